"""What a PDDL domain declares: types, constants, predicates, and how it spells them.

Called by `pddl_in` and `pddl_problem`; calls `pddl_text` and `pddl_formula`.
"""

from __future__ import annotations

from dataclasses import dataclass, field

from forestall.domain.formula import Parameter
from forestall.domain.located import keyed
from forestall.domain.model import BUILT_IN
from forestall.domain.pddl_formula import Reader, Value
from forestall.domain.pddl_text import (
    ROOT,
    AtLineError,
    Group,
    Node,
    Types,
    Word,
    either,
    ours,
    typed,
    unknown,
    words,
)
from forestall.errors import InputError

_TAKEN = (*BUILT_IN, "and", "or", "not", "implies", "some", "every", "fewer", "than", "of", "true",
          "false", "gone")  # fmt: skip


@dataclass(slots=True)
class Declared:
    """The names of a PDDL domain.

    Args:
        grouped: attribute → value → the predicate that says it, "" for the value otherwise.
        lines: "[section.name]" → the line of its declaration.
        types: with their parents.
        constants: name → type.
        predicates: PDDL name → (our name, parameters).
        tags: union of types → the types.
        spelling: our name → that of the file.
    """

    grouped: dict[str, dict[str, str]]
    lines: dict[str, int] = field(default_factory=dict)
    types: Types = field(default_factory=lambda: Types({}))
    constants: dict[str, str] = field(default_factory=dict)
    predicates: dict[str, tuple[str, tuple[Parameter, ...]]] = field(default_factory=dict)
    tags: dict[str, tuple[str, ...]] = field(default_factory=dict)
    spelling: dict[str, str] = field(default_factory=dict)

    # --- declarations ----------------------------------------------------------------------------

    def read_types(self, sections: list[Group]) -> None:
        """Types with their parents.

        Raises:
            AtLineError: a type under two others, or under itself.
        """
        parents: dict[str, str] = {}
        for section in sections:
            for word, types in typed(section.items[1:], "a type"):
                name = self.named(word, "a type")
                if len(types) > 1:
                    raise AtLineError(word.line, f"type {name} has more than one type above it")
                above = self.named(types[0], "a type") if types else ROOT
                if name == ROOT:
                    continue
                if parents.get(name, above) not in (above, ROOT):
                    raise AtLineError(word.line, f"type {name} stands under two other types")
                parents[name] = above
                self.lines.setdefault(f"[categories.{name}]", word.line)
                if above != ROOT:
                    parents.setdefault(above, ROOT)
        for name, parent in parents.items():
            seen, at = {name}, parent
            while at != ROOT:
                if at in seen:
                    line = self.lines.get(f"[categories.{name}]", 1)
                    raise AtLineError(line, f"type {name} stands under itself")
                seen.add(at)
                at = parents.get(at, ROOT)
        self.types = Types(parents)

    def read_constants(self, sections: list[Group]) -> None:
        """Constants with their types.

        Raises:
            AtLineError: see `things_of`.
        """
        for section in sections:
            self.lines.setdefault("[constants]", section.line)
            self.constants |= things_of(section, self.types, self.constants, self.spelling)

    def read_predicates(self, sections: list[Group]) -> None:
        """Predicates; one that is called as a type or a built-in word is gets an "is_".

        Raises:
            AtLineError: no predicate, or one that stands twice.
        """
        for section in sections:
            for item in section.items[1:]:
                if not isinstance(item, Group) or not item.head:
                    raise AtLineError(item.line, f"expected a predicate in (...), found {item}")
                if item.head in self.predicates:
                    raise AtLineError(item.line, f"predicate {item.head} is declared twice")
                word = item.items[0]
                assert isinstance(word, Word)
                name = ours(word, "a predicate")
                taken = {n for n, _ in self.predicates.values()} | set(self.grouped)
                while name in taken or name in _TAKEN or name in (*self.types.parents, ROOT):
                    name = f"is_{name}"
                self._spelt(name, word)
                own = self.parameters(Group(item.items[1:], item.line), item.head)
                self.predicates[item.head] = name, own
                self.lines[f"[predicates.{name}]"] = item.line

    def parameters(self, node: Node | None, what: str) -> tuple[Parameter, ...]:
        """A typed list of variables, its unions of types noted.

        Raises:
            AtLineError: it is none.
        """
        found = Reader(self.types, {}).parameters(node, what)
        if isinstance(node, Group):
            for _, several in typed(node.items, "a variable"):
                self._either(several)
        return found

    def _either(self, several: tuple[Word, ...]) -> None:
        names = [self.types.known(t) for t in several]
        if len(set(names)) > 1 and ROOT not in names:
            self.tags[either(names)] = tuple(names)

    def values(self, derived: frozenset[str]) -> dict[str, Value]:
        """Predicate → the value of an attribute that the annotations say it is.

        Raises:
            InputError: a predicate that does not exist, or cannot be a value.
        """
        known = {n: p for n, p in self.predicates.values()}
        values: dict[str, Value] = {}
        for attribute, table in self.grouped.items():
            otherwise = next((v for v, p in table.items() if not p), None)
            for value, predicate in table.items():
                if not predicate:
                    continue
                key = plain(predicate)
                if key not in known or len(known[key]) != 1 or key in derived or key in values:
                    unary = [n for n, p in known.items() if len(p) == 1 and n not in derived]
                    free = [n for n in unary if n not in values]
                    error = unknown(
                        Word("", 0), f"predicate in values of attribute {attribute}", key, free
                    )
                    raise keyed(InputError(str(error)), f"[attributes.{attribute}")
                values[key] = Value(attribute, value, otherwise)
        return values

    def eithers(self, node: Node) -> None:
        """Notes the unions of types that quantifiers range over."""
        if isinstance(node, Group):
            if node.head == "either":
                self._either(tuple(words(node.items[1:], "a type")))
            for item in node.items:
                self.eithers(item)

    def unions(self, name: str) -> list[str]:
        """Tags of the unions of types that a type is in."""
        up = {name, *self.types.above(name)}
        return sorted(tag for tag, members in self.tags.items() if up & set(members))

    def named(self, word: Word, what: str) -> str:
        """Our name for a word, its spelling noted.

        Raises:
            AtLineError: no name, or one that two words would share.
        """
        name = ours(word, what)
        self._spelt(name, word)
        return name

    def _spelt(self, name: str, word: Word) -> None:
        spell(self.spelling, name, word)


def plain(name: str) -> str:
    """A PDDL name as this project writes it."""
    return name.lower().replace("-", "_")


def value_key(attribute: str, value: str) -> str:
    """The key of a value in `Domain.spelling`."""
    return f"{attribute}={value}"


def differing(spelling: dict[str, str]) -> dict[str, str]:
    """Names, in order, that a file spells in another way."""
    return {name: spelt for name, spelt in sorted(spelling.items()) if name != spelt}


def things_of(
    section: Group, types: Types, known: dict[str, str], spelling: dict[str, str]
) -> dict[str, str]:
    """Constants or objects: our name → type.

    Raises:
        AtLineError: an unknown type, several types for one thing, or a name that stands twice.
    """
    found: dict[str, str] = {}
    for word, several in typed(section.items[1:], "a name"):
        name = ours(word)
        spell(spelling, name, word)
        if len(several) > 1:
            raise AtLineError(word.line, f"{word} has several types: give it one of its own")
        kind = types.known(several[0]) if several else ROOT
        if known.get(name, kind) != kind or name in found:
            raise AtLineError(word.line, f"{word} is declared twice")
        found[name] = kind
    return found


def spell(spelling: dict[str, str], name: str, word: Word) -> None:
    """Note how a PDDL file spells a name.

    Raises:
        AtLineError: two names of the file would become the same.
    """
    before = spelling.get(name, word.text)
    if before != word.text:
        raise AtLineError(
            word.line, f"{before} and {word} would both be called {name} here: rename one"
        )
    spelling[name] = word.text
