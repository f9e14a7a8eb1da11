"""Channel of a record file: samples in m/s^2, times and metadata."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from rocking.core.arrays import Floats
from rocking.errors import MotionError, RecordError
from rocking.motion.description import Description, Origin
from rocking.motion.motion import Motion
from rocking.records.formats.source import Request, Source
from rocking.records.units import Unit

#: Largest distance of even times from their grid divided by the step (or the rounding of printed decimals).
_STEP_TOLERANCE = 1e-6
#: Distance of rounded times from the best even grid in units of the last decimal, with a margin for the grid's error.
_ROUNDING_MARGIN = 1.25
#: Later times are mistakes, s (30,000 years).
_MAX_TIME = 1e12


def find_first_fault(times: Floats) -> int | None:
    """Return the first index at which the time does not increase, or None."""
    with np.errstate(over="ignore"):
        is_valid = (np.diff(times) > 0.0) & (np.abs(times[1:]) <= _MAX_TIME) & (np.abs(times[:-1]) <= _MAX_TIME)
    faults = np.flatnonzero(~is_valid)
    return int(faults[0]) + 1 if len(faults) else None


def fit_even_step(times: Floats) -> float | None:
    """Return the step of increasing `times` (s) if they are even up to their printed decimals, else None."""
    intervals = len(times) - 1
    mean = float(times[-1] - times[0]) / intervals
    rounding = 4.0 * float(np.spacing(np.abs(times).max()))
    resolution = _find_resolution(times, rounding)
    multiple = round(mean / resolution) * resolution if resolution else 0.0
    if abs(multiple - mean) <= (resolution + rounding) / intervals:
        # The decimals represent this step exactly. A missing sample must not pass for rounding.
        return _find_simplest_step(times, multiple, rounding, _STEP_TOLERANCE * mean + rounding)
    if resolution > 0.5 * mean:
        return None
    max_spread = max(_ROUNDING_MARGIN * resolution, _STEP_TOLERANCE * mean) + rounding
    index = np.arange(len(times)) - 0.5 * intervals
    slope = float(index @ times / (index @ index))
    return _find_simplest_step(times, slope, (_ROUNDING_MARGIN - 1.0) * resolution + rounding, max_spread)


def has_rounded_step(times: Floats, step: float) -> bool:
    """Return whether even times with this step may be printed as `times`."""
    sizes = np.abs(times)
    if not sizes.max() <= _MAX_TIME or not np.all(np.diff(times) >= 0.0):
        return False
    rounding = 4.0 * float(np.spacing(sizes.max()))
    resolution = _find_resolution(times, rounding)
    is_rounded = resolution and abs(step / resolution - round(step / resolution)) > _STEP_TOLERANCE
    spread = float(np.ptp(times - step * np.arange(len(times))))
    return spread <= (resolution if is_rounded else _STEP_TOLERANCE * step) + rounding and resolution <= 10.0 * step


def _find_resolution(times: Floats, rounding: float) -> float:
    """Return the place of the last printed decimal of the times, s, or 0 for all digits."""
    for decimals in range(10):
        scaled = times * 10.0**decimals
        if float(np.abs(scaled - np.rint(scaled)).max()) <= max(_STEP_TOLERANCE, rounding * 10.0**decimals):
            return 10.0**-decimals
    return 0.0


def _find_simplest_step(times: Floats, step: float, drift: float, max_spread: float) -> float | None:
    """Return the step (s) of fewest digits within `drift` of `step` over all times, or None off its grid."""
    candidates = (float(f"{step:.{digits}g}") for digits in range(1, 18))
    simplest = next((candidate for candidate in candidates if abs(candidate - step) * len(times) <= drift), step)
    spread = float(np.ptp(times - simplest * np.arange(len(times))))
    return simplest if spread <= max_spread else None


def resolve_timing(
    source: Source, request: Request, printed: Floats, unit: Unit, find_row: Callable[[int], int]
) -> tuple[float | None, Floats | None]:
    """Return the step (s) of times in a unit, or else the times (s), checked against the requested step.

    A function returns the offset of a row in the file.
    """
    times, offset = unit.to_si(printed), find_row(0)
    fault = find_first_fault(times)
    step = fit_even_step(printed) if fault is None and len(printed) > 1 else None
    if step is not None:
        return request.check_step(source, step * unit.multiplier / unit.divisor, offset), None
    requested = None if request.are_defaults else request.dt
    if requested is not None and has_rounded_step(printed, requested * unit.divisor / unit.multiplier):
        return requested, None
    if fault is not None:
        text = "the time does not increase from the row before; correct it"
        if request.dt is not None:
            raise source.error(text, find_row(fault))
        raise source.error(f"{text}, or give {{}} if it is missing or rounded", find_row(fault), "dt")
    gap = find_missing_value(printed)
    if gap is not None:
        raise missing_value_error(source, printed[gap], find_row(gap))
    if requested is not None:
        raise source.error(f"the times are not evenly {requested:g} s apart; omit {{}}", offset, "dt")
    return None, times


class Identification(NamedTuple):
    r"""Format of a file, and the reason for its identification.

    See Also
    --------
    rocking.records.identify : Identify the format of a file.
    rocking.records.channels : Return the channels of a file.

    Examples
    --------
    >>> import pathlib, rocking, tempfile
    >>> file = pathlib.Path(tempfile.mkdtemp(), "samples.dat")
    >>> _ = file.write_text("# cm/s2 at 100 Hz\n0.1\n0.3\n-0.2\n")
    >>> rocking.records.identify(file).format
    'text table'
    """

    format: str
    reason: str


#: Identified format, and reader of its channels.
Recognised = tuple[Identification, Callable[[Request], "list[Channel]"]]


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
        Acceleration, m/s^2, as in the file, including a constant instrument offset.
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
    is_raw : bool
        Whether the numbers are counts with the offset of an instrument, as in K-NET files, which `motion` removes.

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
    is_raw: bool = False

    def __repr__(self) -> str:
        sampling = f"in steps of {self.dt:g} s" if self.dt is not None else "at uneven times"
        peak = float(np.abs(self.acceleration).max(initial=0.0))
        return f"<Channel: {self.label}, {len(self.acceleration)} samples {sampling}, peak {peak:.5g} m/s^2>"

    @property
    def label(self) -> str:
        """Number and name, for lists of channels."""
        return f"{self.number} {self.name!r}"

    def motion(self, baseline: int | str | None = None, highpass: float | None = None) -> Motion:
        """Return the channel as a motion, linear between samples, from time 0.

        Parameters
        ----------
        baseline : int or "none", optional
            Degree of the polynomial that is fitted and subtracted. By default the mean of raw counts is removed (degree
            0), and nothing from other files.
        highpass : float, optional
            Corner frequency of a high-pass filter, Hz.

        Returns
        -------
        Motion
            Motion whose description contains the metadata of the file, and whose `history` states the changes.

        Raises
        ------
        MotionError
            If there are fewer than two samples, or they are too large for a motion, or an argument is invalid.
        """
        facts = {"event": self.event, "station": self.station, "channel": self.label, "units": self.units}
        text = ", ".join(f"{key} {value}" for key, value in {**self.metadata, **facts}.items() if value)
        name = " ".join(part for part in (self.station, self.name) if part)
        fields = {key: getattr(self, key) for key in ("event", "station", "number", "azimuth", "units", "start")}
        fields |= {key: self.metadata.get(key.replace("_", " "), "") for key in ("format", "file", "heading_units")}
        description = Description("record", text=text, origin=Origin(channel=self.name, **fields))
        if self.dt is None:
            assert self.times is not None
            motion = Motion.from_points(self.times, self.acceleration, name=name, description=description)
        else:
            motion = Motion.from_samples(self.acceleration, self.dt, name=name, description=description)
        return remove_baseline(motion, baseline, highpass, is_raw=self.is_raw)


def remove_baseline(
    motion: Motion, baseline: int | str | None, highpass: float | None, *, is_raw: bool = False
) -> Motion:
    """Return a motion without its baseline ("none" keeps it, None keeps all but that of raw counts), filtered."""
    baseline = 0 if baseline is None and is_raw else baseline
    degree = int(baseline) if isinstance(baseline, str) and baseline.isdecimal() else baseline
    if isinstance(degree, str) and degree != "none":
        text = f"{{}} must be the degree of a polynomial (0 removes the mean) or none; got {degree!r}"
        raise MotionError(text, "baseline", value=baseline)
    steps: dict[str, Any] = {} if degree in (None, "none") else {"baseline": degree}
    steps |= {} if highpass is None else {"band_pass": (highpass, None)}
    if steps and motion.dt is None:
        name = "baseline" if "baseline" in steps else "highpass"
        raise MotionError("{} requires samples at even steps; resample the record in Python first", name)
    return motion.processed(**steps) if steps else motion


#: Numbers that represent missing values: nines before and after the point, marks of well logs and SAC, limits of 16 and
#: 24 bits.
_MISSING_VALUES = [float("9" * digits + "." + "9" * decimals) for digits in range(2, 9) for decimals in range(5)]
_MISSING_VALUES += [999.25, 12345.0, 32767.0, 32768.0, 8388607.0, 8388608.0]


def create_channel(
    source: Source,
    format_name: str,
    values: Floats,
    unit: Unit,
    find_row: Callable[[int], int | None],
    *,
    spelling: str = "",
    facts: Mapping[str, str] | None = None,
    **fields: Any,
) -> Channel:
    """Create the channel of numbers in a unit, for which a function returns the offset of a row in the file."""
    if len(values) < 2:
        raise source.error(f"{len(values)} values are too few for a record; use the complete file", find_row(0))
    acceleration = unit.to_si(values)
    if np.isinf(acceleration).any():
        raise source.error("some values are too large for an acceleration; check the file and its units", find_row(0))
    gap = find_missing_value(values)
    if gap is not None:
        raise missing_value_error(source, values[gap], find_row(gap))
    all_facts = {"format": format_name, "file": Path(source.path).name, **(facts or {})}
    metadata = {key: fact for key, fact in all_facts.items() if fact}
    return Channel(acceleration=acceleration, units=spelling or unit.name, metadata=metadata, **fields)


def find_missing_value(values: Floats) -> int | None:
    """Return the index of the first number that represents a missing value, or None."""
    if np.isnan(values).any():
        return int(np.argmax(np.isnan(values)))
    sizes = np.abs(values)
    is_mark = np.isin(sizes, _MISSING_VALUES) | (sizes >= 1e9)
    if not is_mark.any():
        return None
    edges = np.diff(np.concatenate([[False], is_mark, [False]]).astype(np.int8))
    starts, ends = np.flatnonzero(edges == 1), np.flatnonzero(edges == -1)
    padded = np.concatenate([[0.0], sizes, [0.0]])
    is_isolated = np.maximum(padded[starts], padded[ends + 1]) < 0.2 * sizes[starts]
    return int(starts[is_isolated][0]) if is_isolated.any() else None


def missing_value_error(source: Source, value: float, offset: int | None) -> RecordError:
    """Return the error for a missing value."""
    text = f"{value:g} seems to represent a missing value; use a record without missing values"
    return source.error(text, offset)
