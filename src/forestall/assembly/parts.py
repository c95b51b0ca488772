"""Builds the parts of one run, each once, and lends them to each other (`seams.Parts`).

Called by `make`, `demonstrations` and `checking` with a configuration; calls the factories of the
registry.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from typing import Any, TypeVar

from forestall.assembly.configuration import Choice
from forestall.assembly.options import built, checked, declared
from forestall.assembly.registry import find, known
from forestall.domain.model import Domain
from forestall.errors import InputError
from forestall.kinds import CAPTIONER, FINDER, IMAGE_ENCODER, OUTLINER, STRATEGY, TEXT_ENCODER
from forestall.types.demonstration import Demonstration
from forestall.types.kind import Kind

T = TypeVar("T")

_Key = tuple[str, str, tuple[tuple[str, Any], ...]]

_MODELS = frozenset(k.name for k in (TEXT_ENCODER, IMAGE_ENCODER, CAPTIONER, FINDER, OUTLINER))
"""Kinds whose parts are read once for each process, where they borrow nothing: it takes time."""

_shared: dict[_Key, Any] = {}


class Assembly:
    """Implements `Parts`.

    Args:
        choices: the part of each kind.
        domain: of the run's domain.
        demonstrations: the memory, None where there is none.
        lent: things of this very run that a part may ask for by name.
    """

    def __init__(
        self,
        choices: Iterable[Choice],
        domain: Domain,
        demonstrations: Sequence[Demonstration] | None = None,
        lent: Mapping[str, Any] | None = None,
    ) -> None:
        self.domain = domain
        self._choices = {c.kind: c for c in choices}
        self._demonstrations = demonstrations
        self._lent = dict(lent or {})
        self._built: dict[_Key, Any] = {}

    @property
    def demonstrations(self) -> Sequence[Demonstration]:
        """The memory.

        Raises:
            InputError: there is none.
        """
        if not self._demonstrations:
            raise InputError(
                f"strategy {self._choices[STRATEGY.name].name!r} compares with demonstrations, "
                "and the memory has none"
            )
        return self._demonstrations

    def part(self, kind: Kind[T], name: str | None = None, **options: Any) -> T:
        """See the Protocol; the same part is built once.

        Raises:
            InputError: it cannot be built; says why, and whose it is.
        """
        choice = self._choices[kind.name]
        if name is None:
            name, given = choice.name, choice.given
        else:
            given = checked(find(kind.name, name), options)[0]
        key = (kind.name, name, given)
        found = find(kind.name, name)
        alone = kind.name in _MODELS and not declared(found.factory).borrows
        kept = _shared if alone else self._built
        if key not in kept:
            product = built(found, dict(given), self)
            if found.package is not None and (lacking := kind.lacks(product)):
                raise InputError(f"{found.text} cannot be used: it has no {', no '.join(lacking)}")
            kept[key] = product
        product_of_kind: T = kept[key]
        return product_of_kind

    def name(self, kind: Kind[Any]) -> str:
        """What the run's part of a kind is called."""
        return self._choices[kind.name].name

    def options(self, kind: Kind[Any]) -> Mapping[str, Any]:
        """Its options, given and defaulted."""
        return self._choices[kind.name].options

    def given(self, kind: Kind[Any]) -> Mapping[str, Any]:
        """Those that were given."""
        return dict(self._choices[kind.name].given)

    def declared(self, kind: Kind[Any], name: str | None = None) -> Sequence[str]:
        """Every name of a kind; or every option of one part of it."""
        if name is None:
            return known(kind.name)
        return tuple(declared(find(kind.name, name).factory).options)

    def lent(self, what: str) -> Any:
        """Something of this very run.

        Raises:
            InputError: this run has nothing of that name.
        """
        if what not in self._lent:
            raise InputError(f"nothing here can lend {what!r} to a part")
        return self._lent[what]
