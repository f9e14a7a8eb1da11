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
from rocking.errors import OptionError, StudyError
from rocking.explorer.motions import motion_to_texts
from rocking.explorer.payload import Payload, phrase
from rocking.explorer.uploads import UploadStore
from rocking.inputs.quantities import read_number
from rocking.inputs.texts import write_path
from rocking.motion.scaling import FACTOR

#: Largest map, points.
_MAX_POINTS: Final = 1_000_000

#: Maximum number of axis values that are named or offered as choices.
_MAX_NAMES: Final = 1000

#: Parameters of a block, and their units in a study.
_PARAMETERS: Final = {"p": "rad/s", "alpha": "rad", "restitution": ""}

#: Value of blocks with unknown outcome, because the simulation was abandoned or stopped.
UNDECIDED: Final = -1.0

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
        self._choices: dict[str, Sized] = {
            "scale_index": self._scales, "motion_index": product.motions, "polarity_index": product.signs
        }  # fmt: skip
        self._columns: dict[str, Floats] = {name: getattr(blocks, name)[:, 0] for name in _PARAMETERS}
        columns = [*self._columns.values()]
        distinct = len(np.unique(np.column_stack(columns), axis=0))
        combinations = math.prod(np.unique(column).size for column in columns)
        if not (blocks.is_symmetric and distinct == len(blocks) == combinations):
            self._columns = {"block": np.arange(1.0, len(blocks) + 1.0)}
        if len(self.axes()) < 2:
            raise StudyError(
                f"the study in {folder} varies {' and '.join(self.axes()) or 'nothing'}; a map needs two of blocks, "
                f"motions and scales. See its numbers: rocking study report {folder}"
            )

    def axes(self) -> dict[str, Floats]:
        """Values of the varied parameters."""
        values_by_name = {name: np.unique(values) for name, values in self._columns.items()}
        values_by_name["scale"] = np.unique(self._scales)
        values_by_name["motion"] = np.arange(1.0, len(self.study.product.motions) + 1.0)
        return {name: values for name, values in values_by_name.items() if values.size > 1}

    def describe(self) -> dict[str, Any]:
        """Describe the study."""
        product, axes = self.study.product, self.axes()
        return {
            "name": self.name,
            "status": str(self.study.status),
            "axes": [self._describe_axis(name, axes) for name in axes],
            "fixed": {name: np.unique(values)[:_MAX_NAMES].tolist() for name, values in self._columns.items()},
            "scales": self._scales.tolist(),
            "motions": self._list_names("motion"),
            "polarities": ["+" if sign > 0 else "-" for sign in product.signs],
            "quantities": self.quantities,
        }

    def slice(self, texts: Mapping[str, str]) -> Payload:
        """Return one quantity over ``x`` and ``y``; texts such as ``motion_index`` and ``fix_p`` fix the others."""
        axes = self.axes()
        x, y = (texts.get(direction, "") for direction in ("x", "y"))
        for direction, name in {"x": x, "y": y}.items():
            checks.choice(name, direction, OptionError, [*axes])
        quantity = texts.get("quantity", self.quantities[0])
        checks.choice(quantity, "quantity", OptionError, [*self.quantities])
        if x == y:
            raise OptionError("{} and {} must be two different parameters of the study", "x", "y")
        if axes[x].size * axes[y].size > _MAX_POINTS:
            raise OptionError(f"{axes[x].size} by {axes[y].size} points are too many for a map")
        values = np.full((axes[y].size, axes[x].size), np.nan)
        fixed = [
            column == self._find_value(name, texts) for name, column in self._columns.items() if name not in (x, y)
        ]
        blocks = np.flatnonzero(np.all([np.ones(len(self.study.product.blocks), bool), *fixed], axis=0))
        results, product = self._select_outcome(quantity), self.study.product
        scales = range(len(self._scales)) if "scale" in (x, y) else [self._read_index(texts, "scale_index")]
        motions = range(len(product.motions)) if "motion" in (x, y) else [self._read_index(texts, "motion_index")]
        indices = {
            name: np.searchsorted(axes[name], self._columns[name][blocks]) for name in (x, y) if name in self._columns
        }
        for scale, motion in itertools.product(scales, motions):
            level = np.searchsorted(np.unique(self._scales), self._scales[scale])  # a study's scales may be unsorted
            indices |= {"scale": np.full(blocks.size, level), "motion": np.full(blocks.size, motion)}
            selection = {"motion": motion, "scale": scale, "polarity": self._read_index(texts, "polarity_index")}
            selected = results.isel({name: k for name, k in selection.items() if name in results.dims})
            values[indices[y], indices[x]] = np.asarray(selected.values, dtype=float)[blocks]
        script = f"results = rocking.Study({self.name!r}).results()\nprint(results[{quantity!r}])\n"
        header = {
            "x": self._describe_axis(x, axes),
            "y": self._describe_axis(y, axes),
            "quantity": quantity,
            "shape": values.shape,
            "python": f"import rocking\n\n{script}",
            "command": shlex.join(["rocking", "study", "report", write_path(self.name)]),
        }
        return Payload(header, {"values": values.ravel()})

    def point_to_texts(self, texts: Mapping[str, str], uploads: UploadStore) -> dict[str, str]:
        """Return the texts of the simulation at a point of a slice."""
        product = self.study.product
        point = {texts.get(direction, ""): self._read_coordinate(texts, direction) for direction in ("x", "y")}
        nearest_scale = np.argmin(np.abs(self._scales - point.get("scale", 0.0)))
        scale = int(nearest_scale) if "scale" in point else self._read_index(texts, "scale_index")
        motion = product.motions[
            int(point["motion"]) - 1 if "motion" in point else self._read_index(texts, "motion_index")
        ]
        sign = product.signs[self._read_index(texts, "polarity_index")]
        factor = sign * float(product.scales.factors(motion)[scale])
        block_values = {name: [point.get(name, self._find_value(name, texts))] for name in self._columns}
        block = self._find_parameters(block_values["block"][0]) if "block" in block_values else block_values
        point_texts = {name: ",".join(map(repr, values)) for name, values in block.items()}
        point_texts |= motion_to_texts(motion, uploads, factor)
        point_texts |= {"model": product.model, "chattering": str(product.chattering)}
        if product.blocks.gravity != STANDARD_GRAVITY:
            point_texts["gravity"] = repr(float(product.blocks.gravity))
        return point_texts if product.duration is None else point_texts | {"duration": repr(product.duration)}

    def _read_coordinate(self, texts: Mapping[str, str], direction: str) -> float:
        """Return a coordinate of a point of a slice; on an axis of indices it must be one of them."""
        coordinate = read_number(texts.get(f"at_{direction}", ""), f"at_{direction}")
        last = {"motion": len(self.study.product.motions), "block": len(self.study.product.blocks)}.get(
            texts.get(direction, ""), 0
        )
        if not math.isfinite(coordinate) or (last and not 1 <= round(coordinate) <= last):
            expected = f"a number from 1 to {last}" if last else "a finite number"
            raise OptionError(f"{{}} must be {expected}, not {coordinate:g}", f"at_{direction}", value=coordinate)
        return float(round(coordinate)) if last else coordinate

    def _find_parameters(self, block: float) -> dict[str, list[float]]:
        """Return the parameters of a block by its number: one value each, or two if the sides differ."""
        pairs = {name: getattr(self.study.product.blocks, name)[round(block) - 1] for name in _PARAMETERS}
        return {name: list(dict.fromkeys(map(float, pair))) for name, pair in pairs.items()}

    def _select_outcome(self, quantity: str) -> Any:
        """Return the outcome to draw, or `UNDECIDED` if the simulation left it open."""
        results = self.study.results()
        outcomes = results[quantity]
        if quantity != "overturned":
            return outcomes
        is_open = (results.unfinished + results.stopped > 0) & (outcomes == 0)
        return outcomes.astype(float).where(~is_open, UNDECIDED)

    def _find_value(self, name: str, texts: Mapping[str, str]) -> float:
        """Return the value of the study that is nearest to a text, or the first."""
        values = np.unique(self._columns[name])
        text = texts.get(f"fix_{name}")
        return float(values[0] if not text else values[np.argmin(np.abs(values - read_number(text, name)))])

    def _read_index(self, texts: Mapping[str, str], name: str) -> int:
        """Return the index of the scale, motion or polarity in a text, or 0."""
        count = len(self._choices[name])
        index = read_number(texts.get(name) or "0", name)
        if not (0 <= index < count and math.floor(index) == index):
            raise OptionError(f"{{}} must be a whole number from 0 to {count - 1}, not {index:g}", name, value=index)
        return int(index)

    def _find_label(self, name: str) -> tuple[dict[str, Any] | str, str]:
        if name != "scale":
            return phrase(f"axis.{name}"), _PARAMETERS.get(name, "")
        measure = self.study.product.scales.measure or FACTOR
        return measure.quantity.capitalize(), "" if measure.units == "1" else measure.units

    def _describe_axis(self, name: str, axes: Mapping[str, Floats]) -> dict[str, Any]:
        label, unit = self._find_label(name)
        description = {"name": name, "label": label, "unit": unit, "values": axes[name].tolist()}
        is_named = name in ("block", "motion") and len(axes[name]) <= _MAX_NAMES
        return description | {"names": self._list_names(name)} if is_named else description

    def _list_names(self, axis: str) -> list[str]:
        """Return the names of numbered blocks or motions."""
        if axis == "motion":
            return [str(name) for name in self.study.results().motion.values]
        blocks = map(self._find_parameters, self._columns["block"])
        rows = [
            {name: ", ".join(f"{number:.4g}" for number in pair) for name, pair in block.items()} for block in blocks
        ]
        return [f"p = {row['p']} rad/s, α = {row['alpha']} rad, η = {row['restitution']}" for row in rows]
