"""From the rows of a folder to its summary, tables, figures and page. Nothing is run.

Called by the command line after an experiment, or on its own; calls benchmark and report.
"""

from __future__ import annotations

import json
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from forestall.benchmark.cases import CASE_SETS, cases
from forestall.benchmark.findings import findings
from forestall.benchmark.rows import EpisodeRow
from forestall.benchmark.summary import summary as summarised
from forestall.benchmark.tables import Table, tables
from forestall.errors import FileFormatError
from forestall.experiments.folder import ResultsFolder
from forestall.experiments.worker import PAGES
from forestall.report.experiment_page import write_experiment
from forestall.report.record import replace_file

SUMMARY = "summary.json"

STAND_INS = {
    ("image", "two-tower"): "image (stand-in: our small encoder for CLIP)",
    ("caption", "listing"): "caption (stand-in: a list of what is seen for a captioner)",
}
"""(detector, what it works with) → how it is called where people read it."""


def present(
    path: Path, rows: Sequence[EpisodeRow] | None = None
) -> tuple[dict[str, Any], tuple[Table, ...]]:
    """Write `summary.json`, tables, figures and the page of a folder of results.

    Args:
        path: the folder.
        rows: of the experiment; all rows of the folder by default.

    Raises:
        FileFormatError: it holds no experiment, or no episode.
    """
    folder = ResultsFolder(path)
    about = folder.about()
    rows = list(folder.rows().values()) if rows is None else rows
    if not rows:
        raise FileFormatError(f"{path} holds no finished episode yet")
    names = shown_names(about["settings"])
    expected = [c for of in CASE_SETS for c in cases(of, about["split"], about["rounds"])]
    meta = {
        "split": about["split"],
        "seeds": about["rounds"],
        "version": about["version"],
        "sources": about["sources"],
        "settings": about["settings"],
    }
    data = summarised(rows, meta, expected, names)
    made = tables(data)
    replace_file(path / SUMMARY, (json.dumps(data, indent=1) + "\n").encode())
    links = {
        row.key: f"{PAGES}/{row.key}/index.html"
        for row in rows
        if (path / PAGES / row.key / "index.html").exists()
    }
    told = {
        "title": f"Experiments on the {about['split']} split",
        **{k: v for k, v in meta.items() if k != "settings"},
        **about["settings"],
        "episodes": len(rows),
        **folder.effort(),
        "findings": findings(data),
        "names": names,
    }
    write_experiment(path, rows, data, made, told, links)
    return data, made


def shown_names(settings: dict[str, Any]) -> dict[str, str]:
    """How detectors are called; offline stand-ins are called stand-ins."""
    used = {"image": settings.get("image_encoder"), "caption": settings.get("captioner")}
    return {d: STAND_INS[d, str(w)] for d, w in used.items() if (d, str(w)) in STAND_INS}
