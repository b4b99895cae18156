"""tshark dissects what we export as candump: the same transfers, commands and states as our decoder sees."""

from __future__ import annotations

import shutil
import subprocess
from collections import Counter
from collections.abc import Iterator
from pathlib import Path

import pytest

from app.model.description_file import load_builtin
from app.recording.exchange.exporting import Choice, export
from app.recording.exchange.formats import Format
from app.recording.reader import open_recording
from app.wire.decoder import CanOpenDecoder
from app.wire.frame import Can, Frame
from app.wire.nmt import NmtState
from app.wire.records import BootUpSeen, EmcySeen, NmtCommandSeen, Outcome, Record, SdoSeen, StateSeen, SyncSeen
from tests.recording.test_scenarios import PMCS, PMMS, SCRIPTS

FIELDS = (
    "can.id",
    "can.len",
    "canopen.sdo.cmd",
    "canopen.sdo.main_idx",
    "canopen.sdo.sub_idx",
    "canopen.sdo.abort_code",
    "canopen.nmt_ctrl.cd",
    "canopen.nmt_ctrl.node_id",
    "canopen.nmt_guard.state",
    "canopen.em.err_code",
    "frame.time_epoch",
)
SDO_REQUEST, SDO_RESPONSE, SYNC = 0x600, 0x580, 0x80


class Tallies:
    """What somebody has understood of a recording, counted."""

    def __init__(self) -> None:
        self.identifiers: Counter[tuple[int, int]] = Counter()
        self.transfers: Counter[tuple[int, int, int]] = Counter()
        self.aborts: Counter[tuple[int, int]] = Counter()
        self.commands: Counter[tuple[int, int]] = Counter()
        self.states: Counter[tuple[int, int]] = Counter()
        self.emergencies: Counter[tuple[int, int]] = Counter()
        self.syncs = 0

    def of_row(self, row: dict[str, str]) -> None:
        """Take what tshark says of a frame."""
        number = {name: int(text, 0) for name, text in row.items() if text and name != "frame.time_epoch"}
        can_id = number["can.id"]
        self.identifiers[can_id, number.get("can.len", 0)] += 1
        node = can_id & 0x7F
        if "canopen.sdo.abort_code" in number:
            self.aborts[node, number["canopen.sdo.abort_code"]] += 1
        elif can_id & 0x780 == SDO_REQUEST and "canopen.sdo.main_idx" in number:
            self.transfers[node, number["canopen.sdo.main_idx"], number["canopen.sdo.sub_idx"]] += 1
        if "canopen.nmt_ctrl.cd" in number:
            self.commands[number["canopen.nmt_ctrl.node_id"], number["canopen.nmt_ctrl.cd"]] += 1
        if "canopen.nmt_guard.state" in number:
            self.states[node, number["canopen.nmt_guard.state"]] += 1
        if "canopen.em.err_code" in number:
            self.emergencies[node, number["canopen.em.err_code"]] += 1
        self.syncs += can_id == SYNC

    def of_frame(self, frame: Frame) -> None:
        """Take a frame itself."""
        assert isinstance(frame.payload, Can)
        self.identifiers[frame.payload.can_id, frame.payload.length] += 1

    def of_record(self, record: Record) -> None:
        """Take what our decoder says."""
        if isinstance(record, SdoSeen):
            self.transfers[record.node, record.address.major, record.address.minor] += 1
            if record.outcome is Outcome.ABORTED and record.abort_code is not None:
                self.aborts[record.node, record.abort_code] += 1
        elif isinstance(record, NmtCommandSeen):
            self.commands[record.node, record.command.value] += 1
        elif isinstance(record, StateSeen):
            self.states[record.node, record.state.value] += 1
        elif isinstance(record, BootUpSeen):
            self.states[record.node, NmtState.BOOT_UP.value] += 1
        elif isinstance(record, EmcySeen):
            self.emergencies[record.node, record.code] += 1
        elif isinstance(record, SyncSeen):
            self.syncs += 1


def dissected(path: Path) -> Iterator[dict[str, str]]:
    """What tshark says of each frame."""
    program = shutil.which("tshark")
    assert program is not None, "tshark is missing: make system"
    options = [option for name in FIELDS for option in ("-e", name)]
    command = [program, "-r", str(path), "-d", "can.subdissector,canopen", "-T", "fields", *options]
    done = subprocess.run(command, capture_output=True, text=True, check=True, timeout=60)
    for line in done.stdout.splitlines():
        yield dict(zip(FIELDS, line.split("\t"), strict=True))


@pytest.mark.parametrize("script", SCRIPTS, ids=lambda path: path.stem)
def test_tshark_understands_the_export_as_our_decoder_does(script: Path, tmp_path: Path) -> None:
    log = tmp_path / "export.log"
    decoder = CanOpenDecoder(
        "can0", dict.fromkeys(PMMS, load_builtin("oat-pmm")) | dict.fromkeys(PMCS, load_builtin("oat-pmc"))
    )
    ours, theirs, times = Tallies(), Tallies(), []
    with open_recording(script.with_suffix(".mcap"), strict=True) as recording:
        export(recording, log, Choice(Format.CANDUMP))
        for frame in recording.frames():
            ours.of_frame(frame)
            times.append(frame.t_ns // 1000)
            for record in decoder.feed(frame):
                ours.of_record(record)
    for node in (*PMMS, *PMCS):  # a transfer that is open at the end has a request and no outcome yet
        address = decoder.sdo(node).address
        if address is not None:
            ours.transfers[node, address.major, address.minor] += 1
    seen = []
    for row in dissected(log):
        theirs.of_row(row)
        seen.append(int(row["frame.time_epoch"].replace(".", "")) // 1000)
    assert seen == times
    assert theirs.identifiers == ours.identifiers
    assert theirs.transfers == ours.transfers
    assert theirs.aborts == ours.aborts
    assert theirs.commands == ours.commands
    assert theirs.states == ours.states
    assert theirs.emergencies == ours.emergencies
    assert theirs.syncs == ours.syncs
    assert sum(ours.transfers.values()) > 100
    assert sum(ours.states.values()) > 100
