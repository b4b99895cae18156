"""Types of arguments: what argparse checks before anything is done."""

from __future__ import annotations

import argparse
import math

from app.model.address import is_decimal
from app.settings import DEFAULT_PORT

MAX_S = 7 * 24 * 3600.0


def seconds(text: str) -> float:
    """A duration in seconds: finite, not negative, a week at most."""
    return _between(text, 0.0, MAX_S, "s")


def milliseconds(text: str) -> float:
    """A duration in milliseconds, a minute at most."""
    return _between(text, 0.0, 60_000.0, "ms")


def port(text: str) -> int:
    """A TCP port; 0 takes a free one."""
    if not is_decimal(text) or int(text) > 65535:
        raise argparse.ArgumentTypeError(f"'{text}' is no port (0 to 65535)")
    return int(text)


def bitrate(text: str) -> int:
    """A bit rate of classic CAN in bit/s."""
    if not is_decimal(text) or not 10_000 <= int(text) <= 1_000_000:
        raise argparse.ArgumentTypeError(f"'{text}' is no bit rate (10000 to 1000000 bit/s)")
    return int(text)


def wind(text: str) -> float:
    """A mean wind speed in m/s."""
    return _between(text, 0.0, 60.0, "m/s")


def seed(text: str) -> int:
    """Of what is random: a whole number that is not negative."""
    if not is_decimal(text):
        raise argparse.ArgumentTypeError(f"'{text}' is no seed (a whole number)")
    return int(text)


def _between(text: str, low: float, high: float, unit: str) -> float:
    try:
        number = float(text)
    except ValueError:
        number = math.nan
    if not low <= number <= high:
        raise argparse.ArgumentTypeError(f"'{text}' is not between {low:g} and {high:g} {unit}")
    return number


def add_port(parser: argparse.ArgumentParser) -> None:
    """``--port``: where the page is served."""
    parser.add_argument("--port", type=port, default=DEFAULT_PORT, help="loopback port of the page; 0: any free one")
