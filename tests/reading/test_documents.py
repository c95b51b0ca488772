"""JSON and TOML of others: what is taken, and one sentence for everything else."""

from pathlib import Path

import pytest

from forestall.errors import FileFormatError
from forestall.reading import documents
from forestall.reading.documents import parse_json, parse_toml, read_json


def test_what_is_no_fault_is_read(tmp_path: Path) -> None:
    file = tmp_path / "a.json"
    file.write_bytes(b"\xef\xbb\xbf" + '{"größe": [1, -9223372036854775808, 1e300]}'.encode())
    assert read_json(file, "thing") == {"größe": [1, -(2**63), 1e300]}
    assert parse_json('"0123456789012345678901234567890"') == "0123456789012345678901234567890"
    assert parse_json("0.12345678901234567890123") == pytest.approx(0.123456789)
    assert parse_json("[" * 64 + "]" * 64) is not None
    assert parse_toml("a = 1\nb.c = [0.5]", "x.toml") == {"a": 1, "b": {"c": [0.5]}}


@pytest.mark.parametrize(
    ("text", "says"),
    [
        ("{", r"line 1\)"),
        ('{"a": 1,\n "a": 2}', "'a' is given twice"),
        ("NaN", "NaN is no number"),
        ("[-Infinity]", "-Infinity is no number"),
        ("[1,\n1e999]", "line 2: the number 1e999 is too large"),
        (f"[1,\n{2**63}]", "line 2: the number 9223372036854775808 has more than 64 bit"),
        ("9" * 5000, "more than 64 bit"),
        ("9" * 400 + ".0", "too large"),
        (r'{"id": "\ud800"}', "half of a character"),
        ("[" * 65 + "]" * 65, "more than 64 deep"),
        ("[" * 200_000, "damaged"),
        ('{"a":' * 200_000, "damaged"),
    ],
)
def test_damaged_json_is_one_sentence(text: str, says: str) -> None:
    with pytest.raises(FileFormatError, match=says) as caught:
        parse_json(text)
    assert "\n" not in str(caught.value) and len(str(caught.value)) < 200


@pytest.mark.parametrize(
    ("text", "says"),
    [
        ("a = ", "x.toml: not valid TOML"),
        ("a = 1\na = 2", "x.toml: not valid TOML"),
        ("a = nan", "x.toml: a: a finite number"),
        ("b = [[1, -inf]]", r"b\[0\]\[1\]: a finite number"),
        (f"a.b = {2**63}", "a.b: the number has more than 64 bit"),
        ("a = " + "9" * 5000, "x.toml"),
        ("a = 2020-01-01", "a: a date"),
        ("a = " + "[" * 100 + "]" * 100, "more than 64 deep"),
        ("a = " + "[" * 100_000, "x.toml"),
        (".".join("a" * 100_000) + " = 1", "a key of more than 64 parts"),
        ("a" * 300_000, "not valid TOML"),
        ("[" + ".".join("a" * 100) + "]", "a key of more than 64 parts"),
    ],
)
def test_damaged_toml_is_one_sentence(text: str, says: str) -> None:
    with pytest.raises(FileFormatError, match=says) as caught:
        parse_toml(text, "x.toml")
    assert len(str(caught.value)) < 200


def test_budgets_hold(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    file = tmp_path / "a.json"
    file.write_text("[1, 2, 3]")
    with pytest.raises(FileFormatError, match="larger than"):
        read_json(file, "thing", most=5)
    monkeypatch.setattr(documents, "MOST_VALUES", 2)
    with pytest.raises(FileFormatError, match=r"a\.json: it has more than 2 values"):
        read_json(file, "thing")


@pytest.mark.parametrize(
    ("content", "says"),
    [(b"", "is empty: no thing"), (b"\xff\xfe", "is no thing: it is not UTF-8"), (None, "No such")],
)
def test_what_is_no_text_is_named(tmp_path: Path, content: bytes | None, says: str) -> None:
    file = tmp_path / "a.json"
    if content is not None:
        file.write_bytes(content)
    with pytest.raises(FileFormatError, match=says) as caught:
        read_json(file, "thing")
    assert str(file) in str(caught.value)
