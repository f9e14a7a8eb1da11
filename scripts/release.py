"""Say what a release still lacks: one version, its part of the changelog, no placeholder; or print its notes.

python scripts/release.py lacks            # of the version that pyproject.toml states
python scripts/release.py lacks v0.1.0     # of that tag, as the workflow of releases asks
python scripts/release.py notes v0.1.0     # the part of CHANGELOG.md on it
"""

import argparse
import re
import sys
import tomllib
from collections.abc import Iterator
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent


def lacking(root: Path, tag: str | None = None) -> Iterator[str]:
    """Give a sentence for each thing that is missing."""
    project = tomllib.loads((root / "pyproject.toml").read_text("utf-8"))["project"]
    citation, changelog = ((root / name).read_text("utf-8") for name in ("CITATION.cff", "CHANGELOG.md"))
    version = project["version"]
    if tag not in (None, f"v{version}"):
        yield f"the tag is {tag}, but pyproject.toml states the version {version}"
    if f"version: {version}\n" not in citation:
        yield f"CITATION.cff states another version than {version}"
    released = re.search(rf"^## \[{re.escape(version)}\] - (\d{{4}}-\d\d-\d\d)$", changelog, re.MULTILINE)
    if released is None:
        yield f"CHANGELOG.md has no heading '## [{version}] - YEAR-MONTH-DAY'"
    elif f"date-released: {released[1]}\n" not in citation:
        yield f"CITATION.cff lacks 'date-released: {released[1]}', the date in CHANGELOG.md"
    if any("example.org" in address for address in project["urls"].values()):
        yield "[project.urls] in pyproject.toml has the reserved address in place of the project's own"
    if "as listed in the article" in citation:
        yield "CITATION.cff lacks the authors, the journal, the year and the DOI of the article that it refers to"


def notes(root: Path, tag: str) -> str:
    """Return what the changelog says of a version, or an empty text."""
    parts = re.split(r"^## \[(.+?)\].*$", (root / "CHANGELOG.md").read_text("utf-8"), flags=re.MULTILINE)
    return dict(zip(parts[1::2], parts[2::2], strict=True)).get(tag.removeprefix("v"), "").strip()


def main() -> None:
    """Print what is missing, and fail if anything is; or the notes, and fail if there are none."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("wanted", choices=["lacks", "notes"])
    parser.add_argument("tag", nargs="?", help="by default of the version that pyproject.toml states")
    given = parser.parse_args()
    if given.wanted == "lacks":
        sentences = [*lacking(ROOT, given.tag)]
        print("\n".join(sentences) or "nothing is missing")
        sys.exit(bool(sentences))
    found = notes(ROOT, given.tag or tomllib.loads((ROOT / "pyproject.toml").read_text("utf-8"))["project"]["version"])
    print(found or "CHANGELOG.md says nothing of this version")
    sys.exit(not found)


if __name__ == "__main__":
    main()
