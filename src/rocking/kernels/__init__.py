"""Compiled functions. They accept and return numbers, report failure by a code, and never raise."""
