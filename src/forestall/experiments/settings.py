"""What is the same for every episode of an experiment: the parts, and which get a page.

Made by the command line; read by `worker` and kept in the folder of the results.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

from forestall.assembly.configuration import Choice as Part
from forestall.assembly.configuration import Given, choices, domain_of, said_domain
from forestall.domain.model import Domain
from forestall.errors import InputError
from forestall.kinds import DETECTOR, LLM, STRATEGY

PAGES = ("all", "telling", "none")
"""Telling are the proactive runs of failing cases, and those in which it raised a false alarm."""

OWN = (DETECTOR.name, STRATEGY.name)
"""Kinds of parts that an experiment chooses by itself, run by run."""


@dataclass(frozen=True, slots=True)
class Settings:
    """What is the same for every episode of an experiment.

    Args:
        given: what was said about the parts; strategy and detector are the experiment's own.
        pages: which episodes get a page of their own, one of `PAGES`.
    """

    given: Given = field(default_factory=Given)
    pages: str = "telling"

    def parts(self) -> tuple[Part, ...]:
        """The checked choice of every kind but the experiment's own.

        Raises:
            InputError: one that is not valid, or one that is the experiment's own.
        """
        for kind in self.given.kinds():
            if kind in OWN:
                raise InputError(f"an experiment chooses the {kind} of each run by itself")
        return tuple(part for part in choices(self.given) if part.kind not in OWN)

    @property
    def asks(self) -> bool:
        """Whether a language model was named."""
        return self.given.chosen(LLM.name).name != "none"

    def domain(self) -> Domain | None:
        """The domain that every task is read in, None for their own.

        Raises:
            InputError: it cannot be read.
        """
        said = said_domain(self.given)
        return None if said is None else domain_of(said)

    def to_json(self) -> dict[str, Any]:
        """As it stands in the folder of the results."""
        return {"parts": {p.kind: p.to_json() for p in self.parts()}, "pages": self.pages}
