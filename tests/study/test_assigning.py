"""Who is shown what: every rater, item, rival and side as often as every other."""

from collections import Counter

import pytest

from forestall.errors import InputError
from forestall.study.assigning import Design
from forestall.study.model import Trial

from .studies import AGAINST, study_of


def real(trials: tuple[Trial, ...]) -> list[Trial]:
    return [t for t in trials if not t.check]


def spread(counts: Counter[object]) -> int:
    return max(counts.values()) - min(counts.values())


@pytest.mark.parametrize(
    ("count", "raters", "each"), [(40, 15, None), (40, 15, 12), (7, 5, 40), (60, 9, 20)]
)
def test_items_rivals_and_sides_are_balanced(count: int, raters: int, each: int | None) -> None:
    study = study_of(count, Design(raters, each, seed=3))
    shown = [t for trials in study.raters for t in real(trials)]
    assert spread(Counter(t.item for t in shown)) <= 1
    sides: Counter[object] = Counter((t.item, t.against, t.ours) for t in shown)
    for item, rival in {(t.item, t.against) for t in shown}:
        assert abs(sides[item, rival, "a"] - sides[item, rival, "b"]) <= 1
    for trials in study.raters:
        mine = real(trials)
        assert len({t.item for t in mine}) == len(mine) == min(count, each or 40)
        assert spread(Counter(t.against for t in mine)) <= 1 + (count <= 7)
        assert {t.against for t in mine} == set(AGAINST)


def test_the_seed_alone_decides() -> None:
    again = [study_of(12, Design(4, seed=s)).raters for s in (1, 1, 2)]
    assert again[0] == again[1] != again[2]


def test_attention_checks_stand_between_and_are_never_of_one_task() -> None:
    study = study_of(40, Design(15))
    for trials in study.raters:
        checks = [k for k, t in enumerate(trials) if t.check]
        assert len(checks) == 4 and min(b - a for a, b in zip(checks, checks[1:])) > 5  # noqa: B905, RUF007
        for k in checks:
            right, wrong = study.item(trials[k].item), study.item(trials[k].against)
            assert right.task != wrong.task and right.cause != wrong.cause
            shown = study.texts(trials[k])
            assert shown[trials[k].ours == "b"] == right.cause and wrong.cause in shown
    assert not any(t.check for trials in study_of(1, Design(2)).raters for t in trials)


@pytest.mark.parametrize(("raters", "each"), [(0, None), (1000, None), (3, 0)])
def test_a_study_of_nobody_is_refused(raters: int, each: int | None) -> None:
    with pytest.raises(InputError, match=r"is 0|is 1000"):
        Design(raters, each)
