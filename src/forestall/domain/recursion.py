"""Which predicates are defined by each other.

Called by `model`; `circle` works such facts out.
"""

from __future__ import annotations

from collections.abc import Mapping

from forestall.domain.formula import Formula, literals


def circles(definitions: Mapping[str, Formula]) -> dict[str, frozenset[str]]:
    """Predicate → those that it is defined with in a circle, itself included.

    The predicates of one circle share one set; one that is in no circle is not there.

    Args:
        definitions: derived predicate → its definition.
    """
    uses = {
        name: {x.predicate for x, _ in literals(definition) if x.predicate in definitions}
        for name, definition in definitions.items()
    }
    reached: dict[str, set[str]] = {}
    for name, used in uses.items():
        found, left = set[str](), list(used)
        while left:
            other = left.pop()
            if other not in found:
                found.add(other)
                left += uses[other]
        reached[name] = found
    shared: dict[frozenset[str], frozenset[str]] = {}
    found_in: dict[str, frozenset[str]] = {}
    for name, found in reached.items():
        if name in found:
            members = frozenset(o for o in found if name in reached[o])
            found_in[name] = shared.setdefault(members, members)
    return found_in
