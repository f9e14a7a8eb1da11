"""Maps of a body under periodic motion from one impact to the next, with their derivatives."""

from __future__ import annotations

from typing import Final

import numpy as np
from numpy.typing import ArrayLike

from rocking.arrays import Floats
from rocking.body import Body
from rocking.constants import Model
from rocking.dynamics.repeated import Repeated
from rocking.kernels import state
from rocking.kernels.periodic import Fate, to_next_impact
from rocking.motion.motion import Motion
from rocking.treatment import VelocityThreshold

#: Threshold on a speed that none is below: an impact map closes no chattering.
_NO_SPEED: Final = 1e-300


class ImpactMap(Repeated):
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
        change = np.empty((len(made), 2, 2))
        to_next_impact(*self._marching(), made, change)
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
        restoring = record["threshold_slope"][side] * (
            record["threshold"][side] + record["restraint_threshold"][side] + sign * push
        )
        with np.errstate(invalid="ignore"):  # a velocity may be infinite
            return np.stack([made["v"], -restoring - record["damping"][side] * made["v"]], axis=-1)


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
