"""Bodies of another kind than blocks go through all above the kernels."""

from __future__ import annotations

import pytest

import rocking
from rocking import Motion, dynamics, simulate, simulate_many
from rocking.block.body import Bodies, Body
from rocking.core.constants import STANDARD_GRAVITY
from rocking.engine.schemes import Certified
from rocking.engine.tasks import Setup, Task, simulate_tasks
from rocking.errors import BlockError, MotionError, OptionError

G = 9.81


BALL = dynamics.BouncingBall(0.6, gravity=G)


def test_balls_and_blocks_are_bodies():
    block = rocking.Block(width=0.4, height=2.0)
    for body in (BALL, block):
        assert isinstance(body, Body) and isinstance(body.as_bodies(), Bodies)
        assert not isinstance(body, Bodies) and not isinstance(body.as_bodies(), Body)
    for other in (0.4, "block", rocking.Block, [block]):
        with pytest.raises(BlockError, match="a Block or another body is required"):
            simulate(other, None)
    with pytest.raises(BlockError, match=r"not a Solid; use solid\.block\(azimuth\)"):
        simulate(rocking.Solid([(1, 0), (0, 1), (-1, -1)], (0, 0, 1), [[1, 0, 0], [0, 1, 0], [0, 0, 1]]), None)


@pytest.mark.parametrize(
    "simulated",
    [
        lambda body, motion: simulate(body, motion, model="linear", duration=1.0),
        lambda body, motion: simulate_many(body.as_bodies(), motion, model="linear", duration=1.0),
        lambda body, motion: [
            *simulate_tasks(Setup(body.as_bodies(), "linear", Certified(), 1.0), [Task(slice(1), motion)])
        ],
        lambda body, motion: dynamics.simulate(body, motion, duration=1.0),
    ],
    ids=["simulate", "simulate_many", "engine", "dynamics"],
)
def test_a_body_on_a_line_takes_no_vertical_component(simulated):
    motion = rocking.pulses.one_sine(2.0, 1.0)
    for body in (dynamics.ImpactOscillator(1.0, 0.8, stop=0.05), dynamics.BouncingBall(0.5)):
        simulated(body, motion)
        with pytest.raises(MotionError, match=f"this {body.description} moves along one line"):
            simulated(body, motion.with_vertical(rocking.pulses.one_sine(5.0, 1.0)))


def test_the_response_of_a_ball_is_told_in_its_own_words():
    found = simulate(BALL, rocking.pulses.one_sine(15.0, 2.0), model="linear")
    text, values = found.summary(), found.to_dict()
    assert text.startswith("body                bouncing ball\nparameters          restitution = 0.6, gravity = 9.81")
    assert f"uplift above        {G / STANDARD_GRAVITY:.4f} g\n" in text and "peak position       " in text
    assert "friction" not in text and "slenderness" not in text
    assert values["peak_position_m"] == found.peak_rotation > 0.0
    assert not {"required_friction", "peak_over_slenderness"} & set(values)
    assert list(found.to_dataframe(dt=0.01).columns) == ["position_m", "velocity_m_s", "ground_acceleration_m_s2"]
    assert found.to_xarray()["position"].attrs["units"] == "m"
    assert [axes.get_ylabel() for axes in found.plot().axes] == ["position (m)", "ground\nacceleration\n(g)"]
    with pytest.raises(OptionError, match="ground forces of this body are unknown: bouncing ball"):
        found.normal_force(0.1)
    assert found.block == BALL


def test_a_rest_that_the_ground_ends_at_once_passes_on_what_shifts_it():
    ball = dynamics.BouncingBall(0.0, gravity=10.0)
    table = Motion.from_samples([-25.0] * 3 + [-22.0] * 3 + [-18.0, -12.0, 0.0, 0.0], 0.1)

    def run(factor=1.0, position=0.01, velocity=-1.0):
        return dynamics.simulate(
            ball, table.scaled(factor), initial_position=position, initial_velocity=velocity, duration=0.55
        )

    response, h = run(), 1e-5
    found = response.sensitivity.rotation(0.5, of=["motion", "initial_rotation", "initial_velocity"])
    expected = {
        "motion": (run(1.0 + h).position(0.5) - run(1.0 - h).position(0.5)) / (2.0 * h),
        "initial_rotation": (
            run(position=0.01 * (1.0 + h)).position(0.5) - run(position=0.01 * (1.0 - h)).position(0.5)
        )
        / (2.0 * h),
        "initial_velocity": (run(velocity=-1.0 - h).position(0.5) - run(velocity=-1.0 + h).position(0.5)) / (2.0 * h),
    }
    for name, value in expected.items():
        assert float(found[name]) == pytest.approx(float(value), rel=1e-6), name


@pytest.mark.parametrize(
    ("block", "rotation"),
    [
        (rocking.Block.from_parameters(p=1.0, alpha=0.2, restitution=0.5), 5e-324),
        (rocking.Block.from_parameters(p=1e-6, alpha=1e-9, restitution=0.5), 1e-308),
    ],
)
def test_a_start_of_next_to_nothing_ends_next_to_at_once(block, rotation):
    response = rocking.simulate(block, None, initial_rotation=rotation)
    assert response.peak_rotation == rotation and response.events["time"][-1] < 1e-130


def test_a_sequence_begins_after_the_last_impact_at_the_other_stop():
    between = dynamics.ImpactOscillator(1.0, 0.9, stop=-1.0, second_stop=1.001)
    response = dynamics.simulate(between, None, initial_position=1.0, initial_velocity=1.0, duration=20.0)
    (sequence,) = response.sequences
    others = response.impacts["time"][response.impacts["side"] != response.impacts["side"][-1]]
    assert len(others) > 5 and sequence["start"] > others.max()


def test_ensembles_of_other_bodies_name_their_own_coordinate():
    ball, block = dynamics.BouncingBall(0.6), rocking.Block.from_parameters(p=2.0, alpha=0.2, restitution=0.9)
    motion = rocking.pulses.sine(15.0, 3.0, cycles=4)
    found = rocking.simulate_many(ball, motion, model="linear")
    assert found.peak_rotation.attrs == {"units": "m", "long_name": "largest position in size"}
    assert float(found.peak_rotation.max()) == dynamics.simulate(ball, motion).peak_position > 0.0
    assert rocking.simulate_many(block, motion).peak_rotation.attrs["units"] == "rad"
