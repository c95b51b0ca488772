"""Packages that do not come with the monitor alone: which extra brings them, told in one sentence.

Called where such a package is first needed, by the listing of parts, and by the command line of one
that was missed; calls nothing. docs/decisions/0013-what-comes-with-it.md says what each extra
weighs, and why.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from importlib.util import find_spec

from forestall.errors import InputError


@dataclass(frozen=True, slots=True)
class Extra:
    """What is installed by one name.

    Args:
        modules: that it brings, besides those of extras in it.
        what: works with it, in a few words.
    """

    modules: tuple[str, ...]
    what: str


EXTRAS: Mapping[str, Extra] = {
    "perception": Extra(("scipy", "onnxruntime"), "scene graphs from RGB-D, states off pixels"),
    "figures": Extra(("matplotlib",), "figures of calibrations and experiments"),
    "kitchen": Extra(("mujoco", "embreex"), "the embedded household, and experiments in it"),
    "ai2thor": Extra(("ai2thor",), "AI2-THOR, --world ai2thor"),
    "cluster": Extra(("ray",), "experiments on a cluster, --engine ray"),
    "mcap": Extra(("mcap", "mcap_ros2"), "logs in MCAP, import mcap and run --log mcap:FILE"),
    "lerobot": Extra(("pyarrow", "av"), "LeRobot data sets, import lerobot"),
    "llm": Extra(("openai",), "language models, --llm"),
    "planning": Extra(("unified_planning", "up_fast_downward"), "cross-check with Fast Downward"),
    "text": Extra(("sentence_transformers",), "a sentence encoder, --encoder sentence"),
    "training": Extra(("torch", "onnx"), "training an image-text encoder"),
    "virtualhome": Extra(("virtualhome_eval",), "VirtualHome, bench third-party"),
    "viz": Extra(("rerun",), "recordings for the Rerun viewer, export and run --log rerun:FILE"),
    "vision": Extra(
        ("torch", "transformers"), "models of real pictures: --segmenter finder, --states clip"
    ),
}
"""The extras of pyproject.toml that somebody may miss, the nearest first."""


def need(what: str, extra: str, *modules: str) -> None:
    """See that what an extra brings is there.

    Args:
        what: that needs it, as a sentence begins: "the world kitchen".
        extra: which one.
        modules: the modules that are needed; all that the extra brings by default.

    Raises:
        InputError: one is missing; names the extra.
    """
    for module in modules or EXTRAS[extra].modules:
        if not present(module):
            raise InputError(f"{what} needs {module}, which is not installed: {how(extra)}")


def installed(extra: str) -> bool:
    """Whether everything that an extra brings can be found; nothing is imported."""
    return all(map(present, EXTRAS[extra].modules))


def present(module: str) -> bool:
    """Whether a module can be found; nothing is imported."""
    try:
        return find_spec(module) is not None
    except (ImportError, ValueError):  # one that was taken away, or stands for another in a test
        return False


def how(extra: str) -> str:
    """The command that installs an extra."""
    return f"pip install 'forestall[{extra}]'"


def missed(error: BaseException) -> str | None:
    """The sentence for a module that could not be imported; None where no one extra brings it."""
    name = error.name if isinstance(error, ModuleNotFoundError) else None
    top = (name or "").partition(".")[0]
    found = [extra for extra, brings in EXTRAS.items() if top in brings.modules]
    if len(found) != 1:
        return None
    return f"this needs {top}, which is not installed: {how(found[0])}"
