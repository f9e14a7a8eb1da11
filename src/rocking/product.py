"""The full product of bodies, motions, scales and polarities: what is simulated, and how its outcomes are labelled."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any, Final, Literal

import numpy as np
from numpy.typing import ArrayLike

from rocking import checks
from rocking.arrays import Floats
from rocking.block import Blocks
from rocking.body import Bodies
from rocking.constants import VERSION, Model
from rocking.engine import Setup, Task, parts_of
from rocking.errors import InvalidOption
from rocking.motion.motion import Motion
from rocking.motion.named import names_of
from rocking.motion.piecewise import STRONGEST
from rocking.motion.scaling import FACTOR, SCALES, Measure, MeasureName
from rocking.problem import rules_of
from rocking.treatment import Treatment

if TYPE_CHECKING:
    import xarray as xr

Polarity = Literal["+", "-", "both"]

_SIGNS: Final[Mapping[str, tuple[int, ...]]] = {"+": (1,), "-": (-1,), "both": (1, -1)}

#: Outcomes that are kept of a simulation, from the fields of the engine's: units, and what each one means.
VARIABLES: Final[Mapping[str, tuple[str, str]]] = {
    "overturned": ("1", "whether the rotation reached pi/2"),
    "peak_rotation": ("rad", "largest rotation in size"),
    "peak_time": ("s", "time of the peak rotation"),
    "impacts": ("1", "impacts that were resolved"),
    "uplifts": ("1", "uplifts from rest"),
    "rests": ("1", "times the block came to rest"),
    "time_at_rest": ("s", "time spent at rest"),
    "complete_chattering": (
        "1",
        "whether the block came to rest after its first uplift before the motion passed a threshold again",
    ),
    "stalled": ("1", "rests that were not proven, as time no longer advanced between impacts"),
    "unfinished": ("1", "whether the simulation was given up after too many steps; the rest is as far as it came"),
    "stopped": (
        "1",
        "whether the duration ended it while the block moved or the motion went on, and left the verdict open",
    ),
}


@dataclass(frozen=True, eq=False)
class Scales:
    """Levels of a measure that motions are scaled to; without a measure, motions as they are.

    Attributes
    ----------
    measure : Measure or None
        What `values` are: factors, peak accelerations (m/s^2), peak velocities (m/s), spectral accelerations (m/s^2).
    values : ndarray
        Levels of the measure.
    """

    measure: Measure | None = None
    values: Floats = field(default_factory=lambda: np.ones(1))

    @classmethod
    def of(cls, levels: ArrayLike | None, measure: MeasureName | Measure) -> Scales:
        """Scales from arguments."""
        known = Measure.of(measure, among=SCALES)
        if levels is None:
            if known.name != "factor":
                raise InvalidOption("{} says what {} are: give those as well", "measure", "levels")
            return cls()
        return cls(known, checks.positive_numbers(levels, "levels", InvalidOption))

    @property
    def count(self) -> int:
        """Number of scales."""
        return len(self.values)

    @property
    def about(self) -> dict[str, Any]:
        """Name of the measure, its units, and its period (s) and damping where it has them."""
        measure = self.measure or FACTOR
        return {"measure": measure.name, "units": measure.units, **measure.options()}

    def factors(self, motion: Motion) -> Floats:
        """Factors that bring a motion to the levels."""
        with np.errstate(over="ignore"):
            factors = self.values / self.now(motion)
        if not factors.max() * np.abs(motion.coefficients).max() <= STRONGEST:
            motion.scaled(float(factors.max()))  # refused where it is too strong, and not only steep
        return factors

    def now(self, motion: Motion) -> float:
        """Return what a motion measures as it is; 1 where scales are factors."""
        return (self.measure or FACTOR).positive(motion, motion.name)


@dataclass(frozen=True, eq=False)
class Product:
    """Every body under every motion at every scale and polarity.

    Attributes
    ----------
    bodies : Bodies
        n bodies.
    motions : tuple of Motion
        m motions.
    scales : Scales
        What the motions are scaled to.
    polarity : {"+", "-", "both"}
        Motions as they are, reversed, or both.
    model, treatment, duration
        As for `rocking.simulate`.

    Raises
    ------
    InvalidOption
        If a rule is out of its range.
    """

    bodies: Bodies
    motions: tuple[Motion, ...]
    scales: Scales
    polarity: Polarity
    model: Model
    treatment: Treatment
    duration: float | None

    def __post_init__(self) -> None:
        checks.one_of(self.polarity, "polarity", InvalidOption, list(_SIGNS))
        rules_of(self.bodies, self.model, self.treatment, self.duration, record=False)  # checked before any work

    @property
    def signs(self) -> tuple[int, ...]:
        """Factors of the polarities."""
        return _SIGNS[self.polarity]

    @property
    def shape(self) -> tuple[int, int, int, int]:
        """Numbers of motions, scales, polarities and bodies."""
        return len(self.motions), self.scales.count, len(self.signs), len(self.bodies)

    @property
    def blocks(self) -> Blocks:
        """The bodies, for what only blocks can answer.

        Raises
        ------
        InvalidOption
            If they are of another kind.
        """
        if not isinstance(self.bodies, Blocks):
            raise InvalidOption(f"this is known of blocks alone, not of {self.bodies.kind}")
        return self.bodies

    def setup(self, bodies: slice | None = None) -> Setup:
        """Return how to simulate the bodies, or some of them."""
        chosen = self.bodies if bodies is None else self.bodies.select(bodies)
        return Setup(chosen, self.model, self.treatment, self.duration)

    def tasks(self) -> Iterator[Task]:
        """Cut the product into tasks for the engine; their keys are (motion, scale, polarity)."""
        for m, motion in enumerate(self.motions):
            for s, factor in enumerate(self.scales.factors(motion).tolist()):
                for k, sign in enumerate(self.signs):
                    for part in parts_of(len(self.bodies), motion):
                        yield Task(part, motion, sign * factor, (m, s, k))

    def dataset(self, outcomes: Mapping[str, Any]) -> xr.Dataset:
        """Label outcomes, each of the product's shape; dimensions that were not asked for are dropped.

        Parameters
        ----------
        outcomes : mapping
            Arrays by the names of `VARIABLES`.
        """
        import xarray as xr

        dimensions = ("motion", "scale", "polarity", "block")
        gone = {"scale": self.scales.measure is None, "polarity": self.polarity != "both"}
        attributes = {name: {"units": units, "long_name": meaning} for name, (units, meaning) in VARIABLES.items()}
        variables = {name: (dimensions, values, attributes.get(name, {})) for name, values in outcomes.items()}
        whole = xr.Dataset(variables, self._coordinates(), self._attributes())
        return whole.isel({name: 0 for name, is_gone in gone.items() if is_gone}, drop=True)

    def _coordinates(self) -> dict[str, Any]:
        return {
            "motion": ("motion", names_of(self.motions)),
            **verticals_of(self.motions),
            "scale": ("scale", self.scales.values, self.scales.about),
            "polarity": ("polarity", ["+" if sign > 0 else "-" for sign in self.signs]),
            **body_coordinates(self.bodies),
        }

    def _attributes(self) -> dict[str, Any]:
        return {
            "program": f"rocking {VERSION}",
            "model": self.model,
            "chattering": repr(self.treatment),
            "polarity": self.polarity,
            "gravity": self.bodies.gravity,
            "motions": [f"{motion.name}: {motion.description.text}" for motion in self.motions],
            "histories": ["; ".join(motion.history) for motion in self.motions],
        }


def verticals_of(motions: Sequence[Motion]) -> dict[str, Any]:
    """Names of the vertical components, as a coordinate of the dimension ``motion``; none where no motion has one."""
    names = ["" if motion.vertical is None else motion.vertical.name for motion in motions]
    return {"vertical": ("motion", names)} if any(motion.vertical for motion in motions) else {}


def body_coordinates(bodies: Bodies) -> dict[str, Any]:
    """Parameters of bodies as coordinates of the dimension ``block``, with units; of unequal sides one for each."""
    columns = bodies.parameters()
    if bodies.is_symmetric:
        return {name: ("block", values[:, 0], {"units": units}) for name, (values, units) in columns.items()}
    return {
        f"{name}_{side}": ("block", values[:, k], {"units": units})
        for name, (values, units) in columns.items()
        for k, side in enumerate(("plus", "minus"))
    }
