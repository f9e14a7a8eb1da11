"""Shared foundation: checks, numbers with units, results, tables and files, progress, threads."""
