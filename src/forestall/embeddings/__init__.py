"""Encoders of texts and of images; each stands behind a Protocol of `seams/perceiving.py`."""

from forestall.embeddings.hashed import HashedTextEncoder

__all__ = ["HashedTextEncoder"]
