"""Derivatives of a result of a response by the coefficients, and therefore the samples, of its motion."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Final, Literal, get_args

import numpy as np

from rocking.core import checks
from rocking.core.arrays import Floats
from rocking.errors import OptionError
from rocking.kernels import state
from rocking.kernels.adjoint import AdjointEnd, adjoint, differentiate_step_end
from rocking.kernels.march import march
from rocking.kernels.state import Structs
from rocking.kernels.trace import Trail, copy_trail
from rocking.motion import piecewise
from rocking.motion.motion import Motion
from rocking.response.history import find_event_steps, find_impact_steps
from rocking.response.response import Response
from rocking.response.sensitivity import require_sticking

#: Quantities that can be differentiated.
GradientTarget = Literal["peak", "rotation", "velocity", "event", "impact"]

#: Time before a rest, s, up to which impacts are followed. The remainder is of first order, and rounding smaller.
_REST_MARGIN: Final = 1e-5

_OVERTURNS: Final = "the block overturns, so its peak does not depend on small changes"
_AT_STOP: Final = "the body reaches its second stop, so its peak does not depend on small changes"
_UNFINISHED: Final = "the simulation was not finished, so its derivatives are unknown"
_FROM_REST: Final = "the response starts on the ground, where derivatives differ between the two sides"
_REASONS: Final = {
    AdjointEnd.GRAZES:
        "the block touches the ground without speed, so a slightly weaker motion causes no contact or an impact",
    AdjointEnd.LEAVES_AT_ONCE: "the block leaves the ground at the instant at which it comes to rest",
    AdjointEnd.TOUCHES_THRESHOLD:
        "the motion touches the uplift threshold, so a slightly weaker motion causes no uplift",
}  # fmt: skip


@dataclass(frozen=True, eq=False)
class Gradient:
    """Derivatives of a result of a response by its inputs, returned by `gradient`.

    Attributes
    ----------
    value : float
        The result: rotation (rad), angular velocity (rad/s) or time (s); for other bodies in units of the coordinate.
    coefficients : ndarray, shape (n, degree + 1)
        Derivatives by the coefficients of the n pieces of the motion: units of the value per m/s^2, per m/s^3, and so
        on; for a peak rad per m/s^2, for a time s per m/s^2. They are exactly zero for pieces before the last uplift
        preceding the result, or after the result.
    vertical : ndarray or None
        Derivatives by the coefficients of the vertical component.
    initial_rotation, initial_velocity : float
        Derivatives by the initial state: units of the value per rad, and per rad/s.
    reason : str
        Reason for NaN values, one sentence; empty if there are none.
    motion : Motion or None
        The motion.

    See Also
    --------
    rocking.gradient : Differentiate a result of a response.
    rocking.response.Sensitivity : Differentiate by relative changes of the inputs.

    Examples
    --------
    >>> import rocking
    >>> block = rocking.Block.from_parameters(p=2.0, alpha=0.2, restitution=0.9)
    >>> record = rocking.Motion.from_samples([0.0, 3.0, -4.0, 3.0, 0.0], 0.3)
    >>> gradient = rocking.gradient(rocking.simulate(block, record), "impact", 0)
    >>> f"{gradient.value:.4f} s", gradient.samples.round(4).tolist()
    ('0.5071 s', [0.021, 0.1668, 0.0212, 0.0, 0.0])
    """

    value: float
    coefficients: Floats
    vertical: Floats | None
    initial_rotation: float
    initial_velocity: float
    reason: str
    motion: Motion | None

    @property
    def samples(self) -> Floats:
        """Derivatives by the samples of a record, per m/s^2, shape (n + 1,): by the accelerations at breakpoints.

        Raises
        ------
        OptionError
            If the motion is not linear between samples.
        """
        return _convert_to_samples(self.motion, self.coefficients)

    @property
    def vertical_samples(self) -> Floats:
        """Derivatives by the samples of the vertical component.

        Raises
        ------
        OptionError
            If there is no vertical component, or it is not linear between samples.
        """
        if self.motion is None or self.motion.vertical is None or self.vertical is None:
            raise OptionError("the motion has no vertical component; add one by `with_vertical`")
        return _convert_to_samples(self.motion.vertical, self.vertical)

    def __repr__(self) -> str:
        if np.isnan(self.coefficients).any():
            return f"<Gradient: {self.reason}>"
        count = int(np.count_nonzero(np.any(self.coefficients != 0.0, axis=1)))
        text = f"{self.value:.6g} depends on {count} of {len(self.coefficients)} pieces of the motion"
        return f"<Gradient: {'; '.join(filter(None, [text, self.reason]))}>"


def gradient(response: Response, quantity: GradientTarget = "peak", time_or_index: float | None = None) -> Gradient:
    """Differentiate a result of a response by the samples of its motion and by the initial state.

    Parameters
    ----------
    response : Response
        Result of `simulate`, for a block or another body.
    quantity : {"peak", "rotation", "velocity", "event", "impact"}
        Differentiated quantity: the peak rotation (rad), the rotation (rad) or the angular velocity (rad/s) at a time,
        or the time (s) of an impact or an event (uplift, rest or overturning).
    time_or_index : float or int, optional
        Time, s, of a rotation or velocity (at an impact, just after it), or index of an event or impact in `events` or
        `impacts` (-1 is the last). Not used for a peak.

    Returns
    -------
    Gradient
        Derivatives by the coefficients of both components of the motion, by its samples, and by the initial state.

    Raises
    ------
    OptionError
        If the response is not a `Response`, the quantity does not exist, or `time_or_index` is missing, superfluous or
        out of range.

    See Also
    --------
    Response.sensitivity : Derivatives by relative changes of the inputs.

    Notes
    -----
    The gradient is the adjoint of `Response.sensitivity`, computed in one pass for any number of samples. The time of
    an uplift depends only on the motion near it, and not at all if the motion jumps past the threshold. The time of a
    rest includes impacts up to 0.01 ms before it, and the remainder to first order. Values are NaN without a
    derivative, see `Gradient.reason`.

    Examples
    --------
    >>> import rocking
    >>> block = rocking.Block.from_parameters(p=2.0, alpha=0.2, restitution=0.9)
    >>> record = rocking.Motion.from_samples([0.0, 3.0, -4.0, 3.0, 0.0], 0.3)
    >>> response = rocking.simulate(block, record)
    >>> [f"{value:.5f}" for value in rocking.gradient(response).samples]
    ['-0.00175', '-0.01310', '0.01048', '0.04288', '0.03351']
    """
    if not isinstance(response, Response):
        raise OptionError("{} must be a Response, as rocking.simulate returns", "response", value=response)
    require_sticking(response.slips)
    checks.choice(quantity, "quantity", OptionError, get_args(GradientTarget))
    if quantity == "peak":
        target = _target_peak(response, time_or_index)
    elif quantity in ("rotation", "velocity"):
        target = _target_state(response, quantity, time_or_index)
    else:
        target = _target_time(response, quantity, time_or_index)
    trail = response.solution.trail
    derivatives = np.zeros((len(trail.ground.pieces), trail.ground.coefficient_count * trail.ground.stretches.shape[1]))
    by_state = np.zeros(3)
    reason = _UNFINISHED if response.unfinished else target.reason
    if response.rounding_decisions and not reason and _has_ties_before(trail, target.instant):
        reason = _REASONS[AdjointEnd.GRAZES]
    reason = reason or _apply_adjoint(target, by_state, derivatives)
    if reason and reason != _FROM_REST:
        by_state[:] = derivatives[:] = math.nan
    horizontal, vertical = _split_components(response.motion, trail, response.block.gravity, derivatives)
    by_rotation, by_velocity = (_choose_sign(trail, 0) * by_state[:2]).tolist()
    return Gradient(target.value, horizontal, vertical, by_rotation, by_velocity, reason, response.motion)


@dataclass(frozen=True, eq=False)
class _Target:
    """Differentiated result: position in the steps, derivative by the state, and reason for a missing gradient.

    ``elapsed`` is the time after the node of ``row``. ``by_state`` is None for the time at which the step of this row
    ends. A height is the absolute value of a rotation.
    """

    value: float
    instant: float
    trail: Trail
    row: int = 0
    elapsed: float = 0.0
    by_state: tuple[float, float] | None = None
    reason: str = ""
    is_height: bool = False


def _target_peak(response: Response, time_or_index: float | None) -> _Target:
    if time_or_index is not None:
        raise OptionError('{} does not apply to a "peak"', "time_or_index", value=time_or_index)
    trail, value, instant = response.solution.trail, response.peak_rotation, response.peak_time
    reason = _OVERTURNS if response.overturned else _AT_STOP if response._reaches_second_stop else ""
    row = max(0, int(np.searchsorted(trail.nodes["time"], instant)) - 1)
    elapsed = instant - float(trail.nodes["time"][row])
    return _Target(value, instant, trail, row, elapsed, (1.0, 0.0), reason, is_height=True)


def _target_state(response: Response, quantity: GradientTarget, instant: float | None) -> _Target:
    """Create the target for the rotation or velocity at a time."""
    if instant is None:
        raise OptionError(f"a {quantity} requires {{}}, the time in s", "time_or_index")
    time = checks.between(instant, "time_or_index", OptionError, 0.0, response.duration, "s")
    column = int(quantity == "velocity")
    trail, motion_state = response.solution.trail, response._history.states(time)
    row = int(np.searchsorted(trail.nodes["time"], time, side="right")) - 1
    nodes = state.expose_fields(np.concatenate([trail.nodes[: row + 1], _find_later_nodes(response, row, time)]))
    trail, row = trail._replace(nodes=nodes), len(nodes) - 1
    sign = _choose_sign(trail, row) if np.any(motion_state) or time == 0.0 else 0.0
    elapsed = max(0.0, time - float(nodes["time"][row]))
    return _Target(float(motion_state[column]), time, trail, row, elapsed, (0.0, sign) if column else (sign, 0.0))


def _target_time(response: Response, quantity: GradientTarget, index: float | None) -> _Target:
    """Create the target for the time of an event or impact."""
    trail, is_event = response.solution.trail, quantity == "event"
    nodes, results = trail.nodes, response.events if is_event else response.impacts
    if not len(results):
        raise OptionError(f"the response has no {quantity}; choose another {{}}", "quantity", value=quantity)
    k = checks.integer(index, "time_or_index", OptionError, -len(results), len(results) - 1)
    rows = find_event_steps(nodes, overturns=response.overturned) if is_event else find_impact_steps(nodes)
    row, instant = int(rows[k]), float(results["time"][k])
    if row > 0 and nodes["side"][row + 1] < 0 and nodes["time"][row + 1] == nodes["time"][row]:
        row -= 1  # a rest at the instant of the impact
    elapsed = math.inf if nodes["side"][row] >= 0 and nodes["side"][row + 1] >= 0 else 0.0
    if nodes["side"][row] >= 0 and nodes["side"][row + 1] < 0:
        later = _find_later_nodes(response, row, instant - _REST_MARGIN)
        later = later[: int(np.max(np.flatnonzero(later["u"] == 0.0), initial=-1)) + 1]
        trail = trail._replace(nodes=state.expose_fields(np.concatenate([nodes[: row + 1], later, nodes[row + 1 :]])))
        row += len(later)
    return _Target(instant, instant, trail, row, elapsed)


def _find_later_nodes(response: Response, row: int, until: float) -> Structs:
    """Return the nodes after a row up to a time, including impacts after a proof."""
    nodes: Structs = response._history.trail.nodes
    later: Structs = nodes[(nodes["time"] > response.solution.trail.nodes["time"][row]) & (nodes["time"] <= until)]
    return later


def _has_ties_before(trail: Trail, instant: float) -> bool:
    """Return whether rounding determined a touch up to an instant, by integrating again."""
    settings, start = trail.settings.copy(), state.create_state_at_node(trail.nodes[0])
    settings["stop_time"], settings["no_end_time"], settings["writes_tables"] = (
        math.nextafter(instant, math.inf),
        False,
        False,
    )
    march(trail.ground, copy_trail(trail).block, settings, state.create_table(0), state.create_scratch(), start)
    return bool(start["rounding_decisions"] > 0)


def _apply_adjoint(target: _Target, by_state: Floats, derivatives: Floats) -> str:
    """Write derivatives by the initial state and by pieces of the motion; return the reason if there are none."""
    nodes, scratch = target.trail.nodes, state.create_scratch()
    starts_at_rest, start_time = int(nodes["side"][0]) < 0, float(nodes["time"][0])
    status = AdjointEnd.START
    if target.by_state is None:
        trail = copy_trail(target.trail)
        status = AdjointEnd(differentiate_step_end(trail, scratch, target.row, by_state, derivatives))
    else:
        by_state[:2] = target.by_state
        if not np.any(by_state) or (target.instant == start_time and not target.is_height):
            return ""  # at rest, or the initial state itself
    if status not in _REASONS and target.instant > start_time:
        trail, variation = copy_trail(target.trail), state.create_struct(state.VARIATION_DTYPE)
        status = AdjointEnd(adjoint(trail, scratch, variation, target.row, target.elapsed, by_state, derivatives))
        is_waiting = starts_at_rest and (len(nodes) == 1 or nodes["time"][1] > start_time)
        if status not in _REASONS and (status == AdjointEnd.REST or is_waiting):
            return ""  # a new rest before any uplift removes all dependence
        if not starts_at_rest and nodes["u"][0] == 0.0:
            by_state[0] = math.nan
    if status in _REASONS:
        return _REASONS[status]
    if starts_at_rest:
        by_state[:2] = math.nan
    return _FROM_REST if np.any(np.isnan(by_state)) else ""


def _choose_sign(trail: Trail, row: int) -> float:
    """Return the sign of a coordinate in the frame of the side at a node, or at rest."""
    return -1.0 if int(trail.nodes["side"][row]) == 1 else 1.0


def _split_components(
    motion: Motion | None, trail: Trail, gravity: float, derivatives: Floats
) -> tuple[Floats, Floats | None]:
    """Return derivatives by both components from derivatives by their common pieces."""
    if motion is None:
        return np.zeros((0, 2)), None
    starts, columns = trail.ground.pieces[:-1, 0], trail.ground.coefficient_count
    horizontal = _sum_over_pieces(motion, starts, derivatives[:-1, :columns] / gravity)
    if motion.vertical is None:
        return horizontal, None
    return horizontal, _sum_over_pieces(motion.vertical, starts, derivatives[:-1, columns:] / gravity)


def _sum_over_pieces(motion: Motion, starts: Floats, values: Floats) -> Floats:
    """Convert derivatives by finer pieces to the pieces of a motion: the transpose of a refinement."""
    within = starts < motion.duration
    starts, values = starts[within], values[within]
    piece = np.searchsorted(motion.breakpoints, starts, side="right") - 1
    shift = starts - motion.breakpoints[piece]
    columns = motion.coefficients.shape[1]
    sums = np.zeros((len(motion.coefficients), columns))
    for j in range(columns):
        for i in range(j + 1):
            np.add.at(sums[:, j], piece, math.comb(j, i) * shift ** (j - i) * values[:, i])
    return sums


def _convert_to_samples(motion: Motion | None, values: Floats) -> Floats:
    """Convert derivatives by the coefficients of lines to accelerations at their ends."""
    if motion is None or values.shape[1] != 2 or piecewise.has_jumps(motion):
        raise OptionError("the motion is not linear between samples; use the derivatives by its `coefficients`")
    rates = values[:, 1] / np.diff(motion.breakpoints)
    return np.asarray(np.append(values[:, 0] - rates, 0.0) + np.append(0.0, rates))
