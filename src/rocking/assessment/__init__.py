"""Assessment of named objects under records: computation, and its report as one HTML page."""
