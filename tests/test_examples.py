"""Every example of the gallery ends in the numbers that are written here, draws one figure, and is in the gallery."""

import importlib
import re
import runpy
from pathlib import Path

import numpy as np
import pytest

ROOT = Path(__file__).resolve().parents[1]
EXAMPLES = {path.stem: path for path in (ROOT / "examples").glob("[a-z]*.py")}

#: The names of an example's numbers, and what they are; each is right to the tolerance beside it.
NUMBERS = {
    "bouncing_ball": {"difference": (0.0, 1e-14), "resolved": (4, 0), "similar": ([1.0, 1.0, 1.0, 1.0], 1e-13)},
    # What is found depends on draws; the truth is a slenderness of 0.15.
    "calibration": {"found": (0.15, 0.005), "accuracy": (0.9625, 1e-12), "brier": (0.023, 1e-3)},
    "chaos": {
        "difference": (0.0, 1e-12),
        # Within four standard errors: where a chaotic orbit goes, the last places of a machine's sine decide.
        "largest": (0.36, 0.1),
        "shares": ([0.35056, 0.13208, 0.44417, 0.07319], 1e-3),
        "dimension": (1.617, 5e-3),
    },
    "frame": {"larger": ([1.0, 4 / 3, 13 / 9], 1e-14), "at_one": ([0.286340, 0.358691, 0.393608], 1e-5)},
    "median_gradient": {"median": (2.516337, 1e-6), "difference": (0.0258605, 1e-7)},
    "museum": {"peak": (0.1254, 5e-5), "rests": (6, 0), "bracket": (0.0, 4e-12)},
    "paper": {
        # The exact ones are those of an independent computation with many digits; see tests/test_reference.py.
        "exact": (1.125948, 5e-7),
        "eq65": (1.104240, 5e-7),
        "critical": (1.038016, 5e-7),
        "eq76": (1.037324, 5e-7),
        "rests": ([5, 1], 0),
    },
    "precarious_rock": {
        "median": (1.551084, 1e-5),
        "years": (30_000.0, 500.0),
        "never": (2.39, 5e-3),
        "chance": (0.72, 5e-3),
    },
    "pulse_map": {"difference": (0.0, 1e-8)},
    "restitution_law": {"slope": (0.15115, 1e-5)},
    # Responses to one record are ambiguous: the last place of a machine's sine changes their peaks by 1e-4.
    "sizes": {"exponent": (-0.9367, 5e-4), "largest": ([9.88148, 1.16043], 1e-5)},
    "statue": {"least": (0.2831, 5e-5), "peak": (0.019287, 1e-6)},
    "ten_thousand": {"share": (0.4431, 2e-4), "impacts": (411_943, 200)},
    "threshold": {"false_rests": ([0] * 10 + [8] * 3, 0), "verdicts": ([1, 0], 0)},
}

#: Their laws are held by faster tests, too.
MARKS = {
    **dict.fromkeys(("chaos", "median_gradient", "precarious_rock", "sizes", "ten_thousand"), pytest.mark.thorough),
    **dict.fromkeys(("calibration", "frame", "pulse_map"), pytest.mark.slow),
}


@pytest.mark.parametrize(
    "name", [pytest.param(name, marks=[MARKS[name]] if name in MARKS else []) for name in sorted(NUMBERS)]
)
def test_an_example_ends_in_its_numbers_and_draws_one_figure(name, monkeypatch, capsys):
    plt = importlib.import_module("matplotlib.pyplot")
    monkeypatch.setattr(plt, "show", lambda: None)
    found = runpy.run_path(str(EXAMPLES[name]))
    assert len(plt.get_fignums()) == 1
    assert capsys.readouterr().out
    for number, (value, tolerance) in NUMBERS[name].items():
        assert np.asarray(found[number], dtype=float) == pytest.approx(np.asarray(value), abs=tolerance), number


def test_every_example_has_numbers_and_a_place_in_the_gallery():
    listed = re.findall(
        r'"(\w+)"', "".join(re.findall(r"^GALLERY.*?\]", (ROOT / "docs/conf.py").read_text("utf-8"), re.M | re.S))
    )
    assert sorted(listed) == sorted(EXAMPLES) == sorted(NUMBERS)
