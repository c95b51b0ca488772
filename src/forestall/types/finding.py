"""What the input gate says of an observation."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from forestall.errors import ObservationError


@dataclass(frozen=True, slots=True)
class Finding:
    """One thing that an observation says and that cannot be, or ought to be known.

    Args:
        what: its short name, for counting: "distances", "masks", "frozen".
        sentence: what was found, and what would be right.
        frame: index of the picture; None where it is about the whole observation.
        refuses: whether nothing may be judged by this observation.
    """

    what: str
    sentence: str
    frame: int | None = None
    refuses: bool = True


def refuse(findings: Sequence[Finding], source: str = "") -> None:
    """Raise what refuses an observation, if anything does.

    Args:
        findings: of the gate.
        source: where the observation comes from, a file.

    Raises:
        ObservationError: with the first reason, the number of others, and all findings.
    """
    grounds = [f for f in findings if f.refuses]
    if not grounds:
        return
    first = grounds[0]
    where = f"{source}: " if source else ""
    where += "" if first.frame is None else f"frames.{first.frame}: "
    others = sorted({f.what for f in grounds[1:]} - {first.what})
    more = f" (also: {', '.join(others)})" if others else ""
    raise ObservationError(f"{where}{first.what}: {first.sentence}{more}", findings)
