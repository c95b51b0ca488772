"""Domains as data: what a household, a bench or a warehouse is about."""
