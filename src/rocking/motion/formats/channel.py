"""One channel of a record file: its samples in m/s^2 and what the file says about them."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from types import MappingProxyType
from typing import Any

import numpy as np
from numpy.typing import NDArray

from rocking.constants import STANDARD_GRAVITY
from rocking.errors import InvalidMotion
from rocking.motion.description import Description
from rocking.motion.formats.source import Source
from rocking.motion.formats.units import Unit
from rocking.motion.motion import Motion


@dataclass(frozen=True, eq=False)
class Channel:
    """One component of a recorded ground acceleration, evenly sampled (`dt`) or not (`times`).

    Attributes
    ----------
    name : str
        What the file calls the component, for instance "90 Deg", "Up" or "HNE".
    number : int
        The channel's number in the file, counted from 1 where the file gives none.
    acceleration : ndarray, shape (n,)
        m/s^2, read-only; nothing is removed, so an instrument's constant offset is still in it.
    dt : float or None
        Sampling step, s; None where the samples are uneven.
    times : ndarray, shape (n,), or None
        Instants of uneven samples, s; None where they are even.
    azimuth : float or None
        Direction of positive acceleration, degrees clockwise from north; None if vertical or unknown.
    units : str
        Units of the numbers in the file, as it spells them.
    station, event : str
        As the file gives them, or empty.
    metadata : mapping of str to str
        Other facts: format, file, location, what was kept, ...

    Raises
    ------
    InvalidMotion
        If not exactly one of `dt` and `times` is given.

    Examples
    --------
    >>> Channel("Up", 3, [0.0, 0.1, 0.0], dt=0.02, station="CLC").motion().duration
    0.04
    """

    name: str
    number: int
    acceleration: NDArray[np.float64]
    dt: float | None = None
    times: NDArray[np.float64] | None = None
    azimuth: float | None = None
    units: str = ""
    station: str = ""
    event: str = ""
    metadata: Mapping[str, str] = field(default_factory=dict)

    def __post_init__(self) -> None:
        if (self.dt is None) == (self.times is None):
            raise InvalidMotion("a channel needs its sampling step dt or its times, and not both")
        object.__setattr__(self, "acceleration", _frozen(self.acceleration))
        if self.times is not None:
            object.__setattr__(self, "times", _frozen(self.times))
        object.__setattr__(self, "metadata", MappingProxyType(dict(self.metadata)))

    def __reduce__(self) -> tuple[Any, ...]:
        samples = (self.name, self.number, self.acceleration, self.dt, self.times)
        return Channel, (*samples, self.azimuth, self.units, self.station, self.event, dict(self.metadata))

    def __repr__(self) -> str:
        taken = f"in steps of {self.dt:g} s" if self.dt is not None else "at uneven times"
        peak = float(np.abs(self.acceleration).max(initial=0.0))
        in_file = f", {self.units} in the file" if self.units else ""
        return (
            f"<Channel: {self.label}, {len(self.acceleration)} samples {taken}, peak {peak:.5g} m/s^2 "
            f"({peak / STANDARD_GRAVITY:.4g} g){in_file}>"
        )

    @property
    def label(self) -> str:
        """Number and name, as lists of channels show them."""
        return f"{self.number} {self.name!r}"

    def motion(self) -> Motion:
        """Return the channel as a motion, linear between samples, its time counted from the first sample.

        Raises
        ------
        InvalidMotion
            If there are fewer than two samples, or they are too large for a motion.
        """
        name = " ".join(part for part in (self.station, self.name) if part)
        description = Description("record", text=self._facts())
        if self.times is not None:
            return Motion.from_points(self.times, self.acceleration, name=name, description=description)
        assert self.dt is not None
        return Motion.from_samples(self.acceleration, self.dt, name=name, description=description)

    def _facts(self) -> str:
        facts = {"event": self.event, "station": self.station, "channel": self.label, "units": self.units}
        return ", ".join(f"{key} {value}" for key, value in {**self.metadata, **facts}.items() if value)


def to_acceleration(source: Source, at: int | None, values: NDArray[np.float64], unit: Unit) -> NDArray[np.float64]:
    """Return numbers in `unit`, which stand at the offset `at` of the file, in m/s^2.

    Raises
    ------
    UnreadableRecord
        If there are fewer than two, or one is too large.
    """
    if len(values) < 2:
        raise source.error(f"{len(values)} values are too few for a record; get the whole file", at)
    acceleration = unit.to_si(values)
    if not np.isfinite(acceleration).all():
        raise source.error("some values are too large for an acceleration; check the file and its units", at)
    return acceleration


def _frozen(values: NDArray[np.float64]) -> NDArray[np.float64]:
    array = np.array(values, dtype=np.float64)
    array.setflags(write=False)
    return array
