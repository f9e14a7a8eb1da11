"""The equations of motion that can be solved."""

from typing import Final, Literal

#: Exact, or linearised for slender blocks (paper, Eqs 2 and 3).
Model = Literal["nonlinear", "linear"]

MODELS: Final[tuple[Model, ...]] = ("nonlinear", "linear")
