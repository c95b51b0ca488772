"""The configuration of a run: frozen, checked, plain data that a record can hold.

Commands, experiments and Python make one with `run_config`; `make` builds a run from it. What
somebody says about the parts is `Given`, whether it comes from flags, a TOML file or keywords;
`Given.over` puts one over another (file < flag). Every name and option is checked here, before
anything is built.
"""

from __future__ import annotations

import hashlib
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from forestall.assembly.options import built, checked, plain
from forestall.assembly.registry import find, table
from forestall.assembly.tables import TABLES
from forestall.domain.model import Domain
from forestall.domain.toml_out import domain_toml
from forestall.errors import FileFormatError, InputError, UnknownNameError
from forestall.kinds import DOMAIN, PERCEIVER, WORLD
from forestall.reading.documents import read_toml
from forestall.tasks.files import LoadedTask, load_task
from forestall.types.kind import Kind

SHORT: Mapping[str, tuple[str, str | None]] = {
    "encoder": ("text-encoder", None),
    "feature": ("perceiver", "feature"),
    "memory": ("store", "path"),
    "renderer": ("world", "renderer"),
    "threshold": ("detector", "threshold"),
}
"""Short names: of a part's name, or of one of its options."""

SWITCHES: Mapping[str, str] = {
    "subtask-node": "subtask_node",
    "structure": "use_structure",
    "nodes": "use_node",
    "edges": "use_edge",
}
"""What the score can do without (paper, Table 2 left) → the option that it switches off."""

WITHOUT = (*SWITCHES, "reasoning", "validation")
"""Everything that a run can do without."""

NAME = "name"
"""What a part is called, where its options stand, too; no option has this name."""

SYMBOLIC, SYMBOLIC_PERCEIVER = "symbolic", "given-graph"
"""The world of a domain that nothing simulates, and what sees in it: it shows scene graphs."""

RUN_KEYS = ("scenario", "seed", "without")
"""What a configuration file may say besides its tables of parts."""


@dataclass(frozen=True, slots=True)
class Choice:
    """A part that was chosen, with its options as plain data.

    Args:
        kind: of the part.
        name: of the part.
        given: options that somebody gave, sorted.
        defaulted: the others.
    """

    kind: str
    name: str
    given: tuple[tuple[str, Any], ...] = ()
    defaulted: tuple[tuple[str, Any], ...] = ()

    @property
    def options(self) -> dict[str, Any]:
        """Given and defaulted."""
        return {**dict(self.defaulted), **dict(self.given)}

    def to_json(self, defaulted: bool = True) -> dict[str, Any]:
        """As it stands in records; `defaulted`: with what was left to defaults."""
        said = {"name": self.name, "given": dict(self.given)}
        return {**said, "defaulted": dict(self.defaulted)} if defaulted else said


@dataclass(frozen=True, slots=True)
class Given:
    """What somebody said about parts: kind, name if any, options.

    Args:
        parts: sorted by kind, each kind once.
    """

    parts: tuple[tuple[str, str | None, tuple[tuple[str, Any], ...]], ...] = ()

    @classmethod
    def of(cls, tables: Mapping[str, tuple[str | None, Mapping[str, Any]]]) -> Given:
        """From kind → (name, options)."""
        return cls(
            tuple(
                (kind, name, tuple(sorted((k, plain(v)) for k, v in options.items())))
                for kind, (name, options) in sorted(tables.items())
            )
        )

    @classmethod
    def named(cls, values: Mapping[str, Any]) -> Given:
        """From keywords; what is None was not said.

        Args:
            values: kind or short name → the part's name, or a table of "name" and options; dots
                (`detector.threshold`) name one option, `detector.name` the part.

        Raises:
            UnknownNameError: no such kind or short name.
        """
        found: dict[str, tuple[str | None, dict[str, Any]]] = {}
        for key, value in values.items():
            if value is None:
                continue
            kind, dot, option = key.partition(".")
            kind, short = SHORT.get(kind, (kind.replace("_", "-"), None))
            if kind not in TABLES:
                raise UnknownNameError("part", key, (*TABLES, *SHORT))
            name, options = found.get(kind, (None, {}))
            if option == NAME:
                name = str(value)
            elif dot or short:
                options = {**options, (option or short or ""): value}
            elif isinstance(value, Mapping):
                name = str(value[NAME]) if NAME in value else name
                options = {**options, **{k: v for k, v in value.items() if k != NAME}}
            else:
                name = str(value)
            found[kind] = (name, options)
        return cls.of(found)

    @classmethod
    def said(cls, settings: Iterable[str]) -> Given:
        """From "detector.threshold=0.85", one option each.

        Raises:
            InputError: not of that form.
        """
        values: dict[str, str] = {}
        for text in settings:
            key, equals, value = text.partition("=")
            if not equals or "." not in key:
                raise InputError(f"{text!r}: write KIND.OPTION=VALUE, as detector.threshold=0.85")
            kind, _, option = key.partition(".")
            values[f"{kind}.{option.replace('-', '_')}"] = value
        return cls.named(values)

    def over(self, below: Given) -> Given:
        """This over another: another part of a kind brings none of the options of the one below."""
        found = {kind: (name, dict(options)) for kind, name, options in below.parts}
        for kind, name, options in self.parts:
            lower, kept = found.get(kind, (None, {}))
            if name is not None and lower is not None and name != lower:
                kept = {}
            found[kind] = (name or lower, {**kept, **dict(options)})
        return Given.of(found)

    def kinds(self) -> tuple[str, ...]:
        """What something was said about."""
        return tuple(kind for kind, _, _ in self.parts)

    def name(self, kind: str) -> str | None:
        """The part of a kind that was said; None where none was."""
        return next((name for k, name, _ in self.parts if k == kind), None)

    def chosen(self, kind: str) -> Choice:
        """The checked choice of a kind: what was said, over the defaults.

        Raises:
            InputError: a name, an option or a value that is not valid; says what would be.
        """
        name, options = next(
            ((n, dict(o)) for k, n, o in self.parts if k == kind),
            (None, {}),
        )
        found = find(kind, name or table(kind).default)
        return Choice(kind, found.name, *checked(found, options))


@dataclass(frozen=True, slots=True)
class RunConfig:
    """Everything that a run can be configured with; see `run_config`.

    Args:
        task: name of a shipped task, or a task file.
        scenario: name of a shipped scenario, or a scenario file; None for an undisturbed run.
        seed: of the scene.
        choices: one for each kind of part.
        without: a part that is left out, one of `WITHOUT`; it stands in the choices, too.
        keep_observations: whether pictures stay in the record.
        final_look: whether the robot looks once more when the plan is finished.
        domain: that was said, by name or file; None for the task's own. It stands in the choices,
            too.
    """

    task: str
    scenario: str | None = None
    seed: int = 0
    choices: tuple[Choice, ...] = field(default_factory=lambda: choices(Given()))
    without: str | None = None
    keep_observations: bool = True
    final_look: bool = False
    domain: str | None = None

    def choice(self, kind: Kind[Any]) -> Choice:
        """The part of a kind."""
        return next(c for c in self.choices if c.kind == kind.name)

    def load(self) -> LoadedTask:
        """The task, read in the domain that was said, else in its own.

        Raises:
            InputError: see `load_task`.
        """
        said = None if self.domain is None else domain_of(self.choice(DOMAIN))
        return load_task(self.task, said)

    def load_domain(self) -> Domain:
        """The domain of the task; where there is none, the one that was said or the default."""
        return self.load().domain if self.task else domain_of(self.choice(DOMAIN))

    def to_json(self, defaulted: bool = True) -> dict[str, Any]:
        """As it stands in records: what was given, and what was left to defaults.

        Args:
            defaulted: with the defaults, which a folder of many runs has once.
        """
        return {
            "task": self.task,
            "scenario": self.scenario,
            "seed": self.seed,
            "without": self.without,
            "keep_observations": self.keep_observations,
            "final_look": self.final_look,
            "domain": self.domain,
            "parts": {c.kind: c.to_json(defaulted) for c in self.choices},
        }


def run_config(
    task: str,
    scenario: str | None = None,
    *,
    seed: int = 0,
    without: str | None = None,
    keep_observations: bool = True,
    final_look: bool = False,
    given: Given | None = None,
    **named: Any,
) -> RunConfig:
    """A checked configuration.

    Args:
        task: name of a shipped task, or a task file.
        scenario: name of a shipped scenario, or a scenario file; None for an undisturbed run.
        seed: of the scene.
        without: a part to leave out, one of `WITHOUT`.
        keep_observations: whether pictures stay in the record.
        final_look: whether the robot looks once more when the plan is finished.
        given: what was said about parts, in a file or by flags, the domain among them: a name or a
            file. What is not said is as the run's domain has it (`fitting`), else as the tables
            have it.
        **named: the same by keyword, over `given`: `strategy="online"`,
            `detector={"name": "objects", "threshold": 0.8}`, or a short name of `SHORT`.

    Raises:
        InputError: a name, an option or a value that is not valid; says what would be.
    """
    said = Given.named(named).over(given or Given())
    own = said_domain(said, task)
    other = None if own is None else own.name
    if task:
        domain = load_task(task, None if own is None else domain_of(own)).domain
        parts = tuple(part for part in said.parts if part[0] != DOMAIN.name)
        said = fitting(Given(parts), domain)
        own = own or Choice(DOMAIN.name, domain.name)
    chosen = choices(_ablated(said, without))
    chosen = tuple(own if own is not None and c.kind == own.kind else c for c in chosen)
    return RunConfig(
        task,
        scenario,
        seed,
        chosen,
        without,
        keep_observations,
        final_look,
        other,
    )


def fitting(said: Given, domain: Domain) -> Given:
    """What was said, over what a run in a domain has where nothing is said.

    That is what the domain's table `run` says; without a world in it, the symbolic one where the
    default world does not simulate the domain; and in the symbolic world its perceiver.
    """
    said = said.over(Given.named(dict(domain.run)))
    if said.name(WORLD.name) is None:
        usual = find(WORLD.name, table(WORLD.name).default).factory
        if not getattr(usual, "simulates", lambda domain: True)(domain):
            said = said.over(Given.named({WORLD.name: SYMBOLIC}))
    if said.name(WORLD.name) == SYMBOLIC:
        said = said.over(Given.named({PERCEIVER.name: SYMBOLIC_PERCEIVER}))
    return said


def choices(given: Given) -> tuple[Choice, ...]:
    """The checked choice of every kind."""
    return tuple(given.chosen(kind) for kind in TABLES)


def read_file(path: Path) -> tuple[Given, dict[str, Any]]:
    """A configuration file: tables by kind, and scenario, seed or without.

    Raises:
        FileFormatError: it cannot be read, or says something that is neither.
    """
    data = read_toml(path, "configuration")
    run = {key: data.pop(key) for key in RUN_KEYS if key in data}
    types = {"scenario": str, "seed": int, "without": str}
    for key, value in run.items():
        if not isinstance(value, types[key]) or isinstance(value, bool):
            raise FileFormatError(f"{path}: {key} cannot be {value!r}")
    for key in data:
        if key not in TABLES and key not in SHORT:
            known = (*TABLES, *SHORT, *RUN_KEYS)
            raise FileFormatError(f"{path}: {UnknownNameError('table', key, known)}")
    return Given.named(data), run


def said_domain(given: Given, task: str = "") -> Choice | None:
    """The domain that was said; None where none was, or the task's own by its name.

    Raises:
        UnknownNameError: no installed domain, no file, and not the task's own.
    """
    name = given.name(DOMAIN.name)
    if name is None:
        return None
    try:
        return given.chosen(DOMAIN.name)
    except UnknownNameError:
        if task and load_task(task).domain.name == name:
            return None
        raise


def domain_of(choice: Choice) -> Domain:
    """The domain that a choice means, read from its file or built by its factory.

    Raises:
        InputError: it cannot be read or built, or is no domain.
    """
    found = find(choice.kind, choice.name)
    domain = built(found, dict(choice.given), None)
    if not isinstance(domain, Domain):
        raise InputError(f"{found.text} is no domain: it is {type(domain).__name__}")
    return domain


def digest_of(domain: Domain) -> str:
    """Sixteen hexadecimal digits of what a domain says, the same in every process."""
    return hashlib.blake2b(domain_toml(domain).encode(), digest_size=8).hexdigest()


def _ablated(given: Given, without: str | None) -> Given:
    """What was said, and over it what leaving out a part means."""
    if without is None:
        return given
    if without not in WITHOUT:
        raise UnknownNameError("part to leave out", without, WITHOUT)
    if without in SWITCHES:
        name = given.chosen("detector").name
        if name != "scene-graph":
            raise InputError(
                f"without {without!r}: only the detector 'scene-graph' has that part, not {name!r}"
            )
        return Given.named({f"detector.{SWITCHES[without]}": False}).over(given)
    if without == "reasoning":
        return Given.named({"reasoner": "none", "replanner": "anew"}).over(given)
    return Given.named({"replanner.validator": "accept-all"}).over(given)
