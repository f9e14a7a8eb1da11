"""Pairs of horizontal components: measures in all directions, the larger response, and every measure of a motion."""

import itertools
import json
import math
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import rocking
from rocking import Block, HazardCurve, Measure, Motion, fragility, incremental_dynamic_analysis
from rocking.errors import MotionError, OptionError, RecordError
from rocking.motion.scaling import SCALING_MEASURES
from rocking.records import load_pairs

PAIR = load_pairs("el-centro-meloland-*")
BLOCK = Block(width=0.5, height=2.0)
#: Measures with their periods.
MEASURES: dict[str, Any] = {
    "pga": None, "pgv": None, "pgd": None, "sa": 0.4, "sa_average": (0.2, 0.5, 1.0), "arias": None, "cav": None,
    "incremental_velocity": None, "duration": None,
}  # fmt: skip


def noise(seed: int, samples: int = 60) -> Motion:
    return Motion.from_samples(np.random.default_rng(seed).normal(size=samples), 0.02, name=f"noise {seed}")


def rotate(first: Motion, second: Motion, degrees: float) -> Motion:
    return first.scaled(math.cos(math.radians(degrees))) + second.scaled(math.sin(math.radians(degrees)))


@pytest.mark.parametrize("name", MEASURES)
def test_a_measure_of_a_pair_is_that_of_its_directions(name: str) -> None:
    """All directions by adding the scaled components, and each by the measure of one motion (for SA, by its kernel)."""
    first, second = noise(1), noise(2)
    own = Measure(name, MEASURES[name])  # type: ignore[arg-type]
    directions = np.array([own.value(rotate(first, second, k)) for k in range(180)])
    pair = first.with_orthogonal(second)
    expected = {
        "rotd50": np.median(directions), "rotd100": directions.max(), "larger": max(directions[[0, 90]]),
        "geometric_mean": math.sqrt(directions[0] * directions[90]),
    }  # fmt: skip
    if name == "sa_average":
        each = np.array(
            [[Measure("sa", t).value(rotate(first, second, k)) for k in range(180)] for t in (0.2, 0.5, 1.0)]
        )
        assert expected["rotd50"] == pytest.approx(np.median(np.exp(np.log(each).mean(axis=0))), rel=1e-12)
    for component, value in expected.items():
        measure = Measure(name, MEASURES[name], component=component)  # type: ignore[arg-type]
        assert measure.value(pair) == pytest.approx(value, rel=1e-9), component
        assert measure.value(second.with_orthogonal(first)) == pytest.approx(value, rel=1e-9), component
    assert own.value(pair) == own.value(first)


def test_motions_in_one_direction_and_in_a_circle_have_known_measures() -> None:
    line = PAIR[0].with_orthogonal(Motion.from_samples([0.0, 0.0], PAIR[0].duration))
    for name, power in {"pga": 1, "pgv": 1, "sa": 1, "arias": 2, "cav": 1}.items():
        value = Measure(name, MEASURES[name]).value(line)  # type: ignore[arg-type]
        measures = [Measure(name, MEASURES[name], component=kind) for kind in ("rotd50", "rotd100")]  # type: ignore[arg-type]
        expected = value * math.cos(math.pi / 4.0) ** power, value
        assert [measure.value(line) for measure in measures] == pytest.approx(expected, rel=1e-9)
    phases = {"cosine": 0.5 * math.pi, "sine": 0.0}
    cosine, sine = (rocking.pulses.sine(2.0, 1.0, cycles=5.0, phase=phase) for phase in phases.values())
    circle = cosine.with_orthogonal(sine)
    assert Measure("pga", component="rotd50").value(circle) == pytest.approx(2.0, rel=1e-9)
    assert Measure("pga", component="rotd100").value(circle) == pytest.approx(2.0, rel=1e-9)


@pytest.mark.parametrize("component", ["rotd50", "rotd100"])
def test_a_measure_over_all_directions_does_not_depend_on_the_sensors(component: Any) -> None:
    turned = [rotate(PAIR[0], PAIR[1], 37.0), rotate(PAIR[0], PAIR[1], 127.0)]
    for name in ("pga", "pgv", "sa"):
        measure = Measure(name, MEASURES[name], component=component)  # type: ignore[arg-type]
        assert measure.value(turned[0].with_orthogonal(turned[1])) == pytest.approx(measure.value(PAIR[0]), rel=1e-9)


def test_rotated_spectra_are_those_of_another_program() -> None:
    """Values of pyRotd 0.6.1, whose oscillators are computed by Fourier transforms, for 5 % damping."""
    periods, tolerance = (0.1, 0.2, 0.5, 1.0, 2.0, 3.0), 6e-3
    known = {
        "rotd50": (3.42287533, 4.50061043, 6.53880049, 3.83618441, 4.20417451, 3.33391127),
        "rotd100": (3.86250299, 4.88524372, 7.49836864, 5.34954337, 5.88476494, 4.60467728),
    }
    for component, values in known.items():
        measures = [Measure("sa", period, component=component) for period in periods]  # type: ignore[arg-type]
        assert [measure.value(PAIR[0]) for measure in measures] == pytest.approx(values, rel=tolerance)


@pytest.mark.parametrize("name", [name for name in SCALING_MEASURES if name != "factor"])
@pytest.mark.parametrize("component", ["own", "rotd50"])
def test_a_motion_is_scaled_to_a_level_of_every_measure(name: Any, component: Any) -> None:
    motion, measure = noise(3).with_orthogonal(noise(4)), Measure(name, MEASURES[name], component=component)
    scaled = motion.scaled_to(1.7, measure)
    assert measure.value(scaled) == pytest.approx(1.7, rel=1e-9)
    assert scaled.orthogonal is not None and motion.orthogonal is not None
    factor = scaled.pga / motion.pga
    assert scaled.orthogonal.pga == pytest.approx(factor * motion.orthogonal.pga, rel=1e-12)
    again = rocking.simulation.ensemble.ScalingLevels.from_levels([1.7], measure).factors(motion)
    assert again == pytest.approx([factor], rel=1e-9)


def test_incremental_velocity_is_the_largest_area_between_sign_changes() -> None:
    motion = noise(5)
    times = np.linspace(0.0, motion.duration, 200_001)
    samples = motion.acceleration(times)
    starts = np.flatnonzero(np.diff(np.sign(samples), prepend=0.0))
    areas = np.add.reduceat(samples, starts) * (times[1] - times[0])
    assert motion.incremental_velocity == pytest.approx(np.abs(areas).max(), rel=1e-3)
    assert rocking.pulses.one_sine(2.0, 1.0).incremental_velocity == pytest.approx(2.0 / math.pi, rel=1e-12)
    assert Motion.from_samples([0.0, 0.0], 1.0).incremental_velocity == 0.0


def test_components_follow_delays_processing_and_scaling_and_are_dropped_otherwise() -> None:
    pair = noise(6).with_orthogonal(noise(7))
    measure = Measure("pga", component="rotd100")
    assert measure.value(pair.delayed(1.0)) == pytest.approx(measure.value(pair), rel=1e-12)
    assert measure.value(-pair) == pytest.approx(measure.value(pair), rel=1e-12)
    trimmed = pair.processed(trim=(0.2, 0.8))
    both = pair.processed(trim=(0.2, 0.8)), noise(7).processed(trim=(0.2, 0.8))
    assert measure.value(trimmed) == measure.value(both[0].with_orthogonal(both[1]))
    assert measure.value(pair.on_floor(0.3)) == measure.value(
        noise(6).on_floor(0.3).with_orthogonal(noise(7).on_floor(0.3))
    )
    assert pair.with_orthogonal(None).orthogonal is None


@pytest.mark.parametrize(
    ("call", "words"),
    [
        (
            lambda: Measure("pga", component="rotd50").value(noise(1)),
            "requires two horizontal components, and noise 1 has",
        ),
        (lambda: Measure("pga", component="rotd25"), "component must be one of own, geometric_mean, larger, rotd50"),  # type: ignore[arg-type]
        (lambda: Measure("sa_average"), "requires several values of period"),
        (lambda: Measure.parse("sa_average"), "requires periods, in s"),
        (lambda: noise(1).scaled_to(3.0, "duration"), "measure must be one of"),
        (lambda: noise(1).with_orthogonal(3.0), "orthogonal must be a Motion"),  # type: ignore[arg-type]
        (lambda: load_pairs("ridgecrest-clc-090"), "no station has a pair of horizontal components"),
        (lambda: PAIR[0].with_orthogonal(PAIR[0]), "orthogonal must be perpendicular"),
        (lambda: fragility(BLOCK, PAIR, larger=True), "requires a measure of the pair"),
        (
            lambda: fragility(BLOCK, PAIR[:1], larger=True, measure=Measure("pga", component="rotd50")),
            "the other one of el-centro-meloland-360 is missing",
        ),
    ],
)
def test_impossible_measures_and_pairs_are_refused(call: Callable[[], object], words: str) -> None:
    with pytest.raises((OptionError, MotionError, RecordError)) as caught:
        call()
    assert words in str(caught.value)


LEVELS = np.linspace(2.0, 14.0, 7)
ROTATED = Measure("pga", component="rotd50")


@pytest.fixture(scope="module")
def pairs() -> tuple[Motion, ...]:
    return load_pairs(["el-centro-meloland-*", "ridgecrest-tow2-*", "ridgecrest-clc-*"])


def test_only_the_larger_response_of_a_pair_counts(pairs: tuple[Motion, ...]) -> None:
    result = fragility(BLOCK, pairs, measure=ROTATED, levels=LEVELS, polarity="both", larger=True)
    curve, outcomes = result.curves[0], result.outcomes
    assert outcomes is not None and len(outcomes) == 3 * len(LEVELS)
    expected = []
    for level, (first, second) in itertools.product(LEVELS, zip(pairs[::2], pairs[1::2], strict=True)):
        factor = level / ROTATED.value(first)
        runs = [rocking.simulate(BLOCK, m.scaled(s * factor)) for m in (first, second) for s in (1.0, -1.0)]
        expected.append(any(run.overturned for run in runs))
        row = outcomes.iloc[len(expected) - 1]
        largest = max(math.inf if run.overturned else run.peak_over_slenderness for run in runs)
        assert row.peak_over_alpha == pytest.approx(largest, rel=1e-6)
        assert row.motion in (first.name, second.name)
    assert outcomes.overturned.tolist() == expected and 0 < sum(expected) < len(expected)
    assert (curve.exceedance_counts.sum(), curve.trial_counts.sum()) == (sum(expected), len(expected))
    assert result.description.endswith("the larger response") and curve.cluster_count == 3
    shuffled = fragility(BLOCK, [pairs[k] for k in (0, 2, 5, 1, 4, 3)], measure=ROTATED, levels=LEVELS, larger=True)
    assert shuffled.curves[0].exceedance_counts.sum() == curve.exceedance_counts.sum()


def test_a_fragility_meets_the_hazard_curve_in_its_own_component(pairs: tuple[Motion, ...], tmp_path: Path) -> None:
    file = tmp_path / "site.csv"
    file.write_text("pga_g,annual_rate\n0.1,1e-2\n0.5,1e-3\n1.5,1e-5\n")
    fitted = fragility(BLOCK, pairs, measure=ROTATED, levels=LEVELS)
    assert fitted.annual_rate(HazardCurve.read(file, component="rotd50")).rates[0].annual_rate > 0.0
    with pytest.raises(OptionError, match=r"must have the same measure; got peak ground acceleration, RotD50 \(g\)"):
        fitted.annual_rate(HazardCurve.read(file))
    assert fitted.curves[0].cluster_count == 3  # components of a pair are dependent
    assert fitted.to_dict()["measure"] == {"name": "pga", "units": "m/s^2", "component": "rotd50"}


@pytest.mark.parametrize("name", ["arias", "cav", "pgd", "sa_average"])
def test_an_incremental_analysis_finds_the_same_motion_by_every_measure(name: Any) -> None:
    measure, motion = Measure(name, MEASURES[name]), PAIR[0]
    by_pga = incremental_dynamic_analysis(BLOCK, motion, levels=np.geomspace(1.0, 12.0, 16))
    scaled = [motion.scaled_to(level) for level in by_pga.data.level.values]
    found = incremental_dynamic_analysis(BLOCK, motion, measure=measure, levels=[measure.value(m) for m in scaled])
    np.testing.assert_allclose(found.data.peak_rotation, by_pga.data.peak_rotation, rtol=1e-9)
    ends = [end for band in found.bands() for end in band if not math.isnan(end)]
    below, above = ([motion.scaled_to(x * end, measure) for end in ends] for x in (1.0 - 3e-6, 1.0 + 3e-6))
    verdicts = [[rocking.simulate(BLOCK, m).overturned for m in side] for side in (below, above)]
    assert ends and all(first != second for first, second in zip(*verdicts, strict=True))
    uplift = motion.scaled_to(by_pga.data.lowest_uplift)
    assert found.data.lowest_uplift == pytest.approx(measure.value(uplift), rel=1e-9)


def test_the_comparison_of_measures_takes_further_ones(pairs: tuple[Motion, ...]) -> None:
    result = rocking.compare_measures(
        BLOCK, pairs, periods=[1.0], further_measures=["arias", "cav"], component="rotd50"
    )
    names = [str(name) for name in result.data.measure.values]
    assert "Arias intensity, RotD50" in names and "CAV, RotD50" in names
    alone = rocking.compare_measures(BLOCK, pairs, periods=[1.0], further_measures=["arias"])
    row = alone.data.intensity.sel(measure="Arias intensity").values[:, 0]
    pga = alone.data.intensity.sel(measure="PGA").values[:, 0]
    known = [Measure("arias").value(motion.scaled_to(level)) for motion, level in zip(pairs, pga, strict=True)]
    assert row == pytest.approx(known, rel=1e-9)


def test_a_study_of_pairs_counts_the_larger_response(pairs: tuple[Motion, ...], tmp_path: Path) -> None:
    file = tmp_path / "study.toml"
    names = [f"ridgecrest-{station}-{azimuth}" for station in ("tow2", "clc") for azimuth in ("090", "360")]
    records = json.dumps(["el-centro-meloland-270", "el-centro-meloland-360", *names])
    scales = f'pga = {LEVELS.tolist()}\ncomponent = "rotd50"\npolarity = "both"'
    file.write_text(
        f"[blocks]\nwidth = 0.5\nheight = 2.0\n[motions]\nrecords = {records}\npairs = true\n[scales]\n{scales}\n"
    )
    product = rocking.studies.read_study(file).product
    options: dict[str, Any] = {"levels": product.scales.values, "measure": product.scales.measure, "polarity": "both"}
    rocking.create_study(tmp_path / "folder", product.bodies, product.motions, **options).run()
    direct = fragility(BLOCK, pairs, measure=ROTATED, levels=LEVELS, polarity="both", larger=True).curves[0]
    again = rocking.Study(tmp_path / "folder")
    curve = again.fragility(measure=ROTATED, larger=True).curves[0]
    assert (curve.median, curve.dispersion) == pytest.approx((direct.median, direct.dispersion), rel=1e-9)
    table = again.block_fragilities(measure=ROTATED, larger=True).data
    assert float(table["median"][0, 0]) == pytest.approx(direct.median, rel=1e-9)
    assert int(table.trial_count[0, 0]) == 3 * len(LEVELS)


def test_commands_take_pairs(run: Callable[..., tuple[int, str, str]]) -> None:
    block = ["--width", "0.5", "--height", "2"]
    stations = ["el-centro-meloland-*", "ridgecrest-tow2-*"]
    about = ["--component", "rotd50", "--larger", "--levels", "0.2g:1.6g:8", "--polarity", "both", "--json"]
    code, out, err = run("fragility", *stations, *block, *about)
    assert (code, "looks vertical" in err) == (0, False)
    result = json.loads(out)
    assert result["measure"]["component"] == "rotd50" and len(result["outcomes"]) == 2 * 8
    code, out, _ = run("simulate", *stations, *block, "--component", "rotd50", "--pga", "0.5g", "--reversed", "--json")
    rows = json.loads(out)["records"]
    assert code == 0 and len(rows) == 8
    assert {row["record"].removesuffix(" x -1") for row in rows} == {row["record"] for row in rows[:4]}
    pga = [row["pga_g"] for row in rows[:2]]
    first, second = (motion.scaled_to(0.5 * 9.80665, ROTATED).pga / 9.80665 for motion in PAIR)
    assert pga == pytest.approx([first, second], rel=1e-6)
    code, out, _ = run("ida", stations[0], *block, "--measure", "arias", "--levels", "0.5:8:6", "--component", "larger")
    assert code == 0 and "Arias intensity, larger component (m/s)" in out
    code, out, _ = run("check", stations[0], *block, "--component", "rotd50", "--vertical", "own", "--json")
    assert code == 0 and len(json.loads(out)["records"]) == 2
    code, _, err = run("ida", *block, "--pulse", "one-sine:amplitude=1,frequency=1", "--component", "rotd50")
    assert code == 2 and "--component rotd50 requires records" in err
