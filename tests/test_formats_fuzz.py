"""Whatever bytes a record file holds, the readers answer with channels or with one sentence, quickly."""

import functools
import itertools
import random
import re
import sys
import time
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

sys.path.insert(0, str(Path(__file__).resolve().parent))
from oracles import record_files as written
from oracles.damaged_files import TOKENS, damaged

from rocking.errors import RockingError
from rocking.records import channels, identify, read

RECORDS = Path(__file__).resolve().parents[2] / "shared" / "records"

REQUESTS: tuple[dict[str, object], ...] = ({}, {"units": "g"}, {"units": "gal", "dt": 0.005}, {"dt": 0.01})


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


@pytest.mark.parametrize("examples", [150, pytest.param(1000, marks=pytest.mark.thorough)])
def test_damaged_records_end_in_channels_or_one_sentence(place: Path, examples: int) -> None:
    rng = random.Random(examples)
    for _ in range(examples):
        place.write_bytes(damaged(rng.choice(seeds()), rng))
        attempt(place, rng.choice(REQUESTS))


@pytest.mark.parametrize(
    "every", [16, pytest.param(4, marks=pytest.mark.thorough), pytest.param(1, marks=pytest.mark.slow)]
)
def test_any_token_before_a_record_ends_in_channels_or_one_sentence(place: Path, every: int) -> None:
    """As a control character before the title."""
    assert len(seeds()) >= 20
    for seed, token in list(itertools.product(seeds(), TOKENS))[::every]:
        place.write_bytes(token.encode("latin-1") + seed)
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
