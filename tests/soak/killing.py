"""One kill: numbered traffic, a connection that records it, SIGKILL, a restart, and what is left by then."""

from __future__ import annotations

import os
import random
import signal
import time
from collections.abc import Iterator, Sequence
from contextlib import suppress
from pathlib import Path
from typing import Final, NamedTuple

import numpy as np

from app.recording.cdr import can_dtype
from app.recording.reader import open_recording
from app.recording.recover import recover_all
from app.recording.schemas import bus_topic
from bench._process import Child
from tests.recording.rig import by_mcap, files
from tests.soak.numbered import TICKS, Columns, Numbers, wrong

NS: Final = 1_000_000_000
MAX_LOSS_NS: Final = NS // 2
WITNESSED_NS: Final = 3 * MAX_LOSS_NS
"""So long before a kill the feeder's own waits tell whether the machine stood still."""
LATE_NS: Final = 5_000_000
START_TIMEOUT_S: Final = 120.0
"""A busy machine takes its time to start a process."""
POLL_S: Final = 0.005
MOST_S: Final = 60.0
RECOVERY_S: Final = 0.03
"""About what the recovery of a file takes."""


class Plan(NamedTuple):
    """What is sent, and when it ends: ``after_s`` from the first frame, or from the start of the process.

    ``restarts_s``: restarts that are killed as well, so long after each began to recover the files.
    """

    rate: int
    buses: int
    after_s: float
    from_start: bool
    restarts_s: tuple[float, ...] = ()


class Outcome(NamedTuple):
    """What a kill cost. ``loss_ns``: from the kill back to the first frame that is missing, 0 where none is.

    ``stall_ns``: how long the machine let the feeder wait beyond what it had asked for, shortly before the kill.
    """

    plan: Plan
    frames: int
    loss_ns: int
    stall_ns: int
    faults: tuple[str, ...]


class Verdict(NamedTuple):
    """What many kills show. ``faults`` is empty where the promise was kept; ``summary`` is for people."""

    faults: tuple[str, ...]
    frames: int
    summary: str


def verdict(outcomes: Sequence[Outcome]) -> Verdict:
    """Half a second at most; where the machine stood still meanwhile, so much more."""
    faults = [f"{outcome.plan}: {fault}" for outcome in outcomes for fault in outcome.faults]
    for outcome in outcomes:
        if outcome.loss_ns > MAX_LOSS_NS + outcome.stall_ns:
            faults.append(
                f"{outcome.loss_ns / 1e6:.0f} ms lost, the machine stood still {outcome.stall_ns / 1e6:.0f} ms"
            )
    losses_ms = sorted(outcome.loss_ns / 1e6 for outcome in outcomes)
    stalled = sum(MAX_LOSS_NS < outcome.loss_ns <= MAX_LOSS_NS + outcome.stall_ns for outcome in outcomes)
    frames = sum(outcome.frames for outcome in outcomes)
    summary = (
        f"{len(outcomes)} kills, {frames} frames kept; lost: median {losses_ms[len(losses_ms) // 2]:.0f} ms, "
        f"most {losses_ms[-1]:.0f} ms; {stalled} with the machine at a standstill"
    )
    return Verdict(tuple(faults), frames, summary)


def plan(chance: random.Random) -> Plan:
    """From a quiet bus to three busy ones; every fifth kill may come while the connection is still being made."""
    buses = chance.choice((1, 1, 1, 2, 3))
    rate = chance.choice((50, 300, 1000, 2500, 6000)) // buses
    from_start = chance.random() < 0.2
    after_s = chance.uniform(0.0, 0.6) if from_start else chance.uniform(0.0, 2.5)
    restarts_s = tuple(chance.uniform(0.0, RECOVERY_S) for _ in range(chance.choice((0, 0, 1, 2))))
    return Plan(rate, buses, after_s, from_start, restarts_s)


def kill_once(zygote: Child, folder: Path, plan: Plan) -> Outcome:
    """Do it. ``zygote`` runs ``tests.soak.recorder_process``; one caller at a time."""
    folder.mkdir()
    ticks = folder / "ticks"
    with Child("tests.soak.feeder", str(ticks), str(plan.rate), str(MOST_S), str(plan.buses)) as feeder:
        ports = feeder.hear(START_TIMEOUT_S)["ports"]
        zygote.tell(folder=str(folder / "rec"), ports=ports)
        pid = zygote.hear(START_TIMEOUT_S)["pid"]
        try:
            if not plan.from_start:
                _wait_for_frames(ticks, plan.buses)
            time.sleep(plan.after_s)
        finally:
            killed_ns = time.monotonic_ns()
            _kill(pid)
    for after_s in plan.restarts_s:
        zygote.tell(recover=str(folder / "rec"))
        pid = zygote.hear(START_TIMEOUT_S)["pid"]
        time.sleep(after_s)
        _kill(pid)
    return judge(plan, folder, killed_ns)


def _wait_for_frames(ticks: Path, buses: int) -> None:
    deadline = time.monotonic() + START_TIMEOUT_S
    while len(np.unique(read_ticks(ticks)["bus"])) < buses:
        if time.monotonic() > deadline:
            raise TimeoutError("no frame was sent")
        time.sleep(POLL_S)


def _kill(pid: int) -> None:
    """Kill a process, where it has not ended by itself, and wait until it is gone."""
    deadline = time.monotonic() + START_TIMEOUT_S
    with suppress(ProcessLookupError):
        os.kill(pid, signal.SIGKILL)
        while time.monotonic() < deadline:
            os.kill(pid, 0)
            time.sleep(POLL_S)
        raise TimeoutError(f"process {pid} does not end")


def read_ticks(path: Path) -> np.ndarray[tuple[int], np.dtype[np.void]]:
    """What the feeder noted so far."""
    data = path.read_bytes()
    return np.frombuffer(data[: len(data) - len(data) % TICKS.itemsize], TICKS)


def judge(plan: Plan, folder: Path, killed_ns: int) -> Outcome:
    """Restart, read, compare with what was sent."""
    ticks = read_ticks(folder / "ticks")
    ticks = ticks[ticks["t_ns"] <= killed_ns]
    faults = list(_recover(folder / "rec"))
    frames, loss_ns = 0, 0
    for bus in range(plan.buses):
        columns = recorded(folder / "rec", f"can{bus}")
        frames += len(columns.numbers)
        faults += _order_faults(f"can{bus}", columns)
        loss_ns = max(loss_ns, _loss_ns(ticks[ticks["bus"] == bus], len(columns.numbers), killed_ns))
    before = ticks[ticks["t_ns"] >= killed_ns - WITNESSED_NS]
    late_ns = before["late_ns"][before["late_ns"] > LATE_NS]
    return Outcome(plan, frames, loss_ns, int(late_ns.sum()) // plan.buses, tuple(faults))


def _recover(folder: Path) -> Iterator[str]:
    """What a restart does, and whether every file is whole for our reader and for ``mcap`` afterwards."""
    if not folder.is_dir():
        return
    told = {each.file: each for each in recover_all(folder, time.time_ns())}
    for path in files(folder):
        with open_recording(path, strict=True) as recording:
            ours = sum(count for topic, count in recording.topics.items() if topic.startswith("/can"))
            if not recording.finished:
                yield f"{path.name} is not finished"
        theirs = sum(topic.startswith("/can") for topic, _, _ in by_mcap(path))
        if ours != theirs or (path in told and told[path].frames != ours):
            yield f"{path.name}: {ours} frames, {theirs} by mcap, {told.get(path)}"
    if recover_all(folder, time.time_ns()):
        yield "there was something to recover a second time"


def recorded(folder: Path, bus: str) -> Columns:
    """All frames of a bus, in the order of the files."""
    parts: list[Columns] = []
    for path in files(folder):
        with open_recording(path, strict=True) as recording:
            numbers = {number for number, channel in recording.channels.items() if channel.topic == bus_topic(bus)}
            for body, _ in recording.bodies():
                if body.channel_id in numbers:
                    parts.append(_columns(bus, body.data))
    empty = np.empty(0, np.uint32)
    if not parts:
        return Columns(empty, empty, empty)
    return Columns(*(np.concatenate(column) for column in zip(*parts, strict=True)))


def _columns(bus: str, data: bytes) -> Columns:
    layout = can_dtype(bus)
    rows = np.frombuffer(data, np.uint8).reshape(-1, layout.itemsize)
    words = np.ascontiguousarray(rows[:, -8:]).view("<u4")
    identifiers: Numbers = np.frombuffer(data, layout)["id"].astype(np.uint32)
    return Columns(identifiers, words[:, 0].copy(), words[:, 1].copy())


def _order_faults(bus: str, columns: Columns) -> Iterator[str]:
    if not np.array_equal(columns.numbers, np.arange(len(columns.numbers), dtype=np.uint32)):
        yield f"{bus}: something is missing before the end, or in another order"
    if wrong(columns):
        yield f"{bus}: {wrong(columns)} frames are not what was sent"


def _loss_ns(ticks: np.ndarray[tuple[int], np.dtype[np.void]], frames: int, killed_ns: int) -> int:
    """From the kill back to the time when the first missing frame was in the hands of the system."""
    missing = ticks[ticks["sent"] > frames]
    return killed_ns - int(missing["t_ns"][0]) if len(missing) else 0
