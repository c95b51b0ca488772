"""The household's domain file against the kitchen's own truth, in every case that the file makes.

The cases are read off the domain, the situations are recorded episodes (`covering_search`). Each is
played in the kitchen and in the domain at once, and both must say the same after every step.
"""

import re
from functools import cache

import numpy as np
import pytest
from catalogue import TAGS, differences, lacking
from covering import Coverage, cases, play
from covering_play import Run, Step, load_corpus
from covering_search import geometric, intended, start
from equivalent import EQUIVALENT, UNREACHABLE, why_equivalent
from mutants import mutants
from mutate_domain import survivors

from forestall.domain.load import shipped
from forestall.types.plan import Subtask
from forestall.worlds.kitchen.catalogue import shipped_catalogue

DOMAIN = shipped("household")


@cache
def _replayed() -> tuple[Coverage, tuple[tuple[Step, ...], ...]]:
    coverage = Coverage(DOMAIN)
    return coverage, tuple(tuple(play(e, DOMAIN, coverage)) for e in load_corpus())


def _excluded(case: str) -> str | None:
    return next((why for pattern, why in UNREACHABLE.items() if re.fullmatch(pattern, case)), None)


def test_kitchen_and_domain_agree_on_every_recorded_step() -> None:
    found = [d for steps in _replayed()[1] for s in steps for d in s.differences]
    assert not found, "\n".join(found)


def test_every_need_choice_effect_and_process_is_exercised() -> None:
    coverage, _ = _replayed()
    missing = sorted(c for c in coverage.open if _excluded(c) is None)
    assert not missing, "not covered:\n" + "\n".join(missing)


def test_what_is_called_unreachable_is_still_a_case_and_still_not_reached() -> None:
    coverage, _ = _replayed()
    reached = sorted(c for c in coverage.seen if _excluded(c) is not None)
    assert not reached, "reached, though called unreachable:\n" + "\n".join(reached)
    every = cases(DOMAIN)
    stale = [p for p in UNREACHABLE if not any(re.fullmatch(p, c) for c in every)]
    assert not stale, f"no case of the domain is meant by {stale}"


@pytest.mark.parametrize("seed", range(12))
def test_fresh_walks_agree_and_reach_nothing_that_is_called_unreachable(seed: int) -> None:
    rng, coverage = np.random.default_rng((7, seed)), Coverage(DOMAIN)
    run = Run(start(rng, shipped_catalogue()), DOMAIN)
    agenda: list[Subtask] = []
    for _ in range(30):
        agenda = agenda or intended(rng, run.state)
        chosen = agenda.pop(0)
        if not geometric(run.episode, run.state, chosen):
            with coverage.watching():
                assert run.do(chosen).differences == []
    assert not [c for c in coverage.seen if _excluded(c) is not None]


@pytest.mark.slow
def test_no_need_effect_or_process_can_be_left_out() -> None:
    whole = [m for m in mutants(DOMAIN) if m.kind != "part"]
    alive = [n for n in survivors(whole, _replayed()[1]) if why_equivalent(n) is None]
    assert not alive, "nobody misses:\n" + "\n".join(alive)


def test_equivalent_mutants_are_mutants() -> None:
    names = [str(m) for m in mutants(DOMAIN)]
    stale = [p for p in EQUIVALENT if not any(re.fullmatch(p, n) for n in names)]
    assert not stale, f"no mutant is meant by {stale}"


def test_categories_are_those_of_the_kitchen() -> None:
    assert list(differences(DOMAIN, shipped_catalogue())) == []
    assert set(TAGS) == set(DOMAIN.tags)


def test_no_tag_attribute_default_number_or_static_fact_can_be_left_out() -> None:
    told = {
        str(m): any(True for _ in differences(m.domain, shipped_catalogue()))
        for m in lacking(DOMAIN)
    }
    assert len(told) > 400
    assert [name for name, noticed in told.items() if not noticed] == []
