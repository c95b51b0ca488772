"""What the page of an experiment shows, as plain values for the template.

Called by `experiment_page.py`; calls `figure_views.py`. Numbers are the summary's,
only written out here; what is not there is said to be missing.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from forestall.report import figure_data as data
from forestall.report.figure_views import FigureView, figures_of, household_figures_of

if TYPE_CHECKING:
    from forestall.statistics.rows import EpisodeRow

LOOKS: Mapping[str, tuple[str, str]] = {
    "holds": ("go", "✓"),
    "does not hold": ("refused", "✕"),
    "not decided": ("replanned", "?"),
    "not measured": ("unjudged", "–"),
}
"""Verdict on an ordering → its class in the style sheet and its sign."""

TOPICS: Mapping[str, str] = {
    "strategies": "Acting before the failure beats acting after it",
    "detectors": "The scene graph sees more than objects, captions and images",
    "reasoning": "Without reasoning, replanning does far less",
    "ablations": "Every part of the score is needed",
}
"""Topic of an ordering → what the paper says."""

RESERVED = ("title", "findings", "names")
"""Keys of `meta` that have a place of their own; the others are listed as facts."""

MISSING = "not measured"


@dataclass(frozen=True, slots=True)
class OrderingView:
    """One ordering of the paper with the verdict on it."""

    look: str
    sign: str
    verdict: str
    sentence: str


@dataclass(frozen=True, slots=True)
class TopicView:
    """Orderings that belong together."""

    title: str
    counts: tuple[tuple[str, str, str, int], ...]  # look, sign, verdict, how many
    lines: tuple[OrderingView, ...]


@dataclass(frozen=True, slots=True)
class ComparedView:
    """A number of the paper with ours."""

    what: str
    source: str
    paper: str
    ours: str
    interval: str
    n: str
    undisturbed: str
    harmless: str


@dataclass(frozen=True, slots=True)
class EpisodeView:
    """One line of the list of episodes."""

    set: str
    task: str
    scenario: str
    kind: str
    seed: int
    strategy: str
    how: str
    profile: str
    result: str  # "reached", "not reached" or "broke off"
    alarm: str
    cause: str
    end: str
    href: str


@dataclass(frozen=True, slots=True)
class View:
    """The whole page."""

    title: str
    keys: tuple[tuple[str, str], ...]
    facts: tuple[tuple[str, str], ...]
    names: tuple[tuple[str, str], ...]
    notes: tuple[str, ...]
    findings: tuple[str, ...]
    topics: tuple[TopicView, ...]
    verdicts: tuple[tuple[str, str, str, int], ...]
    compared: tuple[ComparedView, ...]
    figures: tuple[FigureView, ...]
    profile: str
    episodes: tuple[EpisodeView, ...]
    filters: tuple[tuple[str, tuple[str, ...]], ...]


def experiment_view(
    rows: Sequence[EpisodeRow],
    summary: Mapping[str, Any],
    meta: Mapping[str, Any],
    links: Mapping[str, str],
) -> View:
    """Everything that the template needs."""
    ordered = sorted(rows, key=_order)
    names = dict(meta.get("names") or summary.get("names") or {})
    profile = summary["shown"]
    content = summary["profiles"][profile]
    topics = _topics(content)
    lines = [line for topic in topics for line in topic.lines]
    episodes = tuple(_episode(r, links) for r in ordered)
    of_profile = Counter(r.profile for r in ordered)
    counts = Counter(r.set for r in ordered if r.profile == profile)
    facts = [(k, _words(v)) for k, v in meta.items() if k not in RESERVED]
    return View(
        title=str(meta.get("title", "The experiments")),
        keys=(
            ("episodes", f"{len(ordered):,}"),
            *((p, f"{n:,}") for p, n in of_profile.items() if len(of_profile) > 1),
            *((s, f"{counts[s]:,}") for s in sorted(counts, key=_set_order)),
        ),
        facts=tuple(facts),
        names=tuple((str(k), str(v)) for k, v in sorted(names.items()) if k != v),
        notes=tuple(summary.get("episodes", {}).get("notes", ())),
        findings=tuple(str(x) for x in meta.get("findings", ())),
        topics=topics,
        verdicts=_counted(lines),
        compared=tuple(_compared(p) for p in content["paper"]),
        figures=(
            *household_figures_of(summary, names),
            *figures_of([r for r in ordered if r.profile == profile], content, names),
        ),
        profile=profile if len(of_profile) > 1 else "",
        episodes=episodes,
        filters=tuple(
            (name, values)
            for name in ("set", "task", "kind", "strategy", "result", "profile")
            if len(values := tuple(dict.fromkeys(getattr(e, name) for e in episodes))) > 1
        ),
    )


def _topics(summary: Mapping[str, Any]) -> tuple[TopicView, ...]:
    found: dict[str, list[OrderingView]] = {}
    for o in summary.get("orderings", ()):
        look, sign = LOOKS.get(o["verdict"], LOOKS["not measured"])
        line = OrderingView(look, sign, o["verdict"], o["sentence"])
        found.setdefault(o["topic"], []).append(line)
    order = [*(t for t in TOPICS if t in found), *(t for t in found if t not in TOPICS)]
    return tuple(TopicView(TOPICS.get(t, t), _counted(found[t]), tuple(found[t])) for t in order)


def _counted(lines: Sequence[OrderingView]) -> tuple[tuple[str, str, str, int], ...]:
    counts = Counter(line.verdict for line in lines)
    return tuple((*look, verdict, counts[verdict]) for verdict, look in LOOKS.items())


def _compared(line: Mapping[str, Any]) -> ComparedView:
    unit = line["unit"]
    false = line["false_alarms"]
    ours = line["ours"]
    return ComparedView(
        what=line["what"],
        source=f"{line['source']}, {line['set']}",
        paper=f"{line['paper']:g} {unit}",
        ours=_number(ours["value"], unit, 100.0 if unit == "%" else 1.0),
        interval=_interval(ours, unit),
        n=f"{ours['n']:,}",
        undisturbed=_rate(false.get("undisturbed")),
        harmless=_rate(false.get("harmless")),
    )


def _number(value: float | None, unit: str, factor: float) -> str:
    return MISSING if value is None else f"{factor * value:.1f} {unit}"


def _interval(metric: Mapping[str, Any], unit: str) -> str:
    low, high = metric.get("low"), metric.get("high")
    if low is None or high is None:
        return ""
    factor = 100.0 if unit == "%" else 1.0
    return f"{factor * low:.1f} to {factor * high:.1f}"


def _rate(metric: Mapping[str, Any] | None) -> str:
    if metric is None or metric["value"] is None:
        return MISSING
    interval = _interval(metric, "%")
    return f"{100 * metric['value']:.1f} %" + (f" ({interval})" if interval else "")


def _episode(row: EpisodeRow, links: Mapping[str, str]) -> EpisodeView:
    alarm = next((j for j in row.judged if j.decision == "replan"), None)
    how = [] if row.strategy in ("none", data.WATCH) else [f"{row.detector} {row.threshold:.2f}"]
    if row.without is not None:
        how.append(f"without {row.without}")
    how += [f"reasoning by {row.reasoning}"] if row.reasoning != "templates" else []
    how += [f"{row.model} model"] if row.model != "exact" else []
    how += [f"{row.demonstrations} demonstrations"] if row.demonstrations != "4" else []
    if row.implied:
        how.append("no alarm, hence as unmonitored")
    broke = row.end == "error"
    return EpisodeView(
        set=row.set,
        task=row.task,
        scenario=row.scenario or "undisturbed",
        kind=(row.kind or "none").replace("_", " "),
        seed=row.seed,
        strategy=row.strategy,
        how=", ".join(how),
        profile=row.profile,
        result="broke off" if broke else "reached" if row.success else "not reached",
        alarm="" if alarm is None else f"{alarm.when} {alarm.subtask}".strip(),
        cause="" if alarm is None else alarm.cause,
        end=row.error if broke and row.error else row.end,
        href=links.get(row.key, ""),
    )


def _order(row: EpisodeRow) -> tuple[Any, ...]:
    known = data.STRATEGIES
    place = known.index(row.strategy) if row.strategy in known else -1
    return (
        *(
            row.profile,
            _set_order(row.set),
            row.task,
            row.scenario or "",
            row.seed,
            place,
            row.strategy,
        ),
        *(row.detector, row.threshold, row.without or "", row.model, row.demonstrations),
        row.reasoning,
    )


def _set_order(name: str) -> tuple[int, str]:
    return (data.SETS.index(name) if name in data.SETS else len(data.SETS)), name


def _words(value: Any) -> str:
    if isinstance(value, bool) or value is None:
        return {True: "yes", False: "no", None: "none"}[value]
    if isinstance(value, float):
        return f"{value:.4g}"
    if isinstance(value, Mapping):
        return ", ".join(f"{k} {_words(v)}" for k, v in value.items()) or "none"
    if isinstance(value, list | tuple):
        return ", ".join(_words(v) for v in value) or "none"
    return str(value)
