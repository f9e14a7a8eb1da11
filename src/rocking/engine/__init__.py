"""Arrays for kernels, chattering schemes, and parallel simulations."""
