"""Small studies with drawn pictures, shared by the tests of this folder."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from forestall.records.pictures import encode_jpeg
from forestall.study.assigning import Design, assign
from forestall.study.model import Explanation, Item, Study, write_study

OURS, AGAINST = "scene-graph", ("objects", "caption", "image")

MARKUP = '<script>document.title = "taken"</script><b>bold</b>'
RIGHT_TO_LEFT = "\u202eצלחת נקייה במיקרוגל"
LONG = "Überlanges" * 30
"""Three hundred characters without a space."""

NASTY = (MARKUP, RIGHT_TO_LEFT, LONG)


def items(count: int, texts: tuple[str, ...] = ()) -> tuple[Item, ...]:
    """Items of seven tasks; `texts` stand in their names, in turn."""

    def text(k: int, what: str) -> str:
        return f"{texts[k % len(texts)]} {what}" if texts else what

    return tuple(
        Item(
            name=f"item-{k + 1:03d}",
            task=text(k, f"Task {k % 7}"),
            step=text(k, f"Do step {k}."),
            cause=text(k, f"Thing {k} is in the way."),
            expected="pictures/expected.jpg",
            expected_from="the same room without the disturbance",
            actual="pictures/actual.jpg",
            explanations=tuple(
                Explanation(d, text(k, f"Before step {k}: words of rival {n}."), "templates")
                for n, d in enumerate((OURS, *AGAINST))
            ),
            source={"run": f"runs/{k}"},
        )
        for k in range(count)
    )


def study_of(count: int, design: Design, texts: tuple[str, ...] = ()) -> Study:
    """A study that lies nowhere."""
    found = items(count, texts)
    trials = assign(found, AGAINST, design)
    return Study(OURS, AGAINST, design.seed, found, tuple(map(tuple, trials)), {}, "0")


def make(folder: Path, count: int, design: Design, texts: tuple[str, ...] = ()) -> Study:
    """The same in a folder, with its pictures."""
    pictures = folder / "pictures"
    pictures.mkdir(parents=True)
    y, x = np.mgrid[0:240, 0:320]
    for name, colour in (("expected", 60), ("actual", 160)):
        rgb = np.stack([x * 0 + colour, 120 + y // 4, 80 + x // 3], -1).astype(np.uint8)
        (pictures / f"{name}.jpg").write_bytes(encode_jpeg(rgb))
    study = study_of(count, design, texts)
    write_study(folder, study)
    return study
