"""Sensitivity of a response to its inputs, and to one unit in their last place."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from functools import cached_property
from typing import Final

import numpy as np
from numpy.typing import ArrayLike, NDArray

from rocking.core import checks
from rocking.core.arrays import Flags, Floats
from rocking.core.tables import format_count
from rocking.errors import OptionError
from rocking.kernels import state
from rocking.kernels.adjoint import AdjointEnd, adjoint, differentiate_step_end
from rocking.kernels.trace import Quantity, Trail, compute_variation, copy_trail
from rocking.kernels.uplift import write_next_uplifts
from rocking.response.history import TimeHistory
from rocking.response.perturbed import Repeat

#: A response is ambiguous if changes of its inputs by one unit in the last place change its peak by more than this
#: fraction, or the time of an event or impact by more than this number of seconds.
VISIBLE_CHANGE: Final = 1e-6

#: Inputs of a sensitivity.
QUANTITIES: Final = ("motion", "initial_rotation", "initial_velocity", "p", "alpha", "restitution")

#: Inputs for derivatives of a rotation, in the order of the kernels.
_INPUTS: Final = (*QUANTITIES, *(f"{name}_{side}" for side in ("plus", "minus") for name in QUANTITIES[3:]))

#: Field of a node that contains the initial state, by input.
_START_FIELDS: Final[dict[int, str]] = {Quantity.ROTATION: "u", Quantity.VELOCITY: "v"}

_ULP: Final = 2.0**-52

#: Relative distance from a threshold within which a motion may or may not exceed it.
NEAR_TIE: Final = 2.0**-44

#: Largest product of an error and the rates of balance and impacts for which its first order is used as a bound.
_MAX_NONLINEARITY: Final = 0.5

#: Changes of peak, impacts and events, in rows for several inputs.
Changes = tuple[Floats, Floats, Floats]


class Sensitivity:
    """Derivatives of a response by relative changes of its inputs, from `Response.sensitivity`.

    The results are structured arrays with the fields motion, initial_rotation, initial_velocity, p, alpha and
    restitution (the latter three for both sides), computed on first access. A field times 1e-3 is the change for
    0.1 % more of this input, to first order. All values are NaN if the simulation is unfinished.

    See Also
    --------
    rocking.gradient : Derivatives by each sample of the motion.

    Examples
    --------
    >>> import rocking
    >>> block = rocking.Block(width=0.4, height=2.0)
    >>> response = rocking.simulate(block, rocking.pulses.one_sine(amplitude=3.0, frequency=2.0))
    >>> f"{response.sensitivity.peak['motion'][0]:.3f} rad"
    '0.237 rad'
    """

    def __init__(
        self,
        trail: Trail,
        history: TimeHistory,
        peak_time: float,
        sizes: tuple[int, int],
        *,
        is_fixed: bool,
        is_known: bool,
    ) -> None:
        self._trail, self._history, self._sizes = trail, history, sizes
        self._peak_time = np.array([peak_time])
        self._peak_time.flags.writeable = False
        self._is_peak_fixed, self._is_known = is_fixed, is_known

    @cached_property
    def peak(self) -> NDArray[np.void]:
        """Derivatives of the peak rotation, rad, shape (1,); 0 if overturned."""
        return self._create_table(0)

    @cached_property
    def impacts(self) -> NDArray[np.void]:
        """Derivatives of the times of impacts, s."""
        return self._create_table(1)

    @cached_property
    def events(self) -> NDArray[np.void]:
        """Derivatives of the times of events, s."""
        return self._create_table(2)

    def _create_table(self, index: int) -> NDArray[np.void]:
        """Return changes of peak, impacts or events, with a field for each input."""
        values = self._changes[index]
        table = np.empty(values.shape[1], dtype=[(name, "f8") for name in QUANTITIES])
        for name, row in zip(QUANTITIES, values, strict=True):
            table[name] = row if self._is_known else np.nan
        return table

    @cached_property
    def _changes(self) -> Changes:
        return self._compute_changes(QUANTITIES)

    def _compute_changes(self, names: Iterable[str]) -> Changes:
        """Return changes of peak, impacts and events, in a row for each name, computed in one pass per name."""
        rows = [_vary_input(self._trail, _INPUTS.index(name), self._peak_time, *self._sizes) for name in names]
        peak, impacts, events = (np.array(values) for values in zip(*rows, strict=True))
        return np.zeros_like(peak) if self._is_peak_fixed else peak, impacts, events

    def rotation(self, time: ArrayLike, inputs: Iterable[str] = QUANTITIES) -> dict[str, Floats]:
        """Return the derivative of the rotation at given times by each input.

        Parameters
        ----------
        time : array_like
            Times, s, of any shape.
        inputs : iterable of str
            Inputs: "motion", "initial_rotation", "initial_velocity", "p", "alpha" or "restitution". The last three
            accept the suffix "_plus" or "_minus" for a single side.

        Returns
        -------
        dict of str to ndarray
            For each input and time: rad (or the unit of the coordinate) per unit of relative change, with the sign of
            the rotation. Zero at rest, at an impact just before it, NaN outside the response and for unfinished
            simulations.

        Notes
        -----
        Each input requires one pass along the response, for any number of times. At a fixed time the rotation is
        continuous, and its derivative jumps at each impact (see "Impacts: restitution and sensitivity" in the
        documentation).
        """
        changes = compute_changes(self._history, time, inputs)
        return changes if self._is_known else {name: np.full_like(values, np.nan) for name, values in changes.items()}

    def __repr__(self) -> str:
        peak, event = 1e-3 * self.peak["motion"][0], 1e-3 * np.max(np.abs(self.events["motion"]), initial=0.0)
        events, impacts = format_count(len(self.events), "event"), format_count(len(self.impacts), "impact")
        changes = f"changes the peak by {peak:.2g} rad and the times of {events} by up to {event:.2g} s"
        return f"<Sensitivity: 0.1 % more of the motion {changes}; {impacts}>"


def _vary_input(trail: Trail, quantity: int, times: Floats, impacts: int, events: int) -> Changes:
    """Compute derivatives by an input: of heights at given times, and of the times of impacts and events."""
    heights, impact_changes, event_changes = np.zeros(len(times)), np.zeros(impacts), np.zeros(events)
    start = _START_FIELDS.get(quantity)
    if start is None or trail.nodes[start][0] != 0.0:  # a share of zero has no effect
        scratch, variation = state.create_scratch(), state.create_struct(state.VARIATION_DTYPE)
        compute_variation(
            copy_trail(trail), scratch, variation, quantity, times, heights, impact_changes, event_changes
        )
    return heights, impact_changes, event_changes


def find_ambiguities(changes: Sensitivity, trail: Trail, height: float, rounding_decisions: int) -> tuple[str, ...]:
    """Return the results ("peak", "events", "touch") that one unit in the last place of all inputs changes visibly.

    ``height`` is the height of the peak above the stop, and ``rounding_decisions`` the known number of ties.
    """
    early, late = (_compute_uplifts(trail, share) for share in (1.0 - NEAR_TIE, 1.0 + NEAR_TIE))
    rounding_decisions += int(np.any(late > early + VISIBLE_CHANGE))
    peak, *times = (_ULP * np.sum(np.abs(rows), axis=0) for rows in changes._changes)
    is_peak_clear = np.all(peak <= VISIBLE_CHANGE * max(height, 1e-300))
    is_clear = (is_peak_clear, np.all(np.concatenate(times) <= VISIBLE_CHANGE), rounding_decisions == 0)
    return tuple(name for name, clear in zip(("peak", "events", "touch"), is_clear, strict=True) if not clear)


def find_slip_ambiguities(repeats: Sequence[Repeat], rounding_decisions: int) -> tuple[str, ...]:
    """Return the results of `find_ambiguities` for a response that slips, from simulations with factors 1 +- NEAR_TIE.

    "touch" includes a mode of motion longer than `VISIBLE_CHANGE` that does not occur for all factors.
    """
    share = _ULP / NEAR_TIE
    peaks, modes = [repeat.peak for repeat in repeats], [_list_modes(repeat.events) for repeat in repeats]
    is_same = len({repeat.outcome for repeat in repeats}) == 1 == len({tuple(names) for names, _ in modes})
    spread = np.max(np.ptp([times for _, times in modes], axis=0), initial=0.0) if is_same else 0.0
    is_peak_clear = share * np.ptp(peaks) <= VISIBLE_CHANGE * max(peaks)
    is_clear = (is_peak_clear, share * spread <= VISIBLE_CHANGE, is_same and rounding_decisions == 0)
    return tuple(name for name, clear in zip(("peak", "events", "touch"), is_clear, strict=True) if not clear)


def _list_modes(events: NDArray[np.void]) -> tuple[list[tuple[str, int]], Floats]:
    """Return kind and side of the events that start a mode longer than `VISIBLE_CHANGE`, and their times, s."""
    lasting = np.append(np.diff(events["time"]) > VISIBLE_CHANGE, True)
    names = [(str(event["kind"]), int(event["side"])) for event in events[lasting]]
    is_new = np.array([k == 0 or names[k] != names[k - 1] for k in range(len(names))])
    return [name for name, new in zip(names, is_new, strict=True) if new], events["time"][
        np.append(True, lasting[:-1])
    ][is_new]


def _compute_uplifts(trail: Trail, factor: float) -> Floats:
    """Return times of the next uplifts from all rests, with thresholds scaled by a factor."""
    block, times = trail.block.copy(), np.zeros(len(trail.nodes))
    block["threshold"] *= factor
    block["restraint_threshold"] *= factor
    write_next_uplifts(trail._replace(block=block), state.create_scratch(), times)
    return times


def bound_rest_errors(trail: Trail, proven: Flags, stop: float) -> Floats:
    """Bound the changes of times of rest by rounding before their proofs, s; infinite if there is no bound.

    ``proven``: which rests are proven; ``stop``: absolute coordinate at which the body stands.
    """
    nodes = state.expose_fields(np.append(trail.nodes, trail.nodes[-1:]))
    nodes["side"][-1] = state.AT_REST
    trail = copy_trail(trail._replace(nodes=nodes))
    scratch, variation = state.create_scratch(), state.create_struct(state.VARIATION_DTYPE)
    fastest, out = np.sqrt(np.max(np.abs(trail.block["stiffness"]))), np.zeros_like(trail.ground.pieces[:, 2:])
    last, errors = (np.flatnonzero((nodes["side"][:-1] >= 0) & (nodes["side"][1:] < 0)), np.full(len(proven), np.inf))
    for k in np.flatnonzero(proven):
        node, following, change = nodes[last[k]], nodes[last[k] + 1], np.zeros(5)
        row, time = (last[k], 0.0) if node["v"] > 0.0 else (last[k] - 1, math.inf)
        if differentiate_step_end(trail, scratch, row, change, out) != AdjointEnd.START:
            continue
        if node["v"] > 0.0:  # derivatives deviate from first order at least twice as much as the time to rest
            change[:3] *= 1.0 + 4.0 * abs((following["time"] - node["time"]) / (change[1] * node["v"]) - 1.0)
        status = adjoint(trail, scratch, variation, row, time, change, out)
        error = change[3] + 4.0 * _ULP * stop * abs(change[0])
        nonlinear = error * max(fastest, change[4])
        if status in (AdjointEnd.START, AdjointEnd.REST) and nonlinear <= _MAX_NONLINEARITY:
            errors[k] = error / (1.0 - nonlinear)
    return errors


def compute_changes(history: TimeHistory, time: ArrayLike, inputs: Iterable[str]) -> dict[str, Floats]:
    """Compute the derivative of the coordinate at times of any shape by each input, see `Sensitivity.rotation`."""
    times, nodes = checks.numbers(time, "time", OptionError), history.trail.nodes
    flat = times.ravel()
    order = np.argsort(flat, kind="stable")
    order = order[~history.is_outside(flat[order])]
    ascending = flat[order]
    ascending.flags.writeable = False
    rows = np.maximum(np.searchsorted(nodes["time"], ascending) - 1, 0)
    signs = np.where(nodes["side"][rows] == 1, -1.0, 1.0)
    rests = nodes["side"] < 0
    events = int(np.count_nonzero(rests[:-1] | rests[1:]))
    changes = {}
    for name in inputs:
        if name not in _INPUTS:
            raise OptionError(f"{{}} must be among {', '.join(_INPUTS)}, not {name!r}", "inputs", value=name)
        values = np.full(flat.shape, np.nan)
        values[order] = signs * _vary_input(history.trail, _INPUTS.index(name), ascending, len(nodes), events)[0]
        changes[name] = values.reshape(times.shape)
    return changes


def require_sticking(slips: bool) -> None:
    """Raise `OptionError` if the base slips, because derivatives through slip are not available."""
    if slips:
        raise OptionError(
            "derivatives are not available for a response that slips; use response.perturbed() or omit {}", "friction"
        )
