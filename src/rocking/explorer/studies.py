"""A study as maps: its outcomes over two of the parameters that it varies."""

from __future__ import annotations

import itertools
import math
import shlex
from collections.abc import Mapping, Sized
from pathlib import Path
from typing import Any, Final, cast

import numpy as np

import rocking
from rocking.analysis.intensity import Measure, MeasureName
from rocking.arrays import Floats
from rocking.errors import InvalidOption, StudyError
from rocking.explorer.core import Payload
from rocking.explorer.inputs import texts_of_motion
from rocking.explorer.parameters import PARAMETERS
from rocking.explorer.uploads import UploadStore
from rocking.quantities import number

#: Largest map, points.
_MOST: Final = 1_000_000

#: Values of an axis that are named, or offered to choose from, at most.
_NAMED: Final = 1000

#: Parameters of a block, and the units in which a study has them.
_PARAMETERS: Final = {"p": "rad/s", "alpha": "rad", "restitution": ""}

#: What is drawn for a block of which it is not known whether it overturns: the simulation was given up, or stopped.
OPEN: Final = -1.0

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

    Blocks that are all combinations of some parameters are shown over these; others, by their number.

    Parameters
    ----------
    folder : path
        Where the study is kept.

    Raises
    ------
    StudyError
        If there is none, nothing of it is done, or it varies too little for a map.
    """

    def __init__(self, folder: Path) -> None:
        self.name = folder.name
        self.study = rocking.study(folder)
        if not self.study.status.done:
            raise StudyError(f"nothing of the study in {folder} is done yet: rocking study run {folder}")
        kept = self.study.store.grid.outcomes
        self.quantities = {name: label for name, label in QUANTITIES.items() if name in kept}
        if not self.quantities:
            raise StudyError(
                f"the study in {folder} keeps only {', '.join(kept)}; a map needs one of {', '.join(QUANTITIES)}. See "
                f"its numbers: rocking study export {folder} results.csv"
            )
        product = self.study.product
        blocks = product.blocks
        self._chosen_from: dict[str, Sized] = {
            "scale_index": product.scales.values, "motion_index": product.motions, "polarity_index": product.signs
        }  # fmt: skip
        self._columns: dict[str, Floats] = {name: getattr(blocks, name)[:, 0] for name in _PARAMETERS}
        if not (blocks.is_symmetric and _is_grid(list(self._columns.values()))):
            self._columns = {"block": np.arange(1.0, len(blocks) + 1.0)}
        if len(self.axes()) < 2:
            raise StudyError(
                f"the study in {folder} varies {' and '.join(self.axes()) or 'nothing'}; a map needs two of blocks, "
                f"motions and scales. See its numbers: rocking study report {folder}"
            )

    def axes(self) -> dict[str, Floats]:
        """Values of what the study varies."""
        found = {name: np.unique(values) for name, values in self._columns.items()}
        found["scale"] = np.asarray(self.study.product.scales.values, dtype=float)
        found["motion"] = np.arange(1.0, len(self.study.product.motions) + 1.0)
        return {name: values for name, values in found.items() if values.size > 1}

    def describe(self) -> dict[str, Any]:
        """Say what the study holds."""
        product, axes = self.study.product, self.axes()
        return {
            "name": self.name,
            "status": str(self.study.status),
            "axes": [self._described(name, axes) for name in axes],
            "fixed": {name: np.unique(values)[:_NAMED].tolist() for name, values in self._columns.items()},
            "scales": np.asarray(product.scales.values, dtype=float).tolist(),
            "motions": self._names("motion"),
            "polarities": ["+" if sign > 0 else "-" for sign in product.signs],
            "quantities": [{"name": name, "label": label} for name, label in self.quantities.items()],
        }

    def slice(self, texts: Mapping[str, str]) -> Payload:
        """Return one quantity over two parameters, the others fixed.

        Parameters
        ----------
        texts : mapping of str to str
            ``x``, ``y``: parameters; ``quantity``; ``motion_index``, ``polarity_index``, ``scale_index``; ``fix_p``,
            ``fix_alpha``, ``fix_restitution``, ``fix_block``: values of what is not drawn.

        Raises
        ------
        InvalidOption
            If the study does not vary a parameter, or has no such quantity.
        """
        axes = self.axes()
        x, y = (self._axis(texts.get(which, ""), axes) for which in ("x", "y"))
        quantity = texts.get("quantity", next(iter(self.quantities)))
        if x == y or quantity not in self.quantities:
            kept = ", ".join(self.quantities)
            raise InvalidOption(f"a map of this study needs two different axes and one quantity of {kept}")
        if axes[x].size * axes[y].size > _MOST:
            raise InvalidOption(f"{axes[x].size} by {axes[y].size} points are too many for a map")
        values = np.full((axes[y].size, axes[x].size), np.nan)
        blocks = self._blocks(texts, {x, y})
        results, product = self._drawn(quantity), self.study.product
        scales = range(len(product.scales.values)) if "scale" in (x, y) else [self._index(texts, "scale_index")]
        motions = range(len(product.motions)) if "motion" in (x, y) else [self._index(texts, "motion_index")]
        at = {
            name: np.searchsorted(axes[name], self._columns[name][blocks]) for name in (x, y) if name in self._columns
        }
        for scale, motion in itertools.product(scales, motions):
            at |= {"scale": np.full(blocks.size, scale), "motion": np.full(blocks.size, motion)}
            values[at[y], at[x]] = self._outcomes(results, texts, scale, motion)[blocks]
        script = f"results = rocking.study({self.name!r}).results()\nprint(results[{quantity!r}])\n"
        header = {
            "x": self._described(x, axes),
            "y": self._described(y, axes),
            "quantity": quantity,
            "shape": values.shape,
            "python": f"import rocking\n\n{script}",
            "command": shlex.join(["rocking", "study", "report", self.name]),
        }
        return Payload(header, {"values": values.ravel()})

    def texts_at(self, texts: Mapping[str, str], uploads: UploadStore) -> dict[str, str]:
        """Return the texts of the simulation at a point of a slice."""
        product = self.study.product
        at = {texts.get(which, ""): number(texts.get(f"at_{which}", ""), f"at_{which}") for which in ("x", "y")}
        scales = np.asarray(product.scales.values, dtype=float)
        scale = self._index(texts, "scale_index") if "scale" not in at else int(np.argmin(np.abs(scales - at["scale"])))
        motion = product.motions[self._index(texts, "motion_index") if "motion" not in at else round(at["motion"]) - 1]
        sign = product.signs[self._index(texts, "polarity_index")]
        factor = sign * float(product.scales.factors(motion)[scale])
        chosen = {name: at.get(name, self._value(name, texts)) for name in self._columns}
        found = self._texts_of_block(chosen)
        found |= texts_of_motion(motion if factor == 1.0 else motion.scaled(factor), uploads)
        found |= {"model": product.model, "chattering": str(product.treatment)}
        return found if product.duration is None else found | {"duration": repr(product.duration)}

    def _texts_of_block(self, chosen: Mapping[str, float]) -> dict[str, str]:
        if "block" not in chosen:
            return {name: repr(float(value)) for name, value in chosen.items()}
        blocks, k = self.study.product.blocks, round(chosen["block"]) - 1
        pairs = {name: getattr(blocks, name)[k] for name in _PARAMETERS}
        return {name: ",".join(repr(float(each)) for each in dict.fromkeys(pair)) for name, pair in pairs.items()}

    def _drawn(self, quantity: str) -> Any:
        """Outcome that is drawn; a verdict that a simulation left open is `OPEN`, and not that the block stands."""
        results = self.study.results()
        found = results[quantity]
        if quantity != "overturned":
            return found
        is_open = (results.unfinished + results.stopped > 0) & (found == 0)
        return found.astype(float).where(~is_open, OPEN)

    def _outcomes(self, results: Any, texts: Mapping[str, str], scale: int, motion: int) -> Floats:
        """Outcomes of all blocks under one motion at one scale."""
        polarity = self._index(texts, "polarity_index")
        chosen = {"motion": motion, "scale": scale, "polarity": polarity}
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

    def _index(self, texts: Mapping[str, str], name: str) -> int:
        """Return the number of the scale, the motion or the polarity that a text chooses, or 0."""
        count = len(self._chosen_from[name])
        wanted = number(texts.get(name) or "0", name)
        if not (0 <= wanted < count and math.floor(wanted) == wanted):
            raise InvalidOption(
                f"{{}} must be a whole number from 0 to {count - 1}, not {wanted:g}", name, value=wanted
            )
        return int(wanted)

    def _axis(self, name: str, axes: Mapping[str, Floats]) -> str:
        if name not in axes:
            raise InvalidOption(f"this study varies {', '.join(axes) or 'nothing'}, not {name[:20]!r}")
        return name

    def _label(self, name: str) -> tuple[str, str]:
        if name in _PARAMETERS:
            return PARAMETERS[name].label, _PARAMETERS[name]
        if name != "scale":
            return f"{name.capitalize()}, by its number", ""
        scales = self.study.product.scales
        if scales.measure in (None, "factor"):
            return "Factor of the motion", ""
        measure = Measure(cast(MeasureName, scales.measure), **scales.options)
        return measure.quantity.capitalize(), measure.units

    def _described(self, name: str, axes: Mapping[str, Floats]) -> dict[str, Any]:
        label, unit = self._label(name)
        found = {"name": name, "label": label, "unit": unit, "values": axes[name].tolist()}
        named = name in ("block", "motion") and len(axes[name]) <= _NAMED
        return found | {"names": self._names(name)} if named else found

    def _names(self, axis: str) -> list[str]:
        """Say what stands behind the numbers of blocks or motions."""
        if axis == "motion":
            return [str(name) for name in self.study.results().motion.values]
        texts = (self._texts_of_block({"block": k}) for k in self._columns["block"])
        return [
            f"p = {_short(each['p'])} rad/s, α = {_short(each['alpha'])} rad, η = {_short(each['restitution'])}"
            for each in texts
        ]


def _is_grid(columns: list[Floats]) -> bool:
    """Whether blocks of these parameters are all combinations of their values, each once."""
    different = len(np.unique(np.column_stack(columns), axis=0))
    return different == len(columns[0]) == math.prod(np.unique(each).size for each in columns)


def _short(text: str) -> str:
    """Write one or two numbers to four digits."""
    return ", ".join(f"{float(each):.4g}" for each in text.split(","))
