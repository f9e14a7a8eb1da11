"""Analytic ground motions: sines, lobes, Ricker and Mavroeidis-Papageorgiou pulses, rectangles and triangles.

Each is a `Motion` whose pieces approximate the formula to 1e-15 of the largest acceleration (`Motion.error`);
rectangles and triangles are exact. Pulses start at time 0, are zero after their end, and are added with
``+``.

A new pulse goes where its like are: `sines`, `wavelets` (with an envelope), `shapes` (straight lines). All but the last
are sums of sines or derivatives of a Gaussian, whose Taylor series are known (`series`).
"""

from rocking.motion.pulses.shapes import (
    half_sine,
    mavroeidis_papageorgiou,
    n_lobe,
    one_cosine,
    one_sine,
    rectangular,
    ricker,
    sine,
    triangular,
)

__all__ = [
    "half_sine",
    "mavroeidis_papageorgiou",
    "n_lobe",
    "one_cosine",
    "one_sine",
    "rectangular",
    "ricker",
    "sine",
    "triangular",
]
