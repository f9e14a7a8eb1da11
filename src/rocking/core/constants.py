"""Shared constants, and the equations of motion."""

from typing import Final, Literal

#: Standard acceleration of gravity of readers and blocks, m/s^2.
STANDARD_GRAVITY: Final = 9.80665

#: Highest degree of a motion's pieces. The series of an arc exceeds it by two.
HIGHEST_DEGREE: Final = 20

#: Version of the package.
VERSION: Final = "0.1.0"

#: Equation of finite rotations, or linearised for slender blocks (paper, Eqs 2 and 3).
Model = Literal["nonlinear", "linear"]

MODELS: Final[tuple[Model, ...]] = ("nonlinear", "linear")
