from __future__ import annotations

import html
import subprocess
import sys

import pytest

from forestall.report.notebook import html_of

from . import graphs, records


def test_a_graph_a_verdict_a_diagnosis_and_a_record_draw_themselves() -> None:
    record = records.potato_record()
    alarm = record.boundaries[records.ALARM_INDEX]
    assert alarm.verdict is not None and alarm.diagnosis is not None
    graph = graphs.observed_graph()._repr_html_()
    assert graph.startswith("<svg") and "Bowl-1" in graph and "<style>" in graph
    verdict = alarm.verdict._repr_html_()
    for words in ("replan", "0.734", "0.900", "Bowl-1 is there", "demo-0003", "<svg"):
        assert words in verdict, words
    diagnosis = alarm.diagnosis._repr_html_()
    assert records.CAUSE in diagnosis and "vacant(Microwave-1)" in diagnosis
    page = html.unescape(record._repr_html_().partition('srcdoc="')[2])
    assert page.startswith("<!doctype html>") and records.CAUSE in page


def test_names_cannot_become_markup() -> None:
    record = records.troubled_record()
    drawn: list[object] = [record.boundaries[1].verdict, record.boundaries[0].diagnosis, record]
    drawn += [b.graph for b in record.boundaries]
    for thing in drawn:
        text = html_of(thing)
        assert "<script>alert" not in text and "<b>&quot;S" not in text and '<b>"S' not in text


def test_what_has_no_drawing_is_refused() -> None:
    with pytest.raises(TypeError, match="a str has no drawing"):
        html_of("text")


def test_types_do_not_bring_pages_along() -> None:
    code = (
        "import sys; from forestall.types.episode import EpisodeRecord;"
        "sys.exit('forestall.report' in sys.modules or 'jinja2' in sys.modules)"
    )
    assert subprocess.run([sys.executable, "-c", code], check=False).returncode == 0
