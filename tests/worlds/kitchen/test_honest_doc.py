"""The page about the honest household says what the code draws."""

import re
from pathlib import Path

import pytest

from forestall.worlds.kitchen.imperfection import WAYS, Rates
from forestall.worlds.kitchen.law import WAYS as WAYS_OF_LAW

PAGE = (Path(__file__).parents[3] / "docs" / "honest.md").read_text(encoding="utf-8")
ROWS = [
    [c.strip() for c in line.strip("|").split("|")]
    for line in PAGE.splitlines()
    if line.startswith("| ")
]


def _percents(text: str) -> list[float]:
    return [float(x) / 100 for x in re.findall(r"([\d.]+) %", text)]


def test_the_rates_are_those_of_the_code() -> None:
    said: dict[str, float] = {}
    for row in ROWS:
        if len(row) == 5 and "%" in row[2]:
            said |= dict(zip(re.findall(r"`(\w+)`", row[1]), _percents(row[2]), strict=True))
    rates = Rates()
    assert said == pytest.approx(
        {w: getattr(rates, w) for several in WAYS.values() for w in several}
    )


def test_the_probabilities_are_those_of_the_code() -> None:
    said = {row[0]: _percents(row[1])[0] for row in ROWS if len(row) == 3 and "%" in row[1]}
    assert said == pytest.approx({w.name: w.probability for w in WAYS_OF_LAW})
