from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from forestall.embeddings.remembered import CropRows, TextRows, Vectors
from forestall.types.observation import Mask, Rgb


def test_texts_are_computed_once_until_they_are_forgotten() -> None:
    asked: list[tuple[str, ...]] = []

    def lengths(texts: Sequence[str]) -> Vectors:
        asked.append(tuple(texts))
        return np.array([[len(t)] for t in texts], dtype=np.float32)

    rows = TextRows(lengths, 1, size=2)
    assert rows(["aa", "b", "aa"]).tolist() == [[2], [1], [2]]
    assert rows(["aa"]).tolist() == [[2]]
    assert rows(["ccc", "aa"]).tolist() == [[3], [2]]
    assert rows(["b"]).tolist() == [[1]]
    assert asked == [("aa", "b"), ("ccc",), ("b",)]
    assert rows([]).shape == (0, 1)


def test_what_is_given_out_can_be_written_to() -> None:
    rows = TextRows(lambda texts: np.ones((len(texts), 2), dtype=np.float32), 2)
    rows(["a"])[:] = 5.0
    assert rows(["a"]).tolist() == [[1, 1]]


def test_crops_are_computed_once_for_each_frame() -> None:
    asked: list[int] = []

    def areas(rgb: Rgb, masks: Sequence[Mask]) -> Vectors:
        asked.append(len(masks))
        return np.array([[m.sum() + int(rgb[0, 0, 0])] for m in masks], dtype=np.float32)

    rows = CropRows(areas, 1)
    dark, bright = np.zeros((2, 2, 3), dtype=np.uint8), np.full((2, 2, 3), 10, dtype=np.uint8)
    full, empty = np.ones((2, 2), dtype=bool), np.zeros((2, 2), dtype=bool)
    assert rows(dark, [full]).tolist() == [[4]]
    assert rows(dark, [empty, full]).tolist() == [[0], [4]]
    assert rows(bright, [full]).tolist() == [[14]]
    assert asked == [1, 1, 1]
    assert rows(bright, []).shape == (0, 1)
