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


def csmip_v1_even(channels: list[tuple[int, str, list[float]]], rate: int = 200) -> str:
    """V1 with a line of points and step, as processed in the nineties; the header states the largest value."""
    text = ""
    for number, name, values in channels:
        peak = f"Units of uncor accel is g.                 Max  = {max(values, key=abs):7.3f} g, at  0.000 sec."
        text += csmip_v1_header(number, name, len(values), peak)
        text += (
            f"{len(values):5d} points of accel data equally spaced at {fortran(1.0 / rate, 4, 3)} sec.  (units: g)\n"
        )
        text += rows([f"{v:9.6f}" for v in values], 8)
        text += f"/&  ----------  END OF DATA FOR CHANNEL {number}  ----------\n"
    return text


def usc(times: list[float], values: list[float], component: str = "S05W") -> str:
    """USC uncorrected: pairs (s, g/10) in 10F7.3 behind a blank."""
    text = [
        "FILE     0 OF UNCORRECTED ACCELEROGRAM DATA OF VOLUME I:",
        "TESTVILLE EARTHQUAKE                                                    20",
        "JAN 02, 1999 -1800 GMT                                                  22",
        "IBB000  99.100.0 N                                                      18",
        "STATION USC# 0099   34 00 00N, 118 00 00W                               39",
        "100 MAIN ST., TESTVILLE, CA                                             27",
        f"COMP {component}                                                               9",
        "TESTVILLE EARTHQUAKE   JAN 02, 1999 -1800 GMT                           45",
        "EPICENTER -   34 00 00N, 118 00 00W                                     35",
        "INSTR PERIOD =  .037 SEC  DAMPING =   .568  SENSITIVITY =   1.69CM/G    69",
        f"NO. OF POINTS = {len(values):6d}      DURATION = {times[-1]:7.3f} SEC                      50",
        "UNITS ARE SEC AND G/10                                                  22",
        "RMS ACCLN. OF COMPLETE RECORD =     .211 G/10                           45",
    ]
    pairs = [f"{v:7.3f}" for pair in zip(times, values, strict=True) for v in pair]
    numbers = rows(["    0"] * 100, 16) + rows(["      .000"] * 50, 8)
    return "\n".join(text) + "\n" + numbers + "".join(f" {line}\n" for line in rows(pairs, 10).splitlines())


def usc_corrected(values: list[float], dt: float = 0.02) -> str:
    """USC corrected: acceleration (cm/s^2), velocity and displacement, the first without its units."""
    text = ["CORRECTED ACCELEROGRAM  IIBB000  99.100.0 COMP N08W   FILE   0  CORRESPONDING T"]
    text += usc([0.0, 1.0], [0.0, 0.0], "N08W").splitlines()[:13]
    text += [
        "ACCELEROGRAM IS BAND-PASS FILTERED BETWEEN  .225- .325 AND 25.00-27.00 HZ.",
        f"{len(values):6d}  INSTRUMENT AND BASELINE CORRECTED DATA",
        f"AT EQUALLY-SPACED INTERVALS OF    {fortran(dt, 4, 3)}  SEC.",
        f"PEAK ACCELERATION = {max(values, key=abs):11.5f}  CMS/SEC/SEC AT    4.580   SEC.",
        "PEAK   VELOCITY   =    12.05681    CMS/SEC   AT    4.500   SEC.",
    ]
    body = ""
    for quantity, units, factor in (
        ("ACC", "", 1.0),
        ("VEL", "  IN UNITS CM/SEC", 0.1),
        ("DIS", "  IN UNITS CM", 0.01),
    ):
        body += f"{len(values):6d} POINTS OF {quantity} DATA EQUALLY SPACED AT   {fortran(dt, 4, 3)} SEC.{units}\n"
        body += rows([fortran(factor * v, 10, 3) for v in values], 8)
    return "\n".join(text) + "\n" + rows(["    0"] * 100, 16) + rows(["      .000"] * 100, 8) + body


def geonet(channels: list[tuple[str, list[float]]], dt: float = 0.005, *, corrected: bool = False) -> str:
    """GeoNet V1A and V2A: mm/s^2 in 10F8.1; velocity and displacement follow a corrected acceleration."""
    text = ""
    for component, values in channels:
        count, peak = len(values), max(values, key=abs)
        stage = "Corrected" if corrected else "Uncorrected"
        text += f"""{stage} accelerogram 19990102_180000_TST_20 Test Institute
Site TST       42 00 00S  172 00 00E     Basalt file:  19990102_180000_TST
Testville Town Hall
Instrument Test_1
Resolution: 24-bit   Instr Period: 0.0050 s   Damping: 0.700
Accelerogram 19990102_180000_TST_20                 Processed 1999 January 03
5 km south of Testville
1999 January 02         18:00:00 UT
Epicentre  42 00 00S 173 00 00E  Bearing S40E  Dist   25km  Depth   15km Mw 7.00
Number of points  {count}    Duration {(count - 1) * dt:.2f} s
"""
        if corrected:
            text += f"Instrument corrected data at {dt:.3f} sec intervals\nBand-pass filter bands are .10-.25 Hz\n"
        else:
            text += f"Raw readings in units of 1.00 mm/s/s  at intervals of {dt:.3f} s\nData is unfiltered\n"
        text += f"Component {component}\nAcceleration:  Peak {peak:8.1f} mm/s/s at   0.15 s     RMS   20.89 mm/s/s\n"
        text += "Velocity record\nDisplacement record\n"
        parts = 3 if corrected else 1
        counts = [count, 0, 0] + [count if k < parts else 0 for k in range(3)]
        text += rows([f"{v:8d}" for v in [0] * 30 + counts + [0] * 4], 10) + rows([f"{v:8.2f}" for v in [0.0] * 60], 10)
        for k in range(parts):
            text += rows([f"{10.0**-k * v:8.1f}" for v in values], 10)
    return text


def bhrc(channels: list[tuple[str, list[float]]], dt: float = 0.005) -> str:
    """BHRC V1: g/10 in 10E13.6; the header's numbers are cut at 70 characters."""
    text = ""
    for component, values in channels:
        text += f"""* VOL1DS FILE:  1/01
Inst Type = SSA-2
Origin Time : 1999/01/02   18:00:00

L

COMP {component}
Testville                 Station   38.0 N 47.0 E   Altitude 1000m   Azimuth L 352   T 82
Epicenter 38.5 N 46.8 E
INSTR PERIOD =  .019 SEC   DAMPING =  .640
NO. OF POINTS = {len(values):6d}      DURATION = {len(values) * dt:7.3f}
UNITS ARE SECONDS AND G/10

"""
        text += rows(["    0"] * 88, 14) + "".join(
            f"{line[:70]}\n" for line in rows(["  .000000E+00"] * 50, 8).splitlines()
        )
        text += rows([exponent(v, 13, 6) for v in values], 10)
    return text


def cwa(components: dict[str, list[float]], rate: int = 50) -> str:
    """CWA: times and gal in 4F10.3; some samples more than whole seconds."""
    count = len(next(iter(components.values())))
    peaks = "".join(f"#AmplitudeMAX. {name}: {max(v):8.3f}~ {min(v):8.3f}\n" for name, v in components.items())
    head = f"""#Earthquake Information
#Origin Time(GMT+08): 1999/01/02-18:00:00
#Magnitude(Ml): 6.0

#Station Information
#StationCode: TST
#StationName: Testville
#InstrumentKind: FBA
#StartTime(GMT+08): 1999/01/02-17:59:50.000
#RecordLength(sec): {count // rate}
#SampleRate(Hz): {rate}
#AmplitudeUnit:  gal. DCoffset(corr)
{peaks}#DataSequence: Time {"; ".join(f"{name}(+)" for name in components)}
#Data: 4F10.3
"""
    table = zip(*components.values(), strict=True)
    return head + "".join(
        f"{k / rate:10.3f}" + "".join(f"{v:10.3f}" for v in row) + "\n" for k, row in enumerate(table)
    )


def afad(components: dict[str, list[float]], dt: float = 0.01) -> str:
    """AFAD before 2020: gal in three columns."""
    peaks = " ".join(f"({name}) {max(map(abs, v)):.6f}" for name, v in components.items())
    head = f"""STRONG GROUND MOTION RECORDS OF TESTLAND
PLACE                   : TESTVILLE TOWN HALL
EARTHQUAKE DATE         : 1999/01/02 18:00:00 (GMT)
STATION ID              : 0099
RECORD TIME             : 02/01/1999 17:59:50.000000 (GMT)
NUMBER OF DATA          : {len(next(iter(components.values())))}
SAMPLING INTERVAL (sec) : {dt:g}
RAW PGA VALUES (gal)    : {peaks}
"""
    names = "".join(f"{name:>13}" for name in components)
    return (
        head
        + names
        + "\n"
        + "".join("".join(f"{v:13.6f}" for v in row) + "\n" for row in zip(*components.values(), strict=True))
    )


def unam(components: dict[str, list[float]], rate: int = 200) -> str:
    """ASA 2.0: 109 lines of header, then gal in 3F10.4."""
    count, channels = len(next(iter(components.values()))), range(len(components))
    peaks = "/".join(f"{max(v, key=abs):.4f}" for v in components.values())
    entries = {
        "NOMBRE DE LA ESTACION": "PUEBLO DE PRUEBA",
        "CLAVE DE LA ESTACION": "TST1",
        "ORIENTACION C1-C6 (rumbo;orientacion)": "/" + "/".join(components),
        "VEL. DE MUESTREO, C1-C6 (muestras/s)": "".join(f"/{rate}" for _ in channels),
        "INTERVALO DE MUESTREO, C1-C6 (s)": "".join(f"/{1.0 / rate:g}" for _ in channels),
        "INTERVALO DE MUESTREO, C7-C12 (s)": "",
        "FECHA DEL SISMO [GMT]": "1999/01/02",
        "HORA EPICENTRO (GMT)": "18:00:00",
        "DURACION DEL REGISTRO (s), C1-C6": "".join(f"/{count / rate:.2f}" for _ in channels),
        "NUM. TOTAL DE MUESTRAS, C1-C6": "".join(f"/{count}" for _ in channels),
        "ACEL. MAX.(Gal), C1-C6": f"/{peaks}",
        "UNIDADES DE LOS DATOS": "Gal (cm/s/s)",
        "FORMATO DATOS (FORTRAN,10 campos/dato)": "3F10.4",
    }
    lines = ["*" * 86] + [f"{key:<39}: {value}" for key, value in entries.items()]
    lines += [""] * (106 - len(lines)) + ["---------+" * 8]
    lines += ["".join(f"{f'CANAL-{k + 1}':>10}" for k in channels), "".join(f"{name:>10}" for name in components)]
    return "\n".join([*lines, ""]) + "".join(
        "".join(f"{v:10.4f}" for v in row) + "\n" for row in zip(*components.values(), strict=True)
    )


def csmnc(values: list[float], dt: float = 0.005) -> str:
    """CSMNC: cm/s^2, eight numbers to a line."""
    peak = max(values, key=abs)
    head = f"""099TST990102180000
0990102180000 1999-01-02 18:0:0 BTM
TESTVILLE EARTHQUAKE, TESTLAND
EPICENTER  30.300N 103.000E DEPTH 13 KM
MAGNITUDE  7.0(Ms)
STATION: 99TST 30.400N 102.800E
SITE CONDITION: ROCK
INSTRUMENT TYPE: TEST
OBSERVING POINT: GROUND
COMP. EW
UNCORRECTED ACCELERATION          UNIT: CM/SEC/SEC
NO. OF POINTS:  {len(values)}  EQUALLY SPACED INTERVALS OF:  {dt:g}  SEC
PEAK VALUE:    {peak:.3f}   AT   26.35 SEC    DURATION:  {len(values) * dt:g} SEC
PRE-EVENT TIME:  20  SEC
CSMNC

"""
    return head + rows([f"{v:14.6E}" for v in values], 8)


def saf(components: dict[str, list[float]], rate: int = 50, units: str = "m/s2") -> str:
    """SESAME ASCII format: keys with values, then three columns."""
    names = "".join(f"CH{k}_ID = {name}\n" for k, name in enumerate(components))
    head = f"""SESAME ASCII data format (saf) v. 1    (this line must not be modified)
SAMP_FREQ = {rate}
NDAT = {len(next(iter(components.values()))):010d}
START_TIME = 1999 01 02 18 00 10.000
# a remark
STA_CODE = TST-02
UNITS = {units}
{names}####--------------------------------
"""
    return head + "".join(" ".join(f"{v:.6f}" for v in row) + "\n" for row in zip(*components.values(), strict=True))


def npts_dt(values: list[float], dt: float = 0.005, per_line: int = 1) -> str:
    """A title, count and step, and the values, as many programs write them."""
    title = f"a motion, units g\n{len(values)} {dt:.4f}\n"
    return title + rows([f"{v:12.6f}" for v in values], per_line)


def counts(seed: int, points: int) -> list[int]:
    """Integers around an instrument's offset of 8000."""
    return [8000 + round(v * 1577.2) for v in series(seed, points)]


def in_g(values: list[float]) -> list[float]:
    """cm/s^2 to g."""
    return [v / 980.665 for v in values]


def in_mm(values: list[float]) -> list[float]:
    """cm/s^2 to mm/s^2."""
    return [10.0 * v for v in values]


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
        "even.v1": csmip_v1_even([(1, " 90 Deg", in_g(series(1))), (2, "Up", in_g(series(2)))]),
        "padded.smc": smc([*series(1), 0.0, 0.0, 0.0], title="1 UNCORRECTED ACCELEROGRAM").replace(
            "        40", "        37"
        ),
        "usc.s0a": usc(film_times(), [v / 98.0665 for v in series(1)]),
        "usc.s0b": usc_corrected(series(1)),
        "geonet.v1a": geonet([("N10E", in_mm(series(1))), ("N80W", in_mm(series(2))), ("Up", in_mm(series(3)))]),
        "geonet.v2a": geonet([("S16W", in_mm(series(1))), ("Up", in_mm(series(3)))], 0.02, corrected=True),
        "bhrc.v1": bhrc([("L1", [v / 98.0665 for v in series(1)]), ("V2", series(2)), ("T3", series(3))]),
        "cwa.dat": cwa(dict(zip("UNE", (series(3, 105), series(1, 105), series(2, 105)), strict=True))),
        "afad.txt": afad({"N-S": series(1), "E-W": series(2), "U-D": series(3)}),
        "unam.txt": unam({"V": series(3), "N00E": series(1), "N90W": series(2)}),
        "csmnc.dat": csmnc(series(1)),
        "sesame.saf": saf({"V": series(3), "N": series(1), "E": series(2)}),
        "npts.txt": npts_dt(in_g(series(1))),
        "wrapped.g3": npts_dt(in_g(series(1)), per_line=5),
        "times.csv": "time (s), acceleration (g)\n"
        + "".join(f"{0.005 * k:.3f},{v / 980.665:.7e}\n" for k, v in enumerate(series(1))),
        "column.txt": "# acceleration, cm/s2\n" + "".join(f"{v:.6f}\n" for v in series(1)),
    }


if __name__ == "__main__":
    FOLDER.mkdir(parents=True, exist_ok=True)
    for name, content in fixtures().items():
        (FOLDER / name).write_text(content, newline="\n")
