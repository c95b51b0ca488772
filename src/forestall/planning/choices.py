"""Things that a skill deals with and does not name: what may be chosen, and on what condition.

Called by `ground`; calls `grounder` and `schemas`.
"""

from __future__ import annotations

from forestall.domain.formula import Formula, asks
from forestall.domain.model import FACING
from forestall.domain.schema import Choice, Skill
from forestall.planning.grounder import Grounder
from forestall.planning.nodes import Node, all_of, any_of, negate
from forestall.types.facts import by_number

Names = dict[str, str]


class Choices:
    """The choices of skills among the things of one grounder."""

    def __init__(self, grounder: Grounder) -> None:
        self.grounder, self.schemas = grounder, grounder.schemas
        self.universe, self.domain = grounder.universe, grounder.domain

    def bindings(self, skill: Skill, names: Names, first: Names) -> list[Names]:
        """Bindings with every thing that may be chosen."""
        several = [names]
        for choice in skill.deciding:
            several = [
                {**b, **chosen}
                for b in several
                for chosen, _, _ in self.chosen(choice, {**b, **first})
            ]
        return several

    def chosen(self, choice: Choice, known: Names) -> list[tuple[Names, Node, str | None]]:
        """What may be chosen, with the condition, and what must be faced for it."""
        g, variable = self.grounder, choice.variable.name
        only = self.schemas.formula(choice.only_if)(g, known)
        found: list[tuple[Names, Node, str | None]] = []
        if only is not False and asks(choice.among, FACING):
            found = self._faced(choice, known, only)
        elif only is not False:
            before: list[Node] = []
            for formula in choice.among:
                fitting = self._fitting(choice, formula, known)
                for i, (name, node) in enumerate(fitting):
                    lower = [negate(n) for _, n in fitting[:i]]
                    needed = all_of((only, node, *before, *lower))
                    if needed is not False:
                        found.append(({variable: name}, needed, None))
                before += [negate(n) for _, n in fitting]
                if any(n is True for _, n in fitting):
                    break
        none = negate(only)
        if not choice.sentence and not found:
            none = True
        if none is not False:
            found.append(({}, none, None))
        return found

    def _faced(
        self, choice: Choice, known: Names, only: Node
    ) -> list[tuple[Names, Node, str | None]]:
        """Things that are chosen once the robot faces them."""
        g, variable = self.grounder, choice.variable.name
        such = self.schemas.join(
            (choice.variable,), choice.such_that, self.schemas.free(choice.such_that)
        )
        found: list[tuple[Names, Node, str | None]] = []
        for bound, node in such(g, known):
            name = bound[variable]
            if not self._may_receive(known, name):
                continue

            def ask(bound: Names = bound, name: str = name) -> Node:
                earlier: list[Node] = []
                ways: list[Node] = []
                for formula in choice.among:
                    here = self.schemas.formula(formula)(g, bound)
                    ways.append(all_of((here, *earlier)))
                    if here is True:
                        break
                    fitting = self._fitting(choice, formula, known)
                    earlier += [negate(n) for x, n in fitting if x != name]
                return any_of(ways)

            needed = all_of((only, node, g.chosen(name, ask)))
            if needed is not False:
                found.append(({variable: name}, needed, name))
        return found

    def _may_receive(self, known: Names, place: str) -> bool:
        made = {n for names in self.universe.made.values() for n in names}
        things = [n for n in known.values() if n in made] or list(known.values())
        return all(self.universe.allows(self.domain, x, place) for x in things)

    def _fitting(self, choice: Choice, formula: Formula, known: Names) -> list[tuple[str, Node]]:
        """Things that a formula and `such_that` are true of, lowest number first."""
        g, variable = self.grounder, choice.variable.name
        join = self.schemas.join((choice.variable,), formula, self.schemas.free(formula))
        such = self.schemas.formula(choice.such_that)
        nodes: dict[str, Node] = {}
        for bound, node in join(g, known):
            both = all_of((node, such(g, bound)))
            if both is not False:
                nodes[bound[variable]] = any_of((nodes.get(bound[variable], False), both))
        return sorted(nodes.items(), key=lambda pair: by_number(pair[0]))
