"""The Unity side of AI2-THOR's protocol, over FIFO and over WSGI, with the stand-in's kitchen.

Started by the real Controller as its executable; whichever server it speaks to is told by the
environment, as Unity is. `--dies-at N` ends the process at the Nth action of a name, without a
word: ACTION or ACTION:N; `--hangs-at` never answers it.
"""

from __future__ import annotations

import argparse
import http.client
import json
import os
import struct
import sys
import time
from collections import Counter
from typing import Any, BinaryIO

import numpy as np
from box_kitchen import Kitchen

_METADATA, _ACTION, _RGB, _DEPTH, _IDS, _END = 1, 2, 4, 5, 9, 255
_HEADER = "!BI"


class Unity:
    """Answers actions with metadata and pictures."""

    def __init__(self, said: argparse.Namespace) -> None:
        self.kitchen = Kitchen(said.width, said.height)
        self.sequence = 0
        self._dies, self._hangs = said.dies_at, said.hangs_at
        self._seen: Counter[str] = Counter()
        self._depth = self._ids = False

    def act(self, action: dict[str, Any]) -> None:
        name = str(action["action"])
        self._seen[name] += 1
        now = (name, f"{name}:{self._seen[name]}")
        if self._dies in now:
            os._exit(1)
        while self._hangs in now:
            time.sleep(0.1)
        self.sequence = int(action["sequenceId"])
        if name == "Initialize":
            self._depth = bool(action.get("renderDepthImage"))
            self._ids = bool(action.get("renderInstanceSegmentation"))
        self.kitchen.step(action)

    def metadata(self) -> dict[str, Any]:
        return self.kitchen.metadata(self.sequence)

    def pictures(self) -> dict[str, bytes]:
        """By the names of the WSGI form; rows from the bottom up, as Unity reads its textures."""
        home = self.kitchen
        found = {"image": np.ascontiguousarray(home.rgb[::-1]).tobytes()}
        if self._depth:
            found["image_depth"] = np.ascontiguousarray(home.depth[::-1]).tobytes()
        if self._ids:
            found["image_ids"] = np.ascontiguousarray(home.ids[::-1]).tobytes()
        return found


def over_fifo(unity: Unity) -> None:
    import msgpack

    fields = {"image": _RGB, "image_depth": _DEPTH, "image_ids": _IDS}
    with open(os.environ["AI2THOR_FIFO_SERVER_PIPE_PATH"], "wb") as out:
        into: BinaryIO | None = None
        while True:
            _write(out, _METADATA, msgpack.packb(unity.metadata()))
            for name, picture in unity.pictures().items():
                _write(out, fields[name], picture)
            out.write(struct.pack(_HEADER, _END, 0))
            out.flush()
            if into is None:
                into = open(os.environ["AI2THOR_FIFO_CLIENT_PIPE_PATH"], "rb")  # noqa: SIM115
            action = _read(into)
            if action is None:
                return
            unity.act(action)


def _write(out: BinaryIO, kind: int, body: bytes) -> None:
    out.write(struct.pack(_HEADER, kind, len(body)) + body)


def _read(into: BinaryIO) -> dict[str, Any] | None:
    action = None
    while True:
        header = into.read(struct.calcsize(_HEADER))
        if len(header) < struct.calcsize(_HEADER):
            return None
        kind, length = struct.unpack(_HEADER, header)
        if kind == _END:
            return action
        action = json.loads(into.read(length))


def over_wsgi(unity: Unity) -> None:
    host, port = os.environ["AI2THOR_HOST"], int(os.environ["AI2THOR_PORT"])
    connection = http.client.HTTPConnection(host, port)
    mark = "stand-in-boundary"
    while True:
        body = b""
        texts = {
            "metadata": json.dumps(unity.metadata()),
            "token": os.environ["AI2THOR_CLIENT_TOKEN"],
        }
        for name, text in texts.items():
            head = f'Content-disposition: form-data; name="{name}"'
            head += "\r\nContent-Type: text/plain; charset=utf-8"
            body += f"--{mark}\r\n{head}\r\n\r\n{text}\r\n".encode()
        for name, picture in unity.pictures().items():
            head = f'Content-disposition: form-data; name="{name}"; filename="{name}"'
            head += "\r\nContent-Type: image/raw"
            body += f"--{mark}\r\n{head}\r\n\r\n".encode() + picture + b"\r\n"
        body += f"--{mark}--\r\n".encode()
        kind = f"multipart/form-data; boundary={mark}"
        connection.request("POST", "/train", body, {"Content-Type": kind})
        action = json.loads(connection.getresponse().read())
        if "action" not in action:
            return
        unity.act(action)


def main() -> None:
    flags = argparse.ArgumentParser()
    flags.add_argument("--dies-at", default="")
    flags.add_argument("--hangs-at", default="")
    flags.add_argument("-screen-width", dest="width", type=int, default=300)
    flags.add_argument("-screen-height", dest="height", type=int, default=300)
    said, _ = flags.parse_known_args(sys.argv[1:])
    unity = Unity(said)
    fifo = os.environ["AI2THOR_SERVER_TYPE"] == "FIFO"
    (over_fifo if fifo else over_wsgi)(unity)


if __name__ == "__main__":
    main()
