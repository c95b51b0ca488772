"""`forestall perceive`: pictures of one's own, seen by models."""

from __future__ import annotations

import json
from pathlib import Path

from forestall.cli.flags import Json, SeeingFlags

DEFAULTS = SeeingFlags()


def perceive(
    folder: Path, out: Path, /, *, parts: SeeingFlags = DEFAULTS, as_json: Json = False
) -> int:
    """Find, outline and locate the things in stored pictures, and write what was seen.

    The output folder is an observation folder again (docs/observation-format.md), with masks and
    states, and holds besides graph.json, the scene graph, and overlay.png, a picture of what was
    understood. It is written as a whole or not at all. How to use models: docs/vision.md.

    Args:
        folder: an observation folder, or one that holds numbered ones: looks of one run.
        out: a folder that is not there yet.
        parts: what pictures are seen with; by default with the masks and states that the folder
            has.
        as_json: print JSON.
    """
    from forestall.assembly.perceiving import GRAPH_FILE, OVERLAY_FILE, perceive_stored
    from forestall.cli.listing import say

    seen, eyes = perceive_stored(folder, out, parts.given())
    if as_json:
        scenes = [
            {
                "scene": str(one.source),
                "out": str(one.place),
                "masks": one.found,
                "graph": one.graph.to_json(),
            }
            for one in seen
        ]
        print(json.dumps({"perception": eyes, "scenes": scenes}, indent=2))
        return 0
    for what, name in eyes.items():
        say(f"{what.replace('_', ' ')}: {name}")
    for one in seen:
        located = [n for n in one.graph.nodes if n.box_m is not None]
        say(f"{one.source}: {one.found} masks, {len(located)} things located")
        for node in one.graph.nodes:
            known = ", ".join(f"{a} {v}" for a, v in node.states if v is not None)
            say(f"  {node.id}{f' ({known})' if known else ''}")
        say(f"  {one.place / GRAPH_FILE}, {OVERLAY_FILE}")
    return 0
