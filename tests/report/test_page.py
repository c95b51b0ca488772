from __future__ import annotations

import itertools
import re
from dataclasses import replace
from html.parser import HTMLParser
from pathlib import Path

import pytest

from forestall.report.page import MOST_BYTES, page_html, write_page
from forestall.report.story import story
from forestall.report.words import duration
from forestall.types.episode import EpisodeRecord

from . import records

pytestmark = pytest.mark.slow

VOID = {"meta", "link", "img", "br", "hr", "input"}
MAKERS = [
    records.potato_record,
    records.unjudged_record,
    records.troubled_record,
    records.looked_after_record,
    records.empty_record,
]


class Page(HTMLParser):
    """Collects what the tests ask about; fails on tags that do not nest."""

    def __init__(self, text: str) -> None:
        super().__init__(convert_charrefs=True)
        self.open: list[str] = []
        self.ids: list[str] = []
        self.links: list[str] = []
        self.sources: list[str] = []
        self.described: list[str] = []
        self.tags: list[tuple[str, dict[str, str]]] = []
        self.words: list[str] = []
        self.feed(text)
        assert self.open == []

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        found = {k: v or "" for k, v in attrs}
        self.tags.append((tag, found))
        if "id" in found:
            self.ids.append(found["id"])
        if "href" in found:
            self.links.append(found["href"])
        if "src" in found:
            self.sources.append(found["src"])
        self.described += found.get("aria-labelledby", "").split()
        if tag not in VOID and not self.rawdata[: self.getpos()[1]].endswith("/>"):
            self.open.append(tag)

    def handle_startendtag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        self.handle_starttag(tag, attrs)
        if tag not in VOID:
            self.handle_endtag(tag)

    def handle_endtag(self, tag: str) -> None:
        assert self.open.pop() == tag

    def handle_data(self, data: str) -> None:
        if self.open and self.open[-1] not in ("style", "script"):
            self.words.append(data)

    @property
    def text(self) -> str:
        return re.sub(r"\s+", " ", " ".join(self.words))

    def having(self, tag: str, css: str) -> list[dict[str, str]]:
        return [a for t, a in self.tags if t == tag and css in a.get("class", "").split()]


def page(record: EpisodeRecord) -> Page:
    return Page(page_html(record))


@pytest.mark.parametrize("make", MAKERS)
def test_the_page_needs_nothing_but_itself(make: object) -> None:
    text = page_html(make())  # type: ignore[operator]
    found = Page(text)
    assert not re.search(r"https?://|@import|url\(", text)
    assert all(link.startswith(("#", "data:,")) for link in found.links)
    assert all(source.startswith("data:image/jpeg;base64,") for source in found.sources)
    assert not [t for t, a in found.tags if t in ("iframe", "object", "embed") or "srcset" in a]


@pytest.mark.parametrize("make", MAKERS)
def test_every_id_is_unique_and_every_reference_exists(make: object) -> None:
    found = page(make())  # type: ignore[operator]
    assert len(found.ids) == len(set(found.ids))
    wanted = [link[1:] for link in found.links if link.startswith("#")] + found.described
    assert set(wanted) <= set(found.ids)
    assert "timeline" in found.ids


@pytest.mark.parametrize("make", MAKERS)
def test_the_same_record_gives_the_same_bytes(make: object) -> None:
    assert page_html(make()) == page_html(make())  # type: ignore[operator]


def test_it_says_what_happened() -> None:
    found = page(records.potato_record())
    text = found.text
    for words in (
        "Heat a potato on a clean plate",
        "microwave-occupied",
        "Task succeeded",
        "passed REFLECT",
        records.CAUSE,
        "0.734",
        "0.900",
        "vacant(Microwave-1)",
        "pick_up(Bowl-1)",
        "nearest demonstration, demo-0003",
        "Bowl-1 is there and was not expected",
        "the scorer’s view",
        "Potato-1 is cooked",
        "oracle states",
        "read from the simulator, not from the pictures",
        "instance-ids",
        "2.5 s",
        "mujoco 4.0.0",
    ):
        assert words in text, words


def test_the_timeline_leads_to_every_moment() -> None:
    found = page(records.potato_record())
    moments = [i for i in found.ids if i.startswith("moment-")]
    assert moments == [f"moment-{n}" for n in range(1, 15)]
    assert [link for link in found.links if link.startswith("#moment-")][:14] == [
        f"#{m}" for m in moments
    ]
    assert len([t for t, a in found.tags if t == "li" and a.get("class") == "replanned"]) == 2


def test_only_what_matters_is_unfolded() -> None:
    for record, unfolded in (
        (records.potato_record(), 1),
        (records.unjudged_record(), 1),
        (records.troubled_record(), 3),
    ):
        cards = page(record).having("details", "moment")
        assert sum("open" in card for card in cards) == unfolded


def test_inserted_steps_stand_in_the_plan() -> None:
    found = page(records.potato_record())
    assert len(found.having("tr", "inserted")) == 2
    assert len(found.having("tr", "done")) == records.ALARM_INDEX
    assert not found.having("tr", "removed")


def test_both_graphs_of_a_judged_moment_are_drawn() -> None:
    drawings = page(records.potato_record()).having("svg", "fg")
    assert len(drawings) == 2 * 14
    assert len(page(records.unjudged_record()).having("svg", "fg")) == 9


def test_a_run_without_verdicts_and_pictures() -> None:
    found = page(records.unjudged_record())
    assert "Task failed" in found.text
    assert "inside(?plate, Microwave): the plate is on CounterTop-2" in found.text
    assert "Outcome refused: Microwave-1 has no room for Plate-1" in found.text
    assert "Not judged" in found.text
    assert "No picture was kept" in found.text
    assert "Executed without a look beforehand" in found.text
    assert "not recorded" in found.text
    assert "No alarm was raised" in found.text
    assert found.sources == []
    assert "oracle" not in found.text


def test_alarms_that_changed_nothing_and_a_scene_without_reference() -> None:
    text = page(records.troubled_record()).text
    assert "nothing was found that must change: the difference is harmless" in text
    assert "The plan stayed as it was: unsolvable (proven on the observed state)." in text
    assert "no demonstration is like it <0.5>" in text
    assert "step 2 cannot run: no room <left>" in text
    assert "Not scored" in text
    assert "uncalibrated" in text


def test_names_cannot_become_markup() -> None:
    text = page_html(records.troubled_record())
    found = Page(text)
    assert "<script>alert" not in text
    assert '<b>"Süß' not in text
    scripts = [a for t, a in found.tags if t == "script"]
    assert [a for a in scripts if a.get("type") != "application/json"] == [{}]
    for words in ('Tasse <b>"Süß & 熱い"</b>', "wein & <bröt>", "'; alert(1) //", "it's <odd>"):
        assert words in found.text


def test_a_run_that_ended_before_it_began() -> None:
    text = page(records.empty_record()).text
    assert "The run ended before its first subtask" in text
    assert "Nothing was executed" in text
    assert "undisturbed" in text


def test_learned_states_are_named_as_such() -> None:
    record = replace(
        records.potato_record(),
        provenance=(("perception", {"segmenter": "sam", "state_estimator": "two-tower <v2>"}),),
    )
    text = page(record).text
    assert "two-tower <v2>" in text
    assert "oracle" not in text


def test_the_file_is_written_whole(tmp_path: Path) -> None:
    path = write_page(records.potato_record(), tmp_path / "deep" / "page.html")
    assert path.read_text("utf-8") == page_html(records.potato_record())
    assert [p.name for p in path.parent.iterdir()] == ["page.html"]


@pytest.mark.parametrize(
    ("seconds", "words"),
    [(0.0, "0 s"), (0.0042, "4.2 ms"), (0.25, "250 ms"), (4.0, "4.0 s"), (131.4, "131 s")],
)
def test_durations_are_short(seconds: float, words: str) -> None:
    assert duration(seconds) == words


def test_moments_after_a_subtask_and_at_the_end_are_said_so() -> None:
    found = page(records.looked_after_record())
    assert "Before and after each subtask, and at the end" in found.text
    assert "after put_in(Plate, Microwave)" in found.text
    assert "The subtask was over: a new plan follows." in found.text
    assert "The plan was finished." in found.text
    assert "Not judged: the strategy does not compare scenes before a subtask." in found.text
    assert "What each detector said" in found.text
    assert "done: put_in(Plate, Microwave)" in found.text
    assert "next: put_in(Plate, Microwave)" in found.text
    assert "0.734 of 0.900: replan" in found.text
    assert "Before each subtask" in page(records.potato_record()).text


@pytest.mark.parametrize("make", MAKERS)
def test_every_drawing_and_region_has_a_name_of_its_own(make: object) -> None:
    found = page(make())  # type: ignore[operator]
    drawings = [a["aria-label"] for a in found.having("svg", "fg")]
    regions = [a["aria-label"] for t, a in found.tags if t == "div" and "aria-label" in a]
    assert len(drawings) == len(set(drawings)) and len(regions) == len(set(regions))


@pytest.mark.parametrize("make", MAKERS)
def test_no_level_of_headings_is_left_out(make: object) -> None:
    levels = [int(t[1]) for t, _ in page(make()).tags if re.fullmatch("h[1-6]", t)]  # type: ignore[operator]
    assert levels[0] == 1
    assert all(b - a <= 1 for a, b in itertools.pairwise(levels))


def test_a_story_stands_on_top() -> None:
    assert story(records.potato_record()) in page(records.potato_record()).text


def test_what_an_alarm_speaks_about_is_framed_in_the_picture() -> None:
    found = page(records.potato_record(width=640, height=480))
    culprits = [a["data-node"] for a in found.having("span", "culprit")]
    assert culprits == ["Bowl-1"]
    placed = [a for t, a in found.tags if t == "g" and "fg-placed" in a.get("class", "")]
    frames = {a["data-node"] for a in found.having("span", "box")}
    boxed = {n.id for b in records.potato_record().boundaries for n in b.graph.nodes if n.box_m}
    assert placed and {a["data-node"] for a in placed} <= frames | boxed
    assert all(a["tabindex"] == "0" and a["aria-label"] for a in placed)


def test_a_page_stays_under_two_megabytes_whatever_its_pictures_are() -> None:
    record = records.potato_record(width=640, height=480, frames=3)
    (first, *rest) = record.boundaries
    many = tuple(replace(b, index=i) for i, b in enumerate((first, *rest, *rest, *rest)))
    assert len(page_html(replace(record, boundaries=many)).encode()) <= MOST_BYTES


def test_a_served_page_leads_home() -> None:
    served = Page(page_html(records.potato_record(), home="/"))
    assert "/" in served.links and "/" not in page(records.potato_record()).links
