"""The short way of reading numbers gives what the careful one gives, bit for bit, or nothing."""

from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from rocking.errors import RockingError
from rocking.motion.formats import channels, table, values
from rocking.motion.formats.values import Layout, read_aligned, read_columns

SAMPLES = sorted((Path(__file__).parent / "data" / "formats").iterdir())


def contents(path: Path, **request):
    try:
        return [(each.acceleration.tobytes(), each.dt, each.number) for each in channels(path, **request)]
    except RockingError as error:
        return str(error)


@pytest.mark.parametrize("path", SAMPLES, ids=lambda path: path.name)
def test_every_sample_file_comes_out_the_same_without_the_short_way(path, monkeypatch):
    request = {"dt": 0.01, "units": "g"} if path.suffix in (".txt", ".csv") else {}
    short = contents(path, **request)
    for module in (values, table):
        monkeypatch.setattr(module, "read_aligned", lambda *_: None, raising=False)
        monkeypatch.setattr(module, "rows_of_numbers", lambda *_: None, raising=False)
    assert contents(path, **request) == short


FORMS = ["{:10.4f}", "{:15.7E}", "{:+.3f} ", "{:9.0f}", "{:25.17e}", "{:.6e} ", "{:12.1f}"]
NUMBERS = st.lists(st.floats(-1e4, 1e4) | st.floats(-1e-9, 1e-9), min_size=2, max_size=12)


@given(numbers=NUMBERS, form=st.sampled_from(FORMS), per_line=st.integers(1, 4))
@settings(deadline=None)
def test_what_is_read_at_once_is_python_s_own_conversion(numbers, form, per_line):
    words = [form.format(number) for number in numbers]
    lines = ["".join(words[k : k + per_line]) for k in range(0, len(words), per_line)]
    expected = np.array([float(word) for word in words])
    read = read_aligned("\n".join(lines).encode())
    assert read is None or read.tobytes() == expected.tobytes()
    rows = read_columns("\n".join(words).encode(), 1)
    assert rows is None or rows.tobytes() == expected.tobytes()


def test_the_usual_forms_take_the_short_way():
    numbers = np.random.default_rng(1).normal(size=40)
    for form in ("{:10.4f}", "{:15.7E}", "{:13.5e}"):
        lines = ["".join(form.format(number) for number in row) for row in numbers.reshape(-1, 4)]
        assert read_aligned("\n".join([*lines, form.format(0.5)]).encode()) is not None
    rows = "".join(f"{0.01 * k:.2f} {number:.6e}\n" for k, number in enumerate(numbers * 1e3))
    assert read_columns(rows.encode(), 2) is not None


def test_numbers_that_touch_are_cut_by_the_layout():
    text = b"-1.25-2.50\n 3.75-4.00\n-5.00"
    assert read_aligned(text) is None
    assert read_aligned(text, Layout(2, 5)).tolist() == [-1.25, -2.5, 3.75, -4.0, -5.0]
    assert read_aligned(b"1234\n5678\n", Layout(2, 2)) is None


@pytest.mark.parametrize(
    "text",
    [
        b"1.0 2.0\n1.0 \n3.0\n",
        b"1.0\n1_0\n",
        b"1.0\n . \n",
        b"1.0\n- .\n",
        b"1.0\n1-0\n",
        b"10\n -\n",
        b"1.0E+01\n1.0E 01\n",
        b"1.0E+01\n1.0D+01\n1.0E+01\n",
        b"1.0\t2.0\n1.0\t2.0\n",
        b"1.0E+999\n1.0E+999\n",
        b"nan\nnan\n",
        b"\n\n",
        b"9" * 5000 + b"\n",
    ],
)
def test_what_is_not_alike_or_no_number_is_left_to_the_careful_way(text):
    assert read_aligned(text) is None


def test_no_number_is_rounded_twice():
    words = ["90071992547409.93E+01", "12345678901234567.E-05", "00000000000000001.E-99", "17000000000000000.E+99"]
    for word in words:
        assert read_aligned(f"{word}\n{word}\n".encode()).tolist() == [float(word)] * 2
    assert read_aligned(b"0.1000000000000000055\n" * 2) is None
