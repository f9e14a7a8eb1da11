"""Physical constants shared by every layer."""

from typing import Final

#: Standard acceleration of gravity, m/s^2; readers and blocks use the same value.
STANDARD_GRAVITY: Final = 9.80665

#: Highest degree of a motion's pieces: an arc's series takes two powers more.
HIGHEST_DEGREE: Final = 20

#: Version of the package.
VERSION: Final = "0.1.0"
