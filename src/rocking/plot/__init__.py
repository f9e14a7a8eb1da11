"""Figures drawn from arrays, independent of the classes of the package."""
