"""PDDL text as nested lists that know their lines, and the names in it as ours.

Called by `pddl_in`, `pddl_formula` and `pddl_problem`; calls nothing. PDDL is read in lower case;
a "-" in a name becomes "_", since facts and formulas use the "-" for other things.
"""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass

from forestall.errors import InputError, UnknownNameError

_TOKEN = re.compile(r";[^\n]*|[()]|[^\s();]+")
_TOP = (":action", ":derived", ":goal", ":init", ":predicates")
_NAME = re.compile(r"\??[a-z_][a-z0-9_]*")

MOST_DEPTH = 64
"""How deep parentheses may nest."""

ROOT = "object"
"""The type of whatever has no other."""


class AtLineError(InputError):
    """Something wrong at a line of a PDDL text; whoever knows the file adds its name."""

    def __init__(self, line: int, text: str) -> None:
        super().__init__(text)
        self.line = line

    def __reduce__(self) -> tuple[type, tuple[int, str]]:
        return (type(self), (self.line, str(self)))


@dataclass(frozen=True, slots=True)
class Word:
    """One name, variable, number or keyword, in lower case."""

    text: str
    line: int

    def __str__(self) -> str:
        return self.text


@dataclass(frozen=True, slots=True)
class Group:
    """What stands between two parentheses."""

    items: tuple[Node, ...]
    line: int

    @property
    def head(self) -> str:
        """The first word, "" where there is none."""
        first = self.items[0] if self.items else None
        return first.text if isinstance(first, Word) else ""

    def __str__(self) -> str:
        return f"({' '.join(map(str, self.items))})"


Node = Word | Group


def _check_depth(stack: Sequence[object], line: int) -> None:
    if len(stack) > MOST_DEPTH:
        raise AtLineError(line, f"it nests more than {MOST_DEPTH} deep")


def parse_pddl(text: str) -> Group:
    """The one expression of a PDDL text.

    Raises:
        AtLineError: a parenthesis is missing or too many, or something follows.
    """
    stack: list[tuple[int, list[Node]]] = []
    done: Group | None = None
    line, at = 1, 0
    for match in _TOKEN.finditer(text):
        line += text.count("\n", at, match.start())
        at = match.start()
        token = match[0]
        if token.startswith(";"):
            continue
        if done is not None:
            raise AtLineError(line, f"{token!r} stands after the end of (define ...)")
        if token == "(":
            stack.append((line, []))
            _check_depth(stack, line)
        elif not stack:
            raise AtLineError(line, f"a PDDL file begins with (define, not with {token!r}")
        elif token == ")":
            started, items = stack.pop()
            group = Group(tuple(items), started)
            if stack:
                stack[-1][1].append(group)
            else:
                done = group
        else:
            if token in _TOP and not stack[-1][1] and len(stack) > 2:
                text = "the section that begins here is not closed: a parenthesis is missing"
                raise AtLineError(stack[1][0], text)
            stack[-1][1].append(Word(token.lower(), line))
    if stack:
        raise AtLineError(stack[-1][0], "a parenthesis is opened here and never closed")
    if done is None:
        raise AtLineError(1, "the file is empty: a PDDL file begins with (define")
    return done


def definition(text: str, what: str) -> tuple[str, Iterator[Group]]:
    """The name after (define (what NAME), and the sections that follow.

    Raises:
        AtLineError: the text defines something else, or a section is none.
    """
    whole = parse_pddl(text)
    title = whole.items[1] if len(whole.items) > 1 else None
    named = isinstance(title, Group) and title.head == what and len(title.items) == 2
    if whole.head != "define" or not named:
        raise AtLineError(whole.line, f"expected (define ({what} NAME) ...), found {_start(whole)}")
    assert isinstance(title, Group)
    return str(title.items[1]), _sections(whole.items[2:])


def _sections(items: Sequence[Node]) -> Iterator[Group]:
    for item in items:
        if not isinstance(item, Group) or not item.head.startswith(":"):
            raise AtLineError(item.line, f"expected a section such as (:init ...), found {item}")
        yield item


def _start(node: Node) -> str:
    text = str(node)
    return text if len(text) <= 40 else f"{text[:40]} ..."


def words(items: Iterable[Node], what: str) -> Iterator[Word]:
    """Items that must be words.

    Raises:
        AtLineError: one of them is a group.
    """
    for item in items:
        if not isinstance(item, Word):
            raise AtLineError(item.line, f"expected {what}, found {_start(item)}")
        yield item


def ours(word: Word, what: str = "a name") -> str:
    """A name, or a variable with its question mark, as this project writes it.

    Raises:
        AtLineError: it is no name.
    """
    name = word.text.replace("-", "_")
    if not _NAME.fullmatch(name):
        raise AtLineError(word.line, f"expected {what}, found {word.text!r}")
    return name


def typed(items: Sequence[Node], what: str) -> list[tuple[Word, tuple[Word, ...]]]:
    """The names of a typed list, each with the types of which it has one.

    Raises:
        AtLineError: a type is missing or is none.
    """
    found: list[tuple[Word, tuple[Word, ...]]] = []
    waiting: list[Word] = []
    left = list(items)
    while left:
        item = left.pop(0)
        if not isinstance(item, Word):
            raise AtLineError(item.line, f"expected {what}, found {_start(item)}")
        if item.text != "-":
            waiting.append(item)
            continue
        kind = left.pop(0) if left else None
        if kind is None or not waiting or str(kind) == "-":
            raise AtLineError(item.line, f"expected {what} before and a type after '-'")
        if isinstance(kind, Word):
            types: tuple[Word, ...] = (kind,)
        elif kind.head == "either" and len(kind.items) > 1:
            types = tuple(words(kind.items[1:], "a type"))
        else:
            raise AtLineError(kind.line, f"expected a type, found {_start(kind)}")
        found += [(w, types) for w in waiting]
        waiting = []
    return found + [(w, ()) for w in waiting]


def unknown(node: Node, kind: str, name: str, known: Iterable[str]) -> AtLineError:
    """A name that is not known, with the nearest ones."""
    return AtLineError(node.line, str(UnknownNameError(kind, name, known)))


@dataclass(frozen=True, slots=True)
class Types:
    """The types of a domain: each with its parent, all of them under `ROOT`."""

    parents: Mapping[str, str]

    def kind(self, types: tuple[Word, ...]) -> str | None:
        """What a parameter's types are as a kind: a type, a tag for several, None for any thing.

        Raises:
            AtLineError: a type that nobody declared.
        """
        names = [self.known(t) for t in types]
        if not names or ROOT in names:
            return None
        return names[0] if len(set(names)) == 1 else either(names)

    def known(self, word: Word) -> str:
        """The name of a declared type.

        Raises:
            AtLineError: nobody declared it.
        """
        name = ours(word, "a type")
        if name not in self.parents and name != ROOT:
            raise unknown(word, "type", name, (*self.parents, ROOT))
        return name

    def above(self, name: str) -> tuple[str, ...]:
        """Every ancestor, the nearest first, without the root."""
        found = []
        while self.parents.get(name, ROOT) != ROOT:
            name = self.parents[name]
            found.append(name)
        return tuple(found)


def either(names: Iterable[str]) -> str:
    """The tag that stands for one of several types."""
    return f"either_{'_'.join(sorted(set(names)))}"
