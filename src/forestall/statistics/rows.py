"""What is kept of one episode of an experiment: one JSON line.

Written by the experiments, read by metrics, tables, figures and pages. Truth about the scene is in
`Judged.possible` and `Judged.reachable`; it was taken for scoring, no part of the run saw it.
"""

from __future__ import annotations

import json
from dataclasses import asdict, dataclass, field, fields
from functools import cache
from typing import Any, ClassVar

from pydantic import ConfigDict, TypeAdapter

from forestall.errors import FileFormatError
from forestall.reading.models import validated_json
from forestall.statistics.cases import Case

ROW_FORMAT = 2
"""Raised whenever a field changes its meaning; rows of another format are refused."""


KIND, HONEST = "kind", "honest"
"""Profiles of the household: one in which nothing goes wrong by itself, and one like others."""

EXACT = "exact"
"""The model that knows what its domain file says; others know less, or say what is not so."""

PLAIN = "4"
"""Demonstrations when nothing is said: four of the nominal plan."""

TEMPLATES, MODEL, MODEL_PLANS = "templates", "model", "model that plans"
"""Who explains: templates over mined facts, a language model alone, one that plans alone, too."""
PERFECT = "perfect"
"""The sensor that was said for all runs; others are looked through besides."""

NOBODY = ("none", "watch", "retry-once")
"""Strategies that judge nothing of what they see, so that model and memory make no difference."""


@dataclass(frozen=True, slots=True, order=True)
class Setup:
    """Who watches over a run, and what he knows.

    Args:
        strategy: its name.
        detector: that decides. `threshold`: of it.
        without: what was left out ("reasoning", "validation"), or None.
        profile: of the household, `KIND` or `HONEST`.
        model: of the domain that the monitor reads: "exact", "coarse" or "wrong".
        demonstrations: in its memory: how many, "varied" behind it where people's ways differ.
        reasoning: who explains: `TEMPLATES`, `MODEL` or `MODEL_PLANS`.
        sensor: what the robot looks through: `PERFECT`, a sensor's name, or errors of the one that
            was said, such as "outline_px=2".
    """

    strategy: str
    detector: str
    threshold: float
    without: str | None = None
    profile: str = KIND
    model: str = EXACT
    demonstrations: str = PLAIN
    reasoning: str = TEMPLATES
    sensor: str = PERFECT

    @classmethod
    def of(cls, run: Any) -> Setup:
        """That of a run or a row, which has its fields among others."""
        return cls(*(getattr(run, field.name) for field in fields(cls)))

    def key(self, case: Case) -> str:
        """The key of an episode: readable, unique within an experiment, fit for a folder's name."""
        return f"{case.scenario or f'undisturbed-{case.task}'}_{case.seed}_{self.name}"

    @property
    def name(self) -> str:
        """All of it that tells it from others, in one word."""
        parts = [self.strategy]
        if self.strategy not in NOBODY:
            parts += [self.detector, f"{self.threshold:.2f}"]
        parts += [f"without-{self.without}"] if self.without else []
        parts += [self.profile] if self.profile != KIND else []
        parts += [self.sensor] if self.sensor != PERFECT else []
        if self.strategy not in NOBODY:
            parts += [f"{self.model}-model"] if self.model != EXACT else []
            told = self.demonstrations.replace(" ", "-")
            parts += [f"{told}-demonstrations"] if self.demonstrations != PLAIN else []
            by = self.reasoning.replace(" ", "-")
            parts += [f"reasoning-by-{by}"] if self.reasoning != TEMPLATES else []
        return "_".join(parts)


_STRICT = ConfigDict(extra="forbid", allow_inf_nan=False)


@dataclass(frozen=True, slots=True)
class Judged:
    """One judgement of a run: at a boundary before a subtask, after it, or at the end.

    Args:
        index: of the boundary; in an unmonitored run it is the position in the plan.
        when: "before", "after" or "end".
        subtask: in text form.
        time_s: simulated.
        score: of the detector that decided, None where nothing was compared.
        decision: "proceed", "replan" (an alarm) or "stop", after the last look.
        confirmed: whether the reasoner found something that must change.
        replanned: whether a new plan was adopted.
        cause: the diagnosis in words, empty without alarm.
        looks: how many looks it took.
        scores: of every watching judge by name, None where it had nothing to compare with. Below
            its threshold it raises an alarm; a judge that says yes or no scores 1 or 0.
        named: judge → the facts that it says must change, as text; only of judges that raise an
            alarm here and name any. The deciding detector's are those of the reasoner.
        possible: truth: the next subtask could be carried out now.
        reachable: truth: what is left of the plan would reach the goal from here.
    """

    __pydantic_config__: ClassVar[ConfigDict] = _STRICT

    index: int
    when: str
    subtask: str
    time_s: float
    score: float | None
    decision: str
    confirmed: bool = False
    replanned: bool = False
    cause: str = ""
    looks: int = 1
    scores: dict[str, float | None] = field(default_factory=dict, hash=False)
    named: dict[str, tuple[str, ...]] = field(default_factory=dict, hash=False)
    possible: bool | None = None
    reachable: bool | None = None


@dataclass(frozen=True, slots=True)
class EpisodeRow:
    """One episode.

    Args:
        set: of cases, one of `CASE_SETS` or `FURTHER_SETS`.
        task: its name.
        scenario: None for an undisturbed run.
        kind: of the failure, None for an undisturbed run.
        knowable: through what it can be known: "scene" (before anything is done), "plan" (only by
            one who knows the task), "after" (after something went wrong on the way); None if not
            failing.
        seed: of the scene.
        strategy: "watch" is the unmonitored run, judged by every detector and never interrupted.
        detector: that decided.
        threshold: of it.
        without: what was left out ("reasoning", "validation", a part of the score), or None.
        known: position in the starting plan of the first step before which the failure can be
            known; the plan's length for "after the last step"; None if not failing. In the kind
            household it is what the scenario says. In the honest one, where any run can fail, it is
            taken from the run that nobody interrupts: the first moment from which on the true plan
            check says that what is left will not do, but not before what the scenario says.
        effect: position of the step that does the harm, likewise; in the honest household the
            first from `known` on that is refused or fails, or the first irreversible harm.
        success: strict check. `weak_success`: REFLECT's own. `failures`: what failed, in words.
        harmed: what must never have happened and did, in words (irreversible).
        harmed_s: simulated time of the first such thing, None without.
        end: why the run ended; "error" and "held" with `error` in words: something broke, or did
            not answer in time, was not to be believed, went wrong too often in a row.
        steps: length of the starting plan.
        executed: how many subtasks were executed. `refused`: how many of them were refused.
        judged: in order.
        replans: adopted plans. `planner_calls`: attempts to make one. `model_calls`: requests to
            language models.
        simulated_s: robot time.
        compute_s: measured seconds by phase. `reasoning_s`: those that a robot would spend, too.
        not_judged: moments before a subtask of which the monitor said that nothing was judged.
        profile: see `Setup`. `model`, `demonstrations`, `reasoning`, `sensor`: likewise.
        slips: how many motions of the robot did not come out as they were meant (truth).
        causes: truth: facts, as text, that are the reason why the run fails without a monitor; see
            `tasks.causes`. Empty if not failing, or where none was found.
        implied: whether it was not executed: its detector never alarms on what the unmonitored run
            shows, so that the run is that one.
        provenance: configuration, versions, demonstrations.
    """

    __pydantic_config__: ClassVar[ConfigDict] = _STRICT

    set: str
    task: str
    scenario: str | None
    kind: str | None
    knowable: str | None
    seed: int
    strategy: str
    detector: str
    threshold: float
    without: str | None
    known: int | None
    effect: int | None
    success: bool
    weak_success: bool | None
    failures: tuple[str, ...]
    harmed: tuple[str, ...]
    harmed_s: float | None
    end: str
    error: str
    steps: int
    executed: int
    refused: int
    judged: tuple[Judged, ...]
    replans: int
    planner_calls: int
    model_calls: int
    simulated_s: float
    compute_s: dict[str, float] = field(hash=False)
    reasoning_s: float = 0.0
    implied: bool = False
    not_judged: int = 0
    profile: str = KIND
    model: str = EXACT
    demonstrations: str = PLAIN
    sensor: str = PERFECT
    slips: int = 0
    causes: tuple[str, ...] = ()
    reasoning: str = TEMPLATES
    provenance: dict[str, Any] = field(default_factory=dict, hash=False)

    @property
    def key(self) -> str:
        """What makes an episode the same one within an experiment."""
        return self.setup.key(self.case)

    @property
    def case(self) -> Case:
        """What was to be done, where, and what was to go wrong."""
        return Case(self.set, self.task, self.scenario, self.seed)

    @property
    def setup(self) -> Setup:
        """Who watched over it."""
        return Setup.of(self)

    @property
    def failing(self) -> bool:
        """Whether the case is one that fails when nobody steps in."""
        return self.known is not None

    def to_json(self) -> dict[str, Any]:
        """Plain data."""
        return {"format": ROW_FORMAT, **asdict(self)}

    @classmethod
    def from_json(cls, data: Any) -> EpisodeRow:
        """Read what `to_json` wrote.

        Raises:
            FileFormatError: another format, or fields that do not fit.
        """
        fields = dict(data) if isinstance(data, dict) else {}
        if (found := fields.pop("format", None)) != ROW_FORMAT:
            raise FileFormatError(f"a result of format {found}; this version reads {ROW_FORMAT}")
        return validated_json(_row(), json.dumps(fields))


@cache
def _row() -> TypeAdapter[EpisodeRow]:
    return TypeAdapter(EpisodeRow)
