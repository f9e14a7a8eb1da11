"""A body of another kind than a block, a ball that bounces on a moving table, goes through all above the kernels."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import ClassVar

import numpy as np
import pytest
from kernel_records import one_sided

import rocking
from rocking import InvalidBlock, InvalidMotion, InvalidOption, Motion, checks, dynamics, simulate, simulate_many
from rocking.body import KINDS, Bodies, Body, Coordinate
from rocking.constants import STANDARD_GRAVITY
from rocking.engine import Setup, Task, simulate_each, simulate_tasks
from rocking.kernels import state
from rocking.treatment import Certified, VelocityThreshold

G = 9.81


@dataclass(frozen=True)
class Side:
    restitution: float

    def __str__(self) -> str:
        return f"restitution = {self.restitution:.5g}"


@dataclass(frozen=True)
class Ball:
    e: float
    gravity: float = G
    coordinate: ClassVar[Coordinate] = Coordinate("height", "velocity", "acceleration", "m")
    balance: ClassVar[tuple[float, float]] = (math.inf, math.inf)
    stops: ClassVar[tuple[float, float]] = (0.0, 0.0)
    contact: ClassVar[None] = None

    @property
    def description(self) -> str:
        return "ball on a table"

    @property
    def sides(self) -> tuple[Side]:
        return (Side(self.e),)

    def uplift_thresholds(self, model="nonlinear"):
        return self.gravity, math.inf

    def alone(self) -> Balls:
        return Balls.of([self])


@dataclass(frozen=True, eq=False)
class Balls:
    restitution: np.ndarray
    gravity: float = G
    kind: ClassVar[str] = "balls"
    is_symmetric: ClassVar[bool] = True

    @classmethod
    def of(cls, bodies):
        return cls(np.array([[ball.e, ball.e] for ball in bodies]), bodies[0].gravity)

    def __len__(self):
        return len(self.restitution)

    def __getitem__(self, index):
        return Ball(float(self.restitution[index, 0]), self.gravity)

    def select(self, index):
        return Balls(self.restitution[index], self.gravity)

    @property
    def stops(self):
        return np.zeros((len(self), 2))

    def parameters(self):
        return {"restitution": (self.restitution, "1")}

    def speed_limits(self, share):
        return np.full((len(self), 2), share)

    def kernel_records(self, model, limits):
        checks.one_of(model, "model", InvalidOption, ["linear"])
        made = state.records(len(self), state.BLOCK)
        for k, e in enumerate(self.restitution[:, 0]):
            made[k] = one_sided(0.0, self.gravity, 1.0, e)
        made["limit"] = limits
        return made


BALLS = Balls(np.repeat([[0.3], [0.6], [0.9]], 2, axis=1))


@pytest.fixture(autouse=True)
def known_kind(monkeypatch):
    monkeypatch.setitem(KINDS, Balls.kind, Balls)


def table(amplitude=15.0):
    """A table that throws the ball: it goes down faster than the ball falls."""
    return rocking.pulses.one_sine(amplitude, 2.0)


def test_balls_and_blocks_are_bodies():
    block = rocking.Block(width=0.4, height=2.0)
    for body in (BALLS[0], block):
        assert isinstance(body, Body) and isinstance(body.alone(), Bodies)
        assert not isinstance(body, Bodies) and not isinstance(body.alone(), Body)
    for other in (0.4, "block", rocking.Block, [block]):
        with pytest.raises(InvalidBlock, match="a Block or another body is needed"):
            simulate(other, None)


@pytest.mark.parametrize(
    "simulated",
    [
        lambda body, motion: simulate(body, motion, model="linear", duration=1.0),
        lambda body, motion: simulate_many(body.alone(), motion, model="linear", duration=1.0),
        lambda body, motion: [
            *simulate_tasks(Setup(body.alone(), "linear", Certified(), 1.0), [Task(slice(1), motion)])
        ],
        lambda body, motion: dynamics.simulate(body, motion, duration=1.0),
        lambda body, motion: dynamics.simulate_many(body, motion, duration=1.0),
    ],
    ids=["simulate", "simulate_many", "engine", "dynamics", "dynamics, many"],
)
def test_a_body_on_a_line_takes_no_vertical_component(simulated):
    motion = rocking.pulses.one_sine(2.0, 1.0)
    for body in (dynamics.ImpactOscillator(1.0, 0.8, stop=0.05), dynamics.BouncingBall(0.5)):
        simulated(body, motion)
        with pytest.raises(InvalidMotion, match=f"this {body.description} moves along one line"):
            simulated(body, motion.with_vertical(rocking.pulses.one_sine(5.0, 1.0)))


@pytest.mark.parametrize("e", [0.3, 0.9])
def test_a_ball_that_falls_stops_bouncing_at_zenos_time(e):
    u = 0.2
    found = simulate(Ball(e), None, model="linear", initial_rotation=u)
    first = math.sqrt(2.0 * u / G)
    rest = first * (1.0 + 2.0 * e / (1.0 - e))
    assert found.impacts["time"][0] == pytest.approx(first, rel=1e-14)
    assert found.events["kind"].tolist() == ["rest"]
    assert found.events["time"][0] == pytest.approx(rest, rel=1e-12)
    assert found.states(0.5 * first) == pytest.approx([u - G * first**2 / 8.0, -0.5 * G * first, -G])
    assert (found.peak_rotation, found.overturned, found.moves_at_end) == (u, False, False)
    # Twice as far off the table, everything takes longer by sqrt(2): half of it for each unit of the initial height.
    assert found.sensitivity.events["initial_rotation"][0] == pytest.approx(0.5 * rest, rel=1e-9)


def test_the_response_of_a_ball_is_told_in_its_own_words():
    found = simulate(BALLS[1], table(), model="linear")
    text, values = found.summary(), found.to_dict()
    assert text.startswith("body                ball on a table\nparameters          restitution = 0.6\n")
    assert f"uplift above        {G / STANDARD_GRAVITY:.4f} g\n" in text and "peak height         " in text
    assert "friction" not in text and "slenderness" not in text
    assert values["peak_height_m"] == found.peak_rotation > 0.0
    assert values["block"] == {"description": "ball on a table", "restitution": [0.6, 0.6], "gravity_m_s2": G}
    assert not {"required_friction", "peak_over_slenderness"} & set(values)
    assert list(found.to_dataframe(dt=0.01).columns) == ["height_m", "velocity_m_s", "ground_acceleration_m_s2"]
    assert found.to_xarray()["height"].attrs["units"] == "m"
    assert "ball on a table under one-sine: moves" in repr(found) and "height (m)" in found._repr_html_()
    figure = found.plot(title="thrown")
    assert [axes.get_ylabel() for axes in figure.axes] == ["height (m)", "ground\nacceleration (g)"]
    assert figure.get_suptitle() == "thrown"
    with pytest.raises(InvalidOption, match="forces of the ground are not known of this body: ball on a table"):
        found.normal_force(0.1)
    with pytest.raises(InvalidOption, match="known of blocks alone"):
        _ = found.block


def test_what_a_ball_cannot_do_is_refused():
    with pytest.raises(InvalidOption, match="model must be one of linear"):
        simulate(Ball(0.5), None)
    with pytest.raises(InvalidOption, match="in front of the body's stop, not"):
        simulate(Ball(0.5), None, model="linear", initial_rotation=-0.1)
    with pytest.raises(InvalidOption, match='chattering "time" is for symmetric blocks'):
        simulate(Ball(0.5), rocking.pulses.sine(15.0, 1.0, cycles=2), model="linear", chattering="time")
    with pytest.raises(InvalidOption, match="never comes to rest"):
        simulate(Ball(1.0), None, model="linear", initial_rotation=0.1)


@pytest.mark.parametrize("how", [Certified(), VelocityThreshold(1e-6)])
def test_the_engine_plays_balls_as_simulate_does(how):
    motions = [table(), rocking.Motion.from_samples(table().acceleration(np.arange(0.0, 0.6, 0.01)), 0.01)]
    judged = 0
    for motion in motions:
        ((task, outcomes),) = simulate_tasks(Setup(BALLS, "linear", how), [Task(slice(0, 3), motion, 1.1)], threads=1)
        assert task.motion is motion
        for ball, outcome in zip(map(BALLS.__getitem__, range(3)), outcomes, strict=True):
            alone = simulate(ball, motion.scaled(1.1), model="linear", chattering=how)
            assert outcome["peak_rotation"] == pytest.approx(alone.peak_rotation, rel=1e-12) and outcome["uplifts"] > 0
            assert outcome["impacts"] == len(alone.impacts)
            assert outcome["last_rest"] == pytest.approx(alone.events["time"][-1], abs=1e-11)
            judged += 1
    assert judged == 6


def test_an_ensemble_of_balls_is_labelled_by_its_parameters():
    result = simulate_many(BALLS, table(), model="linear", levels=[0.5, 1.0])
    assert result.sizes == {"motion": 1, "scale": 2, "block": 3}
    assert result.restitution.values.tolist() == [0.3, 0.6, 0.9]
    assert not np.any(result.peak_rotation.sel(scale=0.5))  # 0.76 g does not lift them
    assert np.all(result.peak_rotation.sel(scale=1.0) > 0.0)
    one = simulate_many(BALLS[2], table(), model="linear")
    assert float(one.peak_rotation[0, 0]) == float(result.peak_rotation[0, 1, 2])
    (found,) = simulate_each(Setup(BALLS, "linear", Certified()), table(), np.ones(3), threads=1)
    assert found[1]["peak_rotation"].tolist() == result.peak_rotation[0, 1].values.tolist()


def test_a_study_of_balls_keeps_its_inputs_and_takes_them_up_again(tmp_path):
    folder = tmp_path / "balls"
    study = rocking.study(folder, BALLS, table(), model="linear", levels=[0.5, 1.0], unit_blocks=512)
    study.run(threads=1)
    again = rocking.study(folder)
    assert isinstance(again.product.bodies, Balls)
    expected = simulate_many(BALLS, table(), model="linear", levels=[0.5, 1.0])
    assert again.results().peak_rotation.values.tolist() == expected.peak_rotation.values.tolist()


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
    (sequence,) = response.chattering
    others = response.impacts["time"][response.impacts["side"] != response.impacts["side"][-1]]
    assert len(others) > 5 and sequence["start"] > others.max()


def test_ensembles_of_other_bodies_name_their_own_coordinate():
    ball, block = dynamics.BouncingBall(0.6), rocking.Block.from_parameters(p=2.0, alpha=0.2, restitution=0.9)
    motion = rocking.pulses.sine(15.0, 3.0, cycles=4)
    found = rocking.simulate_many(ball, motion, model="linear")
    assert found.peak_rotation.attrs == {"units": "m", "long_name": "largest position in size"}
    own = dynamics.simulate_many(ball, motion).peak_position
    assert float(found.peak_rotation.max()) == float(own.max()) > 0.0
    assert rocking.simulate_many(block, motion).peak_rotation.attrs["units"] == "rad"
