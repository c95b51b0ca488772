"""A whole run with a real model behind a real server: only where the environment names one.

FORESTALL_TEST_LLM=http://localhost:8000/v1 names the endpoint, FORESTALL_TEST_LLM_FORM how it is
told what an answer looks like (schema, function, text; function by default), FORESTALL_TEST_LLM_OUT
a folder for the record. docs/llm.md says how a small model is started. Whatever it answers, no plan
goes on that the validator did not accept, and the planner solves what it does not.
"""

from __future__ import annotations

import os
from pathlib import Path

import pytest

from forestall.records.exchanges import exchanges_of, taken
from forestall.records.record import read_record, write_record
from forestall.report.page import page_html
from llm.episodes import played

ENDPOINT = os.environ.get("FORESTALL_TEST_LLM", "")
FORM = os.environ.get("FORESTALL_TEST_LLM_FORM", "function")
OUT = os.environ.get("FORESTALL_TEST_LLM_OUT", "")

pytestmark = pytest.mark.skipif(not ENDPOINT, reason="FORESTALL_TEST_LLM names no endpoint")


def test_a_whole_run_with_a_real_model(tmp_path: Path) -> None:
    options = {"llm.form": FORM, "llm.timeout_s": 300.0, "llm.retries": 0}
    limits = {"limit.diagnose_s": 900.0, "limit.replan_s": 900.0, "limit.judge_s": 2000.0}
    record = played("heat-potato", "microwave-occupied", ENDPOINT, **options, **limits)
    written = write_record(Path(OUT) if OUT else tmp_path / "run", record)
    asked = [e for b in read_record(written).boundaries for e in exchanges_of(b)]
    assert {e.purpose for e in asked} == {"reasoning", "replanning"}
    assert all(e.answer is not None or e.problem for e in asked)
    assert all(e.seconds > 0 for e in asked) and taken(asked).prompt_tokens
    replans = [b.replan for b in record.boundaries if b.replan is not None]
    assert all(r.check is not None and r.check.ok for r in replans if r.plan is not None)
    assert all(r.exchanges for r in replans)
    assert record.success, "the planner stands behind the model"
    page = page_html(record)
    assert all(e.key in page for e in asked)
