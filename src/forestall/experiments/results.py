"""From the rows of a folder to its summary, tables, figures and page. Nothing is run.

Called by the command line after an experiment, or on its own; calls statistics and report.
"""

from __future__ import annotations

import json
from collections import Counter
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from forestall.errors import FileFormatError, InputError
from forestall.experiments.folder import ResultsFolder, episodes_in
from forestall.experiments.worker import PAGES
from forestall.files import make_folder, replace_file
from forestall.kinds import CAPTIONER, IMAGE_ENCODER
from forestall.report.experiment_page import write_experiment
from forestall.statistics.cases import Case, cases
from forestall.statistics.findings import findings
from forestall.statistics.rows import HONEST, EpisodeRow
from forestall.statistics.summary import summary as summarised
from forestall.statistics.tables import Table, tables

SUMMARY = "summary.json"

CALIBRATION = "calibration"
"""Folder inside that of an experiment: watched runs of another split, for thresholds."""

STAND_INS = {
    ("image", "two-tower"): "image (stand-in: our small encoder)",
    ("caption", "listing"): "caption (stand-in: a list of what is seen)",
}
"""(detector, what it works with) → how it is called where people read it."""


def present(path: Path, out: Path | None = None) -> tuple[dict[str, Any], tuple[Table, ...]]:
    """Write `summary.json`, tables, figures and the page of a folder of results.

    Args:
        path: the folder.
        out: where to; the folder itself by default.

    Raises:
        FileFormatError: it holds no experiment, or no episode.
    """
    data, rows, meta, names = summary_of(path)
    made = tables(data)
    to = path if out is None else out
    make_folder(to)
    replace_file(to / SUMMARY, (json.dumps(data, indent=1) + "\n").encode())
    links = {
        row.key: f"{PAGES}/{row.key}/index.html"
        for row in rows
        if (to / PAGES / row.key / "index.html").exists()
    }
    told = {
        "title": f"Experiments on the {meta['split']} split",
        **{k: v for k, v in meta.items() if k not in ("settings", "effort")},
        **{kind: _said(part) for kind, part in meta["settings"]["parts"].items()},
        "episodes": f"{len(rows)}, {sum(not r.implied for r in rows)} of them executed, in "
        f"{sum(sum(r.compute_s.values()) for r in rows) / 3600:.1f} h of one worker",
        **meta["effort"],
        "findings": findings(data),
        "names": names,
    }
    write_experiment(to, rows, data, made, told, links)
    return data, made


def summary_of(
    path: Path,
) -> tuple[dict[str, Any], list[EpisodeRow], dict[str, Any], dict[str, str]]:
    """Summary, rows, what all have in common, and how detectors are called.

    Raises:
        FileFormatError: see `present`.
    """
    folder = episodes_in(path)
    about = folder.about()
    rows = list(folder.rows().values())
    if not rows:
        raise FileFormatError(f"{path} holds no finished episode yet")
    names = shown_names(about["settings"])
    meta = {
        "split": about["split"],
        "seeds": about["rounds"],
        "version": about["version"],
        "sources": about["sources"],
        "settings": about["settings"],
        "effort": folder.effort(),
    }
    try:
        notes = _missing(folder, about, rows)
    except FileFormatError:
        raise
    except InputError as error:  # names that this version does not know
        raise FileFormatError(f"{path}: {error}") from error
    apart = calibration_of(path, about)
    return summarised(rows, meta, notes, names, apart), rows, meta, names


def calibration_of(path: Path, about: dict[str, Any]) -> list[EpisodeRow]:
    """Rows of the folder inside that thresholds are drawn from, none where there is none.

    Raises:
        FileFormatError: it holds the same split.
    """
    inside = path / CALIBRATION
    if not inside.is_dir():
        return []
    folder = episodes_in(inside)
    if folder.about()["split"] == about["split"]:
        raise FileFormatError(f"{inside} is of the split {about['split']}, as what it calibrates")
    return list(folder.rows().values())


def _missing(
    folder: ResultsFolder[EpisodeRow], about: dict[str, Any], rows: Sequence[EpisodeRow]
) -> list[str]:
    """What was asked for and is not there, and what was not asked for."""
    there = Counter((row.set, row.setup.name) for row in rows)
    lacking: Counter[str] = Counter()
    for asked in folder.asked():
        what = f"{asked.strategy} on {asked.set}, {asked.profile}"
        lacking[what] += max(0, asked.episodes - there[asked.set, asked.setup])
    notes = [f"missing: {n} episodes of {what}" for what, n in sorted(lacking.items()) if n]
    used: dict[tuple[str, str], set[Case]] = {}
    for row in rows:
        used.setdefault((row.profile, row.set), set()).add(row.case)
    for (profile, of), found in sorted(used.items()):
        whole = len(cases(of, about["split"], about["rounds"], further=profile == HONEST))
        if len(found) < whole:
            notes.append(f"run: {len(found)} of {whole} cases of {of}, {profile}")
    return notes


def shown_names(settings: dict[str, Any]) -> dict[str, str]:
    """How detectors are called; offline stand-ins are called stand-ins."""
    parts = settings["parts"]
    made_by = {"image": IMAGE_ENCODER.name, "caption": CAPTIONER.name}
    used = {d: parts[kind]["name"] for d, kind in made_by.items() if kind in parts}
    return {d: STAND_INS[d, w] for d, w in used.items() if (d, w) in STAND_INS}


def _said(part: dict[str, Any]) -> str:
    """A part and the options that were given to it, in words."""
    options = ", ".join(f"{option} {value}" for option, value in part["given"].items())
    return f"{part['name']} ({options})" if options else str(part["name"])
