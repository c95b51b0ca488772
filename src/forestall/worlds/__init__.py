"""Worlds that a robot acts in, each a plug-in of its own."""
