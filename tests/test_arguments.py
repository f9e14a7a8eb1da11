"""A motion or a block that is none is refused, wherever one is taken, and told how it becomes one."""

from functools import cache
from pathlib import Path

import numpy as np
import pytest

import rocking
from rocking import Block, Blocks
from rocking.analysis.survey import survey
from rocking.errors import BlockError, MotionError
from rocking.inputs.pulses import named_pulse

BLOCK = Block(width=0.24, height=1.1)
MOTION = rocking.pulses.one_sine(3.0, 1.0)

TAKES_A_MOTION = {
    "simulate": lambda motion: rocking.simulate(BLOCK, motion),
    "simulate_many": lambda motion: rocking.simulate_many(BLOCK, motion),
    "rocking_spectrum": lambda motion: rocking.rocking_spectrum(rocking.Blocks.grid(alpha=[0.2], p=[2.0]), motion),
    "fragility": lambda motion: rocking.fragility(BLOCK, motion, levels=[1.0, 2.0], measure="pga"),
    "assess": lambda motion: rocking.assess(BLOCK, motion),
    "survey": lambda motion: rocking.survey(BLOCK, motion),
    "incremental_dynamic_analysis": lambda motion: rocking.incremental_dynamic_analysis(BLOCK, motion, measure="pga"),
}


@pytest.mark.parametrize("take", TAKES_A_MOTION)
@pytest.mark.parametrize(
    "motion", [np.array([0.1, -0.2]), [0.1, -0.2, 0.3], 0.3, "ridgecrest-clc-090", "RSN6.AT2", Path("RSN6.AT2"), BLOCK]
)
def test_what_is_no_motion_is_refused_and_told_how_to_become_one(take, motion):
    with pytest.raises(MotionError) as caught:
        TAKES_A_MOTION[take](motion)
    for call in ("rocking.read(file)", "rocking.records.load(name)", "Motion.from_samples(array, dt), in m/s^2 and s"):
        assert call in str(caught.value)
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize("take", [name for name in TAKES_A_MOTION if name != "simulate"])
@pytest.mark.parametrize("motions", [[MOTION, "RSN6.AT2"], [MOTION, None], [[0.1, 0.2]]])
def test_every_one_of_several_motions_is_a_motion(take, motions):
    with pytest.raises(MotionError):
        TAKES_A_MOTION[take](motions)


@pytest.mark.parametrize("take", ["simulate_many", "rocking_spectrum"])
def test_a_mapping_gives_motions_its_names(take):
    take = {
        "simulate_many": lambda motions: rocking.simulate_many(BLOCK, motions),
        "rocking_spectrum": lambda motions: (
            rocking.rocking_spectrum(rocking.Blocks.grid(alpha=[0.2], p=[2.0]), motions).data
        ),
    }[take]
    named, listed = take({"weak": MOTION, "strong": 2.0 * MOTION}), take([MOTION, 2.0 * MOTION])
    assert named.motion.values.tolist() == ["weak", "strong"]
    np.testing.assert_array_equal(named.peak_rotation.values, listed.peak_rotation.values)


TAKES_A_BLOCK = {
    "simulate": lambda block: rocking.simulate(block, MOTION),
    "simulate_many": lambda block: rocking.simulate_many(block, MOTION),
    "fragility": lambda block: rocking.fragility(block, MOTION, levels=[1.0, 2.0], measure="pga"),
    "Blocks.from_bodies": Blocks.from_bodies,
}


@pytest.mark.parametrize("take", TAKES_A_BLOCK)
@pytest.mark.parametrize("block", [(0.2, 1.0), 0.2, "statue", None, MOTION, [BLOCK, 0.2]])
def test_what_is_no_block_is_refused_and_told_how_to_become_one(take, block):
    with pytest.raises(
        BlockError, match=r"a (free )?Block( or another body)? is required, not a .*; create one with Block"
    ):
        TAKES_A_BLOCK[take](block)


def test_blocks_are_gathered_from_one_from_several_and_from_themselves():
    blocks = Blocks.from_bodies([BLOCK, Block(half_width=0.2, half_height=1.0)])
    assert Blocks.from_bodies(blocks) is blocks
    assert Blocks.from_bodies(BLOCK)[0] == Block.from_parameters(BLOCK.p, BLOCK.alpha, BLOCK.restitution)
    with pytest.raises(BlockError, match="select"):
        blocks[0:1]
    with pytest.raises(IndexError):
        blocks[2]


@pytest.mark.parametrize(
    "sizes",
    [
        {},
        {"half_width": 0.1},
        {"width": 0.2},
        {"half_width": 0.1, "height": 1.0},
        {"half_width": 0.1, "half_height": 0.5, "width": 0.2},
        {"half_width": 0.1, "half_height": 0.5, "width": 0.2, "height": 1.0},
    ],
)
def test_half_and_full_sizes_do_not_mix(sizes):
    with pytest.raises(BlockError, match="either half_width and half_height, or width and height"):
        Block(**sizes)


ARRAY = np.array([[1.0, 1.0], [1.0, 1.0]])
SITE = rocking.HazardCurve([0.5, 1.0, 2.0], [0.1, 0.01, 0.001])


@cache
def fitted():
    return rocking.fit_fragility([2.0, 3.0, 4.0, 5.0], [1, 4, 7, 10], trial_counts=10)


@cache
def a_map():
    return rocking.overturning_map(BLOCK, "one-sine", amplitudes=[1.0, 2.0], frequencies=[1.0])


#: Each takes one argument that is often given as something else.
TAKES_ONE_THING = {
    "pulse of a map": lambda value: rocking.overturning_map(BLOCK, value, amplitudes=[2.0], frequencies=[1.0]),
    "block of a map": lambda value: rocking.overturning_map(value, "one-sine", amplitudes=[2.0], frequencies=[1.0]),
    "text of a pulse": named_pulse,
    "name of a shipped record": rocking.records.load,
    "critical amplitude of a treatment": rocking.AsymptoticTime,
    "measure": lambda value: rocking.incremental_dynamic_analysis(BLOCK, MOTION, measure=value),
    "method of a chattering time": lambda value: rocking.chattering.chattering_time(1.03, 2.0, 0.9, method=value),
    "method of a critical amplitude": lambda value: rocking.chattering.critical_amplitude(2.0, 0.9, method=value),
    "lobes": lambda value: rocking.pulses.n_lobe([1.0, 2.0], 1.0, lobes=value),
    "kind of a Ricker pulse": lambda value: rocking.pulses.ricker(1.0, 1.0, kind=value),
    "motions of a survey": lambda value: survey(BLOCK, value),
    "motions of a check": lambda value: rocking.rules.compare_rules(BLOCK, value),
    "rules": lambda value: rocking.rules.apply_rules(BLOCK, MOTION, value),
    "rules of a check": lambda value: rocking.rules.compare_rules(BLOCK, {"one": MOTION}, rules=value),
    "parameters of a map": lambda value: rocking.chattering.chattering_map(lambda a, b: None, value),
    "response of episodes": rocking.chattering.chattering_episodes,
    "slenderness": rocking.block.sides.housner_restitution,
    "label of a part": lambda value: a_map().select(frequency=value),
    "limit_states": lambda value: rocking.fragility(BLOCK, [MOTION], limit_states=value),
    "polarity": lambda value: rocking.fragility(BLOCK, [MOTION], polarity=value),
    "polarity of an ensemble": lambda value: rocking.simulate_many(BLOCK, MOTION, polarity=value),
    "confidence": lambda value: rocking.fit_fragility([2.0, 3.0], [1, 2], trial_counts=3, confidence=value),
    "hazard curve": lambda value: fitted().annual_rate(value),
    "limit state": lambda value: fitted().curve(value),
    "intensity of a probability": lambda value: fitted().curves[0].probability(value),
    "intensity of a band": lambda value: fitted().curves[0].band(value)[0],
    "intensity of a rate": SITE.rate_of,
    "chosen blocks": Blocks.from_bodies(BLOCK).select,
    "file of a fragility": lambda value: fitted().to_csv(value),
    "NRML file": lambda value: fitted().to_nrml(value),
    "NRML taxonomy": lambda value: fitted().to_nrml("unwritten.xml", taxonomy=value),
    "file of a response": lambda value: rocking.simulate(BLOCK, None, initial_rotation=0.1).to_csv(value),
    "file of histories": lambda value: rocking.simulate(BLOCK, None, initial_rotation=0.1).to_netcdf(value),
    "file of a hazard curve": rocking.HazardCurve.read,
}

#: Where an empty list asks for nothing, and gets it.
TAKES_NONE_AT_ALL = {
    "intensity of a probability", "intensity of a band", "intensity of a rate", "chosen blocks", "rules",
    "rules of a check", "label of a part",
}  # fmt: skip


@pytest.mark.parametrize("take", TAKES_ONE_THING)
@pytest.mark.parametrize("value", [[], {}, ARRAY * -1.0, object(), 1 + 2j], ids=lambda value: type(value).__name__)
def test_what_is_not_that_thing_is_refused_in_one_sentence(take, value):
    if isinstance(value, list) and take in TAKES_NONE_AT_ALL:
        TAKES_ONE_THING[take](value)
        return
    with pytest.raises(rocking.RockingError) as caught:
        TAKES_ONE_THING[take](value)
    assert "\n" not in str(caught.value)


def test_one_block_is_not_chosen_by_select_nor_are_those_that_are_not_there():
    blocks = Blocks(p=[1.0, 2.0, 3.0], alpha=0.2)
    for index in (0, 1.5, [0, 3], [True, False], np.array([[0, 1]])):
        with pytest.raises(BlockError):
            blocks.select(index)
    assert repr(blocks.select([])) == "<Blocks: none>"
    for index in (slice(0, 2), [0, 1], np.array([True, True, False]), [0, -2]):
        assert blocks.select(index).p[:, 0].tolist() == [1.0, 2.0]


@pytest.mark.parametrize("level", [1e60, 1e300, 1e308])
def test_nothing_is_shaken_more_than_a_motion_may_be(level):
    for scaled in (MOTION.scaled, MOTION.scaled_to):
        with pytest.raises(MotionError, match=r"the acceleration of a motion must stay below 1e\+30 m/s\^2"):
            scaled(level)
    for scale in ({"levels": level, "measure": "pga"}, {"levels": level}):
        with pytest.raises(MotionError, match=r"the acceleration of a motion must stay below 1e\+30 m/s\^2"):
            rocking.simulate_many(BLOCK, MOTION, **scale)


@pytest.mark.parametrize("period", [1e300, 1e9])
def test_a_period_that_says_nothing_is_refused(period):
    with pytest.raises(MotionError, match="a period longer than one million times the duration"):
        MOTION.spectral_acceleration(period)
