"""The line to a running build of AI2-THOR: the package's own Controller, watched.

The Controller waits without end for a build that dies while it starts, for its whole time limit
for one that dies later, and over WSGI it starts another one in a scene of its own. Here every call
runs on a thread beside, the build's process is looked at meanwhile, and a build that has died, or
does not answer in time, is an error that says so, now and at every later call. Called by `world`
and `part`; calls `ai2thor`.
"""

from __future__ import annotations

import importlib
import os
import queue
import threading
import time
import warnings
from collections.abc import Callable
from contextlib import suppress
from dataclasses import dataclass
from enum import Enum
from pathlib import Path
from typing import Any

from forestall.errors import ForestallError, InputError

_LOOK_S, _GRACE_S, _ENDS_S = 0.1, 1.0, 5.0
_LOG = "~/.ai2thor/log/unity.log"

VISIBLE_M = 1.5
"""How far the agent reaches: AI2-THOR calls nothing visible that is further away."""


class Server(Enum):
    """How the Controller and the build talk."""

    FIFO = "fifo"
    WSGI = "wsgi"


@dataclass(frozen=True, slots=True)
class Build:
    """Which build to start, and how it draws.

    Args:
        executable: a build on this machine; None: the one that the package downloads.
        display: X display of the build; None: what the environment says.
        server: how to talk with it.
        width: of a picture, in pixels.
        height: of a picture, in pixels.
        fov_deg: vertical field of view.
        start_s: how long it may take to start.
        answer_s: how long one action may take.
    """

    executable: Path | None = None
    display: str | None = None
    server: Server = Server.FIFO
    width: int = 640
    height: int = 480
    fov_deg: float = 60.0
    start_s: float = 300.0
    answer_s: float = 60.0


def load_package(name: str = "ai2thor.controller") -> Any:
    """A module of the package.

    Raises:
        InputError: it is not installed; with the extra that brings it.
    """
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            return importlib.import_module(name)
    except ImportError as error:
        raise InputError(
            f"the world ai2thor needs the package: pip install 'forestall[ai2thor]' ({error})"
        ) from error


class Link:
    """One build with one scene.

    Raises:
        InputError: no package, or no such executable.
        ForestallError: the build did not start.
    """

    def __init__(self, build: Build, scene: str) -> None:
        self._build = build
        self._broken: str | None = None
        if build.executable is not None and not os.access(build.executable, os.X_OK):
            raise InputError(f"{build.executable} is no program that can be run: a build is needed")
        module = load_package().Controller
        self._controller = module.__new__(module)
        self._server: Any = None
        self._call("start", lambda: self._start(scene), build.start_s)

    def _start(self, scene: str) -> Any:
        build = self._build
        wsgi = load_package("ai2thor.wsgi_server").WsgiServer
        self._controller.start = self._only_once
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            self._controller.__init__(
                local_executable_path=None if build.executable is None else str(build.executable),
                x_display=build.display,
                server_class=wsgi if build.server is Server.WSGI else None,
                width=build.width,
                height=build.height,
                scene=scene,
                server_timeout=build.answer_s,
                server_start_timeout=build.start_s,
                fieldOfView=build.fov_deg,
                gridSize=0.25,
                snapToGrid=False,
                renderDepthImage=True,
                renderInstanceSegmentation=True,
                visibilityDistance=VISIBLE_M,
            )
        return self._controller.last_event

    def _only_once(self, *said: Any, **more: Any) -> Any:
        """The Controller's `start`; after a crash it would start a build in a scene of its own."""
        if self._server is not None:
            raise ForestallError("the build of AI2-THOR has crashed")
        started = type(self._controller).start(self._controller, *said, **more)
        self._server = self._controller.server
        return started

    @property
    def event(self) -> Any:
        """What came of the last action (`ai2thor.server.Event`)."""
        return self._controller.last_event

    def reset(self, scene: str) -> Any:
        """Put a scene into its start.

        Raises:
            ForestallError: the build has died, is late, or has no such scene.
        """
        return self._call("Reset", lambda: self._controller.reset(scene), self._build.answer_s)

    def step(self, action: str, **said: Any) -> Any:
        """Carry an action out; the event says whether it succeeded, and why not.

        Raises:
            ForestallError: the build has died or is late.
        """

        def act() -> Any:
            try:
                return self._controller.step(action=action, **said)
            except ValueError:
                event = self._controller.last_event
                if event.metadata["lastActionSuccess"]:
                    raise
                return event

        return self._call(action, act, self._build.answer_s)

    def stop(self) -> None:
        """End the build; may be called more than once."""
        self._broken = self._broken or "AI2-THOR has been stopped"
        server = self._server or getattr(self._controller, "server", None)
        if server is None:
            return
        self._controller.server = server
        process = server.unity_proc
        if process is not None:
            process.kill()
            process.wait()
        with suppress(Exception):  # a server of others, half broken: its build is dead already
            server.stop()
        for pipe in ("server_pipe", "client_pipe"):
            with suppress(AttributeError, OSError):  # one of the two sorts of servers has pipes
                getattr(server, pipe).close()
        _end_serving(server)
        with suppress(AttributeError, OSError):
            server.tmp_dir.cleanup()

    def _call(self, what: str, work: Callable[[], Any], limit_s: float) -> Any:
        if self._broken is not None:
            raise ForestallError(self._broken)
        answers: queue.SimpleQueue[tuple[Any, BaseException | None]] = queue.SimpleQueue()

        def run() -> None:
            try:
                with warnings.catch_warnings():
                    warnings.simplefilter("ignore")
                    answers.put((work(), None))
            except BaseException as error:  # noqa: BLE001  (handed to the caller)
                answers.put((None, error))
            if self._server is not None:
                self._controller.server = self._server  # a crash takes it away

        threading.Thread(target=run, name=f"ai2thor {what}", daemon=True).start()
        ends = time.monotonic() + limit_s
        while True:
            with suppress(queue.Empty):
                return self._given(what, *answers.get(timeout=_LOOK_S))
            code = self._exit_code()
            if code is not None:
                with suppress(queue.Empty):
                    return self._given(what, *answers.get(timeout=_GRACE_S))
                self._lost(f"the build of AI2-THOR ended in {what} (exit code {code}); see {_LOG}")
            if time.monotonic() > ends:
                self._lost(f"the build of AI2-THOR did not answer {what} within {limit_s:g} s")

    def _given(self, what: str, answer: Any, error: BaseException | None) -> Any:
        if error is None:
            return answer
        code = self._exit_code()
        if code is not None:
            self._lost(f"the build of AI2-THOR ended in {what} (exit code {code}); see {_LOG}")
        if isinstance(error, TimeoutError):
            self._lost(f"the build of AI2-THOR did not answer {what} in time: {error}")
        raise ForestallError(f"AI2-THOR, {what}: {error}") from error

    def _lost(self, why: str) -> None:
        self._broken = why
        self.stop()
        raise ForestallError(why)

    def _exit_code(self) -> int | None:
        server = self._server or getattr(self._controller, "server", None)
        process = getattr(server, "unity_proc", None)
        code: int | None = None if process is None else process.poll()
        return code


def _end_serving(server: Any) -> None:
    """End the loop of a server over WSGI, which its own `stop` does not.

    A loop whose socket is closed under it never ends and takes a core: it ends first, and where it
    does not (a handler waits for ever), its socket stays open.
    """
    loop, thread = getattr(server, "wsgi_server", None), getattr(server, "server_thread", None)
    if loop is None:
        return
    if thread is not None and thread.is_alive():
        threading.Thread(target=loop.shutdown, name="ai2thor end", daemon=True).start()
        thread.join(_ENDS_S)
        if thread.is_alive():
            return
    loop.server_close()
