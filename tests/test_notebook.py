"""The page of tasks in a notebook runs in one, and what should appear appears."""

import re
from pathlib import Path

import pytest

# Each task of the page runs in one notebook, which takes half a minute. What a notebook shows of a figure is held by
# tests/test_canvas.py, and what a result shows of itself by tests/test_reprs.py.
pytestmark = pytest.mark.slow

PAGE = Path(__file__).resolve().parents[1] / "docs" / "howto" / "command-line.md"
CELL = re.compile(r"^```python\n(.*?)^```", re.DOTALL | re.MULTILINE)


@pytest.fixture(scope="module")
def cells(tmp_path_factory):
    import nbformat
    from nbclient import NotebookClient

    sources = [match[1].rstrip("\n") for match in CELL.finditer(PAGE.read_text("utf-8"))]
    notebook = nbformat.v4.new_notebook(cells=[nbformat.v4.new_code_cell(source) for source in sources])
    folder = tmp_path_factory.mktemp("notebook")
    with pytest.MonkeyPatch.context() as patched:
        for name in ("DISPLAY", "WAYLAND_DISPLAY", "MPLBACKEND"):
            patched.delenv(name, raising=False)
        NotebookClient(notebook, timeout=300, resources={"metadata": {"path": str(folder)}}).execute()
    return notebook.cells


def test_every_figure_appears_once(cells):
    drawn = [cell for cell in cells if re.search(r"\.plot\(.*\)$", cell.source)]
    assert len(drawn) >= 7
    for cell in drawn:
        images = [output for output in cell.outputs if "image/png" in output.get("data", {})]
        assert len(images) == 1, cell.source


def test_no_cell_warns_or_prints_to_stderr(cells):
    for cell in cells:
        assert not [output for output in cell.outputs if output.get("name") == "stderr"], cell.source
    assert sum(bool(cell.outputs) for cell in cells) >= 10
