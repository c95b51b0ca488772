"""Pretrained models as they lie on this machine: packages, folders, and what is missing.

Called by `clip.py` and `sentence.py`; calls nothing. Nothing is downloaded here: who wants a model
of the hub fetches it once, by the command that the error names.
"""

from __future__ import annotations

import os
import re
from collections.abc import Iterator
from contextlib import contextmanager
from importlib import import_module
from pathlib import Path
from typing import Any

from forestall.errors import InputError, ModelFileError

_HUB_NAME = re.compile(r"[\w.-]+(/[\w.-]+)?")
_NOT_NEEDED = ("*.h5", "*.msgpack", "*.ot", "*.onnx", "onnx/*", "openvino/*")
"""Copies of the weights for other frameworks."""


def package(name: str, extra: str) -> Any:
    """Import an optional package.

    Raises:
        InputError: it is not installed; says with which extra it comes.
    """
    try:
        return import_module(name)
    except ImportError as error:
        raise InputError(
            f"this encoder needs {name}, which cannot be imported ({error}): "
            f"pip install 'forestall[{extra}]'"
        ) from error


def chosen(model: str | None, variable: str, default: str) -> str:
    """What was asked for: the argument, else the environment variable, else the default."""
    return model or os.environ.get(variable) or default


def local_folder(model: str, variable: str, extra: str) -> Path:
    """The folder of a model that is on this machine.

    Args:
        model: a folder, or a name on the hub whose files have been downloaded before.
        variable: environment variable that can name another one.
        extra: what brings the package that knows where downloads lie.

    Raises:
        InputError: that package is missing.
        ModelFileError: there is no such model here; says how to get it.
    """
    folder = Path(model).expanduser()
    if folder.is_dir():
        return folder
    if not _HUB_NAME.fullmatch(model) or folder.exists():
        raise ModelFileError(
            f"{model} is neither a folder nor a model name such as 'owner/name': "
            f"name one of them, or set {variable}"
        )
    hub = package("huggingface_hub", extra)
    try:
        return Path(hub.snapshot_download(model, local_files_only=True))
    except (OSError, ValueError) as error:  # the hub's own errors are among them
        raise ModelFileError(
            f"the model {model!r} is not on this machine: download it once with "
            f"{download(model)} or set {variable} to a folder that holds it"
        ) from error


def download(model: str) -> str:
    """The command that fetches a model of the hub."""
    return (
        'python -c "from huggingface_hub import snapshot_download; '
        f"snapshot_download('{model}', ignore_patterns={list(_NOT_NEEDED)})\""
    )


def label(kind: str, model: str) -> str:
    """A name for records: what was asked for, of a folder only its own name."""
    folder = Path(model).expanduser()
    return f"{kind}:{folder.resolve().name if folder.is_dir() else model}"


@contextmanager
def loading(path: Path, extra: str) -> Iterator[None]:
    """While a model is read: no progress bars, and errors that say which folder is at fault.

    Raises:
        InputError: a package is missing.
        ModelFileError: a file is missing or damaged, or is not what it should be.
    """
    logs = package("transformers.utils.logging", extra)
    errors = package("safetensors", extra).SafetensorError
    verbosity, bars = logs.get_verbosity(), logs.is_progress_bar_enabled()
    logs.set_verbosity_error()
    logs.disable_progress_bar()
    try:
        yield
    except ImportError as error:
        raise InputError(
            f"{path} needs a package that is missing ({_first_line(error)}): "
            f"pip install 'forestall[{extra}]'"
        ) from error
    except (OSError, ValueError, KeyError, TypeError, RuntimeError, errors) as error:
        raise ModelFileError(
            f"{path} cannot be loaded ({_first_line(error)}): download it again"
        ) from error
    finally:
        logs.set_verbosity(verbosity)
        if bars:
            logs.enable_progress_bar()


def _first_line(error: BaseException) -> str:
    return str(error).strip().partition("\n")[0] or type(error).__name__
