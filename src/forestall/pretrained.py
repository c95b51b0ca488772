"""Pretrained models as they lie on this machine: packages, folders, devices, and what is missing.

Called by `embeddings/` and `vision/`; calls nothing. Nothing is downloaded here: who wants a model
of the hub fetches it once, by the command that the error names.
"""

from __future__ import annotations

import os
import re
from collections.abc import Collection, Iterator
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
            f"this part needs {name}, which cannot be imported ({error}): "
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


AUTO = "auto"
"""The device of who names none: a GPU where there is one, else the processor."""


def check_family(folder: Path, found: str, families: Collection[str], called: str) -> None:
    """What a folder holds is of a family that can be used.

    Args:
        folder: of the model.
        found: the `model_type` of its configuration.
        families: model types that will do.
        called: what such a model is called.

    Raises:
        ModelFileError: it holds something else.
    """
    if found not in families:
        raise ModelFileError(f"{folder} holds a {found!r} model and no {called}")


def read_weights(model_class: Any, folder: Path, torch: Any) -> Any:
    """A model of `transformers` with all its weights, in single precision.

    Raises:
        ModelFileError: some of them are not in the folder.
    """
    model, report = model_class.from_pretrained(
        folder, local_files_only=True, dtype=torch.float32, output_loading_info=True
    )
    if report["missing_keys"]:
        first = min(report["missing_keys"])
        raise ModelFileError(f"{folder} lacks weights, {first} among them: download it again")
    return model.eval()


def on_device(model: Any, device: str, torch: Any) -> str:
    """Put a model where it is to run; the device that it came to.

    Args:
        model: of torch.
        device: as torch calls it, or `AUTO`.
        torch: the package.

    Raises:
        InputError: there is no such device; says which there are.
    """
    here = "cuda" if torch.cuda.is_available() else "cpu"
    wanted = here if device == AUTO else device
    try:
        model.to(wanted)
    except (RuntimeError, AssertionError) as error:  # torch built without it asserts
        there = "cpu" if here == "cpu" else "cpu, cuda"
        raise InputError(
            f"torch cannot run on device {device!r} ({_first_line(error)}): "
            f"this machine has {there}; {AUTO!r} takes the best of them"
        ) from error
    return wanted


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


def onnx_session(
    model: bytes, path: Path, *, threads: int = 0, remedy: str, device: str = "cpu"
) -> Any:
    """An onnxruntime session over the bytes of a model, and no other file.

    Args:
        model: the bytes.
        path: where they are from, for the sentence.
        threads: 0: as many as there are cores, four at most.
        remedy: what is to be done about a damaged one.
        device: "cpu", "cuda", or `AUTO`.

    Raises:
        InputError: onnxruntime has no such device here.
        ModelFileError: the model is damaged, or this onnxruntime cannot run it.
    """
    try:
        import onnxruntime
    except ImportError as error:
        raise ModelFileError(
            f"the encoder needs onnxruntime, which cannot be imported ({error}): "
            "pip install onnxruntime"
        ) from error
    from onnxruntime.capi import onnxruntime_pybind11_state as states

    there = {"cpu": "CPUExecutionProvider"}
    if "CUDAExecutionProvider" in onnxruntime.get_available_providers():
        there["cuda"] = "CUDAExecutionProvider"
    if device not in (AUTO, *there):
        raise InputError(
            f"onnxruntime cannot run on device {device!r}: this machine has "
            f"{', '.join(there)}; {AUTO!r} takes the best of them"
        )
    options = onnxruntime.SessionOptions()
    options.intra_op_num_threads = threads or min(os.cpu_count() or 1, 4)
    options.inter_op_num_threads = 1
    options.log_severity_level = 4
    # threads that spin while they wait slow down the other processes of a survey
    options.add_session_config_entry("session.intra_op.allow_spinning", "0")
    wanted = [p for d, p in reversed(there.items()) if device in (AUTO, d)]
    try:
        return onnxruntime.InferenceSession(model, options, providers=wanted)
    except (states.NotImplemented, states.InvalidGraph) as error:
        raise ModelFileError(
            f"onnxruntime {onnxruntime.__version__} cannot run {path} ({_first_line(error)}): "
            "pip install --upgrade onnxruntime"
        ) from error
    except (
        states.Fail,
        states.InvalidArgument,
        states.InvalidProtobuf,
        states.NoModel,
        states.NoSuchFile,
        states.RuntimeException,
    ) as error:
        raise ModelFileError(f"{path} is damaged ({_first_line(error)}): {remedy}") from error


def _first_line(error: BaseException) -> str:
    return str(error).strip().partition("\n")[0] or type(error).__name__
