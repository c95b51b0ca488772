"""Scenario files as text: what `files` reads, written by the program.

Called by the command line for drawn scenarios; calls nothing. TOML's basic strings are JSON's.
"""

from __future__ import annotations

import json
from collections.abc import Sequence
from typing import Any

from forestall.tasks.files import Scenario

HEAD = """# Drawn by `forestall cases draw`, each judged by playing it without a monitor; see
# docs/experiments.md, "Further sets". Draw anew rather than edit.
"""


def set_file(task: str, scenarios: Sequence[Scenario]) -> str:
    """The text of one file: the scenarios of a set that are of one task."""
    parts = [HEAD, f"task = {_value(task)}\n"]
    for scenario in scenarios:
        parts.append("\n[[scenarios]]\n")
        fields = ("name", "title", "kind", "cause", "source", "known", "effect", "compared")
        for name in fields:
            value = getattr(scenario, name)
            if value not in (None, ""):
                parts.append(f"{name} = {_value(value)}\n")
        for fault in scenario.faults:
            parts.append("\n[[scenarios.faults]]\n")
            table = {"kind": fault.kind} | fault.model_dump(mode="json", exclude_defaults=True)
            parts += [f"{name} = {_value(value)}\n" for name, value in table.items()]
    return "".join(parts)


def _value(value: Any) -> str:
    if isinstance(value, dict):
        inside = ", ".join(f"{k} = {_value(v)}" for k, v in value.items())
        return f"{{ {inside} }}"
    if isinstance(value, list | tuple):
        if sum(map(len, map(str, value))) > 70:
            return "[\n" + "".join(f"  {_value(v)},\n" for v in value) + "]"
        return f"[{', '.join(map(_value, value))}]"
    return json.dumps(value, ensure_ascii=False)
