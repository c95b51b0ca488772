"""Models that find and outline things in pictures, behind Protocols of `seams/perceiving.py`."""
