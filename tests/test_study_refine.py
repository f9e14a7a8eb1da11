"""Critical scales of a study: as bisection by single simulations finds them, the same bytes whoever refines them."""

import hashlib
import json
import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
import pytest

import rocking
from rocking import simulate
from rocking.engine import Setup
from rocking.motion.exceedance import exceedances
from rocking.progress import Progress
from rocking.studies import read_study, refine
from rocking.studies.inputs import OUTCOMES
from rocking.studies.state import Log
from rocking.studies.store import UnitArray
from rocking.studies.units import PointsWork, name_of
from rocking.treatment import treatment

FINE, TOLERANCE = 1e-3, 1e-2
SCALES = np.linspace(4.0, 20.0, 9)
MOTIONS = [rocking.pulses.one_sine(1.0, 5.0 / np.pi), rocking.pulses.one_sine(2.0, 0.8)]
SIDES = [[0.2, 0.21]] * 50  # motions that are reversed find other blocks
BLOCKS = rocking.Blocks(p=np.linspace(1.8, 3.0, 50), alpha=SIDES, restitution=0.9)
FEW = BLOCKS.select(slice(0, 50, 3))  # they show what no number of blocks changes
OPTIONS = {"levels": SCALES, "measure": "pga", "polarity": "both", "model": "linear"}

SCRIPT = """
import sys
import numpy as np, rocking
from rocking.studies import refine
refine._UNITS = refine._LEAST = 16
rocking.study(sys.argv[1]).run(threads=int(sys.argv[2]))
"""


def made(folder, refine=TOLERANCE, blocks=FEW):
    return rocking.study(folder, blocks, MOTIONS, **OPTIONS, refine=refine, unit_blocks=512)


@pytest.fixture(autouse=True, scope="module")
def many_units():
    with pytest.MonkeyPatch.context() as patched:
        patched.setattr("rocking.studies.refine._UNITS", 16)
        patched.setattr("rocking.studies.refine._LEAST", 16)
        yield


@pytest.fixture(scope="module")
def complete(tmp_path_factory):
    folder = tmp_path_factory.mktemp("refined") / "study"
    made(folder).run(threads=1)
    return folder


@pytest.fixture(scope="module")
def large(tmp_path_factory):
    folder = tmp_path_factory.mktemp("large") / "study"
    made(folder, FINE, BLOCKS).run(threads=1)
    return folder


def digest(folder):
    total = hashlib.sha256()
    for path in sorted(Path(folder).rglob("*")):
        if path.is_file() and path.name not in ("lock", "runs.jsonl"):
            total.update(f"{path.relative_to(folder)}".encode() + path.read_bytes())
    return total.hexdigest()


def overturns(block, motion, pga, sign):
    return rocking.simulate(BLOCKS[block], motion.scaled_to(pga).scaled(sign), model="linear").overturned


def bisected(verdict, low, high, tolerance):
    above = verdict(high)
    while high - low > tolerance * high:
        middle = 0.5 * (low + high)
        low, high = (low, middle) if verdict(middle) == above else (middle, high)
    return low, high


@pytest.mark.thorough
def test_critical_scales_are_those_of_bisection_by_single_simulations(large):
    study = rocking.study(large)
    found, verdicts = study.critical_scales(), study.results().overturned.values
    assert study.status.complete
    assert found.known.all()
    changes = verdicts[:, 1:] != verdicts[:, :-1]
    assert found.sizes["change"] == changes.sum() > 130
    assert np.all(found.high - found.low <= FINE * found.high)
    names = study.results().motion.values.tolist()
    seen = 0
    for k in range(0, found.sizes["change"], 8):
        one = found.isel(change=k)
        m, block, sign = names.index(one.motion), int(one.block), {"+": 1, "-": -1}[str(one.polarity.values)]
        scale = np.searchsorted(SCALES, float(one.high)) - 1
        above = bool(verdicts[m, scale + 1, 0 if sign > 0 else 1, block])
        case = block, MOTIONS[m]
        low, high = bisected(lambda pga: overturns(*case, pga, sign), *SCALES[scale : scale + 2], FINE)  # noqa: B023
        assert (float(one.low), float(one.high), bool(one.overturns)) == (low, high, above)
        seen += 1
    assert seen > 15


def test_a_verdict_that_goes_back_has_a_bracket_for_each_change(complete):
    found = rocking.study(complete).critical_scales()
    count = found.to_dataframe().groupby(["motion", "polarity", "block"]).size()
    assert count.max() >= 3
    one = found.to_dataframe().set_index(["motion", "polarity", "block"]).loc[count.idxmax()]
    assert one.overturns.tolist()[:3] == [True, False, True]
    assert np.all(np.diff(one.low) > 0.0)


@pytest.mark.thorough
@pytest.mark.parametrize("threads", [1, 2])
def test_whoever_refines_it_and_when_the_store_is_the_same_to_the_byte(complete, tmp_path, threads):
    folder = tmp_path / "study"
    made(folder, refine=None).run(threads=threads)
    assert not list(folder.glob("round.*"))
    made(folder).run(threads=threads)  # asked for later
    assert digest(folder) == digest(complete)
    assert rocking.study(folder).run().units == 0


@pytest.mark.thorough
def test_a_refinement_that_stops_at_any_unit_goes_on_to_the_same_bytes(complete, tmp_path, monkeypatch):
    class Stopped(BaseException):
        pass

    folder, units, put = tmp_path / "study", 2 * 9 * 2, UnitArray.put

    def put_or_stop(array, key, data):
        if not left.pop():
            raise Stopped
        put(array, key, data)

    for more in (units + 3, 10, 1, 2):
        left = [False, *[True] * more]
        with monkeypatch.context() as patched, pytest.raises(Stopped):
            patched.setattr(UnitArray, "put", put_or_stop)
            made(folder).run(threads=1)
        assert not rocking.study(folder).status.complete
    assert len(list(folder.glob("round.*/c.*"))) == 3 + 10 + 1 + 2
    made(folder).run(threads=1)
    assert digest(folder) == digest(complete)


@pytest.mark.thorough
@pytest.mark.skipif(os.name == "nt", reason="signals are sent the POSIX way")
def test_a_refinement_that_is_killed_goes_on_to_the_same_bytes(large, tmp_path):
    folder, seen = tmp_path / "study", 0
    made(folder, FINE, BLOCKS)
    for more in (3, 25):
        target = seen + more
        with subprocess.Popen([sys.executable, "-c", SCRIPT, str(folder), "2"], stderr=subprocess.DEVNULL) as process:
            while seen < target and process.poll() is None:
                time.sleep(0.01)
                seen = len(list(folder.glob("round.*/c.*")))
            process.send_signal(signal.SIGKILL)
        assert not rocking.study(folder).status.complete
    made(folder, FINE, BLOCKS).run(threads=1)
    assert digest(folder) == digest(large)


def test_a_refinement_says_how_far_it_is_and_goes_on_at_the_unit_that_is_missing(complete, tmp_path):
    folder = tmp_path / "study"
    study = made(folder)
    assert "to be refined to 0.01" in str(study.status)
    study.run()
    count = study.status.refinement.rounds
    assert f"refined to 0.01 (overturning) in {count - 1} rounds" in str(study.status)
    for path in folder.glob(f"round.{count}/*"):
        path.unlink()
    unit = folder / f"round.{count - 1}" / name_of((0,))
    unit.unlink()
    assert f"round {count - 1}: " in str(study.status)
    assert not study.status.complete
    with study._store.place.locked():
        Log(study._store.place).add({"event": "start", "done": 612})
        status = study.status
    running, refined = status.running, status.refinement
    assert running.rate > 0.0 and refined.simulations > refined.done
    assert running.seconds_left == pytest.approx((refined.simulations - refined.done) / running.rate)
    with pytest.raises(rocking.StudyError, match=r"not yet refined to 0\.01 \(overturning\)"):
        study.critical_scales()
    assert study.run().units == 1
    assert digest(folder) == digest(complete)


def test_before_each_round_the_last_one_alone_is_read(tmp_path, monkeypatch):
    read, from_bytes = [], refine.Brackets.from_bytes
    monkeypatch.setattr(refine.Brackets, "from_bytes", lambda data: read.append(len(data)) or from_bytes(data))
    study = made(tmp_path)
    study.run()
    count, rounds = len(read), study.status.refinement.rounds
    assert rounds > 4
    assert rounds - 1 <= count <= 2 * rounds  # those of all before would be twice the sum of their numbers


@pytest.mark.thorough
def test_damage_to_a_round_is_named_and_corrected(complete, tmp_path):
    folder = tmp_path / "study"
    study = made(folder)
    study.run()
    unit = folder / "round.2" / name_of((1,))
    unit.write_bytes(unit.read_bytes()[:-1])
    (fault,) = study.verify()
    assert "unit round.2/c.0.1 is damaged" in fault
    assert len(study.verify(repair=True)) == 1
    assert study.verify(recompute=5) == []
    assert digest(folder) == digest(complete)
    (folder / "round.2" / "brackets.npz").write_bytes(b"")
    with pytest.raises(rocking.StudyError, match=r"round\.2 is damaged: remove"):
        study.verify()


def test_rounds_are_arrays_that_any_zarr_reader_opens(complete):
    zarr = pytest.importorskip("zarr")
    array = zarr.open_group(complete, mode="r")["round.1"]
    names = list(array.attrs["outcomes"])
    assert array.shape == (13, rocking.study(complete).critical_scales().sizes["change"])
    found = dict(zip(names, array[:], strict=True))
    residual, fell = found.pop("residual_rotation"), found["overturned"] == 1.0
    assert not np.isnan([*found.values()]).any()
    np.testing.assert_array_equal(np.isnan(residual), fell)


def completes(block, motion, model, pga, sign):
    """Whether the motion is beyond the thresholds only once until the block rests, by one simulation."""
    scaled = motion.scaled_to(pga).scaled(sign)
    response = rocking.simulate(block, scaled, model=model)
    if not len(response.chattering):
        return False
    starts = exceedances(scaled, block.uplift_thresholds(model), block.gravity)[:, 0]
    return int(np.count_nonzero(starts < response.chattering["end"][0])) == 1


@pytest.mark.parametrize(
    ("model", "every", "tolerance"),
    [
        ("nonlinear", 12, FINE),
        pytest.param("nonlinear", 3, 1e-5, marks=pytest.mark.thorough),
        pytest.param("linear", 3, 1e-5, marks=pytest.mark.slow),
    ],
)
def test_chattering_becomes_complete_and_stops_being_so_where_bisection_by_single_simulations_finds_it(
    tmp_path, model, every, tolerance
):
    motions = [rocking.records.load("el-centro-meloland-270"), rocking.pulses.ricker(1.0, 0.9)]
    blocks, levels, signs = BLOCKS.select(slice(0, 50, every)), np.linspace(1.5, 6.0, 13), {"+": 1, "-": -1}
    study = rocking.study(
        tmp_path,
        blocks,
        motions,
        levels=levels,
        measure="pga",
        polarity="both",
        model=model,
        refine={"complete_chattering": tolerance},
    )
    study.run()
    found, verdicts = study.critical_scales("complete_chattering"), study.results().complete_chattering.values
    assert found.known.all()
    assert found.sizes["change"] == (verdicts[:, 1:] != verdicts[:, :-1]).sum() > 100 * len(blocks) / 17
    assert 0.2 < found.completes.mean() < 0.8
    names, seen = study.results().motion.values.tolist(), 0
    for k in range(0, found.sizes["change"], 14 * len(blocks) // 17):
        one = found.isel(change=k)
        case = blocks[int(one.block)], motions[names.index(one.motion)], model
        high, sign = np.searchsorted(levels, float(one.high)), signs[str(one.polarity.values)]
        low, high = bisected(lambda pga: completes(*case, pga, sign), *levels[[high - 1, high]], tolerance)  # noqa: B023
        assert (float(one.low), float(one.high)) == (low, high)
        assert bool(one.completes) == completes(*case, high, sign) != completes(*case, low, sign)
        seen += 1
    assert seen > 7


def test_under_a_sine_chattering_is_complete_from_the_uplift_to_the_critical_amplitude(tmp_path):
    p, eta = np.array([0.8, 1.5, 2.5, 4.0]), 0.92
    blocks = rocking.Blocks(p=p, alpha=0.2, restitution=eta)
    lifting = blocks.gravity * 0.2
    critical = rocking.chattering.critical_amplitude(np.pi / p, eta)
    # A refinement from levels close by takes few rounds; none of its middles is a critical amplitude itself.
    levels = np.outer([1.0, *critical[::-1]], [1.0 - 1e-5, 1.0 + 2e-5]).ravel()
    study = rocking.study(
        tmp_path,
        blocks,
        rocking.pulses.sine(1.0, 0.5, cycles=4),
        levels=lifting * levels,
        measure="pga",
        model="linear",
        refine={"complete_chattering": 1e-9, "overturning": 0.1},
    )
    study.run()
    assert "refined to 0.1 (overturning), 1e-09 (complete chattering)" in str(study.status)
    found = study.critical_scales("complete_chattering")
    assert found.completes.values.tolist() == [True, False] * len(p)
    amplitude = 0.5 * (found.low + found.high).values / lifting
    np.testing.assert_allclose(amplitude[::2], 1.0, rtol=1e-9)
    np.testing.assert_allclose(amplitude[1::2], critical, rtol=2e-9)
    assert len(set(critical.round(6))) == len(p)


@pytest.mark.thorough
def test_refined_for_both_verdicts_it_finds_what_it_finds_for_each(complete, tmp_path):
    def found_by(refine):
        study = made(tmp_path / f"{len(refine)}{min(refine)}", refine=refine)
        study.run(threads=1)
        return study

    chattering, both = (
        found_by({"complete_chattering": 0.03}),
        found_by({"complete_chattering": 0.03, "overturning": TOLERANCE}),
    )
    for verdict, alone in (("overturning", rocking.study(complete)), ("complete_chattering", chattering)):
        assert both.critical_scales(verdict).identical(alone.critical_scales(verdict))
    grid = rocking.study(complete).critical_scales("complete_chattering")
    assert grid.sizes == chattering.critical_scales("complete_chattering").sizes
    assert np.isin(grid.low, SCALES).all()
    with pytest.raises(rocking.InvalidOption, match="verdict must be one of overturning, complete_chattering"):
        both.critical_scales("falling")


def test_chattering_that_was_cut_off_or_is_not_proven_is_no_verdict():
    outcomes = dict.fromkeys(OUTCOMES, np.zeros(6))
    outcomes |= {
        "overturned": np.array([0, 0, 0, 1, 0, 0]),
        "unfinished": np.array([1, 0, 0, 0, 0, 0]),
        "stopped": np.array([0, 1, 1, 0, 0, 0]),
        "rests": np.array([0, 0, 2, 0, 1, 1]),
        "complete_chattering": np.array([0, 0, 1, 0, 1, 1]),
        "stalled": np.array([0, 0, 0, 0, 0, 1]),
    }
    assert refine._finding("overturning", outcomes).tolist() == [-1, -1, -1, 1, 0, 0]
    assert refine._finding("complete_chattering", outcomes).tolist() == [-1, -1, 1, 0, 1, -1]


def test_two_motions_of_one_factor_shake_each_its_own_points():
    """Points stand in order of their motions and factors: where a factor stays, the motion may change."""
    which, factors = np.array([0, 0, 1, 1, 1, 0]), np.array([2.0, 2.0, 2.0, 2.0, 3.0, 3.0])
    setup = Setup(BLOCKS.select(np.arange(6)), "linear", treatment("certified"), None)
    work = PointsWork(
        setup=setup, motions=tuple(MOTIONS), which=which, factors=factors, unit=(6,), outcomes=("peak_rotation",)
    )
    tasks = [(where[0].start, where[0].stop, task.motion, task.factor) for where, task in work.parts()]
    first, second = MOTIONS
    assert tasks == [(0, 2, first, 2.0), (2, 4, second, 2.0), (4, 5, second, 3.0), (5, 6, first, 3.0)]
    peaks = [
        simulate(block, MOTIONS[motion].scaled(factor), model="linear").peak_rotation
        for block, motion, factor in zip(setup.bodies, which, factors, strict=True)
    ]
    assert work.values(None)[0] == pytest.approx(peaks, rel=1e-12)


def test_the_bar_says_which_round_it_is_and_what_is_counted(tmp_path, monkeypatch):
    said = []

    class Bar(Progress):
        def __init__(self, what, total, **options):
            said.append((what, total))
            super().__init__(what, total, **options)

    monkeypatch.setattr("rocking.studies.run.Progress", Bar)
    study = made(tmp_path)
    study.run()
    state = study.status
    assert said[0] == ("simulations", 612)
    assert said[1] == (f"simulations of round 1 of at most {len(said) - 1}", study.critical_scales().sizes["change"])
    assert said[-1][0].startswith(f"simulations of round {state.refinement.rounds - 1} of at most ")


def test_simulations_that_were_stopped_are_no_verdict(tmp_path):
    study = rocking.study(tmp_path / "study", BLOCKS, MOTIONS, **OPTIONS, refine=0.01, duration=0.9)
    study.run()
    results, found = study.results(), study.critical_scales()
    known = (results.overturned | ~results.stopped).values
    assert (~known).any()
    assert not (results.overturned & results.stopped).any()  # a verdict asks for no more than the latter
    columns = zip(
        *(np.moveaxis(values, 1, -1).reshape(-1, len(SCALES)) for values in (results.overturned.values, known)),
        strict=True,
    )
    assert found.sizes["change"] == sum(int(np.sum(np.diff(falls[told].astype(int)) != 0)) for falls, told in columns)
    wide = (found.high - found.low > 0.01 * found.high).values
    assert np.array_equal(wide, ~found.known.values)


def test_a_change_with_unknown_verdicts_inside_lies_between_the_known_ones(tmp_path):
    block = rocking.Block.from_parameters(p=2.0, alpha=0.2, restitution=0.97)
    options = {"levels": [0.5, 1.0, 2.2, 2.5, 6.0, 6.5], "measure": "pga", "duration": 4.0, "refine": 1e-3}
    study = rocking.study(tmp_path / "study", block, rocking.pulses.one_sine(1.0, 1.0), **options)
    study.run(threads=1)
    results, found = study.results(), study.critical_scales()
    assert results.stopped.values.ravel().tolist() == [False, False, True, True, False, False]
    assert results.overturned.values.ravel().tolist() == [False, False, False, False, True, True]
    assert (found.low.values.tolist(), found.high.values.tolist()) == ([1.0], [6.0])
    assert (found.overturns.values.tolist(), found.known.values.tolist()) == ([True], [False])


def test_what_cannot_be_refined_is_refused(tmp_path):
    for changes, sentence in (
        ({"refine": 2.0}, "refine must be a number from 1e-12 to 0.5"),
        ({"refine": {"complete_chattering": 2.0}}, "refine must be a number from 1e-12 to 0.5"),
        ({"refine": {"falling": 0.1}}, "for overturning and complete_chattering, not 'falling'"),
        ({"refine": {}}, "for overturning and complete_chattering, none of which is given"),
        ({"levels": [2.0]}, "two scales or more, in increasing order"),
        ({"levels": [3.0, 2.0]}, "two scales or more, in increasing order"),
    ):
        with pytest.raises(rocking.InvalidOption, match=sentence):
            rocking.study(tmp_path / "study", BLOCKS, MOTIONS, **(OPTIONS | {"refine": 0.1} | changes))
        assert not (tmp_path / "study").exists()
    made(tmp_path / "study")
    with pytest.raises(rocking.StudyError, match=r"holds a study refined to 0\.01 \(overturning\), not to 0\.001"):
        made(tmp_path / "study", refine=FINE)


@pytest.mark.thorough
def test_a_file_asks_for_refinement_and_the_command_writes_critical_scales(run, tmp_path):
    pandas = pytest.importorskip("pandas")
    file, folder = tmp_path / "study.toml", tmp_path / "study"
    text = """\
[blocks]
p = "2:3:4"
alpha = 0.2
restitution = 0.9

[[motions.pulses]]
family = "one_sine"
amplitude = 1.0
frequency = 0.8

[scales]
pga = "1:9:5"
refine = 1e-4

[simulation]
model = "linear"
"""
    file.write_text(text.replace("1e-4", "3"))
    with pytest.raises(rocking.StudyError, match=r"study\.toml, line 13: refine must be"):
        read_study(file)
    file.write_text(text.replace("1e-4", "{ falling = 1e-4 }"))
    with pytest.raises(rocking.StudyError, match=r"study\.toml, line 13: refine takes a number, or tolerances for"):
        read_study(file)
    file.write_text(text.replace("1e-4", "{ complete_chattering = 1e-6, overturning = 1e-4 }"))
    assert read_study(file).refine == {"overturning": 1e-4, "complete_chattering": 1e-6}
    file.write_text(text)
    assert "refined to 0.0001 (overturning) in" in run("study", "run", file)[1]
    assert json.loads(run("study", "status", folder, "--json")[1])["refinement"]["complete"]
    assert run("study", "export", folder, tmp_path / "critical.csv", "--critical", "overturning")[0] == 0
    table = pandas.read_csv(tmp_path / "critical.csv")
    assert [*table.columns] == [
        *("change", "motion", "polarity", "block", "p_rad_s", "alpha_rad", "restitution"),
        *("pga_low_m_s2", "pga_high_m_s2", "overturns", "known"),
    ]
    assert table.block.tolist() == [0, 1, 2, 3]
    run("study", "export", folder, tmp_path / "chattering.csv", "--critical", "complete_chattering")
    assert pandas.read_csv(tmp_path / "chattering.csv").columns[9] == "completes"
    exact = rocking.incremental_dynamic_analysis(
        read_study(file).product.blocks, read_study(file).product.motions, levels=np.linspace(1, 9, 5), model="linear"
    )
    np.testing.assert_allclose(table.pga_high_m_s2, exact.band_start.values.ravel()[:4], rtol=1.1e-4)


def test_a_bracket_whose_middle_is_unknown_once_stays_as_it_is():
    same = np.zeros(3, dtype=np.int64)
    low, high, above = np.full(3, 1.0), np.full(3, 2.0), np.full(3, True)
    brackets = refine.Brackets(same, same, same, np.arange(3), low, high, above, np.array([False, True, True]))
    assert brackets.wide({refine.VERDICTS[0]: 0.1}).tolist() == [1, 2]
    found = np.array([refine.Finding.YES, refine.Finding.UNKNOWN], dtype=np.int8)
    after = brackets.halved(np.array([1, 2]), found)
    assert (after.low.tolist(), after.high.tolist()) == ([1.0, 1.0, 1.0], [2.0, 1.5, 2.0])
    assert after.known.tolist() == [False, True, False]
    assert after.wide({refine.VERDICTS[0]: 0.1}).tolist() == [1]
