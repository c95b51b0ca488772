"""What can be chosen by name, shipped (`tables`) or somebody's own, loaded only when asked for.

Asked by the rest of this package. A part is a factory: a function or a class whose keyword
parameters are its options (`assembly.options`) and whose first parameter, if it is called `parts`,
lends it what it needs (`seams.Parts`). Others add theirs by entry point, group "forestall.<kind>",
for example

    [project.entry-points."forestall.segmenter"]
    my-segmenter = "my_package.masks:MySegmenter"

or are named where they stand: "my_package.masks:MySegmenter".
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import cache
from importlib import import_module
from importlib.metadata import EntryPoint, entry_points, packages_distributions
from typing import Any

from forestall import kinds
from forestall.assembly.tables import DATA_SETS, FOREIGN, LOGS, NEEDS, PLAN_SETS, TABLES, Table
from forestall.domain.load import load_domain
from forestall.errors import InputError, UnknownNameError
from forestall.extras import installed, missed
from forestall.types.kind import Kind


@dataclass(frozen=True, slots=True)
class Found:
    """A factory and where it comes from.

    Args:
        kind: of the part.
        name: of the part.
        factory: builds it.
        package: whose it is in words, None for a shipped one.
    """

    kind: str
    name: str
    factory: Callable[..., Any]
    package: str | None

    @property
    def text(self) -> str:
        """Which part is meant, for messages."""
        of = "" if self.package is None else f" of the package {self.package}"
        return f"{self.kind} {self.name!r}{of}"


def default(kind: Kind[Any]) -> str:
    """The part of a kind that a run has when nothing is said."""
    return TABLES[kind.name].default


def table(kind: str) -> Table:
    """The table of a kind.

    Raises:
        UnknownNameError: no such kind.
    """
    if kind not in TABLES:
        raise UnknownNameError("kind of part", kind, TABLES)
    return TABLES[kind]


def known(kind: str) -> tuple[str, ...]:
    """Every name of a kind, entry points included."""
    return tuple(sorted({*table(kind).targets, *(e.name for e in _entries(kind))}))


def lacking(kind: str, name: str) -> str | None:
    """The extra without which a part does not work, where it is not installed."""
    extra = NEEDS.get((kind, name))
    return None if extra is None or installed(extra) else extra


def find(kind: str, name: str) -> Found:
    """The factory behind a name, behind "module:attribute", or behind the file of a domain.

    Raises:
        UnknownNameError: no such name.
        InputError: it is known and cannot be imported.
    """
    if (target := table(kind).targets.get(name)) is not None:
        try:
            return Found(kind, name, _imported(target), None)
        except ImportError as error:
            why = missed(error) or error
            raise InputError(f"{kind} {name!r} cannot be loaded ({target}): {why}") from error
    target, package = name, None
    for entry in _entries(kind):
        if entry.name == name:
            target, package = entry.value, _package(entry)
    if kind == kinds.DOMAIN.name and name.endswith((".toml", ".pddl")):
        return Found(kind, name, _domain_file(name), None)
    if ":" not in target:
        raise UnknownNameError(kind, name, known(kind))
    package = package or _owner(target)
    try:
        return Found(kind, name, _imported(target), package)
    except Exception as error:  # somebody else's code: whatever breaks is told with its package
        raise InputError(
            f"{kind} {name!r} of the package {package} cannot be loaded ({target}): "
            f"{type(error).__name__}: {error}"
        ) from error


def foreign(name: str) -> Callable[..., Any]:
    """What makes a household of others, by its name.

    Raises:
        UnknownNameError: no such household.
        InputError: it is known and cannot be imported.
    """
    return _of_others("household", name, FOREIGN, "third-party")


def data_set(name: str) -> Callable[..., Any]:
    """What opens recorded runs of others, by the name of their data set.

    Raises:
        UnknownNameError: no such data set.
        InputError: it is known and cannot be imported.
    """
    return _of_others("data set", name, DATA_SETS, "data-set")


def log(name: str) -> Callable[..., Any]:
    """What writes a log, by its name.

    Raises:
        UnknownNameError: no such log.
        InputError: it is known and cannot be imported.
    """
    return _of_others("log", name, LOGS, "log")


def plan_set(name: str) -> Callable[..., Any] | None:
    """What opens plans of others, by the name of their set; None where no set has it.

    Raises:
        InputError: it is known and cannot be imported.
    """
    if name not in PLAN_SETS and name not in {e.name for e in _entries("plan-set")}:
        return None
    return _of_others("set of plans", name, PLAN_SETS, "plan-set")


def imported_sets() -> tuple[str, ...]:
    """Every name that `forestall import` takes."""
    others = [e.name for group in ("data-set", "plan-set") for e in _entries(group)]
    return tuple(sorted({*DATA_SETS, *PLAN_SETS, *others}))


def _of_others(what: str, name: str, shipped: Mapping[str, str], group: str) -> Callable[..., Any]:
    others = {e.name: e.value for e in _entries(group)}
    target = shipped.get(name, others.get(name))
    if target is None:
        raise UnknownNameError(what, name, (*shipped, *others))
    try:
        return _imported(target)
    except ImportError as error:
        why = missed(error) or error
        raise InputError(f"{what} {name!r} cannot be loaded ({target}): {why}") from error


def _entries(kind: str) -> tuple[EntryPoint, ...]:
    return tuple(entry_points(group=f"forestall.{kind}"))


@cache
def _domain_file(path: str) -> Callable[..., Any]:
    def read() -> Any:
        return load_domain(path)

    return read


def _imported(target: str) -> Callable[..., Any]:
    module, _, attribute = target.partition(":")
    try:
        factory: Callable[..., Any] = getattr(import_module(module), attribute)
    except AttributeError as error:
        raise ImportError(f"{module} has no {attribute!r}") from error
    return factory


def _package(entry: EntryPoint) -> str | None:
    return None if entry.dist is None else f"{entry.dist.name} {entry.dist.version}"


def _owner(target: str) -> str:
    """The distribution that a module comes from; the module's first name where it has none."""
    top = target.partition(":")[0].partition(".")[0]
    return ", ".join(dict.fromkeys(packages_distributions().get(top, [top])))
