"""Text of a CAN connection."""

from __future__ import annotations

import pytest

from app.drivers.can_config import CanConfig, CanInterface, parse_can
from app.errors import UsageError


@pytest.mark.parametrize(
    "text, config",
    [
        (
            "socketcand:127.0.0.1:29536",
            CanConfig(CanInterface.SOCKETCAND, "can0", 500_000, "127.0.0.1", 29536),
        ),
        (
            "socketcand:[::1]:29536/vcan1@250000",
            CanConfig(CanInterface.SOCKETCAND, "vcan1", 250_000, "::1", 29536),
        ),
        ("socketcan:can0", CanConfig(CanInterface.SOCKETCAN, "can0")),
        ("slcan:/dev/ttyACM0@500000", CanConfig(CanInterface.SLCAN, "/dev/ttyACM0", 500_000)),
        ("slcan:COM3@1000000", CanConfig(CanInterface.SLCAN, "COM3", 1_000_000)),
        ("virtual:name", CanConfig(CanInterface.VIRTUAL, "name")),
        ("pcan:PCAN_USBBUS1@250000", CanConfig(CanInterface.PCAN, "PCAN_USBBUS1", 250_000)),
        ("kvaser:0", CanConfig(CanInterface.KVASER, "0")),
        ("ixxat:1@125000", CanConfig(CanInterface.IXXAT, "1", 125_000)),
        ("vector:2", CanConfig(CanInterface.VECTOR, "2")),
    ],
)
def test_known_connections(text: str, config: CanConfig) -> None:
    assert parse_can(text) == config
    assert parse_can(str(config)) == config


@pytest.mark.parametrize(
    "text, named",
    [
        ("", "'' is no interface"),
        ("can0", "'can0' is no interface"),
        ("usb2can:0", "'usb2can' is no interface"),
        ("socketcan", "channel is missing"),
        ("socketcan:", "channel is empty"),
        ("slcan:@500000", "channel is empty"),
        ("slcan:/dev/ttyACM0@fast", "bit rate 'fast'"),
        ("slcan:/dev/ttyACM0@", "bit rate ''"),
        ("slcan:/dev/ttyACM0@123456", "no bit rate 123456"),
        ("pcan:PCAN_USBBUS1@750000", "no bit rate 750000"),
        ("kvaser:0@2000000", "bit rate 2000000 is outside"),
        ("kvaser:first", "channel 'first' is no number"),
        ("socketcand:127.0.0.1", "HOST:PORT"),
        ("socketcand::29536", "HOST:PORT"),
        ("socketcand:localhost:can", "port 'can'"),
        ("socketcand:localhost:70000", "port '70000'"),
        ("socketcand:localhost:29536/", "no name of a channel"),
        ("socketcand:localhost:29536/a b", "no name of a channel"),
    ],
)
def test_what_is_wrong_is_named(text: str, named: str) -> None:
    with pytest.raises(UsageError) as caught:
        parse_can(text)
    assert named in str(caught.value.details["reason"])
    assert caught.value.exit_code == 2


def test_arguments_for_python_can() -> None:
    assert parse_can("slcan:COM3@250000").bus_arguments() == {
        "interface": "slcan",
        "channel": "COM3",
        "bitrate": 250_000,
    }
    assert parse_can("socketcan:can0@250000").bus_arguments() == {"interface": "socketcan", "channel": "can0"}
    assert parse_can("kvaser:1").listening(True).bus_arguments() == {
        "interface": "kvaser",
        "channel": 1,
        "bitrate": 500_000,
        "driver_mode": False,
    }
    assert parse_can("slcan:COM3").listening(True).bus_arguments()["listen_only"] is True
    assert not parse_can("socketcand:localhost:1").has_silent_mode
