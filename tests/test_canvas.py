"""Who knows of a figure: nobody where nobody can look at it, pyplot and notebooks where somebody can."""

import sys
from concurrent.futures import ThreadPoolExecutor

import pytest
from matplotlib.figure import Figure

from rocking.errors import OptionError

DRAW = """
import sys
import numpy as np
from rocking.plot.maps import draw_regions

def draw(**options):
    return draw_regions(
        x=np.array([1.0, 2.0]), y_range=(0.0, 3.0), edges=[np.array([1.0]), np.array([2.0])],
        regions=[[-3, 0], [-3, 0]], names={-3: "stays", 0: "overturns"}, x_label="x", y_label="y", **options)
"""


def test_pyplot_knows_the_figures_of_those_who_use_it_and_is_not_loaded_for_others(monkeypatch):
    monkeypatch.delitem(sys.modules, "matplotlib.pyplot", raising=False)
    drawn()
    assert "matplotlib.pyplot" not in sys.modules
    import matplotlib.pyplot as plt

    assert plt.get_backend() == "agg"
    assert [drawn().number] == plt.get_fignums()


def test_pyplot_knows_nothing_of_a_figure_of_another_thread():
    """Windows belong to the main thread; a server draws in others."""
    import matplotlib.pyplot as plt

    with ThreadPoolExecutor(1) as pool:
        pool.submit(drawn).result()
    assert plt.get_fignums() == []


def images(*cells: str) -> list[int]:
    """Number of images that each cell of a notebook shows."""
    import nbformat
    from nbclient import NotebookClient

    notebook = nbformat.v4.new_notebook(cells=[nbformat.v4.new_code_cell(cell) for cell in (DRAW, *cells)])
    NotebookClient(notebook, timeout=120, kernel_name="python3").execute()
    return [sum("image/png" in output.get("data", {}) for output in cell.outputs) for cell in notebook.cells[1:]]


@pytest.mark.slow
def test_a_notebook_shows_a_figure_once_and_so_one_in_axes_of_the_caller(monkeypatch):
    monkeypatch.delenv("MPLBACKEND", raising=False)
    # The package loads pyplot here, and a notebook's choices stay.
    drawn = ["draw()", "figure = draw()", "figure", "import matplotlib.pyplot as plt\ndraw(); draw()"]
    own = "figure, ax = plt.subplots()\n"
    given = [
        f"{own}draw(ax=ax)",
        f"{own}drawn = draw(ax=ax)",
        f"{own}draw(ax=ax)\nplt.show()",
        f"{own}draw(ax=ax)\nax.set_title('mine');",
        "figure",
        "import copy\nimport pickle",
        f"{own}draw(ax=ax)\ncopies = pickle.loads(pickle.dumps(figure)), copy.deepcopy(figure)\nplt.close('all')",
    ]
    assert images(*drawn, *given) == [1, 0, 1, 1, *(1, 1, 1, 1, 1, 0, 0)]


@pytest.mark.parametrize("size", [(3.0,), (3.0, 2.0, 1.0), (3.0, 0.0), (3.0, float("nan")), "wide", (), 0, ""])
def test_a_figure_of_no_size_is_refused(size):
    with pytest.raises(OptionError, match="figsize must be"):
        drawn(figsize=size)


def drawn(**options) -> Figure:
    scope: dict = {}
    exec(DRAW, scope)
    return scope["draw"](**options)


def test_axes_of_the_caller_keep_their_figure_and_its_style():
    figure = Figure()
    ax = figure.subplots()
    size = ax.xaxis.label.get_size()
    assert drawn(ax=ax, title="A map") is figure
    assert figure.axes == [ax]
    assert not figure.legends
    assert ax.get_title() == "A map"
    assert ax.xaxis.label.get_size() == size
    part = Figure().subfigures()
    assert drawn(ax=part.subplots()) is part.figure
