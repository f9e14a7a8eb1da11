"""A response in words, as data and in files: short lines, honest digits, units in every name."""

import json
import math
import re

import numpy as np
import pandas as pd
import pytest
import xarray as xr

import rocking
from rocking import Block, simulate
from rocking.analysis.survey import survey
from rocking.core.tables import add_unit
from rocking.errors import OptionError, OutputError
from rocking.explorer.simulated import describe_outcome
from rocking.response.summary import format_time, round_ratio
from rocking.rules import RuleComparison

TABLES = {
    "events": ["time_s", "kind", "side"],
    "impacts": ["time_s", "side", "speed_before_rad_s", "speed_after_rad_s"],
    "sequences": ["start_s", "end_s", "lower_s", "upper_s", "impacts"],
}


@pytest.fixture(scope="module")
def record():
    return rocking.records.load("el-centro-meloland-270")


@pytest.fixture(scope="module")
def shaken(record):
    return simulate(Block.from_parameters(p=2.0, alpha=0.2, restitution=0.9), record)


@pytest.fixture(scope="module")
def fallen(record):
    return simulate(Block.from_parameters(p=4.0, alpha=0.05, restitution=0.9), record)


def test_a_summary_is_its_rows(shaken):
    rows = shaken.summary_rows(0.5)
    assert shaken.summary(0.5) == "\n".join(f"{row.name:<20}{row.text}" for row in rows)
    (peak,) = [row for row in rows if row.name == "peak rotation"]
    assert peak.unit == "rad" and float(peak.value) == pytest.approx(
        shaken.peak_rotation, rel=5e-3
    )  # to its known digits
    facts = {row.name: row for row in shaken.result_rows(0.5)}
    assert facts["peak_rotation"] == ("peak_rotation", shaken.peak_rotation, "rad", "")
    assert [*shaken.to_dict(0.5)] == [add_unit(row.name, row.unit) for row in shaken.result_rows(0.5)]


@pytest.mark.parametrize(
    ("below", "above", "text"),
    [
        (0.0, 0.0, "230.726244377 s"),
        (0.9e-9, 0.0, "230.726244377 s"),
        (0.0, 0.02e-6, "230.7262444 s"),
        (3e-6, 1e-6, "230.72624 s"),
        (1e-5, 0.9e-3, "230.726 s"),
        (1.2e-3, 0.0, "230.725 to 230.726 s"),
        (0.4, 0.3, "230.3 to 231.0 s"),
        (1.0, 2.0, "230 to 233 s"),
    ],
)
def test_a_time_has_the_digits_that_repeated_simulations_leave(below, above, text):
    time = 230.7262443771
    assert format_time(time, time - below, time + above) == text


def test_a_motion_changed_by_a_millionth_keeps_the_digits_that_are_shown():
    block, record = Block(width=0.24, height=1.1), rocking.records.load("ridgecrest-clc-090")
    texts = [simulate(block, motion).summary() for motion in (record, record.scaled(1.0 + 1e-6))]
    shown, other = (re.findall(r"^(uplift|rest) +([\d.]+) s", text, re.MULTILINE) for text in texts)
    assert len(shown) == 12
    for (kind, time), (same, nudged_time) in zip(shown, other, strict=True):
        assert kind == same
        decimals = len(time.partition(".")[2])
        assert abs(float(time) - float(nudged_time)) <= 1.01 * 10.0**-decimals


def test_the_dictionary_is_plain_and_names_its_units(shaken, fallen):
    for response in (shaken, fallen, simulate(Block(half_width=0.2, half_height=1.0), None, initial_rotation=0.05)):
        result = response.to_dict()
        assert json.loads(json.dumps(result, allow_nan=False)) == result
        assert "_per_" not in json.dumps(result)
        assert result["block"]["p_rad_s"][0] == response.block.sides[0].p
        assert result["impacts_resolved"] == len(response.impacts)
        assert [event["time_s"] for event in result["events"]] == response.events["time"].tolist()
        assert [row["lower_s"] for row in result["sequences"]] == response.sequences["lower"].tolist()
    assert shaken.to_dict()["motion"]["pga_m_s2"] == shaken.motion.pga
    assert shaken.to_dict()["tipping_time_s"] is None
    assert fallen.to_dict()["tipping_time_s"] == fallen.tipping_time
    assert simulate(Block(half_width=0.2, half_height=1.0), None).to_dict()["motion"] is None
    for name in ("initial_rotation", "initial_velocity"):  # a share of nothing changes nothing
        assert not any(np.any(table[name]) for table in (shaken.sensitivity.peak, shaken.sensitivity.events))


def test_histories_are_a_data_frame_over_time(shaken):
    frame = shaken.to_dataframe(dt=0.02)
    assert frame.index.name == "time_s"
    assert list(frame.columns) == ["rotation_rad", "angular_velocity_rad_s", "ground_acceleration_m_s2"]
    assert np.array_equal(frame["rotation_rad"], shaken.rotation(frame.index.to_numpy()))
    assert np.diff(frame.index).max() == pytest.approx(0.02)
    assert len(shaken.to_dataframe()) == round(shaken.duration / shaken.motion.dt) + 1


@pytest.mark.parametrize("table", TABLES)
def test_every_table_is_a_data_frame_and_a_file_with_units(shaken, tmp_path, table):
    frame = shaken.to_dataframe(table)
    rows = getattr(shaken, table)
    assert list(frame.columns) == TABLES[table]
    for column, name in zip(frame.columns, rows.dtype.names, strict=True):
        assert list(frame[column]) == list(rows[name])
    shaken.to_csv(tmp_path / "table.csv", table)
    back = pd.read_csv(tmp_path / "table.csv")
    assert list(back.columns) == TABLES[table]
    assert np.allclose(back.select_dtypes("number"), frame.select_dtypes("number"), rtol=1e-14)


def test_tables_that_are_none_and_steps_that_mean_nothing_are_refused(shaken, tmp_path):
    with pytest.raises(OptionError, match="table must be one of histories, events, impacts, sequences, not 'nodes'"):
        shaken.to_dataframe("nodes")
    with pytest.raises(OptionError, match="dt is the step of the histories"):
        shaken.to_csv(tmp_path / "impacts.csv", "impacts", dt=0.01)
    for read in (shaken.to_dataframe, shaken.to_xarray):
        with pytest.raises(OptionError, match="dt"):
            read(dt=-1.0)
    with pytest.raises(OutputError, match="nowhere"):
        shaken.to_csv(tmp_path / "nowhere" / "r.csv", "impacts")


def test_every_variable_of_the_dataset_has_a_unit_in_the_file_too(shaken, tmp_path):
    shaken.to_netcdf(tmp_path / "r.nc", dt=0.02)
    with xr.open_dataset(tmp_path / "r.nc") as dataset:
        units = {name: variable.attrs.get("units") for name, variable in dataset.variables.items()}
        assert dataset.attrs["motion"] == shaken.motion.name and dataset.attrs["overturned"] == 0
        assert np.allclose(dataset.rotation, shaken.rotation(dataset.time.values), atol=1e-15)
        assert list(dataset.event_kind.values) == list(shaken.events["kind"])
        assert None not in units.values()
        assert units["impact_speed_after"] == "rad/s"
        assert units["sequence_lower"] == units["event_time"] == "s"
        assert units["ground_acceleration"] == "m/s^2"
        assert {"p_rad_s", "alpha_rad", "gravity_m_s2"} <= set(dataset.attrs)
        assert not [name for name in dataset.attrs if "_per_" in name]


def test_the_phase_plane_has_the_states_of_the_response_and_its_name(shaken):
    axes = shaken.plot_phase_plane().axes[0]
    rotation, velocity = max((line.get_data() for line in axes.lines), key=lambda data: len(data[0]))
    side = shaken.block.sides[0]
    assert np.nanmax(np.abs(rotation)) == pytest.approx(shaken.peak_rotation / side.alpha, rel=1e-3)
    rates = np.abs(shaken.states(np.linspace(0.0, shaken.duration, 20_000))[:, 1])
    assert np.nanmax(np.abs(velocity)) == pytest.approx(rates.max() / (side.p * side.alpha), rel=1e-2)
    titles = [
        f"{figure.get_suptitle()}{figure.axes[0].get_title()}"
        for figure in (shaken.plot_phase_plane(), shaken.plot_phase_plane(title="mine"))
    ]
    assert shaken.motion.name in titles[0] and titles[1] == "mine"
    struck = shaken.events[shaken.events["kind"] == "uplift"]["time"][0]
    labels = [
        shaken.plot_phase_plane(window=(start, struck + 1.0)).axes[0].get_legend_handles_labels()[1]
        for start in (struck, struck + 0.01)
    ]
    assert [any("uplift" in label for label in each) for each in labels] == [True, False]


def test_a_window_is_all_that_is_drawn(shaken):
    start, end = shaken.events["time"][0] + 0.5, shaken.events["time"][0] + 2.0
    figure = shaken.plot(window=(start, end))
    assert figure.axes[0].get_xlim() == (start, end)
    for line in figure.axes[0].lines + figure.axes[1].lines:
        times = np.asarray(line.get_xdata())
        if len(times) > 2:
            assert times.min() >= start and times.max() <= end
    struck = shaken.impacts["time"]
    count = int(np.sum((struck >= start) & (struck <= end)))
    assert 0 < count < len(struck)
    assert f"resolved impacts ({count})" in figure.axes[0].get_legend_handles_labels()[1]


@pytest.mark.parametrize(
    "window", [(3.0, 2.0), (-1.0, 2.0), (0.0, 1e9), 3.0, ("0", "1"), (0.0, 1.0, 2.0), (1.0, math.nan)]
)
def test_a_window_is_a_stretch_of_the_response(shaken, window):
    with pytest.raises(OptionError, match="window"):
        shaken.plot(window=window)


def test_unknown_units_and_times_that_are_no_numbers_are_refused(shaken):
    with pytest.raises(OptionError, match="units must be one of slenderness, rad, deg, not 'degrees'"):
        shaken.plot(rotation_units="degrees")
    for evaluate in (shaken.rotation, shaken.angular_velocity, shaken.normal_force, shaken.friction_demand):
        with pytest.raises(OptionError, match="time"):
            evaluate("1.0")


@pytest.mark.parametrize(
    ("below", "shown"),
    [
        (1e-4, r"\d+\.\d{2,3} to \d+\.\d{2,3} s, complete chattering proven"),
        (1e-5, r"\d+\.\d to \d+\.\d s, complete chattering proven"),
    ],
)
def test_a_time_of_rest_has_no_more_digits_than_the_motion_leaves(below, shown):
    """A bracket of 1e-13 s beside a time that a millionth of the motion moves by seconds would be misleading."""
    amplitude, block = 3.0, Block.from_parameters(p=2.0, alpha=0.2, restitution=0.9)
    critical = math.acosh(1.0 + 0.5 / (amplitude * (amplitude - 1.0))) / 2.0  # Housner (1963)
    pulse = rocking.pulses.rectangular(amplitude * 9.80665 * 0.2, critical * (1.0 - below))
    response = simulate(block, pulse, model="linear")
    assert not response.overturned
    (rest,) = re.findall(r"^rest +(.*)$", response.summary(), re.MULTILINE)
    assert re.fullmatch(shown, rest), rest
    by_threshold = simulate(block, pulse, model="linear", chattering="velocity").summary()
    assert ", by the scheme, not proven" in by_threshold


def test_the_time_of_a_peak_is_as_uncertain_as_its_swing():
    """A motion that is known to a millionth leaves so much of the peak; here by scaling it by a hundred times that."""
    motion = rocking.records.load("el-centro-meloland-270").scaled_to(4.0)
    block = Block(width=0.6, height=2.1)
    one, other = (simulate(block, motion.scaled(factor)) for factor in (1.0, 1.0 + 1e-4))
    (note,) = [row.note for row in one.summary_rows() if row.name == "peak rotation"]
    decimals = len(re.search(r" at \d+\.?(\d*)", note)[1])
    moved = 0.01 * abs(other.peak_time - one.peak_time)
    assert moved < 10.0**-decimals


def test_a_g_is_the_standard_one_whatever_gravity_the_block_has():
    block = rocking.Block(width=0.4, height=2.0, gravity=1.62)
    motion = rocking.pulses.one_sine(0.1 * 9.80665, 1.0)
    response = rocking.simulate(block, motion.with_vertical(0.5 * motion))
    summary = response.summary()
    assert re.search(r"^motion .*peak 0\.1000 g.*vertical .*peak 0\.0500 g", summary, re.MULTILINE)
    assert f"uplift above        {block.uplift_thresholds()[0] / 9.80665:.4f} g" in summary
    for axes, peak in zip(response.plot().axes[1:3], (0.1, 0.05), strict=True):
        highest = [np.max(np.abs(line.get_ydata())) for line in axes.lines]
        assert min(abs(each - peak) for each in highest) < 1e-3 * peak


def test_the_last_row_is_the_end_whatever_the_multiples_of_the_step_round_to():
    motion = rocking.records.load("el-centro-meloland-270").scaled(0.7)
    block, judged = Block(width=0.6, height=2.0), 0
    for duration in (35.3, 30.15, 1.1, 2.03):
        frame = simulate(block, motion, duration=duration).to_dataframe()
        assert frame.index[-1] <= duration and np.isfinite(frame.to_numpy()).all()
        judged += len(frame)
    assert judged > 1000


@pytest.mark.parametrize("pga", [0.47, 0.5, 0.53, 0.55, 0.6, 0.65])
def test_one_case_has_one_peak_in_every_output(pga):
    """Rounded to the digits that are known, or in a table with fewer digits to those of the column."""
    block, motion = Block(width=0.24, height=1.1), rocking.records.load("ridgecrest-clc-090").scaled_to(pga * 9.80665)
    response = rocking.simulate(block, motion)
    (line,) = (row for row in response.summary().splitlines() if row.startswith("peak rotation"))
    low, high = re.search(r"([0-9.]+)(?: to ([0-9.]+))? of the slenderness", line).groups()
    shown = survey(block, {"x": motion}).summary().splitlines()[-1].split()[2]
    assert f"peak {shown} of the slenderness" in repr(response)
    if high is None:
        assert low == shown
    else:  # fewer than three digits are known
        assert len(shown) <= 4 and float(low) - 0.05 <= float(shown) <= float(high) + 0.05
    assert round_ratio(response) == pytest.approx(float(shown), abs=5.1e-5)
    sentence, percent = describe_outcome(response), 100.0 * round_ratio(response)
    if response.perturbed().is_decided:
        assert f"it reaches {percent:.2g} % of" in sentence or f"it reaches {percent:.4g} % of" in sentence
    else:
        assert sentence.startswith("Undecided: overturns in ")
    checked = RuleComparison(block, ("x",), (response,), ({},), (0.5,)).summary()
    assert f"{float(shown):.3g}" in checked.splitlines()[4].split()
