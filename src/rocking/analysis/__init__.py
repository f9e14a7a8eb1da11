"""What engineers ask of many simulations: spectra, overturning maps, scaling, fragility, calibration."""
