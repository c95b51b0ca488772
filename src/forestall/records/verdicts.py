"""What was judged ⇄ plain data: verdicts, references, diagnoses, plans and their checks.

Called by `boundaries.py`; the keys are described in `docs/record-format.md`.
"""

from __future__ import annotations

import base64
import math
from typing import Any

from forestall.reading.fields import Field
from forestall.records.exchanges import exchanges_from, exchanges_json
from forestall.types.demonstration import View
from forestall.types.facts import Literal
from forestall.types.graph import SceneGraph
from forestall.types.plan import Plan, Subtask
from forestall.types.verdict import (
    Calibration,
    Change,
    Decision,
    Diagnosis,
    Discrepancy,
    PlanCheck,
    Reference,
    Replan,
    ReplanOutcome,
    ScoreParts,
    Verdict,
)


def subtask(field: Field) -> Subtask:
    """A subtask from its text form."""
    field.text()
    return field.parsed(Subtask.parse)


def literal(field: Field) -> Literal:
    """A fact from its text form."""
    field.text()
    return field.parsed(Literal.parse)


def graph(field: Field) -> SceneGraph:
    """A scene graph."""
    return field.parsed(SceneGraph.from_json)


def plan(texts: Field, goal: Field) -> Plan:
    """A plan from the text forms of its subtasks, and the goal that it serves."""
    return Plan(texts.tuple_of(subtask), goal.text())


def verdict_json(verdict: Verdict) -> dict[str, Any]:
    """A detector's answer."""
    return {
        "decision": verdict.decision,
        "detector": verdict.detector,
        "score": verdict.score,
        "threshold": _threshold_json(verdict.threshold),
        "calibration": verdict.calibration,
        "parts": None if verdict.parts is None else _parts_json(verdict.parts),
        "references": verdict.references,
        "nearest": None if verdict.nearest is None else _reference_json(verdict.nearest),
        "matches": verdict.matches,
        "discrepancies": [
            {
                "change": d.change,
                "subject": d.subject,
                "expected": d.expected,
                "observed": d.observed,
                "text": d.text,
            }
            for d in verdict.discrepancies
        ],
        "note": verdict.note,
        "lacking": [str(x) for x in verdict.lacking],
        "p_value": verdict.p_value,
        **({"expected_by": verdict.expected_by} if verdict.expected_by else {}),
        **exchanges_json(verdict.exchanges),
    }


def verdict_from(field: Field) -> Verdict:
    """Read what `verdict_json` wrote."""
    return Verdict(
        decision=field["decision"].member(Decision),
        detector=field["detector"].text(),
        score=field.maybe("score", Field.number),
        threshold=_threshold_from(field["threshold"]),
        calibration=field["calibration"].member(Calibration),
        parts=field.maybe("parts", _parts_from),
        nearest=field.maybe("nearest", _reference_from),
        matches=field["matches"].tuple_of(_pair),
        discrepancies=field["discrepancies"].tuple_of(_discrepancy),
        references=field["references"].whole(),
        note=field["note"].text(),
        lacking=field["lacking"].tuple_of(literal),
        p_value=field.optional("p_value", Field.number),
        expected_by=field.optional("expected_by", Field.text) or "",
        exchanges=exchanges_from(field),
    )


def _threshold_json(threshold: float) -> float | str:
    """A threshold that always or never alarms is not finite, and JSON has no such number."""
    return threshold if math.isfinite(threshold) else str(threshold)


def _threshold_from(field: Field) -> float:
    if field.value in ("inf", "-inf"):
        return float(field.value)
    return field.number()


def _parts_json(parts: ScoreParts) -> dict[str, Any]:
    return {
        "score": parts.score,
        "node": parts.node,
        "edge": parts.edge,
        "structure": parts.structure,
    }


def _parts_from(field: Field) -> ScoreParts:
    return ScoreParts(
        score=field["score"].number(),
        node=field.maybe("node", Field.number),
        edge=field.maybe("edge", Field.number),
        structure=field.maybe("structure", Field.number),
    )


def _pair(field: Field) -> tuple[str, str]:
    names = field.tuple_of(Field.text)
    if len(names) != 2:
        field.fail("a pair of names")
    return (names[0], names[1])


def _discrepancy(field: Field) -> Discrepancy:
    return Discrepancy(
        change=field["change"].member(Change),
        subject=field["subject"].text(),
        expected=field["expected"].text(),
        observed=field["observed"].text(),
        text=field["text"].text(),
    )


def _reference_json(reference: Reference) -> dict[str, Any]:
    return {
        "demonstration": reference.demonstration,
        "task": reference.task,
        "index": reference.index,
        "subtask": str(reference.subtask),
        "similarity": reference.similarity,
        "graph": reference.graph.to_json(),
        "later": [str(s) for s in reference.later],
        "view": None if reference.view is None else _view_json(reference.view),
        "after": None if reference.after is None else reference.after.to_json(),
    }


def _reference_from(field: Field) -> Reference:
    return Reference(
        demonstration=field["demonstration"].text(),
        task=field["task"].text(),
        index=field["index"].whole(),
        subtask=subtask(field["subtask"]),
        similarity=field["similarity"].number(),
        graph=graph(field["graph"]),
        later=field["later"].tuple_of(subtask),
        view=field.maybe("view", view_from),
        after=field.maybe("after", graph),
    )


def _view_json(view: View) -> dict[str, Any]:
    image = None if view.image is None else base64.b64encode(view.image).decode("ascii")
    return {
        "image": image,
        "caption": view.caption,
        "encoder": view.encoder,
        "captioner": view.captioner,
    }


def view_from(field: Field) -> View:
    """What a picture comes down to."""
    return View(
        image=field.maybe("image", _bytes),
        caption=field["caption"].text(),
        encoder=field["encoder"].text(),
        captioner=field["captioner"].text(),
    )


def _bytes(field: Field) -> bytes:
    field.text()
    return field.parsed(lambda text: base64.b64decode(text, validate=True))


def diagnosis_json(diagnosis: Diagnosis) -> dict[str, Any]:
    """Why a scene does not fit."""
    return {
        "cause": diagnosis.cause,
        "must_change": [str(x) for x in diagnosis.must_change],
        "must_stay": [str(x) for x in diagnosis.must_stay],
        "culprits": diagnosis.culprits,
        "producer": diagnosis.producer,
        "step": None if diagnosis.step is None else str(diagnosis.step),
        "refusal": diagnosis.refusal,
        "support": diagnosis.support,
        **({"why": diagnosis.why} if diagnosis.why else {}),
        **({"advice": diagnosis.advice} if diagnosis.advice else {}),
        **exchanges_json(diagnosis.exchanges),
    }


def diagnosis_from(field: Field) -> Diagnosis:
    """Read what `diagnosis_json` wrote."""
    return Diagnosis(
        cause=field["cause"].text(),
        must_change=field["must_change"].tuple_of(literal),
        must_stay=field["must_stay"].tuple_of(literal),
        culprits=field["culprits"].tuple_of(Field.text),
        producer=field["producer"].text(),
        step=field.optional("step", subtask),
        refusal=field.optional("refusal", Field.text) or "",
        support=field.optional("support", _support),
        why=field.optional("why", Field.text) or "",
        advice=field.optional("advice", Field.text) or "",
        exchanges=exchanges_from(field),
    )


def _support(field: Field) -> tuple[int, int]:
    numbers = field.tuple_of(Field.whole)
    if len(numbers) != 2:
        field.fail("a pair of numbers")
    return (numbers[0], numbers[1])


def replan_json(replan: Replan) -> dict[str, Any]:
    """An attempt at a corrected plan."""
    return {
        "outcome": replan.outcome,
        "plan": None if replan.plan is None else replan.plan.texts(),
        "plan_goal": None if replan.plan is None else replan.plan.goal,
        "check": None if replan.check is None else _check_json(replan.check),
        "producer": replan.producer,
        "expanded": replan.expanded,
        "seconds": replan.seconds,
        "note": replan.note,
        "looking_for": list(replan.looking_for),
        **exchanges_json(replan.exchanges),
    }


def replan_from(field: Field) -> Replan:
    """Read what `replan_json` wrote."""
    return Replan(
        outcome=field["outcome"].member(ReplanOutcome),
        plan=field.maybe("plan", lambda texts: plan(texts, field["plan_goal"])),
        check=field.maybe("check", _check_from),
        producer=field["producer"].text(),
        expanded=field["expanded"].whole(),
        seconds=field["seconds"].number(),
        note=field["note"].text(),
        looking_for=field.optional("looking_for", lambda f: f.tuple_of(Field.text)) or (),
        exchanges=exchanges_from(field),
    )


def _check_json(check: PlanCheck) -> dict[str, Any]:
    return {
        "ok": check.ok,
        "step": check.step,
        "reason": check.reason,
        "lacking": [str(x) for x in check.lacking],
        "unmet": [str(x) for x in check.unmet],
        "assumed": [str(x) for x in check.assumed],
    }


def _check_from(field: Field) -> PlanCheck:
    return PlanCheck(
        ok=field["ok"].flag(),
        step=field.maybe("step", Field.whole),
        reason=field["reason"].text(),
        lacking=field["lacking"].tuple_of(literal),
        unmet=field["unmet"].tuple_of(literal),
        assumed=field["assumed"].tuple_of(literal),
    )
