"""What bodies on a line share: x'' = stiffness x - damping x' - pull - a(t) between stops, and back with less speed.

Position and motion are those of the table or the support; at a stop the velocity changes its sign and drops by the
restitution.
"""

from __future__ import annotations

import math
from abc import ABC, abstractmethod
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, fields
from typing import ClassVar, Final, NamedTuple, Self, cast

import numpy as np

from rocking import checks
from rocking.arrays import Floats, Integers
from rocking.body import Coordinate
from rocking.constants import STANDARD_GRAVITY, Model
from rocking.errors import InvalidBlock, InvalidOption
from rocking.kernels import state

_POSITION: Final = Coordinate("position", "velocity", "acceleration", "m")


class Law(NamedTuple):
    """Equation of motion of a body: stiffness (1/s^2), damping (1/s), pull (m/s^2), stops (m), the last one or inf."""

    stiffness: float
    damping: float
    pull: float
    low: float
    high: float


@dataclass(frozen=True)
class LinearBody(ABC):
    """What the kinds share: what `rocking.Body` asks of them."""

    coordinate: ClassVar[Coordinate] = _POSITION
    balance: ClassVar[tuple[float, float]] = (math.inf, math.inf)
    contact: ClassVar[None] = None
    kind: ClassVar[str]
    units: ClassVar[Mapping[str, str]]

    @property
    @abstractmethod
    def law(self) -> Law:
        """Equation of motion."""

    @property
    def gravity(self) -> float:
        """Unit of accelerations, m/s^2."""
        return STANDARD_GRAVITY

    @property
    def description(self) -> str:
        """What it is, in words."""
        return self.kind.replace("-", " ")

    @property
    def sides(self) -> Sequence[object]:
        """Its parameters, as text."""
        return (", ".join(f"{name.replace('_', ' ')} = {value:.5g}{unit}" for name, value, unit in self._given()),)

    @property
    def stops(self) -> tuple[float, float]:
        """Positions of its stops, m; without a second one the first twice."""
        low, high = self.law.low, self.law.high
        return low, (high if math.isfinite(high) else low)

    @property
    def thresholds(self) -> tuple[float, float]:
        """Accelerations that take it off its stops, m/s^2, as `uplift_thresholds`."""
        stiffness, _, pull, low, high = self.law
        return pull - stiffness * low, stiffness * high - pull if math.isfinite(high) else math.inf

    def uplift_thresholds(self, model: Model = "linear") -> tuple[float, float]:
        """Accelerations of the support beyond which it leaves its stops: the first when -a passes it, the other when a.

        Parameters
        ----------
        model : {"linear"}
            Its only equation of motion.

        Returns
        -------
        float, float
            m/s^2; infinite where there is no second stop.

        Examples
        --------
        >>> from rocking.dynamics import BouncingBall
        >>> BouncingBall(0.8, gravity=9.81).uplift_thresholds()
        (9.81, inf)
        """
        _check_model(model)
        return self.thresholds

    def alone(self) -> LinearBodies:
        """Return bodies of which it is the only one.

        Returns
        -------
        LinearBodies
            Of this one.

        Examples
        --------
        >>> from rocking.dynamics import BouncingBall
        >>> len(BouncingBall(0.8).alone())
        1
        """
        return LinearBodies((self,))

    def _given(self) -> list[tuple[str, float, str]]:
        values = ((entry.name, getattr(self, entry.name)) for entry in fields(self))
        return [(name, value, f" {self.units[name]}".rstrip()) for name, value in values if value is not None]

    def _check(self, *positive: str) -> None:
        """Check the restitution, and that these are positive; numbers are kept as floats."""
        for name in positive:
            object.__setattr__(self, name, checks.positive(getattr(self, name), name, InvalidBlock, self.units[name]))
        restitution = checks.finite(self.restitution, "restitution", InvalidBlock)  # type: ignore[attr-defined]
        if not 0.0 <= restitution <= 1.0:
            raise InvalidBlock(f"{{}} must be from 0 to 1, not {restitution:g}", "restitution", value=restitution)
        object.__setattr__(self, "restitution", restitution)


@dataclass(frozen=True, eq=False)
class LinearBodies:
    """Any number n of bodies of one of these kinds.

    Parameters
    ----------
    members : sequence
        Bodies of one kind under one gravity.

    Raises
    ------
    InvalidBlock
        If there is none, or they are of several kinds.

    Examples
    --------
    >>> from rocking.dynamics import BouncingBall
    >>> LinearBodies([BouncingBall(0.8), BouncingBall(0.9)])
    <LinearBodies: 2 of kind bouncing-ball>
    """

    members: tuple[LinearBody, ...]

    def __init__(self, members: Sequence[LinearBody]) -> None:
        given = tuple(members)
        if not given or any(type(each) is not type(given[0]) for each in given) or not isinstance(given[0], LinearBody):
            raise InvalidBlock("bodies of one of the kinds in rocking.dynamics are needed, all of the same kind")
        if len({each.gravity for each in given}) > 1:
            raise InvalidBlock("all bodies must be under one {}", "gravity")
        object.__setattr__(self, "members", given)

    @classmethod
    def of(cls, bodies: Iterable[LinearBody]) -> Self:
        """Gather single ones.

        Parameters
        ----------
        bodies : iterable
            Bodies of one kind.

        Returns
        -------
        LinearBodies
            All of them.

        Examples
        --------
        >>> from rocking.dynamics import BouncingBall
        >>> len(LinearBodies.of([BouncingBall(0.8)]))
        1
        """
        return cls(tuple(bodies))

    @property
    def kind(self) -> str:
        """Name of the kind."""
        return self.members[0].kind

    @property
    def gravity(self) -> float:
        """Unit of accelerations, m/s^2."""
        return self.members[0].gravity

    @property
    def restitution(self) -> Floats:
        """Factors on the speed at a stop, shape (n, 2)."""
        return self._pairs("restitution")

    @property
    def stops(self) -> Floats:
        """Positions of the stops, m, shape (n, 2)."""
        return np.array([each.stops for each in self.members])

    @property
    def is_symmetric(self) -> bool:
        """Whether all hang or stand between two stops that are equally far away, without a pull."""
        return all(law.pull == 0.0 and law.low == -law.high for law in (each.law for each in self.members))

    def __len__(self) -> int:
        return len(self.members)

    def __getitem__(self, index: int) -> LinearBody:
        return self.members[index]

    def __repr__(self) -> str:
        return f"<{type(self).__name__}: {len(self)} of kind {self.kind}>"

    def select(self, index: slice | Integers) -> LinearBodies:
        """Return some of them.

        Parameters
        ----------
        index : slice or ndarray
            A slice, an array of indices, or a mask.

        Returns
        -------
        LinearBodies
            Those.

        Examples
        --------
        >>> from rocking.dynamics import BouncingBall
        >>> LinearBodies([BouncingBall(0.8), BouncingBall(0.9)]).select(slice(1, None))[0].restitution
        0.9
        """
        chosen = np.arange(len(self))[index]
        return LinearBodies([self.members[k] for k in chosen])

    def parameters(self) -> Mapping[str, tuple[Floats, str]]:
        """Return what they are made from, by name.

        Returns
        -------
        dict of str to (ndarray, str)
            Arrays of shape (n, 2), and units.

        Examples
        --------
        >>> from rocking.dynamics import BouncingBall
        >>> BouncingBall(0.8).alone().parameters()["restitution"]
        (array([[0.8, 0.8]]), '1')
        """
        names = [entry.name for entry in fields(self.members[0]) if entry.name != "gravity"]
        return {name: (self._pairs(name), self.members[0].units[name] or "1") for name in names}

    def speed_limits(self, share: float) -> Floats:
        """Return a speed for each side: these bodies have none that is natural to them.

        Parameters
        ----------
        share : float
            The speed, m/s.

        Returns
        -------
        ndarray, shape (n, 2)
            That speed.

        Examples
        --------
        >>> from rocking.dynamics import BouncingBall
        >>> BouncingBall(0.8).alone().speed_limits(0.1)
        array([[0.1, 0.1]])
        """
        return np.full((len(self), 2), share)

    def kernel_records(self, model: Model, limits: Floats) -> state.Records:
        """Return them as kernels take them.

        Parameters
        ----------
        model : {"linear"}
            Their only equation of motion.
        limits : ndarray, shape (n, 2)
            Limits of a treatment of chattering.

        Returns
        -------
        structured ndarray, shape (n,)
            Of type `kernels.state.BLOCK`.

        Raises
        ------
        InvalidOption
            If another model is asked for.

        Examples
        --------
        >>> from rocking.dynamics import BouncingBall
        >>> BouncingBall(0.8).alone().kernel_records("linear", np.zeros((1, 2)))["stiffness"]
        array([[0., 0.]])
        """
        _check_model(model)
        made = state.records(len(self), state.BLOCK)
        laws = np.array([each.law for each in self.members])
        facing = np.isfinite(laws[:, 4])
        made["stiffness"] = laws[:, :1]
        made["damping"] = laws[:, 1:2]
        made["restrained"] = laws[:, 1] > 0.0
        made["threshold_slope"] = self.gravity
        made["threshold"] = np.array([each.thresholds for each in self.members]) / self.gravity
        made["restitution"] = self.restitution
        made["two_stops"] = facing
        made["next_side"][:, 1] = facing
        made["overturn_angle"] = laws[:, 4] - laws[:, 3]
        made["limit"] = limits
        return made

    def _pairs(self, name: str) -> Floats:
        values = [getattr(each, name) for each in self.members]
        return np.repeat(np.array([math.nan if value is None else value for value in values])[:, None], 2, axis=1)


def _check_model(model: Model) -> None:
    if model != "linear":
        advice = 'call simulate or simulate_many of rocking.dynamics, or give {} "linear"'
        raise InvalidOption(f"a body of rocking.dynamics moves by linear equations: {advice}", "model", value=model)


class MakerOfKind:
    """Makes bodies of a kind again from what `LinearBodies.parameters` gave."""

    def __init__(self, made: type[LinearBody]) -> None:
        self.made = made

    def __call__(self, **parameters: object) -> LinearBodies:
        columns = {name: np.atleast_1d(cast("Floats", values)) for name, values in parameters.items()}
        gravity = {name: float(values[0]) for name, values in columns.items() if name == "gravity"}
        if "gravity" not in {entry.name for entry in fields(self.made)}:
            gravity = {}
        rows = zip(*(values[:, 0].tolist() for name, values in columns.items() if name != "gravity"), strict=True)
        names = [name for name in columns if name != "gravity"]
        return LinearBodies(
            [
                self.made(**{k: None if math.isnan(v) else v for k, v in zip(names, row, strict=True)}, **gravity)
                for row in rows
            ]
        )

    def of(self, bodies: Iterable[LinearBody], /) -> LinearBodies:
        return LinearBodies.of(bodies)
