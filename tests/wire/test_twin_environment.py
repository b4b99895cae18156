"""Rotor and wind as a frame: there and back, what is refused, and how decoder and live state take it."""

from __future__ import annotations

import json

import pytest

from app.wire.decoder import CanOpenDecoder
from app.wire.frame import Can, Direction, Frame
from app.wire.live import LiveState
from app.wire.records import EnvironmentSeen
from app.wire.twin_environment import CAN_ID, TwinEnvironment, pack_environment, parse_environment

CALM = TwinEnvironment(359.99, -1.5, 8.25, -12.34)


def frame(data: bytes, t_ns: int = 5, extended: bool = True) -> Frame:
    return Frame(t_ns, "can0", Direction.RX, Can(CAN_ID, data, extended))


def test_the_bytes_are_as_documented() -> None:
    data = pack_environment(CALM)
    assert data == bytes.fromhex("9f8c 6aff 3903 2efb")
    assert parse_environment(data) == CALM


def test_a_whole_turn_is_no_turn() -> None:
    assert parse_environment(pack_environment(CALM._replace(azimuth_deg=359.999))).azimuth_deg == 0.0


def test_what_does_not_fit_is_refused() -> None:
    with pytest.raises(ValueError, match="does not fit"):
        pack_environment(CALM._replace(wind_mps=-1.0))
    with pytest.raises(ValueError, match="no 8 bytes"):
        parse_environment(bytes(7))
    with pytest.raises(ValueError, match="azimuth"):
        parse_environment(b"\xff" * 8)


def test_the_live_state_knows_the_latest_and_keeps_it_in_a_keyframe() -> None:
    decoder, live = CanOpenDecoder("can0"), LiveState()
    live.apply_all(decoder.feed_all([frame(pack_environment(CALM)), frame(pack_environment(CALM), 6)]))
    assert live.environment == EnvironmentSeen(6, "can0", 0, CALM)
    other = LiveState()
    other.restore(json.loads(json.dumps(live.snapshot())))
    assert other.environment == live.environment


def test_it_raises_the_version_and_changes_nothing_else() -> None:
    live = LiveState()
    before = live.version
    live.apply(EnvironmentSeen(6, "can0", 0, CALM))
    changes = live.changes_since(before)
    assert changes.version > before
    assert (changes.values, changes.nodes, changes.events) == ((), (), ())


def test_a_keyframe_of_older_recordings_has_none() -> None:
    state = LiveState().snapshot()
    del state["environment"]
    live = LiveState()
    live.restore(state)
    assert live.environment is None


@pytest.mark.parametrize("strange", [frame(bytes(3)), frame(b"\xff" * 8)])
def test_a_frame_of_somebody_else_says_nothing(strange: Frame) -> None:
    assert list(CanOpenDecoder("can0").feed(strange)) == []


def test_the_base_frame_of_the_same_number_is_another() -> None:
    can = Can(CAN_ID & 0x7FF, pack_environment(CALM))
    assert list(CanOpenDecoder("can0").feed(Frame(5, "can0", Direction.RX, can))) == []
