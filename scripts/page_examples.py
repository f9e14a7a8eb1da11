"""Run the examples of pages of the documentation, and keep the images that tutorials draw.

Run ``python scripts/page_examples.py`` from the repository's root (a minute): the code of every page of docs/tutorials
is run in an empty folder, what it prints is compared with what the page says, and the images that it saves are put into
docs/_static/tutorials. So a figure is always that of the code beside it. Other pages may be named to be run.
"""

from __future__ import annotations

import contextlib
import doctest
import re
import shutil
import sys
import tempfile
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
TUTORIALS = ROOT / "docs" / "tutorials"
IMAGES = ROOT / "docs" / "_static" / "tutorials"

EXAMPLE = re.compile(r"^```pycon\n(.*?)^```", re.DOTALL | re.MULTILINE)


def run(page: Path) -> str:
    """Run the examples of a page in the working folder; return a report of those that print something else."""
    text = page.read_text("utf-8")
    examples, end = "", 0
    for match in EXAMPLE.finditer(text):
        # Lines of text become blank lines, so that a failure is reported with its line on the page.
        examples += "\n" * text.count("\n", end, match.start(1)) + match[1]
        end = match.end(1)
    test = doctest.DocTestParser().get_doctest(examples, {}, page.name, str(page), 0)
    report: list[str] = []
    doctest.DocTestRunner(optionflags=doctest.ELLIPSIS, verbose=False).run(test, out=report.append)
    return "".join(report)


def main(names: list[str]) -> None:
    """Run pages, by default all tutorials, and keep the images of these."""
    IMAGES.mkdir(exist_ok=True)
    for page in [Path(name).resolve() for name in names] or sorted(TUTORIALS.glob("*.md")):
        with tempfile.TemporaryDirectory() as folder, contextlib.chdir(folder):
            if report := run(page):
                sys.exit(report)
            saved = sorted(Path(folder).glob("*.png")) if page.parent == TUTORIALS else []
            for image in saved:
                shutil.copy(image, IMAGES / image.name)
        sys.stdout.write(f"{page.name}: {', '.join(image.name for image in saved) or 'runs'}\n")


if __name__ == "__main__":
    main(sys.argv[1:])
