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
from rocking.studies import read_study
from rocking.studies.units import name_of

TOLERANCE = 1e-3
SCALES = np.linspace(4.0, 20.0, 9)
MOTIONS = [rocking.pulses.one_sine(1.0, 5.0 / np.pi), rocking.pulses.one_sine(2.0, 0.8)]
BLOCKS = rocking.Blocks(p=np.linspace(1.8, 3.0, 150), alpha=0.2, restitution=0.9)
OPTIONS = {"pga": SCALES, "polarity": "both", "model": "linear"}

SCRIPT = """
import sys
import numpy as np, rocking
from rocking.studies import refine
refine._UNITS = refine._LEAST = 16
rocking.study(sys.argv[1]).run(threads=int(sys.argv[2]))
"""


def made(folder, refine=TOLERANCE):
    return rocking.study(folder, BLOCKS, MOTIONS, **OPTIONS, refine=refine, unit_blocks=512)


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


def digest(folder):
    total = hashlib.sha256()
    for path in sorted(Path(folder).rglob("*")):
        if path.is_file() and path.name not in ("lock", "runs.jsonl"):
            total.update(f"{path.relative_to(folder)}".encode() + path.read_bytes())
    return total.hexdigest()


def overturns(block, motion, pga, sign):
    return rocking.simulate(BLOCKS[block], motion.scaled(pga=pga).scaled(sign), model="linear").overturned


def bisected(block, motion, sign, low, high, above):
    while high - low > TOLERANCE * high:
        middle = 0.5 * (low + high)
        low, high = (low, middle) if overturns(block, motion, middle, sign) == above else (middle, high)
    return low, high


def test_critical_scales_are_those_of_bisection_by_single_simulations(complete):
    study = rocking.study(complete)
    found, verdicts = study.critical_scales(), study.results().overturned.values
    assert study.status.complete
    assert found.known.all()
    changes = verdicts[:, 1:] != verdicts[:, :-1]
    assert found.sizes["change"] == changes.sum() > 400
    assert np.all(found.high - found.low <= TOLERANCE * found.high)
    names = study.results().motion.values.tolist()
    seen = 0
    for k in range(0, found.sizes["change"], 23):
        one = found.isel(change=k)
        m, block, sign = names.index(one.motion), int(one.block), {"+": 1, "-": -1}[str(one.polarity.values)]
        scale = np.searchsorted(SCALES, float(one.high)) - 1
        above = bool(verdicts[m, scale + 1, 0 if sign > 0 else 1, block])
        low, high = bisected(block, MOTIONS[m], sign, SCALES[scale], SCALES[scale + 1], above)
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


@pytest.mark.parametrize("threads", [1, 2])
def test_whoever_refines_it_and_when_the_store_is_the_same_to_the_byte(complete, tmp_path, threads):
    folder = tmp_path / "study"
    made(folder, refine=None).run(threads=threads)
    assert not list(folder.glob("round.*"))
    made(folder).run(threads=threads)  # asked for later
    assert digest(folder) == digest(complete)
    assert rocking.study(folder).run().units == 0


@pytest.mark.skipif(os.name == "nt", reason="signals are sent the POSIX way")
def test_a_refinement_that_is_killed_goes_on_to_the_same_bytes(complete, tmp_path):
    folder, seen = tmp_path / "study", 0
    made(folder)
    for more in (3, 25, 30):
        target = seen + more
        with subprocess.Popen([sys.executable, "-c", SCRIPT, str(folder), "2"], stderr=subprocess.DEVNULL) as process:
            while seen < target and process.poll() is None:
                time.sleep(0.01)
                seen = len(list(folder.glob("round.*/c.*")))
            process.send_signal(signal.SIGKILL)
        assert not rocking.study(folder).status.complete
    made(folder).run(threads=1)
    assert digest(folder) == digest(complete)


def test_a_refinement_says_how_far_it_is_and_goes_on_at_the_unit_that_is_missing(complete, tmp_path):
    folder = tmp_path / "study"
    study = made(folder)
    assert "to be refined to 0.001" in str(study.status)
    study.run()
    count = study.status.refinement.rounds
    assert f"refined to 0.001 in {count - 1} rounds" in str(study.status)
    for path in folder.glob(f"round.{count}/*"):
        path.unlink()
    unit = folder / f"round.{count - 1}" / name_of((0,))
    unit.unlink()
    assert f"round {count - 1}: " in str(study.status)
    assert not study.status.complete
    with pytest.raises(rocking.StudyError, match=r"not yet refined to 0\.001"):
        study.critical_scales()
    assert study.run().units == 1
    assert digest(folder) == digest(complete)


def test_damage_to_a_round_is_named_and_mended(complete, tmp_path):
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
    with pytest.raises(rocking.StudyError, match=r"round\.2 in .* is damaged: remove"):
        study.verify()


def test_rounds_are_arrays_that_any_zarr_reader_opens(complete):
    zarr = pytest.importorskip("zarr")
    array = zarr.open_group(complete, mode="r")["round.1"]
    assert array.shape == (9, rocking.study(complete).critical_scales().sizes["change"])
    assert not np.isnan(array[:]).any()


def test_simulations_that_were_stopped_are_no_verdict(tmp_path):
    study = rocking.study(tmp_path / "study", BLOCKS, MOTIONS, **OPTIONS, refine=0.01, duration=0.9)
    study.run()
    results, found = study.results(), study.critical_scales()
    known = (results.overturned | ~results.stopped).values
    changes = (results.overturned.values[:, 1:] != results.overturned.values[:, :-1]) & known[:, 1:] & known[:, :-1]
    assert (~known).any()
    assert found.sizes["change"] == changes.sum()
    wide = (found.high - found.low > 0.01 * found.high).values
    assert np.array_equal(wide, ~found.known.values)


def test_what_cannot_be_refined_is_refused(tmp_path):
    for changes, sentence in (
        ({"refine": 2.0}, "refine must be a number from 1e-12 to 0.5"),
        ({"pga": [2.0]}, "two scales or more, in increasing order"),
        ({"pga": [3.0, 2.0]}, "two scales or more, in increasing order"),
    ):
        with pytest.raises(rocking.InvalidOption, match=sentence):
            rocking.study(tmp_path / "study", BLOCKS, MOTIONS, **(OPTIONS | {"refine": 0.1} | changes))
        assert not (tmp_path / "study").exists()
    made(tmp_path / "study")
    with pytest.raises(rocking.StudyError, match=r"holds a study refined to 0\.001, not to 0\.01"):
        made(tmp_path / "study", refine=0.01)


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
    file.write_text(text)
    assert "refined to 0.0001 in" in run("study", "run", file)[1]
    assert json.loads(run("study", "status", folder, "--json")[1])["refinement"]["complete"]
    assert run("study", "export", folder, tmp_path / "critical.csv", "--critical")[0] == 0
    table = pandas.read_csv(tmp_path / "critical.csv")
    assert [*table.columns] == [
        *("change", "motion", "polarity", "block", "p_rad_s", "alpha_rad", "restitution"),
        *("pga_low_m_s2", "pga_high_m_s2", "overturns", "known"),
    ]
    assert table.block.tolist() == [0, 1, 2, 3]
    exact = rocking.incremental_dynamic_analysis(
        read_study(file).product.blocks, read_study(file).product.motions, levels=np.linspace(1, 9, 5), model="linear"
    )
    np.testing.assert_allclose(table.pga_high_m_s2, exact.band_start.values.ravel()[:4], rtol=1.1e-4)
