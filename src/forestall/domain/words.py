"""The words that people, detectors and simulators have for the categories of a domain.

Called where observations and subtasks come in (`perception/folder.py`, `perception/scenes.py`, the
command line). Only what is surely the same word is matched: "dining table", "dining_table",
"DiningTable|+00.1|-2" and "025_mug" name categories if these have such a name, alias, words or
synonym. Everything else is a thing of its own, never a guess and never a refusal.
"""

from __future__ import annotations

import difflib
import re
import unicodedata
from collections.abc import Collection, Mapping

from forestall.domain.model import Domain
from forestall.errors import InputError, UnknownNameError
from forestall.types.facts import category_of, is_instance
from forestall.types.plan import Subtask

_SENSE = re.compile(r"\.[nvars]\.\d+(?=_\d+$|$)")
_CODE = re.compile(r"^\d{3}[-_ ]")
_HASH = re.compile(r"_(?=[0-9a-f]*\d)[0-9a-f]{6,}$")
_NUMBER = re.compile(r"[-_ .#:]*(\d+)$")
_NO_NAME = re.compile(r"[\s(),=\x00-\x1f\x7f]+")
_LONGEST = 80
_SLIP = 0.75


class Words:
    """Looks words up in a domain.

    Args:
        domain: its names, aliases, words and synonyms count; a word that two categories share does
            not, unless it is the name of one.
    """

    def __init__(self, domain: Domain) -> None:
        self._domain = domain
        self._known: dict[str, str] = {}
        shared = set()
        for category in domain.categories.values():
            for word in (category.spoken, *category.synonyms, *category.aliases):
                if self._known.setdefault(_letters(word), category.name) != category.name:
                    shared.add(_letters(word))
        for word in shared:
            del self._known[word]
        self._known |= {_letters(name): name for name in domain.categories}

    def category(self, said: str) -> str:
        """The category that a word means; the word itself, made fit for a name, if none is known.

        Raises:
            InputError: no word at all, or a whole text.
        """
        return self._find(said) or _plain(said)

    def knows(self, said: str) -> bool:
        """Whether a word means a category of the domain."""
        return self._find(said) is not None

    def subtask(self, said: Subtask) -> Subtask:
        """A subtask whose arguments are the domain's words where it has them.

        Instances keep their number: "coffee mug-2" is "Mug-2".
        """
        return Subtask(said.skill, tuple(self._argument(a) for a in said.args))

    def slip(self, said: str) -> bool:
        """Whether a word that means nothing here is nearly one that does: a slip of the pen."""
        near = difflib.get_close_matches(category_of(said), self._domain.categories, 1, _SLIP)
        return bool(near) and not self.knows(said)

    def _argument(self, said: str) -> str:
        if said in self._domain.robot.hands or self._domain.find(said) is not None:
            return said
        found = self._find(said)
        if found is None:
            return said
        return f"{found}-{said.rpartition('-')[2]}" if is_instance(said) else found

    def _find(self, said: str) -> str | None:
        if self._domain.find(said) is not None:
            return self._domain[said].name
        base = _base(said)
        for form in (said, base, _NUMBER.sub("", base)):
            found = self._known.get(_letters(form))
            if found is not None:
                return found
        return None


class Names:
    """Gives every thing that a run speaks of an instance name "Category-N", always the same one.

    Args:
        domain: whose categories are matched.
    """

    def __init__(self, domain: Domain) -> None:
        self.words = Words(domain)
        self._named: dict[str, str] = {}
        self._taken: set[str] = set()

    def reserve(self, said: str) -> None:
        """Keep a name that has the right form already from being given to another thing."""
        if is_instance(said) and self.words.category(category_of(said)) == category_of(said):
            self._named.setdefault(said, said)
            self._taken.add(said)

    def instance(self, said: str, category: str | None = None) -> str:
        """The instance name of an id of whatever form.

        Args:
            said: the id: "Mug-2", "Mug|+00.1|-2.0", "coffee mug_2", "7".
            category: of the thing, as this project names it; None: the id says it.
        """
        found = self._named.get(said)
        if found is None:
            kind = category or self.words.category(said)
            number = _NUMBER.search(_base(said))
            wanted = f"{kind}-{int(number[1])}" if number and len(number[1]) < 7 else ""
            found = wanted if wanted and wanted not in self._taken else self.next(kind)
            self._named[said] = found
            self._taken.add(found)
        return found

    def next(self, category: str) -> str:
        """The first free name of a category, taken from now on."""
        name = self.free(category)
        self._taken.add(name)
        return name

    def free(self, category: str, used: Collection[str] = ()) -> str:
        """The first name of a category that is neither taken nor used."""
        number = 1
        while f"{category}-{number}" in self._taken or f"{category}-{number}" in used:
            number += 1
        return f"{category}-{number}"

    def __contains__(self, said: str) -> bool:
        return said in self._named


def stated(given: Mapping[str, str], category: str, domain: Domain) -> dict[str, str]:
    """The states that somebody tells of a thing; of what the domain lacks it keeps none.

    Raises:
        UnknownNameError: an attribute that the category has not, or another value.
    """
    known = domain.find(category)
    if known is None:
        return {}
    for attribute, value in given.items():
        if attribute not in known.attributes:
            raise UnknownNameError(f"attribute of {category}", attribute, known.attributes)
        if value not in domain.values(attribute):
            raise UnknownNameError(f"value of {attribute}", value, domain.values(attribute))
    return dict(given)


def _letters(text: str) -> str:
    folded = unicodedata.normalize("NFKC", text).casefold()
    return "".join(c for c in folded if c.isalnum())


def _base(said: str) -> str:
    """Without what simulators and dictionaries hang on: places, senses, codes, hashes."""
    base = unicodedata.normalize("NFKC", said).strip().split("|", 1)[0].strip()
    base = _HASH.sub("", _SENSE.sub("", base))
    return _CODE.sub("", base) or base


def _plain(said: str) -> str:
    base = _base(said)
    plain = _NO_NAME.sub(" ", _NUMBER.sub("", base) or base).strip()
    if not plain or len(plain) > _LONGEST:
        raise InputError(f"a category must be a word of at most {_LONGEST} letters, got {said!r}")
    return plain
