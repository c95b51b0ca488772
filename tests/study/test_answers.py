"""What is on the disk after a kill, and what is refused when it is read."""

from pathlib import Path

import pytest

from forestall.errors import FileFormatError, InputError
from forestall.study.answers import Answer, AnswerFile, Start, file_of, read_answers, read_raters
from forestall.study.assigning import Design
from forestall.study.model import read_study

from .studies import make


def test_a_kill_at_any_byte_costs_no_answer_that_was_kept(tmp_path: Path) -> None:
    study = make(tmp_path, 5, Design(2))
    path = file_of(tmp_path, 1)
    file = AnswerFile(path, Start(study.digest, 1, False, "צלחת <b>"))
    ends = [path.stat().st_size]
    for k, choice in enumerate(("a", "both", "b")):
        file.add(Answer(k, choice, 1.5))  # type: ignore[arg-type]
        ends.append(path.stat().st_size)
    whole = path.read_bytes()
    for cut in range(len(whole) + 1):
        path.write_bytes(whole[:cut])
        kept = sum(end <= cut for end in ends)
        rater = read_answers(path, study)
        assert (rater is None) == (kept == 0)
        assert rater is None or len(rater.answers) == kept - 1
        if rater is not None:
            AnswerFile(path).add(Answer(3, "a"))
            again = read_answers(path, study)
            assert again is not None and set(again.answers) == {*range(kept - 1), 3}


def test_what_does_not_fit_on_the_disk_is_taken_back(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    study = make(tmp_path, 5, Design(2))
    path = file_of(tmp_path, 1)
    file = AnswerFile(path, Start(study.digest, 1, False))
    whole = path.read_bytes()

    def full(handle: int) -> None:
        raise OSError(28, "No space left on device")

    with monkeypatch.context() as patched, pytest.raises(OSError, match="No space"):
        patched.setattr("os.fsync", full)
        file.add(Answer(0, "a"))
    assert path.read_bytes() == whole
    file.add(Answer(0, "b"))
    rater = read_answers(path, study)
    assert rater is not None and rater.answers[0].choice == "b"


def test_of_several_answers_to_one_trial_the_last_counts(tmp_path: Path) -> None:
    study = make(tmp_path, 5, Design(2))
    file = AnswerFile(file_of(tmp_path, 2), Start(study.digest, 2, False))
    for choice in ("a", "b", "both"):
        file.add(Answer(0, choice))
    (rater,) = read_raters(tmp_path, study)
    assert rater.answers[0].choice == "both" and rater.next_trial(5) == 1


@pytest.mark.parametrize(
    ("line", "said"),
    [
        ("{}", "trial"),
        ('{"trial": 99, "choice": "a"}', "trial 99 of"),
        ('{"trial": 0, "choice": "c"}', "choice"),
        ('{"trial": 0, "choice": "a", "trial": 1}', "twice"),
        ('{"trial": 0, "choice": "a", "seconds": NaN}', "NaN"),
        ("\x00\xff", "line 2"),
    ],
)
def test_a_damaged_line_is_told_with_its_place(tmp_path: Path, line: str, said: str) -> None:
    study = make(tmp_path, 5, Design(2))
    path = file_of(tmp_path, 1)
    AnswerFile(path, Start(study.digest, 1, False))
    with path.open("a", encoding="utf-8") as file:
        file.write(line + "\n")
    with pytest.raises(FileFormatError, match=r"rater-001\.jsonl, line 2") as error:
        read_answers(path, study)
    assert said in str(error.value)


def test_answers_to_another_study_are_refused(tmp_path: Path) -> None:
    study = make(tmp_path / "one", 5, Design(2))
    other = make(tmp_path / "two", 5, Design(2, seed=1))
    AnswerFile(file_of(tmp_path / "one", 1), Start(other.digest, 1, False))
    with pytest.raises(FileFormatError, match="another study"):
        read_raters(tmp_path / "one", study)
    with pytest.raises(InputError, match="there already"):
        AnswerFile(file_of(tmp_path / "one", 1), Start(study.digest, 1, False))


def test_a_study_is_read_as_it_was_written_and_damage_is_told(tmp_path: Path) -> None:
    study = make(tmp_path, 5, Design(2))
    assert read_study(tmp_path) == study
    file = tmp_path / "study.json"
    text = file.read_text()
    for wrong, said in (
        (text.replace('"ours": "a"', '"ours": "c"', 1), "ours"),
        (text.replace("pictures/actual.jpg", "../secret.jpg", 1), "secret"),
        (text.replace("pictures/actual.jpg", "pictures/gone.jpg", 1), "gone.jpg is not there"),
        (text.replace('"against": "image"', '"against": "nobody"', 1), "nobody"),
        (text[:-30], "study.json"),
    ):
        assert wrong != text
        file.write_text(wrong)
        with pytest.raises(FileFormatError, match=r"study\.json") as error:
            read_study(tmp_path)
        assert said in str(error.value)
    with pytest.raises(InputError, match="forestall study make"):
        read_study(tmp_path / "nowhere")
