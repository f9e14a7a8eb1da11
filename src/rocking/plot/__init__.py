"""Figures drawn from arrays; this layer knows no class of the package."""
