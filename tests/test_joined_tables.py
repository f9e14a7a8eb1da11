"""Tables of different commands on the same records can be joined, and say of what and under what they are."""

import json
import math

import numpy as np
import pandas as pd
import pytest

import rocking
from rocking.analysis.survey import survey
from rocking.inputs import quantities

SIZES = ["--width", "0.24", "--height", "1.1"]
AT2 = """PEER NGA STRONG MOTION DATABASE RECORD
KOBE 01/16/95 2046, {station}, {channel}
ACCELERATION TIME HISTORY IN UNITS OF G
NPTS= {count}, DT= .01000 SEC
{values}
"""


@pytest.fixture
def folder(tmp_path):
    """Three records, of which two have the same title, and a file that is none."""
    records = tmp_path / "recs"
    records.mkdir()
    times = 0.01 * np.arange(600)
    for k, (name, channel) in enumerate((("NIS000", "000"), ("NIS090", "090"), ("copy090", "090"))):
        values = (0.3 + 0.1 * k) * np.sin(2.0 * np.pi * (0.8 + 0.2 * k) * times)
        text = AT2.format(
            station="NISHI-AKASHI", channel=channel, count=len(values), values="\n".join(f"{v:.6E}" for v in values)
        )
        (records / f"{name}.AT2").write_text(text)
    (records / "notes.txt").write_text("these are no numbers\n")
    return records


def table(path, **options):
    return pd.read_csv(path, **options)


@pytest.mark.slow
def test_the_tables_of_all_commands_join_by_record_and_by_motion(run, folder, tmp_path):
    out = {name: tmp_path / name for name in ("simulate", "check", "ida", "spectrum", "measures", "fragility")}
    common = [folder, "--keep-going", "--quiet"]
    extra = {
        "check": [*SIZES, "--rules", "west"],
        "spectrum": ["--alpha", "0.2", "--p", "2,3"],
        "ida": [*SIZES, "--tolerance", "1e-2"],
        "fragility": [*SIZES, "--levels", "0.22g:0.5g:57"],
    }
    for command, target in out.items():
        code, _, err = run(command, *common, *extra.get(command, SIZES), "--out", target)
        assert (code, err) == (0, ""), command
    summary = table(out["simulate"] / "summary.csv")
    known = summary[summary.motion.notna()].set_index("record").motion.to_dict()
    assert len(known) == len(set(known.values())) == 3
    assert all(path.endswith(".AT2") for path in known)
    for path in (
        out["check"] / "check.csv",
        out["ida"] / "levels.csv",
        out["spectrum"] / "peaks.csv",
        out["measures"] / "intensities.csv",
        out["fragility"] / "outcomes.csv",
    ):
        found = table(path).dropna(subset="motion")
        assert dict(zip(found.record, found.motion, strict=True)) == known, path.name
    bands = table(out["ida"] / "bands.csv")
    assert {(row.record, row.motion) for row in bands.itertuples()} <= set(known.items())
    levels = table(out["ida"] / "levels.csv")
    assert len(bands.merge(levels.drop_duplicates(["record", "motion", "block"]))) == len(bands) > 0
    for command, target in out.items():
        result = json.loads((target / ("summary.json" if command == "simulate" else "result.json")).read_text())
        assert {row["record"]: row["motion"] for row in result["records"]} == known, command
        assert [*result["skipped"]] == [str(folder / "notes.txt")], command


def test_a_table_of_many_records_names_block_friction_and_what_was_skipped(run, folder, tmp_path):
    out = tmp_path / "out"
    code, text, _ = run("simulate", folder, *SIZES, "--keep-going", "--available-friction", "0.3", "--out", out)
    assert code == 0
    assert "1 record skipped" in text
    summary = table(out / "summary.csv").set_index("record")
    skipped, read = summary.loc[str(folder / "notes.txt")], summary.loc[str(folder / "NIS000.AT2")]
    assert skipped.verdict.startswith("skipped: ")
    assert pd.isna(skipped.overturned) and pd.isna(skipped.rests)
    block = rocking.Block(width=0.24, height=1.1)
    assert (read.block, read.available_friction) == ("rectangular block, 0.24 m x 1.1 m", 0.3)
    assert (read.p_rad_s, read.alpha_rad, read.restitution) == pytest.approx((block.p, block.alpha, block.restitution))
    counts = table(out / "summary.csv", dtype=str).set_index("record")
    assert counts.rests[str(folder / "NIS000.AT2")].isdecimal()
    assert json.loads((out / "summary.json").read_text())["available_friction"] == 0.3
    pytest.importorskip("openpyxl")
    sheet = pd.read_excel(out / "summary.xlsx", index_col="record")
    assert [*sheet.columns] == [*summary.columns]
    assert sheet.verdict.to_dict() == summary.verdict.to_dict()


@pytest.mark.thorough
def test_the_tables_of_one_block_name_the_vertical_components(run, tmp_path):
    names, vertical = ["el-centro-meloland-270", "el-centro-meloland-360"], "el-centro-meloland-up"
    for command, file in (("simulate", "summary.csv"), ("check", "check.csv")):
        out = tmp_path / command
        assert run(command, *names, *SIZES, "--vertical", vertical, "--out", out)[0] == 0
        assert table(out / file).vertical.tolist() == [vertical, vertical]
        rows = json.loads((out / file.replace("check.csv", "result.json").replace(".csv", ".json")).read_text())
        assert {row["vertical"] for row in rows["records"]} == {vertical}
    assert run("check", *names, *SIZES, "--rules", "west", "--out", tmp_path / "none")[0] == 0
    assert "vertical" not in table(tmp_path / "none" / "check.csv")


def test_a_block_that_overturns_has_no_largest_rotation_in_any_table(tmp_path):
    """As pi/2 over its slenderness it counted for 7.3 in every mean."""
    block = rocking.Block(width=0.24, height=1.1)
    motions = {"falls": rocking.pulses.one_sine(3.0, 1.0), "stands": rocking.pulses.one_sine(3.0, 2.0)}
    found = survey(block, motions)
    peaks = [row["peak_over_slenderness"] for row in found.rows()]
    assert peaks[0] == math.inf and 0.0 < peaks[1] < 1.0
    found.to_csv(tmp_path / "summary.csv")
    assert table(tmp_path / "summary.csv").peak_over_slenderness.tolist() == pytest.approx(peaks)
    fallen = found.responses[0]
    assert fallen.to_dict()["peak_over_slenderness"] is None
    assert "of the slenderness" not in fallen.summary()
    assert f"{fallen.peak_rotation:.4f}" == f"{math.pi / 2:.4f}"


@pytest.mark.thorough
def test_numbers_are_written_as_people_write_them(run, undrawn, tmp_path):
    assert quantities.read_array("0.1:1:10", "--levels").tolist() == [0.1, 0.2, 0.3, 0.4, 0.5, 0.6, 0.7, 0.8, 0.9, 1.0]
    assert quantities.read_array("0.001:1000:7:log", "--p").tolist() == [0.001, 0.01, 0.1, 1.0, 10.0, 100.0, 1000.0]
    names = ["el-centro-meloland-270", "el-centro-meloland-360"]
    for command, several in (("simulate", names), ("check", names[:1])):
        out = tmp_path / command
        assert run(command, *several, *SIZES, "--pga", "0.3g", "--out", out)[0] == 0
        for file in out.iterdir():
            if file.suffix in (".csv", ".json"):
                assert "0.3000000000" not in file.read_text() and "0.29999999" not in file.read_text(), file.name
