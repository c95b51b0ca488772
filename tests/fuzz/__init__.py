"""Damaged inputs over every reader; see `__main__.py`."""
