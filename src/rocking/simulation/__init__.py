"""One simulation, and many."""
