"""Simulations of the bodies of `rocking.dynamics`: `rocking.simulate` and `rocking.simulate_many` in positions."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, fields, replace
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike

import rocking.response
from rocking.core import checks
from rocking.core.arrays import Floats, as_asked
from rocking.dynamics.bodies import LinearBodies, LinearBody
from rocking.engine.problem import never_rests
from rocking.engine.treatment import Treatment
from rocking.errors import InvalidBlock, InvalidOption
from rocking.motion.motion import Motion
from rocking.records.named import Motions, one_motion, several_motions
from rocking.simulation.ensemble import dataset_of, outcomes_of, product_of, setup_of
from rocking.simulation.simulate import response_to

if TYPE_CHECKING:
    import xarray as xr


@dataclass(frozen=True, eq=False, repr=False)
class Response(rocking.response.Response):
    """Response of a body between stops, made by `rocking.dynamics.simulate`: a `rocking.Response` in positions.

    Positions are relative to the table or the support. Of events and impacts ``side`` is +1 at the lower stop and -1 at
    the upper one.
    """

    @property
    def peak_position(self) -> float:
        """Highest position, m: that of the second stop, exactly, once the body has been there."""
        return self.peak_rotation

    def position(self, time: ArrayLike) -> Floats:
        """Return the position relative to the table or the support at any time, m; NaN outside the response."""
        return as_asked(self.states(time)[..., 0])

    def velocity(self, time: ArrayLike) -> Floats:
        """Return the rate of `position`, m/s; just after an impact at one."""
        return as_asked(self.states(time)[..., 1])


def in_positions(response: rocking.response.Response) -> Response:
    """Return the response of a body between stops as one in positions."""
    return Response(**{entry.name: getattr(response, entry.name) for entry in fields(response)})


def simulate(
    body: LinearBody,
    motion: Motion | None,
    *,
    chattering: str | Treatment = "certified",
    duration: float | None = None,
    initial_position: float | None = None,
    initial_velocity: float = 0.0,
) -> Response:
    """Response of a body between stops to a motion of its table or support, with chattering resolved by proof.

    Parameters
    ----------
    body : BouncingBall, ImpactOscillator or InvertedPendulum
        What moves.
    motion : Motion or None
        Acceleration of the table (positive up) or the support; None for free motion.
    chattering : str or treatment
        As for `rocking.simulate`; thresholds on velocities are in m/s.
    duration : float, optional
        Time to stop at, s. By default to the end of the motion, and on until rest; a body that need not come to rest
        stops with the motion.
    initial_position : float, optional
        Position at time 0, m; by default 0, or the stop where that is behind it.
    initial_velocity : float
        Velocity at time 0, m/s.

    Returns
    -------
    Response
        Events, impacts, chattering sequences, and the position at any time.

    Raises
    ------
    InvalidBlock, InvalidMotion
        If the body is none of these, or the motion none, or one with a vertical component beside it.
    InvalidOption
        If an argument is out of its range, the body starts behind a stop, or it never comes to rest and there is
        neither motion nor duration.

    Examples
    --------
    >>> from rocking import dynamics
    >>> response = dynamics.simulate(dynamics.BouncingBall(0.8, gravity=10.0), None, initial_position=0.2)
    >>> f"{response.events['time'][0]:.12f}"
    '1.800000000000'
    """
    body, motion = _one_body(body), one_motion(motion)
    until = _duration(body, motion, duration)
    at = min(max(0.0, body.law.low), body.law.high) if initial_position is None else initial_position
    return in_positions(response_to(body, motion, "linear", chattering, until, (at, initial_velocity)))


def simulate_many(
    bodies: LinearBody | Sequence[LinearBody] | LinearBodies,
    motions: Motions,
    *,
    chattering: str | Treatment = "certified",
    duration: float | None = None,
    initial_position: float | None = None,
    initial_velocity: float = 0.0,
    threads: int | None = None,
    progress: bool | None = None,
) -> xr.Dataset:
    """Simulate every body under every motion, and keep the outcome of each simulation.

    Parameters
    ----------
    bodies : body, sequence of bodies of one kind, or LinearBodies
        n bodies.
    motions : Motion, sequence of Motion, or mapping of str to Motion
        m motions.
    chattering : str or treatment
        As for `simulate`.
    duration : float, optional
        As for `simulate`; by default of bodies that need not come to rest the end of the longest motion.
    initial_position, initial_velocity : float
        As for `simulate`, for all bodies.
    threads, progress : int or bool, optional
        As for `rocking.simulate_many`.

    Returns
    -------
    xarray.Dataset
        As `rocking.simulate_many`, with ``peak_position`` (m), the highest.

    Examples
    --------
    >>> import rocking
    >>> from rocking import dynamics
    >>> balls = [dynamics.BouncingBall(restitution) for restitution in (0.3, 0.6, 0.9)]
    >>> found = dynamics.simulate_many(balls, rocking.pulses.one_sine(15.0, 2.0))
    >>> found.restitution.values.tolist(), bool((found.peak_position > 0.0).all())
    ([0.3, 0.6, 0.9], True)
    """
    gathered = bodies
    if not isinstance(gathered, LinearBodies):
        given = gathered if isinstance(gathered, Iterable) else [gathered]
        gathered = LinearBodies([_one_body(each) for each in given])
    pressed = np.array([_is_pressed(each) for each in gathered.members])
    if duration is None and pressed.any() and not pressed.all():
        # Those that nothing presses against a stop end with the motion; the others go on until they rest.
        import xarray as xr

        kinds = np.flatnonzero(pressed), np.flatnonzero(~pressed)
        options: dict[str, Any] = {
            "chattering": chattering, "initial_position": initial_position, "initial_velocity": initial_velocity,
            "threads": threads, "progress": progress,
        }  # fmt: skip
        parts = [simulate_many(gathered.select(kind), motions, **options) for kind in kinds]
        whole = xr.concat(parts, "body", data_vars="all", coords="minimal", compat="override", join="override")
        return whole.isel(body=np.argsort(np.concatenate(kinds)))
    several = several_motions(motions)
    longest = max(several, key=lambda motion: motion.end)
    ends = [_duration(each, longest, duration) or 0.0 for each in gathered.members]
    if initial_position is not None:
        initial_position = checks.finite(initial_position, "initial_position", InvalidOption)
    product = product_of(gathered, several, None, "factor", "+", "linear", chattering, duration)
    start = initial_position, checks.finite(initial_velocity, "initial_velocity", InvalidOption)
    setup = replace(setup_of(product), start=start, duration=max(ends) or None)
    names = {"peak_rotation": "peak_position", "residual_rotation": "residual_position", "block": "body"}
    found = dataset_of(product, outcomes_of(product, setup, threads, progress))
    found = found.drop_vars(["overturned", "leans"]).rename(names)
    found["peak_position"].attrs.update(units="m", long_name="highest position")
    found["residual_position"].attrs.update(units="m", long_name="position at which it stays; NaN where not known")
    found["peak_time"].attrs.update(long_name="time of the highest position")
    for kept in found.values():
        kept.attrs["long_name"] = kept.attrs["long_name"].replace("the block", "the body")
    return found


def _one_body(body: object) -> LinearBody:
    if not isinstance(body, LinearBody):
        raise InvalidBlock(
            "a BouncingBall, ImpactOscillator or InvertedPendulum of rocking.dynamics is needed, not "
            f"{type(body).__name__}; blocks go to rocking.simulate"
        )
    return body


def _is_pressed(body: LinearBody) -> bool:
    """Whether something presses the body against one of its stops where nothing moves."""
    low, high = body.uplift_thresholds()
    return low > 0.0 or 0.0 < high < np.inf


def _duration(body: LinearBody, motion: Motion | None, duration: float | None) -> float | None:
    """Return the duration: as it is given, else until rest, or of a body that need not rest that of the motion."""
    if duration is not None:
        return duration
    if not _is_pressed(body):
        if motion is None:
            raise InvalidOption(
                "nothing presses this body against a stop, so that it need not rest; give {}", "duration"
            )
        return motion.end
    if never_rests(body.alone()):
        raise InvalidOption(
            f"a body with {{}} 1, as this {body.description}, never comes to rest; give {{}} to say when to stop",
            *("restitution", "duration"),
        )
    return None
