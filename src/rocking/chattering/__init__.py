"""The dimensionless theory of chattering under a sine: asymptotic, semi-analytical, series, exact."""
