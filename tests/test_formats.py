"""Readers of strong-motion records: what each format says comes out, and what is wrong with a file is said."""

import calendar
import contextlib
import io
import os
import pickle
import sys
import tempfile
import time
import tracemalloc
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import format_table
import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from oracles import record_files as written
from oracles.damaged_files import TOKENS

from rocking import records
from rocking.analysis.levels import assign_clusters
from rocking.errors import MotionError, RecordError, RockingError
from rocking.records import channels, formats, identify, read
from rocking.records.formats import source, through_obspy
from rocking.records.formats.channel import find_missing_value, fit_even_step
from rocking.records.formats.source import Request
from rocking.records.named import load_vertical

GRAVITY = 9.80665
SERIES = np.array(written.series(1)) / 100.0


@pytest.fixture
def file(tmp_path: Path) -> Callable[[str | bytes], Path]:
    """Write a file and return its path; the name tells nothing about its format."""

    def write(content: str | bytes) -> Path:
        path = tmp_path / "record.dat"
        path.write_bytes(content.encode("latin-1") if isinstance(content, str) else content)
        return path

    return write


def complaint(path: Path | str, error: type[RockingError] = RecordError, **request: object) -> str:
    """The message with which reading fails."""
    with pytest.raises(error) as caught:
        read(path, **request)
    message = str(caught.value)
    assert "\n" not in message
    assert not message.endswith(".")
    return message


# The fixtures


#: What the fixtures hold that are no records of acceleration: the words of their refusal.
REFUSED = {
    "nga.vt2": "line 4: this PEER AT2 file contains 'velocity'; use the file of the acceleration",
    "nga.dt2": "line 4: this PEER AT2 file contains 'displacement'",
    "velocity.smc": "this USGS SMC file contains 'velocity'",
    "velocity.asc": "this ESM file contains 'velocity'",
    "velocity.v2c": "this COSMOS file contains 'velocity'",
    "raw.v0c": "this COSMOS file contains 'raw accel.'",
}

#: Those of records with a header.
HEADED = sorted(written.fixtures().keys() - REFUSED.keys() - {"times.csv", "column.txt"})


def test_fixtures_are_what_their_writer_writes() -> None:
    assert len(written.fixtures()) >= 20
    assert {path.name for path in written.FOLDER.iterdir()} == written.fixtures().keys()
    for name, content in written.fixtures().items():
        assert (written.FOLDER / name).read_bytes() == content.encode(), name


def test_the_table_of_formats_is_that_of_the_declarations() -> None:
    page = format_table.PAGE.read_text("utf-8")
    assert format_table.update_page(page) == page


def test_every_format_has_a_fixture_and_stands_in_the_reference_the_how_to_and_the_docstring() -> None:
    names = {identify(written.FOLDER / fixture).format for fixture in written.fixtures().keys() - REFUSED.keys()}
    assert names == {each.name for each in formats.load_formats()} | {"text table"}
    docs = Path(__file__).parents[1] / "docs"
    reference, how_to = (
        (docs / each).read_text("utf-8") for each in ("reference/records.md", "howto/read-a-record.md")
    )
    for name in names:
        assert f"`{name}`" in reference, name
        for word in name.split("/")[0].split():
            assert word in how_to and word in (read.__doc__ or ""), name


@pytest.mark.parametrize(
    ("name", "form", "channel", "resolution"),
    [
        ("nga.at2", "PEER AT2", None, 1e-7 * GRAVITY), ("old.at2", "PEER AT2", None, 1e-7 * GRAVITY),
        ("two.v1", "CSMIP V1", 1, 1e-6 * GRAVITY), ("pairs.v1", "CSMIP V1", "EW", 1e-4 * GRAVITY),
        ("two.v2", "CSMIP V2", 1, 1e-7), ("two.v2c", "COSMOS", 1, 1e-7), ("single.v2c", "COSMOS", None, 1e-6),
        ("even.smc", "USGS SMC", None, 1e-4), ("esm.asc", "ESM", None, 1e-8),
        ("padded.smc", "USGS SMC", None, 1e-4), ("even.v1", "CSMIP V1", "90 Deg", 1e-6 * GRAVITY),
        ("geonet.v1a", "GeoNet", "N10E", 1e-4), ("bhrc.v1", "BHRC", "L1", 1e-6 * GRAVITY),
        ("unam.txt", "UNAM", "N00E", 1e-6), ("csmnc.dat", "CSMNC", "EW", 2e-6),
        ("npts.txt", "NPTS DT", None, 1e-6 * GRAVITY), ("wrapped.g3", "NPTS DT", None, 1e-6 * GRAVITY),
    ],
)  # fmt: skip
def test_a_record_comes_out_as_printed(name: str, form: str, channel: int | str | None, resolution: float) -> None:
    path = written.FOLDER / name
    motion = read(path, channel=channel)
    times, acceleration = motion.times, motion.samples
    assert identify(path).format == form
    assert motion.dt == 0.005
    np.testing.assert_allclose(times, 0.005 * np.arange(written.POINTS), atol=1e-15)
    np.testing.assert_allclose(acceleration, SERIES, rtol=0.0, atol=0.51 * resolution)


@pytest.mark.parametrize(
    ("name", "form", "channel", "dt", "azimuth", "resolution"),
    [
        ("geonet.v2a", "GeoNet", "S16W", 0.02, 196.0, 1e-4), ("afad.txt", "AFAD", "N-S", 0.01, 0.0, 1e-8),
        ("cwa.dat", "CWA", "N", 0.02, 0.0, 1e-5), ("sesame.saf", "SESAME SAF", "N", 0.02, 0.0, 1e-4),
        ("usc.s0b", "CSMIP V2", "N08W", 0.02, 352.0, 1e-5), ("usc.s0a", "USC", "S05W", None, 185.0, 1e-4 * GRAVITY),
        ("bhrc.v1", "BHRC", "T3", 0.005, 82.0, None), ("bhrc.v1", "BHRC", "V2", 0.005, None, None),
        ("unam.txt", "UNAM", "N90W", 0.005, 270.0, None), ("geonet.v1a", "GeoNet", "N80W", 0.005, 280.0, None),
    ],
)  # fmt: skip
def test_a_component_of_a_station_comes_out_as_printed(name, form, channel, dt, azimuth, resolution) -> None:
    path = written.FOLDER / name
    (found,) = (each for each in channels(path) if each.name == channel)
    assert (identify(path).format, found.dt, found.azimuth) == (form, dt, azimuth)
    assert (found.times is None) == (dt is not None)
    if resolution is not None:
        count = len(found.acceleration)
        wanted = np.array(written.series(1, count)) / (1.0 if form == "SESAME SAF" else 100.0)
        assert count == (105 if form == "CWA" else written.POINTS)
        np.testing.assert_allclose(found.acceleration, wanted, rtol=0.0, atol=0.51 * resolution)


def changed(name: str, old: str, new: str) -> str:
    """A fixture with each of a text replaced by another."""
    text = (written.FOLDER / name).read_text()
    assert old in text
    return text.replace(old, new)


#: Of every format: a count, a step and a unit that the numbers contradict, and the sentence.
CONTRADICTED = {
    "nga.at2": [("NPTS=     37", "NPTS=     36", "the header specifies 36 values, but 37 follow; remove")],
    "even.v1": [
        ("37 points", "36 points", "the header specifies both 36 and 37 values"),
        ("at .005 sec", "at .010 sec", "a sampling step of both 0.005 and 0.01 s"),
        ("(units: g)", "(units: cm/s2)", "the header states a peak of 2.363 m/s^2, but the largest value is 0.00"),
    ],
    "two.v1": [("at 200 pts/sec", "at 100 pts/sec", "a sampling step of both 0.005 and 0.01 s")],
    "two.v2": [("37 points", "38 points", "the header specifies 38 values, but 37 follow; download")],
    "padded.smc": [("        37", "        31", "the header specifies 31 values, but 40 follow; remove")],
    "usc.s0a": [
        ("POINTS =     37", "POINTS =     38", "the header specifies 76 values, but 74 follow; download"),
        ("SEC AND G/10", "SEC AND FURLONG", "the units 'FURLONG' are unknown"),
    ],
    "usc.s0b": [
        ("37 POINTS", "36 POINTS", "the header specifies 36 values, but 37 follow; remove"),
        ("AT   .020 SEC.", "AT   .020 SEC. IN UNITS G", "the header states a peak of 2.359 m/s^2, but"),
    ],
    "geonet.v1a": [
        ("points  37", "points  36", "the header specifies both 36 and 37 values"),
        ("of 0.005 s", "of 0.010 s", "37 values in steps of 0.01 s do not last the stated 0.18 s"),
        ("1.00 mm/s/s", "1.00 cm/s/s", "but the largest value is"),
    ],
    "bhrc.v1": [
        ("POINTS =     37", "POINTS =     36", "the header specifies 36 values, but "),
        ("SECONDS AND G/10", "SECONDS AND LEAGUES", "the units 'LEAGUES' are unknown"),
    ],
    "cwa.dat": [
        ("RecordLength(sec): 2", "RecordLength(sec): 3", "the header specifies 600 values, but 420 follow"),
        ("SampleRate(Hz): 50", "SampleRate(Hz): 40", "a sampling step of 0.025 s, but the times are in other steps"),
        ("  235.852~", " 9235.852~", "the header states a peak of 92.36 m/s^2, but the largest value is 2.359 m/s^2"),
    ],
    "afad.txt": [
        ("DATA          : 37", "DATA          : 36", "the header specifies 108 values, but 111 follow; remove"),
        ("(sec) : 0.01", "(sec) : zero", "expected a positive number in 'SAMPLING INTERVAL (sec) : zero'"),
        ("VALUES (gal)", "VALUES (furlong)", "the units 'furlong' are unknown"),
    ],
    "unam.txt": [
        ("/37/37/37", "/33/33/33", "33 values in steps of 0.005 s do not last the stated 0.18 s"),
        ("/0.005/0.005", "/0.01/0.01", "a sampling step of both 0.005 and 0.01 s"),
        ("235.8518", "23.58518", "but the largest value is"),
    ],
    "csmnc.dat": [
        ("POINTS:  37", "POINTS:  36", "the header specifies 36 values, but 37 follow; remove"),
        ("OF:  0.005", "OF:  0.01", "37 values in steps of 0.01 s do not last the stated 0.185 s"),
        ("235.852", "2358.52", "the header states a peak of 23.59 m/s^2, but the largest value is 2.359"),
    ],
    "sesame.saf": [
        ("NDAT = 0000000037", "NDAT = 38", "the header specifies 114 values, but 111 follow; download"),
        ("UNITS = m/s2", "UNITS = counts", "the file does not state its units"),
        ("SAMP_FREQ = 50", "SAMP_FREQ = 0", "expected a positive number in 'SAMP_FREQ = 0'"),
    ],
    "npts.txt": [("37 0.0050", "38 0.0050", "the header specifies 38 values, but 37 follow; download")],
}  # fmt: skip


@pytest.mark.parametrize(("name", "case"), [(name, case) for name, cases in CONTRADICTED.items() for case in cases])
def test_a_count_step_or_unit_that_the_numbers_contradict_is_refused(name: str, case, file) -> None:
    old, new, sentence = case
    text = changed(name, old, new)
    with pytest.raises(RecordError) as caught:
        channels(file(text))
    assert sentence in str(caught.value)
    assert caught.value.line is None or 0 < caught.value.line <= text.count("\n")


def test_every_new_format_is_contradicted_in_a_test() -> None:
    names = {identify(written.FOLDER / name).format for name in CONTRADICTED}
    assert {form.name for form in formats.load_formats()} - names == {"COSMOS", "ESM", "K-NET/KiK-net"}  # tested below


def test_the_examples_of_layouts_are_read_as_they_state(shared: Path) -> None:
    folder, found = shared / "cases" / "records", {}
    for path in sorted(folder.iterdir()):
        found[path.name] = channels(path, **({"units": "g"} if path.name == "npts_dt.txt" else {}))
    wanted = {
        "afad.txt": 0.01,
        "bhrc.V1": 0.005,
        "csmip_equally_spaced.V1": 0.005,
        "csmnc.dat": 0.005,
        "geonet.V1A": 0.005,
    }
    for name, dt in (wanted | {"mexico_long_header.txt": 0.01, "npts_dt.txt": 0.01}).items():
        assert {(each.dt, len(each.acceleration)) for each in found[name]} == {(dt, 60)}, name
    assert [each.name for each in found["mexico_long_header.txt"]] == ["V", "N00E", "N90E"]
    (smc,) = found["smc_padded.smc"]
    assert (smc.dt, len(smc.acceleration)) == (0.0015, 28)
    assert found["csmnc.dat"][0].acceleration.min() == pytest.approx(-0.9523526)


def test_every_number_is_the_double_nearest_to_the_printed_one() -> None:
    printed = [float(line) for line in (written.FOLDER / "esm.asc").read_text().splitlines()[-written.POINTS :]]
    (channel,) = channels(written.FOLDER / "esm.asc")
    assert channel.acceleration.tolist() == [value / 100.0 for value in printed]


def test_columns_that_touch_are_split_by_the_stated_format() -> None:
    text = (written.FOLDER / "two.v2c").read_text()
    assert "1234.50000" in text
    assert "-250.12500-999.50000" in text.replace("1234.50000  -0.50000", "") or "-.50000-999.50000" in text
    motion = read(written.FOLDER / "two.v2c", channel="Up")
    assert motion.samples[:5].tolist() == [-1.5025, -2.50125, 12.345, -0.005, -9.995]


def test_film_records_keep_their_uneven_times() -> None:
    (film,) = channels(written.FOLDER / "film.smc")
    assert film.dt is None
    assert film.times is not None
    np.testing.assert_allclose(film.times, written.film_times(), atol=1e-12)
    assert film.motion().dt is None
    even, uneven = channels(written.FOLDER / "pairs.v1")
    assert (even.dt, even.times) == (0.005, None)
    assert uneven.times is not None
    np.testing.assert_allclose(uneven.times, written.film_times(), atol=1e-12)
    assert uneven.motion().duration == pytest.approx(written.film_times()[-1])


def test_an_instant_of_a_film_that_is_printed_twice_has_the_mean_of_its_values(file: Callable[[str], Path]) -> None:
    times = [round(0.002 * k + 0.0005 * (k % 3 == 1), 4) for k in range(2000)]
    values = written.series(1, 2000)
    wanted = list(values)
    for k in (500, 1501):
        times[k] = times[k - 1]
        wanted[k - 1] = 0.5 * (values[k - 1] + values[k])
    kept = [k for k in range(2000) if k not in (500, 1501)]
    pairs = [x for pair in zip(times, values, strict=True) for x in pair]
    (channel,) = channels(file(written.smc(pairs, rate=None)))
    assert channel.times is not None
    np.testing.assert_allclose(channel.times, np.array(times)[kept], rtol=1e-12)
    np.testing.assert_allclose(channel.acceleration, np.array(wanted)[kept] / 100.0, rtol=0.0, atol=1e-4)
    for k in (502, 1503):
        pairs[2 * k] = pairs[2 * (k - 1)]
    assert "the time does not increase" in complaint(file(written.smc(pairs, rate=None)))


def test_labels_of_a_channel() -> None:
    first, up = channels(written.FOLDER / "two.v1")
    assert (first.name, first.number, first.azimuth, first.station) == ("90 Deg", 1, 90.0, "Testville - Town Hall")
    assert (up.name, up.number, up.azimuth) == ("Up", 2, None)
    assert first.metadata["location"] == "Ground"
    assert first.metadata["station channel"] == "5"
    (hne,) = channels(written.FOLDER / "esm.asc")
    assert (hne.name, hne.azimuth, hne.units, hne.station) == ("HNE", 90.0, "cm/s^2", "TT.TST1")
    (smc,) = channels(written.FOLDER / "even.smc")
    assert (smc.name, smc.azimuth, smc.station) == ("090", 90.0, "Testville Town Hall")
    (at2,) = channels(written.FOLDER / "nga.at2")
    assert (at2.name, at2.station, at2.event, at2.units) == ("090", "Town Hall", "Somewhere-01, 1/2/1999", "G")
    cosmos = channels(written.FOLDER / "two.v2c")[1]
    assert (cosmos.name, cosmos.number, cosmos.azimuth) == ("Up", 2, None)
    assert cosmos.metadata["location"] == "Ground floor"


@pytest.mark.parametrize(
    ("direction", "name", "azimuth"),
    [
        *((each, each, azimuth) for each, azimuth in (("N-S", 0.0), ("E-W", 90.0), ("U-D", None))),
        *(("1", "N-S borehole", 0.0), ("2", "E-W borehole", 90.0), ("3", "U-D borehole", None)),
        *(("4", "N-S", 0.0), ("5", "E-W", 90.0), ("6", "U-D", None)),
    ],
)
def test_every_sensor_of_knet_and_kik_net_has_its_name_and_azimuth(
    direction: str, name: str, azimuth: float | None, file: Callable[[str], Path]
) -> None:
    (channel,) = channels(file(written.knet(list(range(100)), direction=direction)))
    assert (channel.name, channel.azimuth) == (name, azimuth)


@pytest.mark.parametrize(("stream", "azimuth"), [("HNN", 0.0), ("HNE", 90.0), ("HNZ", None), ("HN1", None)])
def test_every_component_of_esm_has_its_azimuth(
    stream: str, azimuth: float | None, file: Callable[[str], Path]
) -> None:
    (channel,) = channels(file(written.esm(written.series(1)).replace("STREAM: HNE", f"STREAM: {stream}")))
    assert (channel.name, channel.azimuth) == (stream, azimuth)


def test_smc_of_more_digits_has_fewer_columns(file: Callable[[str], Path]) -> None:
    integers = [-32768] * 48
    text = written.smc([1.0] * 7).splitlines()
    integers[15], integers[16], integers[46] = 2, 7, 8
    values = [-1234.567891, 2345.678912, -3.456789, 4.5, -5.5, 6.5, -7.5]
    text[11:17] = written.rows([f"{each:10d}" for each in integers], 8).splitlines()
    text[-1:] = written.rows([f"{each:14.7E}" for each in values], 5).splitlines()
    (channel,) = channels(file("\n".join([*text, ""])))
    assert channel.acceleration == pytest.approx(0.01 * np.array(values), rel=1e-7)


@pytest.mark.filterwarnings("ignore")
def test_counts_are_multiplied_by_the_calibration_of_their_file(
    monkeypatch: pytest.MonkeyPatch, file: Callable[[bytes], Path]
) -> None:
    obspy = pytest.importorskip("obspy")
    stream = obspy.Stream([obspy.Trace(np.arange(9.0), {"calib": by, "channel": f"HN{by}"}) for by in (1.0, -2.5)])
    monkeypatch.setattr(through_obspy, "_read_traces", lambda *_, **__: stream)
    one, other = channels(file(waveform("MSEED", 900)), units="m/s2")
    assert np.array_equal(other.acceleration, -2.5 * one.acceleration) and one.acceleration[-1] == 8.0


# Channels


def test_one_channel_is_chosen_by_number_or_name() -> None:
    path = written.FOLDER / "two.v1"
    up = read(path, channel=2).pga
    for same in ("2", "Up", "UP", " up "):
        assert read(path, channel=same).pga == up
    assert read(path, channel="90").pga == read(path, channel="90 deg").pga == read(path, channel=1).pga != up
    assert read(written.FOLDER / "nga.at2", channel=1).pga == read(written.FOLDER / "nga.at2").pga


def test_the_vertical_motion_is_a_channel_by_its_name_whatever_the_horizontal_one_is() -> None:
    path, single = written.FOLDER / "two.v1", written.FOLDER / "nga.at2"
    for several in (False, True):
        for horizontal in (1, "90 Deg", None):
            request = Request.create(channel=horizontal, are_defaults=several)
            assert load_vertical("Up", str(path), request).pga == read(path, channel="Up").pga
        for file in (path, single):
            with pytest.raises(RecordError, match="no channel, file or shipped record 'north'; give one of 1 '"):
                load_vertical("north", str(file), Request.create(are_defaults=several))


# PEER


@pytest.mark.parametrize(
    "sizes",
    [
        "NPTS=   37, DT= .0050 SEC,",
        "NPTS=     37, DT=   .0050 SEC",
        "NPTS=37,DT=.005",
        "NPTS = 37 , DT = 0.005 SEC",
        "npts=   37, dt=   5.0e-3 sec",
        "NPTS=    37, DT=  5.000D-03 SEC",
        "NPTS: 37 DT: 0.005",
        "   37    0.0050    NPTS, DT",
        "   37    .00500    NPTS,DT",
        "37, 0.005, npts, dt",
        "   37    0.0050    NPTS, DT   FILTER POINTS: HP=0.20 Hz LP=25.0 Hz",
    ],
)
def test_at2_headers_of_all_shapes(sizes: str, file: Callable[[str], Path]) -> None:
    motion = read(file(written.at2((SERIES / GRAVITY).tolist(), sizes)))
    assert motion.dt == 0.005
    assert len(motion.times) == 37


def test_labels_of_at2_are_on_the_second_line_of_the_file(file: Callable[[str], Path]) -> None:
    title, *rest = written.at2([0.1, -0.2], "NPTS= 2, DT= .01").splitlines(keepends=True)
    for first in (title, "\n"):
        assert channels(file("".join([first, *rest])))[0].station == "Town Hall"


def test_at2_may_touch_and_may_lack_the_units_line(file: Callable[[str], Path]) -> None:
    packed = "".join(f"{value:15.8E}" for value in (-0.5, -0.25, 0.125, -0.0625, -0.03125)) + "\n"
    text = f"header\nNPTS=5, DT=.01\n{packed}"
    assert "does not state its units; give units as" in complaint(file(text))
    assert read(file(text), units="m/s2").samples.tolist() == [-0.5, -0.25, 0.125, -0.0625, -0.03125]


def test_a_damaged_number_is_named_with_its_line(file: Callable[[str], Path]) -> None:
    text = (written.FOLDER / "nga.at2").read_text().splitlines(keepends=True)
    damaged = text[6].split()[2]
    for bad in (".12x4567E-01", "NaN", "-inf", "1E999", "--.1", "1_0", "0x10", "********", "\xb5"):
        lines = [*text[:6], text[6].replace(damaged, bad), *text[7:]]
        message = complaint(file("".join(lines)))
        assert f"line 7: {bad!r} is not a" in message


# COSMOS, CSMIP, SMC, K-NET, ESM


def test_cosmos_in_g(file: Callable[[str], Path]) -> None:
    motion = read(file(written.cosmos((SERIES / GRAVITY).tolist(), units="g (02)")))
    np.testing.assert_allclose(motion.samples, SERIES, atol=0.51e-5 * GRAVITY)


def test_csmip_v2_takes_the_finer_step_of_the_real_header(file: Callable[[str], Path]) -> None:
    path = file(written.csmip_v2([(1, "Up", written.series(1))], dt=0.0078125))
    assert " .008 sec" in path.read_text()
    assert read(path).dt == 0.0078125
    other = path.read_text().replace(" .0078125", " .0200000")
    assert read(file(other)).dt == 0.008


@pytest.mark.parametrize("title", ["1 UNCORRECTED ACCELEROGRAM", "2 CORRECTED ACCELEROGRAM"])
@pytest.mark.parametrize("rate", [200.0, None])
@pytest.mark.parametrize("padding", [0, 1, 3, 8, 9])
@pytest.mark.parametrize("count", [40, 42])
def test_the_first_values_of_smc_are_the_record(title, rate, padding: int, count: int, file) -> None:
    """Whether the row that follows them is a part of another one, or whole."""
    values = [value for k in range(count // 2) for value in (0.003 * k * (1 + 0.01 * k), written.series(1)[k])]
    padded = written.smc(values, rate=rate, title=title) + "".join(
        f"{4.0 + k:10.4f}" + "\n" * (k == 7) for k in range(padding)
    )
    if padding == 9:
        assert f"the header specifies {count} values, but {count + 9} follow" in complaint(file(padded))
        return
    (plain,), (channel,) = channels(file(written.smc(values, rate=rate, title=title))), channels(file(padded))
    np.testing.assert_array_equal(channel.acceleration, plain.acceleration)
    np.testing.assert_array_equal(channel.times, plain.times)


@pytest.mark.parametrize("form", ["CSMIP V1", "SMC"])
def test_uneven_times_contradict_a_step(form: str, file: Callable[[str], Path]) -> None:
    times = [0.005 * k + 0.002 * (k % 3 == 1) for k in range(40)]
    pairs = [x for pair in zip(times, written.series(1) + [0.0] * 3, strict=True) for x in pair]
    v1 = written.csmip_v1_pairs([(1, "90 Deg", times, [x / 1000.0 for x in pairs[1::2]])])
    path = file(v1 if form == "CSMIP V1" else written.smc(pairs, rate=None))
    assert channels(path)[0].times is not None
    assert "the times are not evenly 0.02 s apart; omit dt" in complaint(path, dt=0.02)
    request = source.Request.create(0.02, None, are_defaults=True)
    assert formats.read_channel(path, request).times is not None


def test_times_printed_with_few_digits_have_the_step_that_is_given(file: Callable[[str], Path]) -> None:
    step = 1.0 / 640.0
    pairs = [x for k, value in enumerate(written.series(1)) for x in (round(100.0 + step * k, 3), value)]
    path = file(written.csmip_v1_pairs([(1, "Up", pairs[0::2], [x / 1000.0 for x in pairs[1::2]])]))
    assert channels(path)[0].dt is None and channels(path, dt=step)[0].dt == step


@pytest.mark.parametrize("owner", [" (CDMG STATION 54428)", " (CWB)", "(CUE)", ", (CWB)", " (CWB, TAIWAN)", ""])
@pytest.mark.parametrize("date", ["", " 9/20/1999,"])
@pytest.mark.parametrize("place", ["TCU068", "PACOIMA DAM (UPPER LEFT)"])
def test_the_owner_at_the_end_of_a_title_of_at2_is_no_part_of_the_component(owner, date, place, file) -> None:
    components = {}
    for name, azimuth in (("360", 0.0), ("090", 90.0), ("UP", None)):
        title = f"CHI-CHI 09/20/99,{date} {place}, {name}{owner}"
        text = written.at2([0.1, -0.2], "NPTS= 2, DT= .01").replace("Somewhere-01, 1/2/1999, Town Hall, 090", title)
        (channel,) = channels(file(text))
        assert (channel.name, channel.azimuth, channel.station) == (name, azimuth, place)
        assert channel.metadata.get("station line", "") == owner.strip(" ,()")
        components[name] = channel.motion()
    assert assign_clusters(list(components.values()), "station").tolist() == [0, 0, 0]


def test_counts_keep_their_offset_in_channels_and_lose_it_in_motions() -> None:
    (channel,) = channels(written.FOLDER / "knet.ns")
    expected = np.array(written.counts(1, 200)) * 3920.0 / 6182761.0 / 100.0
    np.testing.assert_allclose(channel.acceleration, expected, rtol=1e-15)
    assert channel.acceleration.mean() > 0.05
    assert channel.is_raw and np.array_equal(channel.motion("none").samples, channel.acceleration)
    motion = read(written.FOLDER / "knet.ns")
    np.testing.assert_allclose(motion.samples, expected - expected.mean(), atol=1e-14)
    assert motion.history == ("baseline of degree 0 removed",)
    assert not read(written.FOLDER / "esm.asc").history
    assert (channel.name, channel.azimuth, channel.dt) == ("N-S", 0.0, 0.01)
    (kik,) = channels(written.FOLDER / "kiknet.ew2")
    assert (kik.name, kik.azimuth, kik.dt) == ("E-W", 90.0, 0.005)


@pytest.mark.parametrize(
    ("samples", "advice"), [(200, "download"), (299, "download"), (300, ""), (399, ""), (400, "remove")]
)
def test_knet_lasts_its_whole_seconds_and_less_than_one_more(samples: int, advice: str, file) -> None:
    text = written.knet([100 + k % 7 for k in range(samples)])
    text = text.replace(f"{'Duration Time(s)':<18}{samples // 100}\n", f"{'Duration Time(s)':<18}3\n")
    assert f"{'Duration Time(s)':<18}3\n" in text
    if advice:
        says = f"line 12: the header specifies 300 values, but {samples} follow; {advice}"
        assert says in complaint(file(text))
    else:
        assert len(read(file(text)).breakpoints) == samples


@pytest.mark.parametrize(
    ("name", "line"),
    [
        ("two.v1", 30), ("pairs.v1", 29), ("two.v2", 48), ("two.v2c", 51), ("single.v2c", -2), ("even.smc", 30),
        ("esm.asc", 49), ("nga.at2", -1), ("knet.ns", -1), ("kiknet.ew2", -1),
    ],
)  # fmt: skip
def test_more_values_than_are_stated_are_not_taken_for_a_file_cut_short(name: str, line: int, file) -> None:
    lines = (written.FOLDER / name).read_text().splitlines(keepends=True)
    for times, advice in ((30, "remove the other values"), (0, "download the complete file again")):
        changed = [*lines]
        changed[line] = times * lines[line]
        assert f"follow; {advice}, or correct that number" in complaint(file("".join(changed)), channel=1)


def test_knet_agrees_with_obspy() -> None:
    obspy = pytest.importorskip("obspy")
    for name in ("knet.ns", "kiknet.ew2"):
        (trace,) = obspy.read(written.FOLDER / name, format="KNET")
        (channel,) = channels(written.FOLDER / name)
        assert channel.dt == trace.stats.delta
        assert channel.station == trace.stats.station
        np.testing.assert_allclose(channel.acceleration, trace.data * trace.stats.calib, rtol=1e-15)


def test_headers_without_labels_are_numbered(file: Callable[[str], Path]) -> None:
    for name, label in (("two.v2c", "Sta Chan"), ("two.v1", "Chan ")):
        (first, *_) = channels(file((written.FOLDER / name).read_text().replace(label, "???")))
        assert (first.name, first.number, first.azimuth) == ("channel 1", 1, None)
    (first, _) = channels(file((written.FOLDER / "two.v1").read_text().replace("Station No.", "???")))
    assert first.station == ""


def test_a_v2_of_little_more_than_data_is_read(file: Callable[[str], Path]) -> None:
    motion = read(file("Corrected accelerogram\n 3 points of accel data equally spaced at .01 sec, in g\n 1 2 3\n"))
    assert motion.samples.tolist() == [GRAVITY, 2.0 * GRAVITY, 3.0 * GRAVITY]
    assert motion.dt == 0.01


# Text tables


@pytest.mark.parametrize(
    ("text", "request_"),
    [
        ("0.5\n-1.5\n2.0\n", {"dt": 0.01}),
        ("  0.5  \n\n-1.5\n 2.0", {"dt": 0.01}),
        ("# a comment\nacceleration\n0.5\n% another\n-1.5\n! and\n//this\n2.0\n", {"dt": 0.01}),
        ("0.5D0\n-1.5d+0\n0.2D+01\n", {"dt": 0.01}),
        ("0.00 0.5\n0.01 -1.5\n0.02 2.0\n", {}),
        ("0.00\t0.5\n0.01\t-1.5\n0.02\t2.0\n", {}),
        ("t,a\n0.00,0.5\n0.01,-1.5\n0.02,2.0\n", {}),
        ("0.00, 0.5,\n0.01, -1.5,\n0.02, 2.0,\n", {}),
        ('"t","a"\n"0.00","0.5"\n"0.01","-1.5"\n"0.02","2.0"\n', {}),
        ("0,00;0,5\n0,01;-1,5\n0,02;2,0\n", {}),
        ("0.00;0.5\n0.01;-1.5\n0.02;2.0\n", {"dt": 0.01}),
        ("0,5;\n-1,5;\n2,0;\n", {"dt": 0.01}),
        ("0,00\t0,5\n0,01\t-1,5\n0,02\t2,0\n", {}),
        ("0 0,5\n0,01 -1,5\n0,02 2,0\n", {}),
        ("0,00 5E-1\n0,01 -15e-1\n0,02 2\n", {}),
        ("0 ,0.5\n0.01 ,-1.5\n0.02 ,2\n", {}),
        ('"0,00" "0,5"\n"0,01" "-1,5"\n"0,02" "2,0"\n', {}),
        ("0,0.5\n0.01,-1.5\n0.02,2\n", {}),
        ("5.00 0.5\n5.01 -1.5\n5.02 2.0\n", {}),
        ("\ufeff0.00 0.5\r\n0.01 -1.5\r\n0.02 2.0\r\n\x1a", {}),
        ("0.00 0.5\r0.01 -1.5\r0.02 2.0\r", {}),
        ("\f0.00 0.5\n\f0.01 -1.5\n0.02\f2.0\n", {}),
    ],
)
def test_text_tables(text: str, request_: dict[str, float], file: Callable[[bytes], Path]) -> None:
    motion = read(file(text.encode()), units="m/s2", **request_)
    assert motion.dt == 0.01
    assert motion.samples.tolist() == [0.5, -1.5, 2.0]


def test_uneven_times_make_an_uneven_motion(file: Callable[[str], Path]) -> None:
    path = file("0.0 0\n0.1 1\n0.4 0\n")
    assert read(path, units="m/s2").acceleration(0.25) == 0.5
    assert "line 1: the times are not evenly 0.1 s apart" in complaint(path, units="m/s2", dt=0.1)


@pytest.mark.parametrize(
    ("text", "request_", "what"),
    [
        ("1\n2\n", {"units": "g"}, "line 1: the file does not state its sampling step; give dt in seconds"),
        ("1\n2\n", {"dt": 0.1}, "line 1: the file does not state its units; give units as one of g, m/s2"),
        ("0 1\n1 2\n1 3\n", {"units": "g"}, "line 3: the time does not increase from the row before"),
        ("0 1\n\n#\n1 2\n-1 3\n", {"units": "g"}, "line 5: the time does not increase from the row before"),
        ("0 1\n1 2\n2\n", {"units": "g"}, "line 3: all rows must have 2 columns; got 1 in this row"),
        ("0.1\n0.2\nEND\n", {"units": "g", "dt": 0.1}, "line 3: 'END' is not a number"),
        (
            "0 1\n0.1 2\n0.2 3\n",
            {"units": "g", "dt": 0.2},
            "line 1: the sampling step in the file is 0.1 s, not dt 0.2 s",
        ),
        ("a\n0,5\n1,5\n", {"units": "g", "dt": 0.1}, "line 2: '0,5' may be one number with a decimal comma, or"),
        ("0,5\n1,5\n2,0\n", {"units": "g"}, "use a point as the decimal sign, and separate numbers by blanks"),
        ('"1,5E-1"\n"2,5E-1"\n', {"units": "g", "dt": 0.1}, "decimal comma"),
        (",512\n,301\n", {"units": "g", "dt": 0.1}, "',512' may be one number with a decimal comma"),
        ("0\n1,5\n2,0\n", {"units": "g", "dt": 0.1}, "line 2: '1,5' is not a number; use a point"),
        ("0 1\n1 2\n" + 600 * "1 " + "\n", {"units": "g"}, "line 3: this row is 1199 characters long"),
        ("0 1\n", {"units": "g"}, "line 1: 1 values are too few"),
        ("1e308\n1e308\n", {"units": "g", "dt": 0.1}, "too large"),
        ("0 1\n1e200 2\n", {"units": "g"}, "the time does not increase"),
    ],
)
def test_what_is_wrong_with_a_table(
    text: str, request_: dict[str, object], what: str, file: Callable[[str], Path]
) -> None:
    assert what in complaint(file(text), **request_)


def test_two_columns_of_whole_numbers_are_read_where_a_blank_tells_the_comma_from_a_decimal_sign(
    file: Callable[[str], Path],
) -> None:
    for text in ("0, 5\n1, 7\n2, 6\n", "0 5\n1 7\n2 6\n", "0;5\n1;7\n2;6\n", "0,5,\n1,7,\n2,6,\n"):
        assert read(file(text), units="m/s2").samples.tolist() == [5.0, 7.0, 6.0]


@pytest.mark.parametrize(
    "content",
    [
        b"0 1\n" + b"1 " * 2**20 + b"\n2 3\n",
        b"0,1.5\n" + b"1," * 2**20,
        b"1 " * 2**20,
        b"0 1\n" + b"  " * 2**20 + b"\n1 2\n",
        b"0 1\n" + 2**12 * (b"1 " * 2**8 + b"\n"),
    ],
)
def test_a_long_line_costs_little_more_than_its_size(content: bytes, file: Callable[[bytes], Path]) -> None:
    path = file(content)
    tracemalloc.start()
    with contextlib.suppress(RecordError):
        read(path, units="g")
    peak = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    assert peak < 8 * len(content)


@pytest.mark.parametrize(
    ("heading", "factor"),
    [
        ("time (s), acceleration (cm/s2)", 0.01), ("t, a [cm/s²]", 0.01), ("t,a (m s⁻²)", 1.0), ("t,a (m·s-2)", 1.0),
        ("t,a (mg)", 1e-3 * GRAVITY), ("t_ms,a_ms2", 1.0), ("time_s,ground_acceleration_m_s2", 1.0),
        ("t_s,acc_g", GRAVITY), ("# El Centro\n# t (s), a (gal)", 0.01),
    ],
)  # fmt: skip
def test_a_heading_states_the_units(heading: str, factor: float, file: Callable[[bytes], Path]) -> None:
    path = file(f"{heading}\n0,0\n0.01,2.5\n0.02,-1\n".encode())
    assert read(path).pga == pytest.approx(2.5 * factor, rel=1e-15)
    assert read(path, units="g").pga == pytest.approx(2.5 * GRAVITY, rel=1e-15)


def test_a_heading_in_another_encoding_states_the_units(file: Callable[[bytes], Path]) -> None:
    assert read(file("t,a [cm/s²]\n0,0\n0.01,2.5\n".encode("latin-1"))).pga == pytest.approx(0.025)


@pytest.mark.parametrize("delimiter", [",", ";", "\t", "  "])
def test_columns_that_a_heading_names_are_channels(delimiter: str, file: Callable[[str], Path]) -> None:
    rows = "time (s)|NS (cm/s2)|EW (cm/s2)\n0.0|1.5|4.0\n0.1|2.5|5.0\n0.2|3.5|9.0\n"
    path = file(rows.replace("|", delimiter))
    first, second = channels(path)
    assert [(each.number, each.name, each.dt) for each in (first, second)] == [(1, "NS", 0.1), (2, "EW", 0.1)]
    assert second.acceleration.tolist() == [0.04, 0.05, 0.09]
    assert "the file contains 2 channels; give channel as one of 1 'NS', 2 'EW'" in complaint(path)
    assert read(path, channel="NS").pga == read(path, channel=1).pga == 0.035


def test_of_named_columns_those_with_a_unit_of_acceleration_are_read(file: Callable[[str], Path]) -> None:
    names = "time_s,rotation_rad,angular_velocity_rad_s,ground_acceleration_m_s2"
    (channel,) = channels(file(f"{names}\n0,1,2,3\n0.5,4,5,6\n"))
    assert (channel.name, channel.acceleration.tolist()) == ("ground_acceleration_m_s2", [3.0, 6.0])


@pytest.mark.parametrize("dt", [0.0, -0.01, float("nan"), float("inf"), "fast", [0.01, 0.02], 10**400])
def test_a_bad_dt_is_refused_before_the_file_is_opened(dt: object) -> None:
    assert "dt must be a positive number, in s" in complaint("nowhere", MotionError, dt=dt)


def test_arguments_must_agree_with_the_file() -> None:
    path = written.FOLDER / "nga.at2"
    assert read(path, dt=0.005, units="g").pga == read(path).pga
    assert "the sampling step in the file is 0.005 s, not dt 0.01 s" in complaint(path, dt=0.01)
    assert "the units in the file are g, not units 'm/s2'" in complaint(path, units="m/s2")


# Steps


@given(
    step=st.sampled_from([0.001, 0.0025, 0.0048828125, 0.005, 0.0078125, 0.01, 0.02, 1.0 / 3.0, 1.0]),
    points=st.integers(30, 3000),
    start=st.sampled_from([0.0, -2.5, 100.0]),
)
def test_even_times_give_their_step_whatever_their_decimals(step: float, points: int, start: float) -> None:
    exact = start + step * np.arange(points)
    assert fit_even_step(exact) == pytest.approx(step, rel=1e-9)
    for decimals in (3, 4, 6):
        rounded = np.round(exact, decimals)
        if 10.0**-decimals <= 0.5 * step:
            found = fit_even_step(rounded)
            assert found is not None
            assert abs(found - step) * (points - 1) <= 1.01 * 10.0**-decimals


def test_a_missing_sample_is_not_even() -> None:
    assert fit_even_step(np.round(0.015 * np.arange(100), 2)) is None
    for step, decimals in ((0.01, 2), (0.005, 3), (0.0078125, 4), (0.02, 17)):
        times = np.round(step * np.arange(2000), decimals)
        assert fit_even_step(np.delete(times, 1000)) is None
        assert fit_even_step(times) == pytest.approx(step, rel=1e-9)


@pytest.mark.cases(fast=4)
@pytest.mark.parametrize("step", [0.005, 0.0078125, 1.0 / 3.0])
@pytest.mark.parametrize("printed", [".2f", ".3f"])
def test_a_step_that_is_given_holds_where_times_are_its_own_with_few_digits(step: float, printed: str, file) -> None:
    exact = 0.5 + step * np.arange(4000)

    def table(times) -> Path:
        return file("\n".join(["time (s),acc (g)", *(f"{time:{printed}},0.1" for time in times)]).encode())

    (channel,) = channels(table(exact), dt=step)
    assert channel.dt == pytest.approx(step, rel=1e-5)
    complaint(table(exact), dt=1.02 * step)
    complaint(table(np.delete(exact, 2000)), dt=step)
    assert "give dt" not in complaint(table(np.concatenate([exact[:2000], exact[:1999:-1]])), dt=step)


def test_a_step_of_short_digits_is_found_exactly() -> None:
    assert fit_even_step(np.round(0.005 * np.arange(5000), 3)) == 0.005
    assert fit_even_step(0.01 * np.arange(5000)) == 0.01
    assert fit_even_step(np.cumsum(np.full(5000, 0.02))) == 0.02


# Text and numbers


def test_line_ends_marks_and_page_breaks_do_not_matter(file: Callable[[bytes], Path]) -> None:
    for name in HEADED:
        plain = (written.FOLDER / name).read_bytes()
        expected = [channel.acceleration.tolist() for channel in channels(written.FOLDER / name)]
        for variant in (
            plain.replace(b"\n", b"\r\n"),
            plain.replace(b"\n", b"\r"),
            b"\xef\xbb\xbf" + plain,
            plain + b"\x1a",
            plain + b"\n\n  \n",
            plain.rstrip(b"\n"),
            plain.replace(b"Town", b"T\xf6wn").replace(b"Memo.", b"Memo. \xe9"),
            b"\n\n" + plain,
            b"\f" + plain,
            plain.replace(b"\n", b"\n\f", 5),
        ):
            found = [channel.acceleration.tolist() for channel in channels(file(variant))]
            assert found == expected, (name, variant[:40])


@pytest.mark.parametrize("between", ["", "# a comment\n"], ids=["at once", "row after row"])
def test_a_row_of_a_table_may_be_1024_characters_long_and_no_longer(file: Callable[[str], Path], between: str) -> None:
    rows = [f"0.0{k} {k}.5\n" for k in range(6)]
    for blanks, says in ((1017, ""), (1018, "line 3: this row is 1025 characters long, too long for a row of numbers")):
        rows[2] = f"0.02{' ' * blanks}2.5\n"
        table = file("".join([*rows[:4], between, *rows[4:]]))
        if says:
            assert says in complaint(table, units="m/s^2")
        else:
            assert read(table, units="m/s^2").coefficients[:, 0].tolist() == [0.5, 1.5, 2.5, 3.5, 4.5]


# Files


def test_a_missing_file_a_folder_and_an_empty_file(tmp_path: Path, file: Callable[[bytes], Path]) -> None:
    assert "there is no such file" in complaint(tmp_path / "none.at2")
    assert "this is a folder" in complaint(tmp_path)
    for blank in (b"", b" \r\n\t\n", b"\xef\xbb\xbf", b"\x1a"):
        assert "this file is empty" in complaint(file(blank))
    for impossible in ("nul\0byte", "x" * 5000, ""):
        assert complaint(impossible)
    assert "must be a file name" in complaint(3)  # type: ignore[arg-type]
    os.mkfifo(tmp_path / "pipe")
    for waiting in (tmp_path / "pipe", "/dev/zero"):
        assert "not a regular file" in complaint(waiting)
    path = file(written.fixtures()["nga.at2"].encode())
    assert read(path).pga == read(str(path)).pga == read(os.fsencode(path)).pga  # type: ignore[arg-type]


def test_a_file_that_is_too_large_is_refused(monkeypatch: pytest.MonkeyPatch, file: Callable[[str], Path]) -> None:
    monkeypatch.setattr(source, "MAX_SIZE", 2**20)
    assert "larger than 1 MiB" in complaint(file("1\n" * 2**20))


def test_foreign_files_are_said_to_be_text_or_binary(file: Callable[[bytes], Path]) -> None:
    for byte in set(range(32)) - set(b"\t\n\f\r"):
        assert "the format of this binary file is unknown" in complaint(file(b"ab%ccd\n" % byte))
    for text in (b"Dear reader,\nthere is no record here.\n", b"time (s), acceleration (g)\n"):
        assert "is unknown: none of its first 1000 lines contains only numbers" in complaint(file(text))


# ObsPy


def waveform(form: str, points: int = 50) -> bytes:
    """A small file in one of ObsPy's formats, counts 0, 3, 6, ..."""
    obspy = pytest.importorskip("obspy")
    header = {"network": "TT", "station": "TST", "channel": "HNZ", "delta": 0.01}
    stream = obspy.Stream([obspy.Trace(np.arange(0, 3 * points, 3, dtype=np.int32), header)])
    with tempfile.NamedTemporaryFile() as place:
        stream.write(place.name, format=form)
        return Path(place.name).read_bytes()


@pytest.mark.parametrize("form", ["MSEED", "GSE2", "SAC", "SLIST", "TSPAIR"])
@pytest.mark.filterwarnings("ignore")
def test_other_formats_go_through_obspy(form: str, file: Callable[[bytes], Path]) -> None:
    path = file(waveform(form))
    assert identify(path).format == f"{form} (through ObsPy)"
    assert "does not state its units; give units as" in complaint(path)
    (channel,) = channels(path, units="cm/s2")
    assert (channel.name, channel.dt, len(channel.acceleration)) == ("HNZ", 0.01, 50)
    np.testing.assert_allclose(channel.acceleration, 0.03 * np.arange(50), rtol=1e-6, atol=1e-12)


def test_a_stray_control_byte_in_a_heading_does_not_make_a_table_binary(file: Callable[[bytes], Path]) -> None:
    rows = b"".join(b"%.2f %.3f\n" % (0.01 * k, (-1) ** k * 0.1) for k in range(100))
    assert read(file(b"logger\x00 3\ntime (s) a (g)\n" + rows)).pga == pytest.approx(0.1 * GRAVITY)


@pytest.mark.parametrize(
    ("header", "azimuth"),
    [
        ({"cmpaz": 40.0, "cmpinc": 90.0}, 40.0), ({"cmpaz": -50.0, "cmpinc": 88.0}, 310.0), ({"cmpaz": 40.0}, None),
        ({"cmpaz": 0.0, "cmpinc": 0.0}, None), ({"cmpaz": 0.0, "cmpinc": 180.0}, None), ({}, None),
    ],
)  # fmt: skip
@pytest.mark.filterwarnings("ignore")
def test_a_horizontal_component_of_sac_has_the_azimuth_of_its_header(header, azimuth, file) -> None:
    content = io.BytesIO()
    sac = pytest.importorskip("obspy.io.sac")
    sac.SACTrace(data=np.linspace(0.0, 3.0, 40, dtype=np.float32), delta=0.01, **header).write(content)
    (channel,) = channels(file(content.getvalue()), units="g")
    assert channel.azimuth == (None if azimuth is None else pytest.approx(azimuth))


@pytest.mark.parametrize("form", ["MSEED", "SLIST", "TSPAIR"])
@pytest.mark.filterwarnings("ignore")
def test_what_obspy_reads_of_a_file_without_its_end_is_refused(form: str, file: Callable[[bytes], Path]) -> None:
    content = waveform(form, 9000)
    (whole,) = channels(file(content), units="gal")
    assert len(whole.acceleration) == 9000
    cut = content[:-900] if form == "MSEED" else b"\n".join(content.splitlines()[:-10])
    assert "download the complete file again" in complaint(file(cut), units="gal")


def test_traces_with_gaps_or_without_numbers_are_refused(
    monkeypatch: pytest.MonkeyPatch, file: Callable[[bytes], Path]
) -> None:
    obspy = pytest.importorskip("obspy")
    path = file(waveform("MSEED"))
    gaps = np.ma.masked_array(np.arange(5.0), [False, True, False, False, False])
    for data in (gaps, np.array(["a", "b"])):
        stream = obspy.Stream([obspy.Trace(data)])
        monkeypatch.setattr(through_obspy, "_read_traces", lambda *_, stream=stream: stream)
        assert "trace 1 has gaps or invalid numbers" in complaint(path, units="g")


@pytest.fixture(params=["UTC0", "XXX-9", "XXX+8", "XXX-5:30"])
def zone(request: pytest.FixtureRequest, monkeypatch: pytest.MonkeyPatch) -> Iterator[None]:
    """Be somewhere on the earth."""
    if not hasattr(time, "tzset"):
        pytest.skip("the time zone of a process cannot be changed here")
    with monkeypatch.context() as patched:
        patched.setenv("TZ", request.param)
        time.tzset()
        yield
    time.tzset()


def test_files_say_when_their_first_sample_is_wherever_they_are_read(zone: None, file: Callable[[bytes], Path]) -> None:
    obspy = pytest.importorskip("obspy")
    buffer, header = io.BytesIO(), {"station": "X", "channel": "HNE", "delta": 0.01}
    header["starttime"] = obspy.UTCDateTime(1999, 1, 2, 18, 0, 19, 870000)
    obspy.Stream([obspy.Trace(np.arange(50, dtype=np.int32), header)]).write(buffer, format="MSEED")
    (trace,) = channels(file(buffer.getvalue()), units="g")
    (esm,) = channels(written.FOLDER / "esm.asc")
    assert esm.start == calendar.timegm((1999, 1, 2, 18, 0, 19)) + 0.87
    assert trace.start == pytest.approx(esm.start, abs=1e-6) and pickle.loads(pickle.dumps(esm)).start == esm.start


def test_without_obspy_the_extra_is_named(monkeypatch: pytest.MonkeyPatch, file: Callable[[bytes], Path]) -> None:
    path = file(waveform("MSEED"))
    monkeypatch.setitem(sys.modules, "obspy", None)
    assert not through_obspy.is_obspy_installed()
    assert "pip install '.[formats]' in the source folder" in complaint(path)
    assert read(written.FOLDER / "knet.ns").pga > 0.0


# Real records; each oracle is the file's own statement or a second, plain reading


def by_columns(path: Path, start: int, stop: int, width: int) -> list[float]:
    """The numbers of lines start + 1 ... stop, cut every `width` characters."""
    lines = path.read_text("latin-1").splitlines()[start:stop]
    return [float(line[i : i + width]) for line in lines for i in range(0, len(line.rstrip()), width)]


@pytest.mark.parametrize(
    ("name", "points", "dt", "peak"),
    [
        ("RSN6_IMPVALL.I_I-ELC180-hor1.AT2", 5372, 0.01, 0.2808),
        ("RSN6_IMPVALL.I_I-ELC270-hor2.AT2", 5346, 0.01, 0.2107),
        ("RSN6_IMPVALL.I_I-ELC-UP.AT2", 5378, 0.01, 0.1781),
        ("RSN753_LOMAP_CLS000-hor1.AT2", 7997, 0.005, 0.6447),
        ("RSN4863_CHUETSU_65036EW.AT2", 6000, 0.01, 0.3748),
    ],
)
def test_real_at2(shared: Path, name: str, points: int, dt: float, peak: float) -> None:
    path = shared / "records" / "test_only" / name
    motion = read(path)
    numbers = [float(token) for line in path.read_text().splitlines()[4:] for token in line.split()]
    assert channels(path)[0].acceleration.tolist() == [number * GRAVITY for number in numbers]
    assert (len(motion.times), motion.dt) == (points, dt)
    assert motion.pga / GRAVITY == pytest.approx(peak, abs=1e-4)


def test_real_smc(shared: Path) -> None:
    path = shared / "records" / "test_only" / "2516b_a.smc"
    motion = read(path)
    assert channels(path)[0].acceleration.tolist() == [value / 100.0 for value in by_columns(path, 35, 5185, 10)]
    assert (len(motion.times), motion.dt) == (41200, 0.005)
    largest = int(np.argmax(np.abs(motion.samples)))
    assert motion.samples[largest] == pytest.approx(0.39103935, abs=0.51e-5)
    assert motion.times[largest] == pytest.approx(47.615 - 0.005, abs=0.0101)


@pytest.mark.parametrize(
    ("text", "request_", "argument"),
    [
        ("1\n2\n", {"units": "g"}, "dt"), ("1\n2\n", {"dt": 0.1}, "units"),
        ("time (s), a (counts)\n0, 1\n1, 2\n", {}, "units"),
        ("time (s), a (g), b (g)\n0, 1, 1\n1, 2, 1\n", {}, "channel"),
    ],
)  # fmt: skip
def test_what_a_file_does_not_say_is_named_as_data(text: str, request_: dict[str, Any], argument: str, file) -> None:
    path = file(text)
    with pytest.raises(RecordError) as caught:
        read(path, **request_)
    assert (caught.value.argument, caught.value.path) == (argument, str(path))
    assert str(path) not in caught.value.message.text()


def test_a_motion_knows_where_it_comes_from(file: Callable[[str], Path]) -> None:
    path = file("time (s), N-S (g), UD (cm/s2)\n0, 1, 1\n1, 2, 1\n")
    origin = read(path, channel="UD", units="gal").description.origin
    assert origin is not None
    assert (origin.format, origin.file, origin.channel, origin.number) == ("text table", path.name, "UD", 2)
    assert (origin.units, origin.heading_units) == ("cm/s2", "cm/s2")
    assert read(path, channel=1, units="gal").scaled(2.0).description.origin.heading_units == "g"
    shipped = records.load("ridgecrest-clc-up").delayed(1.0).description.origin
    assert shipped is not None
    assert (shipped.channel, shipped.station) == ("up", records.info("ridgecrest-clc-up").station)


def test_a_number_for_a_missing_value_is_found_among_far_smaller_ones() -> None:
    for mark in (-99.0, -999.0, 9999.0, 99.9999, -99999.99, 999.25, -12345.0, -32768.0, 8388607.0):
        assert find_missing_value(np.array([0.1, 0.2, mark, mark, 0.2])) == 2
        assert find_missing_value(np.array([0.1, 0.9 * abs(mark), mark, 0.2])) is None  # a value among values
    for value in (9.0, 9.9999, 99.99999, 98.0, 999999999.0, 32766.0):
        assert find_missing_value(np.array([0.1, value, 0.2])) is None


# What is refused


def fixture(name: str, old: str = "", new: str = "", *, lines: slice = slice(None)) -> str:
    """Some lines of a fixture, with the last of a text replaced by another."""
    text = "".join((written.FOLDER / name).read_text().splitlines(keepends=True)[lines])
    assert old in text
    return new.join(text.rsplit(old, 1)) if old else text


FLAGGED = [-999.0 if k == 7 else value for k, value in enumerate(written.series(1))]
LONG = written.series(1, 2000)
VALUES = SERIES.tolist()
UP = (1, "Up", VALUES)
KNET = fixture("knet.ns")
WRONG_COSMOS = written.cosmos([1.5] * 37).replace("      37 acceleration", "      38 acceleration")
FURLONG = "ACCELERATION TIME SERIES IN UNITS OF FURLONG"


@pytest.mark.parametrize(
    ("content", "channel", "sentence"),
    [
        *((fixture(name), None, sentence) for name, sentence in REFUSED.items()),
        (fixture("two.v1"), None, "contains 2 channels; give channel as one of 1 '90 Deg', 2 'Up'"),
        (fixture("two.v1"), 3, "no channel 3; give one of 1 '90 Deg', 2 'Up'"),
        (fixture("two.v1"), "", "no channel ''"),
        (written.csmip_v1([UP, (2, *UP[1:])]), "Up", "2 channels are called 'Up'"),
        (written.at2([0.1, -0.2, 0.1], "NPTS=3, DT=.01", FURLONG), 1, "the units 'FURLONG' are unknown; give units"),
        (written.at2(VALUES, "NPTS= 36, DT= .005"), 1, "line 4: the header specifies 36 values"),
        (written.at2(VALUES, "NPTS= 38, DT= .005"), 1, "line 4: the header specifies 38 values"),
        (written.at2(VALUES, "NPTS=37, DT=0 SEC"), 1, "line 4: expected a positive number in 'NPTS=37, DT=0 SEC'"),
        (written.at2(VALUES, "NPTS=37, DT=1E999 SEC"), 1, "line 4: the sampling step must be positive"),
        (written.at2([], "NPTS= 3, DT= .01"), 1, "the header specifies 3 values, but 0 follow"),
        (written.cosmos(FLAGGED), 1, "seems to represent a missing value"),
        (WRONG_COSMOS.replace("(8F10.5)", "(2F10.5)"), 1, "38 values, but 37 follow"),
        (written.cosmos(LONG, step_ms=-999.0, raw_step=-999.0), 1, "the header states no sampling step"),
        (fixture("even.smc", "        37", "        33", lines=slice(-1)) + "  1.7E+38\n", 1, "a missing value"),
        (fixture("esm.asc", "UNITS", "NO_UNITS"), 1, "give units as one of"),
        (KNET.replace("Scale Factor      3920", "Scale Factor      0"), 1, "in 'Scale Factor 0(gal)/6182761'"),
        (KNET.replace("100Hz", "fast"), 1, "line 11: expected a positive number in 'Sampling Freq(Hz) fast'"),
        (fixture("knet.ns", lines=slice(-13)), 1, "line 12: the header specifies 200 values, but 96 follow"),
        (fixture("knet.ns", lines=slice(15)), 1, "line 1: this header is not complete"),
        ("a (g) or (cm/s2)\n0,0\n0.01,2.5\n", None, "does not state its units"),
        ("time (s),acc (g)\n0.00,0.1\n0.01,0.2\n0.01,0.1\n0.02,0.0\n", None, "give dt if it is missing or rounded"),
        *((mark + bytes(64), None, "this binary file is unknown") for mark in (b"\x93NUMPY\1", b"PK\3\4", b"\x1f\x8b")),
        (fixture("two.v1", lines=slice(31)), 1, "37 values, but"),
        (fixture("two.v1", lines=slice(20)), 1, "line 1: this header is not complete"),
        (fixture("two.v2", lines=slice(49)), 1, "37 values, but"),
        (fixture("two.v2", lines=slice(30)), 1, "line 1: this header is not complete"),
        (fixture("two.v2c", lines=slice(52)), 1, "37 values, but"),
        (fixture("two.v2c", lines=slice(16)), 1, "line 1: this header is not complete"),
        (fixture("even.smc", lines=slice(31)), 1, "37 values, but"),
        (fixture("even.smc", lines=slice(20)), 1, "line 1: this header is not complete"),
        (fixture("esm.asc", lines=slice(50)), 1, "the header specifies 37 values, but"),
        (fixture("pairs.v1", lines=slice(30)), 1, "74 values, but"),
        (fixture("two.v2c", "(Format v01.20", "(Formt v01.20"), 1, "line 111: expected the title of the next channel"),
        (fixture("two.v2c", "velocity pts", "velocity xxx"), 1, "line 56: this header is not complete"),
        (fixture("two.v1", "Uncorrected Accel", "Unocrrected Accel"), 1, "expected the title of the next channel"),
        (fixture("two.v2", "points of veloc", "pionts of veloc"), 1, "' 37 pio' is not a number"),
        (fixture("two.v1", "at 200 pts", "at two pts"), 1, "expected a positive number in ' 37 Accelerogram"),
        (fixture("pairs.v1", "100.005", "100.000"), 1, "the time does not increase from the row before"),
        (fixture("two.v2", "accel data equally spaced at  .005", "accel data equally spaced at  .0x5"), 1,
          "expected a positive number in ' 37 points of accel data equally spaced at .0x5 sec"),
        (fixture("esm.asc", "NDATA: 37", "NDATA: many"), 1, "line 13: expected a positive number in 'NDATA: many'"),
        (fixture("esm.asc", "NDATA: 37", "\nNDATA: 37"), 1, "line 12: the file does not state its units"),
        (fixture("even.smc", "  2.0000000E+02", " -2.0000000E+02"), 1, "line 18: expected a positive number"),
        (fixture("even.smc", "  2.0000000E+02", "  1.7000000E+38"), 1, "expected pairs of time"),
    ],
)  # fmt: skip
def test_what_is_no_record_unknown_cut_short_or_damaged_is_refused(content, channel, sentence, file) -> None:
    assert sentence in complaint(file(content), channel=channel)


@pytest.mark.parametrize(
    ("step_ms", "raw_step", "seconds", "step"),
    [
        (5.0, 0.02, 10, 0.005), (5.0, 0.02, 40, None), (-999.0, 0.005, 10, 0.005), (5.0, 0.005, 9, 0.005),
        (5.0, 0.005, 11, 0.005), (5.0, 0.005, 8, None), (5.0, 0.005, 12, None), (5.0, 0.005, 90, None),
    ],
)  # fmt: skip
def test_cosmos_has_the_step_that_fits_the_duration_to_a_second(step_ms, raw_step, seconds, step, file) -> None:
    text = written.cosmos(LONG, step_ms=step_ms, raw_step=raw_step)
    path = file(text.replace("approx   10 secs", f"approx {seconds:4d} secs"))
    if step is None:
        assert f"2000 values in steps of 0.005 s do not last the stated {seconds} s; correct the header" in complaint(
            path
        )
    else:
        assert read(path).dt == step


def test_what_obspy_may_not_or_cannot_read_is_refused(
    monkeypatch: pytest.MonkeyPatch, file: Callable[[bytes], Path]
) -> None:
    obspy = pytest.importorskip("obspy")
    damaged = bytearray(waveform("MSEED", 9000))
    damaged[2000] ^= 7
    assert "integrity check" in complaint(file(bytes(damaged)), units="gal")
    for content in (waveform("MSEED")[:70], waveform("SAC")[:600]):
        assert complaint(file(content), units="g")
    pickled, pieces = io.BytesIO(), io.BytesIO()
    obspy.Stream([obspy.Trace(np.zeros(9))]).write(pickled, format="PICKLE")
    assert "the format of this" in complaint(file(pickled.getvalue()), units="g")
    header = {"station": "X", "channel": "HNE", "delta": 0.01}
    traces = [obspy.Trace(np.arange(50, dtype=np.int32), header | {"starttime": obspy.UTCDateTime(t)}) for t in (0, 10)]
    obspy.Stream(traces).write(pieces, format="MSEED")
    assert ".X..HNE is in 2 pieces, with gaps or overlaps" in complaint(file(pieces.getvalue()), units="g")
    monkeypatch.setitem(sys.modules, "obspy", None)
    binary = file(bytes(range(256)) * 3 + b"\n5\n6\n7\n")
    assert "the format of this binary file is unknown" in complaint(binary)


# Whatever bytes a file holds


REQUESTS: tuple[dict[str, Any], ...] = ({}, {"units": "g"}, {"units": "gal", "dt": 0.005}, {"dt": 0.01})


def attempt(path: Path, request: dict[str, Any]) -> None:
    """Read a record; anything but a RockingError of one line gets out."""
    try:
        identify(path)
        found = channels(path, **request)
        for channel in found:
            assert np.isfinite(channel.acceleration).all()
            channel.motion()
        read(path, channel=found[0].number, **request)
    except RockingError as error:
        assert 0 < len(str(error)) < 4000 and "\n" not in str(error)


@settings(max_examples=150, deadline=None, suppress_health_check=list(HealthCheck))
@given(content=st.binary(max_size=500), token=st.sampled_from(TOKENS), request_=st.sampled_from(REQUESTS))
def test_any_bytes_end_in_channels_or_one_sentence(content: bytes, token: str, request_, file) -> None:
    attempt(file(content), request_)
    seed = content[:1] + token.encode("latin-1") + (written.FOLDER / HEADED[len(content) % len(HEADED)]).read_bytes()
    attempt(file(seed), request_)


@pytest.mark.parametrize(
    "title", ["", "Corrected Accelerogram\n", "Uncorrected Accelerogram\n", "2 CORRECTED ACCELEROGRAM\n"]
)
@pytest.mark.parametrize(
    "unit", ["1 ", "\n", " ", "-", "NPTS", "NPTS= 1, DT= ", "/&\n", "1,", "| \n", "EVENT_NAME: \n", "1.5\n"]
)
def test_time_grows_no_faster_than_the_file(title: str, unit: str, file: Callable[[str], Path]) -> None:
    path = file(title + unit * (1_000_000 // len(unit)))
    start = time.process_time()
    attempt(path, {"units": "g", "dt": 0.01})
    assert time.process_time() - start < 5.0
