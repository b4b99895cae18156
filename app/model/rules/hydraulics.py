"""A hydraulic axis of an ED2: travel limits, currents of its valve, and modes that exclude each other (4.3, 4.8)."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Final

from app.model.rules.look import Found, Look, Object, make_rule
from app.model.rules.rule import Rule, Severity

ED2: Final = "wandfluh-ed2"
_ON: Final = 1
_OPEN_LOOP: Final = 6
_SINGLE: Final = 1
_INCREMENTAL: Final = 64
_SYNCHRONOUS_CONTROLLER: Final = 2
_PROPORTIONAL: Final = 0


def ed2(address: str) -> Object:
    """A parameter of the ED2."""
    return Object(ED2, address)


LIMITED, NEGATIVE, POSITIVE = ed2("1/106"), ed2("1/100"), ed2("1/101")
MODE, AXES, CONTROLLER, TRANSDUCER = ed2("0/40"), ed2("0/53"), ed2("12/219"), ed2("1/22")
VALVE: Final = ed2("3/133")
CURRENTS: Final = ((ed2("3/73"), ed2("3/129")), (ed2("3/76"), ed2("3/130")))
SPEED: Final = ed2("12/61")
HAND_SPEEDS: Final = (ed2("12/216"), ed2("12/217"))


def _crossed(look: Look) -> Iterator[Found]:
    limits = _limits(look)
    if limits is not None and limits[0] > limits[1]:
        yield Found((NEGATIVE, POSITIVE), {"negative": limits[0] / 10, "positive": limits[1] / 10})


def _no_window(look: Look) -> Iterator[Found]:
    """Both are 0 as delivered, and cannot be written before they are in force."""
    limits = _limits(look)
    if limits is not None and limits[0] == limits[1]:
        yield Found((NEGATIVE, POSITIVE, LIMITED), {"place": limits[0] / 10})


def _limits(look: Look) -> tuple[int, int] | None:
    """Both, where they are in force."""
    if look(LIMITED)[0] != _ON:
        return None
    negative, positive = look(NEGATIVE, POSITIVE)
    return negative, positive


def _open_loop(look: Look) -> Iterator[Found]:
    if look(MODE)[0] == _OPEN_LOOP and look(AXES)[0] != _SINGLE:
        yield Found((AXES, MODE))


def _controller(look: Look) -> Iterator[Found]:
    if _single_in_closed_loop(look) and look(CONTROLLER)[0] != _SYNCHRONOUS_CONTROLLER:
        yield Found((CONTROLLER, AXES))


def _incremental(look: Look) -> Iterator[Found]:
    if _single_in_closed_loop(look) and look(TRANSDUCER)[0] == _INCREMENTAL:
        yield Found((AXES, TRANSDUCER))


def _single_in_closed_loop(look: Look) -> bool:
    axes, mode = look(AXES, MODE)
    return axes == _SINGLE and mode != _OPEN_LOOP


def _currents(look: Look) -> Iterator[Found]:
    if look(VALVE)[0] != _PROPORTIONAL:
        return
    for least, most in CURRENTS:
        low, high = look.maybe(least), look.maybe(most)
        if low is not None and high is not None and low > high:
            yield Found((least, most), {"least": low, "most": high})


def _hand_speeds(look: Look) -> Iterator[Found]:
    highest = look(SPEED)[0]
    for one in HAND_SPEEDS:
        speed = look.maybe(one)
        if speed is not None and speed > highest:
            yield Found((one, SPEED), {"object": one.address, "speed": speed / 10, "highest": highest / 10})


RULES: Final[tuple[Rule, ...]] = (
    make_rule(
        "ed2.travel_limits", "4.8.15", Severity.ERROR, (LIMITED, NEGATIVE, POSITIVE), _crossed, stepwise=True
    ),
    make_rule("ed2.travel_window", "4.8.21", Severity.ERROR, (LIMITED, NEGATIVE, POSITIVE), _no_window),
    make_rule("ed2.open_loop_axes", "4.3.1.1", Severity.ERROR, (MODE, AXES), _open_loop),
    make_rule("ed2.single_axes_controller", "4.3.1.2", Severity.WARNING, (AXES, MODE, CONTROLLER), _controller),
    make_rule("ed2.single_axes_transducer", "4.3.1.2", Severity.WARNING, (AXES, MODE, TRANSDUCER), _incremental),
    make_rule(
        "ed2.valve_currents", "4.8.22", Severity.ERROR,
        (VALVE, *(one for pair in CURRENTS for one in pair)), _currents, stepwise=True,
    ),
    make_rule("ed2.hand_speeds", "4.8.51", Severity.WARNING, (SPEED, *HAND_SPEEDS), _hand_speeds),
)  # fmt: skip
