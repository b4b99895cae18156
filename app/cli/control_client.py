"""Client of the control of running twins: JSON lines over TCP, one request at a time.

It is what ``app.service.instructor.Instructor`` describes. A broken connection is opened anew with the next request.
"""

from __future__ import annotations

import asyncio
import contextlib
import itertools
import json
from collections.abc import Callable, Sequence
from typing import Any, Final, TypeVar

from app.errors import TwinsGoneError, UsageError
from app.model.address import is_decimal
from app.model.fault import (
    ActiveFault,
    FaultKind,
    FaultOrder,
    active_from_table,
    kind_from_table,
    order_table,
)
from app.service.instructor import Playing, ScenarioRef, Situation

ANSWER_S: Final = 5.0
"""Twins answer within a step of their line; after this long they are gone."""
_LINE_MAX: Final = 1 << 20
_Result = TypeVar("_Result")


class ControlClient:
    """Twins that listen at ``control`` (``HOST:PORT``) and know ``token``; their bus is at ``address``.

    Raises UsageError where ``control`` is no address.
    """

    def __init__(self, control: str, token: str, address: str = "", answer_s: float = ANSWER_S) -> None:
        self._host, self._port = _place(control)
        self._token = token
        self._address = address
        self._answer_s = answer_s
        self._ids = itertools.count(1)
        self._lock = asyncio.Lock()
        self._streams: tuple[asyncio.StreamReader, asyncio.StreamWriter] | None = None

    @property
    def address(self) -> str:
        """The connection by which their bus is reached."""
        return self._address

    async def catalogue(self) -> Sequence[FaultKind]:
        """All kinds of fault that they know. Raises TwinsGoneError."""
        return await self._ask("catalogue", lambda tables: [kind_from_table(table) for table in tables])

    async def situation(self) -> Situation:
        """What acts now. Raises TwinsGoneError."""
        return await self._ask("active", _situation)

    async def inject(self, order: FaultOrder) -> ActiveFault:
        """Put a fault in. Raises UsageError that names the field, TwinsGoneError."""
        return await self._ask("inject", active_from_table, order=order_table(order))

    async def clear(self, fault: int) -> None:
        """Take a fault out. Raises UsageError where there is no such fault, TwinsGoneError."""
        await self._ask("clear", _nothing, fault=fault)

    async def clear_all(self) -> None:
        """Take all faults out. Raises TwinsGoneError."""
        await self._ask("clear_all", _nothing)

    async def scenarios(self) -> Sequence[ScenarioRef]:
        """All scenarios that they can play by name. Raises TwinsGoneError."""
        return await self._ask("scenarios", lambda tables: [ScenarioRef(**table) for table in tables])

    async def play(self, scenario: str) -> None:
        """Begin a scenario by its name. Raises UsageError where there is none or it does not fit, TwinsGoneError."""
        await self._ask("play", _nothing, scenario=scenario)

    async def play_text(self, text: str, file: str) -> None:
        """Begin a scenario by its text; ``file`` names it. Raises as ``play``."""
        await self._ask("play", _nothing, text=text, file=file)

    async def stop(self) -> None:
        """End the scenario that plays. Raises TwinsGoneError."""
        await self._ask("stop", _nothing)

    async def close(self) -> None:
        """End the connection."""
        streams, self._streams = self._streams, None
        if streams is not None:
            streams[1].close()
            with contextlib.suppress(OSError):
                await streams[1].wait_closed()

    # -- inside ------------------------------------------------------------------------

    async def _ask(self, do: str, read: Callable[[Any], _Result], **needs: Any) -> _Result:
        """The result of a request, as ``read`` makes it. What makes no sense is as good as no answer."""
        async with self._lock:
            try:
                answer = await asyncio.wait_for(self._exchange(do, needs), self._answer_s)
                if answer["ok"]:
                    return read(answer["result"])
                refusal = _refusal(answer["error"])
            except (OSError, ValueError, KeyError, TypeError, AttributeError, EOFError, UsageError) as error:
                await self.close()
                raise TwinsGoneError(reason=_why(error)) from error
            except asyncio.CancelledError:  # an answer may still come, and would be taken for the next one's
                await self.close()
                raise
        raise refusal

    async def _exchange(self, do: str, needs: dict[str, Any]) -> dict[str, Any]:
        if self._streams is None:
            self._streams = await asyncio.open_connection(self._host, self._port, limit=_LINE_MAX)
        reader, writer = self._streams
        number = next(self._ids)
        request = {"id": number, "token": self._token, "do": do, **needs}
        writer.write(json.dumps(request).encode() + b"\n")
        await writer.drain()
        line = await reader.readline()
        if not line:
            raise EOFError("they closed the connection (wrong token?)")
        answer: dict[str, Any] = json.loads(line)
        if answer["id"] != number:
            raise ValueError("they answered another request")
        return answer


def _situation(table: Any) -> Situation:
    playing = None if table["playing"] is None else Playing(**table["playing"])
    return Situation(int(table["now_ns"]), tuple(active_from_table(one) for one in table["faults"]), playing)


def _nothing(_result: Any) -> None:
    """Nothing is told but that it was done."""


def _refusal(told: Any) -> UsageError:
    field = {"field": str(told["field"])} if "field" in told else {}
    return UsageError(reason=str(told["text"]), **field)


def _why(error: Exception) -> str:
    if isinstance(error, OSError) and error.strerror:
        return error.strerror
    return str(error) or type(error).__name__


def _place(control: str) -> tuple[str, int]:
    host, _, port = control.rpartition(":")
    if not host or not is_decimal(port) or not 0 < int(port) <= 65535:
        raise UsageError(reason=f"'{control}' is no HOST:PORT of running twins")
    return host, int(port)
