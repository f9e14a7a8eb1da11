"""Compiled functions, which accept numbers, return numbers and a code, and never raise."""
