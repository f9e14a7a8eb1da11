"""Ensembles of walls, of blocks with restraints and of laws of restitution against single simulations of the same.

    python stress/walls.py --pairs 20000 --seed 1

Random bodies of each kind, in both models, under records and pulses with and without a vertical component: verdicts,
numbers of uplifts and of rests must be equal and peaks within 1e-9, unless the single simulation calls itself ambiguous
(amb.), or changes as much where its motion is changed by few ulps (expl.). Prints a table, and exits with status 1 on
any other difference. What is drawn is in `tests/oracles/standing.py`.
"""

import argparse
import sys
import time
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "tests"))

from oracles.standing import OF_ENSEMBLES, Count, lanes_and_single

_COLUMNS = (
    "pairs",
    "overturned",
    "never up",
    "ambiguous",
    "explained",
    "different",
    "worst",
    "worst expl.",
    "worst amb.",
)


def row(kind: str, found: Count) -> str:
    """Line of the table."""
    numbers = (found.pairs, found.overturned, found.still, found.ambiguous, found.explained, len(found.different))
    worst = (found.worst, found.worst_explained, found.worst_ambiguous)
    return f"{kind:24}" + "".join(f"{n:12d}" for n in numbers) + "".join(f"{x:12.2g}" for x in worst)


def main() -> int:
    """Compare, print, and say whether anything differs."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--pairs", type=int, default=2_000)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--kind", choices=OF_ENSEMBLES, action="append")
    given = parser.parse_args()
    start, different = time.process_time(), 0
    print(f"{'body':24}" + "".join(f"{word:>12}" for word in _COLUMNS), flush=True)
    for kind in given.kind or OF_ENSEMBLES:
        found = lanes_and_single(kind, given.seed, given.pairs)
        print(row(kind, found), flush=True)
        for where in found.different[:20]:
            print(f"    {where}", flush=True)
        different += len(found.different)
    print(f"{time.process_time() - start:.0f} s of processor time, seed {given.seed}")
    return 1 if different else 0


if __name__ == "__main__":
    sys.exit(main())
