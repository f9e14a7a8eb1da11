"""Checks and broadcasting of the dimensionless parameters."""

from __future__ import annotations

from typing import Final

import numpy as np
from numpy.typing import ArrayLike, NDArray

from rocking import checks
from rocking.arrays import Floats
from rocking.errors import InvalidOption

#: Frequencies (forcing over the block's p) for which double precision resolves the problem.
LOWEST_FREQUENCY: Final = 1e-6
HIGHEST_FREQUENCY: Final = 1e6

#: Closer to one a sequence takes more than a million impacts; at one it never ends.
LARGEST_RESTITUTION: Final = 0.99999


def checked_amplitude(a: ArrayLike) -> Floats:
    """Return amplitudes as an array; any finite number is one."""
    return _finite(a, "a", "the acceleration amplitude over g alpha")


def checked_frequency(omega: ArrayLike) -> Floats:
    """Return frequencies as an array."""
    values = _finite(omega, "omega", "the forcing frequency over p")
    usable = (values >= LOWEST_FREQUENCY) & (values <= HIGHEST_FREQUENCY)
    _require(usable, values, "omega", f"between {LOWEST_FREQUENCY:g} and {HIGHEST_FREQUENCY:g}")
    return values


def checked_restitution(eta: ArrayLike) -> Floats:
    """Return coefficients of restitution as an array."""
    values = _finite(eta, "eta", "the coefficient of restitution")
    usable = (values > 0.0) & ((values <= LARGEST_RESTITUTION) | (values == 1.0))
    _require(usable, values, "eta", f"above 0 and at most {LARGEST_RESTITUTION:g}, or exactly 1")
    return values


def checked_loss(eta: ArrayLike) -> Floats:
    """Return coefficients of restitution below one as an array."""
    values = checked_restitution(eta)
    if (values == 1.0).any():
        raise InvalidOption("{} must be below 1 here: without loss at impacts chattering never ends", "eta", value=eta)
    return values


def checked_slenderness(alpha: ArrayLike) -> Floats:
    """Return slenderness angles as an array."""
    values = _finite(alpha, "alpha", "the slenderness angle in rad")
    _require((values > 0.0) & (values < 0.5 * np.pi), values, "alpha", "between 0 and pi/2 rad")
    return values


def single(values: Floats, name: str) -> float:
    """Return the one value of a parameter that may not be an array."""
    if values.ndim:
        raise InvalidOption(f"{{}} must be a single number here, not an array of shape {values.shape}", name)
    return float(values)


def lifting_amplitude(a: ArrayLike, *, above: bool = False) -> float:
    """Return one amplitude that lifts the block; where it must be above 1, one that also makes it rock."""
    amplitude = single(checked_amplitude(a), "a")
    if amplitude < 1.0 or (above and amplitude == 1.0):
        bound = "above" if above else "at least"
        raise InvalidOption(f"{{}} must be {bound} 1, or the block does not lift off, not {amplitude:g}", "a", value=a)
    return amplitude


def broadcast(*parameters: Floats) -> tuple[tuple[int, ...], list[Floats]]:
    """Return the common shape of the parameters, and each as a flat array of that size."""
    try:
        shape = np.broadcast_shapes(*(parameter.shape for parameter in parameters))
    except ValueError:
        shapes = ", ".join(str(parameter.shape) for parameter in parameters)
        raise InvalidOption(f"the parameters' shapes {shapes} do not broadcast: make them compatible") from None
    return shape, [np.broadcast_to(parameter, shape).ravel() for parameter in parameters]


def _finite(given: ArrayLike, name: str, meaning: str) -> Floats:
    values = checks.numbers(given, name, InvalidOption)
    _require(np.isfinite(values), values, name, f"finite ({meaning})")
    return values


def _require(usable: NDArray[np.bool_], values: Floats, name: str, condition: str) -> None:
    if usable.all():
        return
    index = np.argwhere(~usable)[0]
    where = f" at index {tuple(map(int, index))}" if values.ndim else ""
    value = float(values[tuple(index)])
    raise InvalidOption(f"{{}} must be {condition}, not {value:g}{where}", name, value=value)
