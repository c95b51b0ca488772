"""RoboFail's episodes that are larger than memory should be: read within 1 GiB, or refused."""

from __future__ import annotations

import os
import pickle
import subprocess
import sys
import zipfile
from pathlib import Path

import numpy as np
import pytest
from robofail_set import at_start, event_of, named_as_the_package
from test_thor_robofail import episode

from forestall.domain.load import shipped
from forestall.errors import FileFormatError
from forestall.types.recorded import RecordedRun
from forestall.worlds.ai2thor.robofail.dataset import RoboFail
from forestall.worlds.ai2thor.robofail.layout import read_episode

GIB = 2**30
PADDING_BYTES = 44 * 2**20
"""Of every event, as much as a camera of 3000 by 3000 pixels has; a file may have 64 MiB."""

READ = """
import sys
from pathlib import Path
from forestall.domain.load import shipped
from forestall.errors import FileFormatError
from forestall.worlds.ai2thor.robofail.dataset import RoboFail
(run,) = RoboFail(Path(sys.argv[1])).runs(shipped("ai2thor"))
looks, why = 0, ""
try:
    for look in run.looks():
        looks += 1
except FileFormatError as error:
    why = str(error)
status = Path("/proc/self/status").read_text()  # getrusage would have the memory of the parent, too
print(looks, status.split("VmHWM:")[1].split()[0], why, sep="|")
"""


def read_alone(folder: Path) -> tuple[int, int, str]:
    """Looks, bytes of memory at the most, and why no more was read; in a process of its own."""
    done = subprocess.run(
        [sys.executable, "-c", READ, str(folder)],
        capture_output=True, text=True, check=True, timeout=600,
    )  # fmt: skip
    looks, peak_kib, why = done.stdout.strip().split("|")
    return int(looks), int(peak_kib) * 1024, why


@pytest.fixture
def large(tmp_path: Path) -> Path:
    """An episode of 35 events, 1.5 GiB together; one file that stands under all their names."""
    folder = episode(tmp_path)
    event = event_of(at_start())
    event.third_party_camera_frames = [np.zeros(PADDING_BYTES, np.uint8)]  # type: ignore[attr-defined]
    first, *others = sorted((folder / "events").iterdir())
    with named_as_the_package(), first.open("wb") as file:
        pickle.dump(event, file, protocol=pickle.HIGHEST_PROTOCOL)
    for path in others:
        path.unlink()
        os.link(first, path)
    assert sum(p.stat().st_size for p in (folder / "events").iterdir()) > 1.4 * GIB
    return folder


@pytest.mark.skipif(sys.platform != "linux", reason="the peak is read from /proc")
def test_an_episode_larger_than_a_gibibyte_is_read_in_less(large: Path) -> None:
    looks, peak, why = read_alone(large)
    assert why == "" and looks > 10
    assert peak < GIB


@pytest.mark.skipif(sys.platform != "linux", reason="the peak is read from /proc")
def test_an_event_of_ten_gibibytes_is_refused_before_it_is_in_memory(large: Path) -> None:
    path = large / "events" / "step_3.pickle"
    path.unlink()
    with path.open("wb") as file:
        file.truncate(10 * GIB)  # takes no room on the disk
    _, peak, why = read_alone(large)
    assert "step_3.pickle is larger than" in why
    assert peak < GIB


def test_an_archive_that_unpacks_to_gigabytes_is_not_opened(tmp_path: Path) -> None:
    bomb = tmp_path / "robofail.zip"
    with (
        zipfile.ZipFile(bomb, "w", zipfile.ZIP_DEFLATED) as archive,
        archive.open("boilWater/boilWater-1/events/step_1.pickle", "w") as member,
    ):
        for _ in range(64):
            member.write(bytes(2**20))
    with pytest.raises(FileFormatError, match=r"robofail\.zip is no folder: unpack"):
        RoboFail(bomb)
    folder = episode(tmp_path)
    os.replace(bomb, folder / "events" / "step_1.pickle")
    (run,) = RoboFail(folder).runs(shipped("ai2thor"))
    assert isinstance(run, RecordedRun)
    with pytest.raises(FileFormatError, match=r"step_1\.pickle"):
        list(run.looks())


def test_ten_thousand_files_are_told(tmp_path: Path) -> None:
    for k in range(10_000):
        (tmp_path / f"{k}.txt").touch()
    with pytest.raises(FileFormatError, match=r"has no episode"):
        RoboFail(tmp_path)
    with pytest.raises(FileFormatError, match="more than 5000 events"):
        read_episode(episode(tmp_path / "set", frames=10_000))
