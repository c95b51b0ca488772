"""Whether what a judge names is why a run fails: a rule that compares facts as text.

Called by the metrics with what was named and what the truth says (`Judged.named`,
`EpisodeRow.causes`); calls nothing but the reading of facts. The check on it is a sample that was
judged by hand (`tests/statistics/causes_by_hand.json`).
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from enum import Enum

from forestall.types.facts import Literal, category_of, is_instance


class Agreement(Enum):
    """How near what was named comes to the cause; the nearer first."""

    EXACT = "exact fact"
    SAME_THING = "same thing"
    OTHER = "other"
    NOTHING = "nothing named"

    @property
    def right(self) -> bool:
        """Whether the cause was named, if not to the word."""
        return self in (Agreement.EXACT, Agreement.SAME_THING)


def cause_named(named: Sequence[str], causes: Sequence[str]) -> Agreement:
    """Compare what must change with what is so.

    What is named must hold and does not (`vacant(Microwave-1)`); a cause is so, or is not so with
    "not" before it (`inside(Bowl-1, Microwave-1)`, `not vacant(Microwave-1)`). The best
    pair counts:

    - `EXACT`: one denies the other: the same fact of the same things with another value, or with
      and without "not". A category names any of its things.
    - `SAME_THING`: both say of one thing where it is or what is at it, in other words:
      `vacant(Pot-1)` and what is in the pot. A relation is about its first argument: two things
      on one counter are not one. States (dirty, broken) are causes of their own, and that a thing
      cannot be got at is not where it should be. Numbers may be perceived ones: facts that deny
      each other but for the numbers of their things are here, and not in `EXACT`, for of two of a
      kind the number decides.
    - `OTHER`: neither, also where no cause was found.

    Args:
        named: facts as text. None at all: `NOTHING`.
        causes: likewise.

    Raises:
        InputError: a text that is no fact.
    """
    if not named:
        return Agreement.NOTHING
    wanted, so = _read(named), _read(causes)
    pairs = [(n, c) for n in wanted for c in so]
    if any(_denies(n, c) and _one(n, c) for n, c in pairs):
        return Agreement.EXACT
    if any((_denies(n, c) and _alike(n, c)) or _about_one(n, c) for n, c in pairs):
        return Agreement.SAME_THING
    return Agreement.OTHER


def _read(texts: Iterable[str]) -> list[Literal]:
    return [Literal.parse(t) for t in texts]


def _denies(named: Literal, cause: Literal) -> bool:
    """Whether a fact that must hold cannot while the other is so, whatever they are about."""
    return (
        named.predicate == cause.predicate
        and len(named.args) == len(cause.args)
        and (named.value != cause.value)
    )


def _one(named: Literal, cause: Literal) -> bool:
    return all(_same(a, b) for a, b in zip(named.args, cause.args, strict=True))


def _same(a: str, b: str) -> bool:
    """The same thing; a category may mean any of its things."""
    if is_instance(a) and is_instance(b):
        return a == b
    return category_of(a) == category_of(b)


def _alike(named: Literal, cause: Literal) -> bool:
    pairs = zip(named.args, cause.args, strict=True)
    return all(category_of(a) == category_of(b) for a, b in pairs)


def _about_one(named: Literal, cause: Literal) -> bool:
    """Whether both say where one thing is; or one of a place and the other of what is there."""
    if named.is_state or cause.is_state or len(cause.args) < 2 or not named.args:
        return False
    about = cause.args if len(named.args) == 1 else cause.args[:1]
    return any(_same(named.args[0], a) for a in about)
