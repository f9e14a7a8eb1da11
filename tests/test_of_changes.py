"""The tests of a change are found: for every module some, and first those that are about it."""

import pytest
from of_changes import ROOT, FilesOfTests, ordered


@pytest.fixture(scope="module")
def tests():
    return FilesOfTests()


@pytest.mark.parametrize(
    ("change", "first"),
    [
        pytest.param("src/rocking/kernels/march.py", "kernels_march", marks=pytest.mark.thorough),
        ("src/rocking/explorer/page/map.js", "explorer_server"),
        ("tests/test_vertical.py", "vertical"),
        ("docs/api/index.md", "docs"),
    ],
)
def test_what_is_about_a_file_comes_first(tests, change, first):
    assert ordered([tests.of(ROOT / change)])[0] == ROOT / "tests" / f"test_{first}.py"


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


def test_of_few_files_the_nearest_come_first(few):
    other, refine, this = few.files
    near, far = (few.of(few.root / f"src/rocking/{name}.py") for name in ("studies/refine", "used"))
    assert near == {refine: (1, 0), other: (1, 3)}
    assert ordered([far]) == [this, other]
    assert ordered([far, near]) == ordered([near, far]) == [refine, other, this]
