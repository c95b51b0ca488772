"""Plans that the validator must reject, each with the step and the reason."""

from __future__ import annotations

from dataclasses import dataclass

from forestall.types.graph import SceneGraph
from forestall.types.plan import Plan
from forestall.types.task import Goal
from planning.corpus import (
    BOIL_WATER,
    COOK_EGG,
    HEAT_POTATO,
    KITCHEN,
    LIVING_ROOM,
    MAKE_COFFEE,
    MAKE_SALAD,
    PLANS,
    SWITCH_DEVICES,
    goal,
    plan,
    scene,
)

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
