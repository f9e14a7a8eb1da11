"""Maps of a body under periodic motion: from period to period, and from impact to impact, with their derivatives."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise
from typing import Final

import numpy as np
from numpy.typing import ArrayLike, NDArray

from rocking import checks
from rocking.arrays import Floats, Integers
from rocking.body import Body
from rocking.compiling import SIMULATIONS, announce
from rocking.constants import Model
from rocking.engine import cores, in_threads
from rocking.errors import InvalidMotion, InvalidOption
from rocking.kernels import state
from rocking.kernels.ground import Ground, ground_of
from rocking.kernels.periodic import Fate as Fate
from rocking.kernels.periodic import Setting, differentiate, iterate, step_rows, stretch, to_next_impact
from rocking.kernels.trace import NO_NODES, Trail
from rocking.motion.motion import Motion
from rocking.motion.named import one_motion
from rocking.problem import one_body, rules_of, set_start
from rocking.treatment import Treatment, VelocityThreshold, treatment

#: Ground acceleration, g, that lifts any body: it stands behind the second period.
_BEYOND_ALL: Final = 1e12

#: Rows of the table that a derivative uses again and again.
_ROWS: Final = 512

#: Threshold on a speed that none is below: an impact map closes no chattering.
_NO_SPEED: Final = 1e-300

#: States that a thread takes at once, so that an interrupt is seen soon.
_TOGETHER: Final = 256

#: A highest rotation that asks for none: below the one at which a body has fallen by no more than rounding.
_ALMOST: Final = 1.0 - 2.0**-40


class _Repeated:
    """A body under a motion that repeats for ever, as kernels take both."""

    def __init__(self, body: Body, motion: Motion, model: Model | None, chattering: str | Treatment) -> None:
        self.body, self.motion = one_body(body), _one_period(motion)
        self.bodies = self.body.alone()
        self.model: Model = model_of(self.body, model)
        self.treatment = treatment(chattering)
        self.period = float(self.motion.breakpoints[-1] - self.motion.breakpoints[0])
        limits = self.treatment.limits(self.bodies, self.motion, self.model)
        self._records = self.bodies.kernel_records(self.model, limits)
        self._ground = repeated(self.motion, self.body.gravity)
        rows = step_rows(self._ground, self._records[0])
        self._steps = rows if self.model == "linear" else rows[:, :0]

    def _rules(self, *, record: bool) -> state.Record:
        rules = rules_of(self.bodies, self.model, self.treatment, self.period, record=record)
        rules["stop"], rules["endless"] = np.inf, True
        return rules

    def _setting(self) -> Setting:
        return Setting(self._ground, self._records[0], self._rules(record=False), state.new_table(0), self._steps)

    def _states(self, states: ArrayLike) -> tuple[Floats, state.Records]:
        """States as given, flat, and as records."""
        given = checks.numbers(states, "states", InvalidOption)
        if given.ndim == 0 or given.shape[-1] != 2:
            raise InvalidOption(
                f"{{}} must hold pairs ({self.body.coordinate.name}, velocity) along the last axis, not have the shape "
                f"{given.shape}",
                "states",
            )
        flat = given.reshape(-1, 2)
        made = state.new_states(len(flat), 0)
        set_start(made, self._records, self.bodies, flat[:, 0], flat[:, 1])
        fallen = float(self._records["fallen"][0])
        made["peak"] = fallen if np.isinf(fallen) else fallen * _ALMOST
        return given, made

    def _coordinates(self, u: Floats, v: Floats, side: Integers) -> Floats:
        """Coordinates and velocities of states given in the frames of their sides."""
        at = np.where(side < 0, -1 - side, side)
        sign = 1.0 - 2.0 * at
        stops = np.array(self.body.stops)[at]
        found = np.stack([stops + sign * u, sign * v], axis=-1)
        found[side < 0] = np.stack([stops, np.zeros_like(stops)], axis=-1)[side < 0]
        return found + 0.0

    def _known(self, made: state.Records) -> Floats:
        """Coordinates and velocities of states; NaN of those that are not known."""
        found = self._coordinates(made["u"], made["v"], made["side"])
        found[np.isin(made["ending"], (Fate.OVERTURNED, Fate.UNFINISHED))] = np.nan
        return found

    def _signs(self, side: Integers) -> Floats:
        return np.where(side > 0, -1.0, 1.0)

    @property
    def _is_two_sided(self) -> bool:
        """Whether the coordinate passes zero, or there is a second stop."""
        record = self._records[0]
        return bool(record["facing"] or record["entered"][0] == 1)

    def _pairs_of_impacts(self, impacts: ArrayLike) -> Floats:
        given = checks.numbers(impacts, "impacts", InvalidOption)
        if given.ndim == 0 or given.shape[-1] != 2:
            raise InvalidOption("{} must hold pairs (phase in s, velocity) along the last axis", "impacts")
        return given

    def _after_impacts(self, flat: Floats) -> state.Records:
        record, made = self._records[0], state.new_states(len(flat), 0)
        phase = np.mod(flat[:, 0], self.period)
        starts = self._ground.pieces[: (len(self._ground.pieces) - 3) // 2, 0]
        made["piece"] = np.searchsorted(starts, phase, side="right") - 1
        made["offset"] = phase - starts[made["piece"]]
        made["side"] = np.where(self._directions(flat[:, 1]) < 0.0, 1, 0)
        made["v"] = np.abs(flat[:, 1])
        if np.any(flat[:, 1] == 0.0) or (not self._is_two_sided and np.any(flat[:, 1] < 0.0)):
            raise InvalidOption("every velocity in {} must lead away from the stop that was hit", "impacts")
        made["peak"] = record["fallen"] if np.isinf(record["fallen"]) else record["fallen"] * _ALMOST
        return made

    def _directions(self, velocity: Floats) -> Floats:
        return np.where(velocity < 0.0, -1.0, 1.0)


class StroboscopicMap(_Repeated):
    """Map of a state (coordinate, velocity) to that one period later, made by `stroboscopic_map`.

    Attributes
    ----------
    body, motion, model, treatment
        What is mapped, and how.
    period : float
        Period of the motion, s.
    """

    def __call__(self, states: ArrayLike, periods: int = 1) -> Floats:
        """Return states after some periods.

        Parameters
        ----------
        states : array_like, shape (..., 2)
            Coordinate and velocity at the start of a period: rad and rad/s of a block, m and m/s of other bodies.
        periods : int
            Number of periods.

        Returns
        -------
        ndarray, shape (..., 2)
            States at the end. At rest the velocity is exactly zero and the body at its stop. NaN where the body has
            overturned, or more steps were needed than any sensible motion takes.

        Raises
        ------
        InvalidOption
            If the states have another shape, or one is behind a stop.

        Examples
        --------
        A ball on a table that shakes gently comes to rest:

        >>> import rocking
        >>> from rocking import dynamics
        >>> ball, table = dynamics.BouncingBall(0.5), rocking.pulses.sine(5.0, 2.0, cycles=1)
        >>> dynamics.stroboscopic_map(ball, table)([[0.0, 0.0], [0.05, 0.1]], periods=5).tolist()
        [[0.0, 0.0], [0.0, 0.0]]
        """
        found, _, _ = self.followed(states, periods)
        return found

    def orbit(self, states: ArrayLike, periods: int) -> Floats:
        """Return states after 0, 1, ... periods.

        Parameters
        ----------
        states : array_like, shape (..., 2)
            As for the map.
        periods : int
            Number of periods.

        Returns
        -------
        ndarray, shape (..., periods + 1, 2)
            States; NaN from the period on in which the body overturns.

        Examples
        --------
        >>> import rocking
        >>> from rocking import dynamics
        >>> ball, table = dynamics.BouncingBall(0.5), rocking.pulses.sine(5.0, 2.0, cycles=1)
        >>> dynamics.stroboscopic_map(ball, table).orbit([0.05, 0.1], 5).shape
        (6, 2)
        """
        given, made = self._states(states)
        count = checks.whole(periods, "periods", InvalidOption, least=1)
        rows = np.full((len(made), count, 3), np.nan)
        self._iterate(made, count, rows)
        known = ~np.isnan(rows[..., 0])
        found = self._coordinates(rows[..., 0], rows[..., 1], np.where(known, rows[..., 2], 0.0).astype(np.int64))
        whole = np.concatenate([given.reshape(-1, 1, 2), found], axis=1)
        return whole.reshape(*given.shape[:-1], count + 1, 2)

    def followed(self, states: ArrayLike, periods: int = 1) -> tuple[Floats, NDArray[np.int64], NDArray[np.int64]]:
        """Return states after some periods, with what they are and how many impacts there were.

        Parameters
        ----------
        states : array_like, shape (..., 2)
            As for the map.
        periods : int
            Number of periods.

        Returns
        -------
        states : ndarray, shape (..., 2)
            As of the map.
        fates : ndarray, shape (...)
            What each is: a `Fate`.
        impacts : ndarray, shape (...)
            Impacts that were resolved on the way.

        Examples
        --------
        >>> import rocking
        >>> from rocking import dynamics
        >>> ball, table = dynamics.BouncingBall(0.5), rocking.pulses.sine(5.0, 2.0, cycles=1)
        >>> _, fates, impacts = dynamics.stroboscopic_map(ball, table).followed([0.05, 0.1], periods=5)
        >>> dynamics.Fate(fates).name, int(impacts) > 5
        ('RESTS_FOR_EVER', True)
        """
        given, made = self._states(states)
        shape = given.shape[:-1]
        self._iterate(made, checks.whole(periods, "periods", InvalidOption, least=1), np.empty((len(made), 0, 3)))
        return (
            self._known(made).reshape(given.shape),
            np.array(made["ending"]).reshape(shape),
            np.array(made["impacts"]).reshape(shape),
        )

    def derivative(self, states: ArrayLike, periods: int = 1) -> tuple[Floats, Floats]:
        """Return states after some periods and their derivatives by the states before.

        Parameters
        ----------
        states : array_like, shape (..., 2)
            As for the map.
        periods : int
            Number of periods.

        Returns
        -------
        states : ndarray, shape (..., 2)
            As of the map.
        derivatives : ndarray, shape (..., 2, 2)
            Exactly zero where the body comes to rest on the way: it has forgotten how it began. NaN where it overturns;
            infinite at an impact of no speed (a grazing one).

        Notes
        -----
        Through an arc the variational equation is solved by the same series as the arc; through an impact by its
        saltation matrix, which includes the shift of the impact in time.

        Examples
        --------
        >>> import rocking
        >>> from rocking import dynamics
        >>> ball = dynamics.BouncingBall(0.5, gravity=10.0)
        >>> table = rocking.pulses.sine(15.0, 5.0, cycles=1)
        >>> _, change = dynamics.stroboscopic_map(ball, table).derivative([0.1, 0.5])
        >>> f"{np.linalg.det(change):.12f}"
        '0.250000000000'
        """
        given, made = self._states(states)
        total = np.broadcast_to(np.eye(2), (len(made), 2, 2)).copy()
        ended = np.zeros(len(made), dtype=np.int64)
        for _ in range(checks.whole(periods, "periods", InvalidOption, least=1)):
            signs, before = self._signs(made["side"]), made.copy()
            self._iterate(made, 1, np.empty((len(made), 0, 3)))
            change = self._differentiate(state.attributed(before))
            ended = np.maximum(ended, np.isin(made["ending"], (Fate.OVERTURNED, Fate.UNFINISHED)))
            total = (signs * self._signs(made["side"]))[:, None, None] * change @ total
        found = self._coordinates(made["u"], made["v"], made["side"])
        found[ended > 0] = total[ended > 0] = np.nan
        return found.reshape(given.shape), total.reshape(*given.shape, 2)

    def from_impacts(self, impacts: ArrayLike) -> Floats:
        """Return the states at the end of the period in which bodies leave impacts.

        Parameters
        ----------
        impacts : array_like, shape (..., 2)
            Time since the start of the period, s, and velocity just after the impact, as for an `ImpactMap`.

        Returns
        -------
        ndarray, shape (..., 2)
            States at the start of the next period; NaN where the body overturns before.

        Raises
        ------
        InvalidOption
            If the impacts have another shape, or a velocity does not lead away from its stop.

        Examples
        --------
        >>> import rocking
        >>> from rocking import dynamics
        >>> ball, table = dynamics.BouncingBall(0.5, gravity=10.0), rocking.pulses.sine(15.0, 5.0, cycles=1)
        >>> dynamics.stroboscopic_map(ball, table).from_impacts([0.05, 1.0]).shape
        (2,)
        """
        given = self._pairs_of_impacts(impacts)
        made = self._after_impacts(given.reshape(-1, 2))
        self._iterate(made, 1, np.empty((len(made), 0, 3)))
        return self._known(made).reshape(given.shape)

    def _iterate(self, made: state.Records, periods: int, rows: Floats) -> None:
        announce(SIMULATIONS)
        setting = self._setting()
        impacts = np.zeros(len(made), dtype=np.int64)

        def follow(part: slice) -> None:
            iterate(setting, state.new_scratch(), made[part], periods, rows[part], impacts[part])

        for _ in in_threads(follow, parts_of(len(made)), threads=cores()):
            pass

    def _differentiate(self, made: state.Records) -> Floats:
        announce(SIMULATIONS)
        trail = Trail(self._ground, self._records[0], self._rules(record=True), NO_NODES)
        change = np.empty((len(made), 2, 2))
        differentiate(trail, state.new_scratch(), state.record(state.VARIATION), state.new_table(_ROWS), made, change)
        return change

    def _stretches(self, given: Floats, before: int, count: int) -> tuple[Floats, int, Fate]:
        """Logarithms of the stretches of a frame in each of some periods, after others; impacts in them; the fate."""
        _, made = self._states(given[None])
        announce(SIMULATIONS)
        trail = Trail(self._ground, self._records[0], self._rules(record=True), NO_NODES)
        space = state.new_scratch(), state.record(state.VARIATION), state.new_table(_ROWS)
        frame = np.array([[0.0, 0.0], [0.0, 0.0], [1.0, 0.0]])
        logs, impacts = np.full((before + count, 2), np.nan), 0
        edges = sorted({*range(0, before + count, _TOGETHER), before, before + count})
        for start, stop in pairwise(edges):
            here = stretch(trail, *space, made[0], frame, logs[start:stop])
            impacts += here if start >= before else 0
            if made["ending"][0] not in (Fate.MOVES, Fate.RESTS):
                break
        fate = Fate(int(made["ending"][0]))
        if fate == Fate.RESTS_FOR_EVER:
            logs[np.isnan(logs)] = -np.inf
        return logs[before:], impacts, fate


class ImpactMap(_Repeated):
    """Map of an impact (phase, velocity after it) to the next one, made by `impact_map`."""

    def __call__(self, impacts: ArrayLike) -> Floats:
        """Return the next impacts.

        Parameters
        ----------
        impacts : array_like, shape (..., 2)
            Time of an impact since the start of the period, s, and velocity after it: of a block its sign is the side
            that is entered; between two stops it leads away from the stop that was hit.

        Returns
        -------
        ndarray, shape (..., 2)
            The next ones, with times within the period; NaN where the body rests or overturns first.

        Examples
        --------
        >>> import rocking
        >>> from rocking import dynamics
        >>> ball, table = dynamics.BouncingBall(0.5, gravity=10.0), rocking.pulses.sine(15.0, 5.0, cycles=1)
        >>> dynamics.impact_map(ball, table)([0.05, 1.0]).round(12).tolist()
        [0.05, 0.5]
        """
        found, _ = self.derivative(impacts)
        return found

    def derivative(self, impacts: ArrayLike) -> tuple[Floats, Floats]:
        """Return the next impacts and their derivatives by the impacts before.

        Parameters
        ----------
        impacts : array_like, shape (..., 2)
            As for the map.

        Returns
        -------
        impacts : ndarray, shape (..., 2)
            As of the map.
        derivatives : ndarray, shape (..., 2, 2)
            NaN where there is no next impact.

        Examples
        --------
        >>> import rocking
        >>> from rocking import dynamics
        >>> ball, table = dynamics.BouncingBall(0.5, gravity=10.0), rocking.pulses.sine(15.0, 5.0, cycles=1)
        >>> _, change = dynamics.impact_map(ball, table).derivative([0.05, 1.0])
        >>> change.shape
        (2, 2)
        """
        given = self._pairs_of_impacts(impacts)
        flat = given.reshape(-1, 2)
        made = self._after_impacts(flat)
        start = self._rates(made)
        trail = Trail(self._ground, self._records[0], self._rules(record=True), NO_NODES)
        change = np.empty((len(made), 2, 2))
        to_next_impact(trail, state.new_scratch(), state.record(state.VARIATION), state.new_table(_ROWS), made, change)
        end = self._rates(made)
        lost = made["ending"] != Fate.MOVES
        times = self._ground.pieces[made["piece"], 0] + made["offset"]
        found = np.stack([times, self._velocities(made)], axis=-1)
        # At fixed times a later impact is (-v, -v') off; the shift of the next one is read off in the same way.
        zeros = np.zeros(len(made))
        before = np.array([[-start[:, 0], zeros], [-start[:, 1], np.ones(len(made))]]).transpose(2, 0, 1)
        with np.errstate(divide="ignore", invalid="ignore"):
            after = np.array([[-1.0 / end[:, 0], zeros], [-end[:, 1] / end[:, 0], np.ones(len(made))]])
            total = after.transpose(2, 0, 1) @ change @ before
        signs = np.stack([np.ones(len(made)), self._directions(flat[:, 1])], axis=-1)
        ends = np.stack([np.ones(len(made)), self._signs(made["side"])], axis=-1)
        total *= ends[:, :, None] * signs[:, None, :]
        found[lost] = total[lost] = np.nan
        return found.reshape(given.shape), total.reshape(*given.shape, 2)

    def _velocities(self, made: state.Records) -> Floats:
        velocities: Floats = self._signs(made["side"]) * made["v"]
        return velocities

    def _rates(self, made: state.Records) -> Floats:
        """Velocity and acceleration just after impacts, in the frames of their sides, shape (n, 2)."""
        record = self._records[0]
        side = np.maximum(made["side"], 0)
        pieces = self._ground.pieces[made["piece"]]
        push = np.zeros(len(made))
        for column in pieces[:, :1:-1].T:
            push = push * made["offset"] + column
        sign = np.where(side > 0, -1.0, 1.0)
        restoring = record["gain"][side] * (record["threshold"][side] + sign * push)
        return np.stack([made["v"], -restoring - record["damping"] * made["v"]], axis=-1)


def stroboscopic_map(
    body: Body, motion: Motion, *, model: Model | None = None, chattering: str | Treatment = "certified"
) -> StroboscopicMap:
    """Map of a body under periodic motion from the start of one period to that of the next, exact and vectorised.

    Parameters
    ----------
    body : Block, or a body of `rocking.dynamics`
        What moves.
    motion : Motion
        One period, which repeats for ever: as ``pulses.sine(a, f, cycles=1)``.
    model : {"nonlinear", "linear"}, optional
        Equation of motion; by default nonlinear of a block.
    chattering : str or treatment
        As for `rocking.simulate`.

    Returns
    -------
    StroboscopicMap
        A function of states.

    Raises
    ------
    InvalidMotion
        If the motion is none, or has no length.
    InvalidOption
        If the model is not one of the body's.

    Notes
    -----
    Every impact is located, and chattering is closed by proof, as by `rocking.simulate`: the same kernels march.

    Examples
    --------
    >>> import rocking
    >>> from rocking import dynamics
    >>> block = rocking.Block.from_parameters(p=1.0, alpha=0.2, restitution=0.8)
    >>> shaking = rocking.pulses.sine(6.0, 0.8, cycles=1)
    >>> rock = dynamics.stroboscopic_map(block, shaking, model="linear")
    >>> rock([0.05, 0.0]).round(6).tolist()
    [-0.085002, 0.087054]
    """
    return StroboscopicMap(body, motion, model, chattering)


def impact_map(body: Body, motion: Motion, *, model: Model | None = None) -> ImpactMap:
    """Map of a body under periodic motion from just after one impact to just after the next.

    Parameters
    ----------
    body : Block, or a body of `rocking.dynamics`
        What moves.
    motion : Motion
        One period, which repeats for ever.
    model : {"nonlinear", "linear"}, optional
        As for `stroboscopic_map`.

    Returns
    -------
    ImpactMap
        A function of impacts (phase in s, velocity after).

    Raises
    ------
    InvalidMotion
        If the motion is none, or has no length.
    InvalidOption
        If the model is not one of the body's.

    Examples
    --------
    >>> import rocking
    >>> from rocking import dynamics
    >>> ball, table = dynamics.BouncingBall(0.5, gravity=10.0), rocking.pulses.sine(15.0, 5.0, cycles=1)
    >>> dynamics.impact_map(ball, table)([[0.05, 1.0], [0.1, 0.8]]).shape
    (2, 2)
    """
    return ImpactMap(body, motion, model, VelocityThreshold(_NO_SPEED))


def model_of(body: Body, model: Model | None) -> Model:
    """Return the model asked for; by default the nonlinear one, or the only one of a body."""
    from rocking.block import Block

    return model if model is not None else ("nonlinear" if isinstance(body, Block) else "linear")


def repeated(motion: Motion, gravity: float, sign: float = 1.0) -> Ground:
    """Ground of a motion that repeats for ever, with this sign: twice, and behind that what lifts any body."""
    breaks = motion.breakpoints - motion.breakpoints[0]
    period, columns = breaks[-1], motion.coefficients.shape[1]
    beyond = np.zeros((2, columns))
    beyond[:, 0] = _BEYOND_ALL * gravity, -_BEYOND_ALL * gravity
    breakpoints = np.concatenate([breaks, period + breaks[1:], [3.0 * period, 4.0 * period]])
    coefficients = np.concatenate([motion.coefficients, sign * motion.coefficients, beyond])
    breakpoints.flags.writeable = coefficients.flags.writeable = False  # as a motion's: a kernel is compiled for these
    return ground_of(breakpoints, coefficients, 1.0 / gravity, motion.error)


def parts_of(count: int) -> Sequence[slice]:
    """Ranges of states for one call of a kernel each."""
    return [slice(start, min(start + _TOGETHER, count)) for start in range(0, count, _TOGETHER)]


def _one_period(motion: Motion) -> Motion:
    given = one_motion(motion)
    if given is None:
        raise InvalidMotion("one period of the motion is needed, as rocking.pulses.sine(a, f, cycles=1), not None")
    if given.vertical is not None:
        raise InvalidMotion("maps are made for one component; give a motion without a vertical one")
    return given
