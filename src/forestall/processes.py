"""Processes that work for this one and end with it.

Called by recording, experiments and the encoder's pictures.
"""

from __future__ import annotations

import os
import threading
from concurrent.futures import ProcessPoolExecutor
from multiprocessing import get_context, parent_process


def pool(workers: int) -> ProcessPoolExecutor:
    """Fresh processes that import what they need; when this one is killed, they end at once."""
    return ProcessPoolExecutor(
        workers, mp_context=get_context("spawn"), initializer=end_with_parent
    )


def end_with_parent() -> None:
    """End this process when the one that started it is gone, whatever it is doing.

    Otherwise it would wait for work for ever, and finish writing what nobody asks for any more.
    """
    threading.Thread(target=_watch, name="end-with-parent", daemon=True).start()


def _watch() -> None:
    parent = parent_process()
    if parent is not None:
        parent.join()
        os._exit(1)
