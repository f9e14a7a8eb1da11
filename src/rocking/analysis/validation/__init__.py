"""Validation: what blocks predict of tests, judged against what was observed in them."""
