"""Long work that is kept in a folder while it goes on, so that the same call takes it up again."""

from __future__ import annotations

import hashlib
import io
import time
from collections.abc import Iterable
from pathlib import Path
from typing import Any, Final
from zipfile import BadZipFile

import numpy as np
from numpy.typing import NDArray

from rocking import checks
from rocking.constants import VERSION
from rocking.dynamics.repeated import Repeated
from rocking.errors import InvalidOption, OutputError
from rocking.tables import write_bytes

#: Seconds between two savings.
_BETWEEN: Final = 20.0


class Kept:
    """Arrays of some work in a file of a folder, with the fingerprint of the problem that they are of."""

    def __init__(self, folder: str | Path, what: str, key: str) -> None:
        self._folder, self._what, self._key = checks.path(folder, "folder", InvalidOption), what, key
        try:
            self._folder.mkdir(parents=True, exist_ok=True)
        except OSError as error:
            raise OutputError(f"{{}} cannot be made: {error.strerror}", "folder", path=str(folder)) from error
        self._file = self._folder / f"{what.replace(' ', '-')}.npz"
        self._saved = time.monotonic()

    def arrays(self) -> dict[str, NDArray[Any]]:
        """Arrays that were kept; none where the work is new.

        Raises
        ------
        InvalidOption
            If they are of another problem, or the file cannot be read.
        """
        if not self._file.exists():
            return {}
        try:
            with np.load(self._file) as kept:
                found = dict(kept)
            key = found.pop("key").item()
        except (OSError, EOFError, ValueError, KeyError, TypeError, BadZipFile) as error:
            raise InvalidOption(
                f"{{}} holds a file {self._file.name} that cannot be read; remove it, or give another folder",
                "folder", value=str(self._folder),
            ) from error  # fmt: skip
        if key != self._key:
            raise InvalidOption(
                f"{{}} holds a result of something else in {self._file.name}; give another folder",
                "folder",
                value=str(self._folder),
            )
        return found

    @property
    def is_due(self) -> bool:
        """Whether it is time to save."""
        return time.monotonic() - self._saved > _BETWEEN

    def save(self, **arrays: NDArray[Any]) -> None:
        """Keep arrays in place of those that were kept."""
        packed = io.BytesIO()
        np.savez_compressed(packed, allow_pickle=False, **arrays, key=np.array(self._key))
        write_bytes(self._file, packed.getvalue())
        self._saved = time.monotonic()


def key_of(maps: Iterable[Repeated], *others: object) -> str:
    """Fingerprint of maps, and of arrays or values that decide beside them what is computed."""
    whole = hashlib.sha256(VERSION.encode())
    for each in maps:
        for array in (each._ground.pieces, each._records):
            whole.update(np.ascontiguousarray(array).tobytes())
        whole.update(f"{each.model} {each.treatment}".encode())
    for other in others:
        whole.update(np.ascontiguousarray(other).tobytes() if isinstance(other, np.ndarray) else repr(other).encode())
    return whole.hexdigest()
