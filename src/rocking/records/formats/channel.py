"""Channel of a record file: samples in m/s^2, times and metadata."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from rocking.core.arrays import Floats
from rocking.core.constants import STANDARD_GRAVITY
from rocking.errors import UnreadableRecord
from rocking.motion.description import Description, Origin
from rocking.motion.motion import Motion
from rocking.records.formats.source import Request, Source
from rocking.records.units import Unit

#: Largest distance of even times from their grid divided by the step (or the rounding of printed decimals).
_JITTER = 1e-6
#: Distance of rounded times from the best even grid in units of the last decimal, with a margin for the grid's error.
_SPREAD = 1.25
#: Later times are mistakes, s (30,000 years).
_LATEST = 1e12


def first_fault(times: Floats) -> int | None:
    """Return the first index at which the time does not increase, or None."""
    with np.errstate(over="ignore"):
        fine = (np.diff(times) > 0.0) & (np.abs(times[1:]) <= _LATEST) & (np.abs(times[:-1]) <= _LATEST)
    faults = np.flatnonzero(~fine)
    return int(faults[0]) + 1 if len(faults) else None


def even_step(times: Floats) -> float | None:
    """Return the step of increasing `times` (s) if they are even up to their printed decimals, else None."""
    intervals = len(times) - 1
    mean = float(times[-1] - times[0]) / intervals
    rounding = 4.0 * float(np.spacing(np.abs(times).max()))
    resolution = _resolution(times, rounding)
    multiple = round(mean / resolution) * resolution if resolution else 0.0
    if abs(multiple - mean) <= (resolution + rounding) / intervals:
        # The decimals represent this step exactly. A missing sample must not pass for rounding.
        return _simplest_fit(times, multiple, rounding, _JITTER * mean + rounding)
    if resolution > 0.5 * mean:
        return None
    allowed = max(_SPREAD * resolution, _JITTER * mean) + rounding
    index = np.arange(len(times)) - 0.5 * intervals
    slope = float(index @ times / (index @ index))
    return _simplest_fit(times, slope, (_SPREAD - 1.0) * resolution + rounding, allowed)


def prints_as(times: Floats, step: float) -> bool:
    """Return whether even times with this step may be printed as `times`."""
    sizes = np.abs(times)
    if not sizes.max() <= _LATEST or not np.all(np.diff(times) >= 0.0):
        return False
    rounding = 4.0 * float(np.spacing(sizes.max()))
    last = _resolution(times, rounding)
    rounded = last and abs(step / last - round(step / last)) > _JITTER
    spread = float(np.ptp(times - step * np.arange(len(times))))
    return spread <= (last if rounded else _JITTER * step) + rounding and last <= 10.0 * step


def _resolution(times: Floats, rounding: float) -> float:
    """Return the place of the last printed decimal of the times, s, or 0 for all digits."""
    for decimals in range(10):
        scaled = times * 10.0**decimals
        if float(np.abs(scaled - np.rint(scaled)).max()) <= max(_JITTER, rounding * 10.0**decimals):
            return 10.0**-decimals
    return 0.0


def _simplest_fit(times: Floats, step: float, drift: float, allowed: float) -> float | None:
    """Return the step (s) of fewest digits within `drift` of `step` over all times, or None off its grid."""
    candidates = (float(f"{step:.{digits}g}") for digits in range(1, 18))
    simplest = next((each for each in candidates if abs(each - step) * len(times) <= drift), step)
    spread = float(np.ptp(times - simplest * np.arange(len(times))))
    return simplest if spread <= allowed else None


def timing(
    source: Source, request: Request, written: Floats, unit: Unit, at: int, row_at: Callable[[int], int] | None = None
) -> tuple[float | None, Floats | None]:
    """Return the step (s) of times in a unit, or else the times (s), checked against the requested step."""
    times, row_at = unit.to_si(written), row_at or (lambda _: at)
    fault = first_fault(times)
    step = even_step(written) if fault is None and len(written) > 1 else None
    if step is not None:
        return request.step(source, step * unit.multiplier / unit.divisor, at), None
    given = None if request.several else request.dt
    if given is not None and prints_as(written, given * unit.divisor / unit.multiplier):
        return given, None
    if fault is not None:
        text = "the time does not increase from the row before; correct it"
        if request.dt is not None:
            raise source.error(text, row_at(fault))
        raise source.error(f"{text}, or give {{}} if it is missing or rounded", row_at(fault), "dt")
    gap = gap_at(written)
    if gap is not None:
        raise missing_value(source, written[gap], row_at(gap))
    if given is not None:
        raise source.error(f"the times are not evenly {given:g} s apart; leave {{}} out", at, "dt")
    return None, times


class Identification(NamedTuple):
    """Format of a file, and the reason for its identification."""

    format: str
    reason: str


class Recognised(NamedTuple):
    """Recognised format, reason, and reader of the channels."""

    format: str
    reason: str
    read: Callable[[Request], list[Channel]]


@dataclass(frozen=True, eq=False)
class Channel:
    """Component of a recorded ground acceleration, sampled evenly (`dt`) or unevenly (`times`).

    Attributes
    ----------
    name : str
        Name of the component in the file, for example "90 Deg", "Up" or "HNE".
    number : int
        Channel number in the file, counted from 1 if the file states none.
    acceleration : ndarray, shape (n,)
        Acceleration, m/s^2, including a constant instrument offset.
    dt : float or None
        Sampling step, s, or None for uneven samples.
    times : ndarray, shape (n,), or None
        Instants of uneven samples, s, or None for even samples.
    azimuth : float or None
        Direction of positive acceleration, degrees clockwise from north, or None if vertical or unknown.
    units : str
        Units of the numbers in the file, as spelled there.
    station, event : str
        Station and event as stated in the file, or empty.
    metadata : mapping of str to str
        Other facts: format, file, location, retained content, ...
    start : float or None
        Instant of the first sample by the file's clock, s, or None if unknown.

    See Also
    --------
    rocking.records.channels : return the channels of a file.

    Examples
    --------
    >>> Channel("Up", 3, np.array([0.0, 0.1, 0.0]), dt=0.02, station="CLC").motion().duration
    0.04
    """

    name: str
    number: int
    acceleration: Floats
    dt: float | None = None
    times: Floats | None = None
    azimuth: float | None = None
    units: str = ""
    station: str = ""
    event: str = ""
    metadata: Mapping[str, str] = field(default_factory=dict)
    start: float | None = None

    def __repr__(self) -> str:
        taken = f"in steps of {self.dt:g} s" if self.dt is not None else "at uneven times"
        peak = float(np.abs(self.acceleration).max(initial=0.0))
        peaks = f"peak {peak:.5g} m/s^2 ({peak / STANDARD_GRAVITY:.4g} g)"
        in_file = f", {self.units} in the file" if self.units else ""
        return f"<Channel: {self.label}, {len(self.acceleration)} samples {taken}, {peaks}{in_file}>"

    @property
    def label(self) -> str:
        """Number and name, for lists of channels."""
        return f"{self.number} {self.name!r}"

    def motion(self) -> Motion:
        """Return the channel as a motion, linear between samples, from time 0.

        Returns
        -------
        Motion
            Motion whose description contains the metadata of the file.

        Raises
        ------
        InvalidMotion
            If there are fewer than two samples, or they are too large for a motion.
        """
        facts = {"event": self.event, "station": self.station, "channel": self.label, "units": self.units}
        text = ", ".join(f"{key} {value}" for key, value in {**self.metadata, **facts}.items() if value)
        name = " ".join(part for part in (self.station, self.name) if part)
        known = {key: getattr(self, key) for key in ("event", "station", "number", "azimuth", "units", "start")}
        known |= {key: self.metadata.get(key.replace("_", " "), "") for key in ("format", "file", "heading_units")}
        description = Description("record", text=text, origin=Origin(channel=self.name, **known))
        if self.dt is None:
            assert self.times is not None
            return Motion.from_points(self.times, self.acceleration, name=name, description=description)
        return Motion.from_samples(self.acceleration, self.dt, name=name, description=description)


#: Numbers that represent missing values: nines before and after the point, marks of well logs and SAC, limits of 16 and
#: 24 bits.
_MARKS = [float("9" * whole + "." + "9" * decimals) for whole in range(2, 9) for decimals in range(5)]
_MARKS += [999.25, 12345.0, 32767.0, 32768.0, 8388607.0, 8388608.0]


def channel_of(
    source: Source,
    form: str,
    values: Floats,
    unit: Unit,
    at: int | None,
    *,
    spelling: str = "",
    facts: Mapping[str, str] | None = None,
    row_at: Callable[[int], int] | None = None,
    **known: Any,
) -> Channel:
    """Return the channel of numbers in a unit at the offset `at` of a file of that format."""
    if len(values) < 2:
        raise source.error(f"{len(values)} values are too few for a record; get the whole file", at)
    acceleration = unit.to_si(values)
    if np.isinf(acceleration).any():
        raise source.error("some values are too large for an acceleration; check the file and its units", at)
    gap = gap_at(values)
    if gap is not None:
        raise missing_value(source, values[gap], row_at(gap) if row_at else at)
    said = {"format": form, "file": Path(source.path).name, **(facts or {})}
    metadata = {key: fact for key, fact in said.items() if fact}
    return Channel(acceleration=acceleration, units=spelling or unit.name, metadata=metadata, **known)


def gap_at(values: Floats) -> int | None:
    """Return the index of the first number that represents a missing value, or None."""
    if np.isnan(values).any():
        return int(np.argmax(np.isnan(values)))
    sizes = np.abs(values)
    marked = np.isin(sizes, _MARKS) | (sizes >= 1e9)
    if not marked.any():
        return None
    edges = np.diff(np.concatenate([[False], marked, [False]]).astype(np.int8))
    starts, ends = np.flatnonzero(edges == 1), np.flatnonzero(edges == -1)
    padded = np.concatenate([[0.0], sizes, [0.0]])
    alone = np.maximum(padded[starts], padded[ends + 1]) < 0.2 * sizes[starts]
    return int(starts[alone][0]) if alone.any() else None


def missing_value(source: Source, value: float, at: int | None) -> UnreadableRecord:
    """Return the error for a missing value at the offset `at`."""
    text = f"{value:g} seems to stand for a missing value; get a record that has a value at every instant"
    return source.error(text, at)
