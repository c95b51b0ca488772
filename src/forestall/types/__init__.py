"""Frozen domain types, shared by every layer; they hold no simulator handle."""
