"""What a reader took a file for."""

from __future__ import annotations

from typing import NamedTuple


class Identification(NamedTuple):
    """A file's format, and what in its content says so."""

    format: str
    reason: str
