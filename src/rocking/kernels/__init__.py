"""Compiled leaves: numbers in, numbers and a status out; they never raise."""
