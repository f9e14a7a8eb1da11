"""Print a table of the record files of a folder by format: counts, steps, and peaks divided by the stated ones."""

from __future__ import annotations

import sys
from collections import defaultdict
from pathlib import Path

import numpy as np

from rocking.errors import RecordError
from rocking.records import Channel, channels, identify
from rocking.records.formats.declared import Header
from rocking.records.units import Unit


def read_files(folder: Path) -> list[str]:
    """Return a table with a row for each format, and a line for each file that is not read."""
    found: dict[str, list[tuple[list[float], tuple[Channel, ...]]]] = defaultdict(list)
    unread, stated, find_peaks = list[str](), list[float](), Header.find_peaks

    def find_and_keep(header: Header, count: int, unit: Unit) -> list[float]:
        peaks = find_peaks(header, count, unit)
        stated.extend([*peaks, *[0.0] * count][:count])
        return peaks

    setattr(Header, "find_peaks", find_and_keep)  # noqa: B010 - mypy allows no other assignment
    for path in sorted(path for path in folder.rglob("*") if path.is_file()):
        stated.clear()
        try:
            contents = channels(path)
            found[identify(path).format].append(([*stated], contents))
        except RecordError as error:
            unread.append(f"not read: {error}".replace(f"{folder}/", ""))
    lines = ["| `format` | Files | Channels | Values | Step, s | Peak read / stated |", "|---|---|---|---|---|---|"]
    for name, files in found.items():
        read = [channel for _, contents in files for channel in contents]
        counts, steps = [len(channel.acceleration) for channel in read], [channel.dt or 0.0 for channel in read]
        ratios = [
            float(np.abs(channel.acceleration - offset).max()) / peak
            for peaks, contents in files
            for channel, peak in zip(contents, peaks, strict=False)
            for offset in [float(channel.acceleration.mean()) if channel.is_raw else 0.0]
            if peak
        ]
        texts = [
            f"{len(files)}",
            f"{len(read)}",
            f"{min(counts)} to {max(counts)}",
            f"{min(steps):g} to {max(steps):g}",
        ]
        texts.append(f"{min(ratios):.3f} to {max(ratios):.3f}" if ratios else "not stated")
        lines.append(f"| `{name}` | {' | '.join(texts)} |")
    return lines + unread


if __name__ == "__main__":
    print("\n".join(read_files(Path(sys.argv[1]))))
