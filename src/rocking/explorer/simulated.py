"""A case with its response, and what of it is found when it is first asked for."""

from __future__ import annotations

import functools
from dataclasses import dataclass, replace
from typing import Final

import numpy as np

from rocking.arrays import Floats
from rocking.explorer.inputs import Case
from rocking.motion.motion import Motion
from rocking.response import Response
from rocking.treatment import Certified

#: Bracket on a time of rest, s, with which impacts are resolved for a window close to it: some nanoseconds are left.
_FINEST: Final = Certified(1e-40)

#: Ground motion of longer periods than this (s) is not drawn where a record's baseline would drift.
_LONGEST_PERIOD: Final = 10.0


@dataclass(frozen=True, eq=False)
class Simulated:
    """A case with its response, and what is made of it when it is first asked for."""

    case: Case
    response: Response

    @functools.cached_property
    def fine(self) -> Response:
        """The same response with more impacts resolved before each proven rest."""
        if self.case.treatment.name != _FINEST.name:
            return self.response
        fine = replace(self.case, treatment=_FINEST).simulate()
        return fine if fine.stalled == self.response.stalled else self.response

    def resolved(self, start: float, end: float) -> Response:
        """Return the response whose impacts are resolved as far as a window shows."""
        return self.fine if unresolved(self.response, start, end) else self.response

    @functools.cached_property
    def outline(self) -> Floats | None:
        """Trapezoids of the outline of a mesh, in the plane in which it rocks; None of another block."""
        return None if self.case.body is None else self.case.body.across(self.case.azimuth)

    @functools.cached_property
    def ground(self) -> Motion | None:
        """The motion whose displacement is drawn."""
        return None if self.case.motion is None else _steady(self.case.motion)


def unresolved(response: Response, start: float, end: float) -> list[float]:
    """Return the times, s, from the last resolved impact to the rest, of sequences whose end is seen in a window."""
    ends = np.asarray(response.chattering["end"], dtype=float)
    impact_times = np.asarray(response.impacts["time"], dtype=float)
    last = impact_times[np.searchsorted(impact_times, ends, side="right") - 1]
    seen = (ends > start) & (last < end) & (ends - last > 1e-3 * (end - start))
    return [float(each) for each in (ends - last)[seen]]


def _steady(motion: Motion) -> Motion:
    """Return the horizontal motion, or if it is a record the part of it whose displacement does not drift away."""
    motion = motion.with_vertical(None)
    return motion.processed(baseline=1, band_pass=(1.0 / _LONGEST_PERIOD, None)) if drifts(motion) else motion


def drifts(motion: Motion) -> bool:
    """Whether the displacement of a motion is that of a record, and can be filtered."""
    long_enough = motion.step is not None and motion.duration > 2.0 * _LONGEST_PERIOD > 20.0 * motion.step
    return long_enough and motion.coefficients.shape[1] == 2 and not motion.jumps
