"""Comparison of observed and expected scenes: the paper's score, differences, preconditions."""
