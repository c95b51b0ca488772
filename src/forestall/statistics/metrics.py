"""How well alarms tell failing runs from others: detection, false alarms, lead, named cause.

Calls: `judgements`, `orderings` → here → `watches`, `intervals`. A boundary raises an alarm when
its score lies below the threshold (paper, Sec. 3.3). A boundary without a score raises none, and a
run that broke off raises none from there on.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Protocol

import numpy as np

from forestall.statistics.causes import Agreement, cause_named
from forestall.statistics.intervals import (
    NOTHING,
    SEED,
    Bools,
    Floats,
    Metric,
    Ratio,
    bootstrap,
    divided,
    measured,
)
from forestall.statistics.judges import Together, thresholds_of
from forestall.statistics.rows import Judged
from forestall.statistics.watches import ALL, PAPER_SET, Watches

RANDOM_DRAWS = 200

ALWAYS, NEVER, RANDOM, TRUTH = "always", "never", "random", "true plan check"
TRIVIAL = (ALWAYS, NEVER, RANDOM, TRUTH)
"""Judges that cost nothing, and the simulator's truth as the upper bound."""


@dataclass(frozen=True, eq=False)
class Alarms:
    """Where a judge raised alarms in watched runs.

    Args:
        of: the runs.
        raised: (draws, boundaries); several draws for chance, and for a mean over thresholds.
        seen_by: (runs,) which of them it watched.
        names: of the judges whose word counts for what they name.
    """

    of: Watches
    raised: Bools
    seen_by: Bools
    names: tuple[str, ...] = ()

    @property
    def single(self) -> bool:
        """Whether there is one draw, so that what is counted are things."""
        return len(self.raised) == 1

    def counts(self, where: Bools | None = None) -> Floats:
        """Alarms of each run at some boundaries, (draws, runs)."""
        raised = self.raised if where is None else self.raised & where
        return np.stack([self.of.per_run(line) for line in raised])

    def share(self, where: Bools | None = None) -> Floats:
        """Share of draws with an alarm at some boundaries, (runs,)."""
        found: Floats = (self.counts(where) > 0).mean(axis=0)
        return found

    def first_timely(self) -> list[tuple[np.int64, np.int64]]:
        """(run, boundary) of the first alarm in time, of every draw one after the other."""
        found = []
        for line in self.raised & self.of.timely:
            places = np.flatnonzero(line)
            runs, first = np.unique(self.of.run[places], return_index=True)
            found += list(zip(runs, places[first], strict=True))
        return [(r, b) for r, b in found if self.seen_by[r]]

    def of_runs(self, where: Bools) -> Alarms:
        """The same, counted on some runs only."""
        return Alarms(self.of, self.raised, self.seen_by & where, self.names)


def at_thresholds(of: Watches, judge: str, thresholds: Sequence[float] | None = None) -> Alarms:
    """A judge's alarms, one draw for each threshold; its own one by default."""
    line = np.nan_to_num(of.scores[judge], nan=np.inf)
    found = thresholds_of(judge)[:1] if thresholds is None else thresholds
    raised = line[None, :] < np.array(found, float)[:, None]
    return Alarms(of, raised, of.seen_by[judge], (judge,))


def asked_together(of: Watches, pair: Together) -> Alarms:
    """Alarms of two judges that are asked together, each at its own threshold."""
    one, other = (at_thresholds(of, name) for name in (pair.first, pair.second))
    raised = one.raised & other.raised if pair.both else one.raised | other.raised
    return Alarms(of, raised, one.seen_by & other.seen_by, (pair.first, pair.second))


class _Rule(Protocol):
    def __call__(self, judged: Judged, /) -> bool: ...


def by_rule(of: Watches, rule: _Rule, names: tuple[str, ...] = ()) -> Alarms:
    """Alarms wherever a rule says so."""
    raised = np.array([[rule(j) for j in of.judged]], bool)
    return Alarms(of, raised, np.ones(len(of), bool), names)


def confirmed(judged: Judged) -> bool:
    """An alarm of the deciding detector in which the reasoner found something to change."""
    return judged.confirmed and judged.decision == "replan"


def impossible(judged: Judged) -> bool:
    """The simulator's truth: the next subtask, or the goal by this plan, is out of reach."""
    return judged.reachable is False or judged.possible is False


def false_rate(like: Alarms) -> float:
    """How many of the faultless boundaries that it watched a judge raises an alarm at."""
    there = like.of.faultless & like.seen_by[like.of.run]
    return float(like.raised[:, there].mean()) if there.any() else 0.0


def at_random(of: Watches, like: Alarms) -> Alarms:
    """Alarms at random boundaries, at another judge's rate of false alarms per boundary."""
    random = np.random.default_rng(SEED)
    drawn = random.random((RANDOM_DRAWS, len(of.judged)))
    return Alarms(of, drawn < false_rate(like), np.ones(len(of), bool))


def trivial(of: Watches, like: Alarms) -> dict[str, Alarms]:
    """The trivial judges on the same runs; chance has as many false alarms as `like`."""
    return {
        ALWAYS: by_rule(of, lambda _: True),
        NEVER: by_rule(of, lambda _: False),
        RANDOM: at_random(of, like),
        TRUTH: by_rule(of, impossible),
    }


def point_metrics(alarms: Alarms, failing: str = PAPER_SET) -> dict[str, Metric]:
    """Everything that can be said of one operating point.

    Args:
        alarms: in failing and other runs.
        failing: the set of the failing ones, or `ALL`.
    """
    bad = alarms.of.of_set(failing) & alarms.seen_by
    ratios = detection_ratios(alarms, bad) | false_alarm_ratios(alarms) | _leads(alarms, bad)
    ratios |= _told_apart(alarms, bad) | _named(alarms, bad)
    mixed = {}
    good = _groups(alarms)
    for of in ("undisturbed", ALL):
        ratios[f"quiet_{of}"] = _runs(alarms, 1 - alarms.share(), good[of])
        mixed[f"balanced_accuracy_{of}"] = {"fdr": 0.5, f"quiet_{of}": 0.5}
    found = measured(ratios, alarms.of.clusters, mixed)
    found |= _chance(alarms, bad)
    return {name: metric for name, metric in found.items() if not name.startswith("quiet")}


def detection_ratios(alarms: Alarms, bad: Bools) -> dict[str, Ratio]:
    """How many failing runs are detected.

    `fdr` counts as the paper does: any alarm anywhere in a failing run. `after_known` only counts
    alarms from when the failure can be known, `in_time` only those up to the harm, of the failures
    that can be known before it.
    """
    of = alarms.of
    known = of.index >= of.known[of.run]
    return {
        "fdr": _runs(alarms, alarms.share(), bad),
        "in_time": _runs(alarms, alarms.share(of.timely), bad & of.foreseeable),
        "after_known": _runs(alarms, alarms.share(known), bad),
    }


def false_alarm_ratios(alarms: Alarms) -> dict[str, Ratio]:
    """False alarms by boundary, run and hour; the runs that they are counted on end the name.

    At a boundary an alarm is false where the truth has nothing against going on; those of failing
    runs count among `ALL`. In a run, and in an hour, it is one in a run that does not fail. It is
    unfounded where both are so: a step that was refused and was not needed is no failure of the
    run, and who foresaw the refusal was right.
    """
    of = alarms.of
    false = alarms.counts(of.faultless).mean(axis=0)
    chances = of.per_run(of.faultless)
    any_alarm, unfounded, found = alarms.share(), alarms.share(of.faultless), {}
    for name, runs in _groups(alarms).items():
        there = alarms.seen_by if name == ALL else runs
        found[f"false_alarms_per_boundary_{name}"] = Ratio(
            false * there, chances * there, whole=alarms.single
        )
        found[f"false_alarms_per_run_{name}"] = _runs(alarms, any_alarm, runs)
        found[f"unfounded_per_run_{name}"] = _runs(alarms, unfounded, runs)
        found[f"false_alarms_per_hour_{name}"] = Ratio(
            alarms.counts().mean(axis=0) * runs, of.hours * runs, int(runs.sum()), False
        )
    return found


def detection_rates(alarms: Alarms, bad: Bools) -> dict[str, Metric]:
    """`detection_ratios`, and alarms in runs that do not fail, with their intervals."""
    ratios = detection_ratios(alarms, bad & alarms.seen_by) | false_alarm_ratios(alarms)
    return measured(ratios, alarms.of.clusters)


def _groups(alarms: Alarms) -> dict[str, Bools]:
    """Runs that do not fail, by what was arranged in them."""
    of = alarms.of
    groups = {"undisturbed": of.undisturbed, "harmless": of.harmless, ALL: ~of.failing}
    return {name: runs & alarms.seen_by for name, runs in groups.items()}


def _runs(alarms: Alarms, values: Floats, where: Bools) -> Ratio:
    return Ratio(np.where(where, values, 0.0), where.astype(float), whole=alarms.single)


def _leads(alarms: Alarms, bad: Bools) -> dict[str, Ratio]:
    """Subtasks and seconds from the first alarm in time to the harm, and alarms before it."""
    of = alarms.of
    steps, seconds, hit = (np.zeros(len(of)) for _ in range(3))
    for run, place in alarms.first_timely():
        steps[run] += of.effect[run] - of.index[place]
        seconds[run] += of.harm_s[run] - of.time_s[place]
        hit[run] += 1
    draws, n = len(alarms.raised), int(((hit > 0) & bad).sum())
    before = of.index < of.known[of.run]
    early = alarms.counts(before).mean(axis=0) * bad
    return {
        "lead_subtasks": Ratio(steps * bad / draws, hit * bad / draws, n, False),
        "lead_s": Ratio(seconds * bad / draws, hit * bad / draws, n, False),
        "early_alarms_per_boundary": Ratio(early, of.per_run(before) * bad, whole=alarms.single),
    }


def _told_apart(alarms: Alarms, bad: Bools) -> dict[str, Ratio]:
    """Failing runs with an alarm whose undisturbed twin in the same room has none.

    Of a failing run and its twin, which differ in the fault alone, so many are told apart.
    """
    twins = alarms.of.twins
    where = bad & (twins >= 0) & alarms.seen_by[twins]
    alarmed = alarms.counts() > 0
    apart = (alarmed & ~alarmed[:, twins]).mean(axis=0)
    return {"pairs_apart": _runs(alarms, apart, where)}


def _named(alarms: Alarms, bad: Bools) -> dict[str, Ratio]:
    """Of the failing runs with an alarm in time whose cause is known: whether it was named then.

    The first alarm in time counts, for it is the one that a robot would act upon.
    """
    of = alarms.of
    if not alarms.names or not alarms.single:
        return {}
    exact, right, named, asked = (np.zeros(len(of)) for _ in range(4))
    for run, place in alarms.first_timely():
        causes = of.rows[run].causes
        if not causes or not bad[run]:
            continue
        facts = [f for n in alarms.names for f in of.judged[place].named.get(n, ())]
        agreement = cause_named(facts, causes)
        asked[run] = 1
        named[run] = agreement is not Agreement.NOTHING
        exact[run] = agreement is Agreement.EXACT
        right[run] = agreement.right
    parts: Mapping[str, Floats] = {"exact": exact, "right": right, "named": named}
    return {f"cause_{name}": Ratio(values, asked) for name, values in parts.items()}


def _chance(alarms: Alarms, bad: Bools) -> dict[str, Metric]:
    """What chance detects in time with as many false alarms per boundary, and how much more this.

    Chance raises an alarm at each boundary with the judge's rate, whatever happens there.
    """
    of = alarms.of
    seen = bad & of.foreseeable
    if not seen.any() or not alarms.names:
        return {"chance_in_time": NOTHING, "over_chance": NOTHING} if alarms.names else {}
    false = alarms.counts(of.faultless).mean(axis=0) * alarms.seen_by
    chances = of.per_run(of.faultless) * alarms.seen_by
    length = of.per_run(of.timely)
    lengths = np.unique(length[seen])
    groups = np.stack([seen & (length == k) for k in lengths], axis=1).astype(float)
    hit = alarms.share(of.timely) * seen
    columns = np.column_stack([false, chances, hit, seen.astype(float), groups])

    def both(w: Floats) -> tuple[Floats, Floats]:
        sums = w @ columns
        rate = np.nan_to_num(divided(sums[:, 0], sums[:, 1]))
        caught = (sums[:, 4:] * (1 - (1 - rate[:, None]) ** lengths)).sum(axis=1)
        return divided(caught, sums[:, 3]), divided(sums[:, 2], sums[:, 3])

    n = int(seen.sum())
    return {
        "chance_in_time": bootstrap(lambda w: both(w)[0], of.clusters, n),
        "over_chance": bootstrap(
            lambda w: np.subtract(*both(w)[::-1]), of.clusters, n, differ=True
        ),
    }
