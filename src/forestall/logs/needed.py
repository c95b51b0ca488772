"""Which extra a package belongs to, said where it is missing. Called by readers and writers."""

from __future__ import annotations

from importlib.util import find_spec

from forestall.errors import InputError

_EXTRAS = {"mcap": "mcap", "mcap_ros2": "mcap", "pyarrow": "lerobot", "av": "lerobot"}


def needed(*modules: str) -> None:
    """Make sure that packages are installed.

    Raises:
        InputError: one is not; says which extra brings it.
    """
    for module in modules:
        if find_spec(module) is None:
            extra = _EXTRAS[module]
            raise InputError(
                f"the package {module} is not installed: pip install 'forestall[{extra}]'"
            )
