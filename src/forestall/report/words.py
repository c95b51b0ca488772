"""Numbers as pages say them; called by whatever draws one, calls nothing."""

from __future__ import annotations


def duration(seconds: float) -> str:
    """Seconds in words, with a unit that keeps it short."""
    if seconds == 0:
        return "0 s"
    if abs(seconds) >= 100:
        return f"{seconds:.0f} s"
    if abs(seconds) >= 1:
        return f"{seconds:.1f} s"
    return f"{1000 * seconds:.0f} ms" if abs(seconds) >= 0.0095 else f"{1000 * seconds:.1f} ms"
