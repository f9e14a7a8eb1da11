"""The shipped records: what was published, to the last digit, without a network."""

import json
from pathlib import Path

import numpy as np
import pytest
import ship_records
from numpy.testing import assert_array_equal

from rocking import read, records
from rocking.core.constants import STANDARD_GRAVITY
from rocking.errors import RecordError
from rocking.records.named import load_motion, make_names_unique

ROOT = Path(__file__).resolve().parents[1]
DATA = ROOT / "src" / "rocking" / "records" / "data"

# As printed in the files' headers: g and s for Ridgecrest, cm/s^2 and s for El Centro.
PUBLISHED_PEAKS = {
    "ridgecrest-clc-090": (0.344 * STANDARD_GRAVITY, 234.36),
    "ridgecrest-clc-360": (0.511 * STANDARD_GRAVITY, 235.70),
    "ridgecrest-clc-up": (0.347 * STANDARD_GRAVITY, 234.39),
    "ridgecrest-tow2-090": (0.437 * STANDARD_GRAVITY, 33.78),
    "ridgecrest-tow2-360": (0.386 * STANDARD_GRAVITY, 33.76),
    "ridgecrest-tow2-up": (0.360 * STANDARD_GRAVITY, 31.88),
    "el-centro-meloland-360": (-3.0502, 4.06),
    "el-centro-meloland-270": (-2.9269, 5.16),
    "el-centro-meloland-up": (2.2509, 3.32),
}

FILES = {
    "CICLC.v1": ("ridgecrest-clc-090", "ridgecrest-clc-360", "ridgecrest-clc-up"),
    "CITOW2.RAW": ("ridgecrest-tow2-090", "ridgecrest-tow2-360", "ridgecrest-tow2-up"),
    "MELOLAND_CHAN15.V2": ("el-centro-meloland-360",),
    "MELOLAND_CHAN24.V2": ("el-centro-meloland-270",),
    "MELOLAND_CHAN14.V2": ("el-centro-meloland-up",),
}


def test_all_channels_of_three_stations_ship():
    assert sorted(records.names()) == sorted(PUBLISHED_PEAKS)


@pytest.mark.parametrize("name", PUBLISHED_PEAKS)
def test_the_peak_is_the_published_one(name):
    peak, time = PUBLISHED_PEAKS[name]
    acceleration = records.load(name).samples
    at = round(time / 0.01)
    assert acceleration[at] == pytest.approx(peak, abs=0.0005 * STANDARD_GRAVITY)
    assert np.abs(acceleration).argmax() == at


@pytest.mark.parametrize("name", PUBLISHED_PEAKS)
def test_a_record_says_where_it_comes_from(name):
    motion, record = records.load(name), records.info(name)
    assert motion.name == record.name == name
    assert motion.dt == record.dt == 0.01
    assert len(motion.breakpoints) == record.samples
    assert motion.error == 0.0
    assert motion.history == ()
    assert motion.description.family == "record"
    for fact in (record.event, record.station, record.direction, record.state, record.source, record.terms):
        assert fact
        assert fact in motion.description.text


@pytest.mark.parametrize("file", FILES)
def test_values_are_those_of_the_published_file(file, shared):
    from rocking.records import channels

    found = channels(shared / "records" / "shippable" / file)
    assert len(found) == len(FILES[file])
    for channel, name in zip(found, FILES[file], strict=True):
        times, acceleration = records.load(name).times, records.load(name).samples
        assert_array_equal(acceleration[:-1], channel.acceleration[:-1])
        assert acceleration[-1] == pytest.approx(channel.acceleration[-1], rel=1e-12)
        assert channel.dt == times[1]


def test_the_conversion_script_makes_the_shipped_files(shared, tmp_path, monkeypatch):
    monkeypatch.setattr(ship_records, "DATA", tmp_path)
    monkeypatch.setattr("sys.argv", ["ship_records.py", str(shared / "records" / "shippable")])
    ship_records.main()
    assert (tmp_path / "catalogue.json").read_text() == (DATA / "catalogue.json").read_text()
    for archive in sorted(tmp_path.glob("*.npz")):
        with np.load(archive) as made, np.load(DATA / archive.name) as shipped:
            assert made.files == shipped.files
            for channel in made.files:
                assert_array_equal(made[channel], shipped[channel])


def test_the_shipped_files_are_small_and_name_their_sources():
    assert sum(file.stat().st_size for file in DATA.iterdir()) < 600_000
    sources = (DATA / "SOURCES.md").read_text("utf-8")
    for record in json.loads((DATA / "catalogue.json").read_text("utf-8")).values():
        assert record["terms"] in sources
        assert record["source"] in sources


def test_an_unknown_name_is_answered_with_a_near_one():
    with pytest.raises(RecordError, match="did you mean the shipped record ridgecrest-clc-090"):
        read("ridgecrest-clc-90")
    with pytest.raises(RecordError, match="shipped record ridgecrest-clc-090 or ridgecrest-clc-360"):
        read("ridgecrest-clc")
    with pytest.raises(RecordError, match="did you mean el-centro-meloland-360 or el-centro-meloland-270"):
        records.load("el-centro")
    for typed, meant in (("ridgecrest-clc-u", "clc-up"), ("ridgecrst-clc-up", "clc-up"), ("rigecrest-clc", r"[^ ]*\d")):
        with pytest.raises(RecordError, match=rf"did you mean ridgecrest-{meant}\?"):
            records.load(typed)
    with pytest.raises(RecordError, match="there are ridgecrest-clc-090, "):
        records.load("zzz")


@pytest.mark.parametrize("scale", [1.0, 2.5, 0.5])
def test_a_record_by_name_is_multiplied_by_its_scale(scale, tmp_path):
    path = tmp_path / "record.csv"
    path.write_text("time (s),a (g)\n" + "".join(f"{0.01 * k:.2f},{0.1 * (k % 7 - 3):.3f}\n" for k in range(40)))
    for name, base in (("el-centro-meloland-270", records.load("el-centro-meloland-270")), (str(path), read(path))):
        found = load_motion(f"{name} x {scale}")
        assert np.array_equal(found.coefficients, scale * base.coefficients)
        assert found.name == base.name


def test_numbers_of_names_leave_names_that_are_there():
    assert make_names_unique(["a", "a", "a #1"]) == ["a #2", "a #3", "a #1"]
    assert make_names_unique(["a #2", "a", "b", "a"]) == ["a #2", "a #1", "b", "a #3"]
