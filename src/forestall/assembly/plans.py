"""Plans of anybody's as text: steps in a line, a file or standard input, JSON or one a line.

Called by `checking` and `plan_checking`; calls the words of the domain.
"""

from __future__ import annotations

import re
import sys
from collections.abc import Collection
from pathlib import Path
from typing import Any

from forestall.domain.model import Domain
from forestall.domain.words import Words
from forestall.errors import FileFormatError, InputError, UnknownNameError
from forestall.reading.documents import parse_json
from forestall.reading.files import read_text
from forestall.types.facts import category_of
from forestall.types.plan import Plan, Subtask

STANDARD_INPUT = "-"

_MOST_BYTES = 2**20
_NUMBERED = re.compile(r"^\s*(?:\d+[.):]|[-*])\s+")


def read_plan(text_or_file: str, domain: Domain, source: str = "--plan") -> Plan:
    """A plan of "step; step", or of a file.

    Args:
        text_or_file: the steps; a file with one step a line, in which "#" begins a comment, or
            with a JSON list of steps; "-" for standard input.
        domain: whose skills they are.
        source: of steps that are no file, in errors.

    Raises:
        FileFormatError: the file cannot be read.
        InputError: no step, or one that does not fit the domain, by its number.
    """
    text = text_or_file
    if text_or_file == STANDARD_INPUT:
        text, source = sys.stdin.read(_MOST_BYTES), "standard input"
    elif "(" not in text_or_file:
        source = text_or_file
        try:
            text = read_text(Path(text_or_file), "plan", _MOST_BYTES)
        except FileFormatError as error:
            raise FileFormatError(
                f"{error}; give a file with one step a line, or the steps: "
                "'skill(Thing); skill(Thing, Place)'"
            ) from error
    steps = _steps(text, source)
    if not steps:
        raise InputError(f"{source}: the plan has no step")
    plan = []
    for number, step in enumerate(steps, 1):
        try:
            plan.append(fitting(Subtask.parse(step), domain))
        except InputError as error:
            raise InputError(f"{source}: step {number}: {error}") from error
    return Plan(tuple(plan))


def fitting(subtask: Subtask, domain: Domain) -> Subtask:
    """A subtask in the domain's own words.

    Raises:
        InputError: it is none of the domain's, or an argument is nearly one of its words.
    """
    words = Words(domain)
    for name in subtask.args:
        if words.slip(name):
            domain[name]
    return domain.check(words.subtask(subtask))


def check_arguments(plan: Plan, things: Collection[str], domain: Domain, source: str) -> None:
    """See that every argument is a thing of the scene, or of a category that is known.

    Args:
        plan: of the domain.
        things: names of what is in the scene, and their categories.
        domain: its categories and hands count, too.
        source: of the plan, in errors.

    Raises:
        InputError: an argument that means nothing, with the step and the nearest names.
    """
    for number, step in enumerate(plan, 1):
        for name in step.args:
            known = name in things or name in domain.robot.hands or domain.find(name) is not None
            if not known and category_of(name) not in things:
                options = {*things, *domain.categories}
                error = UnknownNameError(f"argument of {step}", name, options)
                raise InputError(f"{source}: step {number}: {error}")


def _steps(text: str, source: str) -> list[Any]:
    """The texts of the steps; a number or a dash before one is left out."""
    if text.lstrip()[:1] in ("[", "{"):
        try:
            data = parse_json(text)
        except FileFormatError as error:
            raise FileFormatError(f"{source}: {error}") from error
        if isinstance(data, dict) and "plan" in data:
            data = data["plan"]
        if not isinstance(data, list):
            raise FileFormatError(f'{source}: a list of steps is expected: ["skill(Thing)", ...]')
        return data
    lines = (_NUMBERED.sub("", line.partition("#")[0]) for line in text.splitlines())
    return [step.strip() for line in lines for step in line.split(";") if step.strip()]
