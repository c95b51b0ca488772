"""The kitchen as the world part of a run."""

from __future__ import annotations

import pytest

from forestall.domain.load import shipped
from forestall.errors import InputError, UnknownNameError
from forestall.types.scene import SceneNeeds
from forestall.worlds.kitchen import environment as environments
from forestall.worlds.kitchen.environment import KitchenEnvironment
from forestall.worlds.kitchen.part import Kitchens, NamesOption, Profile


def test_an_unknown_renderer_is_named_before_a_kitchen_is_built() -> None:
    with pytest.raises(UnknownNameError, match="did you mean embree"):
        Kitchens("embre")


def test_frames_are_remembered_only_where_many_runs_follow(monkeypatch: pytest.MonkeyPatch) -> None:
    made: list[object] = []
    real = KitchenEnvironment

    def environment(*args: object, frames: object, **rest: object) -> object:
        made.append(frames)
        return real(*args)  # type: ignore[arg-type]

    monkeypatch.setattr(environments, "KitchenEnvironment", environment)
    kitchens = Kitchens()
    for remember in (False, True, True):
        with kitchens.open(SceneNeeds(), shipped("household"), remember) as opened:
            assert opened.environment is opened.disturbance
    assert made[0] is None
    assert made[1] is made[2] is not None


def test_a_domain_without_the_kitchens_words_is_refused_and_told_another_world() -> None:
    assert Kitchens.simulates(shipped("household"))
    assert not Kitchens.simulates(shipped("bench"))
    with (
        pytest.raises(InputError, match=r"kitchen does not simulate.*bench.*filled.*symbolic"),
        Kitchens().open(SceneNeeds(), shipped("bench")),
    ):
        pass


def test_it_says_what_of_it_works_here() -> None:
    found = Kitchens().check()
    assert [w.needed for w in found] == [True, *[False] * (len(found) - 1)]
    assert {w.what for w in found[1:]} >= {"renderer embree", "renderer rays"}


@pytest.mark.parametrize(
    ("profile", "names", "shared"),
    [
        (Profile.KIND, NamesOption.PROFILE, True),
        (Profile.KIND, NamesOption.OWN, False),
        (Profile.HONEST, NamesOption.PROFILE, False),
        (Profile.HONEST, NamesOption.SHARED, True),
    ],
)
def test_whose_names_things_bear_is_an_option(
    profile: Profile, names: NamesOption, shared: bool
) -> None:
    kitchens = Kitchens(profile=profile, names=names)
    with kitchens.open(SceneNeeds(), shipped("household")) as opened:
        assert opened.shares_names is shared
