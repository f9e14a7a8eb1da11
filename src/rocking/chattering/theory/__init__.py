"""The paper's dimensionless theory of chattering under a sine, and its exact counterpart."""
