"""Where the two state machines of a slave stand, as far as its diagnosis tells (ED2 manual, 3.4 and 6.2)."""

from __future__ import annotations

from enum import Enum

from app.wire.profibus.diagnosis import Diagnosis, Status


class DpState(Enum):
    """From power on to data exchange."""

    WAIT_PRM = "wait_prm"
    WAIT_CFG = "wait_cfg"
    DATA_EXCHANGE = "data_exchange"


class WatchdogState(Enum):
    """Of the watchdog, which also looks for the bit rate: a slave that searches for it answers nobody."""

    BAUD_CONTROL = "baud_control"
    DP_CONTROL = "dp_control"


def dp_state(diagnosis: Diagnosis | None, exchanging: bool) -> DpState | None:
    """By its latest ``diagnosis``; who exchanges data does so, whatever it said before. None: not known."""
    if exchanging:
        return DpState.DATA_EXCHANGE
    if diagnosis is None:
        return None
    if diagnosis.status & (Status.PARAMETERS_REQUIRED | Status.PARAMETER_FAULT):
        return DpState.WAIT_PRM
    if diagnosis.status & (Status.NOT_READY | Status.CONFIGURATION_FAULT):
        return DpState.WAIT_CFG
    return DpState.DATA_EXCHANGE


def watchdog_state(diagnosis: Diagnosis | None) -> WatchdogState | None:
    """It answers, so it has the bit rate; whether its watchdog runs it says. None: not known."""
    if diagnosis is None:
        return None
    return WatchdogState.DP_CONTROL if diagnosis.status & Status.WATCHDOG else WatchdogState.BAUD_CONTROL
