"""forestall: see a failing subtask coming, explain it, replan, succeed.

Importing the package loads nothing heavy; see `docs/architecture.md` for the layers.
"""

__version__ = "0.1.0"
