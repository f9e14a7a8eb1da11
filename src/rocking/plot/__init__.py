"""Figures drawn from arrays; this layer knows no class of the package."""

from rocking.plot.response import DrawnSequence, response_figure

__all__ = ["DrawnSequence", "response_figure"]
