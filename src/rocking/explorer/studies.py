"""Study as maps: its outcomes over two of its parameters."""

from __future__ import annotations

import itertools
import math
import shlex
from collections.abc import Mapping, Sized
from pathlib import Path
from typing import Any, Final

import numpy as np

import rocking
from rocking.core import checks
from rocking.core.arrays import Floats
from rocking.core.constants import STANDARD_GRAVITY
from rocking.errors import InvalidOption, StudyError
from rocking.explorer.motions import texts_of_motion
from rocking.explorer.payload import Payload, phrase
from rocking.explorer.uploads import UploadStore
from rocking.inputs.quantities import number
from rocking.inputs.texts import as_path
from rocking.motion.scaling import FACTOR

#: Largest map, points.
_MOST: Final = 1_000_000

#: Maximum number of axis values that are named or offered as choices.
_NAMED: Final = 1000

#: Parameters of a block, and their units in a study.
_PARAMETERS: Final = {"p": "rad/s", "alpha": "rad", "restitution": ""}

#: Value of blocks with unknown outcome, because the simulation was abandoned or stopped.
OPEN: Final = -1.0

#: Quantities of a study that can be drawn.
QUANTITIES: Final = ("overturned", "peak_rotation", "impacts", "rests", "time_at_rest")


class StudyView:
    """Slices of a study in a folder, over the parameters of its blocks' grid, or else over their number."""

    def __init__(self, folder: Path) -> None:
        self.name = folder.name
        self.study = rocking.Study(folder)
        if not self.study.status.done:
            raise StudyError(f"nothing of the study in {folder} is done yet: rocking study run {folder}")
        self.quantities = [*QUANTITIES]
        product = self.study.product
        blocks = product.blocks
        self._scales = np.asarray(product.scales.values, dtype=float)
        self._chosen_from: dict[str, Sized] = {
            "scale_index": self._scales, "motion_index": product.motions, "polarity_index": product.signs
        }  # fmt: skip
        self._columns: dict[str, Floats] = {name: getattr(blocks, name)[:, 0] for name in _PARAMETERS}
        columns = [*self._columns.values()]
        different = len(np.unique(np.column_stack(columns), axis=0))
        combinations = math.prod(np.unique(each).size for each in columns)
        if not (blocks.is_symmetric and different == len(blocks) == combinations):
            self._columns = {"block": np.arange(1.0, len(blocks) + 1.0)}
        if len(self.axes()) < 2:
            raise StudyError(
                f"the study in {folder} varies {' and '.join(self.axes()) or 'nothing'}; a map needs two of blocks, "
                f"motions and scales. See its numbers: rocking study report {folder}"
            )

    def axes(self) -> dict[str, Floats]:
        """Values of the varied parameters."""
        found = {name: np.unique(values) for name, values in self._columns.items()}
        found["scale"] = np.unique(self._scales)
        found["motion"] = np.arange(1.0, len(self.study.product.motions) + 1.0)
        return {name: values for name, values in found.items() if values.size > 1}

    def describe(self) -> dict[str, Any]:
        """Describe the study."""
        product, axes = self.study.product, self.axes()
        return {
            "name": self.name,
            "status": str(self.study.status),
            "axes": [self._described(name, axes) for name in axes],
            "fixed": {name: np.unique(values)[:_NAMED].tolist() for name, values in self._columns.items()},
            "scales": self._scales.tolist(),
            "motions": self._names("motion"),
            "polarities": ["+" if sign > 0 else "-" for sign in product.signs],
            "quantities": self.quantities,
        }

    def slice(self, texts: Mapping[str, str]) -> Payload:
        """Return one quantity over ``x`` and ``y``; texts such as ``motion_index`` and ``fix_p`` fix the others."""
        axes = self.axes()
        x, y = (texts.get(which, "") for which in ("x", "y"))
        for which, name in {"x": x, "y": y}.items():
            checks.one_of(name, which, InvalidOption, [*axes])
        quantity = texts.get("quantity", self.quantities[0])
        checks.one_of(quantity, "quantity", InvalidOption, [*self.quantities])
        if x == y:
            raise InvalidOption("{} and {} must be two different parameters of the study", "x", "y")
        if axes[x].size * axes[y].size > _MOST:
            raise InvalidOption(f"{axes[x].size} by {axes[y].size} points are too many for a map")
        values = np.full((axes[y].size, axes[x].size), np.nan)
        fixed = [column == self._value(name, texts) for name, column in self._columns.items() if name not in (x, y)]
        blocks = np.flatnonzero(np.all([np.ones(len(self.study.product.blocks), bool), *fixed], axis=0))
        results, product = self._drawn(quantity), self.study.product
        scales = range(len(self._scales)) if "scale" in (x, y) else [self._index(texts, "scale_index")]
        motions = range(len(product.motions)) if "motion" in (x, y) else [self._index(texts, "motion_index")]
        at = {
            name: np.searchsorted(axes[name], self._columns[name][blocks]) for name in (x, y) if name in self._columns
        }
        for scale, motion in itertools.product(scales, motions):
            level = np.searchsorted(np.unique(self._scales), self._scales[scale])  # a study's scales may be unsorted
            at |= {"scale": np.full(blocks.size, level), "motion": np.full(blocks.size, motion)}
            chosen = {"motion": motion, "scale": scale, "polarity": self._index(texts, "polarity_index")}
            found = results.isel({name: k for name, k in chosen.items() if name in results.dims})
            values[at[y], at[x]] = np.asarray(found.values, dtype=float)[blocks]
        script = f"results = rocking.Study({self.name!r}).results()\nprint(results[{quantity!r}])\n"
        header = {
            "x": self._described(x, axes),
            "y": self._described(y, axes),
            "quantity": quantity,
            "shape": values.shape,
            "python": f"import rocking\n\n{script}",
            "command": shlex.join(["rocking", "study", "report", as_path(self.name)]),
        }
        return Payload(header, {"values": values.ravel()})

    def texts_at(self, texts: Mapping[str, str], uploads: UploadStore) -> dict[str, str]:
        """Return the texts of the simulation at a point of a slice."""
        product = self.study.product
        at = {texts.get(which, ""): self._at(texts, which) for which in ("x", "y")}
        nearest = np.argmin(np.abs(self._scales - at.get("scale", 0.0)))
        scale = int(nearest) if "scale" in at else self._index(texts, "scale_index")
        motion = product.motions[int(at["motion"]) - 1 if "motion" in at else self._index(texts, "motion_index")]
        sign = product.signs[self._index(texts, "polarity_index")]
        factor = sign * float(product.scales.factors(motion)[scale])
        chosen = {name: [at.get(name, self._value(name, texts))] for name in self._columns}
        block = self._parameters(chosen["block"][0]) if "block" in chosen else chosen
        found = {name: ",".join(map(repr, values)) for name, values in block.items()}
        found |= texts_of_motion(motion, uploads, factor)
        found |= {"model": product.model, "chattering": str(product.chattering)}
        if product.blocks.gravity != STANDARD_GRAVITY:
            found["gravity"] = repr(float(product.blocks.gravity))
        return found if product.duration is None else found | {"duration": repr(product.duration)}

    def _at(self, texts: Mapping[str, str], which: str) -> float:
        """Return a coordinate of a point of a slice; on an axis of indices it must be one of them."""
        at = number(texts.get(f"at_{which}", ""), f"at_{which}")
        last = {"motion": len(self.study.product.motions), "block": len(self.study.product.blocks)}.get(
            texts.get(which, ""), 0
        )
        if not math.isfinite(at) or (last and not 1 <= round(at) <= last):
            wanted = f"a number from 1 to {last}" if last else "a finite number"
            raise InvalidOption(f"{{}} must be {wanted}, not {at:g}", f"at_{which}", value=at)
        return float(round(at)) if last else at

    def _parameters(self, block: float) -> dict[str, list[float]]:
        """Return the parameters of a block by its number: one value each, or two if the sides differ."""
        pairs = {name: getattr(self.study.product.blocks, name)[round(block) - 1] for name in _PARAMETERS}
        return {name: list(dict.fromkeys(map(float, pair))) for name, pair in pairs.items()}

    def _drawn(self, quantity: str) -> Any:
        """Return the outcome to draw, or `OPEN` if the simulation left it open."""
        results = self.study.results()
        found = results[quantity]
        if quantity != "overturned":
            return found
        is_open = (results.unfinished + results.stopped > 0) & (found == 0)
        return found.astype(float).where(~is_open, OPEN)

    def _value(self, name: str, texts: Mapping[str, str]) -> float:
        """Return the value of the study that is nearest to a text, or the first."""
        values = np.unique(self._columns[name])
        wanted = texts.get(f"fix_{name}")
        return float(values[0] if not wanted else values[np.argmin(np.abs(values - number(wanted, name)))])

    def _index(self, texts: Mapping[str, str], name: str) -> int:
        """Return the index of the scale, motion or polarity in a text, or 0."""
        count = len(self._chosen_from[name])
        wanted = number(texts.get(name) or "0", name)
        if not (0 <= wanted < count and math.floor(wanted) == wanted):
            raise InvalidOption(
                f"{{}} must be a whole number from 0 to {count - 1}, not {wanted:g}", name, value=wanted
            )
        return int(wanted)

    def _label(self, name: str) -> tuple[dict[str, Any] | str, str]:
        if name != "scale":
            return phrase(f"axis.{name}"), _PARAMETERS.get(name, "")
        measure = self.study.product.scales.measure or FACTOR
        return measure.quantity.capitalize(), "" if measure.units == "1" else measure.units

    def _described(self, name: str, axes: Mapping[str, Floats]) -> dict[str, Any]:
        label, unit = self._label(name)
        found = {"name": name, "label": label, "unit": unit, "values": axes[name].tolist()}
        named = name in ("block", "motion") and len(axes[name]) <= _NAMED
        return found | {"names": self._names(name)} if named else found

    def _names(self, axis: str) -> list[str]:
        """Return the names of numbered blocks or motions."""
        if axis == "motion":
            return [str(name) for name in self.study.results().motion.values]
        blocks = map(self._parameters, self._columns["block"])
        shown = [{name: ", ".join(f"{each:.4g}" for each in pair) for name, pair in block.items()} for block in blocks]
        return [f"p = {each['p']} rad/s, α = {each['alpha']} rad, η = {each['restitution']}" for each in shown]
