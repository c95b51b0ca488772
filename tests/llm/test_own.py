"""A reasoner and a replanner of somebody else's, by entry point: one file each."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

from forestall.assembly.configuration import run_config
from forestall.assembly.parts import Assembly
from forestall.assembly.registry import known
from forestall.errors import InputError, UnknownNameError
from forestall.kinds import REASONER, REPLANNER
from forestall.types.facts import Literal
from forestall.types.verdict import ReplanOutcome
from llm.scenes import REPAIR, alarm, occupied
from planning.corpus import DOMAIN

VACANT = Literal.parse("vacant(Microwave-1)")


@pytest.fixture
def installed(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Path]:
    """Both installed as a package would be, and a file of recipes."""
    info = tmp_path / "their_planning-0.1.dist-info"
    info.mkdir()
    (info / "METADATA").write_text("Metadata-Version: 2.1\nName: their-planning\nVersion: 0.1\n")
    (info / "entry_points.txt").write_text(
        "[forestall.reasoner]\njudges = llm.own_reasoner:JudgesReasoner\n"
        "[forestall.replanner]\nrecipes = llm.own_replanner:recipes\n"
    )
    monkeypatch.syspath_prepend(str(tmp_path))
    file = tmp_path / "recipes.txt"
    file.write_text("pick_up(Mug)\n\n" + "; ".join(REPAIR[:7]) + "\n")
    yield file


def parts(**named: Any) -> Assembly:
    return Assembly(run_config("heat-potato", **named).choices, DOMAIN)


def test_they_are_parts_like_ours_and_do_their_work(installed: Path) -> None:
    assert "judges" in known("reasoner") and "recipes" in known("replanner")
    made = parts(
        reasoner={"name": "judges", "most": 1}, replanner={"name": "recipes", "file": installed}
    )
    context = occupied()
    missed = (VACANT, Literal.parse("dirty(Microwave-1)=clean"))
    found = made.part(REASONER).diagnose(context, alarm(lacking=missed))
    assert (found.must_change, found.producer) == ((VACANT,), "judges")
    assert found.cause == "scene-graph: vacant(Microwave-1) must hold"
    replan = made.part(REPLANNER).replan(context, found)
    assert replan.outcome is ReplanOutcome.SOLVED and replan.producer == "recipes"
    assert replan.plan is not None and replan.check is not None and replan.check.ok
    assert replan.plan.texts() == list(REPAIR)


def test_what_they_cannot_do_they_say(installed: Path) -> None:
    named = {"reasoner": "judges", "replanner": {"name": "recipes", "file": installed}}
    made, context = parts(**named), occupied()
    nothing = made.part(REASONER).diagnose(context, alarm())
    assert not nothing.found
    replanner = made.part(REPLANNER)
    assert replanner.replan(context, nothing).outcome is ReplanOutcome.NOTHING_TO_CHANGE
    found = made.part(REASONER).diagnose(context, alarm(lacking=(VACANT,)))
    installed.write_text("pick_up(Mug)\n")
    refused = parts(**named).part(REPLANNER).replan(context, found)
    assert refused.outcome is ReplanOutcome.NOT_FOUND and refused.note


def test_their_options_are_checked_like_ours(installed: Path) -> None:
    with pytest.raises(UnknownNameError, match="did you mean most"):
        parts(reasoner={"name": "judges", "mots": 1})
    with pytest.raises(InputError, match="most is 0: at least 1 fact"):
        parts(reasoner={"name": "judges", "most": 0}).part(REASONER)
    with pytest.raises(InputError, match="needs the option file"):
        parts(replanner="recipes").part(REPLANNER)
