"""The tests of a change are found: for every module some, and first those that are about it."""

import subprocess
import sys

import of_changes
import pytest
from of_changes import ROOT, FilesOfTests, changed, ordered

SOURCES = sorted((ROOT / "src" / "rocking").rglob("*.py"))


@pytest.fixture(scope="module")
def tests():
    return FilesOfTests()


@pytest.mark.thorough
def test_every_module_has_tests_and_they_are_near(tests):
    assert len(SOURCES) > 150
    for source in SOURCES:
        found = tests.of(source)
        assert found, f"no file of tests is known for {source}: name it in one, or import it there"
        assert min(found.values()) < (3, 0), source
        assert all(path.is_file() and path.name.startswith("test_") for path in found)


# A case of a module has every file read; `test_of_few_files_the_nearest_come_first` reads few.
OF_MODULES = [
    ("src/rocking/kernels/march.py", "kernels_march"),
    ("src/rocking/kernels/lanes.py", "kernels_lanes"),
    ("src/rocking/studies/refine.py", "study_refine"),
    ("src/rocking/analysis/calibration/search.py", "calibration"),
    ("src/rocking/analysis/spectrum.py", "spectrum"),
    ("src/rocking/motion/__init__.pyi", "motion"),
    ("src/rocking/cli/analysis.py", "cli_analysis"),
    ("src/rocking/explorer/server.py", "explorer_server"),
    ("tests/oracles/balls.py", "certificate"),
]


@pytest.mark.parametrize(
    ("change", "first"),
    [
        *(pytest.param(*each, marks=pytest.mark.thorough) for each in OF_MODULES),
        ("src/rocking/explorer/page/map.js", "explorer_server"),
        ("tests/test_vertical.py", "vertical"),
        ("scripts/validation.py", "validation"),
        ("docs/howto/notebook.md", "notebook"),
        ("docs/api/index.md", "docs"),
    ],
)
def test_what_is_about_a_file_comes_first(tests, change, first):
    found = ordered([tests.of(ROOT / change)])
    assert found[0] == ROOT / "tests" / f"test_{first}.py"


@pytest.mark.thorough
def test_of_several_changes_each_file_of_tests_has_its_nearest_place(tests):
    far, near = tests.of(ROOT / "src/rocking/simulation.py"), tests.of(ROOT / "src/rocking/kernels/march.py")
    both = ordered([far, near])
    assert len(both) == len(set(both)) == len({*far, *near}) > len(near)
    assert both[0] == ordered([near])[0]


@pytest.fixture
def few(tmp_path):
    for name, text in {
        "src/rocking/__init__.py": "",
        "src/rocking/__init__.pyi": "from .studies.refine import refined",
        "src/rocking/alone.py": "",
        "src/rocking/used.py": "from rocking import far",
        "src/rocking/far.py": "",
        "src/rocking/studies/refine.py": "",
        "tests/helper.py": "import rocking.used as used",
        "tests/test_other.py": "import rocking, helper\nrocking.refined()",
        "tests/test_study_refine.py": "",
        "tests/test_this.py": "from helper import used",
    }.items():
        (tmp_path / name).parent.mkdir(parents=True, exist_ok=True)
        (tmp_path / name).write_text(text, "utf-8")
    return FilesOfTests(tmp_path)


def test_a_module_that_no_test_reaches_and_no_name_tells_of_has_none(few):
    other, _, this = few.files
    assert few.of(few.root / "src/rocking/alone.py") == {}
    assert few.of(few.root / "src/rocking/used.py") == {this: (2, 1), other: (2, 3)}
    assert few.of(few.root / "src/rocking/far.py") == {this: (3, 1), other: (3, 3)}


def test_of_few_files_the_nearest_come_first(few):
    other, refine, this = few.files
    near, far = (few.of(few.root / f"src/rocking/{name}.py") for name in ("studies/refine", "used"))
    assert near == {refine: (1, 0), other: (1, 3)}
    assert ordered([far]) == [this, other]
    assert ordered([far, near]) == ordered([near, far]) == [refine, other, this]


def test_a_change_is_staged_unstaged_untracked_or_since_a_commit(tmp_path):
    def git(*arguments):
        identity = ["-c", "user.name=A", "-c", "user.email=a@example.org", "-c", "commit.gpgsign=false"]
        subprocess.run(["git", *identity, *arguments], cwd=tmp_path, check=True, capture_output=True)

    def write(name):
        (tmp_path / name).write_text(name, "utf-8")
        return tmp_path / name

    git("init", "-q")
    (tmp_path / ".gitignore").write_text("ignored\n", "utf-8")
    for name in ("kept", "gone", "edited", "staged"):
        (tmp_path / name).touch()
    git("add", ".")
    git("commit", "-qm", "first")
    committed = write("committed then")
    git("add", ".")
    git("commit", "-qm", "second")
    expected = [write("edited"), write("staged"), write("ñew")]
    write("ignored")
    git("add", "staged")
    (tmp_path / "gone").unlink()
    assert changed(root=tmp_path) == sorted(expected)
    assert changed("HEAD~1", tmp_path) == sorted([*expected, committed])


@pytest.mark.parametrize("status", [0, 1])
@pytest.mark.parametrize(("most", "ran", "left"), [(1, 1, 2), (2, 2, 1), (9, 3, 0)])
def test_the_nearest_files_are_run_and_the_last_line_says_which_were_not(
    few, capfd, monkeypatch, status, most, ran, left
):
    edited = [few.root / name for name in ("tests/test_this.py", "src/rocking/studies/refine.py", "src/rocking/far.py")]
    for name, value in {"ROOT": few.root, "MOST": most, "FilesOfTests": lambda: few}.items():
        monkeypatch.setattr(of_changes, name, value)
    monkeypatch.setattr(of_changes, "changed", lambda commit: edited)
    command = [sys.executable, "-c", f"import sys; print('ran', len(sys.argv) - 1); sys.exit({status})"]
    monkeypatch.setattr(sys, "argv", ["of_changes.py", "HEAD", *command])
    assert of_changes.main() == status
    out, err = capfd.readouterr()
    nearest = ["tests/test_this.py", "tests/test_study_refine.py", "tests/test_other.py"]
    assert out.split() == [*nearest[:most], "ran", f"{ran}"]
    assert err.startswith(f"NOT ALL TESTS WERE RUN: {left} ") if left else not err


def test_a_file_that_no_test_judges_is_named_last(few, capfd, monkeypatch):
    for name, value in {"ROOT": few.root, "FilesOfTests": lambda: few}.items():
        monkeypatch.setattr(of_changes, name, value)
    monkeypatch.setattr(of_changes, "changed", lambda commit: [few.root / "src/rocking/alone.py"])
    monkeypatch.setattr(sys, "argv", ["of_changes.py", "HEAD"])
    assert of_changes.main() == 0
    assert capfd.readouterr().err == "NO TEST IS KNOWN for src/rocking/alone.py\n"
