"""Maps of a body under periodic motion from the start of one period to that of the next, with their derivatives."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
from numpy.typing import ArrayLike, NDArray

from rocking import checks
from rocking.arrays import Floats
from rocking.body import Body
from rocking.constants import Model
from rocking.dynamics.repeated import TOGETHER, Repeated, parts_of
from rocking.errors import InvalidOption
from rocking.kernels import state
from rocking.kernels.periodic import Fate as Fate
from rocking.kernels.periodic import differentiate, iterate, stretch
from rocking.motion.motion import Motion
from rocking.threads import cores, in_threads
from rocking.treatment import Treatment


class StroboscopicMap(Repeated):
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
            Exactly zero where the body comes to rest on the way, or is held at rest at the start: it forgets how it
            began. On a stop that does not hold it, that of the states in front of the stop. NaN where it overturns;
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
        setting = self._setting()
        impacts = np.zeros(len(made), dtype=np.int64)

        def follow(part: slice) -> None:
            iterate(setting, state.new_scratch(), made[part], periods, rows[part], impacts[part])

        for _ in in_threads(follow, parts_of(len(made), periods), threads=cores()):
            pass

    def _differentiate(self, made: state.Records) -> Floats:
        change = np.empty((len(made), 2, 2))
        differentiate(*self._marching(), made, change)
        return change

    def _stretches(self, given: Floats, before: int, count: int) -> tuple[Floats, int, Fate]:
        """Logarithms of the stretches of a frame in each of some periods, after others; impacts in them; the fate."""
        _, made = self._states(given[None])
        marching = self._marching()
        frame = np.array([[0.0, 0.0], [0.0, 0.0], [1.0, 0.0]])
        logs, impacts = np.full((before + count, 2), np.nan), 0
        edges = sorted({*range(0, before + count, TOGETHER), before, before + count})
        for start, stop in pairwise(edges):
            here = stretch(*marching, made[0], frame, logs[start:stop])
            impacts += here if start >= before else 0
            if made["ending"][0] not in (Fate.MOVES, Fate.RESTS):
                break
        fate = Fate(int(made["ending"][0]))
        if fate == Fate.RESTS_FOR_EVER:
            logs[np.isnan(logs)] = -np.inf
        return logs[before:], impacts, fate


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
