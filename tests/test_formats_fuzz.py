"""Whatever bytes a record file holds, the readers answer with channels or with one sentence, quickly."""

import functools
import itertools
import re
import sys
import time
from collections.abc import Callable, Iterator
from pathlib import Path

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

sys.path.insert(0, str(Path(__file__).resolve().parent))
from oracles import record_files as written

from rocking.errors import RockingError
from rocking.motion.formats import channels, identify, read

RECORDS = Path(__file__).resolve().parents[2] / "shared" / "records"

#: What replaces a number, or is put anywhere.
TOKENS = (
    *(b"0", b"-1", b"1", b"nan", b"-inf", b"1e999", b"1e308", b"-1e308", b"5e-324", b"1e-308", b"99999999999", b"2"),
    *(b"9" * 30, b"9" * 5000, b"-999", b"1.7e38", b"1.0D-3", b"1_0", b".", b"-", b"+.e", b"E", b"0.", b"-0.0", b"36"),
    *(
        b" ",
        b"\n",
        b"\r",
        b"\f",
        b"\t",
        b"\0",
        b"\x1a",
        b"\v",
        b"\xff",
        b"\xef\xbb\xbf",
        b"\xff\xfe",
        b"\n\n\n",
        b",",
        b";",
    ),
    *(
        b"#",
        b"/&",
        b"|",
        b"NPTS",
        b"DT=",
        b"units of ",
        b"End-of-data",
        b"(8F10.5)",
        b"(999F999.9)",
        b"(0F0)",
        b"(1E1)",
    ),
    *(
        b"Uncorrected Accelerogram",
        b"Corrected accelerogram\n",
        b"points of accel data at 1 sec",
        b"G/10",
        b"1 VELOCITY",
    ),
)
REQUESTS: tuple[dict[str, object], ...] = ({}, {"units": "g"}, {"units": "gal", "dt": 0.005}, {"dt": 0.01})

Operation = tuple[int, float, float, int]
_NUMBER = re.compile(rb"[+-]?\d*\.?\d+(?:[EeDd][+-]?\d+)?")


def _flip(data: bytes, at: int, length: int, choice: int, other: bytes) -> bytes:
    return data[:at] + bytes([data[at] ^ (1 << choice % 8)]) + data[at + 1 :] if at < len(data) else data


def _delete(data: bytes, at: int, length: int, choice: int, other: bytes) -> bytes:
    return data[:at] + data[at + length :]


def _repeat(data: bytes, at: int, length: int, choice: int, other: bytes) -> bytes:
    return data[:at] + data[at : at + length] * (1 + choice % 20) + data[at + length :]


def _cut(data: bytes, at: int, length: int, choice: int, other: bytes) -> bytes:
    return data[:at]


def _insert(data: bytes, at: int, length: int, choice: int, other: bytes) -> bytes:
    return data[:at] + TOKENS[choice % len(TOKENS)] + data[at:]


def _renumber(data: bytes, at: int, length: int, choice: int, other: bytes) -> bytes:
    found = _NUMBER.search(data, at)
    return data if found is None else data[: found.start()] + TOKENS[choice % len(TOKENS)] + data[found.end() :]


def _splice(data: bytes, at: int, length: int, choice: int, other: bytes) -> bytes:
    return data[:at] + other[min(at, len(other) // 2) :]


def _drop_line(data: bytes, at: int, length: int, choice: int, other: bytes) -> bytes:
    lines = data.split(b"\n")
    del lines[data.count(b"\n", 0, at)]
    return b"\n".join(lines)


def _swap_lines(data: bytes, at: int, length: int, choice: int, other: bytes) -> bytes:
    lines = data.split(b"\n")
    first, second = data.count(b"\n", 0, at), choice % len(lines)
    lines[first], lines[second] = lines[second], lines[first]
    return b"\n".join(lines)


def _join_lines(data: bytes, at: int, length: int, choice: int, other: bytes) -> bytes:
    return data[:at] + data[at:].replace(b"\n", b"", 1 + choice % 3)


def _noise(data: bytes, at: int, length: int, choice: int, other: bytes) -> bytes:
    return data[:at] + bytes((choice * k * k + 7 * k) % 256 for k in range(length % 97)) + data[at:]


MUTATIONS: tuple[Callable[[bytes, int, int, int, bytes], bytes], ...] = (
    *(_flip, _delete, _repeat, _cut, _insert, _insert, _renumber, _renumber, _renumber),
    *(_splice, _drop_line, _swap_lines, _join_lines, _noise),
)


@functools.cache
def seeds() -> list[bytes]:
    """The fixtures, and the real headers before a few of their numbers where the real files are at hand."""
    found = [content.encode() for content in written.fixtures().values()]
    for name in ("CICLC.v1", "CITOW2.RAW"):
        found += [b"".join(_shortened(path)) for path in (RECORDS / "shippable" / name,) if path.is_file()]
    for path in sorted(RECORDS.glob("*/*.[AV]*2")):
        lines = path.read_bytes().splitlines(keepends=True)
        points = re.compile(rb"\b[4-9]\d\d\d\b")
        found.append(
            b"".join(points.sub(b"  40", line, count=1) for line in lines[: 51 if path.suffix == ".V2" else 12])
        )
    return found


def _shortened(path: Path) -> Iterator[bytes]:
    """The lines of a V1 file, of each channel's data the first five (with forty numbers)."""
    data = 0
    for line in path.read_bytes().splitlines(keepends=True):
        if b"points at" in line:
            data = 1
            yield b"    40" + line[6:]
            continue
        data = 0 if line.startswith(b"/&") or data == 0 else data + 1
        if data <= 6:
            yield line


def mutated(seed: bytes, other: bytes, operations: list[Operation]) -> bytes:
    """`seed` after the operations: each a mutation, a place and a length (as shares), and a choice."""
    data = seed
    for mutation, place, share, choice in operations:
        at = min(int(place * len(data)), max(len(data) - 1, 0))
        length = 1 + int(share**4 * min(len(data), 2000))
        data = MUTATIONS[mutation % len(MUTATIONS)](data, at, length, choice, other)[:200_000]
    return data


def attempt(path: Path, request: dict[str, object]) -> bool:
    """Read a record; whether it was accepted. Anything but a RockingError of one line gets out."""
    try:
        identify(path)
        found = channels(path, **request)  # type: ignore[arg-type]
        for channel in found:
            assert np.isfinite(channel.acceleration).all()
            channel.motion()
        read(path, channel=found[0].number, **request)  # type: ignore[arg-type]
    except RockingError as error:
        message = str(error)
        assert message
        assert "\n" not in message
        assert len(message) < 4000
        return False
    return True


OPERATIONS = st.lists(
    st.tuples(st.integers(0, len(MUTATIONS) - 1), st.floats(0, 1), st.floats(0, 1), st.integers(0, 10 * len(TOKENS))),
    max_size=5,
)


@pytest.fixture(scope="module")
def place(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return tmp_path_factory.mktemp("fuzz") / "record.dat"


def test_seeds_are_accepted_or_refused_as_they_are(place: Path) -> None:
    accepted = 0
    for seed in seeds():
        place.write_bytes(seed)
        accepted += attempt(place, {}) or attempt(place, {"units": "gal", "dt": 0.005})
    # The files of velocities, displacements and raw counts are refused.
    assert accepted == len(seeds()) - 6


#: On a busy machine all is slow; each example writes the file anew.
SLOW_OR_SHARED = [HealthCheck.too_slow, HealthCheck.function_scoped_fixture]


@pytest.mark.parametrize("examples", [40, pytest.param(250, marks=pytest.mark.thorough)])
def test_damaged_records_end_in_channels_or_one_sentence(place: Path, examples: int) -> None:
    known = st.sampled_from(seeds())

    @settings(max_examples=examples, deadline=None, suppress_health_check=SLOW_OR_SHARED)
    @given(known, known, OPERATIONS, st.sampled_from(REQUESTS))
    def judge(seed: bytes, other: bytes, operations: list[Operation], request: dict[str, object]) -> None:
        place.write_bytes(mutated(seed, other, operations))
        attempt(place, request)

    judge()


@pytest.mark.parametrize(
    "every", [16, pytest.param(4, marks=pytest.mark.thorough), pytest.param(1, marks=pytest.mark.slow)]
)
def test_any_token_before_a_record_ends_in_channels_or_one_sentence(place: Path, every: int) -> None:
    """As a control character before the title."""
    assert len(seeds()) >= 20
    for seed, token in list(itertools.product(seeds(), TOKENS))[::every]:
        place.write_bytes(token + seed)
        attempt(place, {})


@settings(max_examples=150, deadline=None, suppress_health_check=SLOW_OR_SHARED)
@given(content=st.binary(max_size=500), request_=st.sampled_from(REQUESTS))
def test_random_bytes_end_in_channels_or_one_sentence(place: Path, content: bytes, request_: dict[str, object]) -> None:
    place.write_bytes(content)
    attempt(place, request_)


def test_time_grows_no_faster_than_the_file(place: Path) -> None:
    for unit in (
        b"1 ",
        b"\n",
        b" ",
        b"-",
        b"NPTS",
        b"NPTS= 1, DT= ",
        b"/&\n",
        b"1,",
        b"| \n",
        b"EVENT_NAME: \n",
        b"1.5\n",
    ):
        for title in (b"", b"Corrected Accelerogram\n", b"Uncorrected Accelerogram\n", b"2 CORRECTED ACCELEROGRAM\n"):
            place.write_bytes(title + unit * (1_000_000 // len(unit)))
            start = time.process_time()
            attempt(place, {"units": "g", "dt": 0.01})
            assert time.process_time() - start < 5.0, (unit, title)
