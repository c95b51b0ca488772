"""What judges said of somebody else's runs, counted: shares with intervals.

Called by `third_party` and the command line; calls the intervals. A good run counts as a false
alarm where there is an alarm at any boundary; a failing one as detected where there is one at or
before the step that is refused. Beside each judge as it stands: calibrated, so that at most a tenth
of good runs is to alarm, on the good runs of all other programs.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from forestall.calibration.conformal import extreme, threshold
from forestall.statistics.intervals import Metric, proportion

SCORE, NEEDS, PLAN = "score", "preconditions", "plan check"
JUDGES = (SCORE, NEEDS, PLAN)
LEVEL = 0.1
"""Share of good runs in which a calibrated judge may alarm."""

TOGETHER: Mapping[str, tuple[tuple[str, ...], int]] = {
    SCORE: ((SCORE,), 1),
    NEEDS: ((NEEDS,), 1),
    PLAN: ((PLAN,), 1),
    "preconditions or plan check": ((NEEDS, PLAN), 1),
    "preconditions and plan check": ((NEEDS, PLAN), 2),
    "any of three": (JUDGES, 1),
    "two of three": (JUDGES, 2),
    "all three": (JUDGES, 3),
}
"""What is counted → whose alarms, and how many of them at one boundary are one of it."""

CALIBRATED: Mapping[str, str] = {f"{j}, calibrated": j for j in (SCORE, NEEDS)}


@dataclass(frozen=True, slots=True)
class Knowledge:
    """What the judges knew.

    Args:
        domain: which one, "none" for the one that the demonstrations show.
        memory: whose demonstrations.
    """

    domain: str
    memory: str


@dataclass(frozen=True, slots=True)
class Said:
    """What one judge says before one step.

    Args:
        score: how well the scene fits, None where nothing was judged.
        alarm: whether the robot should not go on.
        note: why.
    """

    score: float | None
    alarm: bool
    note: str = ""


@dataclass(frozen=True, slots=True)
class Judged:
    """What the judges said of one run.

    Args:
        run: name of it.
        program: that it was made of.
        change: what makes it fail, "" for a good one.
        knowledge: what was known.
        said: for each boundary that it came to, judge → what it says.
    """

    run: str
    program: str
    change: str
    knowledge: Knowledge
    said: tuple[Mapping[str, Said], ...]

    def alarms(self, which: str) -> list[bool]:
        """At which boundaries there is an alarm."""
        judges, least = TOGETHER[which]
        return [sum(said[j].alarm for j in judges) >= least for said in self.said]

    def below(self, judge: str, line: float | None) -> list[bool]:
        """At which boundaries a judge's score is below a threshold; None: nowhere."""
        scores = [said[judge].score for said in self.said]
        return [line is not None and s is not None and s < line for s in scores]

    def extreme(self, judge: str) -> float:
        """The smallest score of a judge."""
        return extreme(said[judge].score for said in self.said)


@dataclass(frozen=True, slots=True)
class Row:
    """One line of the table.

    Args:
        knowledge: what was known.
        judge: who judges.
        false_alarms: share of good runs with an alarm.
        detected: share of failing runs with an alarm at or before the refused step.
        at: share of failing runs with an alarm at it.
    """

    knowledge: Knowledge
    judge: str
    false_alarms: Metric
    detected: Metric
    at: Metric

    def to_json(self) -> dict[str, Any]:
        """Plain data."""
        return {
            "domain": self.knowledge.domain,
            "memory": self.knowledge.memory,
            "judge": self.judge,
            "false_alarms": self.false_alarms.to_json(),
            "detected": self.detected.to_json(),
            "at": self.at.to_json(),
        }


def rows(judged: Sequence[Judged]) -> list[Row]:
    """The table: shares with 95 % intervals, drawn by program."""
    found = []
    for knowledge in dict.fromkeys(j.knowledge for j in judged):
        own = [j for j in judged if j.knowledge == knowledge]
        for which in TOGETHER:
            found.append(_row(knowledge, which, own, [j.alarms(which) for j in own]))
        for which, judge in CALIBRATED.items():
            lines = _lines(own, judge)
            alarms = [j.below(judge, lines.get(j.program, lines[""])) for j in own]
            found.append(_row(knowledge, which, own, alarms))
    return found


def changes(judged: Sequence[Judged], knowledge: Knowledge) -> list[tuple[str, int, list[int]]]:
    """Change → failing runs, and how many each judge alone detected."""
    own = [j for j in judged if j.change and j.knowledge == knowledge]
    return [
        (change, len(some), [sum(any(j.alarms(which)) for j in some) for which in JUDGES])
        for change in dict.fromkeys(j.change for j in own)
        if (some := [j for j in own if j.change == change])
    ]


def _lines(judged: Sequence[Judged], judge: str) -> dict[str, float | None]:
    """Program → threshold, from the good runs of all others; "": from those of all."""
    worst = {j.program: j.extreme(judge) for j in judged if not j.change}
    return {p: threshold([e for q, e in worst.items() if q != p], LEVEL) for p in (*worst, "")}


def _row(
    knowledge: Knowledge, which: str, runs: Sequence[Judged], alarms: Sequence[Sequence[bool]]
) -> Row:
    pairs = list(zip(runs, alarms, strict=True))
    good = [any(a) for r, a in pairs if not r.change]
    failing = [(r.program, a) for r, a in pairs if r.change]
    units = [program for program, _ in failing]
    return Row(
        knowledge,
        which,
        proportion(good),
        proportion([any(a) for _, a in failing], units),
        proportion([a[-1] for _, a in failing], units),
    )
