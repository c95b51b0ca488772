"""Task and scenario files: the shipped ones are sound, and wrong ones are named."""

from pathlib import Path

import pytest

from forestall.assembly.configuration import run_config
from forestall.assembly.make import prepare
from forestall.errors import FileFormatError, InputError, UnknownNameError
from forestall.tasks.files import (
    load_scenario,
    load_task,
    long_task_names,
    scenario_names,
    schemas,
    task_names,
)
from forestall.worlds.kitchen.catalogue import catalogue

TASKS = {
    "heat-potato",
    "make-coffee",
    "boil-water",
    "toast-bread",
    "cook-egg",
    "make-salad",
    "store-egg",
    "water-plant",
    "switch-devices",
    "warm-water",
}
SCENARIOS = {
    "microwave-occupied",
    "plate-dirty",
    "microwave-left-closed",
    "coffee-machine-occupied",
    "mug-dropped",
    "pan-dirty",
    "potato-in-pan",
    "burner-occupied",
    "bowl-filled-with-wine",
    "knife-blocked",
}

OWN = """
name = "fetch-ladle"
title = "Fetch the ladle"
plan = ["pick_up(Ladle)", "put_on(Ladle, DiningTable)"]

[goal]
text = "The ladle lies on the dining table."
variables = { "?ladle" = "Ladle" }
all = ["on_top_of(?ladle, DiningTable)"]

[scene]
clutter = [0, 2]

[[scene.objects]]
category = "Ladle"
places = ["CounterTop"]

[categories.Ladle]
words = "ladle"
tags = ["pickupable"]
attributes = ["dirty"]
size_m = [0.28, 0.06, 0.04]
world = { shape = { kind = "box" } }
"""


def test_the_shipped_files_are_all_there_and_load() -> None:
    assert set(task_names()) == TASKS
    assert set(scenario_names()) >= SCENARIOS
    for name in scenario_names():
        scenario = load_scenario(name)
        assert scenario.task in TASKS | set(long_task_names())
        assert scenario.name == name
    for name in task_names():
        assert load_task(name).task.name == name


def test_a_task_of_ones_own_with_an_object_of_ones_own(tmp_path: Path) -> None:
    path = tmp_path / "fetch-ladle.toml"
    path.write_text(OWN)
    loaded = load_task(str(path))
    assert loaded.domain.accepts("CounterTop-1", "Ladle-1")
    assert loaded.task.scene.objects[0].id == "Ladle-1"
    assert str(loaded.task.goal.literals[0]) == "on_top_of(?ladle, DiningTable)"


@pytest.mark.parametrize(
    ("old", "new", "error", "says"),
    [
        ("title =", "titel =", FileFormatError, "titel"),
        ("pick_up(Ladle)", "grab(Ladle)", InputError, "unknown skill 'grab'"),
        ("pick_up(Ladle)", "pick_up(Spoon)", InputError, "unknown object category 'Spoon'"),
        ("clutter = [0, 2]", "clutter = [3, 2]", InputError, "least, most"),
        ("on_top_of(?ladle", "on_top_of(?spoon", InputError, "goal variable"),
        ("on_top_of(?ladle", "onto(?ladle", InputError, "predicate in goal 'onto'.*on_top_of"),
        ('attributes = ["dirty"]', 'attributes = ["wet"]', InputError, "wet"),
        ('places = ["CounterTop"]', 'places = ["Bench"]', InputError, "Bench"),
        ("[goal]", "[goal", FileFormatError, "not valid TOML"),
        ('name = "fetch-ladle"', 'name = "Fetch Ladle"', FileFormatError, "name"),
    ],
)
def test_wrong_task_files(
    tmp_path: Path, old: str, new: str, error: type[Exception], says: str
) -> None:
    assert old in OWN
    path = tmp_path / "own.toml"
    path.write_text(OWN.replace(old, new, 1))
    with pytest.raises(error, match=says):
        load_task(str(path))


@pytest.mark.parametrize(
    ("text", "says"),
    [
        ('[[faults]]\nkind = "explode"\n', "faults"),
        ('[[faults]]\nkind = "drop"\nstep = "navigate_to_obj(Mug)"\nwhere = 3\n', "where"),
        ("faults = []\n", "faults"),
    ],
)
def test_wrong_scenario_files(tmp_path: Path, text: str, says: str) -> None:
    path = tmp_path / "own.toml"
    head = 'name = "own"\ntask = "make-coffee"\ntitle = "t"\nkind = "drop"\ncause = "c"\n'
    path.write_text(head + text)
    with pytest.raises(FileFormatError, match=says):
        load_scenario(str(path))


def test_unknown_names_come_with_near_ones(tmp_path: Path) -> None:
    with pytest.raises(UnknownNameError, match="did you mean heat-potato"):
        load_task("heat-potatoe")
    with pytest.raises(UnknownNameError, match="did you mean mug-dropped"):
        load_scenario("mug-droped")
    with pytest.raises(FileFormatError, match="cannot read task file"):
        load_task(str(tmp_path / "absent.toml"))


RIPE = """
name = "fetch-tomato"
title = "Fetch a ripe tomato"
plan = ["pick_up(Tomato)", "put_on(Tomato, DiningTable)"]

[goal]
text = "A ripe tomato lies on the dining table."
variables = { "?tomato" = "Tomato" }
all = ["on_top_of(?tomato, DiningTable)", "ripe(?tomato)=ripe"]

[[scene.objects]]
category = "Tomato"
states = { ripe = "ripe" }

[attributes.ripe]
values = ["unripe", "ripe"]
phrases = { unripe = ["a green {thing}"], ripe = ["a red {thing}"] }

[attributes.open.phrases]
open = ["a {thing} ajar"]

[categories.Tomato]
attributes = ["ripe"]
synonyms = ["love apple"]
"""


def test_a_task_with_an_attribute_of_its_own(tmp_path: Path) -> None:
    path = tmp_path / "own.toml"
    path.write_text(RIPE, encoding="utf-8")
    loaded = load_task(str(path))
    words = loaded.domain
    assert words["Tomato"].attributes == ("sliced", "temperature", "ripe")
    assert words["Tomato"].synonyms[-1] == "love apple"
    assert words.static("slices_into", "Tomato", "TomatoSliced")
    assert words.phrases("Tomato", "ripe", "ripe") == ("a red tomato",)
    assert words.phrases("Fridge", "open", "open") == ("a fridge ajar",)
    assert loaded.task.scene.objects[0].states == (("ripe", "ripe"),)
    assert str(loaded.task.goal.literals[1]) == "ripe(?tomato)=ripe"
    assert "ripe" not in load_task("make-salad").domain.attributes


@pytest.mark.parametrize(
    ("old", "new", "says"),
    [
        ('values = ["unripe", "ripe"]', 'values = ["ripe"]', "attribute ripe: values must name"),
        ("values = [", "colour = [", "unknown field of attribute ripe 'colour': known:.*values"),
        ("unripe = [", "rotten = [", "'rotten': known: ripe, unripe"),
        ("a green {thing}", "зелёный {thing}", "attribute ripe: phrases.unripe.*Latin letters"),
        ("a green {thing}", "", "phrases.unripe: '' is empty"),
        ('["a green {thing}"]', '"green"', "attributes.ripe.phrases.unripe.*list"),
        ("[attributes.ripe]", "[attributes.near]", "name of a relation"),
        ("[attributes.ripe]", "[attributes.pour]", "name of a skill"),
        ("[attributes.ripe]", "[attributes.located]", "name of a built-in fact"),
        ("open = [", "ajar = [", "'ajar': known: closed, open"),
        (
            '[attributes.open.phrases]\nopen = ["a {thing} ajar"]',
            '[attributes.open]\nvalues = ["closed", "ajar"]',
            r"attribute open exists: its values \(closed, open\)",
        ),
        ('attributes = ["ripe"]', 'attributes = ["rype"]', "'rype': did you mean ripe"),
        ('{ ripe = "ripe" }', '{ ripe = "rotten" }', "ripe of Tomato 'rotten'"),
        ("ripe(?tomato)=ripe", "ripe(?tomato)=red", "value of ripe in goal 'red'"),
        ('synonyms = ["love apple"]', 'synonyms = [""]', "synonyms: '' is empty"),
    ],
)
def test_wrong_attributes_of_task_files(tmp_path: Path, old: str, new: str, says: str) -> None:
    assert old in RIPE
    path = tmp_path / "own.toml"
    path.write_text(RIPE.replace(old, new, 1), encoding="utf-8")
    with pytest.raises(InputError, match=says) as caught:
        load_task(str(path))
    assert str(path) in str(caught.value)


def test_the_schemas_name_every_field() -> None:
    both = schemas()
    assert {"name", "plan", "goal", "scene", "categories"} <= set(both["task"]["properties"])
    fields = both["task"]["$defs"]["AttributeFile"]
    known = {"values", "bins", "unit", "phrases", "camera", "by_category"}
    assert set(fields["properties"]) == known
    assert fields["additionalProperties"] is False
    assert "faults" in both["scenario"]["properties"]


@pytest.mark.parametrize(
    ("fault", "says"),
    [
        ('kind = "drop"\nstep = "navigate_to_obj(Unicorn)"', "Unicorn"),
        ('kind = "drop"\nstep = "pour(Mug, Fridge)"', "comes 0 time"),
        ('kind = "wrong_object"\nstep = "pick_up(Mug)"\nacts_on = "Unicorn"', "Unicorn"),
        ('kind = "replace_plan"\nplan = ["pick_up(Unicorn)"]', "Unicorn"),
        ('kind = "add_object"\ncategory = "Unicorn"', "Unicorn"),
        ('kind = "drop_step"\nstep = "open_obj(Microwave)"', "open_obj"),
    ],
)
def test_what_a_scenario_names_is_checked_before_anything_runs(
    tmp_path: Path, fault: str, says: str
) -> None:
    path = tmp_path / "own.toml"
    head = 'name = "own"\ntask = "make-coffee"\ntitle = "t"\nkind = "drop"\ncause = "c"\n'
    path.write_text(f"{head}[[faults]]\n{fault}\n")
    with pytest.raises(InputError, match=says):
        prepare(run_config("make-coffee", str(path)))


def test_moments_that_the_plan_has_not_are_refused_before_anything_runs(tmp_path: Path) -> None:
    path = tmp_path / "mine.toml"
    text = """
name = "mine"
task = "heat-potato"
title = "t"
kind = "dirty"
cause = "c"
known = "navigate_to_obj(Potato)"
effect = "{effect}"
[[faults]]
kind = "set_state"
object = "Plate"
attribute = "dirty"
value = "dirty"
"""
    for effect, what in (("pick_up(Mug)", "0 time"), ("pick_up(Plate) #3", "2 time")):
        path.write_text(text.format(effect=effect))
        with pytest.raises(InputError, match=what):
            prepare(run_config("heat-potato", str(path)))
    path.write_text(text.format(effect="pick_up(Plate) #2"))
    prepared = prepare(run_config("heat-potato", str(path)))
    assert prepared.scenario is not None
    assert prepared.scenario.moments(prepared.plan) == (0, 7)


@pytest.mark.parametrize(
    ("old", "new", "says"),
    [
        ("clutter = [0, 2]", f"clutter = [0, {10**300}]", "scene.clutter.* more than 64 bit"),
        ("clutter = [0, 2]", "clutter = [0, 1000]", "scene.clutter.1: Input should be less than"),
        ("clutter = [0, 2]", "clutter = [0, 2.0]", "scene.clutter.1"),
        ('words = "ladle"', "words = 7", "category Ladle: words"),
        ("size_m = [0.28", 'size_m = ["<script>"', "categories.Ladle.size_m.0"),
        ("size_m = [0.28", "size_m = [nan", r"categories.Ladle.size_m\[0\]: a finite number"),
        ('tags = ["pickupable"]', "tags = [2026-01-01]", "a date or time"),
        ('attributes = ["dirty"]', "attributes = {}", "categories.Ladle.attributes"),
        ('places = ["CounterTop"]', "places = [[]]", "scene.objects.0.places.0"),
    ],
)
def test_values_of_another_type_are_refused_with_their_place(
    old: str, new: str, says: str, tmp_path: Path
) -> None:
    assert OWN.count(old) == 1
    file = tmp_path / "own.toml"
    file.write_text(OWN.replace(old, new))
    with pytest.raises(InputError, match=says) as caught:
        load_task(str(file))
    assert str(caught.value).startswith(str(file))


@pytest.mark.parametrize("size", ["1", '[0.28, "x", 0.04]', "[0, 1, 1]", "[0.1, 0.1]", "[9, 9, 9]"])
def test_a_shape_that_cannot_be_built_is_refused_before_anything_is(
    size: str, tmp_path: Path
) -> None:
    file = tmp_path / "own.toml"
    text = OWN.replace("size_m = [0.28, 0.06, 0.04]\n", "")
    file.write_text(text.replace('{ kind = "box" }', f'{{ kind = "box", size_m = {size} }}'))
    domain = load_task(str(file)).domain
    with pytest.raises(InputError, match="category Ladle: size_m is width, depth and height"):
        catalogue(domain)


def test_a_goal_that_nothing_can_meet_is_refused_when_it_is_read(tmp_path: Path) -> None:
    file = tmp_path / "knob.toml"
    file.write_text(
        'name = "knob"\ntitle = "Knob"\nplan = ["toggle_on(StoveKnob)"]\n'
        '[goal]\ntext = "A knob is on."\nall = ["toggled(StoveKnob)=on"]\n',
        encoding="utf-8",
    )
    with pytest.raises(InputError, match=r"nothing can meet it, for StoveKnob has no toggled"):
        load_task(str(file))
