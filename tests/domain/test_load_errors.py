"""Whatever is wrong in a domain file is one sentence with file, line and the nearest name."""

from __future__ import annotations

from pathlib import Path

import pytest

from forestall.domain.load import load_domain
from forestall.errors import DomainError, FileFormatError, InputError, UnknownNameError
from forestall.types.plan import Plan

GOOD = """\
name = "bench"
tags = ["movable", "fixture"]

[robot]
hands = ["hand"]

[predicates.on]
kind = "relation"
parameters = ["thing", "place"]
contains = true

[predicates.held_by]
kind = "relation"
parameters = ["thing", "hand"]

[predicates.clear]
kind = "derived"
parameters = ["thing"]
definition = "not some ?y: on(?y, ?thing)"

[predicates.takes]
kind = "static"
parameters = ["place", "thing"]

[attributes.power]
values = ["off", "on"]

[attributes.warmth]
values = ["cold", "warm"]

[categories.Peg]
tags = ["movable"]
attributes = ["warmth"]

[categories.Tray]
tags = ["fixture"]
attributes = ["power", "warmth"]
takes = ["Peg"]

[skills.grasp]
parameters = ["object - movable"]
needs = [{ fact = "clear(?object)", else = "something is on {object}" }]
effects = ["held_by(?object, hand)"]
at = "object"

[skills.switch]
parameters = ["target"]
needs = ["has_power(?target)"]
effects = ["power(?target)=on"]

[processes.heat]
parameters = ["tray", "thing"]
when = "power(?tray)=on and on(?thing, ?tray)"
effects = ["warmth(?thing)=warm"]

[safety.left_on]
every = ["tray - Tray"]
never = "power(?tray)=on"
when = "leaving"
"""

TWO_THAT_UNDO = """[processes.cool]
parameters = ["x"]
when = "warmth(?x)=warm"
effects = ["warmth(?x)=cold"]

[processes.warm]
parameters = ["x"]
when = "warmth(?x)=cold"
effects = ["warmth(?x)=warm"]

[safety.left_on]"""

CASES = """
unknown category
takes = ["Pegg"] <- takes = ["Peg"]
Pegg
unknown category in takes of Tray 'Pegg': did you mean Peg?

unknown kind
"object - moveable" <- "object - movable"
moveable
unknown kind of ?object in skill grasp 'moveable': did you mean movable?

unknown tag
tags = ["fixtur"] <- tags = ["fixture"]
fixtur"
unknown tag of Tray 'fixtur': did you mean fixture?

need over an unbound variable
clear(?objekt) <- clear(?object)
?objekt
unknown variable in need of skill grasp: nothing binds it: '?objekt': did you mean ?object?

effect on a derived predicate
"clear(?object)"] <- "held_by(?object, hand)"]
[skills.grasp]
effect of skill grasp: clear(?object): clear is derived and cannot be changed: change what it is

effect on a static predicate
"takes(?object, ?object)"] <- "held_by(?object, hand)"]
[skills.grasp]
effect of skill grasp: takes(?object, ?object): takes is static and cannot be changed

cyclic derivation
on(?y, ?thing) and clear(?y)" <- on(?y, ?thing)"
[predicates.clear]
definition of clear is cyclic: it depends on its own opposite (clear -> clear)

process that never settles
TWO_THAT_UNDO <- [safety.left_on]
[processes.cool]
process cool and warm: never settles: warmth(?x)=cold and warmth(?x)=warm follow each other

unknown predicate
claer(?object) <- clear(?object)
claer
unknown predicate in need of skill grasp 'claer': did you mean clear?

unknown value
power(?target)=onn <- power(?target)=on
onn
unknown value of power in effect of skill switch 'onn': did you mean on?

number of arguments
clear(?object, ?object) <- clear(?object)
[skills.grasp]
need of skill grasp: clear(?object, ?object): clear takes 1 argument(s)

text that is no formula
"has_power(?target" <- "has_power(?target)"
[skills.switch]
cannot read 'has_power(?target': ',' is expected at the end

unknown field
att = "object" <- at = "object"
att =
unknown field of skill grasp 'att': did you mean at?

unknown role
[roles] holding <- [robot]
"held"
unknown predicate in roles.holding 'held': did you mean held_by?

skill of the robot
[robot] skills <- hands = ["hand"]
"grasps"
unknown skill of the robot 'grasps': did you mean grasp?

tag of a role
[roles] support <- [robot]
"moveable"
unknown tag in roles.movable 'moveable': did you mean movable?

tag of a role that is called as usual and is no tag
[roles] usual <- [robot]
"support"
unknown tag in roles.support 'support': known: fixture, movable

tag of what offers a relation
offered_by = "fixtur" <- contains = true
fixtur"
unknown tag in offered_by of on 'fixtur': did you mean fixture?

hand in a need
not held_by(?object, hnad)" <- clear(?object)"
hnad
unknown hand, constant or category in need of skill grasp 'hnad': did you mean hand?

hand in an effect
held_by(?object, hnad) <- held_by(?object, hand)
hnad
unknown hand, constant or category in effect of skill grasp 'hnad': did you mean hand?

hand of the robot
hands = ["hnad"] <- hands = ["hand"]
hand)
unknown hand, constant or category in effect of skill grasp 'hand': did you mean hnad?

thing in a definition
on(?y, Trai)" <- on(?y, ?thing)"
Trai
unknown hand, constant or category in definition of clear 'Trai': did you mean Tray?

thing whose number is counted
fewer than room(Trai) of ?y: on(?y, ?target)" <- has_power(?target)"
Trai
unknown hand, constant or category in need of skill switch 'Trai': did you mean Tray?

thing in the condition of a process
on(?thing, Trai) <- on(?thing, ?tray)
Trai
unknown hand, constant or category in process heat 'Trai': did you mean Tray?

thing in a safety rule
never = "on(?tray, Trai-2)" <- never = "power(?tray)=on"
Trai
unknown hand, constant or category in safety rule left_on 'Trai-2': did you mean Tray?

predicate of what would help
lacks predicate <- on {object}" }
claer
unknown predicate in lacks of skill grasp 'claer': did you mean clear?

thing of what would help
lacks thing <- on {object}" }
hnad
unknown hand, constant or category in lacks of skill grasp 'hnad': did you mean hand?

variable of what would help
lacks variable <- on {object}" }
?objekt
unknown variable in lacks of skill grasp: nothing binds it: '?objekt': did you mean ?object?

constant of an unknown category
[constants] tray <- [robot]
"Try"
unknown category of constant tray 'Try': did you mean Tray?

rule about an unknown skill
when = "leavin" <- when = "leaving"
"leavin"
unknown when of safety rule left_on 'leavin': did you mean leaving?
"""
"""Name; what is written in place of what; where the fault is; what is said."""

LONGER = {
    "[robot] skills": 'hands = ["hand"]\nskills = ["grasps"]',
    "[roles] support": '[roles]\nmovable = "moveable"\n\n[robot]',
    "[roles] usual": '[roles]\nmovable = "movable"\nsupport = "support"\n\n[robot]',
    "lacks predicate": 'on {object}", lacks = ["claer(?object)"] }',
    "lacks thing": 'on {object}", lacks = ["held_by(?object, hnad)"] }',
    "lacks variable": 'on {object}", lacks = ["clear(?objekt)"] }',
    "TWO_THAT_UNDO": TWO_THAT_UNDO,
    "[roles] holding": '[roles]\nholding = "held"\n\n[robot]',
    "[constants] tray": '[constants]\ntray = "Try"\n\n[robot]',
}

WRONG = {case[0]: case[1:] for case in (c.strip().split("\n") for c in CASES.split("\n\n"))}


def load(folder: Path, text: str) -> object:
    file = folder / "bench.toml"
    file.write_text(text)
    return load_domain(str(file))


def test_the_file_is_right_before_it_is_made_wrong(tmp_path: Path) -> None:
    assert load(tmp_path, GOOD)


@pytest.mark.parametrize("name", WRONG)
def test_what_is_wrong_is_said_with_its_line(name: str, tmp_path: Path) -> None:
    change, place, said = WRONG[name]
    new, old = change.split(" <- ")
    assert GOOD.count(old) == 1
    text = GOOD.replace(old, LONGER.get(new, new))
    line = text[: text.index(place)].count("\n") + 1
    with pytest.raises(DomainError) as raised:
        load(tmp_path, text)
    assert str(raised.value).startswith(f"{tmp_path / 'bench.toml'}, line {line}: {said}")
    assert "\n" not in str(raised.value)


def test_two_skills_of_one_name_are_no_toml(tmp_path: Path) -> None:
    with pytest.raises(FileFormatError, match=r"bench.toml: not valid TOML: .*line \d+"):
        load(tmp_path, GOOD + "\n[skills.grasp]\nparameters = []\n")


def test_a_skill_that_the_robot_lacks_is_no_step_of_a_plan(tmp_path: Path) -> None:
    file = tmp_path / "household.toml"
    file.write_text(
        'name = "small"\n[robot]\nskills = ["pick_up"]\n[skills.pick_up]\nparameters = ["object"]\n'
        '[skills.put_on]\nparameters = ["object", "target"]\n'
    )
    domain = load_domain(str(file))
    plan = Plan.parse(["pick_up(Peg)", "put_on(Peg, Tray)"])
    with pytest.raises(InputError, match=r"step 2, put_on\(Peg, Tray\): unknown skill of the robot "
                       r"of small 'put_on': .*known: pick_up"):  # fmt: skip
        domain.check_plan(plan)


def test_no_such_domain_or_file(tmp_path: Path) -> None:
    with pytest.raises(UnknownNameError, match=r"'houshold': did you mean household\?"):
        load_domain("houshold")
    with pytest.raises(FileFormatError, match="cannot read domain file"):
        load_domain(str(tmp_path / "none.toml"))
