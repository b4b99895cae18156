"""A replay at its own speed, for ten minutes: the cursor keeps the time of the clock, and nothing is left out."""

from __future__ import annotations

import time
from collections.abc import Iterator
from pathlib import Path
from typing import Final

import pytest

from app.recording.part import Batch, Identity, Part
from app.recording.reader import open_recording
from app.service.replay.orders import Play
from app.service.replay.session import Session
from app.service.replay.source import Source
from app.service.replay.stage import ReplayStage
from app.wire.frame import Frame
from tests.service.replay.test_session import SCENARIOS, state_of

NORMAL: Final = SCENARIOS / "1-normal-operation.mcap"
DRIFT_NS: Final = 1_000_000
PLAYED_S: Final = 600.0
LOOKED_S: Final = 5.0
"""The least lag of so many seconds counts: how late a thread is woken on a busy machine is no drift."""


@pytest.fixture(scope="module")
def long_recording(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Normal operation, seven times in a row: more than eleven minutes."""
    path = tmp_path_factory.mktemp("long") / "long-001.mcap"
    with open_recording(NORMAL) as recording:
        span = recording.span_ns
        assert span is not None
        part = Part(path, Identity("long", 1, span[0], span[0]), recording.info, recording.attachments())
        frames = list(recording.frames())
    every_ns = span[1] - span[0] + 20_000_000
    for turn in range(7):
        part.append(Batch(frames=[_later(frame, turn * every_ns) for frame in frames]))
    part.finish(span[1] + 7 * every_ns, 0)
    return path


def _later(frame: Frame, by_ns: int) -> Frame:
    return frame._replace(t_ns=frame.t_ns + by_ns - by_ns % 512, t_adapter_ns=None)


@pytest.fixture
def session(long_recording: Path) -> Iterator[Session]:
    opened = Session(Source(long_recording, {}), time.monotonic_ns)
    yield opened
    opened.close()


def lag_ns(session: Session, zero_ns: int) -> int:
    """How far the cursor is behind the clock, at best, within some seconds."""
    least = 1 << 62
    until = time.monotonic() + LOOKED_S
    while time.monotonic() < until:
        shown_ns = session.now_ns()
        least = min(least, time.monotonic_ns() - shown_ns - zero_ns)
        time.sleep(0.0005)
    return least


@pytest.mark.soak
@pytest.mark.timeout(1200)
def test_ten_minutes_at_speed_1_drift_by_less_than_a_millisecond(session: Session) -> None:
    session.order(Play(1.0)).result(30)
    zero_ns = time.monotonic_ns() - session.now_ns()
    first_ns = lag_ns(session, zero_ns)
    until = time.monotonic() + PLAYED_S
    while time.monotonic() < until:
        assert session.cursor().playing
        time.sleep(1.0)
    drift_ns = lag_ns(session, zero_ns) - first_ns
    assert abs(drift_ns) < DRIFT_NS, f"{drift_ns / 1e6:.3f} ms in {PLAYED_S} s"
    session.close()
    played = session.stage
    assert isinstance(played, ReplayStage)
    source = Source(session.source.path, {})
    straight = ReplayStage(source, None, lambda: 0)
    straight.advance(played.t_ns, lambda: False)
    assert played.buses["can0"].frames == straight.buses["can0"].frames
    assert state_of(played) == state_of(straight)
    source.close()
