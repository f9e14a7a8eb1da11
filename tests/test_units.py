"""Every unit in which a number may be given, of every quantity and in every place, against values in SI units."""

import math

import numpy as np
import pytest

import rocking
from rocking import HazardCurve, Measure
from rocking.analysis.hazard import INTENSITY_HEADINGS
from rocking.calibration.tables import read_observed
from rocking.inputs import quantities
from rocking.records import units
from rocking.solid.mesh import LENGTH_UNITS as LENGTHS_OF_MESHES

G = 9.80665

LENGTHS = {"": 1.0, "m": 1.0, "cm": 1e-2, "mm": 1e-3, "ft": 0.3048, "in": 0.0254}
ACCELERATIONS = {
    "g": G, "gs": G, "g10": 0.1 * G, "%g": 0.01 * G, "mg": 1e-3 * G, "ms2": 1.0, "mss": 1.0, "gal": 1e-2, "cms2": 1e-2,
    "cmss": 1e-2, "cmsss": 1e-2,
    "mms2": 1e-3, "mmss": 1e-3, "ums2": 1e-6, "µms2": 1e-6, "μms2": 1e-6, "nms2": 1e-9, "fts2": 0.3048,
    "ftss": 0.3048, "ins2": 0.0254, "inss": 0.0254,
}  # fmt: skip
TIMES = {
    1.0: "s sec secs second seconds seg segundos sek sekunden secondes secondi",
    1e-3: "ms msec msecs millis millisecond milliseconds",
    1e-6: "us µs μs usec microsecond microseconds",
    1e-9: "ns nsec nanosecond nanoseconds",
    60.0: "min mins minute minutes",
    3600.0: "h hr hrs hour hours",
    86400.0: "d day days",
}
SECONDS = {spelling: factor for factor, spellings in TIMES.items() for spelling in spellings.split()}
PER_TURN = math.pi / 180.0

#: One unit of each quantity, in SI units.
WRITTEN = {
    "length": LENGTHS,
    "position": LENGTHS,
    "angle": {"": 1.0, "rad": 1.0, "radian": 1.0, "radians": 1.0}
    | dict.fromkeys(("deg", "degree", "degrees", "°", "º"), PER_TURN),
    "acceleration": {"": 1.0, **ACCELERATIONS},
    "velocity": {"": 1.0, **{f"{name}s": factor for name, factor in LENGTHS.items() if name}},
    "frequency": {"": 1.0, "hz": 1.0, "rads": 0.5 / math.pi},
    "rate": {"": 1.0, "rads": 1.0, "degs": PER_TURN, "°s": PER_TURN},
    "duration": {"": 1.0, **{units.normalise_spelling(each): factor for each, factor in SECONDS.items()}},
    "number": {"": 1.0},
}


@pytest.mark.parametrize("kind", quantities.UNITS)
def test_every_unit_of_a_quantity_is_so_much_in_si_units(kind):
    assert set(WRITTEN[kind]) == set(quantities.UNITS[kind])
    for spelling, factor in WRITTEN[kind].items():
        assert getattr(quantities, f"read_{kind}")(f"2.5 {spelling}", "x") == pytest.approx(2.5 * factor, rel=1e-15), (
            spelling
        )


def test_every_spelling_of_accelerations_and_times_in_records_is_so_much_in_si_units():
    assert (set(ACCELERATIONS), set(SECONDS)) == (set(units.ACCELERATION_UNITS), set(units.TIME_UNITS))
    for find, factors in ((units.find_unit, ACCELERATIONS), (units.find_time_unit, SECONDS)):
        for spelling, factor in factors.items():
            assert find(spelling).to_si(np.array([2.5])) == pytest.approx(2.5 * factor, rel=1e-15), spelling


#: An intensity of each heading, as it is written and in SI units.
HEADED = {
    "pga_g": ("PGA (g)", 1.0 / G), "pga_percent_g": ("PGA (%g)", 100.0 / G), "pga_m_s2": ("PGA (m/s²)", 1.0),
    "pgv_m_s": ("PGV (m/s)", 1.0), "pgv_cm_s": ("PGV (cm/s)", 100.0),
    "sa_g": ("Sa (g)", 1.0 / G), "sa_percent_g": ("Sa (% g)", 100.0 / G), "sa_m_s2": ("SA [m/s^2]", 1.0),
    "pgd_m": ("PGD (m)", 1.0), "pgd_cm": ("PGD [cm]", 100.0), "arias_m_s": ("Arias (m/s)", 1.0),
    "cav_m_s": ("CAV (m/s)", 1.0), "cav_g_s": ("CAV (g s)", 1.0 / G),
}  # fmt: skip


@pytest.mark.parametrize("heading", INTENSITY_HEADINGS)
def test_an_intensity_is_the_same_in_every_column_of_hazard_curves_and_outcomes(heading, tmp_path):
    (written, per_si), measure = HEADED[heading], Measure(heading.partition("_")[0], *[1.0] * heading.startswith("sa"))
    levels, path = np.array([0.5, 1.25, 4.0]), tmp_path / "table.csv"
    for name in (heading, written):
        rows = [f"{x * per_si!r},{rate}" for x, rate in zip(levels.tolist(), (1e-2, 1e-3, 1e-4), strict=True)]
        path.write_text("\n".join([f"{name},annual_rate", *rows]), "utf-8")
        hazard = HazardCurve.read(path, period=measure.period)
        assert hazard.measure == measure and hazard.intensity == pytest.approx(levels, rel=1e-14)
        rows = [f"{x * per_si!r},{fell}" for x, fell in zip(levels.tolist(), (0, 1, 1), strict=True)]
        path.write_text("\n".join([f"{name},overturned", *rows]), "utf-8")
        observed = read_observed(path, measure)
        assert observed["measure"] == measure and observed["intensity"] == pytest.approx(levels, rel=1e-14)


@pytest.mark.parametrize(
    ("kind", "factor"), [("PGA", G), ("PGV", 0.01), ("SA(0.3)", G), ("PGD", 0.01), ("IA", 1.0), ("CAV", G)]
)
def test_an_intensity_of_openquake_is_in_its_own_units(kind, factor, tmp_path):
    path = tmp_path / "hazard.csv"
    path.write_text(
        f"#,,,,\"kind='mean', investigation_time=50.0, imt='{kind}'\"\n"
        "lon,lat,depth,poe-0.1,poe-0.2,poe-0.3\n10.0,45.0,0.0,0.5,0.3,0.2\n"
    )
    hazard = HazardCurve.read(path)
    assert hazard.measure == (
        Measure("sa", 0.3) if kind.startswith("SA") else Measure({"IA": "arias"}.get(kind, kind.lower()))
    )
    assert hazard.intensity == pytest.approx(factor * np.array([0.1, 0.2, 0.3]), rel=1e-14)


@pytest.mark.parametrize(
    ("name", "column", "label", "scale"),
    [
        ("factor", "factor", "factor of the motion", 1.0),
        ("pga", "pga_m_s2", "peak ground acceleration (g)", 1.0 / G),
        ("pgv", "pgv_m_s", "peak ground velocity (m/s)", 1.0),
        ("sa", "sa_m_s2", "spectral acceleration at 1 s (g)", 1.0 / G),
        ("pga_ratio", "pga_ratio", "PGA / uplift acceleration", 1.0),
        ("pgv_ratio", "pgv_ratio", "p PGV / uplift acceleration", 1.0),
    ],
)
def test_every_measure_is_labelled_in_the_unit_in_which_it_is_shown(name, column, label, scale):
    measure = Measure(name, *[1.0] * (name == "sa"))
    assert (measure.column, measure.label) == (column, label)
    assert measure.display_factor == pytest.approx(scale, rel=1e-15)


@pytest.mark.parametrize("damping", [0.0, 0.05, 0.2])
@pytest.mark.parametrize("period", [0.3, 2.0])
def test_a_spectral_acceleration_is_labelled_with_its_oscillator(period, damping):
    measure = Measure("sa", period, damping)
    assert measure.options() == {"period": period, "damping": damping}
    assert measure.motion_measure == Measure.parse(measure) == measure
    assert (
        (f"damping {damping:g}" in measure.label) == (f"damping {damping:g}" in measure.short_name) == (damping != 0.05)
    )
    motion = rocking.pulses.one_sine(2.0, 1.0)
    assert measure.value(motion) == pytest.approx(motion.spectral_acceleration(period, damping), rel=1e-15)


@pytest.mark.parametrize(("unit", "metres"), [each for each in LENGTHS.items() if each[0]])
def test_a_mesh_is_as_large_as_its_unit_says(unit, metres):
    trimesh = pytest.importorskip("trimesh")
    assert {*LENGTHS_OF_MESHES, ""} == set(LENGTHS)
    box = trimesh.creation.box((0.6 / metres, 0.4 / metres, 1.8 / metres))
    box.apply_translation([0.0, 0.0, 0.9 / metres])
    solid = rocking.Solid.from_mesh(box, density=2000.0, unit=unit)
    assert solid.block(0.0).mass == pytest.approx(2000.0 * 0.6 * 0.4 * 1.8, rel=1e-12)
