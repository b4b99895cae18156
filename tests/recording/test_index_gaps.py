"""Gaps are told as what they are, and act on what is known."""

from __future__ import annotations

from pathlib import Path

from app.model.address import Address
from app.recording.content import EventKind
from app.recording.index import Gap, GapKind
from app.recording.index.index import RecordingIndex
from app.recording.reader import open_recording
from app.recording.writer import RecorderSettings
from app.wire.events import EventKind as WireKind
from app.wire.frame import Can, Direction, Frame
from tests.recording.index_rig import built
from tests.recording.rig import MS, Bench, S, files


def of_kind(index: RecordingIndex, kind: GapKind) -> list[Gap]:
    return [gap for gap in index.gaps() if gap.kind is kind]


def test_a_bus_is_silent_where_its_traffic_does_not_explain_it(tmp_path: Path) -> None:
    bench = Bench(tmp_path)
    bench.run(2, per_step=5)
    last_ns = bench.written[-1].t_ns
    bench.run(3)
    bench.run(1, per_step=5)
    bench.core.shut()
    index = built(next(tmp_path.glob("*.mcap")))
    (gap,) = of_kind(index, GapKind.SILENCE)
    assert (gap.bus, gap.from_ns) == ("can0", last_ns)
    assert 3 * S <= gap.to_ns - gap.from_ns < 3.2 * S


def test_a_bus_is_silent_before_its_first_frame_and_behind_its_last(tmp_path: Path) -> None:
    bench = Bench(tmp_path)
    bench.run(3)
    bench.run(1, per_step=5)
    bench.run(4)
    bench.core.shut()
    index = built(next(tmp_path.glob("*.mcap")))
    before, behind = of_kind(index, GapKind.SILENCE)
    assert (before.to_ns, behind.from_ns) == index.span_ns
    assert [round((gap.to_ns - gap.from_ns) / S) for gap in (before, behind)] == [3, 4]


def test_a_slow_bus_is_not_silent(tmp_path: Path) -> None:
    """A heartbeat every two seconds explains a distance of two seconds, not one of thirty."""
    bench = Bench(tmp_path)
    for pause in (*[2] * 20, 30, *[2] * 5):
        bench.write(1)
        bench.run(pause)
    bench.core.shut()
    index = built(next(tmp_path.glob("*.mcap")))
    (gap,) = of_kind(index, GapKind.SILENCE)
    assert round((gap.to_ns - gap.from_ns) / S) == 30


def test_losses_clock_steps_and_a_lost_bus_are_told_with_their_figures(tmp_path: Path) -> None:
    bench = Bench(tmp_path)
    bench.run(0.5, per_step=5)
    bench.core.count_lost("can0", 7, bench.clock.monotonic, bench.clock.monotonic + 5)
    bench.run(0.5, per_step=5)
    bench.clock.wall += 3600 * S
    bench.run(0.5, per_step=5)
    bench.core.event(EventKind.BUS_LOST, "can0")
    lost_ns = bench.clock.recorder.stamp()
    bench.run(0.5)
    bench.core.event(EventKind.BUS_BACK, "can0")
    bench.run(0.5, per_step=5)
    bench.core.event(EventKind.BUS_LOST, "can0")
    bench.run(0.5, per_step=5)
    bench.core.shut()
    index = built(next(tmp_path.glob("*.mcap")))
    (loss,) = of_kind(index, GapKind.LOSS)
    assert loss.details == {"count": 7, "reason": "adapter"}
    assert loss.to_ns - loss.from_ns == 5
    (step,) = of_kind(index, GapKind.CLOCK_STEP)
    assert step.details["step_ns"] == 3600 * S
    first, second = of_kind(index, GapKind.BUS_LOST)
    assert abs(first.from_ns - lost_ns) < MS
    assert 0.49 * S < first.to_ns - first.from_ns < 0.6 * S
    assert first.details == {"ended": True}
    assert (second.to_ns, second.details) == (index.span_ns[1], {"ended": False})
    reasons = [event.details["reason_key"] for event in index.events() if event.kind is WireKind.GAP]
    assert reasons == ["gap.frames_lost", "gap.bus_lost", "gap.bus_lost", "gap.bus_lost"]


def test_missing_frames_break_a_plot_and_make_values_stale(tmp_path: Path) -> None:
    bench = Bench(tmp_path)
    address = Address(0x6041)
    upload = b"\x40" + address.major.to_bytes(2, "little") + bytes(5)

    def read(value: int) -> None:
        stamp = bench.clock.recorder.stamp
        answer = b"\x4b" + upload[1:4] + value.to_bytes(2, "little") + bytes(2)
        ask = Frame(stamp(), "can0", Direction.TX, Can(0x60B, upload))
        bench.core.write([ask, Frame(stamp(), "can0", Direction.RX, Can(0x58B, answer))])

    read(5)
    bench.run(0.5)
    bench.core.event(EventKind.BUS_LOST, "can0")
    lost_ns = bench.clock.recorder.stamp()
    bench.run(0.5)
    read(6)
    bench.run(0.5)
    bench.core.shut()
    index = built(next(tmp_path.glob("*.mcap")))
    drawn = index.series(("can0", 11, address), index.span_ns[0], index.span_ns[1] + 1, 100)
    assert drawn.low.tolist() == [5, 6]
    (at_ns,) = drawn.breaks.tolist()
    assert drawn.t_ns[0] < at_ns < drawn.t_ns[1]
    assert abs(at_ns - lost_ns) < MS
    assert [change.data for change in index.history("can0", 11, address)] == [b"\x05\x00", b"\x06\x00"]


def test_a_later_part_goes_on_from_what_the_recorder_knew(tmp_path: Path) -> None:
    bench = Bench(tmp_path, RecorderSettings(max_file_s=1.0))
    course_state = {
        "live": {"snapshot": 1, "t_ns": 1, "events": [], "environment": None, "nodes": []},
        "decoders": {},
    }
    bench.core.keyframe(course_state)
    bench.run(1.5, per_step=5)
    bench.core.keyframe(course_state)
    bench.run(0.5, per_step=5)
    bench.core.shut()
    first, second = files(tmp_path)[:2]
    assert not of_kind(built(first), GapKind.RESTART)
    index = built(second)
    (gap,) = of_kind(index, GapKind.RESTART)
    assert gap.details == {"part": 2}
    with open_recording(second) as recording:
        (told,) = recording.keyframes()
    (mark,) = index.marks()
    assert mark.t_ns == told.t_ns
    keyframe = index.keyframe(told.t_ns)
    assert keyframe is not None
    assert keyframe.t_ns == told.t_ns


def test_damage_is_a_gap_and_acts_on_the_state(tmp_path: Path) -> None:
    bench = Bench(tmp_path)
    bench.run(4, per_step=40)
    bench.core.shut()
    path = next(tmp_path.glob("*.mcap"))
    with open_recording(path) as recording:
        places = recording.can_chunks()
        hurt = places[len(places) // 2]
    data = bytearray(path.read_bytes())
    data[hurt.offset + hurt.length - 20] ^= 0xFF
    path.write_bytes(data)
    index = built(path)
    (gap,) = of_kind(index, GapKind.DAMAGE)
    assert (gap.bus, gap.from_ns, gap.to_ns) == ("can0", hurt.start_ns, hurt.end_ns)
    assert gap.details["offset"] == hurt.offset
    assert [event.details for event in index.events()] == [{"reason_key": "gap.damage"}]
    assert index.frames < len(bench.written)
