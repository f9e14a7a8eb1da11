"""Checks of arguments: what is a number, and one sentence that says what should have been."""

from fractions import Fraction

import numpy as np
import pytest

import rocking
from rocking.core import checks
from rocking.errors import BlockError, OptionError

REAL = [1, 1.0, np.float32(1), np.float64(1), np.int64(1), np.uint8(1), Fraction(1), np.array(1), np.array(1.0)]
NOT_REAL = ["1", b"1", True, np.True_, np.array(True), None, 1j, np.array([1.0]), [1.0], np.array("1")]
NOT_FINITE = [np.nan, np.inf, -np.inf, 10**400, np.float32(np.nan)]

CHECKS = {
    "number": lambda value: checks.real(value, "it", OptionError),
    "finite": lambda value: checks.finite(value, "it", OptionError),
    "positive": lambda value: checks.positive(value, "it", OptionError, "s"),
    "within": lambda value: checks.between(value, "it", OptionError, 0.5, 2.0),
    "share": lambda value: checks.fraction(value, "it", OptionError, below=1.5),
}


@pytest.mark.parametrize("check", CHECKS)
@pytest.mark.parametrize("value", REAL)
def test_every_real_number_is_a_number(check, value):
    found = CHECKS[check](value)
    assert (found, type(found)) == (1.0, float)


@pytest.mark.parametrize("check", CHECKS)
@pytest.mark.parametrize("value", NOT_REAL)
def test_text_truth_values_and_sequences_are_not_numbers(check, value):
    with pytest.raises(OptionError, match=r"^it must be a .*number.*, not ") as caught:
        CHECKS[check](value)
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize("check", [name for name in CHECKS if name != "number"])
@pytest.mark.parametrize("value", NOT_FINITE)
def test_only_a_number_need_not_be_finite(check, value):
    with pytest.raises(OptionError, match="must be"):
        CHECKS[check](value)


def test_the_error_is_the_one_that_is_asked_for_and_says_the_unit():
    with pytest.raises(BlockError, match=r"^height must be a positive number, in m, not -1$"):
        checks.positive(-1.0, "height", BlockError, "m")
    with pytest.raises(BlockError, match=r"^p must be a number from 1 to 2, in rad/s, not 3$"):
        checks.between(3.0, "p", BlockError, 1.0, 2.0, "rad/s")


@pytest.mark.parametrize("value", [2, np.int64(2), np.uint8(2), np.array(2)])
def test_whole_numbers_are_of_a_whole_type(value):
    found = checks.integer(value, "it", OptionError, 1, 2)
    assert (found, type(found)) == (2, int)


@pytest.mark.parametrize("value", [0, 3, 2.0, "2", True, np.True_, None, np.float64(2)])
def test_other_whole_numbers_are_refused(value):
    with pytest.raises(OptionError, match="it must be a whole number from 1 to 2, not"):
        checks.integer(value, "it", OptionError, 1, 2)


@pytest.mark.parametrize("values", [[1, 2], (1.0, 2.0), np.array([1, 2], np.int8), [Fraction(1), 2], range(1, 3)])
def test_arrays_of_real_numbers_become_floats(values):
    found = checks.increasing_numbers(values, "they", OptionError)
    assert (found.tolist(), found.dtype) == ([1.0, 2.0], np.float64)


@pytest.mark.parametrize(
    "values",
    [["1", "2"], [1, "2"], [True, False], [1, None], [1j], [[1], [1, 2]], np.ma.masked_array([1.0, 2.0], [0, 1])],
)
def test_arrays_of_anything_else_are_refused(values):
    with pytest.raises(OptionError, match=r"must (be|not contain)"):
        checks.numbers(values, "they", OptionError)


@pytest.mark.parametrize("values", [[], [0.0], [-1.0], [np.nan], [np.inf], [[1.0]]])
def test_positive_numbers_are_one_or_more_of_them(values):
    with pytest.raises(OptionError, match="one or more positive finite numbers"):
        checks.positive_numbers(values, "they", OptionError)


@pytest.mark.parametrize(
    "call",
    [
        lambda number: (
            rocking.Block(half_width=number(0.25), half_height=number(1.0), mass=number(2.0), restitution=number(0.5)).p
        ),
        lambda number: rocking.Block.from_pivots((number(0.25), number(0.5)), number(1.0), number(0.5)).sides[0].p,
        lambda number: rocking.Motion.from_samples([0.0, 1.0], number(0.5)).delayed(number(0.25)).duration,
        lambda number: rocking.Motion([0.0, 2.0], [[1.0]]).spectral_acceleration(number(1.0), number(0.0)),
        lambda number: rocking.pulses.ricker(number(2.0), number(0.5), duration=number(1.0)).pga,
        lambda number: rocking.chattering.chattering_time(number(1.03125), number(2.0), number(0.5)),
    ],
)
def test_single_precision_is_as_good_as_double(call):
    assert call(np.float32) == call(float)
    for wrong in (str, lambda value: True):
        with pytest.raises(rocking.RockingError):
            call(wrong)
