"""Where the assets of FrankaKitchen are: named by the user, or those of gymnasium-robotics.

Called by `part`. The package is looked for and never imported: it pins a `mujoco` that cannot share
an environment with `mujoco-core` 4, which loads the same files.
"""

from __future__ import annotations

from importlib.util import find_spec
from pathlib import Path

from forestall.errors import InputError

MODEL = Path("kitchen_assets", "kitchen_env_model.xml")
INSTALL = "pip install --no-deps gymnasium-robotics==1.4.2"

_WITHIN = (Path(), Path("kitchen_franka"), Path("envs", "assets", "kitchen_franka"),
           Path("gymnasium_robotics", "envs", "assets", "kitchen_franka"))  # fmt: skip


def model_file(assets: str = "") -> Path:
    """The file of the model.

    Args:
        assets: a folder: `kitchen_franka`, the package, or where the package was installed; "" for
            the installed package.

    Raises:
        InputError: there is none; says what to install or to name.
    """
    if assets:
        folder = Path(assets).expanduser()
    else:
        spec = find_spec("gymnasium_robotics")
        if spec is None or spec.origin is None:
            raise InputError(
                f"the assets of FrankaKitchen are not here: {INSTALL}, or --world.assets FOLDER"
            )
        folder = Path(spec.origin).parent
    for within in _WITHIN:
        if (file := folder / within / MODEL).is_file():
            return file
    raise InputError(
        f"{folder}: no {MODEL.as_posix()} in it: name the folder kitchen_franka of "
        f"gymnasium-robotics, or install it ({INSTALL})"
    )
