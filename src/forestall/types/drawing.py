"""How a thing draws itself where somebody looks, such as in a notebook.

Called by `_repr_html_` of graphs, verdicts, diagnoses and records. Who draws is a layer far above:
the package names it when it is imported (`forestall/__init__.py`), and it is loaded at the first
drawing, so that types stay below pages and importing them stays light.
"""

from __future__ import annotations

from importlib import import_module

_named: list[str] = []


def drawn_by(module: str) -> None:
    """Name the module whose `html_of` draws."""
    _named[:] = [module]


def html_of(thing: object) -> str:
    """A thing as HTML."""
    drawn: str = import_module(_named[0]).html_of(thing)
    return drawn
