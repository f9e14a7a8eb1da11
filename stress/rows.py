"""Rows of a table that are measured one by one: each stays, with its date, until it is measured anew."""

import datetime
import json
from collections.abc import Mapping
from pathlib import Path
from typing import Any


def with_earlier(table: Path, measured: Mapping[str, Mapping[str, Any]]) -> dict[str, dict[str, Any]]:
    """Add the date to rows that were measured now; returns them with those of earlier runs, kept beside the table."""
    kept = table.with_suffix(".json")
    rows: dict[str, dict[str, Any]] = json.loads(kept.read_text("utf-8")) if kept.exists() else {}
    today = datetime.date.today().isoformat()
    rows |= {name: {**row, "date": today} for name, row in measured.items()}
    kept.write_text(json.dumps(rows, indent=1, sort_keys=True) + "\n", "utf-8")
    return rows


def markdown(heads: tuple[str, ...], rows: Mapping[str, tuple[object, ...]], missing: str) -> list[str]:
    """Lines of a table, the first column of which names the rows; one without cells says what is missing."""
    lines = ["| " + " | ".join(heads) + " |", "|---" + "|--:" * (len(heads) - 1) + "|"]
    for name, cells in rows.items():
        filled = cells or (missing, *[""] * (len(heads) - 2))
        lines.append("| " + " | ".join(map(str, (name, *filled))) + " |")
    return lines
