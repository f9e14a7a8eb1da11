"""The validation page says what its script computes, and the numbers that others publish are met."""

import importlib.util
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


@pytest.fixture(scope="module")
def quick(script):
    return script.quick_tables()


def test_the_quick_tables_of_the_page_are_those_that_the_script_makes(script, quick):
    assert {name: (script.TABLES / name).read_text("utf-8") for name in quick} == quick


def test_the_amplitudes_of_the_other_program_are_met_within_its_bound(quick):
    rows = quick["validation-blocks.txt"].splitlines()[2:]
    assert len(rows) == 4
    assert all(row.endswith("| yes |") for row in rows)


def test_the_frequency_limits_of_overturning_with_impact_are_those_of_dop853(script):
    rows = (script.TABLES / "validation-limits.txt").read_text("utf-8").splitlines()[2:]
    for (alpha, eta, printed, frequency, amplitude), row in zip(script.LIMITS, rows, strict=True):
        cells = [cell.strip() for cell in row.strip("|").split("|")]
        limit, at = script.scipy_limit(alpha, eta, frequency, amplitude)
        assert cells[3] == cells[4] == f"{limit:.5f}"
        block = rocking.Block.from_parameters(p=1.0, alpha=alpha, restitution=eta)
        for excess, falls in ((-1e-5, True), (1e-5, False), (printed - limit, False)):
            w = limit + excess
            best = script.best_margin(alpha, eta, w, (at - 0.5, at + 2.0))[1]
            pulse = rocking.pulses.one_sine(best * block.minimum_acceleration, w / (2.0 * 3.141592653589793))
            assert rocking.simulate(block, pulse).overturned is falls


def test_every_table_of_the_page_exists():
    text = (ROOT / "docs" / "validation.md").read_text("utf-8")
    names = re.findall(r"^```\{include\} (\S+)$", text, re.MULTILINE)
    assert len(names) >= 7
    for name in names:
        assert (ROOT / "docs" / name).is_file()
