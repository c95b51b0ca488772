"""What the encoder is told about its pictures, in ever other words.

Called by `fit.py`; calls the domain. A thing goes by its names, sometimes by "thing" or by a
word that does not exist, so that "a dirty jug" is understood before anyone has seen a jug.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from forestall.domain.model import Domain
from forestall.types.plan import Subtask

PLAIN = ("{thing}", "a {thing}", "a photo of a {thing}", "a picture of a {thing}", "the {thing}")
ANY_THING = ("object", "thing", "item")
_SYLLABLES = ("ba", "cor", "dil", "fen", "gru", "lop", "mis", "nar", "pel", "sto", "tev", "zul")

SAYINGS: dict[str, tuple[str, ...]] = {
    "navigate_to_obj": (
        "go to the {0}",
        "drive to the {0}",
        "move over to the {0}",
        "approach {0}",
    ),
    "pick_up": ("grasp the {0}", "take the {0}", "lift the {0}", "grab a {0}"),
    "put_on": ("place the {0} on the {1}", "set the {0} down on the {1}", "lay {0} onto {1}"),
    "put_in": ("place the {0} in the {1}", "put the {0} inside the {1}", "insert {0} into {1}"),
    "open_obj": ("open the {0}", "pull the {0} open"),
    "close_obj": ("shut the {0}", "close the {0}"),
    "toggle_on": ("switch on the {0}", "turn the {0} on", "start the {0}"),
    "toggle_off": ("switch off the {0}", "turn the {0} off", "stop the {0}"),
    "slice_obj": ("cut the {0} into slices", "slice the {0}", "chop up the {0}"),
    "crack_obj": ("crack the {0} open", "break the {0} open"),
    "pour": ("pour the {0} into the {1}", "empty the {0} into the {1}", "tip {0} into {1}"),
}
"""Other ways to say a subtask."""


@dataclass(frozen=True, slots=True)
class Question:
    """All values of one attribute of one category."""

    category: str
    attribute: str
    values: tuple[str, ...]


class Writer:
    """Draws texts.

    Args:
        domain: categories, attributes, phrases.
        rng: random choices.
    """

    def __init__(self, domain: Domain, rng: np.random.Generator) -> None:
        self._domain = domain
        self._rng = rng
        self.categories = tuple(sorted(domain.categories))
        self.questions = tuple(
            Question(name, a, domain.values(a))
            for name in self.categories
            for a in domain[name].attributes
            if domain.attributes[a].camera
        )

    def name(self, category: str, *, disguise: float = 0.2) -> str:
        """A name of a category; with probability `disguise` one that does not tell it."""
        draw = self._rng.uniform()
        if draw < disguise / 2:
            return self._pick(ANY_THING)
        if draw < disguise:
            return "".join(self._pick(_SYLLABLES) for _ in range(int(self._rng.integers(2, 4))))
        found = self._domain[category]
        if found.synonyms and self._rng.uniform() < 0.35:
            return self._pick(found.synonyms)
        return found.words

    def thing(self, category: str) -> str:
        """A text that names a category."""
        return self._pick(PLAIN).format(thing=self.name(category, disguise=0.0))

    def state(self, category: str, attribute: str, value: str, *, name: str | None = None) -> str:
        """A phrase that says a state."""
        phrase = self._pick(self._domain.phrases(category, attribute, value))
        words = self._domain[category].words
        return phrase.replace(words, name or self.name(category))

    def answers(self, question: Question) -> list[str]:
        """One phrase for each value of a question, of one thing."""
        name = self.name(question.category)
        return [
            self.state(question.category, question.attribute, v, name=name) for v in question.values
        ]

    def caption(self, category: str, states: Mapping[str, str]) -> str:
        """Several states at once: "a dirty mug, a mug filled with coffee"."""
        if not states:
            return self.thing(category)
        parts = [
            self.state(category, a, v, name=self.name(category, disguise=0.0))
            for a, v in states.items()
        ]
        return self._pick((", ", " and ")).join(parts)

    def sayings(self, count: int) -> tuple[list[str], list[str]]:
        """Two ways to say each of `count` different subtasks."""
        skills = sorted(self._domain.skills)
        seen: dict[Subtask, None] = {}
        while len(seen) < count:
            skill = self._pick(skills)
            args = tuple(self._pick(self.categories) for _ in self._domain.skills[skill].parameters)
            seen[Subtask(skill, args)] = None
        ones, others = [], []
        for subtask in seen:
            names = [self.name(c, disguise=0.0) for c in subtask.args]
            ones.append(self._domain.words(subtask))
            others.append(self._pick(SAYINGS[subtask.skill]).format(*names))
        return ones, others

    def same(self, count: int) -> tuple[list[str], list[str]]:
        """Two names for each of `count` categories."""
        order = self._rng.permutation(len(self.categories))[:count]
        chosen = [self.categories[int(i)] for i in order]
        ones = [self._domain[c].words for c in chosen]
        return ones, [self.thing(c) for c in chosen]

    def _pick(self, options: Sequence[str]) -> str:
        return options[int(self._rng.integers(len(options)))]
