"""Figures drawn from arrays; this layer knows no class of the package."""

from rocking.plot.response import ChatteringSequence, response_figure

__all__ = ["ChatteringSequence", "response_figure"]
