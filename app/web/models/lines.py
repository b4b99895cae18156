"""The types of the diagnosis of a bus: its line, its stations, and the check of the order of their bytes."""

from __future__ import annotations

from typing import Any, Literal

from pydantic import BaseModel, ConfigDict

from app.web.models import Failure

BusKind = Literal["canopen", "modbus-tcp", "profibus-dp"]
StateName = Literal["closed", "listening", "connected", "lost"]
OrderName = Literal["low-low", "low-high", "high-low", "high-high"]


class SaidDoc(BaseModel):
    """A text and what fills its placeholders."""

    text_key: str
    details: dict[str, Any]


class DiagnosisDoc(BaseModel):
    """The latest Slave_Diag. ``data`` are its bytes; ``master`` null: none has parametrised it.

    ``status`` are the names of the bits that are set, as text keys; ``blocks`` the extended diagnosis in words.
    """

    data: str
    ident: int
    master: int | None
    status: list[str]
    blocks: list[SaidDoc]


class SignalDoc(BaseModel):
    """One signal of process data; ``address`` is the parameter of the same value, null where there is none.

    ``raw`` null: the order of bytes is not proven, so nobody knows what they tell.
    """

    number: int
    name: str
    address: str | None
    raw: int | None


class WordDoc(BaseModel):
    """``words`` words of process data from ``word`` (from 1) on, and what shares them. ``data`` empty: none yet."""

    word: int
    words: int
    data: str
    signals: list[SignalDoc]


class TelegramDoc(BaseModel):
    """The telegram type that is exchanged. Sizes in bytes, PKW included; ``received`` is what the slave gets."""

    number: int
    has_pkw: bool
    output_size: int
    input_size: int
    received: list[WordDoc]
    sent: list[WordDoc]


class StationDoc(BaseModel):
    """One station. ``state`` null: the line is gone, so nothing is known of it.

    ``dp_state`` and ``watchdog_state`` null: it has not told. ``order`` is the order of bytes that is proven,
    ``setting`` what the site says. ``age_ms`` is that of the latest inputs that were surely of now, null where there
    were none since it is there; ``starts`` counts how often it has begun to exchange data.
    """

    device: str
    node: int
    state: Literal["absent", "starting", "exchanging"] | None
    problem: Failure | None
    dp_state: Literal["wait_prm", "wait_cfg", "data_exchange"] | None
    watchdog_state: Literal["baud_control", "dp_control"] | None
    diagnosis: DiagnosisDoc | None
    telegram: TelegramDoc | None
    setting: OrderName | None
    order: OrderName | None
    age_ms: float | None
    starts: int
    stale: bool


class LineDoc(BaseModel):
    """A bus of the connection as its driver has it. ``bitrate`` 0: it has none; ``load`` 0..1.

    ``master`` is our own address where the bus has one. ``stations`` are empty where its driver keeps none.
    """

    bus: str
    kind: BusKind
    connection: str
    bitrate: int
    master: int | None
    state: StateName
    reason: str
    since_t_ns: int
    reconnects: int
    dropped: int
    frames: int
    load: float
    problem: Failure | None
    stations: list[StationDoc]


class OrderReadingDoc(BaseModel):
    """One parameter of the check: ``value`` as PKW read it, ``data`` its process data of that moment.

    ``said`` is what the bytes tell by each order.
    """

    signal: str
    address: str | None
    value: int
    data: str
    said: dict[OrderName, int]


class OrderCheckDoc(BaseModel):
    """What the guided check found. ``fits`` are the orders that nothing contradicts, ``setting`` what the site says.

    ``proven`` null: nothing but zeros may be sent, for the reason of ``reason_key``.
    """

    readings: list[OrderReadingDoc]
    fits: list[OrderName]
    setting: OrderName | None
    proven: OrderName | None
    reason_key: str | None


class OrderKept(BaseModel):
    """The order of bytes that the site file is to name."""

    model_config = ConfigDict(extra="forbid", json_schema_extra={"examples": [{"order": "high-high"}]})

    order: OrderName
