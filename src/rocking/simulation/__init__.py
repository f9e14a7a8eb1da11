"""One simulation, many simulations, and derivatives of their peaks."""
