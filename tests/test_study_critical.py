"""Critical scales of a study: the scales between which single simulations change their verdict."""

import itertools

import numpy as np
import pytest

import rocking

SCALES = np.geomspace(1.6, 20.0, 16)
MOTIONS = [rocking.pulses.one_sine(1.0, 5.0 / np.pi), rocking.pulses.ricker(1.0, 0.9)]
# Motions that are reversed find other blocks.
BLOCKS = rocking.Blocks(p=np.linspace(1.8, 3.0, 17), alpha=[[0.2, 0.21]] * 17, restitution=0.9)
OPTIONS = {"levels": SCALES, "measure": "pga", "polarity": "both", "model": "linear"}


@pytest.fixture(scope="module")
def complete(tmp_path_factory):
    study = rocking.create_study(tmp_path_factory.mktemp("complete"), BLOCKS, MOTIONS, **OPTIONS, blocks_per_batch=512)
    study.run()
    return study


def changes(holds, known):
    """Changes by hand, of verdicts of shape (motion, scale, polarity, block)."""
    found = []
    for m, k, b in np.ndindex(*(holds.shape[axis] for axis in (0, 2, 3))):
        seen = [s for s in range(len(SCALES)) if known[m, s, k, b]]
        found += [
            (m, k, b, SCALES[low], SCALES[high], bool(holds[m, high, k, b]), high == low + 1)
            for low, high in itertools.pairwise(seen)
            if holds[m, low, k, b] != holds[m, high, k, b]
        ]
    return found


def as_rows(found, above, results):
    motions, polarities = results.motion.values.tolist(), results.polarity.values.tolist()
    names = ("motion", "polarity", "block", "low", "high", above, "known")
    rows = zip(*(found[name].values.tolist() for name in names), strict=True)
    return [(motions.index(m), polarities.index(k), *rest) for m, k, *rest in rows]


@pytest.mark.parametrize(("verdict", "above"), [("overturning", "overturns"), ("complete_chattering", "completes")])
@pytest.mark.parametrize("duration", [None, 10.0])
def test_changes_lie_between_neighbouring_scales_whose_verdicts_are_known(complete, tmp_path, verdict, above, duration):
    study = complete
    if duration is not None:
        study = rocking.create_study(tmp_path, BLOCKS, MOTIONS, **OPTIONS, duration=duration, blocks_per_batch=512)
        study.run()
    found, results = study.critical_scales(verdict), study.results()
    known = ~(results.unfinished | results.ended_early).values
    holds = results.overturned.values
    if verdict == "complete_chattering":
        known = (known | (results.rests > 0).values) & (results.rests_by_rounding == 0).values
        holds = results.complete_chattering.values
    assert as_rows(found, above, results) == changes(holds, known)
    assert found.sizes["change"] >= 68
    assert known.all() == (duration is None)
    np.testing.assert_array_equal(found.p_plus, BLOCKS.p[found.block, 0])


def test_a_verdict_that_goes_back_has_a_bracket_for_each_change(complete):
    found = complete.critical_scales().to_dataframe()
    count = found.groupby(["motion", "polarity", "block"]).size()
    assert count.max() >= 3
    one = found.set_index(["motion", "polarity", "block"]).loc[count.idxmax()]
    assert one.overturns.tolist()[:3] == [True, False, True]
    assert np.all(np.diff(one.low) > 0.0)


def test_a_change_with_unknown_verdicts_inside_lies_between_the_known_ones(tmp_path):
    block = rocking.Block.from_parameters(p=2.0, alpha=0.2, restitution=0.97)
    options = {"levels": [0.5, 1.0, 2.2, 2.5, 6.0, 6.5], "measure": "pga", "duration": 4.0}
    study = rocking.create_study(tmp_path, block, rocking.pulses.one_sine(1.0, 1.0), **options)
    with rocking.set_options(threads=1):
        study.run()
    results, found = study.results(), study.critical_scales()
    assert results.ended_early.values.ravel().tolist() == [False, False, True, True, False, False]
    assert results.overturned.values.ravel().tolist() == [False, False, False, False, True, True]
    assert (found.low.values.tolist(), found.high.values.tolist()) == ([1.0], [6.0])
    assert (found.overturns.values.tolist(), found.known.values.tolist()) == ([True], [False])


def test_what_has_no_critical_scales_is_refused(complete, tmp_path):
    for name, levels in (("one", [2.0]), ("falling", [3.0, 2.0])):
        study = rocking.create_study(tmp_path / name, BLOCKS, MOTIONS, **(OPTIONS | {"levels": levels}))
        with pytest.raises(rocking.errors.OptionError, match="at least two scales, in increasing order"):
            study.critical_scales()
    with pytest.raises(rocking.errors.OptionError, match="outcome must be one of overturning, complete_chattering"):
        complete.critical_scales("falling")
    with pytest.raises(rocking.errors.StudyError, match="batches are missing"):
        rocking.create_study(tmp_path / "new", BLOCKS, MOTIONS, **OPTIONS).critical_scales()


@pytest.mark.parametrize(("verdict", "column"), [("overturning", "overturns"), ("complete_chattering", "completes")])
def test_the_command_writes_a_row_for_each_change(complete, run, tmp_path, verdict, column):
    pandas = pytest.importorskip("pandas")
    assert run("study", "export", complete.folder, tmp_path / "all.csv", "--critical", verdict)[0] == 0
    table, found = pandas.read_csv(tmp_path / "all.csv"), complete.critical_scales(verdict)
    assert [*table.columns][-4:] == ["pga_low_m_s2", "pga_high_m_s2", column, "known"]
    np.testing.assert_array_equal(table.pga_high_m_s2, found.high)
