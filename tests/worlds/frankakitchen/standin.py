"""A kitchen that stands in for FrankaKitchen's assets: the arm's lengths, a box for each fixture.

Joints, sites, places and ranges are those of the real model; masses, meshes and contacts are not.
"""

from __future__ import annotations

from pathlib import Path

TURN, BACK = "0.707107 0.707107 0 0", "0.707107 -0.707107 0 0"
LINKS = (  # position, turn, lowest and highest angle: the Franka arm's published lengths
    ("0 0 0.333", "1 0 0 0", -2.8973, 2.8973),
    ("0 0 0", BACK, -1.7628, 1.7628),
    ("0 -0.316 0", TURN, -2.8973, 2.8973),
    ("0.0825 0 0", TURN, -3.0718, -0.4),
    ("-0.0825 0.384 0", BACK, -2.8973, 2.8973),
    ("0 0 0", TURN, -1.6573, 2.1127),
    ("0.088 0 0", TURN, -2.8973, 2.8973),
)
FIXTURES = (  # joint, kind, axis, range, where it is handled, where it turns
    ("microwave", "hinge", "0 0 1", "-2.094 0", (-0.642, 0.492, 1.792), (-1.13, 0.45, 1.79)),
    ("right_hinge_cabinet", "hinge", "0 0 1", "0 1.57", (-0.526, 0.582, 2.6), (-0.22, 0.71, 2.6)),
    ("slide_cabinet", "slide", "1 0 0", "0 0.44", (-0.108, 0.607, 2.6), (0.08, 0.73, 2.6)),
    ("light_switch", "hinge", "0 0 1", "-0.7 0", (-0.369, 0.616, 2.28), (-0.4, 0.69, 2.28)),
    ("knob_Joint_1", "hinge", "0 1 0", "-1.57 0", (-0.133, 0.64, 2.226), (-0.133, 0.68, 2.226)),
    ("knob_Joint_2", "hinge", "0 1 0", "-1.57 0", (-0.256, 0.64, 2.226), (-0.256, 0.68, 2.226)),
    ("knob_Joint_3", "hinge", "0 1 0", "-1.57 0", (-0.133, 0.64, 2.34), (-0.133, 0.68, 2.34)),
    ("knob_Joint_4", "hinge", "0 1 0", "-1.57 0", (-0.256, 0.64, 2.34), (-0.256, 0.68, 2.34)),
)
SITES = ("microhandle_site", "hinge_site2", "slide_site", "light_site",
         *(f"knob{k}_site" for k in range(1, 5)))  # fmt: skip
STUCK = "microwave"


def write(folder: Path, stuck: bool = False) -> Path:
    """The model in a folder laid out as the package's; `stuck`: the microwave's door jams."""
    file = folder / "kitchen_franka" / "kitchen_assets" / "kitchen_env_model.xml"
    file.parent.mkdir(parents=True)
    file.write_text(
        '<mujoco><compiler angle="radian"/><option timestep="0.002"/><worldbody>'
        '<body name="panda0_link0" pos="0 0 1.8" euler="0 0 1.57">'
        '<geom type="sphere" size=".05"/>' + _arm() + "</body>"
        + "".join(_fixture(n, stuck) for n in range(len(FIXTURES)))
        + '<body name="kettleroot" pos="-0.27 0.35 1.63"><geom type="sphere" size=".05"/></body>'
        "</worldbody><actuator>" + "".join(
            f'<position joint="arm{k}" kp="{870 if k < 4 else 120}"/>' for k in range(7)
        ) + "</actuator></mujoco>"
    )  # fmt: skip
    return folder


def _arm() -> str:
    opened = "".join(
        f'<body pos="{place}" quat="{turn}"><joint name="arm{k}" axis="0 0 1" '
        f'range="{low} {high}" damping="{100 if k < 4 else 10}"/>'
        '<geom type="sphere" size=".04" mass="1"/>'
        for k, (place, turn, low, high) in enumerate(LINKS)
    )
    return opened + '<site name="end_effector" pos="0 0 0.21"/>' + "</body>" * len(LINKS)


def _fixture(number: int, stuck: bool) -> str:
    joint, kind, axis, span, handle, hinge = FIXTURES[number]
    low, high = span.split()
    arm = " ".join(f"{a - b:.4f}" for a, b in zip(handle, hinge, strict=True))
    place = " ".join(map(str, hinge))
    friction = 500 if stuck and joint == STUCK else 2
    return (
        f'<body pos="{place}"><joint name="{joint}" type="{kind}" axis="{axis}" limited="true" '
        f'range="{low} {high}" damping="2" frictionloss="{friction}"/>'
        f'<geom type="box" size=".03 .03 .03" pos="{arm}" mass="2" contype="0" conaffinity="0"/>'
        f'<site name="{SITES[number]}" pos="{arm}"/></body>'
    )
