"""What numba has compiled of a kernel, kept on disk: a file for each set of types; without it, it is compiled again.

numba's own files are an index and numbered ones. Two processes that compile a kernel at once, for different types, may
take the same number, so that the index of one leads to the code of the other. Nor does numba go on where a file is
damaged, or where nothing can be written.
"""

import contextlib
import hashlib
import os
import pickle
import tempfile
from pathlib import Path
from typing import Any

import numba
from numba.core.caching import CompileResultCacheImpl, FunctionCache
from numba.core.serialize import dumps

_HASH = hashlib.sha256().digest_size


class _OneFolder(CompileResultCacheImpl):
    """What numba keeps, in the folder that it is told: others are not named by the sources of all kernels."""

    # Older versions of numba have an underscore before the name.
    _locator_classes = tuple(
        each
        for each in CompileResultCacheImpl._locator_classes
        if each.__name__.removeprefix("_") == "UserProvidedCacheLocator"
    )


class KernelCache(FunctionCache):
    """numba's cache of a function, with files of our own; a `RuntimeError` where the folder cannot be written any more.

    In the folder numba makes one for each place of sources.
    """

    _impl_class = _OneFolder

    def __init__(self, function: Any) -> None:
        super().__init__(function)
        stamp = numba.__version__, self._impl.locator.get_source_stamp()
        self._cache_file = _Files(Path(self._cache_path), self._impl.filename_base, stamp)

    def _load_overload(self, sig: Any, target_context: Any) -> Any:
        # What is not as it was written may be anything, and so may be the error.
        with contextlib.suppress(Exception):
            return super()._load_overload(sig, target_context)

    def _save_overload(self, sig: Any, data: Any) -> None:
        with contextlib.suppress(OSError):
            super()._save_overload(sig, data)


class _Files:
    """Files in a folder: each holds a hash of the rest, what it was compiled from and for, and the code."""

    def __init__(self, folder: Path, base: str, stamp: Any) -> None:
        self._folder, self._base, self._stamp = folder, base, stamp

    def _path(self, key: Any) -> Path:
        return self._folder / f"{self._base}.{hashlib.sha256(str(key).encode()).hexdigest()[:16]}.nbc"

    def load(self, key: Any) -> Any:
        """Return what is kept for a key; None if there is nothing, or it is damaged or of another source."""
        try:
            content = self._path(key).read_bytes()
        except OSError:
            return None
        if hashlib.sha256(content[_HASH:]).digest() != content[:_HASH]:
            return None
        made_for, data = pickle.loads(content[_HASH:])
        return data if made_for == (self._stamp, key) else None

    def save(self, key: Any, data: Any) -> None:
        """Keep something for a key: whole, or not at all."""
        content = dumps(((self._stamp, key), data))
        descriptor, unfinished = tempfile.mkstemp(dir=self._folder, prefix=".", suffix=".part")
        try:
            with os.fdopen(descriptor, "wb") as file:
                file.write(hashlib.sha256(content).digest() + content)
            Path(unfinished).replace(self._path(key))
        except BaseException:
            with contextlib.suppress(OSError):
                Path(unfinished).unlink()
            raise

    def flush(self) -> None:
        """Remove what is kept."""
        for each in self._folder.glob(f"{self._base}.*.nbc"):
            each.unlink(missing_ok=True)
