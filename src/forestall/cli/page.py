"""`forestall page`: the page of a run, drawn again from its record."""

from __future__ import annotations

from pathlib import Path


def page(run: Path, /, *, out: Path | None = None) -> int:
    """Draw the page of a run from its folder alone, also where the run was killed.

    Args:
        run: the folder of a run (see docs/record-format.md).
        out: the HTML file to write; index.html in that folder by default.
    """
    from forestall.records.record import read_record
    from forestall.report.page import write_page

    record = read_record(run)
    folder = run if run.is_dir() else run.parent
    print(write_page(record, out or folder / "index.html", folder))
    return 0
