"""A replay of real recordings: whichever way one comes to a time, the state there is that of all frames before."""

from __future__ import annotations

import contextlib
import os
import random
import shutil
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

from app.errors import HubsideError, RecordingError, ReplayEndedError, UsageError
from app.recording.content import EventKind, Keyframe
from app.recording.index import build_index
from app.recording.part import Batch, Identity, Part
from app.recording.reader import open_recording
from app.service.replay.orders import Pause, Play, Seek, SetLoop, SetSpeed, StepEvent, StepFrame, StepTime
from app.service.replay.session import Session
from app.service.replay.source import Source
from app.service.replay.stage import ReplayStage
from app.service.replay.transport import Loop
from tests.e2e.processes import ROOT

SCENARIOS = ROOT / "recordings" / "scenarios"
DROPS_OUT = SCENARIOS / "6-node-drops-out.mcap"
TRIP = SCENARIOS / "3-following-error.mcap"
S = 1_000_000_000
DEADLINE_S = 20.0


@pytest.fixture
def session() -> Iterator[Session]:
    opened = Session(Source(TRIP, {}), time.monotonic_ns)
    yield opened
    opened.close()


@pytest.mark.parametrize(("seconds", "expected_s"), [(33, 33), (-5, 0)])
def test_it_stands_at_the_asked_place_from_the_first(seconds: int, expected_s: int) -> None:
    source = Source(TRIP, {})
    session = Session(source, time.monotonic_ns, source.from_ns + seconds * S)
    session.opened.result(DEADLINE_S)
    assert session.cursor().t_ns == source.from_ns + expected_s * S
    session.close()


def state_of(stage: ReplayStage) -> dict[str, Any]:
    """All that is known, but for versions, which count changes. A keyframe holds the last 200 events.

    Whoever recorded looked for overdue heartbeats at tenths of a second of his own: the time of finding one differs.
    """
    state = stage.live.snapshot()
    events = [dict(event) for event in state["events"][-100:]]
    for event in events:
        del event["version"]
        if event["kind"] == "heartbeat_lost":
            del event["t_ns"]
    return {**state, "events": events, "decoders": {name: bus.decoder.snapshot() for name, bus in stage.buses.items()}}


@pytest.mark.parametrize("path", [DROPS_OUT, TRIP, SCENARIOS / "7-service-visit.mcap"], ids=lambda path: path.stem)
def test_a_seek_gives_the_state_that_all_frames_before_give(path: Path) -> None:
    source = Source(path, {})
    times = sorted(random.Random(path.name).sample(range(source.from_ns + 6 * S, source.to_ns), 5))
    straight = ReplayStage(source, None, lambda: 0)
    opened = Source(path, {})
    session = Session(opened, time.monotonic_ns)
    for t_ns in times:
        straight.advance(t_ns, lambda: False)
        session.order(Seek(t_ns + 5 * S)).result(DEADLINE_S)  # from behind, so that it cannot come on foot
        assert session.order(Seek(t_ns)).result(DEADLINE_S).t_ns == t_ns
        assert isinstance(session.stage, ReplayStage)
        assert state_of(session.stage) == state_of(straight)
    session.close()
    source.close()


def test_playing_gives_the_same_state_as_seeking(session: Session) -> None:
    begin = session.source.from_ns + 24 * S
    session.order(Seek(begin)).result(DEADLINE_S)
    session.order(Play(20.0)).result(DEADLINE_S)
    wait_for(lambda: session.cursor().t_ns > begin + 6 * S)
    stopped = session.order(Pause()).result(DEADLINE_S)
    assert isinstance(session.stage, ReplayStage)
    played = state_of(session.stage)
    assert session.stage.t_ns == stopped.t_ns
    session.order(Seek(begin)).result(DEADLINE_S)
    session.order(Seek(stopped.t_ns)).result(DEADLINE_S)
    assert state_of(session.stage) == played


def test_it_shows_the_speed_that_it_attains(session: Session) -> None:
    session.order(Play(2.0)).result(DEADLINE_S)
    wait_for(lambda: session.cursor().t_ns > session.source.from_ns + 3 * S)
    line = session.cursor()
    assert line.playing
    assert line.speed == 2.0
    assert line.attained is not None
    assert 0 < line.attained <= 2.2


def test_steps_by_frame_lead_from_one_frame_to_the_next_and_back(session: Session) -> None:
    with open_recording(TRIP) as recording:
        begin = session.source.from_ns + 10 * S
        times = [frame.t_ns for frame in recording.frames(begin, begin + S // 10)][:20]
    session.order(Seek(times[0])).result(DEADLINE_S)
    forwards = [session.order(StepFrame(True)).result(DEADLINE_S).t_ns for _ in times[1:]]
    assert forwards == times[1:]
    back = [session.order(StepFrame(False)).result(DEADLINE_S).t_ns for _ in times[1:]]
    assert back == times[-2::-1]
    assert session.order(StepTime(-5 * S)).result(DEADLINE_S).t_ns == times[0] - 5 * S


def test_steps_by_event_lead_to_the_trip_once_there_is_an_index(tmp_path: Path) -> None:
    with open_recording(TRIP) as recording:
        build_index(TRIP, recording.descriptions, cache=tmp_path).close()
    session = Session(Source(TRIP, {}, tmp_path), time.monotonic_ns)
    begin = session.source.from_ns
    session.order(Seek(begin + 20 * S)).result(DEADLINE_S)
    trip = session.order(StepEvent(True)).result(DEADLINE_S).t_ns - begin
    assert 26.4e9 < trip < 26.6e9
    after = session.order(Seek(session.source.to_ns)).result(DEADLINE_S).t_ns
    while (before := session.order(StepEvent(False)).result(DEADLINE_S).t_ns) < after:
        after = before
    assert after == begin + trip  # nothing had gone wrong before
    session.close()


def test_without_an_index_steps_by_event_lead_to_what_was_noted(session: Session) -> None:
    noted = [event.t_ns for event in session.source.events]
    session.order(Seek(session.source.from_ns)).result(DEADLINE_S)
    assert session.order(StepEvent(True)).result(DEADLINE_S).t_ns == min(t for t in noted if t > session.source.from_ns)


def test_what_was_noted_is_told_as_the_cursor_passes_it_and_only_then(session: Session) -> None:
    event = next(
        one for one in session.source.events if one.kind is EventKind.NOTE and one.t_ns > session.source.from_ns + S
    )
    session.order(Seek(event.t_ns - S)).result(DEADLINE_S)
    heard: list[int] = []
    session.listen(lambda line: heard.append(line.t_ns))
    assert event.t_ns not in [line.t_ns for line in session.noted()]
    session.order(Seek(event.t_ns + 1)).result(DEADLINE_S)
    assert heard == [event.t_ns]
    assert event.t_ns in [line.t_ns for line in session.noted()]


def test_a_loop_is_played_over_and_over(session: Session) -> None:
    begin = session.source.from_ns + 20 * S
    session.order(SetLoop(Loop(begin, begin + S))).result(DEADLINE_S)
    session.order(Seek(begin)).result(DEADLINE_S)
    epoch = session.epoch
    session.order(Play(10.0)).result(DEADLINE_S)
    wait_for(lambda: session.epoch >= epoch + 3)
    assert begin <= session.cursor().t_ns <= begin + S


def test_at_its_end_it_stands_still(session: Session) -> None:
    session.order(Seek(session.source.to_ns - S)).result(DEADLINE_S)
    session.order(Play(10.0)).result(DEADLINE_S)
    wait_for(lambda: not session.cursor().playing)
    assert session.cursor().t_ns == session.source.to_ns


def test_an_order_that_makes_no_sense_is_refused_and_the_replay_goes_on(session: Session) -> None:
    with pytest.raises(UsageError, match="speed"):
        session.order(SetSpeed(100.0)).result(DEADLINE_S)
    assert session.order(Seek(session.source.from_ns + S)).result(DEADLINE_S).t_ns == session.source.from_ns + S


def test_after_its_end_nothing_is_taken(session: Session) -> None:
    session.close()
    with pytest.raises(ReplayEndedError):
        session.order(Pause()).result(DEADLINE_S)


def test_a_node_that_fell_silent_is_stale_and_missed() -> None:
    source = Source(DROPS_OUT, {})
    stage = ReplayStage(source, source.keyframe(source.from_ns + 15 * S), lambda: 0)
    stage.advance(source.from_ns + 20 * S, lambda: False)
    node = stage.live.node("can0", 13)
    assert node is not None
    assert node.silent
    source.close()


def test_a_file_without_frames_is_refused(tmp_path: Path) -> None:
    path = tmp_path / "empty.mcap"
    path.write_bytes(b"nothing of it")
    with pytest.raises(RecordingError):
        Source(path, {})


def wait_for(condition: object) -> None:
    assert callable(condition)
    until = time.monotonic() + DEADLINE_S
    while not condition():
        assert time.monotonic() < until
        time.sleep(0.005)


# -- what can go wrong ----------------------------------------------------------------


@pytest.fixture
def copied(tmp_path: Path) -> Path:
    path = tmp_path / "copy.mcap"
    shutil.copy(TRIP, path)
    return path


def test_a_file_that_is_cut_under_a_replay_ends_no_process(copied: Path) -> None:
    session = Session(Source(copied, {}), time.monotonic_ns)
    session.order(Seek(session.source.from_ns + S)).result(DEADLINE_S)
    os.truncate(copied, 5000)
    line = session.order(Seek(session.source.to_ns)).result(DEADLINE_S)
    assert line.t_ns == session.source.to_ns
    assert session.source.damages > 0
    session.close()


def test_a_step_that_fails_is_told_and_the_replay_goes_on(copied: Path, tmp_path: Path) -> None:
    with open_recording(copied) as recording:
        build_index(copied, recording.descriptions, cache=tmp_path).close()
    session = Session(Source(copied, {}, tmp_path), time.monotonic_ns)
    copied.unlink()
    with pytest.raises(HubsideError):
        session.order(StepEvent(True)).result(DEADLINE_S)
    begin = session.source.from_ns
    assert session.order(Seek(begin + S)).result(DEADLINE_S).t_ns == begin + S
    session.close()


def test_a_state_that_makes_no_sense_is_passed_over(monkeypatch: pytest.MonkeyPatch) -> None:
    source = Source(TRIP, {})
    good = source.keyframe
    bad_from = source.from_ns + 20 * S

    def keyframe(t_ns: int) -> Keyframe | None:
        found = good(t_ns)
        return found if found is None or found.t_ns < bad_from else Keyframe(found.t_ns, {"live": {}, "decoders": {}})

    monkeypatch.setattr(source, "keyframe", keyframe)
    session = Session(source, time.monotonic_ns)
    session.order(Seek(source.from_ns + 31 * S)).result(DEADLINE_S)
    other = Source(TRIP, {})
    straight = ReplayStage(other, None, lambda: 0)
    straight.advance(source.from_ns + 31 * S, lambda: False)
    assert isinstance(session.stage, ReplayStage)
    assert state_of(session.stage) == state_of(straight)
    session.close()
    other.close()


def test_who_asks_while_it_closes_is_answered(session: Session) -> None:
    answers = [session.order(Seek(session.source.from_ns + n * S)) for n in range(50)]
    session.close()
    for answer in answers:
        with contextlib.suppress(ReplayEndedError):
            answer.result(DEADLINE_S)
    assert not session._thread.is_alive()


def test_a_request_that_was_given_up_ends_nothing(session: Session) -> None:
    for n in range(20):
        session.order(Seek(session.source.from_ns + n * S)).cancel()
    assert session.order(Seek(session.source.from_ns)).result(DEADLINE_S).t_ns == session.source.from_ns
    assert session.failure is None


def test_a_step_back_leads_over_any_silence(tmp_path: Path) -> None:
    path = tmp_path / "silent.mcap"
    with open_recording(TRIP) as recording:
        frames = list(recording.frames(None, recording.span_ns[0] + S)) if recording.span_ns else []
        part = Part(path, Identity("silent", 1, frames[0].t_ns, frames[0].t_ns), recording.info)
    late = frames[-1]._replace(t_ns=frames[-1].t_ns + 400 * S)
    part.append(Batch(frames=[*frames, late]))
    part.finish(late.t_ns, 0)
    session = Session(Source(path, {}), time.monotonic_ns)
    session.order(Seek(late.t_ns)).result(DEADLINE_S)
    assert session.order(StepFrame(False)).result(DEADLINE_S).t_ns == frames[-1].t_ns
    session.close()


def test_the_speed_attained_in_a_loop_is_that_of_what_was_played() -> None:
    """Every turn plays half a second of the recording, and takes 100 ms of the clock: 5 times as fast, not 20 times."""
    now = [0]
    session = Session(Source(TRIP, {}), lambda: now[0])
    begin = session.source.from_ns + 20 * S
    loop = SetLoop(Loop(begin, begin + S // 2))
    assert session.order(loop).result(DEADLINE_S).attained is None
    session.order(Seek(begin)).result(DEADLINE_S)
    session.order(Play(20.0)).result(DEADLINE_S)
    for _ in range(12):
        epoch = session.epoch
        now[0] += S // 10
        wait_for(lambda epoch=epoch: session.epoch > epoch)
        session.order(loop).result(DEADLINE_S)  # by then the clock has been looked at
    attained = session.cursor().attained
    assert attained is not None
    assert 4.0 < attained < 6.0
    session.close()
