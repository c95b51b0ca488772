"""One composition root: configuration → objects; the one place that imports implementations."""
