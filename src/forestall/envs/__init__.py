"""Worlds in which a robot looks and acts: the embedded household and adapters to others."""
