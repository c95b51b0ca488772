"""What the intervals of the whole report hold, in as many studies as CI has time for."""

from __future__ import annotations

from pathlib import Path

import pytest

from forestall.study.assigning import Design

from .coverage import SHARES, coverage, taste_of
from .studies import AGAINST, make

TIMES = 40
RARE = 33
"""A coverage of 95 % holds fewer in 40 studies once in 1400 times (binomial), and there are 27
numbers, most of which hang together."""


@pytest.mark.slow
def test_intervals_of_the_report_hold_the_truth(tmp_path: Path) -> None:
    study = make(tmp_path, 40, Design(15))
    found = {(h.of, h.what): h for h in coverage(study, tmp_path, taste_of(AGAINST), TIMES)}
    assert {what for _, what in found} == {*SHARES, "odds", "strength", "alpha"}
    assert len(found) == 5 * 4 + 2 * 3 + 1
    for name, held in found.items():
        assert held.held >= RARE, (name, held)
    assert sum(h.held for h in found.values()) / (TIMES * len(found)) >= 0.92
    assert all(found[name, "preference"].wide < 0.25 for name in AGAINST)
