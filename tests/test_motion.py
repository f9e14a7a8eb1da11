"""Laws of the piecewise polynomial ground motion."""

import pickle
import subprocess
import sys
from dataclasses import replace
from fractions import Fraction

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.polynomial import Polynomial
from numpy.testing import assert_allclose, assert_array_equal

from rocking import pulses, records
from rocking.errors import MotionError, OptionError
from rocking.motion.motion import Description, Motion
from rocking.motion.scaling import Measure

values = st.floats(-10.0, 10.0).map(lambda x: round(x, 3))


@st.composite
def motions(draw, most_columns=4):
    """Motions of a few pieces and a low degree, with jumps."""
    pieces, columns = draw(st.integers(1, 5)), draw(st.integers(1, most_columns))
    widths = draw(st.lists(st.floats(0.05, 2.0), min_size=pieces, max_size=pieces))
    row = st.lists(values, min_size=columns, max_size=columns)
    coefficients = draw(st.lists(row, min_size=pieces, max_size=pieces))
    return Motion(np.concatenate([[0.0], np.cumsum(widths)]), coefficients)


def dense_times(motion, per_piece=400):
    """Times all over the motion, the breakpoints among them."""
    fractions = np.linspace(0.0, 1.0, per_piece + 1)
    starts, widths = motion.breakpoints[:-1], np.diff(motion.breakpoints)
    return np.unique(np.append((starts[:, None] + widths[:, None] * fractions).ravel(), motion.duration))


def exact_integrals(motion, t):
    """Velocity and displacement at time t in rational arithmetic."""
    velocity = displacement = Fraction(0)
    breakpoints = [Fraction(b) for b in motion.breakpoints.tolist()]
    for start, end, row in zip(breakpoints, breakpoints[1:], motion.coefficients.tolist(), strict=False):
        x = min(end, Fraction(t)) - start
        if x <= 0:
            break
        rise = sum(Fraction(c) * x ** (j + 1) / (j + 1) for j, c in enumerate(row))
        fall = sum(Fraction(c) * x ** (j + 2) / ((j + 1) * (j + 2)) for j, c in enumerate(row))
        velocity, displacement = velocity + rise, displacement + velocity * x + fall
    return float(velocity), float(displacement + velocity * max(Fraction(t) - breakpoints[-1], Fraction(0)))


@settings(deadline=None)
@given(st.lists(values, min_size=2, max_size=30), st.floats(0.001, 0.5))
def test_samples_are_joined_by_straight_lines(samples, dt):
    motion = Motion.from_samples(samples, dt)
    times = np.linspace(0.0, motion.duration, 101)
    expected = np.interp(times, dt * np.arange(len(samples)), samples)
    assert_allclose(motion.acceleration(times), expected, rtol=0, atol=1e-13 * (1 + np.abs(samples).max()))
    assert motion.dt == dt
    assert motion.error == 0.0


@settings(deadline=None)
@given(motions(), st.floats(0.0, 1.5))
def test_velocity_and_displacement_are_the_exact_integrals(motion, fraction):
    t = fraction * motion.duration
    velocity, displacement = exact_integrals(motion, t)
    scale = np.abs(motion.coefficients).max() * (1.0 + motion.duration) ** 5
    assert abs(motion.velocity(t) - velocity) <= 1e-15 * scale
    assert abs(motion.displacement(t) - displacement) <= 1e-15 * scale


@settings(deadline=None)
@given(motions(most_columns=7))
def test_peaks_are_the_extrema_of_the_pieces_not_of_samples(motion):
    velocity = displacement = 0.0
    sampled, missed = np.zeros(3), np.zeros(3)
    for width, row in zip(np.diff(motion.breakpoints), motion.coefficients, strict=True):
        acceleration = Polynomial(row)
        rise = acceleration.integ(k=velocity)
        way = rise.integ(k=displacement)
        x = np.linspace(0.0, width, 401)
        for i, curve in enumerate((acceleration, rise, way)):
            sampled[i] = max(sampled[i], np.abs(curve(x)).max())
            # Between two samples a curve stands out by its curvature times the squared gap over eight, at most.
            missed[i] = max(missed[i], Polynomial(np.abs(curve.coef)).deriv(2)(width) * (width / 400) ** 2 / 8)
        velocity, displacement = rise(width), way(width)
    peaks = np.array([motion.pga, motion.pgv, motion.pgd])
    rounding = 1e-14 * sampled + 1e-14 * np.abs(motion.coefficients).max()
    assert (peaks >= sampled - rounding).all()
    assert (peaks <= sampled + missed + rounding).all()


def test_peak_between_breakpoints_is_found_exactly():
    motion = Motion([0.0, 3.0], [[0.0, 4.0, -2.0]])  # peak 2 at t = 1, but -6 at the end
    assert motion.pga == 6.0
    assert Motion([0.0, 2.0], [[0.0, 4.0, -2.0]]).pga == 2.0
    triangle = Motion.from_samples([1.0, -1.0], 2.0)  # velocity t - t^2/2
    assert triangle.pgv == 0.5
    assert triangle.pgd == pytest.approx(2.0 / 3.0, rel=1e-15)


def test_a_motion_is_zero_outside_and_takes_the_later_value_at_a_jump():
    motion = Motion([0.0, 1.0, 2.0], [[1.0], [5.0]])
    assert_array_equal(motion.acceleration([-1e-9, 0.0, 1.0, 2.0, 2.0 + 1e-9]), [0.0, 1.0, 5.0, 5.0, 0.0])
    assert_array_equal(motion.velocity([-1.0, 0.0, 2.0, 9.0]), [0.0, 0.0, 6.0, 6.0])
    assert motion.displacement(3.0) == 0.5 + 1.0 + 2.5 + 6.0
    assert np.isnan(motion.acceleration(np.nan))


def test_evaluation_keeps_the_shape_of_the_times():
    motion = Motion.from_samples([0.0, 1.0], 1.0)
    for function in (motion.acceleration, motion.velocity, motion.displacement):
        assert isinstance(function(0.5), float)
        assert function([0.1, 0.2]).shape == (2,)
        assert function(np.zeros((2, 3, 1))).shape == (2, 3, 1)
        assert function(np.zeros(0)).shape == (0,)


def test_samples_come_back():
    samples = np.array([0.1, -0.7, 0.3, 0.2])
    motion = Motion.from_samples(samples, 0.01)
    times, back = motion.times, motion.samples
    assert_array_equal(times, 0.01 * np.arange(4))
    assert_array_equal(back[:-1], samples[:-1])
    assert_allclose(back[-1], samples[-1], rtol=1e-14)


def test_points_may_be_uneven_and_time_counts_from_the_first():
    motion = Motion.from_points([2.0, 2.5, 4.0], [1.0, 3.0, 0.0])
    assert_array_equal(motion.breakpoints, [0.0, 0.5, 2.0])
    assert motion.dt is None
    assert_array_equal(motion.acceleration([0.0, 0.25, 0.5, 1.25]), [1.0, 2.0, 3.0, 1.5])


def test_arrays_are_own_and_read_only():
    coefficients = np.ones((2, 1))
    motion = Motion(np.arange(3.0), coefficients)
    coefficients[0, 0] = 7.0
    assert motion.pga == 1.0
    for array in (motion.breakpoints, motion.coefficients):
        assert array.dtype == np.float64
        assert array.flags.c_contiguous
        with pytest.raises(ValueError, match="read-only"):
            array[0] = 1.0
    with pytest.raises(TypeError):
        motion.description.parameters["amplitude"] = 1.0


def test_a_motion_travels_between_processes():
    motion = pulses.sine(1.0, 2.0, cycles=1).scaled(2.0)
    copy = pickle.loads(pickle.dumps(motion))
    assert_array_equal(copy.coefficients, motion.coefficients)
    assert not copy.coefficients.flags.writeable
    assert (copy.name, copy.history, copy.error, copy.dt) == ("sine", motion.history, motion.error, None)
    assert copy.description == motion.description
    assert copy != motion  # identity: two motions are never compared by value


@settings(deadline=None)
@given(motions(), st.floats(-5.0, 5.0))
def test_scaling_is_linear(motion, factor):
    times = dense_times(motion, 20)
    assert_allclose(
        motion.scaled(factor).acceleration(times), factor * motion.acceleration(times), rtol=1e-12, atol=1e-12
    )


@pytest.mark.parametrize(
    ("target", "said"),
    [
        ("pga", "to a peak ground acceleration of 1.7 m/s^2 (0.1734 g)"),
        ("pgv", "to a peak ground velocity of 1.7 m/s"),
    ],
)
def test_scaling_to_a_target_reaches_it_and_says_its_unit(target, said):
    motion = Motion.from_samples([0.0, 1.0, -3.0, 2.0], 0.3).scaled_to(1.7, target)
    assert getattr(motion, target) == pytest.approx(1.7, rel=1e-15)
    assert motion.history[-1].endswith(said)


def test_scaling_to_a_spectral_acceleration_reaches_it():
    motion = Motion.from_samples([0.0, 1.0, -3.0, 2.0], 0.3).scaled_to(2.0, Measure("sa", period=0.7, damping=0.02))
    assert motion.spectral_acceleration(0.7, 0.02) == pytest.approx(2.0, rel=1e-14)
    factor, said = f"{motion.coefficients[1, 0]:.6g}", "a spectral acceleration of 2 m/s^2 (0.2039 g) at 0.7 s"
    assert motion.history == (f"scaled by {factor} to {said}, damping 0.02",)


def test_scaling_and_polarity_keep_the_description_true():
    motion = -pulses.sine(2.0, 1.5, cycles=2, phase=0.1).scaled_to(3.0)
    assert motion.description.family == "sine"
    assert motion.description.parameters == {"amplitude": -3.0, "frequency": 1.5, "cycles": 2.0, "phase": 0.1}
    assert motion.error == pytest.approx(3e-15)
    assert len(motion.history) == 2
    assert motion.history[1] == "polarity reversed"


@pytest.mark.parametrize(
    ("call", "argument"),
    [
        *((lambda each=each: LINE.scaled_to(1.0, each), "measure") for each in ("sa", "pga_ratio", None)),
        (lambda: Measure("factor", period=1.0), "period"),
        (lambda: Measure("sa", period=1.0, damping=7.0), "damping"),
        (lambda: Measure("pga", damping=0.1), "damping"),
        (lambda: Measure("strength"), "measure"),
    ],
)
def test_unusable_measures_are_refused_by_the_name_of_the_argument(call, argument):
    with pytest.raises(OptionError) as caught:
        call()
    assert caught.value.argument == argument


@settings(deadline=None)
@given(motions(), motions())
def test_a_sum_adds_accelerations(one, other):
    total = one + other
    times = np.sort(np.random.default_rng(0).uniform(0.0, total.duration, 50))
    scale = sum(np.abs(m.coefficients).max() * max(1.0, m.duration) ** 3 for m in (one, other))
    expected = one.acceleration(times) + other.acceleration(times)
    assert_allclose(total.acceleration(times), expected, rtol=0, atol=1e-14 * scale)
    assert total.duration == max(one.duration, other.duration)


def test_a_sum_of_records_on_one_grid_stays_sampled_and_others_do_not():
    record = Motion.from_samples([1.0, 2.0, 3.0], 0.5, name="a")
    assert (record + record).dt == 0.5
    # The shorter one ends in a jump, on the grid.
    assert (record + Motion.from_samples([1.0, 1.0], 0.5)).dt == 0.5
    total = record + pulses.half_sine(1.0, 1.0)
    assert total.name == "a + half sine"
    assert total.description.family == "sum"
    assert "amplitude 1, frequency 1" in total.description.text
    assert total.error == 1e-15


def test_the_step_follows_from_the_pieces():
    even = np.arange(6) * 0.1
    lines = np.arange(10.0).reshape(5, 2)
    assert Motion(even, lines).dt == 0.1
    assert Motion(even, np.hstack([lines, np.zeros((5, 3))])).dt == 0.1
    assert Motion.from_points([0.0, 0.1, 0.2, 0.3], [0.0, 1.0, -1.0, 0.0]).dt == 0.1
    assert Motion(even, np.hstack([lines, lines])).dt is None
    assert Motion(even, lines[:, :1]).dt is None
    assert Motion(np.append(even[:-1], 0.51), lines).dt is None
    with pytest.raises(TypeError):
        Motion(even, lines, dt=0.1)


def test_a_record_that_is_no_longer_linear_between_even_samples_has_no_step():
    record = Motion.from_samples(np.zeros(25), 0.125)
    assert record.dt == 0.125
    # The pulse has its breakpoints on the record's grid.
    assert (record + pulses.sine(4.0, 1.0, cycles=3)).dt is None
    assert record.delayed(0.1).dt is None
    assert record.delayed(0.125).dt == 0.125
    assert pickle.loads(pickle.dumps(record.scaled(2.0))).dt == 0.125


def test_pieces_jump_where_their_ends_do_not_meet():
    record = Motion.from_samples([1.0, 2.0, -3.0, 0.5], 0.01).scaled(1.0 / 3.0)
    assert not record.has_jumps
    assert not pulses.sine(1.0, 1.0, cycles=3).has_jumps
    assert (record + Motion.from_samples([1.0, 1.0], 0.01)).has_jumps
    assert Motion([0.0, 1.0, 2.0], [[1.0], [5.0]]).has_jumps


@settings(deadline=None)
@given(motions(), st.floats(0.01, 5.0))
def test_a_delay_shifts_the_motion_in_time(motion, delay):
    later = motion.delayed(delay)
    times = 0.5 * (motion.breakpoints[1:] + motion.breakpoints[:-1])
    scale = np.abs(motion.coefficients).max() * max(1.0, motion.duration) ** 3
    assert_allclose(later.acceleration(times + delay), motion.acceleration(times), rtol=0, atol=1e-13 * scale)
    assert later.acceleration(0.5 * delay) == 0.0
    assert_allclose([later.pga, later.pgv, later.pgd], [motion.pga, motion.pgv, motion.pgd], rtol=1e-10, atol=1e-10)


def test_a_delay_and_processing_show_in_the_family():
    motion = pulses.sine(1.0, 1.0, cycles=1).delayed(0.5).delayed(0.5)
    assert motion.description.family == "delayed sine"
    assert motion.history == ("delayed by 0.5 s", "delayed by 0.5 s")


def test_pieces_of_too_high_a_degree_are_refused_and_the_message_says_to_split_them():
    assert Motion([0.0, 1.0], np.ones((1, 21))).pga == 21.0
    with pytest.raises(MotionError, match="degree 20 or less, not 21: split"):
        Motion([0.0, 1.0], np.ones((1, 22)))


def test_pieces_may_be_short_but_not_steep_beyond_all_sense():
    assert Motion([0.0, 1e-16, 1.0], [[1.0, 0.0], [2.0, 0.0]]).pga == 2.0
    with pytest.raises(MotionError, match="too steep"):
        Motion.from_points([0.0, 1e-300, 1.0], [0.0, 1.0, 0.0])
    with pytest.raises(MotionError, match="must last"):
        Motion([0.0, 1e-300], [[1.0]])


def test_descriptions_compare_by_value():
    assert Description("sine", {"amplitude": 1.0}) == Description("sine", {"amplitude": 1.0})
    assert Description("sine", {"amplitude": 1.0}).scaled(-2.0).parameters == {"amplitude": -2.0}


def test_adding_something_else_is_a_type_error():
    with pytest.raises(TypeError):
        Motion.from_samples([0.0, 1.0], 1.0) + 1.0


@pytest.mark.parametrize(
    "statement",
    ["from rocking.pulses import ricker", "import rocking.records", "from rocking.records import load, read",
     "from rocking.rules import apply_rules", "import rocking; rocking.pulses.ricker, rocking.rules.apply_rules"],
)  # fmt: skip
def test_public_modules_can_be_imported(statement):
    subprocess.run([sys.executable, "-c", statement], check=True)


def test_motions_import_without_slow_libraries():
    code = (
        "import sys; import rocking.motion.motion, rocking.pulses; from rocking.records import load;"
        "load('el-centro-meloland-270').scaled_to(1.0).pgv;"
        "print(sorted({'scipy', 'numba', 'xarray', 'matplotlib'} & set(sys.modules)))"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "[]"


# Two components


@pytest.fixture(scope="module")
def two_components():
    return records.load("el-centro-meloland-270"), records.load("el-centro-meloland-360")


@pytest.mark.parametrize("azimuth", [0.0, 33.0, 90.0, 200.0, 360.0, -45.0])
def test_the_component_along_an_azimuth_is_the_projection_of_the_vector(two_components, azimuth):
    west, north = two_components
    times = np.linspace(0.0, 20.0, 777)
    east, up = -west.acceleration(times), north.acceleration(times)
    wanted = east * np.sin(np.radians(azimuth)) + up * np.cos(np.radians(azimuth))
    for motion in (west.rotated(north, azimuth), north.rotated(west, azimuth)):
        np.testing.assert_allclose(motion.acceleration(times), wanted, rtol=0.0, atol=1e-14)
        assert motion.description.origin.azimuth == azimuth


def test_along_their_own_azimuths_components_are_themselves_to_the_bit(two_components):
    west, north = two_components
    for azimuth, own in ((270.0, west), (0.0, north), (90.0, -west), (180.0, -north)):
        found = west.rotated(north, azimuth)
        times = own.breakpoints[:-1]  # the one lasts longer than the other
        assert np.array_equal(found.acceleration(times), own.acceleration(times))


def test_components_that_are_not_perpendicular_are_components_of_one_vector():
    vector = {0.0: 3.0, 90.0: 4.0}  # towards north and towards east
    one, other = (
        Motion([0.0, 1.0], [[vector[0.0] * np.cos(np.radians(at)) + vector[90.0] * np.sin(np.radians(at))]])
        for at in (10.0, 70.0)
    )
    for azimuth, value in vector.items():
        found = one.rotated(other, azimuth, recorded=(10.0, 70.0))
        assert found.acceleration(0.5) == pytest.approx(value, rel=1e-14)


def test_a_rotated_motion_has_the_pieces_of_both_and_one_vertical_component():
    up = Motion([0.0, 1.0], [[2.0]], name="up")
    one, other = Motion([0.0, 1.0], [[1.0]], name="one"), Motion([0.0, 0.5, 3.0], [[1.0], [-1.0]], name="other")
    found = one.with_vertical(up).rotated(other.with_vertical(up), 45.0, recorded=(0.0, 90.0))
    assert found.breakpoints.tolist() == [0.0, 0.5, 1.0, 3.0]
    assert found.vertical is up
    assert found.label == "one with vertical up, with other rotated to 45 deg"
    with pytest.raises(MotionError, match="different vertical components"):
        one.with_vertical(up).rotated(other.with_vertical(-up), 45.0, recorded=(0.0, 90.0))


def test_components_that_begin_at_different_times_are_refused_until_they_are_cut(two_components):
    def beginning(motion, start):
        origin = replace(motion.description.origin, start=start)
        return replace(motion, description=replace(motion.description, origin=origin))

    west, north = two_components
    one, other = beginning(west, 100.0), beginning(north, 100.5)
    for first, second in ((one, other), (other, one)):
        with pytest.raises(MotionError, match=r"360' begins 0.5 s after '\S+270'; remove .* processed\(trim=\(0.5, "):
            first.rotated(second, 30.0)
    found = one.processed(trim=(0.5, one.duration)).rotated(other, 30.0)
    wanted = west.delayed(1e-3).rotated(north.delayed(0.501), 30.0)
    times = np.linspace(0.0, 20.0, 333)
    np.testing.assert_allclose(found.acceleration(times), wanted.acceleration(times + 0.501), rtol=0.0, atol=1e-12)
    assert beginning(west, 100.0).rotated(beginning(north, 100.001), 30.0).pga == west.rotated(north, 30.0).pga


def test_a_reversed_record_points_the_other_way():
    west, north = (records.load(f"el-centro-meloland-{azimuth}") for azimuth in (270, 360))
    east = -west
    assert (east.description.origin.azimuth, (2.0 * east).description.origin.azimuth) == (90.0, 90.0)
    assert west.description.origin.azimuth == 270.0 and (-east).description.origin.azimuth == 270.0
    turned = east.rotated(north, 90.0)
    times = np.linspace(0.0, 20.0, 501)
    assert turned.acceleration(times) == pytest.approx(east.acceleration(times), abs=1e-12)
    assert not turned.description.origin.is_reversed


LINE = Motion([0.0, 1.0], [[1.0]], name="line")


@pytest.mark.parametrize(
    ("call", "sentence"),
    [
        (lambda: LINE.scaled(np.nan), "factor must be a finite number"),
        (lambda: LINE.scaled_to(0.0), "level must be a positive number"),
        (lambda: LINE.scaled_to(-1.0, Measure("sa", 1.0)), "level must be a positive number"),
        (lambda: Motion([0.0, 1.0], [[0.0]]).scaled_to(1.0), "zero throughout"),
        (lambda: LINE.delayed(0.0), "delay must be a positive number"),
        (lambda: Motion.from_samples([1.0], 0.1), "at least two samples; got 1"),
        (lambda: Motion.from_samples([0.0, 1.0, np.nan], 0.1), "got nan at sample 2"),
        (lambda: Motion.from_samples([[0.0, 1.0]], 0.1), "1 dimension"),
        (lambda: Motion.from_samples(["0.0", "1.0"], 0.1), "an array of numbers"),
        (lambda: Motion.from_samples([0.0, 1.0], 0.0), "dt must be a positive number"),
        (lambda: Motion.from_samples([0.0, 1.0], [0.1, 0.2]), "from_points"),
        (lambda: Motion.from_samples([0.0, 1.0], 1e10), "dt must be a number from 1e-09 to 1e\\+09"),
        (lambda: Motion.from_samples([1e308, -1e308], 0.1), "must be finite numbers"),
        (lambda: Motion.from_samples([1e60, 0.0], 0.1), "must stay below 1e\\+30"),
        (lambda: Motion.from_points([0.0, 1.0, 1.0], [0.0] * 3), "increase strictly"),
        (lambda: Motion.from_points([0.0, np.nan], [0.0] * 2), "increase strictly"),
        (lambda: Motion.from_points([0.0, 1.0], [0.0] * 3), "each of the 3 accelerations; got 2"),
        (lambda: Motion([0.0], np.zeros((0, 1))), "n \\+ 1 breakpoints"),
        (lambda: Motion([0.0, 1.0], np.zeros((1, 0))), "n \\+ 1 breakpoints"),
        (lambda: Motion([0.0, 1.0], np.zeros((2, 1))), "n \\+ 1 breakpoints"),
        (lambda: Motion([0.5, 1.0], np.zeros((1, 1))), "start at 0"),
        (lambda: Motion([0.0, 2.0, 1.0], np.zeros((2, 1))), "increase strictly"),
        (lambda: Motion([0.0, np.inf], np.zeros((1, 1))), "breakpoints of a motion must be finite"),
        (lambda: Motion([0.0, 1.0], [[np.nan]]), "coefficients of a motion must be finite"),
        (lambda: Motion([0.0, 1.0], [1.0]), "from_samples"),
        (lambda: Motion([0.0, 1.0], [[1.0]], error=-1.0), "approximation error"),
        (lambda: Motion([0.0, 1.0], [[1.0]], name=3), "name of a motion must be text"),
        (lambda: Motion([0.0, 1.0], [[1.0]], history="scaled"), "sequence of sentences"),
        (lambda: Motion([0.0, 1.0], [[1.0]], description="a record"), "Description"),
        (lambda: Description(3), "family of a description must be text"),
        (lambda: Description("sine", {"amplitude": "large"}), "amplitude of a description must be a number"),
        (lambda: LINE.acceleration("0.5"), "time must be a number"),
        (lambda: LINE.measures(["0.5"]), "periods of a spectral acceleration must be a number"),
        (lambda: LINE.rotated(LINE, 30.0), "the azimuth of 'line' is unknown; give recorded"),
        (lambda: LINE.rotated(LINE, 30.0, recorded=(0.0, 171.0)), "along one line within 9 deg"),
        (lambda: LINE.rotated(LINE, 30.0, recorded=(0.0,)), "recorded must be the azimuths of both"),
        (lambda: LINE.rotated(3.0, 30.0), "other must be a Motion"),
    ],
)
def test_what_no_motion_can_be_is_refused_in_one_sentence(call, sentence):
    with pytest.raises(MotionError, match=sentence) as refused:
        call()
    assert "\n" not in str(refused.value)
