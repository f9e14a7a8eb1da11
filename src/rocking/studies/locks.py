"""Locks on open files: held by one process at a time, gone with it, on POSIX systems and on Windows."""

from __future__ import annotations

import sys
from typing import IO

#: Where a file is locked on Windows: beyond all that is written, since nobody reads what is locked there.
_BEYOND = 1 << 30

if sys.platform == "win32":
    import msvcrt

    def take(file: IO[str]) -> bool:
        """Lock a file unless somebody else has; whether it is locked."""
        file.seek(_BEYOND)
        try:
            msvcrt.locking(file.fileno(), msvcrt.LK_NBLCK, 1)
        except PermissionError:
            return False
        return True

    def leave(file: IO[str]) -> None:
        """Unlock a file."""
        file.seek(_BEYOND)
        msvcrt.locking(file.fileno(), msvcrt.LK_UNLCK, 1)

else:
    import fcntl

    def take(file: IO[str]) -> bool:
        """Lock a file unless somebody else has; whether it is locked."""
        try:
            fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except (BlockingIOError, PermissionError):
            return False
        return True

    def leave(file: IO[str]) -> None:
        """Unlock a file."""
        fcntl.flock(file, fcntl.LOCK_UN)
