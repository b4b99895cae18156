"""The golden file: what is written today is what was written then, record for record, and reads back."""

from __future__ import annotations

import struct
from pathlib import Path

from mcap.records import Chunk
from mcap.stream_reader import StreamReader

from app.recording.chunks import chunk_data
from app.recording.content import AttachedFile, Keyframe
from app.recording.reader import open_recording
from app.wire.frame import Can
from tests.recording.make_golden import ATTACHMENTS, GOLDEN, INFO, STATE, T_NS, clocks, events, frames, make
from tests.recording.rig import by_mcap


def records(path: Path) -> list[tuple[str, bytes | str]]:
    """The records of the data section; of a chunk its uncompressed content, which no version of zstd changes."""
    found: list[tuple[str, bytes | str]] = []
    with path.open("rb") as stream:
        for record in StreamReader(stream, emit_chunks=True, validate_crcs=True).records:
            name = type(record).__name__
            if name == "DataEnd":
                return found
            found.append((name, chunk_data(record) if isinstance(record, Chunk) else repr(record)))
    raise AssertionError("the data section does not end")


def test_the_same_content_makes_the_same_file(tmp_path: Path) -> None:
    path = tmp_path / "again.mcap"
    make(path)
    assert records(path) == records(GOLDEN)


def test_all_content_reads_back() -> None:
    with open_recording(GOLDEN, strict=True) as recording:
        assert list(recording.frames()) == frames()
        assert list(recording.clocks()) == clocks()
        assert list(recording.events()) == events()
        assert list(recording.keyframes()) == [Keyframe(T_NS, STATE)]
        assert recording.attachments() == [AttachedFile(*each) for each in ATTACHMENTS]
        assert recording.info == INFO
        assert recording.totals == (11, 3, T_NS + 200_000_000)


def test_mcap_decodes_every_message_of_it() -> None:
    topics = [topic for topic, _, _ in by_mcap(GOLDEN)]
    counts = {topic: topics.count(topic) for topic in topics}
    assert counts == {"/can0": 9, "/modbus0": 1, "/dp0": 1, "/clock": 2, "/state": 1, "/events": 2}


def test_the_bytes_of_a_can_message_are_those_of_the_contract() -> None:
    """Written out by hand from ``docs/recording-format.md``."""
    chunk = next(content for name, content in records(GOLDEN) if name == "Chunk")
    seconds, nanoseconds = divmod(T_NS, 1_000_000_000)
    assert isinstance(chunk, bytes)
    assert chunk[:71] == (
        b"\x05" + struct.pack("<Q", 62)  # message record, 62 bytes follow
        + struct.pack("<HIQQ", 4, 0, T_NS, T_NS)  # channel, sequence, log time, publish time
        + b"\x00\x01\x00\x00"  # CDR, little-endian
        + struct.pack("<iI", seconds, nanoseconds)
        + struct.pack("<I", 8) + b"can0/tx\x00"
        + struct.pack("<I", 0x000)
        + b"\x00\x00\x00\x02"  # is_rtr, is_extended, is_error, dlc
        + b"\x01\x0b" + bytes(6)
    )  # fmt: skip


def test_the_sample_of_six_nodes_is_whole() -> None:
    with open_recording(GOLDEN.with_name("oat-six-nodes.mcap"), strict=True) as recording:
        payloads = [frame.payload for frame in recording.frames()]
        answering = {can.can_id & 0x7F for can in payloads if isinstance(can, Can) and can.can_id & 0x780 == 0x580}
        assert answering == {1, 2, 3, 11, 12, 13}
        assert len(list(recording.keyframes())) == 2
        assert {each.name for each in recording.attachments()} == {"oat-pmm.json", "oat-pmc.json"}
