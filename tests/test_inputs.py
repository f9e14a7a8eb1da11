"""Every input means the same wherever it is given: on the command line, in a study file or its table, on the page."""

import math

import numpy as np
import pytest

from rocking import Block, Blocks, RockingError
from rocking.cli.options import BlockOptions, MotionOptions, RestrainedOptions, StartOptions
from rocking.explorer.inputs import read_case
from rocking.explorer.parameters import PARAMETERS
from rocking.explorer.uploads import UploadStore
from rocking.inputs.bodies import create_block, write_block_call
from rocking.inputs.declared import BLOCK_DESCRIPTIONS, BLOCK_INPUTS, INPUTS, SUPPORT_INPUTS
from rocking.studies import read_study
from rocking.studies.file import SCHEMA

#: Descriptions of blocks as they are typed, and the blocks of Python.
BLOCKS = [
    ({"width": "24cm", "height": "1.1"}, Block(width=0.24, height=1.1)),
    ({"width": "0.3", "height": "1.1", "offset": "-3cm"}, Block(width=0.3, height=1.1, offset=-0.03)),
    (
        {"half_width": "0.15", "half_height": "0.55", "offset": "0.03", "restitution": "0.9,0.8", "mass": "50"},
        Block(half_width=0.15, half_height=0.55, offset=0.03, restitution=(0.9, 0.8), mass=50.0),
    ),
    ({"p": "2", "alpha": "12deg", "restitution": "0.9"}, Block.from_parameters(2.0, math.radians(12.0), 0.9)),
    (
        {"p": "2.9858,3.0053", "alpha": "0.27417,0.155"},
        Block.from_parameters((2.9858, 3.0053), (0.27417, 0.155)),
    ),
    (
        {"pivots": "20cm,0.15", "height_of_mass": "0.6", "gyration": "0.4", "mass": "7"},
        Block.from_pivots((0.2, 0.15), 0.6, 0.4, mass=7.0),
    ),
    (
        {"pivots": "0.2", "height_of_mass": "0.6", "gyration": "400mm", "restitution": "0.7,0.8"},
        Block.from_pivots((0.2, 0.2), 0.6, 0.4, restitution=(0.7, 0.8)),
    ),
]
OTHERS = '\n[motions]\nrecords = ["el-centro-meloland-270"]\n[simulation]\nduration = 1.0\n'


def sides(block):
    return [(side.p, side.alpha, side.restitution, side.radius) for side in block.sides]


def in_a_study(tmp_path, table):
    (tmp_path / "study.toml").write_text(f"[blocks]\n{table}\n{OTHERS}")
    return read_study(tmp_path / "study.toml").product.bodies


@pytest.mark.parametrize(("texts", "block"), BLOCKS)
def test_a_block_is_the_same_from_a_command_a_page_a_file_and_a_table(tmp_path, texts, block):
    without_mass = {name: text for name, text in texts.items() if name != "mass"}
    assert sides(BlockOptions(**without_mass).create_block()) == sides(block)
    body = RestrainedOptions(**texts).create_body()
    assert (sides(body), body.mass) == (sides(block), block.mass)
    if {*without_mass} <= PARAMETERS.keys():
        case = read_case({**without_mass, "motion": "none", "duration": "1"}, UploadStore())
        assert sides(case.block) == sides(block) == sides(eval(case.block_expression, {"Block": Block}))
    whole = Blocks.from_bodies([block])
    columns = {}
    for name, text in texts.items():
        pair = text.split(",") * (2 if name == "pivots" and "," not in text else 1)
        columns |= {name: text} if len(pair) == 1 else dict(zip((f"{name}_plus", f"{name}_minus"), pair, strict=True))
    (tmp_path / "blocks.csv").write_text("\n".join((",".join(columns), ",".join(columns.values()))))
    found = [in_a_study(tmp_path, 'csv = "blocks.csv"')]
    if not any("," in text for name, text in texts.items() if name != "pivots"):
        lines = {name: f'["{text}"]' for name, text in texts.items()}
        if "pivots" in texts:
            lines["pivots"] = str([[*INPUTS["pivots"].read(texts["pivots"])]])
        found.append(in_a_study(tmp_path, "\n".join(f"{name} = {value}" for name, value in lines.items())))
    for bodies in found:
        for name in ("p", "alpha", "restitution"):
            np.testing.assert_array_equal(getattr(bodies, name), getattr(whole, name))


def test_a_file_makes_a_block_of_every_combination(tmp_path):
    found = in_a_study(tmp_path, 'width = [0.3, "40cm"]\nheight = 1.1\noffset = [-0.03, 0.0]')
    truth = [Block(width=w, height=1.1, offset=s) for w in (0.3, 0.4) for s in (-0.03, 0.0)]
    np.testing.assert_array_equal(found.alpha, Blocks.from_bodies(truth).alpha)
    pairs = "pivots = [[0.2, 0.15], [0.1, 0.1]]\nheight_of_mass = 0.6\ngyration = [0.4, 0.5]"
    truth = [Block.from_pivots(pair, 0.6, k) for pair in ((0.2, 0.15), (0.1, 0.1)) for k in (0.4, 0.5)]
    np.testing.assert_array_equal(in_a_study(tmp_path, pairs).p, Blocks.from_bodies(truth).p)


def test_every_input_of_a_body_is_an_option_and_a_key_and_every_other_has_an_option():
    options = {each for kind in (RestrainedOptions, MotionOptions, StartOptions) for each in kind.__dataclass_fields__}
    assert {*BLOCK_INPUTS, *SUPPORT_INPUTS} <= options & INPUTS.keys()
    keys = {*SCHEMA["blocks"]}
    assert {*BLOCK_INPUTS} <= keys and all(name in keys or f"{name}s" in keys for name in SUPPORT_INPUTS)
    described = {name for name, each in INPUTS.items() if each.help}
    assert described - {"model", "chattering", "friction"} == options & INPUTS.keys()  # these have options of their own


@pytest.mark.parametrize("shape", BLOCK_DESCRIPTIONS, ids=lambda shape: shape.name)
def test_a_description_of_a_block_is_complete_or_refused(shape):
    values = dict.fromkeys(shape.needed, 0.3) | ({"pivots": (0.3, 0.3)} if "pivots" in shape.needed else {})
    assert eval(write_block_call(values), {"Block": Block}) == create_block(values)
    for name in shape.needed if len(shape.needed) > 1 else ():
        with pytest.raises(RockingError, match="a block requires more than"):
            create_block({each: value for each, value in values.items() if each != name})
    for other in BLOCK_DESCRIPTIONS:
        if other is not shape:
            with pytest.raises(RockingError, match="are from different descriptions of a block"):
                create_block(values | dict.fromkeys(other.needed, 0.3))
