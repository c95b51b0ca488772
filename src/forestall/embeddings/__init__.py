"""Encoders of texts and of images; each stands behind a Protocol of `interfaces.py`."""

from forestall.embeddings.hashed import HashedTextEncoder

__all__ = ["HashedTextEncoder"]
