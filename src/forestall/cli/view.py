"""`forestall view`: runs and experiments of a folder in a browser, also while they happen."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path


def view(folder: Path = Path("runs"), /, *, port: int = 8766, host: str = "127.0.0.1") -> int:
    """Show the runs and experiments of a folder in a browser, also while they happen.

    An index with filters, the page of each run, two runs side by side. Nothing is written to the
    folder, and nothing is loaded from a network.

    Args:
        folder: of a run, of several, or of experiments; runs by default.
        port: to listen on; 0 for any that is free.
        host: name or address to listen on; 0.0.0.0 lets others in the network look.
    """
    from forestall.view.serving import viewing

    with viewing(folder, host, port) as server:
        print(server.address, flush=True)
        try:
            server.serve_forever()
        except KeyboardInterrupt:
            return 0
    return 0


@contextmanager
def serving_run(folder: Path) -> Iterator[str]:
    """Serve one run while the block goes on; yields the address of its page."""
    from forestall.view.serving import viewing

    with viewing(folder, port=0) as server, server.answering():
        yield f"{server.address}run/"
