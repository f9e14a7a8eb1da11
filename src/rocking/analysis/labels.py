"""Names of motions and of curves, from the dataset of an analysis."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

from rocking.motion.description import labelled

if TYPE_CHECKING:
    import xarray as xr


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
