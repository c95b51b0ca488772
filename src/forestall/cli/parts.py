"""`forestall parts`: what can be chosen by name, and the options of each part."""

from __future__ import annotations

import json

from forestall.cli.flags import Json


def parts(kind: str | None = None, /, *, as_json: Json = False) -> int:
    """List the parts of a run by kind, or one kind's with every option and its default.

    Args:
        kind: only this kind, with options: world, sensor, domain, segmenter, finder, outliner,
            states, perceiver, text-encoder, image-encoder, captioner, store, retriever, detector,
            expectations, llm, reasoner, replanner, validator, limit, strategy.
        as_json: print JSON, always with options.
    """
    from forestall.assembly.registry import known, lacking, table
    from forestall.assembly.tables import TABLES
    from forestall.extras import how

    if not as_json and kind is None:
        for name, of in TABLES.items():
            each = [of.default, *(n for n in known(name) if n != of.default)]
            print(f"{name}: {', '.join(_told(name, n, n == of.default) for n in each)}")
        absent = {e for k in TABLES for n in known(k) if (e := lacking(k, n)) is not None}
        for one in sorted(absent):
            print(f"[{one}] is not installed: {how(one)}")
        return 0
    wanted = list(TABLES) if kind is None else [table(kind).kind.name]
    if as_json:
        print(json.dumps({k: {n: _options(k, n) for n in known(k)} for k in wanted}, indent=2))
        return 0
    for name in known(wanted[0]):
        mark = " (default)" if name == table(wanted[0]).default else ""
        extra = lacking(wanted[0], name)
        print(f"{name}{mark}" + (f", not installed: {how(extra)}" if extra else ""))
        for option, value in sorted(_options(wanted[0], name).items()):
            print(f"  --{wanted[0]}.{option} {value}")
    return 0


def _told(kind: str, name: str, default: bool) -> str:
    """A part in one line with others."""
    from forestall.assembly.registry import lacking

    extra = lacking(kind, name)
    notes = [*(["default"] if default else []), *([f"needs [{extra}]"] if extra else [])]
    return f"{name} ({', '.join(notes)})" if notes else name


def _options(kind: str, name: str) -> dict[str, object]:
    """Every option of a part with its default, None where it has none."""
    from dataclasses import MISSING

    from forestall.assembly.options import declared, plain
    from forestall.assembly.registry import find

    options = declared(find(kind, name).factory).options.values()
    return {o.name: None if o.default is MISSING else plain(o.default) for o in options}
