"""How the peak of a response changes with every coefficient, and so with every sample, of its motion."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Final

import numpy as np

from rocking.arrays import Floats
from rocking.errors import InvalidOption
from rocking.kernels import state
from rocking.kernels.adjoint import Ends, adjoint
from rocking.kernels.trace import Trail
from rocking.motion import piecewise
from rocking.motion.motion import Motion
from rocking.response.answers import trail_of
from rocking.response.response import Response

_NO_REASON: Final = ""
_OVERTURNS: Final = "the block overturns: its peak is where it falls, whatever changes a little"
_UNFINISHED: Final = "the simulation was not finished: its peak is not known"
_FROM_REST: Final = "the response starts on the ground: a start to the other side changes it otherwise"
_REASONS: Final = {
    Ends.GRAZES: "the block touches the ground without speed: with a little less motion it does not, or it hits it",
    Ends.LEAVES_AT_ONCE: "the block leaves the ground at the instant at which it comes to rest, before its peak",
}


@dataclass(frozen=True, eq=False)
class Gradient:
    """Derivatives of a number, as the peak of a response, by what it was computed from; made by `gradient`.

    Attributes
    ----------
    value : float
        The number itself: of a peak rad, of another body's in the unit of its coordinate.
    coefficients : ndarray, shape (n, degree + 1)
        By the coefficients of the motion's n pieces: rad per m/s^2, per m/s^3, and so on. Exactly zero for all pieces
        that end before the last uplift in front of the peak, or begin after it.
    vertical : ndarray or None
        The same, of the vertical component.
    initial_rotation, initial_velocity : float
        By the start: rad per rad, and rad per rad/s.
    reason : str
        Why numbers are NaN, one sentence; empty where none is.
    """

    value: float
    coefficients: Floats
    vertical: Floats | None
    initial_rotation: float
    initial_velocity: float
    reason: str
    _motion: Motion | None

    @property
    def samples(self) -> Floats:
        """By the samples of a record, rad per m/s^2, shape (n + 1,): by the motion's accelerations at breakpoints.

        Raises
        ------
        InvalidOption
            If the motion is not linear between samples.
        """
        return _by_samples(self._motion, self.coefficients)

    @property
    def vertical_samples(self) -> Floats:
        """The same, of the vertical component.

        Raises
        ------
        InvalidOption
            If there is none, or if it is not linear between samples.
        """
        if self._motion is None or self._motion.vertical is None or self.vertical is None:
            raise InvalidOption("the motion has no vertical component; give it one by `with_vertical`")
        return _by_samples(self._motion.vertical, self.vertical)

    def __repr__(self) -> str:
        if self.reason:
            return f"<Gradient: {self.reason}>"
        moved = int(np.count_nonzero(np.any(self.coefficients != 0.0, axis=1)))
        return f"<Gradient: {self.value:.6g} depends on {moved} of {len(self.coefficients)} pieces of the motion>"


def gradient(response: Response) -> Gradient:
    """Differentiate the peak of a response by its motion, sample by sample, and by the start.

    Parameters
    ----------
    response : Response
        What `simulate` found, for a block or another body.

    Returns
    -------
    Gradient
        By the coefficients of the motion's pieces, both components, by its samples, and by the initial state.

    Raises
    ------
    InvalidOption
        If the response is none, or that of a body with a tendon that yields or with two stops.

    Notes
    -----
    One pass back along the steps of the response, whatever the number of samples: the adjoint of what
    `Response.sensitivity` carries forwards (see "Impacts: restitution and sensitivity" in the documentation). Numbers
    are NaN where there is no derivative, and `Gradient.reason` says why: where the block overturns, or touches the
    ground without speed.

    Examples
    --------
    >>> import rocking
    >>> block = rocking.Block.from_parameters(p=2.0, alpha=0.2, restitution=0.9)
    >>> record = rocking.Motion.from_samples([0.0, 3.0, -4.0, 3.0, 0.0], 0.3)
    >>> found = rocking.gradient(rocking.simulate(block, record))
    >>> [f"{each:.5f}" for each in found.samples]
    ['-0.00175', '-0.01310', '0.01048', '0.04288', '0.03351']
    """
    if not isinstance(response, Response):
        raise InvalidOption("{} must be a response, as `rocking.simulate` returns it", "response", value=response)
    reason = _NO_REASON
    if response.overturned or response.unfinished:
        reason = _OVERTURNS if response.overturned else _UNFINISHED
    elif response.near_ties:
        reason = _REASONS[Ends.GRAZES]
    return rotation_gradient(response, response.peak_time, response.peak_rotation, reason)


def rotation_gradient(response: Response, time: float, height: float, reason: str = _NO_REASON) -> Gradient:
    """Differentiate the height of the rotation at a time, unless there is a reason not to; as `gradient`."""
    trail, motion = trail_of(response), response.motion
    if trail.block["yielding"] or trail.block["facing"]:
        what = "a tendon that yields" if trail.block["yielding"] else "two stops"
        raise InvalidOption(
            f"no gradient is known of a body with {what}; `Response.sensitivity` tells how its peak changes with scales"
        )
    out = np.zeros((len(trail.ground.pieces), trail.ground.columns * trail.ground.stretches.shape[1]))
    by_start = np.zeros(2)
    reason = reason or _taken_back(trail, time, by_start, out)
    if reason and reason != _FROM_REST:
        by_start[:] = math.nan
        out[:] = math.nan
    horizontal, vertical = _by_components(motion, trail, response.body.gravity, out)
    sign = -1.0 if int(trail.nodes["side"][0]) == 1 else 1.0
    return Gradient(
        value=height,
        coefficients=horizontal,
        vertical=vertical,
        initial_rotation=float(sign * by_start[0]),
        initial_velocity=float(sign * by_start[1]),
        reason=reason,
        _motion=motion,
    )


def _taken_back(trail: Trail, peak_time: float, by_start: Floats, out: Floats) -> str:
    """Write derivatives by the state at the start and by pieces of the ground; returns why there are none."""
    nodes = trail.nodes
    starts_at_rest, begin = int(nodes["side"][0]) < 0, float(nodes["time"][0])
    moves = peak_time > begin  # else the start is the peak
    if moves or not starts_at_rest:
        by_start[0] = 1.0
    if moves:
        row = int(np.searchsorted(nodes["time"], peak_time)) - 1
        scratch, work = state.new_scratch(), state.record(state.VARIATION)
        ends = Ends(adjoint(trail, scratch, work, row, peak_time - float(nodes["time"][row]), by_start, out))
        if ends in _REASONS:
            return _REASONS[ends]
        if ends == Ends.REST or (starts_at_rest and nodes["time"][1] > begin):
            return _NO_REASON  # what comes to rest again before an uplift leaves nothing
    if starts_at_rest:
        by_start[:] = math.nan
    elif moves and nodes["u"][0] == 0.0:
        by_start[0] = math.nan
    return _FROM_REST if np.any(np.isnan(by_start)) else _NO_REASON


def _by_components(motion: Motion | None, trail: Trail, gravity: float, out: Floats) -> tuple[Floats, Floats | None]:
    """Return derivatives by the coefficients of both components, from those by the pieces that they have in common."""
    if motion is None:
        return np.zeros((0, 2)), None
    starts, columns = trail.ground.pieces[:-1, 0], trail.ground.columns
    horizontal = _by_own_pieces(motion, starts, out[:-1, :columns] / gravity)
    if motion.vertical is None:
        return horizontal, None
    return horizontal, _by_own_pieces(motion.vertical, starts, out[:-1, columns:] / gravity)


def _by_own_pieces(motion: Motion, starts: Floats, values: Floats) -> Floats:
    """Take derivatives by the coefficients of finer pieces to those of a motion's own: the transpose of `refined`."""
    within = starts < motion.duration
    starts, values = starts[within], values[within]
    piece = np.searchsorted(motion.breakpoints, starts, side="right") - 1
    shift = starts - motion.breakpoints[piece]
    columns = motion.coefficients.shape[1]
    found = np.zeros((len(motion.coefficients), columns))
    for j in range(columns):
        for i in range(j + 1):
            np.add.at(found[:, j], piece, math.comb(j, i) * shift ** (j - i) * values[:, i])
    return found


def _by_samples(motion: Motion | None, values: Floats) -> Floats:
    """Take derivatives by the coefficients of lines to those by the accelerations at their ends."""
    if motion is None or values.shape[1] != 2 or piecewise.jumps(motion):
        raise InvalidOption(
            "the motion is not linear between samples; take the derivatives by its pieces' `coefficients`, or make it "
            "of samples by `Motion.from_samples`"
        )
    rates = values[:, 1] / np.diff(motion.breakpoints)
    found = np.zeros(len(values) + 1)
    found[:-1] = values[:, 0] - rates
    found[1:] += rates
    return found
