"""How long comparing takes: random graphs from a seed, scored against many references.

Called by `forestall bench speed`; calls batch. Nothing is asserted here.
"""

from __future__ import annotations

import time
from collections.abc import Sequence

import numpy as np

from forestall.comparison.batch import BatchScorer
from forestall.comparison.options import ScoreConfig
from forestall.embeddings.hashed import HashedTextEncoder
from forestall.errors import InputError
from forestall.interfaces import TextEncoder
from forestall.types.facts import GRIPPER
from forestall.types.graph import ObjectNode, Relation, SceneGraph
from forestall.types.plan import Subtask
from forestall.vocabulary import ATTRIBUTES, Vocabulary, household
