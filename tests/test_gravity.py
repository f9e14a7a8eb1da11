"""Under four times the gravity a body four times as large does the same under four times the motion."""

import numpy as np
import pytest

import rocking
from rocking import Blocks, Damper, Load, RestrainedBlock, Spring, Tendon, Thrust, rules

G = 9.80665
K = 4.0

BODIES = {
    "free": lambda k: (),
    "tendon": lambda k: (Tendon(3e4, prestress=2e3 * k, offset=0.1 * k),),
    "yielding tendon": lambda k: (Tendon(1e5, prestress=1e3 * k, strength=2.5e3 * k),),
    "spring": lambda k: (Spring(4e3 * k * k),),
    "damper": lambda k: (Damper(3e3 * k * k),),
    "thrust": lambda k: (Thrust(900.0 * k, height=3.0 * k),),
    "load": lambda k: (Load(400.0, 3.0 * k, offset=0.1 * k, moves_with_block=False),),
    "load that follows": lambda k: (Load(400.0, 3.0 * k, offset=0.1 * k),),
}


def motion_of(k, vertical=True):
    motion = rocking.pulses.sine(3.6 * k, 0.9, cycles=2)
    return motion.with_vertical(rocking.pulses.sine(2.0 * k, 1.7, cycles=2)) if vertical else motion


def body_of(name, k):
    block = rocking.Block.from_pivots(
        (1.2 * k, 1.0 * k), 3.5 * k, 2.3 * k, mass=2e3, restitution=(0.8, 0.75), gravity=k * G
    )
    return RestrainedBlock(block, *BODIES[name](k)) if BODIES[name](k) else block


@pytest.mark.parametrize("name", BODIES)
@pytest.mark.parametrize("model", ["linear", "nonlinear"])
def test_a_response_under_more_gravity_is_the_same(name, model):
    one, other = (rocking.simulate(body_of(name, k), motion_of(k), model=model) for k in (1.0, K))
    assert len(one.impacts) >= 3 and not one.ambiguous
    close = {"rel": 1e-9, "abs": 1e-12}
    times = np.linspace(0.0, min(one.duration, other.duration), 41)[:-1] + 1e-4
    histories = ["rotation", "angular_velocity", "angular_acceleration", "normal_force", "friction_demand"]
    histories += [] if name == "yielding tendon" else ["kinetic_energy", "potential_energy"]
    for history in histories:
        assert getattr(one, history)(times) == pytest.approx(getattr(other, history)(times), **close), history
    for number in ("peak_rotation", "required_friction", "minimum_normal_force", "duration"):
        assert getattr(one, number) == pytest.approx(getattr(other, number), **close), number
    assert one.balance == pytest.approx(other.balance, **close)
    lifting = (each.block.uplift_thresholds(model) for each in (one, other))
    assert K * np.array(next(lifting)) == pytest.approx(np.array(next(lifting)), **close)
    assert one.sensitivity.peak["motion"] == pytest.approx(other.sensitivity.peak["motion"], rel=1e-7)
    for of, at in (("peak", None), ("impact", 1), ("rotation", 1.0)):
        first, second = (rocking.gradient(each, of, at) for each in (one, other))
        assert first.coefficients == pytest.approx(K * second.coefficients, rel=1e-6, abs=1e-9)
        assert first.vertical == pytest.approx(K * second.vertical, rel=1e-6, abs=1e-9)


@pytest.mark.parametrize("name", rules.RULES)
def test_a_rule_compares_the_same_under_more_gravity(name):
    ratios = [
        rules.RULES[name](
            Blocks([[2.0, 2.0], [2.5, 3.0], [0.3, 0.3]], [[0.2, 0.2], [0.3, 0.2], [0.2, 0.2]], 0.85, gravity=k * G),
            motion_of(k, False),
        ).ratio
        for k in (1.0, K)
    ]
    assert ratios[0] == pytest.approx(ratios[1], rel=1e-9)


def blocks_of(k):
    return Blocks.grid(p=[1.5, 3.0], alpha=[0.15, 0.25], restitution=[0.9], gravity=k * G)


#: An analysis under so many times the gravity, and what of it is the same.
ANALYSES = {
    "ensemble": lambda k: rocking.simulate_many(
        blocks_of(k), motion_of(k), levels=[2.0 * k, 4.0 * k], measure="pga"
    ).peak_rotation.values,
    "spectrum by p": lambda k: rocking.rocking_spectrum(
        blocks_of(k).select(slice(0, 2)), motion_of(k), p=[1.0, 2.0]
    ).data.peak_rotation.values,
    "spectrum by size": lambda k: rocking.rocking_spectrum(
        blocks_of(k).select(slice(0, 2)), motion_of(k), size=[k, 4.0 * k]
    ).data.peak_rotation.values,
    "overturning map": lambda k: rocking.overturning_map(
        rocking.Block.from_parameters(2.0, 0.2, 0.9, gravity=k * G),
        "sine", cycles=1, amplitudes=[1.5, 3.0, 6.0], frequencies=[1.0, 2.0], rtol=1e-4,
    ).data.mode.values,
    "incremental": lambda k: rocking.incremental_dynamic_analysis(
        blocks_of(k), motion_of(k), measure="pgv_ratio", rtol=1e-3
    ).bands(block=1),
    "critical scale": lambda k: rocking.critical_scale(
        rocking.Block.from_parameters(2.0, 0.2, 0.9, gravity=k * G), motion_of(k), bounds=(0.1, 9.0)
    ).scale,
    "sizes of spectrum": lambda k: rocking.rocking_spectrum(blocks_of(k), motion_of(k)).data["size"].values / k,
}  # fmt: skip


@pytest.mark.parametrize("name", ANALYSES)
def test_an_analysis_is_the_same_under_more_gravity(name):
    one, other = (np.asarray(ANALYSES[name](k), dtype=float) for k in (1.0, K))
    assert one.size and np.any(one != 0.0)
    np.testing.assert_allclose(one, other, rtol=1e-6, atol=1e-12)


@pytest.mark.parametrize("name", ["pga_ratio", "pgv_ratio"])
@pytest.mark.parametrize("model", ["linear", "nonlinear"])
def test_a_level_in_the_unit_of_a_block_lifts_it_under_more_gravity(name, model):
    block = rocking.Block.from_parameters((2.0, 2.5), (0.2, 0.3), 0.9, gravity=K * G)
    lifting = K * G * (0.2 if model == "linear" else np.tan(0.2))
    motion = motion_of(1.0, False)
    per_unit = lifting / motion.pga if name == "pga_ratio" else lifting / (2.0 * motion.pgv)
    levels = [0.9, 1.1, 1.3, 2.0]
    found = rocking.incremental_dynamic_analysis(block, motion, measure=name, levels=levels, model=model)
    same = [rocking.simulate(block, motion * (per_unit * each), model=model).peak_rotation for each in levels]
    assert found.data.peak_rotation.values.ravel() == pytest.approx(same, rel=1e-6, abs=1e-12)


@pytest.mark.parametrize("model", ["linear", "nonlinear"])
@pytest.mark.parametrize("k", [1.0, K])
def test_a_figure_has_the_thresholds_of_both_sides_under_the_weight_of_the_moment(k, model):
    response = rocking.simulate(body_of("free", k), motion_of(k), model=model)
    lines = [line for line in response.plot().axes[1].lines if line.get_label() == "uplift thresholds"]
    for line, side, sign in zip(lines, response.block.sides, (-1.0, 1.0), strict=True):
        own = side.alpha if model == "linear" else np.tan(side.alpha)
        weight = 1.0 + response.motion.vertical.acceleration(line.get_xdata()) / (k * G)
        assert sign * line.get_ydata() == pytest.approx(k * own * weight, rel=1e-12)
