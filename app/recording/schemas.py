"""The message types of a recording and the topics that carry them.

The texts are ROS 2 message definitions; a definition that uses another one is followed by it after a line of 80
equals signs, as the MCAP registry asks for the schema encoding ``ros2msg``.
"""

from __future__ import annotations

from typing import NamedTuple

PROFILE = "ros2"
MESSAGE_ENCODING = "cdr"
SCHEMA_ENCODING = "ros2msg"

CLOCK_TOPIC = "/clock"
STATE_TOPIC = "/state"
EVENTS_TOPIC = "/events"

_HEADER = """\
================================================================================
MSG: std_msgs/Header
builtin_interfaces/Time stamp
string frame_id
================================================================================
MSG: builtin_interfaces/Time
int32 sec
uint32 nanosec
"""


class MessageType(NamedTuple):
    """A ROS 2 message type: its full name and its definition, joined with those it uses."""

    name: str
    text: str


CAN_FRAME = MessageType(
    "can_msgs/msg/Frame",
    "std_msgs/Header header\nuint32 id\nbool is_rtr\nbool is_extended\nbool is_error\nuint8 dlc\nuint8[8] data\n"
    + _HEADER,
)
TELEGRAM = MessageType(
    "hubside_msgs/msg/Telegram",
    "std_msgs/Header header\nuint8 kind\nstring link\nuint8[] data\n" + _HEADER,
)
CLOCK = MessageType(
    "hubside_msgs/msg/Clock",
    "std_msgs/Header header\nint64 monotonic_ns\nint64 wall_ns\nbool adapter_known\nint64 adapter_ns\n"
    "int64 adapter_t_ns\n" + _HEADER,
)
STATE = MessageType("hubside_msgs/msg/State", "std_msgs/Header header\nstring json\n" + _HEADER)
EVENT = MessageType("hubside_msgs/msg/Event", "std_msgs/Header header\nstring kind\nstring json\n" + _HEADER)

ALL_TYPES = (CAN_FRAME, CLOCK, STATE, EVENT, TELEGRAM)
"""In the order of their schema ids, which begin at 1. The order is part of the format."""


FIXED_TOPICS = {CLOCK_TOPIC: CLOCK.name, STATE_TOPIC: STATE.name, EVENTS_TOPIC: EVENT.name}
"""The topics beside those of the buses, and their types."""


def bus_topic(bus: str) -> str:
    """The topic of a bus: ``/can0`` for ``can0``."""
    return f"/{bus}"
