"""`forestall study make | serve | report | export`: which of two explanations is better."""

from __future__ import annotations

import json
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

from cyclopts import App, Parameter

from forestall.cli.flags import Json

if TYPE_CHECKING:
    from forestall.llm.explaining import Writer

study = App(name="study", help="The human study: which of two explanations says better what fails.")

Several = Parameter(consume_multiple=True, negative="")


@study.command
def make(
    folder: Path,
    /,
    *,
    results: Annotated[list[Path], Parameter(name="--from", consume_multiple=True, negative="")],
    ours: str | None = None,
    against: Annotated[list[str] | None, Several] = None,
    items: int = 40,
    raters: int = 15,
    each: int | None = None,
    threshold: float | None = None,
    memory: Path | None = None,
    llm: str | None = None,
    seed: int = 0,
) -> int:
    """Make a study of failing boundaries at which all chosen detectors alarmed in time.

    The runs must have been watched: forestall run TASK --scenario NAME --strategy watch, or an
    experiment with --strategies watch --pages all. What cannot be asked about is counted.

    Args:
        folder: new or empty.
        results: folders of runs or of experiments.
        ours: the detector that all others are compared with; scene-graph by default.
        against: the others; objects, caption and image by default.
        items: at most so many boundaries, of all tasks in turn.
        raters: how many people can take part.
        each: comparisons for each of them; every item once by default, 40 at most.
        threshold: of all detectors, in the place of the runs' own.
        memory: the demonstration file, where it is not where the runs had it.
        llm: the language model that writes the explanations (see forestall run --help); templates
            write them by default.
        seed: of choice, order and sides.
    """
    from forestall.cli.listing import say
    from forestall.study.assigning import Design
    from forestall.study.making import AGAINST, OURS, Asked, make_study

    asked = Asked(
        ours or OURS, tuple(against or AGAINST), items, threshold, memory,
        Design(raters, each, seed),
    )  # fmt: skip
    made = make_study(folder, results, asked, _writer(llm))
    for why, count in made.left_out.items():
        say(f"{count} left out: {why}")
    shown = sum(not t.check for t in made.raters[0])
    say(
        f"{len(made.items)} items, {made.ours} against {', '.join(made.against)}; {raters} raters "
        f"with {shown} comparisons and {len(made.raters[0]) - shown} attention checks each"
    )
    _say_power(made)
    say(f"next: forestall study serve {folder}")
    return 0


@study.command
def serve(folder: Path, /, *, port: int = 8765, host: str = "127.0.0.1") -> int:
    """Ask people, in a browser on this machine or, with --host 0.0.0.0, in its network.

    Args:
        folder: of the study.
        port: to listen on; 0 for any that is free.
        host: name or address to listen on.
    """
    from forestall.study.serving import serving

    with serving(folder, host, port) as server:
        print(server.address, flush=True)
        if host not in ("127.0.0.1", "localhost"):
            import socket

            port = server.server_address[1]
            print(f"on other devices: http://{socket.gethostname()}:{port}/", flush=True)
        try:
            server.serve_forever()
        except KeyboardInterrupt:
            return 0
    return 0


@study.command
def report(folder: Path, /, *, out: Path | None = None, as_json: Json = False) -> int:
    """Count the answers: wins, losses and both with intervals, agreement, strengths, power.

    Args:
        folder: of the study.
        out: where to write report.html, report.json, answers.csv and answers.json; the study's
            folder by default.
        as_json: print the report as JSON instead of tables.
    """
    from forestall.cli.listing import say
    from forestall.study.reporting import write_report

    written = write_report(folder, out)
    if as_json:
        print(json.dumps(written.data, indent=2))
        return 0
    data = written.data
    if data["people"] is None:
        say("No person has answered yet.")
    else:
        _say("people", data["people"])
    if data["simulated"] is not None:
        _say("SIMULATED raters, no people", data["simulated"])
    paper = data["paper"]
    say(f'The paper, {paper["raters"]} raters: "{paper["said"]}" ({paper["source"]}).')
    print(written.files[0])
    return 0


@study.command
def export(folder: Path, /, *, out: Path | None = None) -> int:
    """Write what raters are shown, and apart from it the key, as CSV and JSON for crowd platforms.

    Args:
        folder: of the study.
        out: folder to write to; "export" in the study's folder by default.
    """
    from forestall.study.exporting import export as exported
    from forestall.study.model import read_study

    for path in exported(read_study(folder), out or folder / "export"):
        print(path)
    return 0


def _writer(llm: str | None) -> Writer | None:
    """Who writes the explanations, None for the templates."""
    if llm is None:
        return None
    from forestall.assembly.configuration import choices, domain_of
    from forestall.assembly.language import said_llm
    from forestall.assembly.parts import Assembly
    from forestall.kinds import DOMAIN, LLM
    from forestall.llm.explaining import ModelWriter

    given = said_llm(llm)
    parts = Assembly(choices(given), domain_of(given.chosen(DOMAIN.name)))
    return ModelWriter(parts.part(LLM))


def _say(who: str, found: dict[str, Any]) -> None:
    from forestall.cli.listing import print_table, say
    from forestall.study.reporting import number, table_of

    say(
        f"{who}: {found['raters']} raters ({found['finished']} finished, {found['not_attentive']} "
        f"left out for their attention checks), {found['answers']} answers"
    )
    if "against" not in found:
        return
    print_table(*table_of(found))
    told = "not defined" if found["alpha"]["value"] is None else number(found["alpha"])
    say(f"Krippendorff's alpha {told} over {found['alpha']['comparisons']} comparisons")
    _say_needed(found["power"])


def _say_power(made: Any) -> None:
    from forestall.study.measuring import power_of

    _say_needed(power_of(made))


def _say_needed(power: dict[str, Any]) -> None:
    from forestall.cli.listing import say

    how = "assumed" if power["variance"]["assumed"] else "measured"
    needed = ", ".join(
        f"{50 + 100 * float(d):.0f} % {'more items' if n is None else n}"
        for d, n in power["raters_needed"].items()
    )
    say(f"raters that a preference for ours needs to be found ({how} variances): {needed}")
