"""Walls, restrained bodies, laws and meshes: ensembles against single simulations, and these against an integration."""

import pytest
from oracles.standing import KINDS, OF_ENSEMBLES, TOLERANCE, lanes_and_single, single_and_integrated

#: Of walls, restraints and laws one each, by what they do to the equation.
FEW = ("wall", "spring and damper", "thrust, load and lean", "yielding tendon", "falling restitution")


@pytest.mark.cases(fast=4, thorough=12)
@pytest.mark.parametrize(
    "pairs", [20, pytest.param(100, marks=pytest.mark.thorough), pytest.param(400, marks=pytest.mark.slow)]
)
@pytest.mark.parametrize("kind", OF_ENSEMBLES)
def test_an_ensemble_of_each_kind_gives_what_single_simulations_give(kind, pairs):
    found = lanes_and_single(kind, 2, pairs, most=20)
    assert found.different == []
    assert found.pairs == pairs
    assert found.worst <= TOLERANCE
    assert found.ambiguous + found.explained <= 0.05 * pairs
    if pairs > 20:
        assert 0.05 * pairs < found.overturned < 0.95 * pairs
        assert found.still < 0.4 * pairs


@pytest.mark.parametrize(
    ("kind", "cases"),
    [
        *((kind, 3) for kind in FEW),
        *(pytest.param(kind, 8, marks=pytest.mark.thorough) for kind in KINDS),
        *(pytest.param(kind, 100, marks=pytest.mark.slow) for kind in KINDS),
    ],
)
def test_each_kind_moves_as_an_integration_of_forces_says(kind, cases):
    found = single_and_integrated(kind, 2, cases)
    assert found.different == []
    assert found.cases == cases
    assert found.ill <= 0.1 * cases
    assert found.peaks >= 0.2 * cases
    assert found.impacts >= cases
