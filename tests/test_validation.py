"""The validation page says what 'scripts/validation.py' computes, and the numbers that others publish are met."""

import math
from pathlib import Path

import validation

import rocking

ROOT = Path(__file__).resolve().parents[1]


def test_the_amplitudes_of_the_other_program_are_met_within_its_bound():
    rows = (ROOT / "docs" / "_tables" / "validation-blocks.txt").read_text("utf-8").splitlines()[2:]
    assert len(rows) == len(validation.OTHERS) == 4
    for row, (radius, theirs) in zip(rows, validation.OTHERS.items(), strict=True):
        assert row.startswith(f"| {radius:g} | {theirs:.5f} |") and row.endswith("| yes |")
        block = rocking.Block(half_width=radius * math.sin(0.2), half_height=radius * math.cos(0.2))
        for sign in (-1.0, 1.0):
            level = theirs + sign * validation.OTHERS_ERROR
            pulse = rocking.pulses.one_sine(level * min(block.uplift_thresholds()), 2.0)
            assert rocking.simulate(block, pulse).overturned is (sign > 0.0)


def test_every_kind_of_body_is_judged_and_none_differs():
    from oracles.standing import KINDS

    rows = (ROOT / "docs" / "_tables" / "validation-standing.txt").read_text("utf-8").splitlines()[2:]
    cells = [[cell.strip() for cell in row.strip("|").split("|")] for row in rows]
    assert [row[0] for row in cells] == [*KINDS]
    for kind, cases, impacts, _, same, ill, worst in cells:
        assert int(cases) >= 200 and int(impacts) >= 1000, kind
        assert int(same) + int(ill) == int(cases) and int(ill) <= 10, kind
        assert float(worst.removeprefix("below ")) <= 1e-8, kind
