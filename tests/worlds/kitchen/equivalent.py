"""What the kitchen cannot show of the domain file, by name and with the reason.

`UNREACHABLE`: cases of `covering.cases` for which there is no situation; a test fails where one is
reached after all, or where the domain no longer has it. `EQUIVALENT`: mutants of `mutants.mutants`
that behave like the whole domain. Keys are patterns over names; the first that fits gives the
reason.
"""

from __future__ import annotations

import re

_LOST = "the kitchen's truth knows where everything is: nothing in it is ever lost"
_LIQUID = "what holds liquid has things inside it, and never on top of it"
_DEVICE = "basins and devices that fill have things inside them, and never on top of them"
_NESTED = "no movable vessel takes another one"
_CAPACITY = "only what is limited has a capacity, and things are only where a place takes them"
_HELD = "a vessel matters, and is chosen, only for an egg that is held"
_PIECE = "whatever is cut or cracked open becomes food"
_FRESH = "a cracked egg has no slices, and an egg in its shell is never cooked"
_ONE = "a burner and a microwave take one thing, and no vessel stands in another"
_SMALL = "a plate takes one thing: two foods lie in a vessel"
_ALIKE = "only the microwave both opens and runs, and it is what works closed only"

_FOOD = "vessels with liquid and washable dishes take nothing but food"

UNREACHABLE: dict[str, str] = {
    r".*: need \d+ alone \[located\(.*": _LOST,
    r"navigate_to_obj: need 1 failed, then met": _LOST,
    r"(pick_up|slice_obj|put_in|put_on): need 3 failed, then met": _LOST,
    r"(open|close|crack)_obj: need 2 failed, then met": _LOST,
    r"toggle_(on|off): need 2 failed, then met": _LOST,
    r"pour: need 5 failed, then met": _LOST,
    r".* not because of \[located\(.*": _LOST,
    r".* not because of \[food\(\?piece\)\]": _PIECE,
    r"crack_obj: effect (4|8|12|16) (happens|only by .*)": _FRESH,
    r"crack_obj: effect (4|8|12|16) not because of \[(dirty|held_by|inside|on_top|takes).*": _FRESH,
    r"(crack|slice)_obj: effect (6|7) happens": _LIQUID,
    r"(crack|slice)_obj: effect (6|7) not because of \[not filled.*": _LIQUID,
    r"crack_obj: effect (14|15) happens": _LIQUID,
    r"crack_obj: effect (14|15) not because of \[not filled.*": _LIQUID,
    r"crack_obj: effect (10|11) not because of \[takes_inside.*": _LIQUID,
    r"crack_obj: effect \d+ not because of \[held_by.*":
        _HELD,
    r"crack_obj: choice \?vessel such that not because of \[\(not limited.*takes_inside.*":
        "no vessel that takes one thing inside takes a cracked egg",
    r"open_obj: need 4 only by \[not needs_closed.*": _ALIKE,
    r"toggle_on: need 4 only by \[not needs_closed.*": _ALIKE,
    r"pour: effect 1 not because of \[not drains.*": "what drains holds no liquid",
    r"pour: effect 2 only by \[on_top_of.*": _LIQUID,
    r"process (brew|run_water): effect 3 only by \[on_top_of.*": _LIQUID,
    r"process (brew|run_water|wash): only by \[on_top_of.*": _DEVICE,
    r"process brew: not because of \[has_filled.*": "a coffee machine takes mugs and cups only",
    r"process cook: effect 2 not because of \[within.*": _ONE,
    r"process cook: effect 3 only by \[on_top_of.*": _SMALL,
    r"put_(in|on): done already not because of \[not held_by.*":
        "what cannot be picked up is never in the gripper",
    r"put_(in|on): effect [345] not because of \[food.*": _FOOD,
    r"put_(in|on): need 5 (alone|failed).*": _NESTED,
    r"put_(in|on): need [89] only by \[not .*": _CAPACITY,
    r"slice_obj: effect [48] (only by \[cooked|not because of \[sliced).*":
        "slices are sliced, cooked or not",
}  # fmt: skip

EQUIVALENT: dict[str, str] = {
    r".*: need \d+ \[located\(.*": _LOST,
    r"toggle_on: done_when: \[located.*": _LOST,
    r"crack_obj: choice \?vessel such_that: \[located.*": _LOST,
    r"put_(in|on): need 5 \[not within.*": _NESTED,
    r"put_(in|on): need [89]: .*\[\(?not .*": _CAPACITY,
    r"crack_obj: choice \?vessel such_that: \[not (limited|takes_).*": _CAPACITY,
    r"put_(in|on): effect 1: when \[takes_inside.*":
        "a thing on top of a place is not inside it: effect 2 takes effect 1 back",
    r"put_(in|on): done_when: \[not held_by.*":
        "what cannot be picked up is never in the gripper",
    r"put_(in|on): effect [345]: when \[food.*": _FOOD,
    r"(crack|slice)_obj: effect \d+: when \[food\(\?piece\)\]": _PIECE,
    r"slice_obj: effect [48]: when \[(sliced|cooked).*cooked\]": "slices are sliced, cooked or not",
    r"crack_obj: effect \d+: when \[held_by\(\?object, gripper\)\]":
        _HELD,
    r"crack_obj: choice \?vessel among 3: \[on_top_of.*":
        "what has room on top of it beside a thing is the outermost thing that it is within",
    r"open_obj: need 4: \[not needs_closed.*": _ALIKE,
    r"toggle_on: need 4: \[not needs_closed.*": _ALIKE,
    r"pour: effect 1: when \[not drains.*": "what drains holds no liquid",
    r"(pour|slice_obj): at":
        "the hand is full then, and the put that must come first changes what is faced",
    r"crack_obj: effect 9: when \[takes_inside.*":
        "a thing on top of a place is not inside it: effect 13 takes effect 9 back",
    r"crack_obj: effect (10|11): when \[takes_inside.*": _LIQUID,
    r"crack_obj: effect (9|1[0-6]): when \[held_by.*":
        _HELD,
    r"crack_obj: choice \?vessel only_if(:.*)?": _HELD,
    r"crack_obj: choice \?vessel such_that: \[(\(not limited.*takes_inside|fewer.*inside).*":
        "no vessel that takes one thing inside takes a cracked egg",
    r"pour: effect 2: kind of \?y - food": _FOOD,
    r"process (run_water|brew|cook): effect 3: kind of \?[yo] - food": _FOOD,
    r"process (wash|run_water|brew): when \[on_top_of.*": _DEVICE,
    r"process (run_water|brew): effect [13]: when \[on_top_of.*": _LIQUID,
    r"process brew: when \[has_filled.*": "a coffee machine takes mugs and cups only",
    r"process heat: kind of .*": "whatever runs and has things in or on it heats them",
    r"process cook: kind of .*": "nothing that cooks gets into a coffee machine",
    r"process cook: effect 2: when \[within.*": _ONE,
    r"process cook: effect 3: when \[on_top_of.*": _SMALL,
    r"(vacant|confined|unblocked|hand_empty): .*": "said in sentences and asked by planners only",
    r"shut: \[encloses.*": "what opens and encloses nothing takes nothing",
    r"process (wash|run_water|soak): kind of \?tap.*": "only a tap serves a basin",
    r"pour: effect 2: when \[on_top_of.*": _LIQUID,
    r"pick_up: effect 2: not blocking\(\?y, \?object\)":
        "nothing stands in front of what can be picked up",
    r"(crack|slice)_obj: effect (6|7)( .*|:.*)?": _LIQUID,
    r"crack_obj: effect (4|8|12|16)(:.*)?": _FRESH,
    r"crack_obj: effect (14|15)(:.*)?": _LIQUID,
}  # fmt: skip


def why_equivalent(name: str) -> str | None:
    """Why nothing can tell a mutant from the whole domain; None where something could."""
    return next((why for pattern, why in EQUIVALENT.items() if re.fullmatch(pattern, name)), None)
