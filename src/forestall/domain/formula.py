"""Formulas over facts: what needs, conditions, derived predicates and goals are written in.

A formula is data. `parse_formula` reads the text form that domain files use:

    inside(?x, ?y) and not open(?y)=closed
    every ?y - food: not inside(?y, ?x)
    some ?k - cuts: held_by(?k, gripper)
    fewer than 2 of ?y: inside(?y, ?x)

Quantifiers reach as far to the right as they can. Called by the loaders; calls nothing.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Iterable, Iterator, Mapping
from dataclasses import dataclass

from forestall.errors import InputError
from forestall.types.facts import Literal


@dataclass(frozen=True, slots=True, order=True)
class Parameter:
    """A variable and what may stand for it.

    Args:
        name: with its question mark: "?object".
        kind: a tag, a category, or "has_<attribute>"; None: any thing.
    """

    name: str
    kind: str | None = None

    def __str__(self) -> str:
        return self.name if self.kind is None else f"{self.name} - {self.kind}"


@dataclass(frozen=True, slots=True)
class Not:
    """The opposite of a formula."""

    part: Formula


@dataclass(frozen=True, slots=True)
class And:
    """All of its parts; without parts it is true."""

    parts: tuple[Formula, ...]


@dataclass(frozen=True, slots=True)
class Or:
    """Any of its parts; without parts it is false."""

    parts: tuple[Formula, ...]


@dataclass(frozen=True, slots=True)
class Some:
    """True where some things make it true."""

    variables: tuple[Parameter, ...]
    part: Formula


@dataclass(frozen=True, slots=True)
class Every:
    """True where all things make it true."""

    variables: tuple[Parameter, ...]
    part: Formula


@dataclass(frozen=True, slots=True)
class Fewer:
    """True where fewer than so many things make it true.

    Args:
        bound: a number, or the name of a number that categories have.
        of: whose number it is, where `bound` is a name.
    """

    bound: int | str
    of: str
    variable: Parameter
    part: Formula


Formula = Literal | Not | And | Or | Some | Every | Fewer

TRUE = And(())
FALSE = Or(())

_TOKEN = re.compile(r"\s*(\?[A-Za-z_]\w*|[A-Za-z_]\w*(?:-\d+)?|\d+|!=|[(),:=\-])")
_WORDS = ("and", "or", "not", "implies", "some", "every", "fewer", "than", "of")


MOST_CHARACTERS = 4000
MOST_DEPTH = 50
"""How long and how deep a formula may be."""


def parse_formula(text: str) -> Formula:
    """Read the text form.

    Raises:
        InputError: the text is no formula; says where it stops being one.
    """
    if not isinstance(text, str) or len(text) > MOST_CHARACTERS:
        raise InputError(f"a formula is a text of at most {MOST_CHARACTERS} characters")
    parser = _Parser(text)
    formula = parser.formula()
    parser.end()
    return formula


def bind(formula: Formula, names: Mapping[str, str]) -> Formula:
    """The formula with free variables replaced."""
    if isinstance(formula, Literal):
        return formula.bind(names)
    if isinstance(formula, Not):
        return Not(bind(formula.part, names))
    if isinstance(formula, And | Or):
        return type(formula)(tuple(bind(p, names) for p in formula.parts))
    if isinstance(formula, Fewer):
        inner = {k: v for k, v in names.items() if k != formula.variable.name}
        of = names.get(formula.of, formula.of)
        return Fewer(formula.bound, of, formula.variable, bind(formula.part, inner))
    own = {v.name for v in formula.variables}
    inner = {k: v for k, v in names.items() if k not in own}
    return type(formula)(formula.variables, bind(formula.part, inner))


def asks(formulas: Iterable[Formula], predicate: str) -> bool:
    """Whether formulas speak of a predicate."""
    return any(x.predicate == predicate for f in formulas for x, _ in literals(f))


def literals(formula: Formula) -> Iterator[tuple[Literal, bool]]:
    """Every literal with whether it stands under an even number of negations."""
    return _literals(formula, True)


def _literals(formula: Formula, positive: bool) -> Iterator[tuple[Literal, bool]]:
    if isinstance(formula, Literal):
        if formula.value == "false":
            yield Literal(formula.predicate, formula.args), not positive
        else:
            yield formula, positive
    elif isinstance(formula, Not):
        yield from _literals(formula.part, not positive)
    elif isinstance(formula, And | Or):
        for part in formula.parts:
            yield from _literals(part, positive)
    else:
        yield from _literals(formula.part, positive != isinstance(formula, Fewer))


def free(formula: Formula) -> frozenset[str]:
    """Names of the variables that no quantifier binds."""
    if isinstance(formula, Literal):
        return frozenset(a for a in formula.args if a.startswith("?"))
    if isinstance(formula, Not):
        return free(formula.part)
    if isinstance(formula, And | Or):
        return frozenset().union(*(free(p) for p in formula.parts))
    if isinstance(formula, Fewer):
        of = {formula.of} if formula.of.startswith("?") else set()
        return (free(formula.part) - {formula.variable.name}) | of
    return free(formula.part) - {v.name for v in formula.variables}


def variables(formula: Formula) -> Iterator[Parameter]:
    """Every variable that a quantifier binds."""
    if isinstance(formula, Not):
        yield from variables(formula.part)
    elif isinstance(formula, And | Or):
        for part in formula.parts:
            yield from variables(part)
    elif isinstance(formula, Fewer):
        yield formula.variable
        yield from variables(formula.part)
    elif isinstance(formula, Some | Every):
        yield from formula.variables
        yield from variables(formula.part)


def counted_of(formula: Formula) -> Iterator[str]:
    """Every name whose category bounds a count: ?x of "fewer than capacity(?x) of ..."."""
    if isinstance(formula, Not):
        yield from counted_of(formula.part)
    elif isinstance(formula, And | Or):
        for part in formula.parts:
            yield from counted_of(part)
    elif not isinstance(formula, Literal):
        if isinstance(formula, Fewer) and formula.of:
            yield formula.of
        yield from counted_of(formula.part)


def normal(formula: Formula, positive: bool = True) -> Formula:
    """Negation normal form: `Not` stands nowhere but before a `Fewer`.

    A negated relation has the value "false"; a negated value stays a `Not` of its literal.
    """
    if isinstance(formula, Literal):
        if positive:
            return formula
        if formula.value in ("true", "false"):
            other = "false" if formula.value == "true" else "true"
            return Literal(formula.predicate, formula.args, other)
        return Not(formula)
    if isinstance(formula, Not):
        return normal(formula.part, not positive)
    if isinstance(formula, And | Or):
        parts = tuple(normal(p, positive) for p in formula.parts)
        return And(parts) if isinstance(formula, And) == positive else Or(parts)
    if isinstance(formula, Fewer):
        inner = Fewer(formula.bound, formula.of, formula.variable, normal(formula.part))
        return inner if positive else Not(inner)
    kind = Some if isinstance(formula, Some) == positive else Every
    return kind(formula.variables, normal(formula.part, positive))


def show(formula: Formula) -> str:
    """The text form."""
    if isinstance(formula, Literal):
        return str(formula)
    if isinstance(formula, Not):
        return f"not {_in(formula.part)}"
    if isinstance(formula, And | Or):
        if not formula.parts:
            return "true" if isinstance(formula, And) else "false"
        word = " and " if isinstance(formula, And) else " or "
        return word.join(_in(p) for p in formula.parts)
    if isinstance(formula, Fewer):
        bound = (
            formula.bound if isinstance(formula.bound, int) else f"{formula.bound}({formula.of})"
        )
        return f"fewer than {bound} of {formula.variable}: {show(formula.part)}"
    word = "some" if isinstance(formula, Some) else "every"
    return f"{word} {', '.join(map(str, formula.variables))}: {show(formula.part)}"


def _in(formula: Formula) -> str:
    plain = isinstance(formula, Literal | Not)
    return show(formula) if plain else f"({show(formula)})"


class _Parser:
    """Recursive descent over the tokens of one text."""

    def __init__(self, text: str) -> None:
        self._text = text
        self._tokens: list[str] = []
        at = 0
        while text[at:].strip():
            match = _TOKEN.match(text, at)
            if match is None:
                raise InputError(f"cannot read {text!r} as a formula at {text[at:].strip()!r}")
            self._tokens.append(match[1])
            at = match.end()
        self._at = 0
        self._depth = 0

    def formula(self) -> Formula:
        left = self._either()
        if self._take("implies"):
            self._deeper()
            return Or((Not(left), self.formula()))
        return left

    def end(self) -> None:
        if self._at < len(self._tokens):
            raise self._wrong("the end")

    def _either(self) -> Formula:
        return self._joined("or", Or, self._both)

    def _both(self) -> Formula:
        return self._joined("and", And, self._single)

    def _joined(
        self, word: str, kind: type[And] | type[Or], part: Callable[[], Formula]
    ) -> Formula:
        parts = [part()]
        while self._take(word):
            parts.append(part())
        return parts[0] if len(parts) == 1 else kind(tuple(parts))

    def _single(self) -> Formula:
        self._deeper()
        found = self._unit()
        self._depth -= 1
        return found

    def _deeper(self) -> None:
        self._depth += 1
        if self._depth > MOST_DEPTH:
            raise InputError(f"a formula nests more than {MOST_DEPTH} deep")

    def _unit(self) -> Formula:
        if self._take("not"):
            return Not(self._single())
        if self._take("("):
            inner = self.formula()
            self._need(")")
            return inner
        for word, kind in (("some", Some), ("every", Every)):
            if self._take(word):
                several = [self._parameter()]
                while self._take(","):
                    several.append(self._parameter())
                self._need(":")
                return kind(tuple(several), self.formula())
        if self._take("fewer"):
            return self._fewer()
        return self._atom()

    def _fewer(self) -> Formula:
        self._need("than")
        bound: int | str
        token, of = self._next("a number"), ""
        if token.isdecimal():
            bound = int(token)
        else:
            bound = token
            self._need("(")
            of = self._next("a name")
            self._need(")")
        self._need("of")
        variable = self._parameter()
        self._need(":")
        return Fewer(bound, of, variable, self.formula())

    def _parameter(self) -> Parameter:
        name = self._next("a variable")
        if not name.startswith("?"):
            raise self._wrong("a variable such as ?x", back=1)
        return Parameter(name, self._next("a kind") if self._take("-") else None)

    def _atom(self) -> Formula:
        name = self._next("a fact")
        if not re.fullmatch(r"[A-Za-z_]\w*", name) or name in _WORDS:
            raise self._wrong("a fact such as inside(?x, ?y)", back=1)
        if name in ("true", "false") and not self._peek("("):
            return TRUE if name == "true" else FALSE
        self._need("(")
        args: list[str] = []
        while not self._take(")"):
            if args:
                self._need(",")
            args.append(self._next("a name"))
        if self._take("!="):
            return Not(Literal(name, tuple(args), self._next("a value")))
        value = self._next("a value") if self._take("=") else "true"
        return Literal(name, tuple(args), value)

    def _peek(self, token: str) -> bool:
        return self._at < len(self._tokens) and self._tokens[self._at] == token

    def _take(self, token: str) -> bool:
        found = self._peek(token)
        self._at += found
        return found

    def _need(self, token: str) -> None:
        if not self._take(token):
            raise self._wrong(repr(token))

    def _next(self, what: str) -> str:
        if self._at >= len(self._tokens) or self._tokens[self._at] in "(),:=!=":
            raise self._wrong(what)
        self._at += 1
        return self._tokens[self._at - 1]

    def _wrong(self, expected: str, back: int = 0) -> InputError:
        rest = self._tokens[self._at - back :]
        found = f"{' '.join(rest[:4])!r}" if rest else "the end"
        return InputError(f"cannot read {self._text!r}: {expected} is expected at {found}")
