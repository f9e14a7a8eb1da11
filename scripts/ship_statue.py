"""Make the mesh of a statue that ships with the package: a plinth, a figure of revolution, and a head off its axis.

    python scripts/ship_statue.py [FILE]

writes ``src/rocking/solid/data/statue.obj``, or FILE. Every cross-section of figure and head is a regular polygon of
SEGMENTS corners, so that what the mesh encloses is known in closed form. Nothing of it was measured on a statue.
"""

import math
import sys
from pathlib import Path

FILE = Path(__file__).resolve().parents[1] / "src" / "rocking" / "solid" / "data" / "statue.obj"

SEGMENTS = 36

#: Sizes of the plinth, m: to the east, to the north, up.
PLINTH = (0.44, 0.44, 0.2)

#: Height above the plinth and radius, m, of the figure's cross-sections.
FIGURE = (
    (0.0, 0.19), (0.06, 0.2), (0.2, 0.185), (0.4, 0.16), (0.6, 0.15), (0.75, 0.16), (0.9, 0.18), (1.05, 0.2),
    (1.15, 0.205), (1.22, 0.18), (1.26, 0.12), (1.29, 0.075),
)  # fmt: skip

#: Axes of the figure and of the head, from the middle of the plinth: to the east and to the north, m.
FIGURE_AT = (0.02, 0.0)
HEAD_AT = (0.09, 0.03)
_NECK, _HEAD = 0.07, 0.13
#: Height above the figure and radius, m, of the head's cross-sections: a ball that is cut off at the neck.
HEAD = tuple(
    (_HEAD * (math.cos(start) - math.cos(angle)), _HEAD * math.sin(angle))
    for start in (math.asin(_NECK / _HEAD),)
    for k in range(13)
    for angle in (start + (math.pi - start) * k / 13,)
)
HEAD_TOP = _HEAD * (1.0 + math.cos(math.asin(_NECK / _HEAD)))

Corner = tuple[float, float, float]


def revolved(
    profile: tuple[tuple[float, float], ...], at: Corner, top: float | None
) -> tuple[list[Corner], list[tuple[int, int, int]]]:
    """Return corners and triangles of rings of corners, with a corner in the middle of the lowest, and one on top."""
    east, north, up = at
    turns = [2.0 * math.pi * k / SEGMENTS for k in range(SEGMENTS)]
    corners = [
        (east + radius * math.cos(turn), north + radius * math.sin(turn), up + height)
        for height, radius in profile
        for turn in turns
    ]
    rings = len(profile)
    faces: list[tuple[int, int, int]] = []
    for ring in range(rings - 1):
        for k in range(SEGMENTS):
            here, there = ring * SEGMENTS + k, ring * SEGMENTS + (k + 1) % SEGMENTS
            faces += [(here, there, there + SEGMENTS), (here, there + SEGMENTS, here + SEGMENTS)]
    low, high = len(corners), len(corners) + 1
    corners += [(east, north, up + profile[0][0]), (east, north, up + (profile[-1][0] if top is None else top))]
    for k in range(SEGMENTS):
        after, last = (k + 1) % SEGMENTS, (rings - 1) * SEGMENTS
        faces += [(after, k, low), (last + k, last + after, high)]
    return corners, faces


def parts() -> dict[str, tuple[list[Corner], list[tuple[int, int, int]]]]:
    """Return corners and triangles of all parts by name."""
    x, y, z = 0.5 * PLINTH[0], 0.5 * PLINTH[1], PLINTH[2]
    box = [(a, b, c) for c in (0.0, z) for b in (-y, y) for a in (-x, x)]
    sides = [(0, 2, 3, 1), (4, 5, 7, 6), (0, 1, 5, 4), (1, 3, 7, 5), (3, 2, 6, 7), (2, 0, 4, 6)]
    faces = [face for a, b, c, d in sides for face in ((a, b, c), (a, c, d))]
    shoulder = z + FIGURE[-1][0]
    return {
        "plinth": (box, faces),
        "figure": revolved(FIGURE, (*FIGURE_AT, z), None),
        "head": revolved(HEAD, (*HEAD_AT, shoulder), HEAD_TOP),
    }


def main() -> None:
    """Write the file."""
    lines = ["# A statue of three closed parts, in m, z up; made by scripts/ship_statue.py."]
    first = 1
    for name, (corners, faces) in parts().items():
        lines += [f"o {name}"]
        lines += ["v " + " ".join(f"{value:.9f}".rstrip("0").rstrip(".") for value in corner) for corner in corners]
        lines += ["f " + " ".join(str(first + k) for k in face) for face in faces]
        first += len(corners)
    target = Path(sys.argv[1]) if len(sys.argv) > 1 else FILE
    target.parent.mkdir(parents=True, exist_ok=True)
    target.write_text("\n".join(lines) + "\n", "utf-8")


if __name__ == "__main__":
    main()
