"""Critical scales of a study: neighbouring scales between which a verdict on a block changes."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any, Final, Literal, get_args

import numpy as np

from rocking import checks
from rocking.arrays import Flags, Floats
from rocking.ensemble import body_coordinates, dataset_of, verticals_of
from rocking.errors import InvalidOption
from rocking.studies.inputs import require
from rocking.studies.store import Store

if TYPE_CHECKING:
    import xarray as xr

StudyVerdict = Literal["overturning", "complete_chattering"]

#: How a dataset names a verdict on the higher scale, and what that means.
_ABOVE: Final[Mapping[str, tuple[str, str]]] = {
    "overturning": ("overturns", "whether the scale above overturns the block, and the one below does not"),
    "complete_chattering": ("completes", "whether chattering is complete at the scale above, and not at the one below"),
}

#: Outcomes that a verdict follows from, besides those that are always kept.
_NEEDED: Final[Mapping[str, Sequence[str]]] = {
    "overturning": ("overturned",),
    "complete_chattering": ("rests", "complete_chattering"),
}


def critical_scales(store: Store, verdict: StudyVerdict) -> xr.Dataset:
    """Label the changes of a verdict in a study whose units are done, as `Study.critical_scales`."""
    import xarray as xr

    checks.one_of(verdict, "verdict", InvalidOption, get_args(StudyVerdict))
    require(store.grid.outcomes, _NEEDED[verdict], f"a critical scale of {verdict.replace('_', ' ')}")
    product, levels = store.product, store.product.scales.values
    if product.scales.count < 2 or not np.all(np.diff(levels) > 0.0):
        raise InvalidOption("critical scales lie between two scales or more, in increasing order: give those")
    store.require_complete()
    holds, known = np.zeros(store.grid.shape, bool), np.zeros(store.grid.shape, bool)
    for key in store.grid:
        here = store.grid.ranges(key)
        holds[here], known[here] = _verdicts(verdict, store.present(key))
    # An unknown verdict takes the last known one below: else a change with unknown verdicts inside would be lost.
    below = np.zeros(store.grid.shape, np.int64)  # number of that scale; -1 where no verdict is known so far
    for k in range(product.scales.count):
        below[:, k] = np.where(known[:, k], k, below[:, k - 1] if k else -1)
        np.copyto(holds[:, k], holds[:, k - 1], where=~known[:, k])
    changed = (holds[:, 1:] != holds[:, :-1]) & (below[:, :-1] >= 0)
    motion, polarity, block, scale = np.nonzero(changed.transpose(0, 2, 3, 1))
    low = below[motion, scale, polarity, block]
    above, meaning = _ABOVE[verdict]
    whole, about = dataset_of(product, {}), product.scales.about
    units = {"units": about["units"]}
    of_blocks: dict[str, Any] = {
        name: ("change", np.asarray(values)[block], attributes)
        for name, (_, values, attributes) in body_coordinates(product.bodies).items()
    }
    return xr.Dataset(
        {
            "low": ("change", levels[low], units | {"long_name": "scale below the change"}),
            "high": ("change", levels[scale + 1], units | {"long_name": "scale above the change"}),
            above: ("change", holds[motion, scale + 1, polarity, block], {"long_name": meaning}),
            "known": ("change", low == scale, {"long_name": "whether the verdicts of all simulations are known"}),
        },
        {
            "motion": ("change", whole.motion.values[motion]),
            **{
                name: ("change", np.array(verticals)[motion])
                for name, (_, verticals) in verticals_of(product.motions).items()
            },
            "polarity": ("change", np.where(np.array(product.signs)[polarity] > 0, "+", "-")),
            "block": ("change", block),
            **of_blocks,
        },
        whole.attrs | {name: value for name, value in about.items() if name != "units"},
    )


def _verdicts(verdict: str, outcomes: Mapping[str, Floats]) -> tuple[Flags, Flags]:
    """Return whether a verdict holds in each simulation, and whether that is known.

    A block that had not overturned when its simulation was given up or stopped may do so later.
    """
    known = (outcomes["unfinished"] == 0.0) & (outcomes["stopped"] == 0.0)
    if verdict == "overturning":
        return outcomes["overturned"] != 0.0, known
    known = (known | (outcomes["rests"] != 0.0)) & (outcomes["stalled"] == 0.0)
    return outcomes["complete_chattering"] != 0.0, known
