"""IS-Bench's conditions and start states, which are BDDL (PDDL over synsets), in a domain's words.

Called by `tasks`; calls the PDDL reader. "stove.n.01_1" becomes "stove_n_01-1", a thing of the
category "stove_n_01"; what has one argument is an attribute that is yes or no.
"""

from __future__ import annotations

import re
from collections.abc import Collection, Iterator, Mapping
from dataclasses import dataclass

from forestall.domain.pddl_text import AtLineError, Group, Node, Word, definition, parse_pddl
from forestall.errors import FileFormatError, InputError
from forestall.types.facts import category_of

ATTRIBUTES = ("open", "toggled_on", "cooked", "frozen", "hot", "sliced", "real")
RELATIONS = ("inside", "ontop", "nextto", "covered", "filled", "saturated", "insource")
SPELT = {"contains": "filled"}
"""Another word for the same, as far as a plan changes it."""

ROOM, AGENT, FUTURE, REAL = "inroom", "agent_n_01-1", "future", "real"

_THING = re.compile(r"\??([a-z]\w*(?:[.-][a-z0-9_]*)*?)_(\d+)")
_NAME = re.compile(r"\??([a-z]\w*(?:[.-]\w+)*)")
_CONNECTIVES = ("and", "or")
_QUANTIFIERS = {"forall": "every", "exists": "some"}


@dataclass(frozen=True, slots=True)
class Start:
    """How a task begins.

    Args:
        things: of the task, also those that only come about: these are not real yet.
        states: (thing, attribute) pairs that hold.
        relations: (thing, relation, other).
        left_out: facts that no domain of ours says.
    """

    things: tuple[str, ...]
    states: frozenset[tuple[str, str]]
    relations: tuple[tuple[str, str, str], ...]
    left_out: tuple[str, ...]


def thing(text: str) -> str:
    """A thing's name as ours: "?stove.n.01_1" → "stove_n_01-1".

    Raises:
        InputError: it is none.
    """
    match = _THING.fullmatch(text.strip().lower())
    if match is None:
        raise InputError(f"{text!r} is no name of a thing such as stove.n.01_1")
    return f"{_ours(match[1])}-{int(match[2])}"


def condition(text: str, things: Collection[str]) -> str:
    """A condition, "(:goal ...)", as a formula.

    Args:
        text: as the task's file has it.
        things: that there are, in our names.

    Raises:
        InputError: it is no BDDL, or says what no formula here says; names it.
    """
    whole = parse_pddl(text)
    if whole.head != ":goal" or len(whole.items) != 2:
        raise InputError(f"a condition is (:goal ...) with one part, not {_shown(whole)}")
    return _formula(whole.items[1], things, {})


def start(text: str, source: str) -> Start:
    """The start state of a problem file.

    Raises:
        FileFormatError: it is no BDDL problem; with the file and the line.
    """
    try:
        sections = {s.head: s for s in definition(text, "problem")[1]}
        objects = [_ours_of(w) for w in _words(sections[":objects"].items[1:])]
        return _start([o for o in objects if o and o != AGENT], sections[":init"].items[1:])
    except KeyError as error:
        raise FileFormatError(f"{source}: a problem has no section {error.args[0]}") from error
    except AtLineError as error:
        raise FileFormatError(f"{source}, line {error.line}: {error}") from error
    except InputError as error:
        raise FileFormatError(f"{source}: {error}") from error


def _start(things: list[str], facts: tuple[Node, ...]) -> Start:
    states: set[tuple[str, str]] = set()
    relations: dict[tuple[str, str, str], None] = {}
    left_out: list[str] = []
    coming: set[str] = set()
    for fact in facts:
        if not isinstance(fact, Group) or fact.head == "not":  # what is not said is not so
            continue
        head, args = SPELT.get(fact.head, fact.head), [str(a) for a in fact.items[1:]]
        if head == ROOM or AGENT in (_ours_of(Word(a, 0)) for a in args):
            continue
        if head == FUTURE:
            coming |= {thing(a) for a in args}
        elif head in ATTRIBUTES and len(args) == 1:
            states.add((thing(args[0]), head))
        elif head in RELATIONS and len(args) == 2:
            relations[thing(args[0]), head, thing(args[1])] = None
        else:
            left_out.append(f"start fact {fact}")
    there = tuple(dict.fromkeys(things))
    states |= {(t, REAL) for t in there if t not in coming}
    named = {t for t, _ in states} | {t for a, _, b in relations for t in (a, b)}
    if unknown := sorted(named - set(there)):
        raise InputError(f"{', '.join(unknown)}: in :init and not among :objects")
    return Start(there, frozenset(states), tuple(relations), tuple(left_out))


def _formula(node: Node, things: Collection[str], scope: Mapping[str, str]) -> str:
    if not isinstance(node, Group) or not node.head:
        raise InputError(f"a condition is expected, not {_shown(node)}")
    parts = node.items[1:]
    if node.head in _CONNECTIVES:
        told = [_formula(p, things, scope) for p in parts]
        return f"({f' {node.head} '.join(told)})" if told else "true"
    if node.head == "not" and len(parts) == 1:
        return f"not ({_formula(parts[0], things, scope)})"
    if node.head == "imply" and len(parts) == 2:
        first, second = (_formula(p, things, scope) for p in parts)
        return f"(({first}) implies ({second}))"
    if node.head in _QUANTIFIERS and len(parts) == 2 and isinstance(parts[0], Group):
        return _quantified(node.head, parts[0], parts[1], things, scope)
    return _atom(node, things, scope)


def _quantified(
    head: str, variables: Group, part: Node, things: Collection[str], scope: Mapping[str, str]
) -> str:
    words = [str(w) for w in variables.items]
    if len(words) != 3 or words[1] != "-":
        raise InputError(f"one variable of one kind is expected, not {variables}")
    kind, own = _ours(words[2]), f"?v{len(scope) + 1}"
    if not any(category_of(t) == kind for t in things):
        raise InputError(f"there is no {words[2]} among the objects")
    inner = _formula(part, things, {**scope, words[0]: own})
    return f"({_QUANTIFIERS[head]} {own} - {kind}: {inner})"


def _atom(node: Group, things: Collection[str], scope: Mapping[str, str]) -> str:
    head = SPELT.get(node.head, node.head)
    count = 1 if head in ATTRIBUTES else 2
    if head not in (*ATTRIBUTES, *RELATIONS) or len(node.items) != count + 1:
        number = len(node.items) - 1
        raise InputError(f"predicate {node.head!r} of {number} things is not known here")
    args = []
    for word in node.items[1:]:
        name = scope.get(str(word)) or thing(str(word))
        if not name.startswith("?") and name not in things:
            raise InputError(f"{word} in {node} is not among the objects")
        args.append(name)
    return f"{head}({', '.join(args)}){'=yes' if head in ATTRIBUTES else ''}"


def _words(items: tuple[Node, ...]) -> Iterator[Word]:
    """The names of typed objects, without their types."""
    typed = False
    for item in items:
        if not isinstance(item, Word):
            raise AtLineError(item.line, f"an object is expected, not {_shown(item)}")
        if item.text == "-":
            typed = True
        elif typed:
            typed = False
        else:
            yield item


def _ours_of(word: Word) -> str:
    match = _THING.fullmatch(word.text)
    return "" if match is None else f"{_ours(match[1])}-{int(match[2])}"


def _ours(text: str) -> str:
    match = _NAME.fullmatch(text.lower())
    if match is None:
        raise InputError(f"{text!r} is no name")
    return re.sub(r"[.-]", "_", match[1])


def _shown(node: Node) -> str:
    text = str(node)
    return text if len(text) <= 60 else f"{text[:57]}..."
