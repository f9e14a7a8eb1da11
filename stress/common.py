"""What the trials share: a study of some dozens of short batches, and the digest of all that a study is."""

import hashlib
from pathlib import Path

import numpy as np

import rocking
from rocking.studies import Study

BLOCKS = rocking.Blocks(p=np.linspace(1.0, 6.0, 1300), alpha=0.2, restitution=0.9)


def made(folder: Path, scales: int = 8) -> Study:
    """Make a study of six batches for each scale, of a hundredth of a second, or open it."""
    motions = [rocking.records.load(name) for name in ("el-centro-meloland-270", "el-centro-meloland-360")]
    return rocking.create_study(
        folder, BLOCKS, motions, levels=np.linspace(2.0, 9.0, scales), measure="pga", blocks_per_batch=512
    )


def digest(folder: Path) -> str:
    """Hash of every file of a study: its name and its bytes."""
    total = hashlib.sha256()
    for path in sorted(folder.rglob("*")):
        if path.is_file() and path.name != "lock":
            total.update(f"{path.relative_to(folder)}".encode() + b"\0" + path.read_bytes())
    return total.hexdigest()


def batches(folder: Path) -> dict[str, bytes]:
    """Bytes of every batch that is done, by its name."""
    return {path.name: path.read_bytes() for path in (folder / "batches").glob("batch.*")}
