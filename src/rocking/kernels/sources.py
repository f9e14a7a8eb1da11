"""What kernels were compiled from. This imports the standard library alone, for a build of the package runs it, too."""

import hashlib
from pathlib import Path


def sources(folder: Path) -> str:
    """Hash of all kernels' sources."""
    digest = hashlib.sha256()
    for source in sorted(folder.rglob("*.py")):
        digest.update(str(source.relative_to(folder)).encode() + b"\0" + source.read_bytes() + b"\0")
    return digest.hexdigest()[:16]
