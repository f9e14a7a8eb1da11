"""Compiled functions: numbers in, numbers and a code out; they never raise."""
