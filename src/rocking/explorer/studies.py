"""Study as maps: its outcomes over two of its parameters."""

from __future__ import annotations

import math
import shlex
from collections.abc import Mapping
from pathlib import Path
from typing import Any, Final

import numpy as np

import rocking
from rocking.block import Block
from rocking.core import checks
from rocking.core.arrays import Floats
from rocking.errors import OptionError, StudyError
from rocking.explorer.inputs import block_to_texts
from rocking.explorer.motions import motion_to_texts
from rocking.explorer.parameters import read_count
from rocking.explorer.payload import Payload
from rocking.explorer.uploads import UploadStore
from rocking.inputs.quantities import read_number
from rocking.inputs.texts import format_path
from rocking.motion.scaling import FACTOR

#: Largest map, points, and maximum number of named or offered values of a parameter.
_MAX_POINTS: Final = 1_000_000
_MAX_NAMES: Final = 1000

#: Parameters of a block, and their units in a study.
_PARAMETER_UNITS: Final = {"p": "rad/s", "alpha": "rad", "restitution": ""}

#: Value of blocks with unknown outcome, because the simulation was abandoned or stopped.
UNDECIDED: Final = -1.0

#: Quantities of a study that can be drawn.
QUANTITIES: Final = ("overturned", "peak_rotation", "impacts", "rests", "time_at_rest")


class StudyView:
    """Slices of a study in a folder, over its motions and scales and the parameters (or numbers) of its blocks.

    Attributes
    ----------
    axes : dict of str to ndarray
        Increasing values of each parameter.
    """

    def __init__(self, folder: Path) -> None:
        self.name, self.study = folder.name, rocking.Study(folder)
        if not self.study.status.done_count:
            raise StudyError(f"nothing of the study in {folder} is done yet: rocking study run {folder}")
        product = self.study.product
        blocks, scales = product.blocks, np.asarray(product.scales.values, dtype=float)
        columns = {name: getattr(blocks, name)[:, 0] for name in _PARAMETER_UNITS}
        grid = {name: np.unique(column) for name, column in columns.items()}
        distinct_count = len(np.unique(np.column_stack([*columns.values()]), axis=0))
        if not (blocks.is_symmetric and distinct_count == len(blocks) == math.prod(map(len, grid.values()))):
            grid = columns = {"block": np.arange(1.0, len(blocks) + 1.0)}
        self._grid: dict[str, Floats] = grid
        positions = [np.searchsorted(grid[name], column) for name, column in columns.items()]
        shape = [len(values) for values in grid.values()]
        self._blocks = np.argsort(np.ravel_multi_index(positions, shape)).reshape(shape)  # positions on the grid
        self._scales = np.argsort(scales)  # a study's scales may be unsorted
        motions = np.arange(1.0, len(product.motions) + 1.0)
        self.axes = {**grid, "scale": scales[self._scales], "motion": motions, "polarity": np.array(product.signs)}
        self._varied = [name for name, values in self.axes.items() if len(values) > 1 and name != "polarity"]
        if len(self._varied) < 2:
            raise StudyError(
                f"the study in {folder} varies {' and '.join(self._varied) or 'nothing'}; a map needs two of blocks, "
                f"motions and scales. See its numbers: rocking study report {folder}"
            )

    def describe(self) -> dict[str, Any]:
        """Describe the study: the axes of its maps, and the choices for parameters that are no axis."""
        signs = ["+" if sign > 0 else "-" for sign in self.study.product.signs]
        choices = {name: values[:_MAX_NAMES].tolist() for name, values in self.axes.items()}
        return {
            "name": self.name,
            "status": str(self.study.status),
            "axes": [self._describe_axis(name) for name in self._varied],
            "choices": choices | {"motion": self._list_motions(), "polarity": signs},
            "quantities": [*QUANTITIES],
        }

    def select(self, texts: Mapping[str, str]) -> Payload:
        """Return one quantity over ``x`` and ``y``; texts such as ``motion_index`` and ``p_index`` fix the others."""
        x, y = (checks.choice(texts.get(direction), direction, OptionError, self._varied) for direction in ("x", "y"))
        quantity = checks.choice(texts.get("quantity", QUANTITIES[0]), "quantity", OptionError, [*QUANTITIES])
        shape = len(self.axes[y]), len(self.axes[x])
        if x == y:
            raise OptionError("{} and {} must be two different parameters of the study", "x", "y")
        if math.prod(shape) > _MAX_POINTS:
            raise OptionError(f"{shape[1]} by {shape[0]} points are too many for a map")
        selected = {name: slice(None) if name in (x, y) else self._read_index(texts, name) for name in self.axes}
        blocks = self._blocks[tuple(selected.pop(name) for name in self._grid)]
        positions = {**selected, "scale": self._scales[selected["scale"]], "block": blocks.ravel()}
        results = self.study.results()
        results = results.isel({name: position for name, position in positions.items() if name in results.dims})
        values = results[quantity]
        if quantity == "overturned":
            is_undecided = (results.unfinished + results.ended_early > 0) & (values == 0)
            values = values.astype(float).where(~is_undecided, UNDECIDED)
        order = [name for name in ("motion", "scale", *self._grid) if name in (x, y)]
        by_dimension = values.transpose(*[name for name in ("motion", "scale", "block") if name in values.dims])
        drawn = np.asarray(by_dimension, dtype=float).reshape([len(self.axes[name]) for name in order])
        script = f"results = rocking.Study({self.name!r}).results()\nprint(results[{quantity!r}])\n"
        header = {
            "x": self._describe_axis(x),
            "y": self._describe_axis(y),
            "quantity": quantity,
            "shape": shape,
            "python": f"import rocking\n\n{script}",
            "command": shlex.join(["rocking", "study", "report", format_path(self.name)]),
        }
        return Payload(header, {"values": (drawn if order == [y, x] else drawn.T).ravel()})

    def point_to_texts(self, texts: Mapping[str, str], uploads: UploadStore) -> dict[str, str]:
        """Return the texts of the simulation nearest to a point of a slice."""
        product, index = self.study.product, {name: self._read_index(texts, name) for name in self.axes}
        for direction in ("x", "y"):
            name = checks.choice(texts.get(direction), direction, OptionError, self._varied)
            coordinate = read_number(texts.get(f"at_{direction}", ""), f"at_{direction}")
            checks.finite(coordinate, f"at_{direction}", OptionError)
            index[name] = int(np.argmin(np.abs(self.axes[name] - coordinate)))
        block, motion = self._blocks[tuple(index[name] for name in self._grid)], product.motions[index["motion"]]
        factor = product.signs[index["polarity"]] * float(product.scales.factors(motion)[self._scales[index["scale"]]])
        sides = {name: getattr(product.blocks, name)[block].tolist() for name in _PARAMETER_UNITS}
        parameters = Block.from_parameters(**sides, gravity=float(product.blocks.gravity))
        point_texts = block_to_texts(parameters) | motion_to_texts(motion, uploads, factor)
        point_texts |= {"model": product.model, "chattering": str(product.chattering)}
        return point_texts if product.duration is None else point_texts | {"duration": repr(product.duration)}

    def _read_index(self, texts: Mapping[str, str], name: str) -> int:
        """Return the index of a parameter's value in a text, or 0."""
        return read_count(texts.get(f"{name}_index") or "0", f"{name}_index", 0, len(self.axes[name]) - 1)

    def _describe_axis(self, name: str) -> dict[str, Any]:
        description = {"name": name, "unit": _PARAMETER_UNITS.get(name, ""), "values": self.axes[name].tolist()}
        if name == "scale":
            measure = self.study.product.scales.measure or FACTOR
            unit = "" if measure.units == "1" else measure.units
            description |= {"label": measure.quantity.capitalize(), "unit": unit}
        is_named = name == "motion" and len(self.axes[name]) <= _MAX_NAMES
        return description | {"names": self._list_motions()} if is_named else description

    def _list_motions(self) -> list[str]:
        return [str(name) for name in self.study.results().motion.values]
