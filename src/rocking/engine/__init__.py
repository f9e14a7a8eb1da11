"""Arrays for kernels, treatments of chattering, and many simulations as tasks in threads."""
