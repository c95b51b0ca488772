"""What moves in FrankaKitchen: which joint, by what it is handled, where it stands in which state.

Read by `world`. Joints, sites and goal positions are those of gymnasium-robotics 1.4 (Apache-2.0),
envs/franka_kitchen/kitchen_env.py and its assets.
"""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class Fixture:
    """One thing with a joint.

    Args:
        name: of the instance.
        joint: of the model.
        site: where it is handled.
        attribute: that its joint shows.
        rest: value with the joint at zero.
        moved: value with the joint at `goal`.
        goal: radians, or metres of what slides.
    """

    name: str
    joint: str
    site: str
    attribute: str
    rest: str
    moved: str
    goal: float

    def value(self, position: float) -> str | None:
        """The state at a joint's position, None in between."""
        share = position / self.goal
        return self.rest if share < 0.2 else self.moved if share > 0.8 else None

    def position(self, value: str) -> float:
        """Where the joint stands in a state."""
        return self.goal if value == self.moved else 0.0


FIXTURES = (
    Fixture("Microwave-1", "microwave", "microhandle_site", "open", "closed", "open", -0.75),
    Fixture("HingeCabinet-1", "right_hinge_cabinet", "hinge_site2", "open", "closed", "open", 1.45),
    Fixture("SlideCabinet-1", "slide_cabinet", "slide_site", "open", "closed", "open", 0.37),
    Fixture("LightSwitch-1", "light_switch", "light_site", "turned", "off", "on", -0.69),
    Fixture("BurnerKnob-1", "knob_Joint_1", "knob1_site", "turned", "off", "on", -0.88),
    Fixture("BurnerKnob-2", "knob_Joint_2", "knob2_site", "turned", "off", "on", -0.88),
    Fixture("BurnerKnob-3", "knob_Joint_3", "knob3_site", "turned", "off", "on", -0.92),
    Fixture("BurnerKnob-4", "knob_Joint_4", "knob4_site", "turned", "off", "on", -0.92),
)

SKILLS = {
    "swing_open": ("open", "open", ("Microwave", "HingeCabinet")),
    "swing_shut": ("open", "closed", ("Microwave", "HingeCabinet")),
    "slide_open": ("open", "open", ("SlideCabinet",)),
    "slide_shut": ("open", "closed", ("SlideCabinet",)),
    "turn_on": ("turned", "on", ("LightSwitch", "BurnerKnob")),
    "turn_off": ("turned", "off", ("LightSwitch", "BurnerKnob")),
}
"""Skill → attribute, value that it brings about, categories that it handles."""
