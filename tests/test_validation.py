"""The validation page says what its script computes, and the numbers that others publish are met."""

import importlib.util
import math
import re
from pathlib import Path

import pytest

import rocking

ROOT = Path(__file__).resolve().parents[1]


@pytest.fixture(scope="module")
def script():
    specification = importlib.util.spec_from_file_location("validation", ROOT / "scripts" / "validation.py")
    module = importlib.util.module_from_spec(specification)
    specification.loader.exec_module(module)
    return module


@pytest.mark.parametrize(
    "name", [*(pytest.param(slow, marks=pytest.mark.thorough) for slow in ("pulses", "blocks")), "half-sine", "free"]
)
def test_the_quick_tables_of_the_page_are_those_that_the_script_makes(script, name):
    assert len(script.QUICK) == 4
    file = f"validation-{name}.txt"
    assert (script.TABLES / file).read_text("utf-8") == script.QUICK[file]()


def test_the_amplitudes_of_the_other_program_are_met_within_its_bound(script):
    rows = (script.TABLES / "validation-blocks.txt").read_text("utf-8").splitlines()[2:]
    assert len(rows) == len(script.OTHERS) == 4
    for row, (radius, theirs) in zip(rows, script.OTHERS.items(), strict=True):
        assert row.startswith(f"| {radius:g} | {theirs:.5f} |") and row.endswith("| yes |")
        block = rocking.Block(half_width=radius * math.sin(0.2), half_height=radius * math.cos(0.2))
        for sign in (-1.0, 1.0):
            level = theirs + sign * script.OTHERS_ERROR
            pulse = rocking.pulses.one_sine(level * block.minimum_acceleration, 2.0)
            assert rocking.simulate(block, pulse).overturned is (sign > 0.0)


@pytest.mark.thorough
@pytest.mark.parametrize("number", [pytest.param(0, marks=pytest.mark.thorough), 1])
def test_the_frequency_limits_of_overturning_with_impact_are_those_of_dop853(script, number):
    rows = (script.TABLES / "validation-limits.txt").read_text("utf-8").splitlines()[2:]
    assert len(rows) == len(script.LIMITS) == 2
    alpha, eta, printed, frequency, amplitude = script.LIMITS[number]
    cells = [cell.strip() for cell in rows[number].strip("|").split("|")]
    limit, at = script.scipy_limit(alpha, eta, frequency, amplitude)
    assert cells[3] == cells[4] == f"{limit:.5f}"
    block = rocking.Block.from_parameters(p=1.0, alpha=alpha, restitution=eta)
    for excess, falls in ((-1e-5, True), (1e-5, False), (printed - limit, False)):
        w = limit + excess
        best = script.best_margin(alpha, eta, w, (at - 0.5, at + 2.0))[1]
        pulse = rocking.pulses.one_sine(best * block.minimum_acceleration, w / (2.0 * 3.141592653589793))
        assert rocking.simulate(block, pulse).overturned is falls


def test_every_kind_of_body_is_judged_and_none_differs():
    from oracles.standing import KINDS

    rows = (ROOT / "docs" / "_tables" / "validation-standing.txt").read_text("utf-8").splitlines()[2:]
    cells = [[cell.strip() for cell in row.strip("|").split("|")] for row in rows]
    assert [row[0] for row in cells] == [*KINDS]
    for kind, cases, impacts, _, same, ill, worst in cells:
        assert int(cases) >= 200 and int(impacts) >= 1000, kind
        assert int(same) + int(ill) == int(cases) and int(ill) <= 10, kind
        assert float(worst.removeprefix("below ")) <= 1e-8, kind


def test_every_table_of_the_page_exists():
    text = (ROOT / "docs" / "validation.md").read_text("utf-8")
    names = re.findall(r"^```\{include\} (\S+)$", text, re.MULTILINE)
    assert len(names) >= 7
    for name in names:
        assert (ROOT / "docs" / name).is_file()
