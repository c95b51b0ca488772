"""Masks, depth and the hand → one scene graph with three-valued facts (L1)."""

from forestall.perception.config import PerceptionConfig, ScopeConfig
from forestall.perception.perceiver import GraphPerceiver

__all__ = ["GraphPerceiver", "PerceptionConfig", "ScopeConfig"]
