"""Counting values by demonstrations, and how likely what always held is a need and not a habit.

Called by `needs`; calls nothing.

Let a literal have held before a skill in s of the n demonstrations in which it was observed, and at
other times, for things of the same kinds, have held in t demonstrations and not held in d (one may
count in both). What was not observed counts nowhere. A need is as likely beforehand as a habit:

- need: the skill was done because it held; an exception has the probability e, so that what was
  seen has the likelihood e^(n - s);
- habit: it holds before the skill as often as at other times. How often that is is itself not known
  but from the t and d, a Beta(1 + t, 1 + d) with Laplace's prior, so that what was seen has the
  beta-binomial likelihood B(1 + t + s, 1 + d + n - s) / B(1 + t, 1 + d);
- or a habit of doing this very thing, as often as it may be, whatever is so at other times: the
  likelihood is B(1 + s, 1 + n - s).

The weight is need / (need + habit), where either habit is as likely beforehand. Without other
times and exceptions it is the rule of succession, (n + 1) / (n + 2). What varied elsewhere and
always held here comes near 1, but only with n; what never varied anywhere stays below `VARIED`,
however often it was seen; and what varied here, too, falls below 1/2, even a strong habit.
"""

from __future__ import annotations

from collections.abc import Collection
from dataclasses import dataclass, field
from math import exp, lgamma, log, log1p

EXCEPTION = 0.01
"""How probable it is that a need was not met, or not seen to be, before a skill that went well,
where cameras say what was so."""

VARIED = 0.8
"""Weight that nothing reaches which never was otherwise and was seen as often at other times: half
of the habits explain at least half of it, however often it was seen."""


@dataclass(slots=True)
class Tally:
    """In how many demonstrations a fact had which values.

    Args:
        runs: demonstrations in which it was asked.
        seen: those in which it had any value that was observed.
        some: value → those in which it had it at some time.
        only: value → those in which it had no other.
    """

    runs: int = 0
    seen: int = 0
    some: dict[str, int] = field(default_factory=dict)
    only: dict[str, int] = field(default_factory=dict)

    def add(self, values: Collection[str], times: int = 1) -> None:
        """Count one demonstration with these values; -1 takes one back."""
        self.runs += times
        if not values:
            return
        self.seen += times
        for value in values:
            self.some[value] = self.some.get(value, 0) + times
            if len(values) == 1:
                self.only[value] = self.only.get(value, 0) + times

    def plus(self, other: Tally) -> Tally:
        """Both together."""
        return Tally(
            self.runs + other.runs,
            self.seen + other.seen,
            _sum(self.some, other.some),
            _sum(self.only, other.only),
        )

    def always(self, value: str) -> int:
        """Demonstrations in which it had this value alone."""
        return self.only.get(value, 0)

    def ever(self, value: str) -> tuple[int, int]:
        """Demonstrations in which it had this value at some time, and another at some time."""
        return self.some.get(value, 0), self.seen - self.only.get(value, 0)


def _sum(one: dict[str, int], other: dict[str, int]) -> dict[str, int]:
    return {k: one.get(k, 0) + other.get(k, 0) for k in {*one, *other}}


def weight(
    true: int, seen: int, elsewhere: tuple[int, int] = (0, 0), exception: float = EXCEPTION
) -> float:
    """How likely what held in `true` of `seen` demonstrations is a need; see above."""
    held, not_held = elsewhere
    false = seen - true
    if false and not exception:
        return 0.0
    usual = _log_beta(1 + held + true, 1 + not_held + false) - _log_beta(1 + held, 1 + not_held)
    own = _log_beta(1 + true, 1 + false)
    need = false * log(exception) if false else 0.0
    likelier, other = max(usual, own), min(usual, own)
    odds = likelier + log1p(exp(other - likelier)) - log(2) - need
    return 1 / (1 + exp(min(odds, 700.0)))


def _log_beta(a: float, b: float) -> float:
    return lgamma(a) + lgamma(b) - lgamma(a + b)
