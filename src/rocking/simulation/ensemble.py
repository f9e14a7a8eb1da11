"""Compiled, parallel simulation of all combinations of blocks, motions, scales and polarities."""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any, Final, Literal

import numpy as np
from numpy.typing import ArrayLike, NDArray

from rocking.block import Blocks
from rocking.block.body import Bodies, Body
from rocking.block.friction import Friction, check_friction, resolve_friction
from rocking.block.single import ROTATION
from rocking.core import checks
from rocking.core.arrays import Floats
from rocking.core.constants import VERSION, Model
from rocking.core.progress import Progress
from rocking.engine.problem import build_settings, gather_bodies
from rocking.engine.schemes import ChatteringScheme, chattering_scheme
from rocking.engine.tasks import (
    OUTCOME_DTYPE,
    Setup,
    Task,
    check_components,
    create_task,
    simulate_tasks,
    split_simulations,
)
from rocking.errors import OptionError
from rocking.motion.motion import Motion
from rocking.motion.piecewise import MAX_ACCELERATION
from rocking.motion.scaling import FACTOR, SCALING_MEASURES, Measure, MeasureName
from rocking.records.named import Motions, list_motion_names, list_motions, make_names_unique
from rocking.response.perturbed import FACTOR_COUNT, RELATIVE_STEP, list_factors

if TYPE_CHECKING:
    import xarray as xr

Polarity = Literal["+", "-", "both"]

POLARITY_SIGNS: Final[Mapping[str, tuple[int, ...]]] = {"+": (1,), "-": (-1,), "both": (1, -1)}

#: Units and meanings of outcomes by their names in the engine's result.
VARIABLES: Final[Mapping[str, tuple[str, str]]] = {
    "overturned": ("1", "whether the rotation reached pi/2"),
    "peak_rotation": ("rad", "largest rotation in size"),
    "residual_rotation": ("rad", "rotation at which it stays; NaN where it overturns or that is not known"),
    "peak_time": ("s", "time of the peak rotation"),
    "impacts": ("1", "resolved impacts: those of a sequence after its proof are not among them"),
    "uplifts": ("1", "uplifts from rest"),
    "rests": ("1", "times the block came to rest"),
    "time_at_rest": ("s", "time spent at rest"),
    "complete_chattering": ("1",
        "whether the block came to rest after its first uplift before the motion passed a threshold again"),
    "rests_by_rounding": ("1", "rests that were not proven, as time no longer advanced between impacts"),
    "leans": ("1", "whether restraints hold the block leaning for ever"),
    "unfinished": ("1", "whether the simulation was given up after too many steps; the rest is as far as it came"),
    "ended_early": ("1",
        "whether the duration ended it while the block moved or the motion went on, and left the verdict open"),
}  # fmt: skip

#: Optional times, likewise.
TIME_VARIABLES: Final[Mapping[str, tuple[str, str]]] = {
    "first_uplift": ("s", "time of the first uplift; 0 without one"),
    "first_rest": ("s", "time at which the block first came to rest; 0 if it never did"),
    "last_rest": ("s", "time at which the block last came to rest; 0 if it never did"),
}

#: Further outcomes with friction, likewise.
SLIP_VARIABLES: Final[Mapping[str, tuple[str, str]]] = {
    "lost_contact": ("1", "whether the ground ceased to press on the block, where the simulation ends"),
    "largest_slip": ("m", "largest displacement of the base relative to the ground in size"),
    "residual_slip": ("m", "displacement of the base relative to the ground at the end"),
}

#: Names of coordinates and results that labels of blocks must not replace.
_RESERVED: Final = {
    *VARIABLES, *TIME_VARIABLES, *SLIP_VARIABLES, "motion", "record", "file", "vertical", "scale", "level", "polarity",
    "block", "weight", "limit_state", "fractile", "change", "median", "dispersion", "exceedance_count",
    "trial_count", "fault", "low", "high", "known"
}  # fmt: skip

#: Units of parameters of pulses.
_PULSE_UNITS: Final = {"amplitude": "m/s^2", "frequency": "Hz", "duration": "s", "phase": "rad"}

_SHARE_MEANING: Final = "share of the simulation and its repeats within 3e-6 of the motion that overturn"


@dataclass(frozen=True, eq=False)
class ScalingLevels:
    """Levels of a measure to which motions are scaled. Without a measure, motions are not scaled.

    Attributes
    ----------
    measure : Measure or None
        Measure of `values`, in SI units.
    values : ndarray
        Levels of the measure.

    See Also
    --------
    rocking.Measure : Measure of a ground motion.
    rocking.simulation.ensemble.SimulationProduct : Combination of bodies, motions, scales and polarities.

    Examples
    --------
    >>> import rocking
    >>> from rocking.simulation.ensemble import ScalingLevels
    >>> scales = ScalingLevels.from_levels([2.0, 4.0], "pga")
    >>> scales.factors(rocking.pulses.one_sine(amplitude=4.0, frequency=1.0)).tolist()
    [0.5, 1.0]
    """

    measure: Measure | None = None
    values: Floats = field(default_factory=lambda: np.ones(1))

    @classmethod
    def from_levels(cls, levels: ArrayLike | None, measure: MeasureName | Measure) -> ScalingLevels:
        """Create scales from `levels` and `measure` as in `simulate_many`, or for unscaled motions."""
        parsed = Measure.parse(measure, names=SCALING_MEASURES)
        if levels is None:
            if parsed.name != "factor":
                raise OptionError("{} requires {}", "measure", "levels")
            return cls()
        return cls(parsed, checks.positive_numbers(levels, "levels", OptionError))

    @property
    def count(self) -> int:
        """Number of scales."""
        return len(self.values)

    @property
    def attributes(self) -> dict[str, Any]:
        """Name of the measure, units, and, for spectral accelerations, period (s) and damping."""
        measure = self.measure or FACTOR
        return {"measure": measure.name, "units": measure.units, **measure.options()}

    def factors(self, motion: Motion) -> Floats:
        """Return the factor that scales a motion to each level."""
        with np.errstate(over="ignore"):
            measure = self.measure or FACTOR
            factors: Floats = measure.find_factor(self.values, measure.require_positive_value(motion, motion.name))
            largest = factors.max() * np.abs(motion.coefficients).max()
        if not largest <= MAX_ACCELERATION:
            motion.scaled(float(factors.max()))  # raises for too strong motions, not only steep ones
        return factors


@dataclass(frozen=True, eq=False)
class SimulationProduct:
    """Combinations of all bodies, motions, scales and polarities.

    Attributes
    ----------
    bodies : Bodies
        n bodies.
    motions : tuple of Motion
        m motions.
    scales : ScalingLevels
        Scales of the motions.
    polarity : {"+", "-", "both"}
        Original motions, reversed motions, or both.
    model, chattering, duration, friction
        As for `rocking.simulate`.

    Raises
    ------
    OptionError, MotionError
        If an option is out of range, or bodies on a line have vertical motion.

    See Also
    --------
    rocking.simulation.ensemble.ScalingLevels : Levels of the motions.
    rocking.simulate_many : Simulate all combinations.

    Examples
    --------
    >>> import rocking, tempfile
    >>> block, pulse = rocking.Block(width=0.4, height=2.0), rocking.pulses.one_sine(4.0, 1.0)
    >>> study = rocking.create_study(tempfile.mkdtemp(), block, pulse, levels=[0.4, 1.0], polarity="both")
    >>> study.product.shape
    (1, 2, 2, 1)
    """

    bodies: Bodies
    motions: tuple[Motion, ...]
    scales: ScalingLevels
    polarity: Polarity
    model: Model
    chattering: ChatteringScheme
    duration: float | None
    friction: tuple[float, float] | None = None

    def __post_init__(self) -> None:
        checks.choice(self.polarity, "polarity", OptionError, list(POLARITY_SIGNS))
        build_settings(
            self.bodies, self.model, self.chattering, self.duration, writes_tables=False
        )  # raises before the work
        check_friction(self.bodies, self.model, self.friction)
        for motion in self.motions:
            check_components(self.bodies, motion)

    @property
    def signs(self) -> tuple[int, ...]:
        """Signs of the polarities."""
        return POLARITY_SIGNS[self.polarity]

    @property
    def shape(self) -> tuple[int, int, int, int]:
        """Numbers of motions, scales, polarities and bodies."""
        return len(self.motions), self.scales.count, len(self.signs), len(self.bodies)

    @property
    def blocks(self) -> Blocks:
        """Bodies as blocks, for results that are defined for blocks only.

        Raises
        ------
        OptionError
            If the bodies are not blocks.
        """
        if not isinstance(self.bodies, Blocks) or self.bodies.terms:
            raise OptionError(f"this result is defined for blocks only, not for {self.bodies.kind}")
        return self.bodies


def create_product(
    blocks: Bodies | Body | Sequence[Body],
    motions: Motions,
    levels: ArrayLike | None,
    measure: MeasureName | Measure,
    polarity: Polarity,
    model: Model,
    chattering: str | ChatteringScheme,
    duration: float | None,
    friction: Friction | None = None,
) -> SimulationProduct:
    """Create a product from the arguments of `simulate_many`."""
    bodies, ground_motions = gather_bodies(blocks), tuple(list_motions(motions))
    scales, scheme = ScalingLevels.from_levels(levels, measure), chattering_scheme(chattering)
    coefficients = resolve_friction(friction)
    return SimulationProduct(bodies, ground_motions, scales, polarity, model, scheme, duration, coefficients)


def create_setup(product: SimulationProduct, bodies: slice | None = None) -> Setup:
    """Return the setup for all or some bodies of a product."""
    selected = product.bodies if bodies is None else product.bodies.select(bodies)
    return Setup(selected, product.model, product.chattering, product.duration, friction=product.friction)


def _generate_tasks(product: SimulationProduct, perturbation: float) -> Iterator[Task]:
    """Divide a product into tasks for the engine, with slices of its outcomes, in order, as keys."""
    signs, per_motion = np.asarray(product.signs, dtype=float), math.prod(product.shape[1:])
    factors = [product.scales.factors(motion) for motion in product.motions]
    for part in split_simulations(product.motions, np.full(len(factors), per_motion)):
        m, s, k, block = np.unravel_index(np.arange(part.start, part.stop), product.shape)
        first = m[0]
        scales = np.array(factors[first : m[-1] + 1])[m - first, s]
        yield create_task(block, product.motions, m, perturbation * (signs[k] * scales), part)


def create_dataset(product: SimulationProduct, outcomes: Mapping[str, Any]) -> xr.Dataset:
    """Create a dataset from arrays named as in `VARIABLES`, without the dimensions that were not requested."""
    import xarray as xr

    has_scales, has_polarities = product.scales.measure is not None, product.polarity == "both"
    requested = {"motion": True, "scale": has_scales, "polarity": has_polarities, "block": True}
    dimensions = tuple(name for name, is_requested in requested.items() if is_requested)
    part = tuple(slice(None) if is_requested else 0 for is_requested in requested.values())
    meanings = {**VARIABLES, **TIME_VARIABLES, **SLIP_VARIABLES, "overturned_share": ("1", _SHARE_MEANING)}
    variable_attributes = {name: {"units": units, "long_name": meaning} for name, (units, meaning) in meanings.items()}
    coordinate = product.bodies[0].coordinate if len(product.bodies) else ROTATION
    if coordinate.unit != ROTATION.unit:
        for name in ("peak_rotation", "residual_rotation"):
            variable_attributes[name]["units"] = coordinate.unit
        variable_attributes["peak_rotation"]["long_name"] = f"largest {coordinate.name} in size"
        meaning = f"whether the {coordinate.name} passed its limit, where it has one"
        variable_attributes["overturned"]["long_name"] = meaning
    variables = {
        name: (dimensions, values[part], variable_attributes.get(name, {})) for name, values in outcomes.items()
    }
    coordinates = {
        "motion": ("motion", list_motion_names(product.motions)),
        **motion_coordinates(product.motions),
        "scale": ("scale", product.scales.values, product.scales.attributes),
        "polarity": ("polarity", ["+" if sign > 0 else "-" for sign in product.signs]),
        **body_coordinates(product.bodies),
    }
    used = {name: values for name, values in coordinates.items() if values[0] in dimensions}
    attributes = {
        "program": f"rocking {VERSION}",
        "model": product.model,
        "chattering": repr(product.chattering),
        "polarity": product.polarity,
        "gravity": product.bodies.gravity,
        "motions": [f"{motion.name}: {motion.description.text}" for motion in product.motions],
        "histories": ["; ".join(motion.history) for motion in product.motions],
    }
    return xr.Dataset(variables, used, attributes)


def collect_verticals(motions: Sequence[Motion]) -> dict[str, Any]:
    """Return the vertical components as a coordinate of ``motion``, if there are any."""
    names = ["" if motion.vertical is None else motion.vertical.name for motion in motions]
    return {"vertical": ("motion", names)} if any(motion.vertical for motion in motions) else {}


def motion_coordinates(motions: Sequence[Motion]) -> dict[str, Any]:
    """Return vertical components, files, and parameters of pulses as coordinates of ``motion``, if there are any."""
    descriptions = [motion.description for motion in motions]
    coordinates = collect_verticals(motions)
    if any(files := ["" if item.origin is None else item.origin.file for item in descriptions]):
        coordinates["file"] = ("motion", files)
    for name in dict.fromkeys(name for item in descriptions for name in item.parameters):
        is_velocity = name == "amplitude" and all("Mavroeidis" in item.family for item in descriptions)
        unit = "m/s" if is_velocity else _PULSE_UNITS.get(name.partition("_")[0], "1")
        values = [item.parameters.get(name, math.nan) for item in descriptions]
        coordinates[f"pulse_{name}"] = ("motion", values, {"units": unit})
    return coordinates


def body_coordinates(bodies: Bodies) -> dict[str, Any]:
    """Return labels, and parameters with units, as coordinates of ``block``, one for each side if the sides differ."""
    columns = bodies.parameters()
    are_equal = all(np.array_equal(values[:, 0], values[:, 1], equal_nan=True) for values, _ in columns.values())
    coordinates: dict[str, Any] = {name: ("block", values, {}) for name, values in list_labels(bodies).items()}
    for name, (values, units) in columns.items():
        for k, suffix in enumerate(("",) if are_equal else ("_plus", "_minus")):
            coordinates[f"{name}{suffix}"] = ("block", values[:, k], {"units": units})
    return coordinates


def list_labels(bodies: Bodies) -> dict[str, NDArray[Any]]:
    """Return the labels of blocks by the name of their coordinate, which differs from the names of results."""
    labels = bodies.labels if isinstance(bodies, Blocks) else {}
    return {
        f"object_{name}" if name in {*_RESERVED, *bodies.parameters()} else name: values
        for name, values in labels.items()
    }


def find_labels(data: xr.Dataset) -> list[str]:
    """Return the coordinates that are labels of blocks; parameters have units."""
    block_coordinates = [str(name) for name, values in data.coords.items() if values.dims == ("block",)]
    return [name for name in block_coordinates if "units" not in data[name].attrs and name not in ("block", "weight")]


def list_block_names(data: xr.Dataset) -> list[str]:
    """Return distinct names of blocks for texts and figures: their own, or else numbers from 1."""
    names = data["name"].values if "name" in find_labels(data) else [""] * data.sizes["block"]
    return make_names_unique([str(name) or f"block {k}" for k, name in enumerate(names, start=1)])


def simulate_many(
    blocks: Bodies | Body | Sequence[Body],
    motions: Motions,
    *,
    model: Model = "nonlinear",
    chattering: str | ChatteringScheme = "certified",
    levels: ArrayLike | None = None,
    measure: MeasureName | Measure = "factor",
    polarity: Polarity = "+",
    duration: float | None = None,
    include_times: bool = False,
    friction: Friction | None = None,
    robust: bool = False,
) -> xr.Dataset:
    """Simulate every block under every motion.

    Parameters
    ----------
    blocks : Blocks, Block, RestrainedBlock or sequence of one kind
        n blocks, or other bodies (`rocking.block.body.Bodies`).
    motions : Motion, sequence of Motion, or mapping of str to Motion
        m motions. The keys of a mapping are the names of its motions.
    model, chattering : str or ChatteringScheme
        As for `simulate`.
    levels : array_like, optional
        Levels of `measure` to which every motion is scaled. Adds the dimension ``scale``.
    measure : str or Measure
        Measure of `levels` in SI units: "factor", "pga", "pgv" or another name of `Measure`, for example spectral
        accelerations (m/s^2) as ``rocking.Measure("sa", period=1.0)``.
    polarity : {"+", "-", "both"}
        Original motions, reversed motions, or both, which adds the dimension ``polarity``.
    duration : float, optional
        As for `simulate`.
    include_times : bool
        Whether to include the times of the first uplift and of the first and the last rest.
    friction : float or pair, optional
        As for `simulate`. Adds the variables lost_contact, largest_slip and residual_slip (m).
    robust : bool
        Whether to repeat every simulation with the motion scaled by 1 +- 1e-6 and 1 +- 3e-6 (`Response.perturbed`), in
        five times the computing time.

    Returns
    -------
    xarray.Dataset
        Dimensions (motion, scale, polarity, block), as far as they apply. Variables: overturned, peak_rotation (rad),
        peak_time (s), impacts (without those after a certificate), uplifts, rests, time_at_rest (s),
        complete_chattering (whether the block came to rest after its first uplift before the motion passed a threshold
        again), rests_by_rounding (rests without a certificate), unfinished, and ended_early (by `duration`, which then
        leaves overturned undetermined). `include_times` adds first_uplift, first_rest and last_rest (s, or 0 without
        such an event). `robust` adds overturned_share, the share of the five simulations that overturn. Shares other
        than 0 and 1 are undecided. Coordinates contain the names of the motions and the parameters of the blocks.

    See Also
    --------
    rocking.simulate : Simulate one block under one motion.
    rocking.Blocks : Several blocks, for example a grid.
    rocking.fragility : Fit fragility curves to such simulations.

    Notes
    -----
    The engine is the same as for `simulate`: every impact is located and chattering is proven. Under evenly sampled
    records, rocking blocks advance together through samples without events. Each result depends, bit for bit, only on
    its own block and motion.

    Examples
    --------
    >>> import rocking
    >>> blocks = rocking.Blocks.grid(p=[2.0, 4.0], alpha=[0.1, 0.2], restitution=[0.9])
    >>> motion = rocking.pulses.one_sine(amplitude=4.0, frequency=1.0)
    >>> result = rocking.simulate_many(blocks, motion, levels=[0.4, 1.0])
    >>> result.overturned.sel(scale=0.4).values.tolist()
    [[True, False, True, False]]
    """
    product = create_product(blocks, motions, levels, measure, polarity, model, chattering, duration, friction)
    names = [*VARIABLES, *(TIME_VARIABLES if checks.boolean(include_times, "include_times", OptionError) else ())]
    names += SLIP_VARIABLES if product.friction is not None else ()
    setup = create_setup(product)
    outcomes = simulate_product(product, setup, names)
    if checks.boolean(robust, "robust", OptionError):
        factors = [factor for factor in list_factors(RELATIVE_STEP, FACTOR_COUNT) if factor != 1.0]
        repeats = [simulate_product(product, setup, ["overturned"], factor) for factor in factors]
        overturned = [result["overturned"].astype(bool) for result in (outcomes, *repeats)]
        outcomes["overturned_share"] = np.mean(overturned, axis=0)
    return create_dataset(product, outcomes)


def simulate_product(
    product: SimulationProduct, setup: Setup, names: Iterable[str] = tuple(VARIABLES), perturbation: float = 1.0
) -> dict[str, NDArray[np.generic]]:
    """Simulate a product with motions scaled by a factor near 1, and return arrays by names of `OUTCOME_DTYPE`."""
    count = math.prod(product.shape)
    results: dict[str, NDArray[np.generic]] = {name: np.empty(count, dtype=OUTCOME_DTYPE[name]) for name in names}
    with Progress("simulating", count) as bar:
        for task, outcomes in simulate_tasks(setup, _generate_tasks(product, perturbation)):
            for name, values in results.items():
                values[task.key] = outcomes[name]
            bar.advance(len(outcomes))
    return {name: values.reshape(product.shape) for name, values in results.items()}
