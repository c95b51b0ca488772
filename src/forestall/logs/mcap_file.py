"""An MCAP file record by record, within budgets; a message can be read once more by its place.

Called by `mcap_index` and `mcap_in`; calls the package mcap for single records. Sizes are looked at
before anything is allocated, nothing is sorted and nothing kept but one unpacked chunk, so that a
file of any size takes little memory. See https://mcap.dev/spec for the records.
"""

from __future__ import annotations

import io
import struct
import zlib
from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from pathlib import Path
from types import TracebackType
from typing import IO, Any

from forestall.errors import FileFormatError
from forestall.reading.files import decoding

MAGIC = b"\x89MCAP0\r\n"
MOST_CHUNK_BYTES = 128 * 2**20
"""Of a chunk unpacked, and of a message outside of any; recorders write a few MiB."""

MOST_SCHEMAS = 65_535

_HEAD = struct.Struct("<BQ")
_RECOVER = "a recorder that was killed leaves such a file, and 'mcap recover FILE' saves the rest"

Place = tuple[int, int]
"""Where a message is: its chunk's or its own offset in the file, and its number in the chunk."""


@dataclass(frozen=True, slots=True)
class Told:
    """One message as it stands in the file.

    Args:
        topic: of its channel.
        log_ns: when it was logged.
        data: not decoded.
        place: for `McapFile.read`.
        channel: of the file.
    """

    topic: str
    log_ns: int
    data: bytes
    place: Place
    channel: int


class McapFile:
    """One file, which is open while it is entered, as often as wanted.

    Args:
        path: of it.

    Raises:
        FileFormatError: no such file, or no MCAP.
    """

    def __init__(self, path: Path) -> None:
        self.path = path
        self.about: dict[str, dict[str, str]] = {}
        """Metadata records by name, as far as the file was read."""
        self._decoders: dict[int, Callable[[bytes], Any] | str] = {}
        self._schemas: dict[int, Any] = {}
        self._channels: dict[int, Any] = {}
        self._last: tuple[int, list[Any]] = (-1, [])
        self._size = 0
        self._file: IO[bytes] = io.BytesIO()

    def __enter__(self) -> McapFile:
        path = self.path
        try:
            if not path.is_file():
                raise FileFormatError(f"cannot read the log {path}: it is no file")
            self._size = path.stat().st_size
            self._file = path.open("rb")
        except OSError as error:
            raise FileFormatError(f"cannot read the log {path}: {error.strerror}") from error
        if self._file.read(len(MAGIC)) != MAGIC:
            self._file.close()
            raise FileFormatError(f"{path} is no MCAP file: it does not begin as one")
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        self._file.close()
        self._last = (-1, [])

    def topics(self) -> dict[str, str]:
        """Topic → the name of its messages, as far as the file was read."""
        return {
            c.topic: self._schemas[c.schema_id].name if c.schema_id in self._schemas else "?"
            for c in self._channels.values()
        }

    def messages(self) -> Iterator[Told]:
        """Every message in the order of the file.

        Raises:
            FileFormatError: a damaged record, one that claims too much, or the file is cut off;
                says at which byte.
        """
        from mcap.opcode import Opcode

        offset, ended = len(MAGIC), False
        while not ended:
            opcode, length = self._head(offset)
            body = offset + _HEAD.size
            if opcode == Opcode.CHUNK:
                for number, record in enumerate(self._chunk(offset)):
                    yield from self._taken(record, (offset, number))
            elif opcode == Opcode.MESSAGE:
                yield from self._taken(self._alone(offset), (offset, -1))
            elif opcode in (Opcode.SCHEMA, Opcode.CHANNEL, Opcode.METADATA):
                record = self._record(opcode, offset)
                yield from self._taken(record, (offset, -1))
            ended = opcode == Opcode.FOOTER
            offset = body + length
        self._file.seek(offset)
        if self._file.read(len(MAGIC)) != MAGIC:
            raise self._cut(offset)

    def read(self, place: Place) -> bytes:
        """The content of a message that was met before."""
        offset, number = place
        record = self._alone(offset) if number < 0 else self._chunk(offset)[number]
        data: bytes = record.data
        return data

    def decoded(self, told: Told, data: bytes | None = None) -> Any:
        """A message as a ROS 2 object.

        Args:
            told: the message.
            data: another one of its channel.

        Raises:
            FileFormatError: it is not encoded as ROS 2 messages are, or damaged.
        """
        where = f"a log: topic {told.topic}"
        decoder = self._decoders.get(told.channel)
        if decoder is None:
            decoder = self._decoders[told.channel] = self._decoder(told)
        if isinstance(decoder, str):
            raise FileFormatError(decoder)
        with decoding(self.path, where):
            return decoder(told.data if data is None else data)

    def _decoder(self, told: Told) -> Callable[[bytes], Any] | str:
        from mcap_ros2.decoder import DecoderFactory

        channel = self._channels[told.channel]
        schema = self._schemas.get(channel.schema_id)
        with decoding(self.path, f"a log: the definition of topic {told.topic}"):
            decoder = DecoderFactory().decoder_for(channel.message_encoding, schema)
        if decoder is not None:
            found: Callable[[bytes], Any] = decoder
            return found
        how = "none" if schema is None else schema.encoding
        return (
            f"{self.path}: topic {told.topic} has messages in {channel.message_encoding!r} with a "
            f"definition in {how!r}: ROS 2 messages in 'cdr' with 'ros2msg' are read"
        )

    def _taken(self, record: Any, place: Place) -> Iterator[Told]:
        from mcap.records import Channel, Message, Metadata, Schema

        if isinstance(record, Schema):
            if len(self._schemas) >= MOST_SCHEMAS:
                raise FileFormatError(f"{self.path}: more than {MOST_SCHEMAS} message definitions")
            self._schemas[record.id] = record
        elif isinstance(record, Channel):
            self._channels[record.id] = record
        elif isinstance(record, Metadata):
            self.about.setdefault(record.name, record.metadata)
        elif isinstance(record, Message):
            channel = self._channels.get(record.channel_id)
            if channel is None:
                raise FileFormatError(
                    f"{self.path} is damaged at byte {place[0]}: a message of channel "
                    f"{record.channel_id}, which is not declared before"
                )
            yield Told(channel.topic, record.log_time, record.data, place, record.channel_id)

    def _head(self, offset: int) -> tuple[int, int]:
        """Opcode and length of the record at an offset, which is all there."""
        self._file.seek(offset)
        head = self._file.read(_HEAD.size)
        if len(head) < _HEAD.size:
            raise self._cut(offset)
        opcode, length = _HEAD.unpack(head)
        if offset + _HEAD.size + length > self._size:
            raise self._cut(offset)
        return opcode, length

    def _record(self, opcode: int, offset: int) -> Any:
        """The record at an offset, as the package reads it."""
        from mcap.stream_reader import StreamReader

        _, length = self._head(offset)
        if length > MOST_CHUNK_BYTES:
            raise FileFormatError(
                f"{self.path}: the record at byte {offset} has {length} bytes; at most "
                f"{MOST_CHUNK_BYTES} are read"
            )
        self._file.seek(offset)
        data = self._file.read(_HEAD.size + length)
        with decoding(self.path, f"an MCAP file: the record at byte {offset}"):
            reader = StreamReader(io.BytesIO(data), skip_magic=True, emit_chunks=True)
            return next(iter(reader.records))

    def _alone(self, offset: int) -> Any:
        from mcap.opcode import Opcode

        return self._record(Opcode.MESSAGE, offset)

    def _chunk(self, offset: int) -> list[Any]:
        """The records of the chunk at an offset, unpacked."""
        from mcap.opcode import Opcode
        from mcap.stream_reader import breakup_chunk

        if self._last[0] == offset:
            return self._last[1]
        self._last = (-1, [])
        chunk = self._record(Opcode.CHUNK, offset)
        where = f"an MCAP file: the chunk at byte {offset}"
        if chunk.uncompressed_size > MOST_CHUNK_BYTES:
            raise FileFormatError(
                f"{self.path}: the chunk at byte {offset} claims {chunk.uncompressed_size} bytes; "
                f"at most {MOST_CHUNK_BYTES} are read"
            )
        with decoding(self.path, where):
            data = _unpacked(chunk)
            if len(data) != chunk.uncompressed_size:
                raise ValueError(f"{len(data)} bytes instead of {chunk.uncompressed_size}")
            if chunk.uncompressed_crc and zlib.crc32(data) != chunk.uncompressed_crc:
                raise ValueError("its checksum does not fit: it is damaged")
            records: list[Any] = breakup_chunk(replace(chunk, compression="", data=data))
        self._last = (offset, records)
        return records

    def _cut(self, offset: int) -> FileFormatError:
        return FileFormatError(f"{self.path} is cut off at byte {offset}: {_RECOVER}")


def _unpacked(chunk: Any) -> bytes:
    """What a chunk has, never more than it says."""
    most = chunk.uncompressed_size
    if chunk.compression == "zstd":
        import zstandard

        claimed = zstandard.frame_content_size(chunk.data)
        if claimed > most:
            raise ValueError(f"it unpacks to {claimed} bytes and says {most}")
        packed: bytes = zstandard.ZstdDecompressor().decompress(chunk.data, max_output_size=most)
        return packed
    if chunk.compression == "lz4":
        from lz4.frame import LZ4FrameDecompressor

        unpacked: bytes = LZ4FrameDecompressor().decompress(chunk.data, max_length=most + 1)
        return unpacked
    if chunk.compression:
        raise ValueError(f"packed with {chunk.compression!r}, which is not read")
    data: bytes = chunk.data
    return data
