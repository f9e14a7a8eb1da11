"""Maps of a body under periodic motion, with their derivatives: from period to period, and from impact to impact."""

from __future__ import annotations

from typing import Final

import numpy as np
from numpy.typing import ArrayLike, NDArray

from rocking.block.body import Body
from rocking.core import checks
from rocking.core.arrays import Flags, Floats
from rocking.core.constants import Model
from rocking.core.threads import cores, in_threads
from rocking.dynamics.forcing import PeriodicForcing, parts_of, repeated
from rocking.engine.treatment import Treatment, VelocityThreshold
from rocking.errors import InvalidOption
from rocking.kernels import state
from rocking.kernels.periodic import TRAP, differentiate, iterate, to_next_impact
from rocking.kernels.periodic import Fate as Fate
from rocking.motion.motion import Motion

#: Fields of a body's record that are a side's own.
_OF_SIDES: Final = (
    "stiffness", "threshold_slope", "threshold", "slenderness", "restitution", "min_restitution", "restitution_slope",
    "restraint_threshold", "added_weight",
    "added_push", "prestress", "spring", "damping",
)  # fmt: skip


class StroboscopicMap(PeriodicForcing):
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
        """
        found, _, _ = self.followed(states, periods)
        return found

    def orbit(self, states: ArrayLike, periods: int) -> Floats:
        """Return states after 0, 1, ... periods, shape (..., periods + 1, 2); otherwise as the map."""
        given, made = self._states(states)
        count = checks.whole(periods, "periods", InvalidOption, least=1)
        rows = np.full((len(made), count, 3), np.nan)
        self._iterate(made, count, rows)
        known = ~np.isnan(rows[..., 0])
        found = self._coordinates(rows[..., 0], rows[..., 1], np.where(known, rows[..., 2], 0.0).astype(np.int64))
        whole = np.concatenate([given.reshape(-1, 1, 2), found], axis=1)
        return whole.reshape(*given.shape[:-1], count + 1, 2)

    def followed(self, states: ArrayLike, periods: int = 1) -> tuple[Floats, NDArray[np.int64], NDArray[np.int64]]:
        """Return states after some periods as the map does, the `Fate` of each, and the numbers of impacts resolved."""
        given, made = self._states(states)
        self._iterate(made, checks.whole(periods, "periods", InvalidOption, least=1))
        fates, impacts = (np.array(made[name]).reshape(given.shape[:-1]) for name in ("ending", "impacts"))
        return self._known(made).reshape(given.shape), fates, impacts

    def derivative(self, states: ArrayLike, periods: int = 1) -> tuple[Floats, Floats]:
        """Return states after some periods as the map does, and their derivatives by the states before, (..., 2, 2).

        Derivatives are exactly zero where the body comes to rest on the way, or is held at rest at the start. On a stop
        that does not hold it, they are those of the states in front of the stop. NaN where it overturns; infinite at a
        grazing impact. An arc contributes the solution of its variational equation, an impact its saltation matrix.
        """
        given, made = self._states(states)
        total = np.broadcast_to(np.eye(2), (len(made), 2, 2)).copy()
        change, ended = np.empty_like(total), np.zeros(len(made), dtype=np.bool_)
        for _ in range(checks.whole(periods, "periods", InvalidOption, least=1)):
            signs, before = _signs(made["side"]), made.copy()
            self._iterate(made)
            differentiate(*self._marching(), state.attributed(before), change)
            ended |= np.isin(made["ending"], (Fate.OVERTURNED, Fate.UNFINISHED))
            total = (signs * _signs(made["side"]))[:, None, None] * change @ total
        found = self._coordinates(made["u"], made["v"], made["side"])
        found[ended] = total[ended] = np.nan
        return found.reshape(given.shape), total.reshape(*given.shape, 2)

    def from_impacts(self, impacts: ArrayLike) -> Floats:
        """Return the states at the end of the period in which bodies leave impacts, given as for an `ImpactMap`.

        NaN where the body overturns before. `InvalidOption` if the impacts have another shape, or a velocity does not
        lead away from its stop.
        """
        given = self._pairs(impacts, "impacts", "phase in s")
        made = self._after_impacts(given.reshape(-1, 2))
        self._iterate(made)
        return self._known(made).reshape(given.shape)

    def _iterate(self, made: state.Records, periods: int = 1, rows: Floats | None = None) -> None:
        setting = self._setting()
        orbits = np.empty((len(made), 0, 3)) if rows is None else rows
        traps, counts = np.empty((0, TRAP)), np.zeros((2, len(made)), dtype=np.int64)

        def follow(part: slice) -> None:
            found, taken = counts[:, part]
            iterate(setting, state.new_scratch(), made[part], periods, orbits[part], traps, found, taken)

        for _ in in_threads(follow, parts_of(len(made), periods), threads=cores()):
            pass


class HalfMap(StroboscopicMap):
    """Map of a mirrored body under an antisymmetric motion to the mirror image of its state half a period later."""

    def __init__(self, strobe: StroboscopicMap) -> None:
        super().__init__(strobe.body, strobe.motion, strobe.model, strobe.treatment)
        motion = strobe.motion
        middle = int(np.argmin(np.abs(motion.breakpoints - 0.5 * motion.duration)))
        half = Motion(motion.breakpoints[: middle + 1], motion.coefficients[:middle], error=motion.error)
        self.period *= 0.5
        self._ground = repeated(half, self.body.gravity, -1.0)
        self._steps = np.ascontiguousarray(self._steps[:, :middle])  # as kernels take arrays

    def mirrored(self, state: Floats, halves: int) -> tuple[Floats, Floats]:
        """Mirror image of a state after an odd number of half periods, and its derivative; NaN where it overturns."""
        total, at = np.eye(2), state
        for _ in range(halves):
            if not np.all(np.isfinite(at)):  # a march from there would take all its turns
                break
            after, change = self.derivative(at)
            at, total = 0.0 - after, -change @ total
        return at, total


class ImpactMap(PeriodicForcing):
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
        """
        return self.derivative(impacts)[0]

    def derivative(self, impacts: ArrayLike) -> tuple[Floats, Floats]:
        """Return the next impacts as the map does, and their derivatives by the impacts before, shape (..., 2, 2)."""
        given = self._pairs(impacts, "impacts", "phase in s")
        made = self._after_impacts(given.reshape(-1, 2))
        start, signs, change = self._rates(made), _signs(made["side"]), np.empty((len(made), 2, 2))
        to_next_impact(*self._marching(), made, change)
        end = self._rates(made)
        times = self._ground.pieces[made["piece"], 0] + made["offset"]
        found = np.stack([times, _signs(made["side"]) * made["v"]], axis=-1)
        # At fixed times a later impact is (-v, -v') off; the shift of the next one is read off in the same way.
        zeros, ones = np.zeros(len(made)), np.ones(len(made))
        before = np.array([[-start[:, 0], zeros], [-start[:, 1], ones]]).transpose(2, 0, 1)
        with np.errstate(divide="ignore", invalid="ignore"):
            after = np.array([[-1.0 / end[:, 0], zeros], [-end[:, 1] / end[:, 0], ones]])
            total = after.transpose(2, 0, 1) @ change @ before
        total *= np.stack([ones, _signs(made["side"])], axis=-1)[:, :, None] * np.stack([ones, signs], axis=-1)[:, None]
        lost = made["ending"] != Fate.MOVES
        found[lost] = total[lost] = np.nan
        return found.reshape(given.shape), total.reshape(*given.shape, 2)

    def _rates(self, made: state.Records) -> Floats:
        """Velocity and acceleration just after impacts, in the frames of their sides, shape (n, 2)."""
        record = self._records[0]
        side = np.maximum(made["side"], 0)
        push = np.zeros(len(made))
        for column in self._ground.pieces[made["piece"]][:, :1:-1].T:
            push = push * made["offset"] + column
        restoring = record["threshold_slope"][side] * (
            record["threshold"][side] + record["restraint_threshold"][side] + _signs(side) * push
        )
        with np.errstate(invalid="ignore"):  # a velocity may be infinite
            return np.stack([made["v"], -restoring - record["damping"][side] * made["v"]], axis=-1)


def _signs(side: NDArray[np.int64]) -> Floats:
    return np.where(side > 0, -1.0, 1.0)


def is_mirrored(strobe: StroboscopicMap) -> bool:
    """Whether the mirror image of every course of a body is one half a period later."""
    record, (low, high), motion = strobe._records[0], strobe.body.stops, strobe.motion
    if not strobe._is_two_sided or low != -high or any(record[name][0] != record[name][1] for name in _OF_SIDES):
        return False
    half = 0.5 * motion.duration
    if not are_halved(motion)[0]:
        return False
    times = half * (np.arange(200) + 0.5) / 200.0
    sums = motion.acceleration(times) + motion.acceleration(times + half)
    return bool(np.max(np.abs(sums)) <= 1e-12 * motion.pga)


def distances(times: Floats, marks: Floats, period: float) -> Floats:
    """Distance in time of each of some times to the nearest of some marks, all of them within a period that repeats."""
    marks = np.sort(marks)
    after = np.searchsorted(marks, times)
    away = np.abs(times - marks[[after - 1, after % len(marks)]])
    return np.asarray(np.min(np.minimum(away, period - away), axis=0))


def are_halved(motion: Motion) -> Flags:
    """Of each breakpoint but the last: whether there is another one half a period later."""
    starts, period = motion.breakpoints[:-1] - motion.breakpoints[0], motion.duration
    return distances(np.mod(starts + 0.5 * period, period), starts, period) <= 1e-14 * period


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
        Equation of motion; by default nonlinear of a body that rocks.
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

    Examples
    --------
    >>> from rocking import Block, dynamics, pulses
    >>> block = Block.from_parameters(p=1.0, alpha=0.2, restitution=0.8)
    >>> shaking = pulses.sine(6.0, 0.8, cycles=1)
    >>> rock = dynamics.stroboscopic_map(block, shaking, model="linear")
    >>> rock([0.05, 0.0]).round(6).tolist()
    [-0.085002, 0.087054]
    """
    return StroboscopicMap(body, motion, model, chattering)


def impact_map(body: Body, motion: Motion, *, model: Model | None = None) -> ImpactMap:
    """Map of a body under periodic motion from just after one impact to just after the next.

    Parameters
    ----------
    body, motion, model : Body, Motion, str
        As for `stroboscopic_map`.

    Returns
    -------
    ImpactMap
        A function of impacts (phase in s, velocity after).

    Examples
    --------
    >>> from rocking import dynamics, pulses
    >>> ball, table = dynamics.BouncingBall(0.5, gravity=10.0), pulses.sine(15.0, 5.0, cycles=1)
    >>> dynamics.impact_map(ball, table)([[0.05, 1.0], [0.1, 0.8]]).shape
    (2, 2)
    """
    # No speed is below this threshold: an impact map closes no chattering.
    return ImpactMap(body, motion, model, VelocityThreshold(1e-300))
