"""Small worked cases: scenes in words, goals, and plans that are right.

Shared by the tests of planning, replanning and diagnosis. A scene is text, one fact a line or
separated by commas: `Mug-1 on CounterTop-1`, `Egg-1 in Fridge-1`, `Pot-1 blocks Knife-1`,
`Mug-1 held`, `Plate-1 is dirty`, `Mug-1 lost`, `Fridge-1 hidden`, or a bare name.
"""

from __future__ import annotations

from forestall.domain.load import shipped
from forestall.types.facts import GRIPPER, Literal, category_of
from forestall.types.graph import Box, ObjectNode, Relation, SceneGraph
from forestall.types.plan import Plan
from forestall.types.task import Goal

DOMAIN = shipped("household")
_PREDICATES = {"on": "on_top_of", "in": "inside", "blocks": "blocking"}
_BOX = Box((0.0, 0.0, 0.0), (0.1, 0.1, 0.1))


def scene(*texts: str) -> SceneGraph:
    """A graph from text; later facts override earlier ones. States not named are the defaults."""
    states: dict[str, dict[str, str | None]] = {}
    places: dict[str, Relation] = {}
    blocking: set[Relation] = set()
    lost: set[str] = set()
    hidden: set[str] = set()
    held = None

    def known(name: str) -> None:
        states.setdefault(name, dict(DOMAIN.default_states(name)))

    for line in ",".join(texts).replace("\n", ",").split(","):
        words = line.split()
        if not words:
            continue
        known(words[0])
        match words[1:]:
            case []:
                pass
            case ["held"]:
                held = words[0]
                places.pop(words[0], None)
            case ["lost"]:
                lost.add(words[0])
                places.pop(words[0], None)
            case ["hidden"]:
                hidden.add(words[0])
            case ["is", value]:
                attribute = next(a for a, p in DOMAIN.attributes.items() if value in p.values)
                states[words[0]][attribute] = value
            case ["unseen", attribute]:
                states[words[0]][attribute] = None
            case ["blocks", behind]:
                known(behind)
                blocking.add(Relation(words[0], "blocking", behind))
            case [predicate, parent]:
                known(parent)
                places[words[0]] = Relation(words[0], _PREDICATES[predicate], parent)
    nodes = [ObjectNode(GRIPPER, GRIPPER)] + [
        ObjectNode(
            name,
            category_of(name),
            tuple(values.items()),
            centroid_m=None if name in lost else (0.05, 0.05, 0.05),
            box_m=None if name in lost else _BOX,
        )
        for name, values in states.items()
    ]
    relations = [*places.values(), *blocking]
    if held is not None:
        relations.append(Relation(held, "held_by", GRIPPER))
    return SceneGraph(tuple(nodes), tuple(relations), hidden=tuple(hidden))


def goal(*texts: str, never: tuple[str, ...] = (), **variables: str) -> Goal:
    """A goal from literal texts; `mug="Mug"` declares ?mug."""
    return Goal(
        "; ".join(texts),
        tuple((f"?{v}", c) for v, c in variables.items()),
        tuple(map(Literal.parse, texts)),
        tuple(map(Literal.parse, never)),
    )


def plan(text: str) -> Plan:
    """A plan from one subtask a line."""
    return Plan.parse([line for line in text.strip().splitlines() if line.strip()])


KITCHEN = """
    CounterTop-1, CounterTop-2, DiningTable-1, Sink-1, Faucet-1, Fridge-1, Microwave-1
    CoffeeMachine-1, Toaster-1, StoveBurner-1, StoveBurner-2, StoveBurner-3, StoveBurner-4
    Cabinet-1, Drawer-1, GarbageCan-1, Floor-1
    Potato-1 on CounterTop-1, Plate-1 on CounterTop-1, Bowl-1 on CounterTop-1
    Knife-1 on CounterTop-1, Apple-1 on CounterTop-1, Mug-1 on CounterTop-2, Pot-1 on CounterTop-2
    Pan-1 on CounterTop-2, Bread-1 on CounterTop-2, Cup-1 on DiningTable-1
    Lettuce-1 on DiningTable-1, Tomato-1 on DiningTable-1, HousePlant-1 on DiningTable-1
    Egg-1 in Fridge-1
"""

LIVING_ROOM = """
    DiningTable-1, TVStand-1, Shelf-1, FloorLamp-1, Floor-1, Television-1 on TVStand-1
    Laptop-1 on DiningTable-1, RemoteControl-1 on Shelf-1
"""

HEAT_POTATO = goal(
    "on_top_of(?potato, ?plate)",
    "inside(?plate, Microwave)",
    "cooked(?potato)=cooked",
    "dirty(?plate)=clean",
    never=("spoiled(?potato)",),
    potato="Potato",
    plate="Plate",
)
MAKE_COFFEE = goal(
    "filled(?mug)=coffee",
    "dirty(?mug)=clean",
    "on_top_of(?mug, CounterTop)",
    never=("spoiled(?mug)",),
    mug="Mug",
)
COOK_EGG = goal(
    "inside(?egg, ?pan)",
    "cooked(?egg)=cooked",
    "dirty(?pan)=clean",
    never=("spoiled(?egg)",),
    egg="EggCracked",
    pan="Pan",
)
MAKE_SALAD = goal(
    "inside(?lettuce, ?bowl)",
    "inside(?potato, ?bowl)",
    "inside(?tomato, ?bowl)",
    "inside(?bowl, Fridge)",
    "open(Fridge)=closed",
    "dirty(?bowl)=clean",
    "filled(?bowl)=empty",
    never=("spoiled(?lettuce)", "spoiled(?potato)", "spoiled(?tomato)", "spoiled(?bowl)"),
    lettuce="LettuceSliced",
    potato="PotatoSliced",
    tomato="TomatoSliced",
    bowl="Bowl",
)
BOIL_WATER = goal(
    "filled(?pot)=water",
    "on_top_of(?pot, StoveBurner-4)",
    "toggled(StoveBurner-4)=on",
    "temperature(?pot)=hot",
    pot="Pot",
)
TOAST_BREAD = goal(
    "cooked(?slice)=cooked",
    "inside(?slice, Toaster)",
    never=("spoiled(?slice)",),
    slice="BreadSliced",
)
STORE_EGG = goal(
    "inside(?egg, ?bowl)",
    "inside(?bowl, Fridge)",
    "open(Fridge)=closed",
    "broken(?egg)=intact",
    egg="Egg",
    bowl="Bowl",
)
WARM_WATER = goal(
    "filled(?mug)=water",
    "temperature(?mug)=hot",
    "on_top_of(?mug, DiningTable)",
    mug="Mug",
)
WATER_PLANT = goal("filled(?plant)=water", plant="HousePlant")
SWITCH_DEVICES = goal(
    "open(?laptop)=closed",
    "on_top_of(?laptop, TVStand)",
    "toggled(Television)=on",
    laptop="Laptop",
)

PLANS: dict[str, Plan] = {
    "heat-potato": plan("""
        navigate_to_obj(Potato)
        pick_up(Potato)
        put_on(Potato, Plate)
        pick_up(Plate)
        navigate_to_obj(Microwave)
        put_on(Plate, CounterTop)
        open_obj(Microwave)
        pick_up(Plate)
        put_in(Plate, Microwave)
        close_obj(Microwave)
        toggle_on(Microwave)"""),
    "make-coffee": plan("""
        navigate_to_obj(Mug)
        pick_up(Mug)
        navigate_to_obj(Sink)
        put_on(Mug, SinkBasin)
        toggle_on(Faucet)
        toggle_off(Faucet)
        pick_up(Mug)
        pour(Mug, Sink)
        navigate_to_obj(CoffeeMachine)
        put_in(Mug, CoffeeMachine)
        toggle_on(CoffeeMachine)
        toggle_off(CoffeeMachine)
        pick_up(Mug)
        put_on(Mug, CounterTop)"""),
    "cook-egg": plan("""
        navigate_to_obj(Fridge)
        open_obj(Fridge)
        pick_up(Egg)
        close_obj(Fridge)
        navigate_to_obj(StoveBurner-1)
        toggle_on(StoveBurner-1)
        navigate_to_obj(Pan)
        put_on(Egg, CounterTop)
        pick_up(Pan)
        navigate_to_obj(StoveBurner-1)
        put_on(Pan, StoveBurner-1)
        navigate_to_obj(Egg)
        pick_up(Egg)
        navigate_to_obj(Pan)
        crack_obj(Egg)
        put_in(EggCracked, Pan)"""),
    "make-salad": plan("""
        navigate_to_obj(Lettuce)
        pick_up(Lettuce)
        navigate_to_obj(Bowl)
        put_on(Lettuce, CounterTop)
        navigate_to_obj(Tomato)
        pick_up(Tomato)
        navigate_to_obj(Bowl)
        put_on(Tomato, CounterTop)
        navigate_to_obj(Potato)
        pick_up(Potato)
        navigate_to_obj(Bowl)
        put_on(Potato, CounterTop)
        navigate_to_obj(Knife)
        pick_up(Knife)
        navigate_to_obj(Bowl)
        slice_obj(Lettuce)
        slice_obj(Potato)
        slice_obj(Tomato)
        put_on(Knife, CounterTop)
        pick_up(LettuceSliced)
        put_in(LettuceSliced, Bowl)
        pick_up(PotatoSliced)
        put_in(PotatoSliced, Bowl)
        pick_up(TomatoSliced)
        put_in(TomatoSliced, Bowl)
        navigate_to_obj(Fridge)
        open_obj(Fridge)
        navigate_to_obj(Bowl)
        pick_up(Bowl)
        navigate_to_obj(Fridge)
        put_in(Bowl, Fridge)
        close_obj(Fridge)"""),
    "boil-water": plan("""
        navigate_to_obj(Pot)
        pick_up(Pot)
        navigate_to_obj(Sink)
        put_in(Pot, Sink)
        toggle_on(Faucet)
        toggle_off(Faucet)
        pick_up(Pot)
        navigate_to_obj(StoveBurner-4)
        put_on(Pot, StoveBurner-4)
        toggle_on(StoveKnob-4)"""),
    "toast-bread": plan("""
        navigate_to_obj(Knife)
        pick_up(Knife)
        navigate_to_obj(Bread)
        slice_obj(Bread)
        put_on(Knife, CounterTop)
        pick_up(BreadSliced)
        navigate_to_obj(Toaster)
        put_in(BreadSliced, Toaster)
        toggle_on(Toaster)"""),
    "store-egg": plan("""
        navigate_to_obj(Fridge)
        open_obj(Fridge)
        pick_up(Egg)
        navigate_to_obj(Bowl)
        put_in(Egg, Bowl)
        pick_up(Bowl)
        navigate_to_obj(Fridge)
        put_in(Bowl, Fridge)
        close_obj(Fridge)"""),
    "warm-water": plan("""
        pick_up(Mug)
        put_in(Mug, Sink)
        toggle_on(Faucet)
        toggle_off(Faucet)
        pick_up(Mug)
        open_obj(Microwave)
        put_in(Mug, Microwave)
        close_obj(Microwave)
        toggle_on(Microwave)
        toggle_off(Microwave)
        open_obj(Microwave)
        pick_up(Mug)
        put_on(Mug, DiningTable)"""),
    "water-plant": plan("""
        pick_up(Pot)
        put_in(Pot, Sink)
        toggle_on(Faucet)
        toggle_off(Faucet)
        pick_up(Pot)
        navigate_to_obj(HousePlant)
        pour(Pot, HousePlant)"""),
    "switch-devices": plan("""
        close_obj(Laptop)
        pick_up(Laptop)
        put_on(Laptop, TVStand)
        pick_up(RemoteControl)
        navigate_to_obj(Television)
        toggle_on(Television)
        put_on(RemoteControl, TVStand)"""),
}

GOALS: dict[str, Goal] = {
    "heat-potato": HEAT_POTATO,
    "make-coffee": MAKE_COFFEE,
    "cook-egg": COOK_EGG,
    "make-salad": MAKE_SALAD,
    "boil-water": BOIL_WATER,
    "toast-bread": TOAST_BREAD,
    "store-egg": STORE_EGG,
    "warm-water": WARM_WATER,
    "water-plant": WATER_PLANT,
    "switch-devices": SWITCH_DEVICES,
}


def together(*tasks: str) -> Goal:
    """Several tasks of the corpus as one large goal."""
    variables, literals, never = [], [], []
    for task in tasks:
        wanted = GOALS[task]
        names = {v: f"{v}_{task}" for v, _ in wanted.variables}
        variables += [(names[v], c) for v, c in wanted.variables]
        literals += [x.bind(names) for x in wanted.literals]
        never += [x.bind(names) for x in wanted.never]
    return Goal(" and ".join(tasks), tuple(variables), tuple(literals), tuple(never))


LARGE = together("make-salad", "make-coffee", "boil-water", "toast-bread")
LARGE_SCENE = (
    KITCHEN
    + """
    Bowl-1 is wine, Bowl-1 is dirty, Mug-1 is dirty, Cup-1 in CoffeeMachine-1
    Pan-1 on StoveBurner-4, Pot-1 on CounterTop-1, Pot-1 blocks Knife-1
"""
)


def home_of(task: str) -> str:
    """The scene text of a task."""
    return LIVING_ROOM if task == "switch-devices" else KITCHEN
