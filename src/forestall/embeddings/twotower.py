"""The shipped image-text encoder: pictures and texts as unit vectors of one space, in onnxruntime.

Called by the learned state estimator (crops against phrases), by retrieval and comparison (texts,
crops) and by image-level comparison (whole frames); calls `crops.py` and `tokens.py`. It stands
where the paper uses CLIP (Sec. 3); how it was trained and what it can and cannot do stands in
docs/encoder.md.
"""

from __future__ import annotations

import hashlib
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass, field, fields, replace
from importlib.resources import files
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from forestall.embeddings.crops import INPUT_PIXELS, crops, whole
from forestall.embeddings.remembered import CropRows, TextRows, Vectors
from forestall.embeddings.tokens import tokens, words
from forestall.errors import FileFormatError, InputError, ModelFileError
from forestall.pretrained import onnx_session
from forestall.reading.documents import read_json
from forestall.reading.fields import Field
from forestall.reading.files import read_bytes
from forestall.types.encoder import StateReading
from forestall.types.observation import Mask, Rgb

FORMAT = 1
DESCRIPTION_NAME = "encoder.json"
TOWERS = ("image", "text")
TOWER_FILES = tuple(f"{tower}.onnx" for tower in TOWERS)
MOST_BYTES = 2**29
_REMEDY = "reinstall forestall, or train one with `forestall encoder train`"


@dataclass(frozen=True, slots=True)
class Description:
    """What stands beside the two towers.

    Args:
        name: of the model, for records.
        known: words that training has seen.
        reading: how cosines are turned into answers.
        training: how it was made.
        sha256: of each tower's file, {} where nobody wrote it down.
    """

    name: str
    known: frozenset[str]
    reading: StateReading
    training: Mapping[str, Any]
    sha256: Mapping[str, str] = field(default_factory=dict)

    def as_json(self) -> dict[str, Any]:
        """What the file holds."""
        return {
            "format": FORMAT,
            "name": self.name,
            "reading": asdict(self.reading),
            "training": dict(self.training),
            "sha256": dict(self.sha256),
            "known": sorted(self.known),
        }

    @classmethod
    def read(cls, path: Path) -> Description:
        """Read the file.

        Raises:
            ModelFileError: it is not there or does not say what it should.
        """
        if not path.is_file():
            raise ModelFileError(f"there is no encoder at {path}: {_REMEDY}")
        try:
            data = Field(read_json(path, "description of an encoder"))
            if data["format"].value != FORMAT:
                raise ModelFileError(
                    f"{path} has format {data['format'].value}, this version reads {FORMAT}: "
                    f"{_REMEDY}"
                )
            return cls(
                data["name"].text(),
                frozenset(data["known"].tuple_of(Field.text)),
                _reading(data["reading"]),
                dict(data["training"].pairs(lambda f: f.value)),
                dict(data.optional("sha256", lambda f: f.pairs(Field.text)) or ()),
            )
        except (InputError, TypeError) as error:
            raise ModelFileError(f"{path} cannot be read ({error}): {_REMEDY}") from error


def _reading(field: Field) -> StateReading:
    scale, divisor, least, area, rough = (f.name for f in fields(StateReading))
    found = StateReading(
        field[scale].number(),
        *(dict(field.optional(k, lambda f: f.pairs(Field.number)) or ()) for k in (divisor, least)),  # type: ignore[arg-type]
    )
    least_area = field.optional(area, Field.whole)
    found = replace(found, most_rough=field.maybe(rough, Field.number))
    return found if least_area is None else replace(found, least_area=least_area)


def checksums(folder: Path) -> dict[str, str]:
    """SHA-256 of each tower's file, as it stands in the description beside them."""
    return {n: hashlib.sha256((folder / n).read_bytes()).hexdigest() for n in TOWER_FILES}


def shipped() -> Path:
    """The folder of the encoder that the package ships."""
    return Path(str(files("forestall").joinpath("data/encoder")))


class TwoTowerEncoder:
    """Crops, frames and texts → unit rows (implements `ImageTextEncoder`).

    Args:
        folder: image.onnx, text.onnx and encoder.json; the shipped ones by default.
        threads: of each tower; 0: as many as there are cores, four at most.

    Raises:
        ModelFileError: a file is missing or damaged, or this onnxruntime cannot run it.
    """

    def __init__(self, folder: Path | None = None, *, threads: int = 0) -> None:
        folder = folder or shipped()
        self.description = Description.read(folder / DESCRIPTION_NAME)
        self.name = self.description.name
        self.reading = self.description.reading
        sha256 = self.description.sha256
        self._image, self._text = (_open(folder / n, sha256.get(n), threads) for n in TOWER_FILES)
        self._check_towers(folder)
        width = int(self._image.get_outputs()[0].shape[-1])
        self._texts = TextRows(self._texts_anew, width)
        self._crops = CropRows(self._crops_anew, width)

    def _check_towers(self, folder: Path) -> None:
        """See that each file is the tower that its name says."""
        for tower, session, wanted in (
            ("image", self._image, ("tensor(float)", 4)),
            ("text", self._text, ("tensor(int32)", 3)),
        ):
            given = session.get_inputs()[0]
            if (given.type, len(given.shape)) != wanted:
                path = folder / f"{tower}.onnx"
                raise ModelFileError(f"{path} is no {tower} tower of this encoder: {_REMEDY}")

    def readable(self, text: str) -> bool:
        """Whether a text has anything that this encoder can read (Latin letters, digits)."""
        return bool(words(text))

    def encode(self, texts: Sequence[str]) -> Vectors:
        """(n, d) float32 rows of unit length.

        Raises:
            InputError: a text without a Latin letter or digit.
        """
        return self._texts(texts)

    def encode_crops(self, rgb: Rgb, masks: Sequence[Mask]) -> Vectors:
        """(n, d) float32 unit rows, one for each mask.

        What was asked of the same frame just before is not computed again, so that states and
        features of one detection cost one pass.
        """
        return self._crops(rgb, masks)

    def encode_image(self, rgb: Rgb) -> Vectors:
        """(d,) float32 unit vector of a whole frame."""
        row: Vectors = self.encode_pixels(whole(rgb)[None])[0]
        return row

    def encode_pixels(self, pixels: npt.NDArray[np.uint8]) -> Vectors:
        """Unit rows of crops that are cut already, (n, INPUT_PIXELS, INPUT_PIXELS, 4).

        Raises:
            InputError: crops of another shape.
        """
        if pixels.shape[1:] != (INPUT_PIXELS, INPUT_PIXELS, 4):
            raise InputError(
                f"crops must be (n, {INPUT_PIXELS}, {INPUT_PIXELS}, 4), got {pixels.shape}"
            )
        values = pixels.transpose(0, 3, 1, 2).astype(np.float32)
        rows: Vectors = self._image.run(None, {"input": values})[0]
        return rows

    def _texts_anew(self, texts: Sequence[str]) -> Vectors:
        for text in texts:
            if not self.readable(text):
                raise InputError(
                    f"the encoder {self.name!r} cannot read {text!r}: it knows Latin letters only"
                )
        rows: Vectors = self._text.run(None, {"input": tokens(texts, self.description.known)})[0]
        return rows

    def _crops_anew(self, rgb: Rgb, masks: Sequence[Mask]) -> Vectors:
        return self.encode_pixels(crops(rgb, masks))


def _open(path: Path, sha256: str | None, threads: int) -> Any:
    """An onnxruntime session over the bytes whose checksum was looked at, and no other file.

    Raises:
        ModelFileError: see `TwoTowerEncoder`.
    """
    if not path.is_file():
        raise ModelFileError(f"there is no encoder at {path}: {_REMEDY}")
    try:
        data = read_bytes(path, "model", MOST_BYTES)
    except FileFormatError as error:
        raise ModelFileError(f"{error}: {_REMEDY}") from error
    if sha256 is not None and hashlib.sha256(data).hexdigest() != sha256:
        raise ModelFileError(
            f"{path} is damaged (its SHA-256 is not the one in {DESCRIPTION_NAME}): {_REMEDY}"
        )
    return onnx_session(data, path, threads=threads, remedy=_REMEDY)
