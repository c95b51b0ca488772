"""Things, facts and steps in a domain's words, as an owner would say them.

Called by whoever tells people what a run is about (`records/sentences.py`); calls the model. A
domain without words is said by its names: "lies_in(peg-1, tray-1)" is "the peg lies in the tray".
Whatever a part of somebody's own hands in is said somehow, and nothing of it is an error.
"""

from __future__ import annotations

import re
from collections.abc import Collection, Iterable, Mapping, Sequence
from dataclasses import replace

from forestall.domain.model import LOCATED, Domain
from forestall.domain.phrases import with_articles
from forestall.types.facts import GRIPPER, Literal, category_of, is_instance
from forestall.types.graph import SceneGraph
from forestall.types.plan import Subtask

_NUMBERS = ("no", "a", "two", "three", "four", "five", "six", "seven", "eight", "nine", "ten")
_ORDINALS = ("first", "second", "third", "fourth", "fifth", "sixth", "seventh", "eighth", "ninth")
_PREPOSITIONS = frozenset(["at", "from", "in", "into", "off", "on", "onto", "to", "with"])
_SLOT = re.compile(r"\{(\w+)\}")
_CALL = re.compile(r"(?:\b(not) )?\b([a-z]\w*)\(([^()]*)\)(?:=(\w+))?")
_INSTANCE = re.compile(r"(?:\b[Tt]he )?\b([A-Za-z][\w|.+]*-\d+)\b")
_CAMEL = re.compile(r"\b[A-Z]\w*\b")
_AUXILIARY = re.compile(r"\b(am|is|are|was|were|has|have|can|will)\b")
_VERB = re.compile(r"^(\{0\}|the \w+) (\w+s)\b")


class Spoken:
    """Says what a domain is about, in one scene: how many there are decides what needs a number.

    Args:
        domain: whose words are used.
        graph: the things that are known.
    """

    def __init__(self, domain: Domain, graph: SceneGraph) -> None:
        self.domain, self.graph = domain, graph
        self._alike: dict[str, list[str]] = {}
        for node in graph.nodes:
            self._alike.setdefault(node.category, []).append(node.id)
        for names in self._alike.values():
            names.sort(key=_by_number)

    # --- things ----------------------------------------------------------------------------------

    def the(self, name: str) -> str:
        """A thing: "the mug", "the second mug" where there are several, "stove burner 4".

        The name of a category of which there are several means any: "a counter".
        """
        if name in self.domain.robot.hands:
            return f"the {_plain(name)}"
        kind = self._kind(name)
        word, alike = self._word(kind), self._alike.get(kind, [])
        if not is_instance(name) and name not in alike:
            return f"the {word}" if len(alike) < 2 else with_articles(f"a {word}")
        if self.domain.is_a(kind, self.domain.roles.numbered) and len(alike) > 1:
            return f"{word} {name.rpartition('-')[2]}"
        if len(alike) < 2 or name not in alike:
            return f"the {word}"
        at = alike.index(name)
        if at < len(_ORDINALS):
            return f"the {_ORDINALS[at]} {word}"
        return f"the {word} {name.rpartition('-')[2]}"

    def several(self, names: Iterable[str], beside: Collection[str] = ()) -> str:
        """Things that are spoken of for the first time: "two nuts and a bolt".

        Args:
            names: of the things.
            beside: things that are spoken of already: another of their kind is "another mug".
        """
        kinds: dict[str, list[str]] = {}
        for name in names:
            kinds.setdefault(self._kind(name), []).append(name)
        known = {self._kind(n) for n in beside}
        said = []
        for kind, members in kinds.items():
            word, count = self._word(kind), len(members)
            if count == 1 and self.domain.is_a(kind, self.domain.roles.numbered):
                said.append(self.the(members[0]))
            elif count == 1:
                said.append(f"another {word}" if kind in known else with_articles(f"a {word}"))
            else:
                number = _NUMBERS[count] if count < len(_NUMBERS) else str(count)
                said.append(f"{number} {plural(word)}")
        return listed(said) or "something"

    def all_of(self, names: Sequence[str]) -> str:
        """Things that are known: "the plate and both nuts"."""
        kinds: dict[str, list[str]] = {}
        for name in dict.fromkeys(names):
            kinds.setdefault(self._kind(name), []).append(name)
        said: list[str] = []
        for kind, members in kinds.items():
            if len(members) > 1 and set(members) == set(self._alike.get(kind, ())):
                count = "both" if len(members) == 2 else f"all {len(members)}"
                said.append(f"{count} {plural(self._word(kind))}")
            else:
                said += [self.the(name) for name in members]
        return listed(said)

    def _any(self, name: str) -> bool:
        """Whether a name means any of several things."""
        alike = self._alike.get(self._kind(name), [])
        return not is_instance(name) and name not in alike and len(alike) > 1

    def _kind(self, name: str) -> str:
        node = self.graph.get(name)
        return node.category if node is not None else self.domain.canonical(category_of(name))

    def _word(self, kind: str) -> str:
        found = self.domain.find(kind)
        return _plain(kind) if found is None else _plain(found.spoken)

    # --- facts -----------------------------------------------------------------------------------

    def fact(self, literal: Literal, holds: bool = True) -> str:
        """A fact, or that it does not hold, as a clause: "the pan is not clean"."""
        first = literal.args[0] if literal.args else ""
        if holds != (literal.value == "true") and self._any(first):
            pattern = self._pattern(replace(literal, value="true"), True)
            if pattern.startswith("{0}"):
                names = {str(k): a for k, a in enumerate(literal.args)}
                return self._put(pattern, names, {first: f"no {self._word(self._kind(first))}"})
        return self._filled(self._pattern(literal, holds), literal)

    def would(
        self, literal: Literal, holds: bool = True, called: Mapping[str, str] | None = None
    ) -> str:
        """The same of what is to come: "the pan would not be clean"."""
        return self._filled(_would(self._pattern(literal, holds)), literal, called)

    def place(self, relation: str, place: str) -> str:
        """Where a thing is that has a relation to a place: "inside the microwave"."""
        return f"{placing(relation, self.domain)} {self.the(place)}"

    def _pattern(self, literal: Literal, holds: bool) -> str:
        """The clause with {0}, {1} for the things."""
        predicate, roles = literal.predicate, self.domain.roles
        if literal.is_state:
            value = self.domain.say(predicate, literal.value).replace("_", " ")
            return f"{{0}} is {value}" if holds else f"{{0}} is not {value}"
        holds = holds == (literal.value == "true")
        if predicate == LOCATED:
            return "I know where {0} is" if holds else "I do not know where {0} is"
        if predicate == roles.holding:
            return "I am holding {0}" if holds else "I am not holding {0}"
        return _related(predicate, len(literal.args), holds, self.domain)

    def _filled(
        self, pattern: str, literal: Literal, called: Mapping[str, str] | None = None
    ) -> str:
        return self._put(pattern, {str(k): a for k, a in enumerate(literal.args)}, called)

    # --- steps -----------------------------------------------------------------------------------

    def step(self, step: Subtask, called: Mapping[str, str] | None = None) -> str:
        """What a person says to have a subtask done: "put the plate in the microwave".

        Args:
            step: of a plan, or one that nobody knows.
            called: name → what it is called here: "it" for what was just spoken of.
        """
        called = called or {}
        skill = self.domain.skills.get(step.skill)
        if skill is not None and skill.says and len(skill.roles) == len(step.args):
            names = dict(zip(skill.roles, step.args, strict=True))
            return self._put(skill.says, names, called)
        words = _plain(skill.words if skill is not None and skill.words else step.skill)
        things = [called.get(a) or self.the(a) for a in step.args]
        *verb, last = words.split()
        if len(things) == 2 and verb and last in _PREPOSITIONS:
            return f"{' '.join(verb)} {things[0]} {last} {things[1]}"
        if len(things) < 2:
            return " ".join((words, *things))
        return f'do "{words}" with {listed(things)}'

    def _put(
        self, pattern: str, names: Mapping[str, str], called: Mapping[str, str] | None = None
    ) -> str:
        def said(match: re.Match[str]) -> str:
            name = names.get(match[1])
            return "something" if name is None else (called or {}).get(name) or self.the(name)

        return _SLOT.sub(said, pattern)

    # --- texts -----------------------------------------------------------------------------------

    def text(self, said: str) -> str:
        """A text in which facts, steps and names stand as programs write them, in words."""
        parts, last = [], 0
        for match in _CALL.finditer(said):
            parts += [self._names(said[last : match.start()]), self._call(match)]
            last = match.end()
        return "".join((*parts, self._names(said[last:])))

    def _call(self, match: re.Match[str]) -> str:
        denied, name, inside, value = match.groups()
        args = tuple(a.strip() for a in inside.split(",") if a.strip())
        if name in self.domain.skills and value is None and not denied:
            return f'"{self.step(Subtask(name, args))}"'
        if name not in self.domain.predicates and name != LOCATED and value is None:
            return self._names(match[0])
        return self.fact(Literal(name, args, value or "true"), not denied)

    def _names(self, said: str) -> str:
        def thing(match: re.Match[str]) -> str:
            name = match[1]
            known = self.graph.get(name) is not None or self.domain.find(name) is not None
            return self.the(name) if known else match[0]

        def kind(match: re.Match[str]) -> str:
            return self._word(match[0]) if match[0] in self.domain.categories else match[0]

        return _CAMEL.sub(kind, _INSTANCE.sub(thing, said))


def told(literal: Literal, domain: Domain, holds: bool = True) -> str:
    """A fact, or that it does not hold, of things by their names: "Vial-1 rests on Bench-1"."""
    holds = holds == (literal.value == "true")
    pattern = _related(literal.predicate, len(literal.args), holds, domain)
    names = {
        str(k): f"the {_plain(a)}" if a in domain.robot.hands or a == GRIPPER else a
        for k, a in enumerate(literal.args)
    }
    return _SLOT.sub(lambda match: names.get(match[1], "something"), pattern)


def placing(relation: str, domain: Domain) -> str:
    """What stands before a place, after "is": "inside", "on top of", "resting on"."""
    words = _words(relation, 2, domain)
    verb = None if words.startswith("{0} is ") else _VERB.match(words)
    if verb is not None:
        words = f"{verb[1]} is {_participle(_infinitive(verb[2]))}{words[verb.end() :]}"
    return words.removeprefix("{0} is ").removesuffix(" {1}")


def _related(predicate: str, arity: int, holds: bool, domain: Domain) -> str:
    """The clause of a fact that is no state, with {0}, {1} for the things."""
    words = _words(predicate, arity, domain)
    if holds:
        return words
    known = domain.predicates.get(predicate)
    return (known.opposite if known is not None else "") or denied(words)


def _words(predicate: str, arity: int, domain: Domain) -> str:
    known = domain.predicates.get(predicate)
    return known.words if known is not None and known.words else by_name(predicate, arity)


def by_name(predicate: str, arity: int) -> str:
    """How a sentence says a fact that has no words: "{0} is inside {1}", "{0} lies in {1}"."""
    plain = _plain(predicate)
    if arity == 0:
        return f"it is so that {plain}"
    others = " and ".join(f"{{{k}}}" for k in range(1, arity))
    says = plain if plain.split()[0].endswith("s") and arity > 1 else f"is {plain}"
    return f"{{0}} {says} {others}".rstrip()


def listed(things: Sequence[str], joined: str = "and") -> str:
    """Several things in a row: "a", "a and b", "a, b and c"."""
    if len(things) < 2:
        return "".join(things)
    return f"{', '.join(things[:-1])} {joined} {things[-1]}"


def plural(word: str) -> str:
    """Several of what an English word means."""
    if re.search(r"(s|x|z|ch|sh)$", word) or re.search(r"[^aeiou]o$", word):
        return f"{word}es"
    if re.search(r"[^aeiou]y$", word):
        return f"{word[:-1]}ies"
    if re.search(r"[^f]fe?$", word) and re.search(r"(kni|li|lea|loa|hal|shel|wol|thie)fe?$", word):
        return re.sub(r"fe?$", "ves", word)
    return f"{word}s"


def sentence(text: str) -> str:
    """A text with a capital letter at its beginning and a stop at its end."""
    text = text.strip()
    if not text:
        return ""
    return text[0].upper() + text[1:] + ("" if text[-1] in ".!?" else ".")


def _plain(name: str) -> str:
    """A name as words: "lies_in", "SoupLadle"; a short form in capitals stays."""
    apart = re.sub(r"(?<=[a-z0-9])(?=[A-Z])", " ", name.replace("_", " "))
    return " ".join(w.lower() if w[:1].isupper() and w[1:].islower() else w for w in apart.split())


def denied(words: str) -> str:
    """That something does not hold, from how a sentence with {0}, {1} says that it does."""
    if words.startswith("nothing "):
        return f"something {words[8:]}"
    if (found := _AUXILIARY.search(words)) is not None:
        said = "cannot" if found[1] == "can" else f"{found[1]} not"
        return words[: found.start()] + said + words[found.end() :]
    if (verb := _VERB.match(words)) is not None:
        return f"{verb[1]} does not {_infinitive(verb[2])}{words[verb.end() :]}"
    return f"it is not so that {words}"


def _would(words: str) -> str:
    """What will hold in the end, from how a sentence says that it holds."""
    words = words.replace(" cannot ", " can not ")
    if (found := _AUXILIARY.search(words)) is not None:
        rest = words[found.end() :]
        denied, rest = (" not", rest[4:]) if rest.startswith(" not ") else ("", rest)
        if found[1] in ("can", "will"):
            return f"{words[: found.start()]}could{denied}{rest}"
        be = "have" if found[1] in ("has", "have") else "be"
        return f"{words[: found.start()]}would{denied} {be}{rest}"
    if (verb := _VERB.match(words)) is not None and verb[2] != "does":
        return f"{verb[1]} would {_infinitive(verb[2])}{words[verb.end() :]}"
    return words.replace(" does not ", " would not ")


def _infinitive(verb: str) -> str:
    if re.search(r"(ch|sh|ss|x|zz)es$", verb):
        return verb[:-2]
    return f"{verb[:-3]}y" if verb.endswith("ies") and len(verb) > 4 else verb[:-1]


def _participle(verb: str) -> str:
    if verb.endswith("ie"):
        return f"{verb[:-2]}ying"
    return f"{verb[:-1]}ing" if verb.endswith("e") else f"{verb}ing"


def _by_number(name: str) -> tuple[str, int]:
    head, _, tail = name.rpartition("-")
    return (head, int(tail)) if tail.isdecimal() else (name, 0)
