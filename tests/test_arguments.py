"""A motion or a block that is none is refused, wherever one is taken, and told how it becomes one."""

from pathlib import Path

import numpy as np
import pytest

import rocking
from rocking import Block, Blocks, InvalidBlock, InvalidMotion, InvalidOption

BLOCK = Block(0.12, 0.55)
MOTION = rocking.pulses.one_sine(3.0, 1.0)

TAKES_A_MOTION = {
    "simulate": lambda motion: rocking.simulate(BLOCK, motion),
    "simulate_many": lambda motion: rocking.simulate_many(BLOCK, motion),
    "rocking_spectrum": lambda motion: rocking.rocking_spectrum(motion, alpha=[0.2], p=[2.0]),
    "fragility": lambda motion: rocking.fragility(BLOCK, motion, levels=[1.0, 2.0], measure="pga"),
    "incremental_dynamic_analysis": lambda motion: rocking.incremental_dynamic_analysis(BLOCK, motion, measure="pga"),
}


@pytest.mark.parametrize("take", TAKES_A_MOTION)
@pytest.mark.parametrize(
    ("motion", "mend"),
    [
        (np.array([0.1, -0.2, 0.3]), "Motion.from_samples(array, dt)"),
        ([0.1, -0.2, 0.3], "Motion.from_samples(array, dt)"),
        (0.3, "Motion.from_samples(array, dt)"),
        ("ridgecrest-clc-090", 'rocking.records.load("ridgecrest-clc-090")'),
        ("RSN6.AT2", 'rocking.read("RSN6.AT2")'),
        (Path("RSN6.AT2"), 'rocking.read("RSN6.AT2")'),
        (BLOCK, "Motion.from_samples"),
    ],
)
def test_what_is_no_motion_is_refused_and_told_how_to_become_one(take, motion, mend):
    with pytest.raises(InvalidMotion) as caught:
        TAKES_A_MOTION[take](motion)
    assert mend in str(caught.value)
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize("take", [name for name in TAKES_A_MOTION if name != "simulate"])
@pytest.mark.parametrize("motions", [[MOTION, "RSN6.AT2"], [MOTION, None], [[0.1, 0.2]]])
def test_every_one_of_several_motions_is_a_motion(take, motions):
    with pytest.raises(InvalidMotion):
        TAKES_A_MOTION[take](motions)


TAKES_A_BLOCK = {
    "simulate": lambda block: rocking.simulate(block, MOTION),
    "simulate_many": lambda block: rocking.simulate_many(block, MOTION),
    "fragility": lambda block: rocking.fragility(block, MOTION, levels=[1.0, 2.0], measure="pga"),
    "Blocks.of": Blocks.of,
}


@pytest.mark.parametrize("take", TAKES_A_BLOCK)
@pytest.mark.parametrize("block", [(0.2, 1.0), 0.2, "statue", None, MOTION, [BLOCK, 0.2]])
def test_what_is_no_block_is_refused_and_told_how_to_become_one(take, block):
    with pytest.raises(InvalidBlock, match=r"a Block is needed, not a .*: make one with Block"):
        TAKES_A_BLOCK[take](block)


def test_blocks_are_gathered_from_one_from_several_and_from_themselves():
    blocks = Blocks.of([BLOCK, Block(0.2, 1.0)])
    assert Blocks.of(blocks) is blocks
    assert Blocks.of(BLOCK)[0] == Block.from_parameters(BLOCK.p, BLOCK.alpha, BLOCK.restitution)
    with pytest.raises(InvalidBlock, match="select"):
        blocks[0:1]
    with pytest.raises(IndexError):
        blocks[2]


def test_full_sizes_make_the_same_block_as_half_sizes():
    assert Block(width=0.24, height=1.1) == Block(half_width=0.12, half_height=0.55)


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
    with pytest.raises(InvalidBlock, match="either half_width and half_height, or width and height"):
        Block(**sizes)


def test_full_sizes_are_checked_under_their_own_names():
    with pytest.raises(InvalidBlock, match=r"^height must be a positive number, in m, not -1$"):
        Block(width=0.2, height=-1.0)


def test_an_unknown_model_has_no_thresholds():
    with pytest.raises(InvalidOption, match="model must be one of nonlinear, linear, not 'Linear'"):
        BLOCK.uplift_thresholds("Linear")
