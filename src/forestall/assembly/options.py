"""The options of a part: what its factory declares, read, checked and turned into arguments.

Called by `configuration` (to check what was given) and `parts` (to build). An option is a keyword
parameter of the factory, or a field of a parameter that is an options dataclass; its default
stands there and nowhere else. Values travel as plain data (text, numbers, tuples), which can be
written into a record and compared.
"""

from __future__ import annotations

import inspect
import types
import typing
from collections.abc import Callable, Mapping
from dataclasses import MISSING, dataclass, fields, is_dataclass
from enum import Enum
from functools import cache
from pathlib import PurePath
from typing import Any

from forestall.assembly.registry import Found
from forestall.errors import ForestallError, InputError, UnknownNameError
from forestall.types.kind import Settled

BORROWS = "parts"
"""Name of the first parameter of a factory that borrows."""


@dataclass(frozen=True, slots=True)
class Option:
    """One option.

    Args:
        name: as in flags and files.
        hint: its type.
        default: its value when nothing is said, `MISSING` where it must be given.
        parameter: of the factory.
        within: the options dataclass that it is a field of, None for a plain parameter.
    """

    name: str
    hint: Any
    default: Any
    parameter: str
    within: Any


@dataclass(frozen=True, slots=True)
class Declared:
    """What a factory declares."""

    borrows: bool
    options: Mapping[str, Option]


@cache
def declared(factory: Callable[..., Any]) -> Declared:
    """The options of a factory by name.

    Raises:
        TypeError: two options of one name, or annotations that cannot be read.
    """
    called = factory.__init__ if inspect.isclass(factory) else factory
    try:
        hints = typing.get_type_hints(called, include_extras=True)
    except NameError as error:
        raise TypeError(f"its annotations cannot be read: {error}") from error
    found: dict[str, Option] = {}
    borrows = False
    for parameter in inspect.signature(factory).parameters.values():
        if parameter.name == BORROWS:
            borrows = True
            continue
        if parameter.kind in (parameter.VAR_POSITIONAL, parameter.VAR_KEYWORD):
            continue
        hint = hints.get(parameter.name, Any)
        config, settled = _dataclass_of(hint)
        if config is None:
            plain = MISSING if parameter.default is parameter.empty else parameter.default
            options = [Option(parameter.name, hint, plain, parameter.name, None)]
        else:
            options = _fields(config, settled, parameter.name)
        for option in options:
            if option.name == "name":
                raise TypeError("it declares the option 'name', which means the part itself")
            if option.name in found:
                raise TypeError(f"it declares the option {option.name!r} twice")
            found[option.name] = option
    return Declared(borrows, found)


def _dataclass_of(hint: Any) -> tuple[Any, tuple[str, ...]]:
    """The options dataclass that a parameter is annotated with, and fields that are settled."""
    settled: tuple[str, ...] = ()
    if typing.get_origin(hint) is typing.Annotated:
        hint, *marks = typing.get_args(hint)
        settled = next((m.fields for m in marks if isinstance(m, Settled)), ())
    union = typing.get_origin(hint) in (typing.Union, types.UnionType)
    for one in typing.get_args(hint) if union else (hint,):
        if inspect.isclass(one) and is_dataclass(one):
            return one, settled
    return None, settled


def _fields(config: Any, settled: tuple[str, ...], parameter: str) -> list[Option]:
    hints = typing.get_type_hints(config)
    options = []
    for field in fields(config):
        if field.name in settled:
            continue
        default = field.default
        if default is MISSING and field.default_factory is not MISSING:
            default = field.default_factory()
        options.append(Option(field.name, hints[field.name], default, parameter, config))
    return options


def checked(
    found: Found, given: Mapping[str, Any]
) -> tuple[tuple[tuple[str, Any], ...], tuple[tuple[str, Any], ...]]:
    """Given and defaulted options as plain data, each sorted by name.

    Raises:
        UnknownNameError: the part has no such option.
        InputError: a value that does not fit, or an option that must be given and is not.
    """
    options = _declared_by(found)
    for name in given:
        if name not in options:
            raise UnknownNameError(f"option of the {found.text}", name, options)
    values = {name: _converted(found, options[name], value) for name, value in given.items()}
    missing = [n for n, o in options.items() if o.default is MISSING and n not in values]
    if missing:
        raise InputError(f"the {found.text} needs the option {' and '.join(missing)}")
    _arguments(found, options, values)
    return (
        tuple(sorted((n, plain(v)) for n, v in values.items())),
        tuple(sorted((n, plain(o.default)) for n, o in options.items() if n not in values)),
    )


def built(found: Found, given: Mapping[str, Any], parts: Any) -> Any:
    """Call the factory of a part.

    Raises:
        InputError: a part of somebody else's that cannot be built, or whose options do not fit.
    """
    options = _declared_by(found)
    values = {name: _converted(found, options[name], value) for name, value in given.items()}
    arguments = _arguments(found, options, values)
    first = (parts,) if declared(found.factory).borrows else ()
    try:
        return found.factory(*first, **arguments)
    except ForestallError:
        raise
    except Exception as error:  # somebody else's code: whatever breaks is told with its package
        if found.package is None:
            raise
        raise InputError(
            f"{found.text} cannot be built: {type(error).__name__}: {error}"
        ) from error


def plain(value: Any) -> Any:
    """A value as it stands in records: text, numbers, tuples, None."""
    if isinstance(value, Enum):
        return value.value
    if isinstance(value, PurePath):
        return str(value)
    if isinstance(value, list | tuple | set | frozenset):
        return tuple(plain(v) for v in value)
    return value


def _declared_by(found: Found) -> Mapping[str, Option]:
    try:
        return declared(found.factory).options
    except (TypeError, ValueError) as error:
        raise InputError(f"{found.text} cannot be built: {error}") from error


def _arguments(
    found: Found, options: Mapping[str, Option], values: Mapping[str, Any]
) -> dict[str, Any]:
    """Keyword arguments for the factory; what was not given is left to its own defaults."""
    arguments: dict[str, Any] = {}
    grouped: dict[str, dict[str, Any]] = {}
    for name, value in values.items():
        option = options[name]
        if option.within is None:
            arguments[option.parameter] = value
        else:
            grouped.setdefault(option.parameter, {})[name] = value
    within = {o.parameter: o.within for o in options.values() if o.within is not None}
    for parameter, some in grouped.items():
        try:
            arguments[parameter] = within[parameter](**some)
        except InputError as error:
            if type(error) is not InputError:
                raise
            raise InputError(f"{found.text}: {error}") from error
    return arguments


def _converted(found: Found, option: Option, value: Any) -> Any:
    from pydantic import PydanticSchemaGenerationError, TypeAdapter, ValidationError

    hint = option.hint
    if isinstance(value, str) and typing.get_origin(hint) is tuple:
        value = tuple(part.strip() for part in value.split(",") if part.strip())
    if inspect.isclass(hint) and issubclass(hint, Enum) and not isinstance(value, hint):
        known = {str(member.value): member for member in hint}
        if str(value) not in known:
            raise UnknownNameError(f"{option.name} of the {found.text}", str(value), known)
        return known[str(value)]
    try:
        return TypeAdapter(hint).validate_python(value)
    except PydanticSchemaGenerationError as error:
        raise InputError(f"{option.name} of the {found.text} cannot be set") from error
    except ValidationError as error:
        why = error.errors()[0]["msg"]
        raise InputError(f"{option.name} of the {found.text} cannot be {value!r}: {why}") from error
