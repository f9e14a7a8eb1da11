"""Arrays for kernels, treatments of chattering, and parallel simulations."""
