"""A reasoner of somebody else's in one file: what the judges miss must change.

    [project.entry-points."forestall.reasoner"]
    judges = "own_reasoner:JudgesReasoner"

Its keyword parameters are its options: `--reasoner.name judges --reasoner.most 2`.
"""

from __future__ import annotations

from forestall.errors import InputError
from forestall.types.runtime import BoundaryContext
from forestall.types.verdict import Diagnosis, Verdict


class JudgesReasoner:
    """Implements `forestall.seams.Reasoner`; asks nobody, knows only what was judged.

    Args:
        most: facts that must change.
    """

    name = "judges"

    def __init__(self, most: int = 3) -> None:
        if most < 1:
            raise InputError(f"most is {most}: at least 1 fact is needed")
        self._most = most

    def diagnose(self, context: BoundaryContext, verdict: Verdict) -> Diagnosis:
        said = (verdict, *context.said)
        lacking = tuple(dict.fromkeys(fact for v in said for fact in v.lacking))[: self._most]
        if not lacking:
            return Diagnosis("no judge names a fact", (), producer=self.name)
        who = " and ".join(dict.fromkeys(v.detector for v in said if v.lacking))
        facts = ", ".join(map(str, lacking))
        things = tuple(dict.fromkeys(a for fact in lacking for a in fact.args))
        return Diagnosis(f"{who}: {facts} must hold", lacking, culprits=things, producer=self.name)
