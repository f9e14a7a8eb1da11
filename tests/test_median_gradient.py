"""The derivatives of a fragility's median and dispersion, against differences of fits and fits to many levels."""

from typing import Any

import numpy as np
import pytest

import rocking
from rocking import Block, InvalidOption, MedianGradient, Motion, Unfitted, fragility, median_gradient
from rocking.analysis.critical import critical_between

GIVEN = {"p": np.array([2.0, 2.2]), "alpha": np.array([0.2, 0.19]), "restitution": np.array([0.9, 0.8])}
STEPS = ({"p": 1.0, "alpha": 0.7, "restitution": -0.5},)
EACH = tuple({name: 1.0} for name in GIVEN)


def sine(frequency: float) -> Motion:
    return Motion.from_samples(np.sin(np.linspace(0.0, 2.0 * np.pi, 13)), 1.0 / (12.0 * frequency))


PULSES = [sine(frequency) for frequency in (0.4, 0.6, 0.9)]


def of(motions: list[Motion], low: float, high: float, levels: int, model: Any, **shares: float) -> MedianGradient:
    changed = {name: tuple(value * (1.0 + shares.get(name, 0.0))) for name, value in GIVEN.items()}
    return median_gradient(Block.from_parameters(**changed), motions, low, high, levels=levels, model=model, threads=1)


def judged_by_differences(
    motions: list[Motion], limits: tuple[float, float], levels: int, model: Any, directions: Any = EACH
) -> int:
    """Judge median and dispersion along changes of the block; returns how many ends of bands they depend on."""
    found = of(motions, *limits, levels, model)
    assert found.reason == ""
    for direction in directions:
        slopes = []
        for h in (1e-3, 5e-4):
            more, less = (
                of(motions, *limits, levels, model, **{name: x * share for name, share in direction.items()})
                for x in (h, -h)
            )
            assert len(more.ends) == len(less.ends) == len(found.ends)
            median, dispersion = more.median - less.median, more.dispersion - less.dispersion
            slopes.append(np.array([median, dispersion]) / (2.0 * h))
        expected = (4.0 * slopes[1] - slopes[0]) / 3.0
        told = [
            sum(share * getattr(found, f"{quantity}_by_{name}") for name, share in direction.items())
            for quantity in ("median", "dispersion")
        ]
        assert told == pytest.approx(expected.tolist(), rel=1e-6, abs=1e-8), direction
    return len(found.ends)


@pytest.mark.parametrize("model", [pytest.param("linear", marks=pytest.mark.slow), "nonlinear"])
def test_median_and_dispersion_change_as_differences_of_fits_say(model: str) -> None:
    assert judged_by_differences(PULSES, (1.5, 2.8), 12, model, STEPS) == 3


@pytest.mark.slow
@pytest.mark.parametrize("model", ["linear", "nonlinear"])
def test_median_and_dispersion_change_so_with_each_parameter(model: str) -> None:
    assert judged_by_differences(PULSES, (1.5, 2.8), 12, model) == 3


@pytest.mark.slow
def test_bands_that_end_count_too() -> None:
    assert judged_by_differences(PULSES[1:], (1.5, 12.0), 300, "nonlinear", STEPS) >= 6


@pytest.mark.parametrize(
    ("counts", "most"),
    [((20, 80), (1e-2, 2e-3)), pytest.param((100, 400), (3e-3, 5e-4), marks=pytest.mark.slow)],
)
def test_fits_to_many_levels_tend_to_that_of_all(counts: tuple[int, int], most: tuple[float, float]) -> None:
    block = Block.from_parameters(**{name: tuple(value) for name, value in GIVEN.items()})
    found = median_gradient(block, PULSES, 1.5, 2.8, levels=30)
    errors = []
    for count in counts:
        curve = fragility(block, PULSES, levels=np.geomspace(1.5, 2.8, count)).curves[0]
        errors.append(max(abs(curve.median / found.median - 1.0), abs(curve.dispersion - found.dispersion)))
    assert errors[0] < most[0]
    assert errors[1] < most[1]


@pytest.mark.slow
def test_a_fit_to_many_levels_changes_as_the_derivative_says() -> None:
    """By 2 % more of the slenderness, which moves the ends of bands over ten of 400 levels."""
    found, share = of(PULSES, 1.5, 2.8, 30, "nonlinear"), 0.02
    medians = []
    for sign in (1.0, -1.0):
        changed = GIVEN | {"alpha": GIVEN["alpha"] * (1.0 + sign * share)}
        block = Block.from_parameters(**{name: tuple(value) for name, value in changed.items()})
        medians.append(fragility(block, PULSES, levels=np.geomspace(1.5, 2.8, 400)).curves[0].median)
    slope = (medians[0] - medians[1]) / (2.0 * share)
    assert found.median_by_alpha == pytest.approx(slope, rel=0.05)


def test_levels_of_the_linear_model_are_in_proportion_to_the_slenderness() -> None:
    found = of(PULSES, 1.5, 2.8, 12, "linear")
    assert found.ends["by_alpha"] == pytest.approx(found.ends["level"].tolist(), rel=1e-9)
    assert found.ends["begins"].all()
    assert "median" in repr(found)


def test_what_no_lognormal_fits_is_said_in_a_sentence() -> None:
    block = Block.from_parameters(p=2.0, alpha=0.2, restitution=0.9)
    with pytest.raises(Unfitted, match="no level overturns the block under every motion: higher levels"):
        median_gradient(block, PULSES, 1.0, 1.5, levels=4)
    with pytest.raises(Unfitted, match="all levels overturn the block under every motion: lower levels"):
        median_gradient(block, PULSES[:1], 2.6, 3.0, levels=4)
    with pytest.raises(Unfitted, match="are separated"):
        median_gradient(block, PULSES[0], 1.5, 3.0, levels=4)
    with pytest.raises(InvalidOption, match=r"low = 3 must be below high = 2"):
        median_gradient(block, PULSES, 3.0, 2.0)
    with pytest.raises(InvalidOption, match="measure must be one of"):
        median_gradient(block, PULSES, 1.0, 2.0, measure="pga_ratio")


def touching() -> tuple[Block, Motion]:
    """Return a block that nothing weighs down for a while: a push, sooner or later, decides whether it lands."""
    lift = Motion([0.0, 2.6, 4.0], [[-2.0 * 9.80665], [0.0]])
    push = Motion([0.0, 0.01, 0.9, 1.1, 2.6, 3.2, 4.0], [[-1e-3], [0.0], [1.0], [0.0], [-3.5], [0.0]])
    return Block.from_parameters(p=3.0, alpha=0.2, restitution=0.5), push.with_vertical(lift)


def test_where_a_touch_decides_on_overturning_a_critical_scale_has_no_derivative() -> None:
    block, motion = touching()

    def response(scale: float) -> rocking.Response:
        return rocking.simulate(block, motion * scale)

    touch = critical_between(response, motion, 0.95, 1.03, falls_above=False)
    assert touch.scale == pytest.approx(0.99996, abs=1e-5)
    assert "without the block coming to the balance point" in touch.gradient.reason
    assert np.all(np.isnan([touch.p, touch.alpha, touch.restitution, *touch.gradient.coefficients.ravel()]))
    balance = rocking.critical_scale(block, motion, 1.03, 1.09)
    assert np.all(np.isfinite([balance.p, balance.alpha, balance.restitution]))


def test_where_a_touch_decides_on_overturning_a_median_has_no_derivative() -> None:
    block, motion = touching()
    found = median_gradient(block, [motion, sine(0.7)], 3.45, 4.5, levels=20)
    assert found.ends["begins"].tolist() == [False, True, True]
    assert np.isnan(found.ends["by_p"]).tolist() == [True, False, False]
    assert np.isnan(found.median_by_p)
    assert "balance point" in found.reason
    assert found.reason in repr(found)
    assert np.isfinite(found.median)
