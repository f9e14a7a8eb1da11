"""What analyses return: results that say what they are, and none from simulations that were given up."""

import copy
import inspect
import math
import pickle
from dataclasses import replace

import numpy as np
import pytest
from matplotlib.figure import Figure
from public_names import public_names

import rocking
from rocking import dynamics, errors
from rocking.calibration.outcomes import simulate_outcomes
from rocking.chattering import chattering_map, critical_amplitude_nonlinear, families
from rocking.core.progress import Progress
from rocking.core.result import DatasetResult

BLOCK = rocking.Block.from_parameters(p=2.0, alpha=0.2, restitution=0.9)
PULSE = rocking.pulses.one_sine(6.0, 1.0)
ONE_PERIOD = rocking.pulses.sine(3.0, 1.0, cycles=1)
RESTLESS = rocking.Block.from_parameters(p=2.0, alpha=0.2, restitution=1.0 - 1e-9)


#: Two blocks, of which the second is given up at a small budget where it does not overturn.
TWO = [BLOCK, RESTLESS]

#: How one outcome that is missing is reported.
ONE_MISSING = "1 simulation given up after too many steps: outcomes missing"


@pytest.mark.usefixtures("small_budget")
def test_a_fragility_leaves_out_what_was_given_up_and_reports_it():
    pulses = [PULSE, rocking.pulses.one_sine(6.0, 1.8)]
    found = rocking.fragility(TWO, pulses, levels=np.linspace(1.5, 6.0, 10))
    missing = found.outcomes.unfinished
    count = int(missing.sum())
    assert 0 < count < len(found.outcomes)
    assert found.outcomes.peak_over_alpha[missing].isna().all()
    assert found.curves[0].trial_counts.sum() == len(found.outcomes) - count
    assert found.curves[0].exceedance_counts.sum() == found.outcomes.overturned.sum()
    assert f"{count} simulations given up after too many steps: outcomes missing" in found.summary()
    known = found.outcomes[~missing]
    again = rocking.fit_fragility(known.pga_m_s2, known.overturned, clusters=known.motion)
    assert found.curves[0].median == pytest.approx(again.curves[0].median, rel=1e-12)


@pytest.mark.usefixtures("small_budget")
def test_scaling_has_no_peak_where_a_simulation_was_given_up():
    found = rocking.incremental_dynamic_analysis(TWO, PULSE, levels=[2.2, 9.0])
    np.testing.assert_array_equal(
        np.isnan(found.data.peak_over_alpha.transpose("motion", "block", "level").values),
        [[[False] * 2, [True, False]]],
    )
    assert f"note: {ONE_MISSING}" in found.summary()


@pytest.mark.usefixtures("small_budget")
@pytest.mark.parametrize("ensemble", [False, True])
def test_a_spectrum_leaves_out_what_was_given_up(ensemble):
    blocks = [BLOCK, RESTLESS] if ensemble else rocking.Blocks.grid(p=[2.0], alpha=[0.2], restitution=[0.9, 1.0 - 1e-9])
    found = rocking.rocking_spectrum(blocks, PULSE.scaled(0.4), **({"p": [2.0]} if ensemble else {}))
    assert f"note: {ONE_MISSING}" in found.summary()
    alone = rocking.rocking_spectrum(rocking.Blocks.grid(p=[2.0], alpha=[0.2], restitution=[0.9]), PULSE.scaled(0.4))
    fractiles = found.data.fractile_over_alpha.values.reshape(3, -1)
    np.testing.assert_array_equal(fractiles[:, 0], alone.data.fractile_over_alpha.values.ravel())
    shares = found.data.overturned_share.values.ravel()
    assert shares[0] == 0.0
    if not ensemble:
        assert np.isnan(fractiles[:, 1]).all()
        assert np.isnan(shares[1])


@pytest.mark.usefixtures("small_budget")
def test_a_map_has_a_mode_for_what_was_given_up():
    found = rocking.overturning_map(RESTLESS, "one-sine", amplitudes=[0.5, 1.2], frequencies=[3.0])
    assert found.data.mode.values[:, 0].tolist() == [-3, -5]
    assert "not finished" in found.summary()
    assert f"note: {ONE_MISSING}" in found.summary()
    found.plot()


@pytest.mark.thorough
@pytest.mark.usefixtures("small_budget")
def test_a_study_leaves_out_what_was_given_up(tmp_path):
    pulses = [PULSE, rocking.pulses.one_sine(6.0, 1.8)]
    levels = np.linspace(1.5, 6.0, 10)
    study = rocking.create_study(tmp_path / "study", TWO, pulses, levels=levels, measure="pga")
    study.run()
    direct = rocking.fragility(TWO, pulses, levels=levels)
    missing = int(direct.outcomes.unfinished.sum())
    text = f"{missing} simulations given up after too many steps: outcomes missing"
    together, each, spectrum = study.fragility(measure="pga"), study.block_fragilities(measure="pga"), study.spectrum()
    assert together.missing_note == direct.missing_note == text
    assert together.curves[0].median == pytest.approx(direct.curves[0].median, rel=1e-9)
    assert each.data.trial_count.values[0].tolist() == [20.0, 20.0 - missing]
    for found in (together, each, spectrum):
        assert text in found.summary()
    known = direct.outcomes[direct.outcomes.block == 1]
    shares = known[~known.unfinished].groupby("pga_m_s2").overturned.mean().reindex(levels).values
    np.testing.assert_array_equal(spectrum.data.overturned_share.values[:, 1], shares)


@pytest.mark.usefixtures("small_budget")
def test_a_calibration_takes_what_was_given_up_for_half_overturned():
    outcomes = simulate_outcomes(rocking.Blocks.from_bodies(TWO), [PULSE.scaled(0.4), PULSE.scaled(2.0)], "nonlinear")
    assert outcomes.tolist() == [[0.0, 1.0], [0.5, 1.0]]


@pytest.mark.usefixtures("small_budget")
def test_a_map_of_chattering_calls_what_was_given_up_unproven():
    found = chattering_map(families.sine(RESTLESS), {"a": [1.2], "omega": [3.0]})
    assert found.data.outcome.values.tolist() == [[5]]


@pytest.fixture(scope="module")
def bars():
    """Of every progress bar that ended what it is of, what was done, and of how much."""
    found = []
    with pytest.MonkeyPatch.context() as patched:
        ended = Progress.__exit__

        def noted(bar, kind, *error):
            if kind is None:
                found.append((bar.description, bar.done, bar.total))
            return ended(bar, kind, *error)

        patched.setattr(Progress, "__exit__", noted)
        yield found


@pytest.fixture(scope="module")
def spectrum(bars):
    blocks = rocking.Blocks.grid(alpha=[0.15, 0.2], p=[1.0, 2.0, 3.0], restitution=[0.9])
    return rocking.rocking_spectrum(blocks, [PULSE, PULSE.scaled(0.5)])


@pytest.fixture(scope="module")
def study(bars, tmp_path_factory):
    motions = [rocking.pulses.one_sine(6.0, frequency) for frequency in (0.5, 0.8, 1.2, 2.0)]
    levels = [2.0, 3.0, 4.0, 5.0, 6.0, 8.0]
    found = rocking.create_study(
        tmp_path_factory.mktemp("study") / "one", [BLOCK], motions, levels=levels, measure="pga"
    )
    found.run()
    return found


@pytest.fixture(scope="module")
def results(bars, spectrum, study):
    statue = rocking.Solid.from_mesh("statue")
    return {
        "RockingSpectrum": spectrum,
        "OverturningMap": rocking.overturning_map(BLOCK, "one-sine", amplitudes=[1.0, 4.0], frequencies=[2.0, 3.0]),
        "IncrementalDynamicAnalysis": rocking.incremental_dynamic_analysis(BLOCK, PULSE),
        "MeasureComparison": rocking.compare_measures(BLOCK, [PULSE, rocking.pulses.one_sine(6.0, 2.0)]),
        "ResistanceRose": statue.rose(),
        "ChatteringMap": chattering_map(families.sine(BLOCK), {"a": [1.01, 1.1], "omega": [2.0, 3.0]}),
        "BlockTable": study.block_fragilities(),
        "Basins": dynamics.basins(BLOCK, ONE_PERIOD, np.linspace(-0.2, 0.2, 5), np.linspace(-0.4, 0.4, 5)),
        "BifurcationDiagram": dynamics.bifurcation_diagram(
            lambda factor: (BLOCK, ONE_PERIOD.scaled(factor)),
            [0.5, 1.0],
            [0.01, 0.1],
            recorded_periods=4,
            direction="both",
        ),
    }


@pytest.fixture(scope="module")
def of_several():
    """Results that have other dimensions where they are of several blocks."""
    blocks = rocking.Blocks(p=[2.0, 3.0], alpha=[0.1, 0.2], restitution=0.9)
    return {"RockingSpectrum of several": rocking.rocking_spectrum(blocks, [PULSE], p=[1.0, 2.0])}


def test_every_public_result_with_a_dataset_is_among_those_that_are_judged(results):
    public = {value for value in public_names().values() if inspect.isclass(value) and issubclass(value, DatasetResult)}
    assert {each.__name__ for each in public} - {"DatasetResult"} == results.keys()


def test_every_bar_comes_to_its_end(results, bars):
    assert {"mapping", "simulating", "refining", "basins", "fitting"} <= {what for what, *_ in bars}
    assert len(bars) > 12
    assert [each for each in bars if not each[1] == each[2] > 0] == []


@pytest.mark.parametrize("written", [3, pytest.param(10, marks=pytest.mark.thorough)])
def test_a_result_keeps_its_dataset_and_offers_nothing_of_it_as_its_own(results, tmp_path, written):
    assert len(results) == 9
    for number, found in enumerate(results.values()):
        for again in (copy.copy(found), pickle.loads(pickle.dumps(found))):
            assert again.data.identical(found.data)
            assert again.data.sizes == found.data.sizes
            assert type(again) is type(found)
        for missing in (next(iter(found.data.data_vars)), "sizes", "no_such_variable"):
            with pytest.raises(AttributeError):
                getattr(found, missing)
        if number < written:
            found.to_netcdf(tmp_path / "result.nc")
    with pytest.raises(errors.OutputError, match="cannot be written"):
        found.to_netcdf(tmp_path / "none" / "result.nc")


def test_every_variable_of_a_result_has_units_or_a_meaning(results):
    judged = 0
    for name, found in results.items():
        for variable in found.data.data_vars.values():
            described = {"units", "long_name", "flag_meanings"} & set(variable.attrs)
            assert described or variable.dtype == bool, (name, variable)
            judged += 1
    assert judged >= 5 * len(results) > 20


def test_a_result_draws_itself_into_axes_of_the_caller(results):
    for found in results.values():
        figure = Figure()
        ax, other = figure.subplots(1, 2)
        assert found.plot(ax) is figure
        assert ax.has_data()
        assert not other.has_data()


@pytest.mark.parametrize("every", [4, pytest.param(1, marks=pytest.mark.thorough)])
def test_whatever_draws_itself_does_so_at_the_size_that_is_wanted(results, every):
    fragility = rocking.fit_fragility([1.0, 2.0, 3.0, 4.0], [0, 1, 2, 4], trial_counts=4)
    for found in [fragility, rocking.simulate(BLOCK, PULSE), PULSE, *[*results.values()][::every]]:
        assert found.plot(figsize=(3.4, 2.7)).get_size_inches().tolist() == [3.4, 2.7]


PULSES = "pulse_amplitude_m_s2,pulse_frequency_Hz,pulse_cycles,pulse_phase_rad"
HEADERS = {
    ("Basins", "attractors"): "attractor,share,standard_error,period,impact_count,has_rest,multiplier",
    ("Basins", "outcomes"): "angular_velocity_rad_s,rotation_rad,outcome,periods",
    ("Basins", "orbits"): "attractor,phase,orbit_coordinate_rad,orbit_velocity_rad_s",
    ("BifurcationDiagram", "states"): "direction,value,start,iterate,coordinate_rad,velocity_rad_s",
    ("BifurcationDiagram", "orbits"): "direction,value,start,period,impact_count",
    (
        "ResistanceRose",
        "rose",
    ): "azimuth_deg,acceleration_g,alpha_rad,p_rad_s,restitution,radius_m,rise_m,coupling,lateral_offset_m,gap_m",
    ("ResistanceRose", "support"): "east_m,north_m",
    ("RockingSpectrum", "fractiles"): "fractile,alpha_rad,restitution,p_rad_s,period_s,size_m,"
    "fractile_over_alpha,overturned_share",
    ("RockingSpectrum", "peaks"): f"motion,alpha_rad,restitution,p_rad_s,{PULSES},period_s,size_m,"
    "peak_rotation_rad,peak_over_alpha,overturned",
    ("OverturningMap", "modes"): "amplitude,frequency,mode,peak_rotation_rad",
    ("OverturningMap", "boundaries"): "boundary_frequency,boundary_amplitude,mode_below,mode_above",
    ("IncrementalDynamicAnalysis", "levels"): f"motion,level_m_s2,block,{PULSES},p_rad_s,alpha_rad,restitution,"
    "peak_rotation_rad,peak_over_alpha,overturned",
    ("IncrementalDynamicAnalysis", "bands"): "motion,block,band_start_m_s2,band_end_m_s2",
    ("MeasureComparison", "measures"): "measure,unit,median_intensity,dispersion,dispersion_low,dispersion_high,"
    "dispersion_of_all",
    ("MeasureComparison", "intensities"): f"measure,motion,block,unit,{PULSES},intensity",
    ("BlockTable", "blocks"): "limit_state,block,p_rad_s,alpha_rad,restitution,"
    "median_m_s2,median_lower_m_s2,median_upper_m_s2,dispersion,dispersion_lower,dispersion_upper,exceedance_count,trial_count,"
    "fault",
    ("ChatteringMap", "outcomes"): "a,omega,outcome,complete,uplift_s,rest_s,lower_s,upper_s,rests,overturned",
}


def test_every_result_is_written_as_tables_whose_columns_have_units(results, tmp_path):
    written = {}
    for name, found in results.items():
        for table in found.TABLES:
            found.to_csv(tmp_path / "table.csv", table)
            written[name, table] = (tmp_path / "table.csv").read_text().splitlines()
            rows = found.data[[*(found.TABLES[table] or found.data)]].to_dataframe()
            assert len(found.to_dataframe(table)) == len(rows) == len(written[name, table]) - 1
        assert found.to_dataframe().equals(found.to_dataframe(next(iter(found.TABLES))))
        with pytest.raises(errors.OptionError, match="table must be one of"):
            found.to_dataframe("histories")
    assert {key: lines[0] for key, lines in written.items()} == HEADERS


def test_the_rows_of_a_table_are_the_values_of_the_result(results):
    spectrum, scaled = results["RockingSpectrum"], results["IncrementalDynamicAnalysis"]
    for row in spectrum.to_dataframe("peaks").itertuples():
        at = {"motion": row.motion, "alpha": row.alpha_rad, "restitution": row.restitution, "p": row.p_rad_s}
        assert float(spectrum.data.peak_over_alpha.sel(at)) == row.peak_over_alpha
        assert math.isinf(row.peak_over_alpha) == row.overturned
    bands = scaled.to_dataframe("bands")
    assert bands.motion.tolist() == ["one-sine"] * len(scaled.bands())
    ends = list(zip(bands.band_start_m_s2, bands.band_end_m_s2, strict=True))
    assert str(ends) == str(scaled.bands())


def test_a_part_of_a_result_is_a_result(spectrum):
    part = spectrum.select(alpha=0.2, p=[1.0, 3.0])
    assert dict(part.data.sizes) == {"motion": 2, "alpha": 1, "restitution": 1, "p": 2, "fractile": 3}
    assert len(part.plot().axes[0].lines) > 0
    with pytest.raises(errors.OptionError, match="dimensions are"):
        spectrum.select(height=1.0)


def test_levels_go_on_to_three_times_the_first_that_overturns_and_no_further():
    blocks = [BLOCK, rocking.Block.from_parameters(p=3.0, alpha=0.15, restitution=0.9)]
    found = rocking.incremental_dynamic_analysis(blocks, PULSE)
    first = found.data.overturned.isel(motion=0).transpose("block", "level").values.argmax(axis=1)
    last = 3.0 * float(found.data.level[first.max()])
    assert float(found.data.level[-2]) < last <= float(found.data.level[-1])


def test_a_fragility_keeps_every_simulation_for_an_audit(tmp_path):
    levels = [1.0, 2.0, 3.0, 4.0, 6.0]
    motions = [rocking.pulses.one_sine(1.0, f) for f in (0.5, 0.8, 1.2, 2.0)]
    found = rocking.fragility(BLOCK, motions, levels=levels)
    names = list(found.outcomes.motion.unique())
    assert len(names) == len(motions)
    assert len(found.outcomes) == len(levels) * len(motions)
    for _, row in found.outcomes.iterrows():
        motion = motions[names.index(row.motion)]
        response = rocking.simulate(BLOCK, motion.scaled_to(row.pga_m_s2))
        assert response.overturned == row.overturned == row.exceeded_overturning
        assert response.peak_rotation == pytest.approx(row.peak_rotation_rad, abs=1e-9)
        assert math.isinf(row.peak_over_alpha) == row.overturned
    found.to_csv(tmp_path / "outcomes.csv", "outcomes")
    header = (tmp_path / "outcomes.csv").read_text().splitlines()[0]
    assert header.startswith("motion,block,polarity,pga_m_s2,peak_rotation_rad,peak_over_alpha,overturned")
    given = rocking.fit_fragility([1.0, 2.0, 3.0, 4.0], [0, 1, 2, 4], trial_counts=4)
    with pytest.raises(errors.OptionError, match="no simulations"):
        given.to_csv(tmp_path / "none.csv", "outcomes")


def test_the_nonlinear_critical_amplitude_is_not_read_off_an_unfinished_simulation(request):
    whole = critical_amplitude_nonlinear(2.0, 0.9, 0.2)
    request.getfixturevalue("small_budget")
    found = critical_amplitude_nonlinear(2.0, [0.9, 0.99999], 0.2)
    assert found[0] == whole
    assert np.isnan(found[1])


#: Dimensions that not all variables have, though none is of all values together: what holds along with each label.
NOT_POOLED = {
    "RockingSpectrum": {"fractile"},
    "RockingSpectrum of several": {"fractile"},
    "OverturningMap": {"amplitude", "frequency"},
    "ResistanceRose": {"azimuth", "corner"},
    "BifurcationDiagram": {"direction", "value", "iterate"},
}


def test_a_dimension_that_some_numbers_lack_is_said_to_be_pooled_or_is_known_not_to_be(results, of_several):
    for name, found in (results | of_several).items():
        lacked = {d for d in found.data.dims if not all(d in each.dims for each in found.data.data_vars.values())}
        assert lacked - {*found.AGGREGATED_DIMENSIONS} == NOT_POOLED.get(name, set()), name


def test_a_part_has_no_numbers_of_the_whole(results, of_several):
    results = results | of_several
    for name, dimension in (
        ("RockingSpectrum", "motion"), ("IncrementalDynamicAnalysis", "motion"), ("MeasureComparison", "motion"),
        ("RockingSpectrum of several", "block"), ("MeasureComparison", "block"),
        ("IncrementalDynamicAnalysis", "level"),
        ("Basins", "attractor"), ("Basins", "rotation"),
        ("Basins", "angular_velocity"),
    ):  # fmt: skip
        assert dimension in results[name].data.sizes, name
        with pytest.raises(errors.OptionError, match=f"aggregated over {dimension}; repeat the analysis for a part"):
            results[name].select(**{dimension: results[name].data[dimension].values[0]})


def test_names_are_no_html():
    motion = replace(PULSE, name="A&B <b>PGA<0.3</b>")
    blocks = rocking.Blocks.grid(p=[1.0, 2.0], alpha=[0.2], restitution=[0.9])
    found = rocking.rocking_spectrum(blocks, motion)
    assert "<b>PGA" in repr(found) and "<b>PGA" not in found._repr_html_()
