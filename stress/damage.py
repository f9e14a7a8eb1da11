"""Flip bits of a study's files and cut them short: every damage is seen, or does not change what is read.

python stress/damage.py --trials 1000
"""

import argparse
import tempfile
from collections import Counter
from pathlib import Path

import numpy as np
import xarray as xr
from common import digest, made

import rocking


def damaged(data: bytes, rng: np.random.Generator) -> bytes:
    """Flip one bit, or cut off the end."""
    if rng.random() < 0.3:
        return data[: int(rng.integers(len(data)))]
    changed = bytearray(data)
    changed[rng.integers(len(data))] ^= 1 << int(rng.integers(8))
    return bytes(changed)


def seen(folder: Path, name: str, reference: xr.Dataset) -> str:
    """Whether the damage of a file is reported when it is read; if not, that what is read is the same."""
    try:
        study = rocking.Study(folder)
        faults = study.verify()
    except rocking.errors.StudyError as error:
        assert "damaged" in str(error)
        return "reported when the study is opened"
    if faults:
        assert len(faults) == 1
        assert Path(name).name in faults[0]
        return "reported by verify"
    assert study.results().load().identical(reference)
    return "harmless: the same is read"


def main() -> None:
    """Damage one file after the other, and repair it."""
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("--trials", type=int, default=1000)
    parser.add_argument("--seed", type=int, default=0)
    given = parser.parse_args()
    rng = np.random.default_rng(given.seed)
    found: Counter[tuple[str, str]] = Counter()
    with tempfile.TemporaryDirectory() as where:
        folder = Path(where)
        with rocking.set_options(threads=1):
            made(folder).run()
        reference, expected = rocking.Study(folder).results().load(), digest(folder)
        files = [path for path in sorted(folder.rglob("*")) if path.is_file() and path.name != "lock"]
        for _ in range(given.trials):
            # The file that describes a study as often as a fifth of all.
            path = folder / "study.npz" if rng.random() < 0.2 else files[rng.integers(len(files))]
            sound = path.read_bytes()
            path.write_bytes(damaged(sound, rng))
            what = seen(folder, str(path), reference)
            found["unit" if path.name.startswith("unit.") else path.name, what] += 1
            if what == "reported when the study is opened":
                path.write_bytes(sound)
            else:
                rocking.Study(folder).verify(repair=True)
            assert digest(folder) == expected
    for (file, what), count in sorted(found.items()):
        print(f"{count:5d}  {file}: {what}")


if __name__ == "__main__":
    main()
