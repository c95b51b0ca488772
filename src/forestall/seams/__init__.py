"""Every Protocol of the project; implementations never import each other.

Calls point downwards: a command has a runtime built (`assembly/`), its monitor calls
the strategy, the strategy calls detector, reasoner, replanner; all see only this and `types/`.
Parts of one's own take them from here, the package's own files from where each one stands.
"""

from __future__ import annotations

from forestall.seams.acting import (
    Disturbance,
    Environment,
    Eye,
    OpenWorld,
    OracleView,
    Renderer,
    Unnamed,
    Vantages,
    World,
    WorldPart,
)
from forestall.seams.judging import (
    DemonstrationStore,
    Detector,
    Expectations,
    GraphScorer,
    Locator,
    PlanValidator,
    Reasoner,
    Replanner,
    Retriever,
    Strategy,
)
from forestall.seams.language import LanguageModel
from forestall.seams.others import DataSet, Foreign, PlanSet
from forestall.seams.perceiving import (
    Captioner,
    ConfidentStateEstimator,
    Finder,
    ImageEncoder,
    ImageTextEncoder,
    Outliner,
    Perceiver,
    Segmenter,
    StateEstimator,
    TextEncoder,
)
from forestall.seams.running import GoalChecker, Listener, LookListener, Parts

__all__ = [
    "Captioner",
    "ConfidentStateEstimator",
    "DataSet",
    "DemonstrationStore",
    "Detector",
    "Disturbance",
    "Environment",
    "Expectations",
    "Eye",
    "Finder",
    "Foreign",
    "GoalChecker",
    "GraphScorer",
    "ImageEncoder",
    "ImageTextEncoder",
    "LanguageModel",
    "Listener",
    "Locator",
    "LookListener",
    "OpenWorld",
    "OracleView",
    "Outliner",
    "Parts",
    "Perceiver",
    "PlanSet",
    "PlanValidator",
    "Reasoner",
    "Renderer",
    "Replanner",
    "Retriever",
    "Segmenter",
    "StateEstimator",
    "Strategy",
    "TextEncoder",
    "Unnamed",
    "Vantages",
    "World",
    "WorldPart",
]
