"""Reading by columns is held to reading frame by frame: the same frames, and of any objects the same values."""

from __future__ import annotations

import itertools
import random
from collections import defaultdict
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from typing import Final

import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st

from app.model.address import Address
from app.model.description import Description
from app.model.description_file import load_builtin
from app.recording.columns import SOURCES, CanColumns, Samples, Signal, blocks, can_columns, samples
from app.recording.columns.listening import Listening, Wanted
from app.recording.part import Batch, Identity, Part
from app.recording.reader import open_recording
from app.wire.decoder import CanOpenDecoder
from app.wire.frame import Frame
from app.wire.records import Source, ValueSeen
from tests.recording import columns_traffic
from tests.recording.rig import INFO
from tests.wire import traffic as conversation

SCENARIOS: Final = Path(__file__).resolve().parents[2] / "recordings" / "scenarios"
SMALL_BLOCK: Final = 1
Value = tuple[int, bytes, Source]


def described(buses: Iterable[str]) -> dict[tuple[str, int], Description]:
    pmm, pmc = load_builtin("oat-pmm"), load_builtin("oat-pmc")
    return {(bus, node): pmm if node < 10 else pmc for bus in buses for node in (1, 3, 11, 12, 13)}


def streamed(frames: Iterable[Frame], descriptions: Mapping[tuple[str, int], Description]) -> dict[Signal, list[Value]]:
    """All values as the decoder sees them, frame by frame."""
    decoders: dict[str, CanOpenDecoder] = {}
    found: defaultdict[Signal, list[Value]] = defaultdict(list)
    for frame in frames:
        if frame.bus not in decoders:
            known = {node: one for (bus, node), one in descriptions.items() if bus == frame.bus}
            decoders[frame.bus] = CanOpenDecoder(frame.bus, known)
        for record in decoders[frame.bus].feed(frame):
            if isinstance(record, ValueSeen):
                signal = Signal(record.bus, record.node, record.address)
                found[signal].append((record.t_ns, record.data, record.source))
    return dict(found)


def values(found: Samples) -> list[Value]:
    return [
        (t_ns, found.data(n), SOURCES[source])
        for n, (t_ns, source) in enumerate(zip(found.t_ns.tolist(), found.source.tolist(), strict=True))
    ]


def write(path: Path, frames: Sequence[Frame], chance: random.Random) -> Path:
    """A recording whose chunks end anywhere, and overlap here and there."""
    part = Part(path, Identity("columns", 1, 0, 0), INFO)
    borders = sorted(chance.randrange(len(frames) + 1) for _ in range(chance.randrange(6)))
    batches = [list(frames[a:b]) for a, b in zip([0, *borders], [*borders, len(frames)], strict=True)]
    for first, second in itertools.pairwise(batches):
        late = min(chance.choice((0, 0, 1, 3, 40)), len(first))
        moved = (
            chance.sample(range(len(first)), late) if chance.random() < 0.2 else range(len(first) - late, len(first))
        )
        for n in sorted(moved, reverse=True):
            second.insert(0, first.pop(n))
    for batch in batches:
        part.append(Batch(batch))
    part.finish(0, 0)
    return path


def frames_of_columns(columns: CanColumns) -> list[Frame]:
    return [columns.frame(row) for row in range(columns.frames)]


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return tmp_path_factory.mktemp("columns")


@settings(max_examples=120, deadline=None, derandomize=True)
@given(
    seed=st.integers(0, 1 << 30),
    count=st.integers(1, 900),
    buses=st.sampled_from([("can0",), ("can0",), columns_traffic.BUSES]),
    in_small_blocks=st.booleans(),
    workers=st.sampled_from([1, 3]),
    share=st.sampled_from([0.05, 0.3, 1.0]),
)
@example(seed=0, count=285, buses=("can0",), in_small_blocks=False, workers=1, share=1.0)  # boot-ups one after another
def test_random_traffic_gives_the_same_frames_and_values(
    folder: Path, seed: int, count: int, buses: tuple[str, ...], in_small_blocks: bool, workers: int, share: float
) -> None:
    chance = random.Random(seed)
    path = write(folder / "random.mcap", columns_traffic.frames(seed, count, buses), chance)
    try:
        with pytest.MonkeyPatch.context() as patch, open_recording(path, strict=True) as recording:
            if in_small_blocks:
                patch.setattr(blocks, "BLOCK_BYTES", SMALL_BLOCK)
            frames = list(recording.frames())
            descriptions = described(buses)
            seen = streamed(frames, descriptions)
            by_bus = {bus: [frame for frame in frames if frame.bus == bus] for bus in buses}
            got: defaultdict[str, list[Frame]] = defaultdict(list)
            for columns in can_columns(recording, workers=workers):
                got[columns.bus] += frames_of_columns(columns)
            assert got == {bus: mine for bus, mine in by_bus.items() if mine}
            never = [Signal(bus, 2, Address(0x5FFF, 1)) for bus in buses]
            wanted = [signal for signal in seen if chance.random() < share] + never
            found = samples(recording, wanted, descriptions, workers=workers)
    finally:
        path.unlink()
    assert set(found) == set(wanted)
    for signal in wanted:
        assert values(found[signal]) == seen.get(signal, []), signal


@pytest.mark.parametrize("name", sorted(path.name for path in SCENARIOS.glob("*.mcap")))
def test_every_value_of_a_scenario_is_the_same(name: str) -> None:
    descriptions = described(["can0"])
    with open_recording(SCENARIOS / name, strict=True) as recording:
        seen = streamed(recording.frames(), descriptions)
        found = samples(recording, list(seen), descriptions)
    assert {signal: values(found[signal]) for signal in seen} == seen


def test_segments_of_a_block_download_that_look_like_writes_are_none(tmp_path: Path) -> None:
    """Segment 35 of a block begins like an expedited write to 1801h:01; taken for one, its PDO would be given up."""
    lines = conversation.write(Address(0x1801, 1), (0x4000028B).to_bytes(4, "little"))
    data = bytes(34 * 7) + b"\x01\x18\x01\0\0\0\x80" + bytes(7 * 5)
    lines += conversation.block_write(columns_traffic.UNLISTED, data)
    lines += conversation.read(Address(0x6041), b"\x37\x02")
    frames = conversation.frames(11, lines, t_ns=1_750_000_000_000_000_000)
    frames.append(conversation.frame(frames[-1].t_ns + 1000, 0x28B, bytes(range(8))))
    path = write(tmp_path / "block.mcap", frames, random.Random(1))
    descriptions, position = described(["can0"]), Signal("can0", 11, Address(0x6064))
    seen = streamed(frames, descriptions)
    assert seen[position] == [(frames[-1].t_ns, bytes(range(2, 6)), Source.PDO_TX)]
    assert values(samples(path, [position], descriptions)[position]) == seen[position]


def test_identifiers_keep_their_meaning_while_others_learn_theirs() -> None:
    decoder = CanOpenDecoder("can0", {11: load_builtin("oat-pmc"), 12: load_builtin("oat-pmc")})
    listening = Listening(decoder, Wanted([(11, Address(0x6064))]))

    def learn(node: int, address: Address, raw: int) -> bool:
        before = decoder.layouts
        decoder.feed_all(conversation.frames(node, conversation.write(address, raw.to_bytes(4, "little"))))
        assert decoder.layouts > before
        return listening.holds(decoder)

    assert learn(12, Address(0x1801, 1), 0x3A0), "a PDO of a node that nobody looks at"
    assert not learn(11, Address(0x1801, 1), 0x3A1)
    listening = Listening(decoder, Wanted([(11, Address(0x6064))]))
    assert not learn(12, Address(0x1014), 0x2A5), "an identifier of EMCY wins over a PDO, whosever it is"
