"""A run once more: the same files, seed and parts, under another strategy.

Called by the command line; calls `configuration.py`. A run can be repeated from its configuration,
or from what its record says of it.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from forestall.assembly.configuration import Given, RunConfig, run_config
from forestall.errors import FileFormatError, InputError
from forestall.kinds import DOMAIN, STRATEGY
from forestall.reading.fields import Field
from forestall.types.episode import EpisodeRecord


def under(config: RunConfig, strategy: str) -> RunConfig:
    """The configuration of the same run under another strategy, which has none of its options.

    Raises:
        InputError: there is no such strategy, or it is the run's own.
    """
    if strategy == config.choice(STRATEGY).name:
        raise InputError(f"the run itself has the strategy {strategy!r}: name another one")
    return _rebuilt(config.to_json(defaulted=False), strategy)


def config_of(record: EpisodeRecord) -> RunConfig:
    """The configuration that a record was made with.

    Raises:
        FileFormatError: the record says none, as those of runs that were not made here do.
        InputError: a name or a value of it is no longer valid.
    """
    said = dict(record.provenance).get("config")
    if not isinstance(said, Mapping):
        raise FileFormatError("the record does not say how it was made: it cannot be run again")
    return _rebuilt(said)


def _rebuilt(said: Mapping[str, Any], strategy: str | None = None) -> RunConfig:
    field = Field(said)
    parts = {
        kind: chosen
        for kind, chosen in field["parts"].pairs(_chosen)
        if kind != DOMAIN.name or said.get("domain") is not None
    }
    given = Given.of(parts)
    if strategy is not None:
        given = Given.of({STRATEGY.name: (strategy, {})}).over(given)
    return run_config(
        field["task"].text(),
        field.maybe("scenario", Field.text),
        seed=field["seed"].whole(),
        without=field.maybe("without", Field.text),
        keep_observations=field["keep_observations"].flag(),
        final_look=field["final_look"].flag(),
        given=given,
    )


def _chosen(part: Field) -> tuple[str, dict[str, Any]]:
    return part["name"].text(), dict(part["given"].pairs(lambda f: f.value))
