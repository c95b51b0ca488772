"""Small worked cases: scenes in words, plans that are right, plans that are wrong, with the reason.

Shared by the tests of planning, replanning and diagnosis. A scene is text, one fact a line or
separated by commas: `Mug-1 on CounterTop-1`, `Egg-1 in Fridge-1`, `Pot-1 blocks Knife-1`,
`Mug-1 held`, `Plate-1 is dirty`, `Mug-1 lost`, `Fridge-1 hidden`, or a bare name.
"""

from __future__ import annotations

from dataclasses import dataclass

from forestall.types.facts import GRIPPER, Literal, category_of
from forestall.types.graph import Box, ObjectNode, Relation, SceneGraph
from forestall.types.plan import Plan
from forestall.types.task import Goal
from forestall.vocabulary import ATTRIBUTES, household

VOCABULARY = household()
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
        states.setdefault(name, dict(VOCABULARY.default_states(name)))

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
                attribute = next(a for a, v in ATTRIBUTES.items() if value in v)
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


NOTHING = goal("hand_empty()")


@dataclass(frozen=True)
class Wrong:
    """A plan that must be rejected: at which step (None: it runs, but the goal is unmet) and why.

    `lacking` is one of the literals that the step lacks, or one of the unmet goal literals.
    """

    name: str
    scene: SceneGraph
    plan: Plan
    goal: Goal
    step: int | None
    reason: str
    lacking: str | None = None


def _wrong(
    name: str,
    where: str,
    text: str,
    step: int | None,
    reason: str,
    lacking: str | None = None,
    wanted: Goal = NOTHING,
) -> Wrong:
    return Wrong(name, scene(KITCHEN, where), plan(text), wanted, step, reason, lacking)


def _without(steps: Plan, *dropped: str) -> str:
    return "\n".join(t for t in steps.texts() if t not in dropped)


WRONG: tuple[Wrong, ...] = (
    _wrong(
        "microwave closed",
        "",
        _without(PLANS["heat-potato"], "open_obj(Microwave)"),
        7,
        "Microwave-1 is closed",
        "open(Microwave-1)=open",
        HEAT_POTATO,
    ),
    _wrong(
        "microwave occupied",
        "Cup-1 in Microwave-1",
        "\n".join(PLANS["heat-potato"].texts()),
        8,
        "Microwave-1 has no room: it already has Cup-1",
        "vacant(Microwave-1)",
        HEAT_POTATO,
    ),
    _wrong(
        "hand full",
        "Mug-1 held",
        "pick_up(Cup)",
        0,
        "the gripper already holds Mug-1",
        "hand_empty()",
    ),
    _wrong(
        "hand empty",
        "",
        "put_on(Mug, CounterTop)",
        0,
        "Mug-1 is not in the gripper (it is empty)",
        "held_by(Mug-1, gripper)",
    ),
    _wrong("other thing held", "Cup-1 held", "put_in(Mug, CoffeeMachine)", 0, "it holds Cup-1"),
    _wrong(
        "pan into the microwave",
        "Pan-1 held",
        "open_obj(Microwave)\nput_in(Pan, Microwave)",
        1,
        "Microwave-1 does not take Pan",
    ),
    _wrong(
        "pot into the toaster",
        "Pot-1 held",
        "put_in(Pot, Toaster)",
        0,
        "Toaster-1 does not take Pot",
    ),
    _wrong(
        "onto something that holds nothing",
        "Mug-1 held",
        "put_on(Mug, Faucet)",
        0,
        "Faucet-1 does not take Mug",
    ),
    _wrong(
        "burner occupied",
        "Pan-1 on StoveBurner-4",
        "\n".join(PLANS["boil-water"].texts()),
        8,
        "StoveBurner-4 has no room: it already has Pan-1",
        "vacant(StoveBurner-4)",
        BOIL_WATER,
    ),
    _wrong(
        "coffee machine occupied",
        "Cup-1 in CoffeeMachine-1",
        "\n".join(PLANS["make-coffee"].texts()),
        9,
        "CoffeeMachine-1 has no room: it already has Cup-1",
        None,
        MAKE_COFFEE,
    ),
    _wrong(
        "apple on the plate",
        "Apple-1 on Plate-1",
        "pick_up(Potato)\nput_on(Potato, Plate)",
        1,
        "Plate-1 has no room: it already has Apple-1",
    ),
    _wrong(
        "slice without a knife",
        "",
        "slice_obj(Bread)",
        0,
        "no knife is in the gripper",
        "held_by(Knife, gripper)",
    ),
    _wrong("slice with something else", "Mug-1 held", "slice_obj(Bread)", 0, "no knife"),
    _wrong("slice a mug", "Knife-1 held", "slice_obj(Mug)", 0, "Mug-1 cannot be sliced"),
    _wrong(
        "slice inside the closed fridge",
        "Knife-1 held, Lettuce-1 in Fridge-1",
        "slice_obj(Lettuce)",
        0,
        "Lettuce-1 is inside Fridge-1, which is closed",
    ),
    _wrong(
        "pick from the closed fridge",
        "",
        "navigate_to_obj(Fridge)\npick_up(Egg)",
        1,
        "Egg-1 is inside Fridge-1, which is closed",
        "open(Fridge-1)=open",
    ),
    _wrong(
        "pick from a plate in the closed microwave",
        "Plate-1 in Microwave-1, Potato-1 on Plate-1",
        "pick_up(Potato)",
        0,
        "Potato-1 is inside Microwave-1, which is closed",
    ),
    _wrong(
        "turn on an open microwave",
        "",
        "open_obj(Microwave)\ntoggle_on(Microwave)",
        1,
        "Microwave-1 is open and cannot be turned on",
        "open(Microwave-1)=closed",
    ),
    _wrong(
        "open a running microwave",
        "",
        "toggle_on(Microwave)\nopen_obj(Microwave)",
        1,
        "does not open while it runs",
        "toggled(Microwave-1)=off",
    ),
    Wrong(
        "television without remote",
        scene(LIVING_ROOM),
        plan("navigate_to_obj(Television)\ntoggle_on(Television)"),
        SWITCH_DEVICES,
        1,
        "RemoteControl, which is not in the gripper",
        "held_by(RemoteControl, gripper)",
    ),
    Wrong(
        "no such thing here",
        scene(LIVING_ROOM),
        plan("pick_up(Mug)"),
        SWITCH_DEVICES,
        0,
        "no Mug has been seen",
        "located(Mug)",
    ),
    _wrong("unknown object", "", "pick_up(Spaceship)", 0, "there is no object called 'Spaceship'"),
    _wrong("unknown instance", "", "pick_up(Mug-7)", 0, "no Mug-7 has been seen"),
    _wrong(
        "lost mug",
        "Mug-1 lost",
        "navigate_to_obj(Mug)",
        0,
        "its place is not known",
        "located(Mug-1)",
    ),
    _wrong(
        "pick up a cracked egg",
        "EggCracked-1 in Bowl-1",
        "pick_up(EggCracked)",
        0,
        "EggCracked-1 cannot be picked up",
    ),
    _wrong("pick up a fixture", "", "pick_up(Sink)", 0, "Sink-1 cannot be picked up"),
    _wrong("pour from an empty mug", "Mug-1 held", "pour(Mug, Sink)", 0, "Mug-1 is empty"),
    _wrong("pour from a plate", "Plate-1 held", "pour(Plate, Sink)", 0, "holds no liquid"),
    _wrong(
        "pour onto the counter",
        "Mug-1 held, Mug-1 is water",
        "pour(Mug, CounterTop)",
        0,
        "nothing can be poured from Mug-1 into CounterTop-1",
    ),
    _wrong("open what has no door", "", "open_obj(Toaster)", 0, "Toaster-1 cannot be opened"),
    _wrong("turn on a table", "", "toggle_on(DiningTable)", 0, "cannot be turned on or off"),
    _wrong("crack an apple", "", "crack_obj(Apple)", 0, "Apple-1 cannot be cracked"),
    _wrong(
        "blocked knife",
        "Pot-1 on CounterTop-1, Pot-1 blocks Knife-1",
        "navigate_to_obj(Knife)\npick_up(Knife)",
        1,
        "Pot-1 stands in front of Knife-1",
        "unblocked(Knife-1)",
    ),
    _wrong(
        "laptop into the sink",
        "Laptop-1 held",
        "put_in(Laptop, Sink)",
        0,
        "Sink-1 does not take Laptop",
    ),
    _wrong(
        "bowl into itself", "Bowl-1 held", "put_in(Bowl, Bowl-1)", 0, "Bowl-1 does not take Bowl"
    ),
    _wrong(
        "goal unmet: microwave never turned on",
        "",
        _without(PLANS["heat-potato"], "toggle_on(Microwave)"),
        None,
        "goal is not met",
        "cooked(Potato-1)=cooked",
        HEAT_POTATO,
    ),
    _wrong(
        "goal unmet: potato without a plate",
        "",
        "pick_up(Potato)\nopen_obj(Microwave)\nput_in(Potato, Microwave)\n"
        "close_obj(Microwave)\ntoggle_on(Microwave)",
        None,
        "goal is not met",
        "on_top_of(Potato-1, Plate-1)",
        HEAT_POTATO,
    ),
    _wrong(
        "irreversible: egg cooked in a dirty pan",
        "Pan-1 is dirty",
        "\n".join(PLANS["cook-egg"].texts()),
        None,
        "goal is not met",
        "spoiled(EggCracked-1)",
        COOK_EGG,
    ),
    _wrong(
        "irreversible: pan washed after cooking",
        "Pan-1 is dirty",
        "\n".join(PLANS["cook-egg"].texts())
        + "\npick_up(Pan)\nput_in(Pan, Sink)\ntoggle_on(Faucet)\ntoggle_off(Faucet)",
        None,
        "spoiled(EggCracked-1)",
        "spoiled(EggCracked-1)",
        COOK_EGG,
    ),
    _wrong(
        "irreversible: potato left in the pan",
        "Potato-1 in Pan-1",
        "\n".join(PLANS["cook-egg"].texts()),
        None,
        "goal is not met",
        "spoiled(EggCracked-1)",
        COOK_EGG,
    ),
    _wrong(
        "irreversible: salad into wine",
        "Bowl-1 is wine",
        "\n".join(PLANS["make-salad"].texts()),
        None,
        "goal is not met",
        "spoiled(LettuceSliced-1)",
        MAKE_SALAD,
    ),
    _wrong(
        "irreversible: coffee into a dirty mug",
        "Mug-1 is dirty",
        "pick_up(Mug)\nput_in(Mug, CoffeeMachine)\ntoggle_on(CoffeeMachine)\n"
        "toggle_off(CoffeeMachine)\npick_up(Mug)\nput_in(Mug, Sink)\ntoggle_on(Faucet)\n"
        "toggle_off(Faucet)\npick_up(Mug)\nput_on(Mug, CounterTop)",
        None,
        "goal is not met",
        "spoiled(Mug-1)",
        MAKE_COFFEE,
    ),
    _wrong(
        "irreversible: coffee into water",
        "",
        _without(PLANS["make-coffee"], "pour(Mug, Sink)"),
        None,
        "goal is not met",
        "spoiled(Mug-1)",
        MAKE_COFFEE,
    ),
    _wrong(
        "coffee mug left in the machine",
        "",
        _without(PLANS["make-coffee"], "put_on(Mug, CounterTop)"),
        None,
        "goal is not met",
        "on_top_of(Mug-1, CounterTop)",
        MAKE_COFFEE,
    ),
)
