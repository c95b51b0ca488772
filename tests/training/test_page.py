from __future__ import annotations

import base64
import io
import re
import time
from html.parser import HTMLParser
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from forestall.errors import InputError
from forestall.training.measure import Answers, measure
from forestall.training.page import Synonym, ZeroShot, page_html, write_page
from forestall.training.page_pictures import EDGE, contact_sheet, strips

VOID = {"meta", "link", "img", "br"}
VALUES = {"dirty": ("clean", "dirty"), "filled": ("empty", "water", "coffee", "wine")}
SHEET = re.compile(r"--sheet:url\((data:image/jpeg;base64,[^)]*)\)")


class Page(HTMLParser):
    """The words of a page; fails on tags that do not nest."""

    def __init__(self, text: str) -> None:
        super().__init__(convert_charrefs=True)
        self.open: list[str] = []
        self.words: list[str] = []
        self.ids: list[str] = []
        self.links: list[str] = []
        self.feed(text)
        assert self.open == []

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        found = {k: v or "" for k, v in attrs}
        self.ids += [found["id"]] if "id" in found else []
        self.links += [found[k] for k in ("href", "src") if k in found]
        if tag not in VOID:
            self.open.append(tag)

    def handle_endtag(self, tag: str) -> None:
        assert self.open.pop() == tag

    def handle_data(self, data: str) -> None:
        if data.strip() and self.open[-1] != "style":
            self.words.append(data.strip())

    @property
    def text(self) -> str:
        return " ".join(self.words)


def crops(n: int) -> np.ndarray:
    """Plain crops of different greys, a square in the middle of each as mask."""
    pixels = np.zeros((n, 40, 40, 4), dtype=np.uint8)
    pixels[..., :3] = (np.arange(n) * 37 % 200 + 20)[:, None, None, None]
    pixels[:, 10:30, 10:30, 3] = 255
    return pixels


def answers_of(n: int, wrong: int, silent: int, category: str = "Mug") -> Answers:
    """`n` questions whether a mug is dirty, all clean: some called dirty, some not answered."""
    probability = np.tile(np.array([[0.9, 0.1, 0, 0]], dtype=np.float32), (n, 1))
    probability[:wrong] = [[0.2, 0.8, 0, 0]]
    probability[wrong : wrong + silent] = [[0.6, 0.4, 0, 0]]
    answered = np.ones(n, dtype=bool)
    answered[wrong : wrong + silent] = False
    return Answers(
        category=np.full(n, category),
        attribute=np.full(n, "dirty"),
        truth=np.zeros(n, dtype=np.int64),
        probability=probability,
        answered=answered,
        area=np.arange(n) + 30,
        crop=np.arange(n),
    )


def page_of(answers: Answers, facts: dict[str, str] | None = None, **more: object) -> str:
    pixels = crops(int(answers.crop.max()) + 1)
    return page_html(measure(answers), pixels, answers, facts or {}, **more)  # type: ignore[arg-type]


def test_figures_and_aims_are_on_the_page() -> None:
    page = Page(page_of(answers_of(100, wrong=2, silent=5)))
    assert "Both aims met" in page.text
    assert "97.9 %" in page.text  # 93 of 95
    assert "93 of 95" in page.text
    assert "95 of 100" in page.text
    assert "95.0 %" in page.text
    assert "aim: 97 % or more, met" in page.text
    ends = {f"#{i}" for i in page.ids}
    assert all(link.startswith("data:") or link in ends for link in page.links)


@pytest.mark.parametrize(
    ("wrong", "silent", "words"),
    [(10, 5, "One aim missed"), (0, 11, "One aim missed"), (10, 50, "Both aims missed")],
)
def test_a_missed_aim_is_told(wrong: int, silent: int, words: str) -> None:
    assert words in Page(page_of(answers_of(100, wrong, silent))).text


def test_confused_and_unanswered_crops_are_shown_with_their_captions() -> None:
    text = page_of(answers_of(100, wrong=20, silent=5))
    page = Page(text)
    assert "20 of 100 that are clean; 12 shown" in page.text
    assert "not answered 5 of 100" in page.text
    assert "0.80 · 30 px" in page.text
    assert "(clean) 0.60 · 50 px" in page.text
    sheets = [
        Image.open(io.BytesIO(base64.b64decode(uri.partition(",")[2])))
        for uri in SHEET.findall(text)
    ]
    assert [s.size for s in sheets] == [(12 * EDGE, EDGE), (5 * EDGE, EDGE)]
    middle = np.asarray(sheets[0])[EDGE // 2, EDGE // 2]
    assert np.abs(middle.astype(int) - 20).max() <= 4


def test_surest_errors_come_first_and_every_attribute_has_its_worst() -> None:
    rng = np.random.default_rng(3)
    n = 3000
    attribute = np.where(np.arange(n) < 2970, "filled", "dirty")
    wide = np.where(attribute == "filled", 4, 2)
    probability = rng.dirichlet([1.0] * 4, n)
    probability[wide == 2, 2:] = 0
    probability = (probability / probability.sum(axis=1, keepdims=True)).astype(np.float32)
    answers = Answers(
        category=np.full(n, "Mug"),
        attribute=attribute,
        truth=rng.integers(0, wide),
        probability=probability,
        answered=np.ones(n, dtype=bool),
        area=np.full(n, 300),
        crop=np.arange(n),
    )
    measured = measure(answers, VALUES)
    confused, unobserved = strips(measured, crops(n), answers)
    assert unobserved == ()
    assert {s.attribute for s in confused} == {"dirty", "filled"}
    assert [s.count for s in confused] == sorted((s.count for s in confused), reverse=True)
    for strip in confused:
        sure = [float(c.confidence) for c in strip.captions]
        assert sure == sorted(sure, reverse=True)
        assert all((c.truth, c.said) == (strip.truth, strip.said) for c in strip.captions)
    group = next(g for g in measured.attributes if g.attribute == confused[0].attribute)
    row = group.values.index(confused[0].truth or "")
    assert group.confusion[row][group.values.index(confused[0].said)] == confused[0].count


def test_mask_is_outlined_and_what_it_holds_is_left_alone() -> None:
    with_mask = crops(1)
    outlined = np.asarray(contact_sheet(with_mask))
    plain = np.asarray(contact_sheet(with_mask[..., :3]))
    changed = (outlined != plain).any(axis=-1)
    assert changed.sum() > 100
    assert not changed[26:70, 26:70].any()
    assert not changed[:20].any()


def test_every_text_is_escaped() -> None:
    evil = "<script>alert(1)</script>"
    text = page_of(
        answers_of(20, wrong=2, silent=2, category=evil),
        {evil: evil},
        synonyms=[Synonym(evil, evil, evil, 0.5, False, evil)],
        zero_shot=[ZeroShot(evil, evil, 3, None, None, None)],
    )
    assert "<script" not in text
    assert Page(text).text.count(evil) >= 9


def test_words_and_zero_shot_are_tables() -> None:
    page = Page(
        page_of(
            answers_of(20, 0, 0),
            {"seed": "17"},
            synonyms=[
                Synonym("mugg", "Mug", "Mug", 0.913, True, "spelling"),
                Synonym("beaker", "Bowl", "Cup", 0.448, False, "meaning"),
                Synonym("icebox", "Fridge", "Fridge", 0.61, True, "meaning"),
            ],
            zero_shot=[ZeroShot("rolled up or flat", "rolled", 1300, 0.613, 0.5, 0.587)],
        )
    )
    assert "meaning 1 of 2 right, 50.0 %" in page.text
    assert page.text.index("beaker") < page.text.index("icebox")  # the wrong ones first
    assert "✕ Bowl , wrong Cup 0.45" in page.text
    assert "rolled up or flat rolled 1,300 61.3 % 50.0 % 58.7 %" in page.text
    assert "seed 17" in page.text
    plain = Page(page_of(answers_of(20, 0, 0)))
    assert "Words that it has not read" not in plain.text
    assert "Without training" not in plain.text
    assert "Nothing was confused." in plain.text
    assert "Everything was answered." in plain.text


def test_nothing_answered_at_all() -> None:
    page = Page(page_of(answers_of(4, wrong=0, silent=4)))
    assert "Both aims missed" in page.text
    assert "nothing answered" in page.text
    assert "dirty=clean" in page.text


def test_answers_must_be_those_measured() -> None:
    answers = answers_of(10, 1, 1)
    with pytest.raises(InputError, match="that were measured"):
        page_html(measure(answers_of(9, 1, 1)), crops(10), answers, {})
    with pytest.raises(InputError, match="beyond the 9"):
        page_html(measure(answers), crops(9), answers, {})


def test_hundred_thousand_answers_are_quick_and_the_page_stays_small(tmp_path: Path) -> None:
    rng = np.random.default_rng(0)
    n = 100_000
    attribute = rng.choice(["dirty", "filled"], n)
    wide = np.where(attribute == "filled", 4, 2)
    probability = rng.dirichlet([1.0] * 4, n)
    probability[wide == 2, 2:] = 0
    probability = (probability / probability.sum(axis=1, keepdims=True)).astype(np.float32)
    answers = Answers(
        category=rng.choice([f"Thing{i}" for i in range(30)], n),
        attribute=attribute,
        truth=rng.integers(0, wide),
        probability=probability,
        answered=probability.max(axis=1) > 0.5,
        area=rng.integers(10, 5000, n),
        crop=rng.integers(0, 300, n),
    )
    noise = rng.integers(0, 256, (300, 80, 80, 4), dtype=np.uint8)  # as incompressible as can be
    started = time.process_time()
    measured = measure(answers, VALUES)
    out = write_page(measured, noise, answers, tmp_path / "new" / "page.html", {})
    assert time.process_time() - started < 10
    assert out.stat().st_size < 3_000_000
    first = out.read_bytes()
    write_page(measured, noise, answers, out, {})
    assert out.read_bytes() == first
