"""A body in the plane of each azimuth is its block there, under the component of the motion along it."""

import math

import numpy as np
import pytest

import rocking
from rocking import Motion, Solid, records, response_rose
from rocking.errors import BlockError, MotionError, OptionError


@pytest.fixture(scope="module")
def statue():
    return Solid.from_mesh("statue", density={"plinth": 2700.0, "figure": 2650.0, "head": 2650.0})


@pytest.fixture(scope="module")
def pairs():
    east, north = records.load("el-centro-meloland-270"), records.load("el-centro-meloland-360")
    pulses = tuple(rocking.pulses.one_sine(5.0, frequency) for frequency in (0.6, 0.8))
    return {
        "meloland": (east.processed(trim=(4.0, 12.0)), north.processed(trim=(4.0, 12.0))),
        # Rotated to where they are, they know their azimuths.
        "pulses": tuple(pulses[0].rotated(pulses[1], azimuth, recorded=(90.0, 0.0)) for azimuth in (90.0, 0.0)),
    }


def test_every_outcome_is_that_of_the_block_under_the_motion_along_its_azimuth(statue, pairs):
    azimuths, levels = [0.0, 50.0, 90.0, 230.0], [0.5, 1.6]
    found = response_rose(statue, pairs, azimuths=azimuths, levels=levels, measure="pgv")
    judged = 0
    for name, (one, other) in pairs.items():
        for level in levels:
            factor = level / math.sqrt(one.pgv * other.pgv)
            for azimuth in azimuths:
                block = statue.block(azimuth)
                response = rocking.simulate(block, one.rotated(other, azimuth).scaled(factor))
                here = found.data.sel(pair=name, level=level, azimuth=azimuth)
                assert bool(here.overturned) == response.overturned
                if not response.overturned:
                    wanted = response.peak_rotation / min(block.balance)
                    assert float(here.peak_over_slenderness) == pytest.approx(abs(wanted), rel=1e-9)
                else:
                    assert np.isinf(here.peak_over_slenderness)
                judged += 1
    assert judged == 16
    # Across from 50 deg the mirror image is under the mirrored motion.
    assert np.array_equal(found.data.overturned.sel(azimuth=50.0), found.data.overturned.sel(azimuth=230.0))
    assert 0.0 < float(found.data.overturned.mean()) < 1.0
    assert found.data.anywhere.values.tolist() == found.data.overturned.any("azimuth").mean("pair").values.tolist()


def test_pairs_as_they_are_have_one_level(statue, pairs):
    found = response_rose(statue, [pairs["pulses"]] * 2, azimuths=[0.0])
    assert found.data.level.values.tolist() == [1.0]
    assert len({*found.data.pair.values.tolist()}) == 2
    assert "factor of the motion 1" in found.summary()


def test_the_figure_has_the_full_circle(statue, pairs):
    found = response_rose(statue, [pairs["pulses"]], azimuths=[0.0, 60.0, 120.0], levels=[0.5, 2.0])
    axes = found.plot().axes[0]
    curves = [line for line in axes.lines if line.get_marker() == "o"]
    assert [len(line.get_xdata()) for line in curves] == [7, 7]
    for line, shares in zip(curves, found.data.overturned_share.values, strict=True):
        np.testing.assert_allclose(np.hypot(*line.get_data())[:6], [*shares, *shares], atol=1e-15)


@pytest.mark.parametrize(
    ("change", "error", "sentence"),
    [
        ({"pairs": []}, OptionError, "pairs must contain a pair of horizontal"),
        ({"pairs": [Motion([0.0, 1.0], [[1.0]])]}, OptionError, "a pair of horizontal components for each site"),
        ({"pairs": Motion([0.0, 1.0], [[1.0]])}, OptionError, "pairs must be a list"),
        ({"pairs": [("a.at2", "b.at2")]}, MotionError, "rocking.read"),
        ({"pairs": [(Motion([0.0, 1.0], [[1.0]]), Motion([0.0, 1.0], [[1.0]]))]}, MotionError, "is unknown"),
        ({"levels": [1.0], "measure": "pga_ratio"}, OptionError, "pga_ratio"),
        ({"solid": rocking.Block(width=0.4, height=1.8)}, BlockError, "a Solid is required"),
    ],
)
def test_what_is_no_pair_and_no_solid_is_refused(statue, pairs, change, error, sentence):
    given = {"solid": statue, "pairs": [pairs["pulses"]]} | change
    with pytest.raises(error, match=sentence):
        response_rose(given.pop("solid"), given.pop("pairs"), **given)
