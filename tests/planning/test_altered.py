"""What a skill may have changed, and nothing else."""

from forestall.planning.altered import altered
from forestall.types.plan import Subtask
from planning.corpus import DOMAIN, scene

SINK = "Mug-1 in Sink-1, Faucet-1, Cup-1 on CounterTop-1, CounterTop-1, Fridge-1"


def after(step: str, *more: str) -> set[tuple[str, str]]:
    return set(altered(scene(SINK, *more), Subtask.parse(step), DOMAIN))


def test_a_tap_fills_what_stands_below_it() -> None:
    found = after("toggle_on(Faucet-1)", "Mug-1 is dirty")
    assert {("Faucet-1", "toggled"), ("Mug-1", "filled"), ("Mug-1", "dirty")} <= found
    assert not any(name == "Cup-1" for name, _ in found)


def test_a_drive_changes_no_state() -> None:
    assert after("navigate_to_obj(Fridge-1)") == set()


def test_what_could_not_run_or_is_not_known_changes_nothing_that_is_known() -> None:
    assert after("open_obj(Mug-1)") == set()
    assert after("polish(Mug-1)") == set()


def test_the_scene_is_left_as_it_was() -> None:
    graph = scene(SINK)
    altered(graph, Subtask.parse("toggle_on(Faucet-1)"), DOMAIN)
    assert graph == scene(SINK)
