"""What the page shows, as plain values for the template; called by `page.py` only."""

from __future__ import annotations

import json
from collections.abc import Collection, Iterable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from forestall.records.derived import (
    SIMULATOR_PHASES,
    Alarm,
    Mark,
    Moment,
    PlanRow,
    alarms,
    cause_of,
    done_before,
    in_words,
    moments,
    outcome_of,
    plan_rows,
    provenance_of,
    reasoning_s,
)
from forestall.records.exchanges import Taken, exchanges_of, taken
from forestall.records.pictures import Picture, page_picture, rgb_of
from forestall.records.plain import plain
from forestall.report.beside_view import BesideView, beside_view
from forestall.report.drawn import Drawn, drawn
from forestall.report.exchange_view import ExchangeView, exchange_views
from forestall.report.graph_svg import graph_svg
from forestall.report.in_picture import Framed, framed
from forestall.report.space import space_of
from forestall.report.story import story
from forestall.types.episode import (
    BoundaryRecord,
    EpisodeRecord,
    SkillStatus,
    StoredObservation,
)
from forestall.types.observation import Observation
from forestall.types.runtime import When
from forestall.types.verdict import Verdict

PICTURE_WIDTH, VIEW_WIDTH, THUMB_WIDTH = 480, 232, 132
_MAX_VIEWS = 3

LOOKS: Mapping[Mark, tuple[str, str]] = {
    Mark.PROCEEDED: ("go", "✓"),
    Mark.REPLANNED: ("replanned", "↻"),
    Mark.DISMISSED: ("dismissed", "◌"),
    Mark.UNSOLVED: ("unsolved", "!"),
    Mark.REFUSED: ("refused", "✕"),
    Mark.FAILED: ("refused", "✕"),
    Mark.LOOKED: ("looked", "◎"),
    Mark.STOPPED: ("unsolved", "■"),
    Mark.UNJUDGED: ("unjudged", "–"),
}
"""Mark → its class in the style sheet and its sign (colour alone never tells)."""


@dataclass(frozen=True, slots=True)
class Bar:
    """One number as a bar of `percent` of the full length."""

    label: str
    value: float | None
    percent: float
    strong: bool = False
    aside: bool = False  # a phase of the simulator


@dataclass(frozen=True, slots=True)
class Card:
    """One moment of the run."""

    number: int
    moment: Moment
    about: str  # what tells it from all others
    look: str
    sign: str
    verb: str
    args: str
    picture: Picture | None
    views: tuple[Picture, ...]
    thumb: Picture | None
    boxes: tuple[Framed, ...]
    space: Mapping[str, Any] | None
    bars: tuple[Bar, ...]
    threshold_percent: float
    observed_svg: str
    expected_svg: str
    cause: str
    outcome: str
    rows: tuple[PlanRow, ...]
    exchanges: tuple[ExchangeView, ...]
    open: bool


@dataclass(frozen=True, slots=True)
class Page:
    """The whole page."""

    record: EpisodeRecord
    cards: tuple[Card, ...]
    heading: str
    story: str
    alarms: tuple[Alarm, ...]
    places: Mapping[int, int]  # position of a boundary → number of its card
    legend: tuple[tuple[str, str, str, int], ...]  # class, sign, words, how many
    segmenter: str
    states: str
    oracle: bool
    memory: str
    reasoning_s: float
    simulator_s: float
    model: Taken
    phases: tuple[Bar, ...]
    provenance: tuple[tuple[str, str], ...]
    beside: BesideView | None


def page_view(
    record: EpisodeRecord,
    folder: Path | None,
    pictures_bytes: int,
    others: Sequence[EpisodeRecord] = (),
) -> Page:
    """Everything that the template needs.

    Args:
        record: of the run.
        folder: where its pictures lie.
        pictures_bytes: how large all pictures together may be.
        others: of the same start under other strategies.
    """
    all_moments = moments(record)
    frames = sum(
        1 + 0.3 * min(_MAX_VIEWS, len(m.boundary.observation.frames) - 1)
        for m in all_moments
        if m.boundary is not None and m.boundary.observation is not None
        if m.boundary.observation.frames
    )
    budget = int(pictures_bytes / max(10.0, frames))
    cards = tuple(_card(record, i, m, budget, folder) for i, m in enumerate(all_moments, 1))
    perception = provenance_of(record, "perception")
    states = str(perception.get("state_estimator") or "not recorded")
    longest = max((s for _, s in record.compute_s), default=0.0) or 1.0
    return Page(
        record=record,
        cards=cards,
        heading=_heading(all_moments),
        story=story(record, others),
        alarms=alarms(record),
        places={c.moment.position: c.number for c in cards if c.moment.position is not None},
        legend=_legend(all_moments),
        segmenter=str(perception.get("segmenter") or "not recorded"),
        states=states,
        oracle="oracle" in states.lower(),
        memory=_words(dict(record.provenance).get("memory")),
        reasoning_s=reasoning_s(record.compute_s),
        simulator_s=sum(s for n, s in record.compute_s if n in SIMULATOR_PHASES),
        model=taken(e.told for c in cards for e in c.exchanges),
        phases=tuple(
            Bar(name, seconds, 100 * seconds / longest, aside=name in SIMULATOR_PHASES)
            for name, seconds in sorted(record.compute_s, key=lambda x: (-x[1], x[0]))
        ),
        provenance=tuple((str(k), _words(v)) for k, v in record.provenance),
        beside=beside_view(record, others),
    )


def _heading(found: Sequence[Moment]) -> str:
    """What the cards are about."""
    times = {m.when for m in found}
    words = "Before and after each subtask" if When.AFTER in times else "Before each subtask"
    return f"{words}, and at the end" if When.END in times else words


def _legend(found: Sequence[Moment]) -> tuple[tuple[str, str, str, int], ...]:
    counts = {mark: sum(m.mark is mark for m in found) for mark in Mark}
    return tuple((*LOOKS[mark], mark.value, n) for mark, n in counts.items() if n)


def _card(
    record: EpisodeRecord, number: int, moment: Moment, budget: int, folder: Path | None
) -> Card:
    look, sign = LOOKS[moment.mark]
    boundary = moment.boundary
    verdict = None if boundary is None else boundary.verdict
    observation = None if boundary is None else boundary.observation
    picture, views, thumb = _pictures(observation, budget, folder)
    bars, threshold = _bars(verdict)
    how = drawn(record.task.domain)
    boxes = () if boundary is None or picture is None else _boxes(boundary)
    space = None if boundary is None else space_of(boundary, how)
    about = f"moment {number}, {in_words(moment.when)} {moment.subtask}"
    placed = {b.node for b in boxes} | {b[0] for b in (space or {}).get("boxes", ())}
    observed, expected = _graphs(moment, about, how, placed)
    outcome = None if boundary is None else outcome_of(boundary)
    rows: tuple[PlanRow, ...] = ()
    if boundary is not None and moment.after is not None:
        rows = plan_rows(done_before(record, boundary), moment.before, moment.after)
    return Card(
        number=number,
        moment=moment,
        about=about,
        look=look,
        sign=sign,
        verb=_verb(moment),
        args=" → ".join(moment.subtask.args),
        picture=picture,
        views=views,
        thumb=thumb,
        boxes=boxes,
        space=space,
        bars=bars,
        threshold_percent=threshold,
        observed_svg=observed,
        expected_svg=expected,
        cause=cause_of(boundary) if boundary is not None and moment.alarm else "",
        outcome="" if outcome is None else outcome.value,
        rows=rows,
        exchanges=() if boundary is None else exchange_views(exchanges_of(boundary)),
        open=moment.alarm or look in ("refused", "replanned", "unsolved"),
    )


def _verb(moment: Moment) -> str:
    verb = moment.subtask.skill.removesuffix("_obj").replace("_", " ")
    return verb if moment.when is When.BEFORE else f"{in_words(moment.when)} {verb}"


def _pictures(
    observation: Observation | StoredObservation | None, budget: int, folder: Path | None
) -> tuple[Picture | None, tuple[Picture, ...], Picture | None]:
    if observation is None or not observation.frames:
        return None, (), None
    *others, newest = (rgb_of(frame, folder) for frame in observation.frames)
    if newest is None:
        return None, (), None
    thumb = page_picture(newest, width=THUMB_WIDTH, budget_bytes=max(3000, budget // 8))
    picture = page_picture(newest, width=PICTURE_WIDTH, budget_bytes=budget)
    views = tuple(
        page_picture(rgb, width=VIEW_WIDTH, budget_bytes=budget // 4)
        for rgb in others[-_MAX_VIEWS:]
        if rgb is not None
    )
    return picture, views, thumb


def _boxes(boundary: BoundaryRecord) -> tuple[Framed, ...]:
    """Frames of what the observed graph draws, and of what an alarm speaks about."""
    seen, diagnosis = boundary.observation, boundary.diagnosis
    if seen is None or not seen.frames:
        return ()
    culprits = () if diagnosis is None else diagnosis.culprits
    shown = {n.id for n in boundary.scoped.nodes} | set(culprits)
    found = framed(boundary.graph, seen.frames[-1], culprits)
    return tuple(f for f in found if f.node in shown)


def _bars(verdict: Verdict | None) -> tuple[tuple[Bar, ...], float]:
    if verdict is None or verdict.score is None:
        return (), 0.0
    parts = verdict.parts
    found: list[tuple[str, float | None, bool]] = [("score", verdict.score, True)]
    if parts is not None:
        found += [
            ("nodes", parts.node, False),
            ("edges", parts.edge, False),
            ("structure", parts.structure, False),
        ]
    scale = max(1.0, verdict.threshold, *(v for _, v, _ in found if v is not None))
    return (
        tuple(Bar(n, v, 100 * max(0.0, v or 0.0) / scale, strong) for n, v, strong in found),
        100 * max(0.0, verdict.threshold) / scale,
    )


def _graphs(moment: Moment, about: str, how: Drawn, placed: Collection[str]) -> tuple[str, str]:
    boundary = moment.boundary
    if boundary is None:
        return "", ""
    verdict, done = boundary.verdict, moment.when is not When.BEFORE
    seen = boundary.scoped
    if verdict is None or verdict.nearest is None:
        return graph_svg(
            seen, None, (), (), "observed", how, done=done, about=about, placed=placed
        ), ""
    wanted, pairs, found = verdict.nearest.graph, verdict.matches, verdict.discrepancies
    return (
        graph_svg(
            seen, wanted, pairs, found, "observed", how, done=done, about=about, placed=placed
        ),
        graph_svg(wanted, seen, pairs, found, "expected", how, done=done, about=about),
    )


def status_sign(status: SkillStatus | None) -> str:
    """The sign of an executed step."""
    return "✓" if status is SkillStatus.SUCCEEDED else "✕"


def _words(value: Any) -> str:
    """A value of the provenance on one line."""
    data = plain(value)
    if data is None:
        return "none"
    if isinstance(data, dict):
        return _joined(f"{k} {_words(v)}" for k, v in data.items())
    if isinstance(data, list):
        if all(isinstance(v, list) and len(v) == 2 for v in data):
            return _joined(f"{k} {_words(v)}" for k, v in data)
        return _joined(_words(v) for v in data)
    return data if isinstance(data, str) else json.dumps(data, ensure_ascii=False)


def _joined(parts: Iterable[str]) -> str:
    return ", ".join(parts) or "none"
