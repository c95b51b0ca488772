"""A stand-in for a captioning model: lists what perception saw, in sentences.

Called where a captioner can stand; calls nothing. Like a caption it names things and how they look
and says nothing of where they are: the paper's caption-based comparison (Sec. 3) suffers from just
that. Unlike a caption it never errs about what perception found.
"""

from __future__ import annotations

from forestall.domain.model import Domain
from forestall.domain.phrases import with_articles
from forestall.types.facts import GRIPPER
from forestall.types.graph import ObjectNode, SceneGraph, Seen
from forestall.types.observation import Observation


class ListingCaptioner:
    """Says what is in view around the subtask (implements `Captioner`).

    One sentence for each thing and each state of it, in alphabetical order: "A clean plate. A clean
    plate. A closed microwave." Things out of view are left out, and so are states that no picture
    shows; a thing without any other state is named: "A knife."

    Args:
        domain: how things and their states are called.
    """

    name = "listing (stand-in)"

    def __init__(self, domain: Domain) -> None:
        self._domain = domain

    def caption(self, observation: Observation, scoped: SceneGraph) -> str:
        """Sentences about the visible nodes of the scoped graph; "" where there are none."""
        seen = [n for n in scoped.nodes if n.seen is Seen.VISIBLE and n.id != GRIPPER]
        said = sorted(phrase for node in seen for phrase in self._phrases(node))
        return " ".join(f"{phrase[:1].upper()}{phrase[1:]}." for phrase in said)

    def _phrases(self, node: ObjectNode) -> tuple[str, ...]:
        """One for each state that a picture can show; the thing's name where there is none."""
        category = self._domain.find(node.category)
        if category is None:
            return (with_articles(f"a {node.category}"),)
        found = [
            self._domain.phrases(node.category, attribute, value)
            for attribute, value in node.states
            if value is not None and attribute in category.attributes
        ]
        return tuple(p[0] for p in found if p) or (with_articles(f"a {category.spoken}"),)
