"""Names of motions and of curves, from the dataset of an analysis, and numbers of what has one label."""

from __future__ import annotations

import math
from collections.abc import Hashable, Sequence
from typing import TYPE_CHECKING

import numpy as np

from rocking import checks
from rocking.arrays import Integers
from rocking.errors import InvalidOption
from rocking.motion.description import labelled

if TYPE_CHECKING:
    import xarray as xr


def numbered(labels: Sequence[object]) -> Integers:
    """Give each label that is new the next number."""
    places: dict[object, int] = {}
    return np.array([places.setdefault(label, len(places)) for label in labels], dtype=np.int64)


def groups_of(labels: object, name: str, count: int, each: str = "outcome") -> Integers:
    """Numbers of given labels, one for each of so many; what has None, NaN or no text for a label is on its own."""
    given = checks.several(labels, name, InvalidOption)
    if len(given) != count or not all(isinstance(label, Hashable) for label in given):
        raise InvalidOption(f"{{}} must hold {count} labels, numbers or texts, one for each {each}", name, value=labels)
    return numbered([(k,) if _is_missing(label) else label for k, label in enumerate(given)])


def _is_missing(label: object) -> bool:
    # The missing value of pandas is equal to nothing, and no truth value either.
    return label is None or type(label).__name__ == "NAType" or label == "" or _is_nan(label)


def _is_nan(label: object) -> bool:
    return isinstance(label, float) and math.isnan(label)


def labels_of(data: xr.Dataset, of: str = "motion", *, with_history: bool = True) -> list[str]:
    """Names of the motions, or of their records, with their vertical components and with what was done to them."""
    names = data[of].values
    verticals = data.vertical.values if "vertical" in data.coords else [""] * len(names)
    histories = data.histories if with_history else [""] * len(names)
    return [
        labelled(str(name), done.split("; ") if done else [], str(vertical))
        for name, done, vertical in zip(names, histories, verticals, strict=True)
    ]


def motions_in_words(data: xr.Dataset) -> str:
    """Name the motion, or count them, and those that were scaled or processed among them."""
    labels = labels_of(data)
    changed = sum(bool(done) for done in data.histories)
    if len(labels) == 1:
        return labels[0]
    which = "all" if changed == len(labels) else f"{changed} of them"
    return f"{len(labels)} motions" + (f", {which} scaled or processed" if changed else "")


def curves_of(data: xr.Dataset) -> list[tuple[str, xr.Dataset]]:
    """Name and select each combination of slenderness and restitution; the blocks of an ensemble are one curve."""
    if "block" in data.dims:
        return [(data.blocks, data)]
    stacked = data.stack(curve=[name for name in ("alpha", "restitution") if name in data.dims])
    return [(_curve_name(one), one) for one in (stacked.isel(curve=k) for k in range(stacked.sizes["curve"]))]


def _curve_name(one: xr.Dataset) -> str:
    restitution = f", restitution {float(one.restitution):g}" if "restitution" in one.coords else ""
    return f"alpha = {float(one.alpha):.5g} rad ({math.degrees(one.alpha):.4g}°){restitution}"
