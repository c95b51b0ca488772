"""`forestall run --live`: a run with a view of it."""

from __future__ import annotations

import re
import urllib.request
from pathlib import Path

import pytest

from forestall.cli.main import call


def test_a_run_is_shown_until_it_was_seen_enough(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    seen = []

    def look() -> None:
        said = re.search(r"^live: (http://127\.0\.0\.1:\d+/run/)$", capsys.readouterr().err, re.M)
        assert said is not None
        with urllib.request.urlopen(said[1], timeout=120) as answer:
            seen.append(answer.read().decode())

    monkeypatch.setattr("forestall.cli.run._until_stopped", look)
    run = ["run", "hand-over-washer", "--strategy", "none", "--quiet", "--live", "--out"]
    assert call([*run, str(tmp_path / "run")]) == 0
    (page,) = seen
    assert 'id="timeline"' in page and "All runs" in page
