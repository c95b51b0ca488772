"""Removes each rule from the household's domain file, and tells which nobody misses.

    PYTHONPATH=tests/worlds/kitchen python tests/worlds/kitchen/mutate_domain.py

Every need, every part of a need, every choice, effect, fact and condition, every process, every
part of a definition, and every tag, attribute, default, number and static fact of a category is
left out, one at a time. A mutant is killed where a recorded step (`covering_corpus.json`) leads
elsewhere than in the kitchen, or where the catalogue of the kitchen says otherwise. Those that
stay alive are printed: equivalent ones with the reason why nothing can tell them, and the others,
for which the exit code is 1: the corpus lacks an episode (`covering_search.py` finds it), or the
rule does nothing. Takes some minutes.

What it does not remove, because the kitchen has no opinion on it: sentences and facts that would
help, what a plan prefers, safety rules, words and phrases.
"""

from __future__ import annotations

import sys
from collections.abc import Iterable, Sequence

from catalogue import differences, lacking
from covering import play
from covering_play import Step, load_corpus
from equivalent import why_equivalent
from mutants import Mutant, kills, mutants

from forestall.domain.load import shipped
from forestall.domain.model import Domain
from forestall.worlds.kitchen.catalogue import shipped_catalogue


def played(domain: Domain) -> list[list[Step]]:
    """Every step of every recorded episode."""
    return [list(play(episode, domain)) for episode in load_corpus()]


def survivors(several: Iterable[Mutant], episodes: Sequence[Sequence[Step]]) -> list[str]:
    """Names of the mutants that no episode kills."""
    return [str(m) for m in several if not any(kills(m, steps) for steps in episodes)]


def main() -> int:
    """Print the survivors."""
    domain, catalogue = shipped("household"), shipped_catalogue()
    rules, facts = list(mutants(domain)), list(lacking(domain))
    alive = survivors(rules, played(domain))
    alive += [str(m) for m in facts if not any(True for _ in differences(m.domain, catalogue))]
    total = len(rules) + len(facts)
    lines = [f"{total} mutants, {total - len(alive)} killed, {len(alive)} alive"]
    lines += [f"{name}: {why_equivalent(name) or 'ALIVE'}" for name in sorted(alive)]
    sys.stdout.write("\n".join(lines) + "\n")
    return int(any(why_equivalent(name) is None for name in alive))


if __name__ == "__main__":
    sys.exit(main())
