"""Single simulations and ensembles."""
