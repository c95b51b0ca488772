"""Every kind of part of a run, typed by its Protocol.

Read by `assembly`, which has a table of names for each, and by factories, which ask their `Parts`
for other parts by kind.
"""

from __future__ import annotations

from forestall.domain.model import Domain
from forestall.seams.acting import Eye, WorldPart
from forestall.seams.judging import (
    DemonstrationStore,
    Detector,
    Expectations,
    PlanValidator,
    Reasoner,
    Replanner,
    Retriever,
    Strategy,
)
from forestall.seams.language import LanguageModel
from forestall.seams.perceiving import (
    Captioner,
    Finder,
    ImageTextEncoder,
    Outliner,
    Perceiver,
    Segmenter,
    StateEstimator,
    TextEncoder,
)
from forestall.supervision import Limits
from forestall.types.kind import Kind

WORLD = Kind[WorldPart]("world", WorldPart)
SENSOR = Kind[Eye]("sensor", Eye)
DOMAIN = Kind[Domain]("domain", Domain)
SEGMENTER = Kind[Segmenter]("segmenter", Segmenter)
FINDER = Kind[Finder]("finder", Finder)
OUTLINER = Kind[Outliner]("outliner", Outliner)
STATES = Kind[StateEstimator]("states", StateEstimator)
PERCEIVER = Kind[Perceiver]("perceiver", Perceiver)
TEXT_ENCODER = Kind[TextEncoder]("text-encoder", TextEncoder)
IMAGE_ENCODER = Kind[ImageTextEncoder]("image-encoder", ImageTextEncoder)
CAPTIONER = Kind[Captioner]("captioner", Captioner)
STORE = Kind[DemonstrationStore]("store", DemonstrationStore)
RETRIEVER = Kind[Retriever]("retriever", Retriever)
DETECTOR = Kind[Detector]("detector", Detector)
EXPECTATIONS = Kind[Expectations]("expectations", Expectations)
LLM = Kind[LanguageModel]("llm", LanguageModel)
REASONER = Kind[Reasoner]("reasoner", Reasoner)
REPLANNER = Kind[Replanner]("replanner", Replanner)
VALIDATOR = Kind[PlanValidator]("validator", PlanValidator)
LIMIT = Kind[Limits]("limit", Limits)
STRATEGY = Kind[Strategy]("strategy", Strategy)
