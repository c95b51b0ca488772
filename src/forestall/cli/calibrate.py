"""`forestall calibrate`: thresholds with a bound on false alarms, from demonstrations."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Literal

from cyclopts import Parameter

from forestall.cli.flags import Flag, Names, SeeingFlags
from forestall.cli.listing import print_table, say

if TYPE_CHECKING:
    from collections.abc import Sequence

    from forestall.calibration.fitted import CalibrationTable, Fit
    from forestall.report.calibration_figure import Panel


DEFAULTS = SeeingFlags()

WISHED = (0.2, 0.1, 0.05, 0.02, 0.01)
"""Levels of which is said how many runs they need."""

_EVERY = "every subtask"


def calibrate(
    memory: Path,
    /,
    *,
    level: float | None = None,
    judge: Names = None,
    references: Path | None = None,
    divide: Literal["undo", "skill", "none"] = "undo",
    irreversible_share: float = 2 / 3,
    pooled: Flag = False,
    later: Annotated[list[Path] | None, Parameter(consume_multiple=True, negative="")] = None,
    out: Path | None = None,
    parts: SeeingFlags = DEFAULTS,
    quiet: Flag = False,
) -> int:
    """Draw the line of a judge where at most so many good runs have a false alarm.

    Every demonstration is judged against the others, as a run would be. Give the file to runs with
    --detector.calibration (docs/calibration.md).

    Args:
        memory: a demonstration file.
        level: the bound on false alarms per run, over all judges together; 0.05 by default.
        judge: scene-graph, preconditions, plan-check; the detector's by default.
        references: another demonstration file, which runs will compare with; the calibration then
            holds for any judge without leaving anything out.
        divide: undo: one line before what can be undone, one before what cannot; skill: one for
            each skill; none: one for all. What the runs are too few for is not divided.
        irreversible_share: of the budget that is spent before what cannot be undone.
        pooled: no thresholds for each task, one for all.
        later: folders of good runs since then, in order: does the calibration still fit?
        out: the TOML file to write; the picture lies beside it (.svg, extra [figures]).
        parts: which parts, and their options.
        quiet: no progress bar.
    """
    from forestall.assembly.calibrating import calibrate as calibrated
    from forestall.calibration.file import write_calibration
    from forestall.calibration.fitted import LEVEL
    from forestall.calibration.scores import Parts
    from forestall.cli.progress import bar
    from forestall.extras import how, installed
    from forestall.files import replace_file
    from forestall.memory.store import open_store
    from forestall.report.calibration_figure import calibration_figure

    with open_store(memory) as store:
        runs = list(store.required())
    compared = None
    if references is not None:
        with open_store(references) as store:
            compared = list(store.required())
    with bar("judging", quiet=quiet) as feed:
        table = calibrated(
            runs,
            parts.given(),
            judges=judge or (),
            references=compared,
            level=LEVEL if level is None else level,
            parts=Parts(divide),
            by_task=not pooled,
            share=irreversible_share,
            progress=feed,
        )
    scenes = len({(d.task, d.scene) for d in runs})
    _say_fits(table, scenes)
    if later:
        _say_later(table, later)
    if out is not None:
        write_calibration(out, table)
        written = f"{out}"
        if installed("figures"):
            picture = out.with_suffix(".svg")
            replace_file(picture, calibration_figure(_panels(table), table.level))
            written = f"{out} and {picture}"
        else:
            say(f"no picture of it: {how('figures')}")
        same = "give it to runs with the same judge as --detector, and"
        say(f"{written} written: {same} --detector.calibration {out}")
    return 0


def _groups(table: CalibrationTable) -> list[tuple[str, Fit, Fit]]:
    """Every task, or all, with the thresholds that serve it and those of its own runs."""
    if not table.by_task:
        return [("all tasks", table.fit(None), table.fit_of(None, divided=False))]
    return [
        (task or "no task", table.fit(task), table.fit_of(task, divided=False))
        for task in sorted(set(table.scores.tasks))
    ]


def _say_fits(table: CalibrationTable, scenes: int) -> None:
    from forestall.assembly.calibrating import COUNTED, PLAN_CHECK
    from forestall.calibration.conformal import runs_needed

    rows: list[tuple[str, ...]] = []
    for task, fit, own in _groups(table):
        for line in fit.lines:
            judged = [e for e in line.extremes if e < float("inf")]
            counted = line.column.judge in (COUNTED, PLAN_CHECK)
            if line.threshold is None or not fit.usable:
                told = "uncalibrated"
            elif counted:
                told = "may alarm" if line.threshold > 0 else "may not alarm"
            else:
                told = f"{line.threshold:.4f}"
            lowest = f"{judged.count(0.0)} alarms" if counted else f"{min(judged, default=1.0):.4f}"
            rest = "its own" if fit.task is not None else "all tasks"
            more = max(0, own.needed(table.level) - own.runs) if not own.usable else 0
            rows.append(
                (task, line.column.judge, line.column.part or _EVERY, told, f"{fit.runs}, {rest}",
                 lowest if judged else "never judged", f"{own.smallest:.3f}", str(more))
            )  # fmt: skip
    print_table(
        ("task", "judge", "before", "threshold", "good runs", "lowest", "smallest level of its own",
         "more runs needed"),
        rows,
    )  # fmt: skip
    how = "held out" if table.held_out else "each judged against the others"
    say(
        f"\n{len(table.scores.runs)} good runs in {scenes} scenes, {how}; at most {table.level:g} "
        f"of good runs have a false alarm, over all {len(table.scores.judges)} judge(s) together."
    )
    for judge, count in table.looks.items():
        if count:
            say(
                f"{judge} would have looked again in {count} of them; that counts as no alarm, and "
                "is one where a second look does not help: the bound does not cover it."
            )
    shares = len(table.scores.judges)
    needs = ", ".join(f"{x:g} needs {runs_needed(x, shares)}" for x in WISHED)
    say(f"A level needs so many good runs of a group, undivided: {needs}.")


def _say_later(table: CalibrationTable, folders: Sequence[Path]) -> None:
    from forestall.assembly.calibrating import judged_in, still_fits
    from forestall.records.record import read_record

    records = [read_record(folder) for folder in folders]
    good = [r for r in records if r.success is not False]
    if len(good) < len(records):
        say(f"{len(records) - len(good)} of the later runs failed and say nothing here.")
    tests = still_fits(table, [judged_in(r, table.scores.judges) for r in good])
    level = table.level / len(tests)
    for judge, test in tests.items():
        state = "no longer fits: calibrate again" if test.broken(level) else "still fits"
        say(
            f"{judge}: the calibration {state} ({test.added} later runs; a bet against it has come "
            f"to {test.capital:.3g}, {test.most:.3g} at most, {1 / level:g} would be enough)."
        )


def _panels(table: CalibrationTable) -> list[Panel]:
    from forestall.assembly.calibrating import COUNTED, PLAN_CHECK
    from forestall.report.calibration_figure import Panel, Row

    def rows(fit: Fit, judge: str) -> tuple[Row, ...]:
        return tuple(
            Row(
                x.column.part or _EVERY,
                tuple(e for e in x.extremes if e < float("inf")),
                x.threshold if fit.usable else None,
            )
            for x in fit.lines
            if x.column.judge == judge
        )

    return [
        Panel(
            judge,
            tuple(
                (task if fit.task or not table.by_task else f"{task} (by all tasks)",
                 rows(fit, judge))
                for task, fit, _ in _groups(table)
            ),
            judge in (COUNTED, PLAN_CHECK),
        )
        for judge in table.scores.judges
    ]  # fmt: skip
