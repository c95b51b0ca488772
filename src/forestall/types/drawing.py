"""How a thing draws itself where somebody looks, such as in a notebook.

Called by `_repr_html_` of graphs, verdicts, diagnoses and records. Who draws is a layer far above:
the package's own table names it (`forestall.DRAWER`), and it is imported at the first drawing, so
that types stay below pages and importing them stays light.
"""

from __future__ import annotations

from importlib import import_module

import forestall


def html_of(thing: object) -> str:
    """A thing as HTML."""
    drawn: str = import_module(forestall.DRAWER).html_of(thing)
    return drawn
