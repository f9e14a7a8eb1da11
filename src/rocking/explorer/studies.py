"""A study as maps: its outcomes over two of the parameters that it varies."""

from __future__ import annotations

import math
from collections.abc import Mapping
from pathlib import Path
from typing import Any, Final

import numpy as np

import rocking
from rocking.arrays import Floats
from rocking.errors import InvalidOption, StudyError
from rocking.explorer.case import texts_of_motion
from rocking.explorer.core import Payload
from rocking.explorer.shelf import Shelf
from rocking.quantities import number

#: Largest map, points.
_MOST: Final = 1_000_000

_LABELS: Final = {
    "p": ("Frequency parameter p", "rad/s"),
    "alpha": ("Slenderness α", "rad"),
    "restitution": ("Restitution η", ""),
    "scale": ("Scale", ""),
}

#: Quantities of a study that are drawn.
QUANTITIES: Final = {
    "overturned": "Overturns",
    "peak_rotation": "Peak rotation, rad",
    "impacts": "Impacts",
    "rests": "Rests",
    "time_at_rest": "Time at rest, s",
}


class StudyView:
    """A study in a folder, slice by slice.

    Parameters
    ----------
    folder : path
        Where the study is kept.

    Raises
    ------
    StudyError
        If there is none, nothing of it is done, or its blocks have two sides.
    """

    def __init__(self, folder: Path) -> None:
        self.name = folder.name
        self.study = rocking.study(folder)
        if not self.study.status.done:
            raise StudyError(f"nothing of the study in {folder} is done yet: rocking study run {folder}")
        product = self.study.product
        if not product.blocks.is_symmetric:
            raise StudyError("the blocks of this study have two sides; a map shows symmetric ones")
        self._columns = {name: getattr(product.blocks, name)[:, 0] for name in ("p", "alpha", "restitution")}

    def axes(self) -> dict[str, Floats]:
        """Values of what the study varies."""
        found = {name: np.unique(values) for name, values in self._columns.items()}
        found["scale"] = np.asarray(self.study.product.scales.values, dtype=float)
        return {name: values for name, values in found.items() if values.size > 1}

    def describe(self) -> dict[str, Any]:
        """Say what the study holds."""
        product = self.study.product
        results = self.study.results()
        return {
            "name": self.name,
            "status": str(self.study.status),
            "axes": [
                {"name": name, "label": self._label(name)[0], "unit": self._label(name)[1], "values": values.tolist()}
                for name, values in self.axes().items()
            ],
            "fixed": {name: np.unique(values).tolist() for name, values in self._columns.items()},
            "scales": np.asarray(product.scales.values, dtype=float).tolist(),
            "motions": [str(name) for name in results.motion.values],
            "polarities": ["+" if sign > 0 else "-" for sign in product.signs],
            "quantities": [{"name": name, "label": label} for name, label in QUANTITIES.items()],
        }

    def slice(self, texts: Mapping[str, str]) -> Payload:
        """Return one quantity over two parameters, the others fixed.

        Parameters
        ----------
        texts : mapping of str to str
            ``x``, ``y``: parameters; ``quantity``; ``motion_index``, ``polarity_index``, ``scale_index``; ``fix_p``,
            ``fix_alpha``, ``fix_restitution``: values of what is not drawn.

        Raises
        ------
        InvalidOption
            If the study does not vary a parameter, or has no such quantity.
        """
        axes = self.axes()
        x, y = (self._axis(texts.get(which, ""), axes) for which in ("x", "y"))
        quantity = texts.get("quantity", "overturned")
        if x == y or quantity not in QUANTITIES:
            raise InvalidOption("a map of a study needs two different axes and one of its quantities")
        if axes[x].size * axes[y].size > _MOST:
            raise InvalidOption(f"{axes[x].size} by {axes[y].size} points are too many for a map")
        values = np.full((axes[y].size, axes[x].size), np.nan)
        blocks = self._blocks(texts, {x, y})
        scales = range(len(self.study.product.scales.values)) if "scale" in (x, y) else [self._scale(texts)]
        for scale in scales:
            outcome = self._outcomes(texts, scale, quantity)[blocks]
            at = {name: np.searchsorted(axes[name], self._columns[name][blocks]) for name in (x, y) if name != "scale"}
            at["scale"] = np.full(blocks.size, scale)
            values[at[y], at[x]] = outcome
        header = {
            "x": self._described(x, axes),
            "y": self._described(y, axes),
            "quantity": quantity,
            "shape": values.shape,
        }
        return Payload(header, {"values": values.ravel()})

    def texts_at(self, texts: Mapping[str, str], shelf: Shelf) -> dict[str, str]:
        """Return the texts of the simulation at a point of a slice."""
        product = self.study.product
        at = {texts.get(which, ""): number(texts.get(f"at_{which}", ""), f"at_{which}") for which in ("x", "y")}
        scales = np.asarray(product.scales.values, dtype=float)
        scale = self._scale(texts) if "scale" not in at else int(np.argmin(np.abs(scales - at["scale"])))
        motion = product.motions[self._index(texts, "motion_index", len(product.motions))]
        sign = product.signs[self._index(texts, "polarity_index", len(product.signs))]
        factor = sign * float(product.scales.factors(motion)[scale])
        found = {name: repr(float(at.get(name, self._value(name, texts)))) for name in self._columns}
        found |= texts_of_motion(motion if factor == 1.0 else motion.scaled(factor), shelf)
        found |= {"model": product.model, "chattering": str(product.treatment)}
        return found if product.duration is None else found | {"duration": repr(product.duration)}

    def _outcomes(self, texts: Mapping[str, str], scale: int, quantity: str) -> Floats:
        """Outcomes of all blocks under one motion at one scale."""
        results = self.study.results()[quantity]
        chosen = {
            "motion": self._index(texts, "motion_index", len(self.study.product.motions)),
            "scale": scale,
            "polarity": self._index(texts, "polarity_index", len(self.study.product.signs)),
        }
        found = results.isel({name: k for name, k in chosen.items() if name in results.dims})
        return np.asarray(found.values, dtype=float)

    def _blocks(self, texts: Mapping[str, str], drawn: set[str]) -> np.ndarray[Any, np.dtype[np.intp]]:
        """Blocks whose fixed parameters have their values."""
        keep = np.ones(len(self.study.product.blocks), dtype=bool)
        for name, values in self._columns.items():
            if name not in drawn:
                keep &= values == self._value(name, texts)
        return np.flatnonzero(keep)

    def _value(self, name: str, texts: Mapping[str, str]) -> float:
        """Value of the study that is nearest to what a text says, or the first."""
        values = np.unique(self._columns[name])
        wanted = texts.get(f"fix_{name}")
        return float(values[0] if not wanted else values[np.argmin(np.abs(values - number(wanted, name)))])

    def _scale(self, texts: Mapping[str, str]) -> int:
        return self._index(texts, "scale_index", len(self.study.product.scales.values))

    def _index(self, texts: Mapping[str, str], name: str, count: int) -> int:
        wanted = number(texts.get(name) or "0", name)
        if not (0 <= wanted < count and math.floor(wanted) == wanted):
            raise InvalidOption(f"{name} must be a whole number from 0 to {count - 1}, not {wanted:g}")
        return int(wanted)

    def _axis(self, name: str, axes: Mapping[str, Floats]) -> str:
        if name not in axes:
            raise InvalidOption(f"this study varies {', '.join(axes) or 'nothing'}, not {name[:20]!r}")
        return name

    def _label(self, name: str) -> tuple[str, str]:
        scales = self.study.product.scales
        return (str(scales.measure), scales.units) if name == "scale" else _LABELS[name]

    def _described(self, name: str, axes: Mapping[str, Floats]) -> dict[str, Any]:
        label, unit = self._label(name)
        return {"name": name, "label": label, "unit": unit, "values": axes[name].tolist()}
