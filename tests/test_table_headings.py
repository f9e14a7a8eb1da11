"""Text tables as spreadsheets, loggers and programs write them: what is read of each, or the line that is refused."""

import itertools
import re
from pathlib import Path

import numpy as np
import pytest

from rocking.errors import RecordError
from rocking.inputs.notes import list_reading_notes, list_vertical_notes
from rocking.records.formats import channels, identify, read
from rocking.records.formats.source import Request
from rocking.records.named import load_motion

G = 9.80665
FT, IN = 0.3048, 0.0254

#: Samples of every table below, in its own unit.
SAMPLES = [0.1, -0.4, 0.25, 0.0]


def rows(*, step: float = 0.01, sign: str = ",", point: str = ".", start: int = 0, form: str = "{:.3f}") -> str:
    """Four rows of times and the samples."""
    pairs = (f"{form.format(step * (start + k))}{sign}{value:g}\n" for k, value in enumerate(SAMPLES))
    return "".join(pairs).replace(".", point)


def wide(*columns: list[float], sign: str = ",", point: str = ".") -> str:
    """Rows of numbers from their columns."""
    return "".join(sign.join(f"{value:g}" for value in row) + "\n" for row in zip(*columns, strict=True)).replace(
        ".", point
    )


TIMES = [0.0, 0.01, 0.02, 0.03]
OTHER = [1.0, 2.0, 3.0, 4.0]
COUNT = [1.0, 2.0, 3.0, 4.0]

#: Name, content, step (s), and what the samples are times, in m/s^2.
READ = [
    ("spreadsheet", "Time (s),Acceleration (g)\n" + rows(), 0.01, G),
    ("spreadsheet with marks", "\ufeffTime (s);Acceleration (m/s²)\r\n" + rows(sign=";", point=","), 0.01, 1.0),
    ("spreadsheet, marked delimiter", "sep=;\nTime (s);a (g)\n" + rows(sign=";", point=","), 0.01, G),
    ("quoted names", '"Time (s)","Acceleration, NS (m/s^2)"\n' + rows(), 0.01, 1.0),
    ("quoted names with commas", '"Time, s","Acceleration, cm/s2"\n' + rows(), 0.01, 0.01),
    ("empty columns and rows at the end", "Time (s),a (g),,\n,,,\n" + rows().replace("\n", ",,\n") + ",,,\n", 0.01, G),
    ("names after empty lines", "\n\n  \nTime (s)\ta (g)\n\n" + rows(sign="\t"), 0.01, G),
    ("first row of whole numbers", "Zeit [s]\ta [g]\n" + "0\t0,1\n0,01\t-0,4\n0,02\t0,25\n0,03\t0\n", 0.01, G),
    ("milliseconds", "time (ms),a (g)\n" + rows(step=10.0), 0.01, G),
    ("milliseconds after an underscore", "t_ms,a_ms2\n" + rows(step=10.0, form="{:.0f}"), 0.01, 1.0),
    ("microseconds", "Time [µs]\tAccel [mg]\n" + rows(step=10_000.0, sign="\t"), 0.01, 1e-3 * G),
    ("nanoseconds since a date", "timestamp_ns,a_g\n" + rows(step=1e7, start=10**11, form="{:.0f}"), 0.01, G),
    ("minutes", "Time [min];a [g]\n" + rows(step=0.5, sign=";"), 30.0, G),
    ("hours", "time (hr),a (gal)\n" + rows(step=0.25), 900.0, 0.01),
    ("days", "days,acc (g)\n" + rows(step=0.5), 43200.0, G),
    ("units after a slash", "t/ms;a/g\n" + rows(step=5.0, sign=";"), 0.005, G),
    ("units after a word", "Time in ms\tAcceleration in cm/s^2\n" + rows(step=5.0, sign="\t"), 0.005, 0.01),
    ("units as names", "ms,g\n" + rows(step=5.0), 0.005, G),
    ("units below the names", "Time,Acceleration\n(ms),(cm/s/s)\n" + rows(step=5.0), 0.005, 0.01),
    ("units above the names", "sec;gal\nTime;Acc\n" + rows(step=0.02, sign=";"), 0.02, 0.01),
    ("a rule below the names", "Time (sec)  Acc (g)\n----------  -------\n" + rows(sign="  "), 0.01, G),
    ("a title above the names", "El Centro (1940), NS (180)\nTime (s), a (g)\n" + rows(), 0.01, G),
    ("the unit in the title", "Acceleration in (cm/s2)\nt, a\n" + rows(), 0.01, 0.01),
    ("processing program", "Station X\n\nTime [sec]    Acceleration [g]\n" + rows(sign="    "), 0.01, G),
    ("names between single blanks", "Time (ms) Ground acceleration (g)\n" + rows(step=10.0, sign=" "), 0.01, G),
    ("names in a comment", "% t (ms)  a (mg)\n" + rows(step=10.0, sign="  "), 0.01, 1e-3 * G),
    ("names of variables", "Time_s_,Acc_m_s_2_\n" + rows(), 0.01, 1.0),
    ("percent of g", "Time (s),Acceleration (%g)\n" + rows(), 0.01, 0.01 * G),
    ("percent of g after a word", "time;acc % g\n" + rows(sign=";"), 0.01, 0.01 * G),
    ("a duration in a remark", "# duration (min): 2\n# t, acc (g)\n" + rows(), 0.01, G),
    ("feet", "TIME SEC\tACC FT/SEC2\n" + rows(sign="\t"), 0.01, FT),
    ("inches", "Time (s),Acc (in/s^2)\n" + rows(), 0.01, IN),
    ("m s^-2", "Time (s),Acc (m s^-2)\n" + rows(), 0.01, 1.0),
    ("two named columns of whole numbers", "t (ms),a (mg)\n0,5\n10,-7\n20,6\n30,0\n", 0.01, None),
    ("accelerations first", "a (g),t (ms)\n" + wide(SAMPLES, [0.0, 5.0, 10.0, 15.0]), 0.005, G),
    ("numbers of rows", "Index,Time (s),a (g)\n" + wide(COUNT, TIMES, SAMPLES), 0.01, G),
    ("numbers of rows without a name", ",time (ms),a_g\n" + wide(COUNT, [0.0, 5.0, 10.0, 15.0], SAMPLES), 0.005, G),
    ("velocities beside", "Time [s];v [cm/s];d [cm];a [g]\n" + wide(TIMES, OTHER, OTHER, SAMPLES, sign=";"), 0.01, G),
    ("a large value that belongs to the motion", "t (s),a (mm/s2)\n0,999\n0.01,850\n0.02,-999\n0.03,0\n", 0.01, None),
    (
        "logger",
        "LabVIEW Measurement\nSeparator\tTab\n***End_of_Header***\n\nSamples\t4\nDelta_X\t0.010000\n"
        "***End_of_Header***\nX_Value\tAcceleration (g)\n" + rows(sign="\t"),
        0.01,
        G,
    ),
    (
        "telephone",
        '"Time (s)";"Acceleration x (m/s^2)"\n0,000000000E0;1,000000E-1\n1,000000000E-2;-4,000000E-1\n'
        "2,000000000E-2;2,500000E-1\n3,000000000E-2;0,000000E0\n",
        0.01,
        1.0,
    ),
]  # fmt: skip


@pytest.mark.parametrize(("content", "dt", "factor"), [each[1:] for each in READ], ids=[each[0] for each in READ])
def test_a_table_is_read_as_its_heading_says(content: str, dt: float, factor: float | None, tmp_path: Path) -> None:
    path = tmp_path / "table.csv"
    path.write_bytes(content.encode())
    (channel,) = channels(path)
    assert channel.dt == pytest.approx(dt, rel=1e-15)
    if factor is None:
        assert len(channel.acceleration) == 4
    else:
        assert channel.acceleration == pytest.approx(np.array(SAMPLES) * factor, rel=1e-15)


#: Name, content, line, and what is said of it.
REFUSED = [
    ("overflowed", "time (s),a (g)\n0.00,********\n" + rows(start=1), 2, "'********' is not a number"),
    ("the letter O", "0.00,O.1\n" + rows(start=1), 1, "'O.1' is not a number"),
    ("a number with a letter", "t;a\n0;0,1x\n" + rows(start=1, sign=";", point=","), 2, "'0.1x' is not a number"),
    ("thousands", "time (s);a (g)\n0;1.234,5\n" + rows(start=1, sign=";"), 2, "'1.234.5' is not a number, but"),
    ("an empty time", "time (s),a (g)\n,0.1\n" + rows(start=1), 2, "must have 2 columns; got 1 in this row"),
    ("a spreadsheet's error", "time (s),a (g)\n0,#N/A\n" + rows(start=1), 2, "'#N/A' is not a number"),
    ("a spreadsheet's error among rows", "a (g)\n0.1\n#DIV/0!\n0.2\n", 3, "'#DIV/0!' is not a number"),
    ("not a number", "time (s),a (g)\n0,NaN\n" + rows(start=1), 2, "'NaN' is not a finite number"),
    ("a dash", "0 -\n0.01 0.1\n0.02 0.3\n", 1, "'-' is not a number"),
    ("a word for a value", "t (s)\ta (g)\n0\tfaulty\n" + rows(start=1, sign="\t"), 2, "'faulty' is not"),
    ("a word for a time, no heading", "x;0,1\n" + rows(start=1, sign=";"), 1, "'x' is not a number"),
    ("two damaged rows", "t,a\n0,?\n\n0.01,?\n" + rows(start=2), 4, "'?' is not a number"),
    ("a damaged time below names", "t (s)  a (g)\nx.csv  0.1\n" + rows(start=1, sign="  "), 2, "'x.csv' is not"),
    ("one damaged number", "a (g)\n0.l\n0.2\n0.3\n", 2, "'0.l' is not a number"),
    ("9999", "time (s),a (g)\n0,0.1\n0.01,9999\n0.02,0.2\n", 3, "9999 seems to represent a missing"),
    ("many of -999.9", "a (gal)\n1\n-999.9\n-999.9\n-3\n", 3, "-999.9 seems to represent a missing"),
    ("an unknown unit of time", "Time (fortnights),a (g)\n" + rows(), 1, "unclear from 'fortnights'"),
    ("a unit of time of something", "Recorded (min)\nTime,a (g)\n" + rows(), 2, "unclear from 'min'"),
    ("a peak in brackets", "# PGA (g) = 0.312\n# Time   Acc\n" + rows(), 3, "the file does not state its units"),
    ("a conversion", "# 1 g = 981 cm/s2\n# t   acc\n" + rows(), 3, "the file does not state its units"),
    ("-99", "time (s),a (g)\n0,0.1\n0.01,-99\n0.02,0.2\n", 3, "-99 seems to represent a missing"),
    ("24 bits", "time (s),a (gal)\n0,1\n0.01,8388607\n0.02,2\n", 3, "8.38861e+06 seems to represent a missing"),
    ("metres", "Time (m),a (g)\n" + rows(), 1, "unclear from 'm'"),
    ("volts", "Time (s),Sensor (mV)\n" + rows(), 1, "the units 'mV' are unknown; give units as one of"),
    ("velocities", "Time (s),v (cm/s)\n" + rows(), 1, "the heading states 'cm/s', which is not a unit of"),
    ("displacements", "time (s),disp (cm)\n" + rows(), 1, "of acceleration; use a table of accelerations"),
    ("a unit in Spanish", "t (s),a (cm/seg2)\n" + rows(), 1, "the units 'cm/seg2' are unknown; give units as one"),
    ("a factor", "Time (s),a (10^-3 g)\n" + rows(), 1, "the units '10^-3 g' are unknown"),
    ("two units", "Time (s),a (g or cm/s2)\n" + rows(), 1, "the units 'g or cm/s2' are unknown"),
    ("numbers of rows and no times", "Sample,a (g)\n" + wide(COUNT, SAMPLES), 2, "give dt in seconds"),
    ("components and no times", "NS (g),EW (g)\n" + wide(OTHER, SAMPLES), 2, "give dt in seconds"),
    ("a spectrum", "Period (s),Sa (g)\n" + rows(), 1, "'Sa', perhaps a spectrum); use a table of"),
    ("unnamed columns", "0 1 2\n1 2 3\n2 3 4\n", 1, "each line holds 3 numbers"),
]  # fmt: skip


@pytest.mark.parametrize(("content", "line", "what"), [each[1:] for each in REFUSED], ids=[each[0] for each in REFUSED])
def test_what_is_lost_or_unclear_in_a_table_is_refused_with_its_line(
    content: str, line: int, what: str, tmp_path: Path
) -> None:
    path = tmp_path / "table.csv"
    path.write_bytes(content.encode())
    with pytest.raises(RecordError) as caught:
        channels(path, dt=0.01 if "," not in content and ";" not in content and "\t" not in content else None)
    message = str(caught.value)
    assert message.startswith(f"{path}, line {line}: ")
    assert what in message
    assert "\n" not in message


def test_every_column_of_times_is_for_the_channels_after_it(tmp_path: Path) -> None:
    path = tmp_path / "pairs.csv"
    later = [5.0, 5.02, 5.04, 5.06]
    path.write_text("t1 (s),NS (g),t2 (s),EW (g)\n" + wide(TIMES, SAMPLES, later, OTHER))
    first, second = channels(path)
    assert [(each.name, each.dt) for each in (first, second)] == [("NS", 0.01), ("EW", 0.02)]


def test_channels_without_times_take_the_step_that_is_given(tmp_path: Path) -> None:
    path = tmp_path / "table.csv"
    path.write_text("NS (g),EW (g)\n" + wide(OTHER, SAMPLES))
    first, second = channels(path, dt=0.02)
    assert (first.name, first.dt, second.name) == ("NS", 0.02, "EW")
    path.write_text("Sample,a (g)\n" + wide(COUNT, SAMPLES))
    assert read(path, dt=0.02).dt == 0.02


def test_units_overrule_what_a_heading_says_and_lines_before_the_rows_may_hold_numbers(tmp_path: Path) -> None:
    path = tmp_path / "table.txt"
    for title in ("1940 El Centro", "Magnitude 6.5", "180 deg", "Test 3, 12 March", "4 points", "# 0.00 0.1x"):
        path.write_text(f"{title}\n" + rows(sign=" ", start=1))
        assert read(path, units="g").samples == pytest.approx(G * np.array(SAMPLES))
    path.write_text("Time,0,90,UP\n" + wide(TIMES, SAMPLES, OTHER, OTHER))
    assert [each.name for each in channels(path, units="g")] == ["0", "90", "UP"]
    path.write_text("Time (s),v (cm/s)\n" + rows())
    (channel,) = channels(path, units="g")
    assert channel.metadata["heading units"] == "cm/s"
    assert identify(path).reason == "from line 2 on each line holds 2 numbers, between them a comma"


def test_the_first_row_of_a_table_is_among_its_first_1000_lines(tmp_path: Path) -> None:
    path = tmp_path / "table.txt"
    for count, line in itertools.product((62, 63, 64, 200, 999), ("words of a laboratory", "# words", "", "KEY : 3 m")):
        path.write_text(f"{line}\n" * count + rows())
        assert read(path, units="g").samples == pytest.approx(G * np.array(SAMPLES))
    path.write_text("words of a laboratory\n" * 1000 + rows())
    with pytest.raises(RecordError, match="none of its first 1000 lines contains only numbers"):
        read(path, units="g")


def test_even_and_uneven_times_are_in_the_unit_of_their_heading(tmp_path: Path) -> None:
    path = tmp_path / "table.csv"
    path.write_text("t (ms),a (g)\n0,0.1\n5,0.2\n20,0.3\n")
    (channel,) = channels(path)
    assert channel.dt is None
    assert channel.times is not None and channel.times.tolist() == [0.0, 0.005, 0.02]
    path.write_text("t (ms),a (g)\n0,0.1\n5,0.2\n10,0.3\n")
    assert read(path, dt=0.005).dt == 0.005
    with pytest.raises(RecordError, match=r"the sampling step in the file is 0\.005 s, not dt 5 s"):
        read(path, dt=5.0)


@pytest.mark.parametrize(
    "name", ["T", "S", "NS", "Time history", "time series (g)", "Time: 12:03", "dt = 0.005 s", "1"]
)
def test_a_title_above_a_column_of_accelerations_may_speak_of_time(tmp_path, name):
    path = tmp_path / "column.csv"
    path.write_text(f"# {name}\n0.000\n0.005\n0.010\n")
    assert read(path, dt=0.005, units="g").pga == pytest.approx(0.01 * G)


def test_a_missing_row_among_even_times_is_noted(tmp_path):
    def written(name, left_out):
        path = tmp_path / name
        rows = [f"{0.01 * k:.2f},{0.1 * ((7 * k) % 5 - 2):.3f}" for k in range(40) if k not in left_out]
        path.write_text("\n".join(["time (s),a (g)", *rows]))
        return list_reading_notes(read(path))

    (note,) = written("gap.csv", {17})
    assert note.startswith("the times go on by 0.01 s, but by 0.02 s after 0.16 s: are rows missing?")
    assert written("whole.csv", set()) == ()


@pytest.mark.parametrize("names", ["time (s),ns,up", "t,NS,EW", "t,ns,ud", "Time,ud,ns"])
def test_ns_beside_times_is_north_south_and_no_nanoseconds(tmp_path, names):
    path = tmp_path / "table.csv"
    path.write_text(names + "\n" + wide(TIMES, SAMPLES, OTHER))
    found = channels(path, units="gal")
    assert [channel.name for channel in found] == names.split(",")[1:]
    assert {channel.dt for channel in found} == {0.01}


@pytest.mark.parametrize("names", ["NS,EW,UD", "ns,ew,ud", "N-S E-W U-D", "ch1;ch2;ch3"])
def test_components_alone_are_read_with_a_step(tmp_path, names):
    path = tmp_path / "table.csv"
    sign = "," if "," in names else ";" if ";" in names else " "
    path.write_text(names + "\n" + wide(SAMPLES, OTHER, [-each for each in OTHER], sign=sign))
    found = channels(path, dt=0.01, units="gal")
    assert [channel.name for channel in found] == [name.strip() for name in re.split("[,; ]", names)]
    assert found[0].acceleration == pytest.approx(0.01 * np.array(SAMPLES), rel=1e-15)
    with pytest.raises(RecordError, match="the time does not increase from the row before"):
        channels(path, units="gal")


def test_of_a_folder_those_that_say_something_else_keep_it_or_are_refused(tmp_path):
    path = tmp_path / "table.csv"
    for unit, what in (("cm/s", "'cm/s', which is not a unit of"), ("counts", "the units 'counts' are unknown")):
        path.write_text(f"t (s),v ({unit})\n" + rows())
        with pytest.raises(RecordError, match=what):
            load_motion(str(path), Request.create(units="g", are_defaults=True))
    path.write_text("t (s),a (g)\n0,0\n0.01,1\n0.05,0.5\n0.06,0\n")
    assert load_motion(str(path), Request.create(0.01, are_defaults=True)).dt is None
    with pytest.raises(RecordError, match="not evenly"):
        load_motion(str(path), Request.create(0.01))


def test_a_column_is_found_by_its_name_before_its_number(tmp_path):
    path = tmp_path / "table.csv"
    path.write_text("t (s),2 (g),1 (g)\n0,0,0\n0.01,0.1,0.2\n0.02,0,0\n")
    by_name, by_number = (read(path, channel=channel).pga / 9.80665 for channel in ("2", 2))
    assert (by_name, by_number) == pytest.approx((0.1, 0.2))


def test_components_that_begin_apart_are_noted(tmp_path):
    path = tmp_path / "table.csv"
    both = [f"{0.01 * k:.2f},{k % 3},{0.01 * k + 0.2:.2f},{(k + 1) % 3}" for k in range(50)]
    path.write_text("t1 (s),a1 (g),t2 (s),a2 (g)\n" + "\n".join(both) + "\n")
    found = load_motion(str(path), Request(channel="a1"), "a2")
    (note,) = (each for each in list_vertical_notes(found) if "begins" in each)
    assert "by its file the vertical motion begins 0.2 s after the horizontal one" in note
    assert not [each for each in list_vertical_notes(found.delayed(0.2)) if "begins" in each]
    path.write_text("t (s),a1 (g),a2 (g)\n" + "\n".join(f"{0.01 * k:.2f},{k % 3},{(k + 1) % 3}" for k in range(50)))
    found = load_motion(str(path), Request(channel="a1"), "a2")
    assert list_vertical_notes(found) == ()


#: Periods of response spectra and ordinates, none of them negative.
PERIODS = {
    "logarithmic": np.geomspace(0.01, 10.0, 30).tolist(),
    "even": (0.02 * np.arange(100)).tolist(),
    "even in parts": [0.02, 0.04, 0.06, 0.1, 0.15, 0.2, 0.3, 0.4, 0.5, 1.0, 1.5, 2.0],
}
SPECTRA = """
T (s),Spectral Acceleration (g)  Period T (s),Acceleration (g)  T [s],Se [g]  T (s),RotD50 (g)  T (s),SA (g)
Period (s),PSA (g)  Period (s),Acceleration (g)  T (s),Pseudo-acceleration (g)  T [s],Sd [g]  T,S_a (g)
T (s),RotD100 (g)  T (s),GMRotI50 (g)  Periodo (s),Aceleracion espectral (g)  Período (s),Accelerazione (g)
Periode T [s],Beschleunigung [m/s2]  T [s],Spektralbeschleunigung [m/s2]  T (s),Accelerazione spettrale (g)
Tn (s),A (g)  Natural period (s),Peak acceleration (g)  Time period (s),Sa/g (g)  T_s,Sa_g  T (s),Acceleration (g)
T [s],a [g]  T (s),Response spectrum (g)  T (s),Design spectrum Se(T) (g)  T (s),5% damped SA (g)  T (s),Geomean (g)
T (s),Sae (g)  per (s),psa05 (g)  Frequency (Hz),SA (g)  Time (s),Spectral acceleration (g)
"""
ACCELEROGRAMS = """
Time (s),Acceleration (g)  t [s],a [m/s2]  T (s),Acceleration (g)  T (s),Acc (g)  T [s],a [g]  Time T (s),a (g)
Tempo (s),Accelerazione (g)  Zeit [s],Beschleunigung [m/s2]  Time (s),SE (g)  Time (s),Spectrum-compatible a (g)
Time (s),Spectrally matched acceleration (g)  Time (s),Long-period acceleration (g)  x (s),a (g)  seconds,g
Time,Long-period acceleration
"""


def headings(text: str) -> list[str]:
    return re.split(r"\s{2,}|\n", text.strip())


@pytest.mark.parametrize("periods", PERIODS.values(), ids=PERIODS.keys())
@pytest.mark.parametrize("heading", headings(SPECTRA))
def test_a_response_spectrum_is_no_accelerogram(heading: str, periods: list[float], tmp_path: Path) -> None:
    path = tmp_path / "record.csv"
    path.write_text(heading + "\n" + wide(periods, [0.9 / (0.3 + period) for period in periods]), encoding="utf-8")
    with pytest.raises(RecordError, match=r"names no column of acc|seems to be a response spectrum"):
        read(path)


@pytest.mark.parametrize("title", ["Response spectrum for 5 % damping\n", "# Pseudo-acceleration (g)\n"])
@pytest.mark.parametrize(("columns", "dt"), [(2, None), (1, 0.01)])
def test_a_title_says_that_a_table_is_a_response_spectrum(title: str, columns: int, dt, tmp_path: Path) -> None:
    path = tmp_path / "record.txt"
    for sign, refused in ((1.0, True), (-1.0, False)):
        path.write_text(title + wide(*(TIMES, [0.5, 0.7 * sign, 0.6, 0.1])[2 - columns :], sign=" "))
        if refused:
            with pytest.raises(RecordError, match="seems to be a response spectrum"):
                read(path, units="g", dt=dt)
        else:
            assert read(path, units="g", dt=dt).pga == pytest.approx(0.7 * G)


@pytest.mark.parametrize("heading", headings(ACCELEROGRAMS))
def test_an_accelerogram_is_no_response_spectrum(heading: str, tmp_path: Path) -> None:
    path = tmp_path / "record.csv"
    path.write_text(heading + "\n" + rows(), encoding="utf-8")
    units = None if "g" in heading.replace("Long", "") or "m/s2" in heading else "g"
    motion = read(path, units=units)
    assert motion.duration == pytest.approx(0.03) and motion.pga in (pytest.approx(0.4 * G), pytest.approx(0.4))


def test_accelerations_that_are_never_negative_are_read_where_a_column_is_named_as_that_of_times(tmp_path) -> None:
    path = tmp_path / "pulse.csv"
    for name, is_read in (("Time (s)", True), ("t (s)", True), ("T (s)", False)):
        path.write_text(f"{name},Acceleration (g)\n0,0\n0.1,0.3\n0.2,0\n")
        if is_read:
            assert read(path).pga == pytest.approx(0.3 * G)
        else:
            with pytest.raises(RecordError, match="or name the column 'time'"):
                read(path)


@pytest.mark.parametrize(
    "stated",
    """SAMPLING INTERVAL (sec) : 0.01  Sampling rate: 100 Hz  sampling frequency (Hz),100  dt = 0.01 s  DT 0.0100
Time step (s) = .01  Samples/sec=100  100 samples per second  100 sps  Delta t = 10 ms  time_step: 1.0E-02
EQUALLY SPACED INTERVALS OF: 0.010 SEC  INTERVALO DE MUESTREO, C1-C6 (s) : /0.01/0.01/0.01
VEL. DE MUESTREO, C1-C6 (muestras/s) : /100/100/100  Sampling period 1/100 s""".replace("\n", "  ").split("  "),
)
@pytest.mark.parametrize("columns", [1, 3])
def test_a_step_that_a_heading_states_is_not_contradicted(stated: str, columns: int, tmp_path: Path) -> None:
    path = tmp_path / "table.txt"
    names = "N-S (gal)  E-W (gal)  U-D (gal)\n" if columns == 3 else ""
    path.write_text(f"A STATION\n{stated}\n{names}" + wide(*[SAMPLES] * columns, sign="  "))
    channel = 1 if columns == 3 else None
    assert read(path, dt=0.01, units="gal", channel=channel).dt == 0.01
    with pytest.raises(RecordError, match=r"line 2: the heading states .*, not dt 0.02 s; correct one of them"):
        read(path, dt=0.02, units="gal", channel=channel)
    if columns == 1:
        with pytest.raises(RecordError, match=r"no column contains times, but the heading states .*; give dt"):
            read(path, units="gal")


@pytest.mark.parametrize("dt", [0.0078125, 0.0078, 0.008])
def test_a_step_that_a_heading_states_may_be_rounded(dt: float, tmp_path: Path) -> None:
    path = tmp_path / "table.txt"
    for stated, refused in (("0.0078", dt == 0.008), ("0.008", False), ("0.01", True), ("1e-9999", True)):
        path.write_text(f"sampling interval: {stated} s\n" + wide(SAMPLES))
        if refused:
            with pytest.raises(RecordError, match="correct one of them"):
                read(path, dt=dt, units="g")
        else:
            assert read(path, dt=dt, units="g").dt == dt
