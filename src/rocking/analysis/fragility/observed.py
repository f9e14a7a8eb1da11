"""Outcomes that were observed, as `rocking fragility --outcomes` reads them: what fell, and how it was shaken."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from rocking.analysis.calibration.tables import Table, outcomes_of, read_table
from rocking.analysis.hazard import HEADINGS, heading_of
from rocking.errors import InvalidOption, UnreadableRecord
from rocking.motion.scaling import Measure
from rocking.tables import counted


def read_observed(
    path: Path, measure: Measure, *, channel: str | None = None, dt: float | None = None, units: str | None = None
) -> dict[str, Any]:
    """Read a table of observed outcomes as arguments of `fit_fragility`.

    Parameters
    ----------
    path : Path
        CSV table with a column overturned (1 or 0, yes or no; with a column trials, how many of them), and either an
        intensity (pga_g, pga_m_s2, pgv_m_s, pgv_cm_s, sa_g or sa_m_s2; "PGA (g)" is pga_g as well) or a motion (a
        record file, or a shipped record; with columns scale and channel where wanted). A column group holds labels of
        outcomes that belong together, as those of one earthquake; tests under one motion do in any case.
    measure : Measure
        What is taken of motions; the period and damping of a spectral acceleration in the table.
    channel, dt, units
        What record files do not say.

    Raises
    ------
    UnreadableRecord
        If it is no such table, or a cell or a record cannot be read; the message has the line.
    InvalidOption
        If the measure counts in a block's own unit, or a spectral acceleration has no period.
    """
    table = read_table(path)
    names = {heading_of(cell): cell for cell in table.columns}
    found = [name for name in names if name in HEADINGS]
    if "overturned" not in names or len(found) + ("motion" in names) != 1:
        raise UnreadableRecord(
            f"{path}, line 1: the columns must be overturned and either motion or one of {', '.join(HEADINGS)}, "
            f"not {','.join(table.columns)}"
        )
    observed: dict[str, Any]
    if found:
        observed = _against_intensity(table, names, found[0], measure)
    else:
        observed = _under_motions(table, measure, channel=channel, dt=dt, units=units)
    outcomes = round(float(np.sum(np.broadcast_to(observed["trials"], len(table.rows)))))
    return observed | {"description": f"{counted(outcomes, 'observed outcome')} in {path.name}"}


def _against_intensity(table: Table, names: dict[str, str], heading: str, measure: Measure) -> dict[str, Any]:
    kind, factor = HEADINGS[heading]
    if kind == "sa" and measure.period is None:
        raise InvalidOption("give {} (s) of its spectral acceleration", "period", path=str(table.path))
    counts = "trials" in names
    return {
        "intensity": factor * table.numbers(names[heading]),
        "exceeded": table.numbers(names["overturned"]) if counts else [*table.answers(names["overturned"])],
        "trials": table.numbers(names["trials"]) if counts else 1,
        "clusters": [row[names["group"]] for _, row in table.rows] if "group" in names else None,
        "measure": measure if kind == "sa" else Measure(kind),
    }


def _under_motions(table: Table, measure: Measure, **files: Any) -> dict[str, Any]:
    if measure.in_block_units:
        raise InvalidOption(f"{measure.name} counts in a block's own unit, which outcomes do not tell: take pga")
    tests = outcomes_of(table, **files)
    return {
        "intensity": [measure.value(motion) for motion in tests.motions],
        "exceeded": [*tests.overturned],
        "trials": 1,
        "clusters": tests.groups or [row["motion"] for _, row in table.rows],
        "measure": measure,
    }
