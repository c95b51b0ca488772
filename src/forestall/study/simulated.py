"""Raters that a program plays, for tests and for trying a study out. Never reported as people.

Calls `answers.py`. Their true preference is known, so that intervals can be checked against it.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from forestall.study.answers import Answer, AnswerFile, Choice, Rater, Start, file_of
from forestall.study.model import Study, Trial


@dataclass(frozen=True, slots=True)
class Taste:
    """How simulated raters answer.

    Args:
        odds: rival → log-odds that ours is chosen over it, for the middle rater and item.
        rater_sd: of raters around it, in log-odds. `item_sd`: of items, for each rival anew.
        both: probability of "both".
        careless: probability that a rater answers by a coin, checks included.
    """

    odds: Mapping[str, float] = field(hash=False)
    rater_sd: float = 0.4
    item_sd: float = 0.8
    both: float = 0.2
    careless: float = 0.0

    def preference(self, rival: str) -> float:
        """The true share of wins plus half that of both, over all raters and items."""
        sd = float(np.hypot(self.rater_sd, self.item_sd))
        nodes, weights = np.polynomial.hermite_e.hermegauss(60)
        wins = float((_logistic(self.odds[rival] + sd * nodes) * weights).sum() / weights.sum())
        return (1 - self.both) * wins + self.both / 2


def simulate(study: Study, taste: Taste, seed: int) -> list[Rater]:
    """The answers of all raters of a study, drawn; every one is marked as simulated."""
    random = np.random.default_rng(seed)
    easy = {
        (i.name, rival): random.normal(0, taste.item_sd)
        for i in study.items
        for rival in study.against
    }
    raters = []
    for number, trials in enumerate(study.raters, 1):
        leans = {rival: random.normal(0, taste.rater_sd) for rival in study.against}
        careless = random.random() < taste.careless
        answers = {}
        for position, trial in enumerate(trials):
            if careless:
                choice: Choice = "a" if random.random() < 0.5 else "b"
            elif trial.check:
                choice = trial.ours
            else:
                odds = taste.odds[trial.against] + leans[trial.against]
                choice = _choice(trial, odds + easy[trial.item, trial.against], taste, random)
            answers[position] = Answer(position, choice, round(float(random.gamma(4, 5)), 1))
        raters.append(Rater(Start(study.digest, number, simulated=True), answers))
    return raters


def write_simulated(folder: Path, raters: list[Rater]) -> None:
    """Write simulated raters as answer files, as people's are.

    Raises:
        InputError: somebody has answered in a place of theirs.
    """
    for rater in raters:
        file = AnswerFile(file_of(folder, rater.start.rater), rater.start)
        for answer in rater.answers.values():
            file.add(answer)


def _choice(trial: Trial, odds: float, taste: Taste, random: np.random.Generator) -> Choice:
    if random.random() < taste.both:
        return "both"
    wins = random.random() < float(_logistic(np.array(odds)))
    return trial.ours if wins else ("b" if trial.ours == "a" else "a")


def _logistic(x: NDArray[np.float64]) -> NDArray[np.float64]:
    return 1 / (1 + np.exp(-x))
