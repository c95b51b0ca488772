"""A tiny flat and programs in the layout of the two packages, written by the tests."""

import json
from pathlib import Path
from typing import Any

ME, KITCHEN, FRIDGE, PLATE, LAMP, CUP = 1, 2, 3, 4, 5, 6
GROUP = "dataset/programs_processed_precond_nograb_morepreconds"
SCENE = "TrimmedTestScene1_graph/results"


def node(
    number: int, name: str, *properties: str, states: tuple[str, ...] = (), category: str = ""
) -> dict[str, Any]:
    return {
        "id": number,
        "class_name": name,
        "category": category or "Props",
        "properties": list(properties),
        "states": list(states),
        "prefab_name": None,
        "bounding_box": None,
    }


def graph() -> dict[str, Any]:
    """A kitchen with a closed fridge, in which a plate is, a lamp and a cup."""
    things = [
        node(ME, "character", category="Characters"),
        node(KITCHEN, "kitchen", category="Rooms"),
        node(FRIDGE, "fridge", "CAN_OPEN", "CONTAINERS", states=("CLOSED", "CLEAN")),
        node(PLATE, "plate", "GRABBABLE", states=("DIRTY",)),
        node(LAMP, "lamp", "HAS_SWITCH", "HAS_PLUG", states=("OFF", "PLUGGED_IN")),
        node(CUP, "cup", "GRABBABLE", "RECIPIENT", states=("CLEAN",)),
    ]
    edges = [(n, "INSIDE", KITCHEN) for n in (ME, FRIDGE, PLATE, LAMP, CUP)]
    edges += [(PLATE, "INSIDE", FRIDGE), (PLATE, "CLOSE", FRIDGE), (FRIDGE, "CLOSE", PLATE)]
    return {
        "nodes": things,
        "edges": [{"from_id": a, "relation_type": r, "to_id": b} for a, r, b in edges],
    }


FETCH = f"""Fetch a plate
go and get it


[WALK] <fridge> (1.{FRIDGE})
[OPEN] <fridge> (1.{FRIDGE})
[FIND] <plate> (1.{PLATE})
[GRAB] <plate> (1.{PLATE})
"""

LIGHT = f"""Light
on

[WALK] <kitchen> (1.{KITCHEN})
[FIND] <lamp> (1.{LAMP})
[SWITCHON] <lamp> (1.{LAMP})
"""

PDDL = """(define (domain tiny)
  (:requirements :typing)
  (:types object character)
  (:predicates
    (closed ?obj - object) (open ?obj - object) (on ?obj - object) (off ?obj - object)
    (plugged_in ?obj - object) (plugged_out ?obj - object) (clean ?obj - object)
    (dirty ?obj - object) (sitting ?char - character) (lying ?char - character)
    (grabbable ?obj - object) (can_open ?obj - object) (containers ?obj - object)
    (surfaces ?obj - object) (person ?obj - object)
    (holds_rh ?char - character ?obj - object) (holds_lh ?char - character ?obj - object)
    (next_to ?char - character ?obj - object) (on_char ?obj - object ?char - character)
    (obj_next_to ?obj1 ?obj2 - object) (obj_inside ?obj1 ?obj2 - object)
    (obj_ontop ?obj1 ?obj2 - object))
  (:action walk_towards :parameters (?char - character ?obj - object)
    :precondition (not (sitting ?char))
    :effect (and (next_to ?char ?obj)
      (forall (?near - object) (when (obj_next_to ?near ?obj) (next_to ?char ?near)))))
  (:action find :parameters (?char - character ?obj - object)
    :precondition (next_to ?char ?obj) :effect ())
  (:action open :parameters (?char - character ?obj - object)
    :precondition (and (can_open ?obj) (closed ?obj) (next_to ?char ?obj) (not (on ?obj)))
    :effect (and (open ?obj) (not (closed ?obj))))
  (:action close :parameters (?char - character ?obj - object)
    :precondition (and (can_open ?obj) (open ?obj))
    :effect (and (closed ?obj) (not (on ?obj))))
  (:action standup :parameters (?char - character)
    :precondition (or (sitting ?char) (lying ?char))
    :effect (and (not (sitting ?char)) (not (lying ?char))))
  (:action grab :parameters (?char - character ?obj - object)
    :precondition (and (grabbable ?obj) (next_to ?char ?obj)
      (not (exists (?box - object) (and (obj_inside ?obj ?box) (closed ?box))))
      (not (and (exists (?a - object) (holds_lh ?char ?a))
                (exists (?b - object) (holds_rh ?char ?b)))))
    :effect (holds_rh ?char ?obj)))
"""


def installed(folder: Path, programs: dict[str, str], start: Any = None) -> Path:
    """A folder as if both packages had been installed in it, without what executes."""
    data = folder / "virtualhome_eval"
    for name, text in programs.items():
        program = data / GROUP / "executable_programs" / SCENE / f"{name}.txt"
        graphs = data / GROUP / "init_and_final_graphs" / SCENE / f"{name}.json"
        for place in (program, graphs):
            place.parent.mkdir(parents=True, exist_ok=True)
        program.write_text(text)
        graphs.write_text(json.dumps({"init_graph": start or graph(), "final_graph": graph()}))
    pddl = data / "resources/virtualhome/virtualhome.pddl"
    pddl.parent.mkdir(parents=True, exist_ok=True)
    pddl.write_text(PDDL)
    (folder / "virtualhome").mkdir(exist_ok=True)
    return folder
