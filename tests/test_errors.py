"""Errors survive a process boundary and name what would be valid."""

import pickle

import pytest

from forestall import errors
from forestall.errors import ForestallError, PartError, UnknownNameError


@pytest.mark.parametrize(
    "error",
    [
        UnknownNameError("task", "heat-potatoe", ["heat-potato", "toast-bread"]),
        PartError("observe", "did not answer within 10 s", late=True, world=True),
        *(
            kind("one line")
            for kind in vars(errors).values()
            if isinstance(kind, type)
            and issubclass(kind, ForestallError)
            and kind not in (PartError, UnknownNameError)
        ),
    ],
    ids=lambda e: type(e).__name__,
)
def test_errors_survive_a_worker(error: ForestallError) -> None:
    again = pickle.loads(pickle.dumps(error))
    assert type(again) is type(error)
    assert str(again) == str(error)


def test_long_vocabularies_are_not_printed_when_something_is_near() -> None:
    names = [f"Thing{k}" for k in range(30)]
    assert len(str(UnknownNameError("object", "Thing", names))) < 80
    assert "known: Thing0" in str(UnknownNameError("object", "Zebra", names))
