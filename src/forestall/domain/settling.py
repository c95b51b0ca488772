"""Whether what happens by itself comes to an end.

Called by `checks`. Processes that set one attribute of one thing to different values could undo
each other for ever; two of them are refused where what each brings about lets the other begin.
"""

from __future__ import annotations

from forestall.domain.formula import literals, normal
from forestall.domain.located import keyed
from forestall.domain.model import Domain
from forestall.domain.schema import Process
from forestall.errors import InputError
from forestall.types.facts import Literal


def check_settling(domain: Domain) -> None:
    """See that no process, and no two, undo what they did.

    Raises:
        InputError: a process that never settles.
    """
    for process in domain.processes:
        for fact in _facts(process):
            for other in domain.processes:
                for back in _facts(other):
                    if _undoes(fact, back) and _leads(process, fact, other, back):
                        both = (
                            process.name
                            if process is other
                            else (f"{process.name} and {other.name}")
                        )
                        text = f"process {both}: never settles: {fact} and {back} follow each other"
                        raise keyed(InputError(text), f"[processes.{process.name}]")


def _facts(process: Process) -> list[Literal]:
    return [f for e in process.effects for f in e.facts]


def _undoes(fact: Literal, back: Literal) -> bool:
    return fact.predicate == back.predicate and fact.value != back.value


def _leads(first: Process, fact: Literal, second: Process, back: Literal) -> bool:
    """Whether each asks, of the thing itself, for just what the other brings about."""
    return _asks(second, back, fact) and _asks(first, fact, back)


def _asks(process: Process, own: Literal, given: Literal) -> bool:
    conditions = [process.condition]
    conditions += [e.condition for e in process.effects if own in e.facts]
    for condition in conditions:
        for literal, positive in literals(normal(condition)):
            if literal.args == own.args and literal.predicate == given.predicate:
                if positive and literal.value == given.value:
                    return True
                if not positive and literal.value == own.value:
                    return True
    return False
