"""The one error family.

ForestallError
├── InputError             what the user gave is not valid; one line that says what would be
│   ├── UnknownNameError   a name that is not known, with the nearest known ones
│   ├── FileFormatError    a file that cannot be read as what it should be
│   ├── DomainError        a domain that contradicts itself, or that something does not fit
│   └── ObservationError   what was seen cannot be: units, camera, masks, dead senses
├── MemoryFileError        the demonstration file is empty, of another version, damaged or locked
├── ModelFileError         a model is missing or damaged, or cannot be run here
├── SceneError             a scene cannot be built as asked (no room, contradictory needs)
├── PerceptionError        an observation that cannot be used (NaN depth, wrong shapes)
└── PartError              a part of a run that raised, gave nonsense or did not answer in time
"""

from __future__ import annotations

import difflib
from collections.abc import Iterable, Sequence
from typing import Any

_MOST_TOLD, _LAST_TOLD = 1000, 300


class ForestallError(Exception):
    """Base of every error that forestall raises on purpose; its text is one clear line.

    Args:
        text: the line; what is longer, because it quotes what was given, is cut in its middle.
    """

    def __init__(self, text: str = "") -> None:
        line = " ".join(str(text).splitlines())
        if len(line) > _MOST_TOLD:
            line = f"{line[: _MOST_TOLD - _LAST_TOLD]} ... {line[-_LAST_TOLD:]}"
        super().__init__(line)


class InputError(ForestallError):
    """What the user gave is not valid."""


class UnknownNameError(InputError):
    """A name outside a closed vocabulary.

    Args:
        kind: what the name should name, e.g. "task".
        name: the name that was given.
        known: every name that would be valid.
    """

    def __init__(self, kind: str, name: str, known: Iterable[str]) -> None:
        options = sorted(known)
        near = difflib.get_close_matches(name, options, n=3, cutoff=0.6)
        meant = f"did you mean {' or '.join(near)}?" if near else ""
        if not near or len(options) <= 20:
            some = options if len(options) <= 60 else [*options[:8], f"... ({len(options)} in all)"]
            meant = f"{meant} known: {', '.join(some) or 'none'}".strip()
        super().__init__(f"unknown {kind} {name!r}: {meant}")
        self.kind = kind
        self.name = name
        self.known = tuple(options)

    def __reduce__(self) -> tuple[type, tuple[str, str, tuple[str, ...]]]:
        return (type(self), (self.kind, self.name, self.known))


class FileFormatError(InputError):
    """A file that cannot be read as what it should be."""


class DomainError(InputError):
    """A domain that contradicts itself, or something that does not fit its domain."""


class ObservationError(InputError):
    """What was seen cannot be; nothing may be judged by it.

    Args:
        text: the first refusing finding, and how many more there are.
        findings: all of them (`types.finding.Finding`), those that refuse nothing too.
    """

    def __init__(self, text: str, findings: Sequence[Any] = ()) -> None:
        super().__init__(text)
        self.findings = tuple(findings)

    def __reduce__(self) -> tuple[type, tuple[str, tuple[Any, ...]]]:
        return (type(self), (str(self), self.findings))


class MemoryFileError(ForestallError):
    """The demonstration file is empty, of another schema version, damaged or locked."""


class ModelFileError(ForestallError):
    """A model is missing or damaged, or cannot be run on this machine."""


class SceneError(ForestallError):
    """A scene cannot be built as asked."""


class PerceptionError(ForestallError):
    """An observation that cannot be used."""


class PartError(ForestallError):
    """A part of a run that raised something, gave nonsense or did not answer in time.

    Args:
        part: which one, e.g. "observe", "detector scene-graph".
        why: what it did, in words.
        late: whether it did not answer in time.
        internal: whether it is a mistake in a program, and not an error that was raised on purpose.
        world: whether the part is the world.
    """

    def __init__(
        self,
        part: str,
        why: str,
        *,
        late: bool = False,
        internal: bool = False,
        world: bool = False,
    ) -> None:
        text = f"{part} {why}" if late else f"{part}: {why}"
        super().__init__(f"internal error in {text}" if internal and not world else text)
        self.part, self.why = part, why
        self.late, self.internal, self.world = late, internal, world

    @property
    def senses(self) -> bool:
        """Whether it is what the robot sees that cannot be believed."""
        return isinstance(self.__cause__, ObservationError)

    def __reduce__(self) -> tuple[Any, ...]:
        return (_part_error, (self.part, self.why, self.late, self.internal, self.world))


def _part_error(part: str, why: str, late: bool, internal: bool, world: bool) -> PartError:
    return PartError(part, why, late=late, internal=internal, world=world)


def where(error: BaseException) -> str:
    """Where in the program an error came up, " (file.py, line 7)"; "" for one never raised."""
    place = error.__traceback__
    while place is not None and place.tb_next is not None:
        place = place.tb_next
    if place is None:
        return ""
    file = place.tb_frame.f_code.co_filename.replace("\\", "/").rpartition("/")[2]
    return f" ({file}, line {place.tb_lineno})"
