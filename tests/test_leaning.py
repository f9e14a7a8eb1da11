"""A block that its restraints hold while it leans: where, how that is known, and that nothing else is taken for it."""

import math

import numpy as np
import pytest
from scipy.optimize import brentq

import rocking
from rocking import Block, Damper, RestrainedBlock, Spring, Tendon, Thrust

SIZE = {"width": 0.8, "height": 5.0, "mass": 9000.0}
COLUMN = Block(**SIZE)
EXAMPLE = RestrainedBlock(COLUMN, Tendon(2e6, strength=4e4), Damper(5e4))

#: Bodies that lean from 0.22 rad on, with what holds them: two that yield, on one side or the other alone, without
#: damping, under a thrust, with a spring that is not enough by itself.
BODIES = {
    "yields": EXAMPLE,
    "hardly-damped": RestrainedBlock(COLUMN, Tendon(2e6, strength=4e4), Damper(2e3)),
    "overdamped": RestrainedBlock(COLUMN, Tendon(2e6, strength=4e4), Damper(3e6)),
    "undamped": RestrainedBlock(COLUMN, Tendon(2e6, strength=4e4)),
    "offset": RestrainedBlock(COLUMN, Tendon(2e6, strength=4e4, offset=0.02), Damper(5e4)),
    "pushed": RestrainedBlock(COLUMN, Tendon(2e6, strength=4e4), Thrust(100.0, height=4.0), Damper(5e4)),
    "with-spring": RestrainedBlock(COLUMN, Tendon(2e6, strength=4e4), Spring(2e4), Damper(5e4)),
    "one-sided": Block.one_sided(Tendon(2e6, strength=4e4), Damper(5e4), **SIZE),
}


#: Pulses of 0.8 Hz that leave the first and the last but one of them leaning, and one that overturns both.
PULSES = [rocking.pulses.one_sine(a, 0.8).scaled(sign) for a in (3.56, 3.92, 3.96, 6.0) for sign in (1.0, -1.0)]


def leaning(body, model="nonlinear", sign=1.0, **options):
    start = 0.25 if body is BODIES["with-spring"] else 0.22
    return rocking.simulate(body, None, model=model, initial_rotation=sign * start, **options)


def turning(body, response):
    """Return the moment that brings a body back at a rotation from zero, over inertia, written anew."""
    parameters = {name: values[0] for name, (values, _) in body.as_bodies().parameters().items()}
    side = 1 if response.residual_rotation < 0.0 else 0
    of = {name: float(values[side]) for name, values in parameters.items()}
    plastic = float(response.tendons["plastic_elongation"].max(initial=0.0))
    linear = response.model == "linear"

    def moment(u):
        own = (1.0 + of["sine_coefficient"]) * math.sin(of["alpha"] - u) + of["cosine_coefficient"] * math.cos(
            of["alpha"] - u
        )
        if linear:
            own = of["alpha"] - u + of["sine_coefficient"] * (math.sin(of["alpha"]) - math.cos(of["alpha"]) * u)
            own += of["cosine_coefficient"] * (math.cos(of["alpha"]) + math.sin(of["alpha"]) * u)
        stretch = of["lever_arm"] * (u if linear else 2.0 * math.sin(0.5 * u)) - plastic - of["slack_elongation"]
        pull = of["prestress"] + of["tendon_stiffness"] * min(
            max(stretch, 0.0), of["yield_elongation"] - of["slack_elongation"]
        )
        return of["p"] ** 2 * (own + pull * (1.0 if linear else math.cos(0.5 * u)) + of["spring"] * u)

    return moment


def test_the_example_leans_where_tendon_and_weight_are_in_balance():
    response = leaning(EXAMPLE)
    assert response.leans
    assert not (response.overturned or response.unfinished or response.ended_early or response.ambiguous)
    assert response.residual_rotation == pytest.approx(0.1962311436, abs=1e-10)
    assert response.peak_rotation == 0.22
    assert response.duration < 10.0
    assert np.isfinite(response.rotation([0.0, 0.5 * response.duration, response.duration])).all()
    assert "residual rotation   0.19623 rad" in response.summary()
    assert "stays leaning, at 0.19623 rad" in repr(response)
    facts = response.to_dict()
    assert (facts["leans"], facts["residual_rotation_rad"]) == (True, response.residual_rotation)
    dataset = response.to_xarray()
    assert (dataset.leans, dataset.residual_rotation_rad) == (1, response.residual_rotation)


@pytest.mark.parametrize("model", ["nonlinear", "linear"])
@pytest.mark.parametrize("sign", [1.0, -1.0])
@pytest.mark.parametrize("name", BODIES)
def test_a_body_that_leans_does_so_about_a_stable_balance_and_never_leaves_it(name, sign, model):
    body = BODIES[name]
    sign = 1.0 if body.is_one_sided else sign
    response = leaning(body, model, sign)
    assert response.leans
    at, moment = abs(response.residual_rotation), turning(body, response)
    assert math.copysign(1.0, response.residual_rotation) == sign
    assert moment(0.999 * at) < 0.0 < moment(1.001 * at)
    assert brentq(moment, 0.999 * at, 1.001 * at, xtol=1e-14) == pytest.approx(at, rel=1e-9)
    long = leaning(body, model, sign, duration=response.duration + 60.0)
    assert long.ended_early
    assert not long.leans
    assert math.isnan(long.residual_rotation)
    later = sign * long.rotation(np.linspace(response.duration, long.duration, 4001))
    assert len(long.impacts) == len(response.impacts)
    assert 0.0 < later.min() <= at * (1.0 + 1e-9)
    assert later.max() <= response.peak_rotation * (1.0 + 1e-9)
    if name not in ("undamped", "hardly-damped"):
        assert later[-1] == pytest.approx(at, rel=1e-6)


def test_a_spring_holds_a_body_that_leans_far():
    weight = COLUMN.mass * COLUMN.gravity * COLUMN.sides[0].radius
    body = RestrainedBlock(COLUMN, Spring(0.68 * weight), Damper(5e4))
    response = rocking.simulate(body, None, initial_rotation=1.5)
    assert response.leans
    moment = turning(body, response)
    assert brentq(moment, 1.0, 1.55, xtol=1e-14) == pytest.approx(response.residual_rotation, rel=1e-12)


def test_a_body_released_where_it_leans_stays_there():
    body = RestrainedBlock(COLUMN, Spring(0.68 * COLUMN.mass * COLUMN.gravity * COLUMN.sides[0].radius))
    balance = brentq(lambda u: math.sin(COLUMN.alpha - u) + 0.68 * u, 1.0, 1.55, xtol=1e-15)
    for start in (balance, math.nextafter(balance, 2.0), math.nextafter(balance, 0.0)):
        response = rocking.simulate(body, None, initial_rotation=start)
        assert response.leans
        assert response.residual_rotation == pytest.approx(balance, rel=1e-12)
        assert response.peak_rotation == pytest.approx(balance, rel=1e-9)


@pytest.mark.cases(fast=1)
@pytest.mark.parametrize("model", ["nonlinear", "linear"])
def test_only_a_body_below_the_barrier_leans(model):
    """Released without speed where its tendon has just yielded: the climb inwards decides, by an integral."""
    ends = set()
    for strength in np.linspace(3.2e4, 4.6e4, 15):
        body = RestrainedBlock(COLUMN, Tendon(2e6, strength=strength))
        response = leaning(body, model)
        moment = turning(body, leaning(body, model, duration=1e-3))
        if moment(0.22) <= 0.0:
            assert response.overturned
            continue
        at = np.linspace(0.0, 0.22, 100_001)
        energy = np.concatenate([[0.0], np.cumsum([moment(u) for u in 0.5 * (at[1:] + at[:-1])])])
        assert response.leans == (energy[-1] < energy[:-1].max() - 1e-9 * np.ptp(energy))
        assert response.leans == (len(response.impacts) == 0)
        ends.add(response.leans)
    assert ends == {True, False}


def test_an_ensemble_has_the_same_ends_as_single_simulations():
    bodies = [BODIES[name] for name in ("yields", "undamped", "pushed", "with-spring")]
    dataset = rocking.simulate_many(bodies, PULSES)
    single = [[rocking.simulate(body, pulse) for body in bodies] for pulse in PULSES]
    for name in ("leans", "overturned", "unfinished", "ended_early", "peak_rotation", "peak_time", "residual_rotation"):
        np.testing.assert_array_equal(dataset[name].values, [[getattr(one, name) for one in row] for row in single])
    leans, rotation = dataset.leans.values, dataset.residual_rotation.values
    assert leans.sum() == 6
    assert not dataset.unfinished.values.any()
    symmetric = [0, 1, 3]
    np.testing.assert_array_equal(rotation[0::2, symmetric], -rotation[1::2, symmetric])
    assert (rotation[~leans & ~dataset.overturned.values] == 0.0).all()
    assert np.isnan(rotation[dataset.overturned.values]).all()


def test_a_table_and_a_fragility_count_what_leans_as_standing():
    rows = rocking.survey(BODIES["yields"], PULSES).to_dataframe()
    assert rows.leans.tolist() == [True, True, *[False] * 6]
    assert rows.verdict[rows.leans].str.startswith("leans at").all()
    assert rows.residual_rotation_rad[rows.leans].abs().between(0.1, 0.25).all()
    pulses = [PULSES[0], rocking.pulses.one_sine(3.0, 1.1)]
    found = rocking.fragility(BODIES["yields"], pulses, levels=[3.0, 3.56, 4.0, 5.0, 6.0])
    assert (found.curves[0].trial_counts.sum(), found.missing_note) == (10, "")
    assert found.outcomes.overturned.sum() == found.curves[0].exceedance_counts.sum()
    (held,) = found.outcomes.index[(found.outcomes.pga_m_s2 == 3.56) & (found.outcomes.motion == "one-sine #1")]
    assert not found.outcomes.overturned[held]
    assert 0.0 < found.outcomes.peak_over_alpha[held] < 2.0


def test_the_peak_of_a_body_that_leans_has_derivatives():
    found = rocking.simulate(BODIES["yields"], PULSES[0])
    changes = [found.sensitivity.peak[name] for name in ("motion", "p", "alpha", "restitution")]
    assert found.leans and np.isfinite(changes).all()
    h = 1e-6
    peaks = [rocking.simulate(BODIES["yields"], PULSES[0].scaled(1.0 + d)).peak_rotation for d in (-h, h)]
    assert found.sensitivity.peak["motion"][0] == pytest.approx((peaks[1] - peaks[0]) / (2.0 * h), rel=1e-4)
