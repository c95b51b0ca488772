"""Models that find and outline things in pictures; each stands behind a Protocol of `seams.py`."""
