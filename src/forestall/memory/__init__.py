"""Demonstrations: record, store, retrieve."""
