"""Writers of strong-motion files, from the published descriptions of the formats; they share nothing with the readers.

Run as a program, it writes the fixtures of tests/data/formats anew.
"""

import math
from pathlib import Path

FOLDER = Path(__file__).resolve().parents[1] / "data" / "formats"
POINTS = 37


def series(seed: int = 0, points: int = POINTS) -> list[float]:
    """A decaying wiggle in cm/s^2, both signs, from some hundredths to some hundreds."""
    return [
        250.0 * math.exp(-0.05 * k) * math.sin(0.7 * k + seed) + 0.03 * math.cos(2.9 * k * (seed + 1))
        for k in range(points)
    ]


def film_times(points: int = POINTS) -> list[float]:
    """Uneven instants, as a digitised film has them, s."""
    return [round(0.02 * k + 0.004 * math.sin(3.0 * k), 3) for k in range(points)]


def fortran(value: float, width: int, decimals: int) -> str:
    """Fw.d as the programs of the time printed it: no zero before the point."""
    text = f"{value:.{decimals}f}".replace("-0.", "-.")
    text = text[1:] if text.startswith("0.") else text
    assert len(text) <= width
    return text.rjust(width)


def exponent(value: float, width: int, decimals: int) -> str:
    """0.dE+xx without the leading zero, as PEER's files have it."""
    if value == 0.0:
        return ("." + "0" * decimals + "E+00").rjust(width)
    power = math.floor(math.log10(abs(value))) + 1
    digits = f"{abs(value) / 10.0**power:.{decimals}f}"
    if digits.startswith("1"):
        power, digits = power + 1, f"{0.1:.{decimals}f}"
    return (("-" if value < 0 else "") + digits[1:] + f"E{power:+03d}").rjust(width)


def short_exponent(value: float, width: int, decimals: int) -> str:
    """1pEw.dE1, one digit of exponent, as SMC files have it."""
    mantissa, power = f"{value:.{decimals}E}".split("E")
    return f"{mantissa}E{int(power):+d}".rjust(width)


def rows(fields: list[str], per_line: int) -> str:
    """Lines of `per_line` fields that nothing separates."""
    return "".join("".join(fields[i : i + per_line]) + "\n" for i in range(0, len(fields), per_line))


def at2(values: list[float], sizes: str, kind: str = "ACCELERATION TIME SERIES IN UNITS OF G") -> str:
    """PEER: `values` in g; `sizes` is the fourth line."""
    title = "PEER NGA STRONG MOTION DATABASE RECORD\nSomewhere-01, 1/2/1999, Town Hall, 090\n"
    return title + f"{kind}\n{sizes}\n" + rows([exponent(v, 15, 7) for v in values], 5)


def csmip_v1_header(number: int, name: str, points: int, units: str) -> str:
    """13 text lines, 100 integers in 16I5, 50 reals in 8F10."""
    text = [
        "Uncorrected Accelerogram Data             Processed: 01/02/99, TEST",
        "Rcrd of Sat Jan  2, 1999 10:00:00.0 PST               (Test v1.0)",
        "                                        (Origin:  To be determined)",
        "12345-L0001-99002.01                 Start time:  1/02/99, 18:00:00.0 UTC",
        "Station No. 12345   34.000N, 118.000W     K2    s/n 0001  (2 Chns of  2 at Sta)",
        "Testville - Town Hall                     TEST",
        f"Chan {number:2d}: {name:<8}(Sta Chn: {number + 4:2d})     Location: Ground",
        "Rcrd of Sat Jan  2, 1999 10:00:00.0 PST    Sat Jan  2, 1999 10:00:00.0 PST",
        "Hypocenter:  To be determined.               ML:  To be determined.",
        "Instr Period =  .0050 sec,  Damping =  .707,  Sensitivity = 5.00 v/g",
        f"No. of Points =  {points}  Record Length =  1.000 sec   at 200 Samples/sec",
        units,
        "RMS calc for complete record =        .",
    ]
    integers = [f"{v:5d}" for v in [number, 100, 3, -999] * 25]
    reals = [fortran(v, 10, 5) for v in [-999.0, 0.005] * 25]
    return "\n".join(text) + "\n" + rows(integers, 16) + rows(reals, 8)


def csmip_v1(channels: list[tuple[int, str, list[float]]], rate: int = 200) -> str:
    """Modern V1: values in g, 8f9.6, which touch where a value is below -0.1 g by a digit too many."""
    text = ""
    for number, name, values in channels:
        text += csmip_v1_header(number, name, len(values), "Units of uncor data are sec and g.")
        text += f"{len(values):6d} Accelerogram points at {rate} pts/sec in units of g.       Format: (8f9.6)\n"
        text += rows([fortran(v, 9, 6) for v in values], 8)
        text += f"/&  ----------  End of Data for Station Channel {number:3d}  ----------\n"
    return text


def csmip_v1_pairs(channels: list[tuple[int, str, list[float], list[float]]]) -> str:
    """Old V1: pairs (s, g/10) in 10F7.3 right after the headers."""
    text = ""
    for number, name, times, values in channels:
        text += csmip_v1_header(number, name, len(values), "UNITS OF UNCOR ACCEL ARE SEC AND G/10.")
        pairs = [f"{v:7.3f}" for pair in zip(times, values, strict=True) for v in pair]
        text += rows(pairs, 10) + f"/&  ----------  END OF DATA FOR CHANNEL {number}  ----------\n"
    return text


def csmip_v2(channels: list[tuple[int, str, list[float]]], dt: float = 0.005) -> str:
    """V2: acceleration (cm/s^2), velocity and displacement, each in 8f10.6; the step is real header 53."""
    text = ""
    for number, name, values in channels:
        head = ["Corrected accelerogram   12345-L0001-99002.01       Chan  1: 360 Deg     from"]
        head += csmip_v1_header(number, name, len(values), "").splitlines()[:13]
        head[2] = "Record of Sat Jan  2, 1999 10:00:00.0 PST             (Test v1.0)"
        head += [f"text line {k}" for k in range(15, 26)]
        reals = [-999.0] * 100
        reals[52] = dt
        text += "\n".join(head) + "\n"
        text += rows([f"{v:5d}" for v in [number, 100, 3, -999] * 25], 16)
        text += rows([fortran(v, 10, 7 if 0.0 < v < 1.0 else 5) for v in reals], 8)
        for quantity, units, factor in (("accel", "cm/sec2", 1.0), ("veloc", "cm/sec", 0.1), ("displ", "cm", 0.01)):
            step = fortran(dt, 6, 3).strip()
            text += f"{len(values):6d} points of {quantity} data equally spaced at  {step} sec, in {units}. (8f10.6)\n"
            text += rows([fortran(factor * v, 10, 6 if abs(factor * v) < 100.0 else 5) for v in values], 8)
        text += f"/&  ----------  End of data for channel {number:2d}  ----------\n"
    return text


def cosmos(
    values: list[float],
    *,
    quantity: str = "acceleration",
    units: str = "cm/sec2(04)",
    columns: str = "(8F10.5)",
    fields: list[str] | None = None,
    number: int = 1,
    direction: str = "90 Deg",
    step_ms: float = 5.0,
    raw_step: float = 0.005,
) -> str:
    """One block of COSMOS 1.20."""
    text = [
        f"Corrected {quantity:<16}(Format v01.20 with 13 text lines) Src: test.evt",
        "Record of Test Earthquake of Sat Jan 02, 1999 18:00 UTC",
        "Hypocenter: 34.00000 -118.00000 H= 10km Mw=6.0",
        "Origin: 1999/01/02 18:00:00    UTC",
        "Statn No: 02-012345 Code:TT-12345  TEST  Testville Town Hall",
        "Coords: 34.0000 -118.0000  Site geology:",
        "Recorder: K2       s/n 1 ( 2 Chns of   2 at Sta) Sensor: Episensor",
        "Rcrd start time: 1999/01/02 18:00:05.000 UTC (Q=5) RcrdId: (see comment)",
        f"Sta Chan {number:3d}: {direction} (Rcrdr Chan  {number}) Location:Ground floor",
        "Raw record length =   1.000 sec, Uncor max =    12345, at   0.100 sec.",
        "Processed: 1999/01/03 05:00:00 GMT, TEST, Max =  123.000 cm/sec2 at    0.100 sec",
        "Record filtered below  0.03 Hz (periods over 33.33 secs), and above 20.0 Hz",
        "Values used when parameter or data value is unknown/unspecified:   -999, -999.00",
    ]
    integers = [f"{v:8d}" for v in [2, 1, 4, 120, -999] * 20]
    reals = [-999.0] * 100
    reals[33], reals[61] = raw_step, step_ms
    seconds = round(len(values) * (step_ms / 1000.0 if step_ms > 0.0 else raw_step))
    body = fields or [fortran(v, 10, 5) for v in values]
    per_line = int(columns.strip("(").split("F")[0].split("E")[0].split("I")[0])
    return (
        "\n".join(text)
        + "\n 100 Integer-header values follow on  10 lines, Format= (10I8)\n"
        + rows(integers, 10)
        + " 100 Real-header values follow on  20 lines, Format= (5F15.6)\n"
        + rows([f"{v:15.6f}" for v in reals], 5)
        + '   2 Comment line(s) follow, each starting with a "|":\n| RcrdId: TEST.12345\n|<PROCESS> MANUAL\n'
        + f"{len(values):8d} {quantity} pts, approx {seconds:4d} secs, units={units},Format={columns}\n"
        + rows(body, per_line)
        + f"End-of-data for Chan {number} {quantity}\n"
    )


def smc(values: list[float], *, rate: float | None = 200.0, title: str = "2 CORRECTED ACCELEROGRAM") -> str:
    """SMC; without a rate the values are times and accelerations in turn."""
    text = [
        title,
        "*",
        "1234b",
        "     1999  01  02    1800 TESTVILLE",
        "Moment Mag= 6.00     Ms=          Ml=",
        "station = Testville Town Hall           component= 090",
        "epicentral dist =     12.0       pk acc =  2.50E+2",
        "inst type=K2         data source = TEST",
        "*",
        "*",
        "*",
    ]
    integers = [-32768] * 48
    integers[15], integers[16] = 2, len(values)
    reals = [1.7e38] * 50
    reals[1] = rate or 1.7e38
    return (
        "\n".join(text)
        + "\n"
        + rows([f"{v:10d}" for v in integers], 8)
        + rows([f"{v:15.7E}" for v in reals], 5)
        + "| Written for tests\n|\n"
        + rows([short_exponent(v, 10, 4) for v in values], 8)
    )


def knet(counts: list[int], *, direction: str = "N-S", scale: str = "3920(gal)/6182761", rate: int = 100) -> str:
    """K-NET ASCII; the duration is in whole seconds."""
    entries = [
        ("Origin Time", "1999/01/02 18:00:00"),
        ("Lat.", "37.798"),
        ("Long.", "142.200"),
        ("Depth. (km)", "36"),
        ("Mag.", "5.7"),
        ("Station Code", "TST001"),
        ("Station Lat.", "38.7262"),
        ("Station Long.", "141.5109"),
        ("Station Height(m)", "79"),
        ("Record Time", "1999/01/02 18:00:46"),
        ("Sampling Freq(Hz)", f"{rate}Hz"),
        ("Duration Time(s)", f"{len(counts) // rate}"),
        ("Dir.", direction),
        ("Scale Factor", scale),
        ("Max. Acc. (gal)", "48.060"),
        ("Last Correction", "1999/01/02 17:59:31"),
        ("Memo.", ""),
    ]
    head = "".join(f"{key:<18}{value}\n" for key, value in entries)
    lines = [counts[i : i + 8] for i in range(0, len(counts), 8)]
    return head + "".join(" ".join(f"{count:8d}" for count in line) + " \n" for line in lines)


def esm(values: list[float], *, dt: float = 0.005, kind: str = "ACCELERATION", units: str = "cm/s^2") -> str:
    """ESM (DYNA 1.2): 64 header lines, one value to a line."""
    entries = {
        "EVENT_NAME": "TESTVILLE",
        "EVENT_ID": "TEST-19990102_0000001",
        "EVENT_DATE_YYYYMMDD": "19990102",
        "EVENT_TIME_HHMMSS": "180000",
        "MAGNITUDE_W": "",
        "MAGNITUDE_L": "4.6",
        "NETWORK": "TT",
        "STATION_CODE": "TST1",
        "STATION_NAME": "Town Hall, Testville: cellar",
        "VS30_M/S": "",
        "DATE_TIME_FIRST_SAMPLE_YYYYMMDD_HHMMSS": "19990102_180019.870",
        "SAMPLING_INTERVAL_S": f"{dt:.6f}",
        "NDATA": f"{len(values)}",
        "DURATION_S": f"{len(values) * dt:.3f}",
        "STREAM": "HNE",
        "UNITS": units,
        "INSTRUMENT": "sensor = TEST [Unknown] | digitizer = Unknown [Unknown]",
        "INSTRUMENT_ANALOG/DIGITAL": "D",
        "PGA_CM/S^2": f"{max(map(abs, values)):.6f}",
        "BASELINE_CORRECTION": "BASELINE REMOVED",
        "LATE/NORMAL_TRIGGERED": "NT",
        "DATABASE_VERSION": "DYNA 1.0",
        "HEADER_FORMAT": "DYNA 1.2",
        "DATA_TYPE": kind,
        "PROCESSING": "manual (Paolucci et al., 2011)",
        "USER1": "",
        "USER5": "",
    }
    return "".join(f"{key}: {value}\n" for key, value in entries.items()) + "".join(f"{v:.6f}\n" for v in values)


def counts(seed: int, points: int) -> list[int]:
    """Integers around an instrument's offset of 8000."""
    return [8000 + round(v * 1577.2) for v in series(seed, points)]


def in_g(values: list[float]) -> list[float]:
    """cm/s^2 to g."""
    return [v / 980.665 for v in values]


def fixtures() -> dict[str, str]:
    """Every file of tests/data/formats: name and content."""
    film = [x for pair in zip(film_times(), series(4), strict=True) for x in pair]
    touching = [-150.25, -250.125, 1234.5, -0.5, -999.5] * 7 + [0.25, -0.125]
    return {
        "nga.at2": at2(in_g(series(1)), "NPTS=     37, DT=   .0050 SEC,"),
        "old.at2": at2(in_g(series(1)), "   37    0.0050    NPTS, DT", "ACCELERATION TIME HISTORY IN UNITS OF G"),
        "nga.vt2": at2(series(1), "NPTS=     37, DT=   .0050 SEC", "VELOCITY TIME SERIES IN UNITS OF CM/S"),
        "nga.dt2": at2(series(1), "NPTS=     37, DT=   .0050 SEC", "DISPLACEMENT TIME SERIES IN UNITS OF CM"),
        "two.v1": csmip_v1([(1, " 90 Deg", in_g(series(1))), (2, "Up", in_g(series(2)))]),
        "pairs.v1": csmip_v1_pairs(
            [
                (1, "EW", [100.0 + 0.005 * k for k in range(POINTS)], [v / 98.0665 for v in series(1)]),
                (2, "NS", film_times(), [v / 98.0665 for v in series(2)]),
            ]
        ),
        "two.v2": csmip_v2([(1, "360 Deg", series(1)), (2, " 90 Deg", series(2))]),
        "two.v2c": cosmos(series(1), number=1)
        + cosmos(series(3), quantity="velocity", units="cm/sec(05)", number=1)
        + cosmos(touching, number=2, direction="Up"),
        "single.v2c": cosmos(series(1), columns="(1E15.6)", fields=[f"{v:15.6e}" for v in series(1)], raw_step=0.02),
        "raw.v0c": cosmos(series(1), quantity="raw accel.", units="counts (50)"),
        "velocity.v2c": cosmos(series(1), quantity="velocity", units="cm/sec(05)"),
        "even.smc": smc(series(1)),
        "film.smc": smc(film, rate=None, title="1 UNCORRECTED ACCELEROGRAM"),
        "velocity.smc": smc(series(1), title="3 VELOCITY"),
        "knet.ns": knet(counts(1, 200)),
        "kiknet.ew2": knet(counts(2, 400), direction="5", scale="2000(gal)/8388608", rate=200),
        "esm.asc": esm(series(1)),
        "velocity.asc": esm(series(1), kind="VELOCITY", units="cm/s"),
        "times.csv": "time (s), acceleration (g)\n"
        + "".join(f"{0.005 * k:.3f},{v / 980.665:.7e}\n" for k, v in enumerate(series(1))),
        "column.txt": "# acceleration, cm/s2\n" + "".join(f"{v:.6f}\n" for v in series(1)),
    }


if __name__ == "__main__":
    FOLDER.mkdir(parents=True, exist_ok=True)
    for name, content in fixtures().items():
        (FOLDER / name).write_text(content, newline="\n")
