"""What a kind of part is: a name, and the Protocol that its parts implement.

Used by `kinds`, which has all of them, and by whoever asks for a part. No vocabulary, no imports.
"""

from __future__ import annotations

import inspect
from dataclasses import dataclass
from typing import Any, Generic, TypeVar

T = TypeVar("T")


@dataclass(frozen=True)
class Kind(Generic[T]):
    """A kind of part; `T` is the type that asking for one gives.

    Args:
        name: as in flags, files and entry points ("forestall.<name>").
        protocol: the Protocol itself, to see that what others built has its members.
    """

    name: str
    protocol: Any

    def lacks(self, product: object) -> tuple[str, ...]:
        """Public members of the Protocol that an object does not have."""
        members = {
            name
            for base in self.protocol.__mro__
            if getattr(base, "_is_protocol", False)
            for name in (*vars(base), *inspect.get_annotations(base))
            if not name.startswith("_")
        }
        return tuple(sorted(name for name in members if not hasattr(product, name)))


@dataclass(frozen=True, slots=True)
class Settled:
    """Marks an options parameter of a factory: these fields the factory fills in by itself.

    `score: Annotated[ScoreConfig, Settled("feature")]` makes every other field an option.
    """

    fields: tuple[str, ...]

    def __init__(self, *fields: str) -> None:
        object.__setattr__(self, "fields", fields)
