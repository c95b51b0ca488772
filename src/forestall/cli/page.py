"""`forestall page`, `gallery` and `export`: runs shown again from their records."""

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


def gallery(out: Path, /, *runs: Path) -> int:
    """Show runs that went wrong on one Markdown page: what was seen, said and done instead.

    Args:
        out: the folder to write gallery.md and its pictures to.
        runs: folders of runs in which there was an alarm, in the order of the page.
    """
    from forestall.errors import InputError
    from forestall.report.gallery import write_gallery

    if not runs:
        raise InputError("no run was named: give the folder of at least one")
    print(write_gallery(out, runs))
    return 0


def export(run: Path, log: str, /) -> int:
    """Write the record of a run for another program's viewer: what was seen, said and done.

    A record keeps pictures and no depth; `forestall run --log` writes those, too (docs/logs.md).

    Args:
        run: the folder of a run (see docs/record-format.md).
        log: rerun:FILE, a new file for the Rerun viewer.
    """
    from forestall.assembly.logs import export as write
    from forestall.assembly.logs import showing
    from forestall.records.record import read_record

    writer = showing(log)
    write(read_record(run), run if run.is_dir() else run.parent, writer)
    print(log.partition(":")[2])
    return 0
