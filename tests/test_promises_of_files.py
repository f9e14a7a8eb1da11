"""Promises on files, the page's server, interrupts and full disks at a small size; and what they once found."""

import io
import sys

import pytest
from oracles import record_files
from promises import commands, full_disk, interrupts, reading, serving
from promises.promise import Found

import rocking
from rocking.calibration.tables import read_tests
from rocking.errors import OptionError, RecordError, RockingError
from rocking.inputs.quantities import read_array
from rocking.studies import read_study


@pytest.mark.parametrize("cases", [60, pytest.param(600, marks=pytest.mark.thorough)])
def test_a_damaged_file_is_refused_or_read_as_it_states(monkeypatch, cases):
    monkeypatch.setattr(reading, "CASES", cases)
    monkeypatch.setattr(reading, "PARTS", 1000)
    monkeypatch.setattr(reading, "_TRACED", 10**9)
    found = reading.judge(7)
    assert not found.told
    assert found.cases >= 100 + cases
    assert found.notes["compared"] >= cases // 20
    assert found.notes["refused"] >= cases // 2


def lost(text, start, end):
    """A text without the lines from the one that begins so, after the first, up to the first that begins otherwise."""
    lines = text.splitlines(keepends=True)
    first = next(k for k, line in enumerate(lines) if start in line)
    last = next(k for k, line in enumerate(lines) if k > first and end in line)
    return "".join(lines[:first] + lines[last:])


@pytest.mark.parametrize("form", ["v1", "v2"])
def test_a_channel_whose_header_has_lost_lines_does_not_pass_for_the_next_one(form):
    channels = [(1, " 90 Deg", [0.1, 0.2, -0.3]), (2, "Up", [0.05, -0.02, 0.01])]
    if form == "v1":
        short = lost(record_files.csmip_v1(channels), "Station No.", "Accelerogram points")
        found = reading.read_record("a", short.encode(), {})
        assert [len(each.acceleration) for each in found] == [3, 3]
        assert found[0].acceleration == pytest.approx([0.980665, 1.96133, -2.941995])
        none = lost(record_files.csmip_v1(channels), "Accelerogram points", "/&")
    else:
        none = lost(record_files.csmip_v2(channels), "points of accel", "points of veloc")
        untitled = record_files.csmip_v2(channels).rpartition("Corrected accelerogram")
        with pytest.raises(RecordError, match="title of the next channel"):
            reading.read_record("a", (untitled[0] + untitled[2]).encode(), {})
    with pytest.raises(RecordError, match=r"this header is not complete|specifies 6 values, but 0 follow"):
        reading.read_record("a", none.encode(), {})


@pytest.mark.parametrize("first", ["9" * 3000 + ",0.1", "0." + "0" * 600 + ",0.1"])
def test_a_first_row_of_endless_digits_is_no_heading(first):
    text = f"time (s), a (g)\n{first}\n0.01,0.2\n0.02,0.1\n0.03,0.0\n"
    with pytest.raises(RecordError, match="line 2"):
        rocking.read(io.BytesIO(text.encode()))


def test_a_name_that_no_file_can_have_is_refused_in_a_sentence(tmp_path):
    name, table, study = "9" * 3000, tmp_path / "tests.csv", tmp_path / "study.toml"
    table.write_text(f"motion,overturned,vertical\n{name},1,\nel-centro-meloland-270,1,{name}\n")
    study.write_text(f'[blocks]\np = 2.0\nalpha = 0.2\n[motions]\nrecords = ["{name}"]\n')
    for read, file in ((read_tests, table), (read_study, study)):
        with pytest.raises(RockingError, match=r"could not be read|there is no such file"):
            read(file)


@pytest.mark.parametrize("text", ["1:1e999:5", "-1e308:1e308:3", "1:1e999:5:log"])
def test_a_range_without_finite_ends_is_refused(text):
    with pytest.raises(OptionError, match=r"finite ends|positive ends"):
        read_array(text, "p")


def test_a_rate_of_an_endless_intensity_is_refused_without_a_warning(tmp_path):
    file = tmp_path / "hazard.csv"
    file.write_text("pga_g,annual_rate\n0.1,0.1\n1e308,0.01\n")
    with pytest.raises(OptionError):
        rocking.HazardCurve.read(file)


@pytest.mark.skipif(sys.platform != "linux", reason="processes are looked at as Linux shows them")
@pytest.mark.thorough
def test_the_server_answers_as_its_table_says(monkeypatch):
    monkeypatch.setattr(serving, "REQUESTS", 60)
    monkeypatch.setattr(serving, "NAMES", 8)
    monkeypatch.setattr(serving, "CONNECTIONS", 0)
    found = serving.judge(0)
    assert not found.told
    assert found.judged >= 60 + 8 * 3


@pytest.mark.skipif(sys.platform != "linux", reason="processor time of another process is read as on Linux")
@pytest.mark.slow
def test_an_interrupt_ends_a_command_with_one_sentence(tmp_path):
    # At a share of the processor time here and now: a quick machine is through in half a second.
    folders = [tmp_path / name for name in ("first", "whole", "ended")]
    for folder in folders:
        folder.mkdir()
    # The first may compile, or write what the others only read.
    seconds = min(interrupts.ended("records", folder, None).seconds for folder in folders[:2])
    found = Found()
    one = interrupts.ended("records", folders[2], 0.5 * seconds)
    interrupts._judge_end(found, "records", one, folders[2] / "out", {})
    assert not found.told
    assert found.notes["interrupted"] == 1


@pytest.mark.skipif(sys.platform != "linux", reason="where a descriptor leads is read as on Linux")
@pytest.mark.slow
def test_a_study_goes_on_after_a_full_disk(monkeypatch):
    monkeypatch.setattr(full_disk, "MOST", 1)
    found = full_disk.judge([*commands.COMMANDS].index("study run"))
    assert not found.told
    assert found.notes == dict.fromkeys([*full_disk.KINDS, "print"], 1)
