"""Client of the control of running twins: JSON lines over TCP, one request at a time.

It is what ``app.service.instructor.Instructor`` describes. A broken connection is opened anew with the next request.
"""

from __future__ import annotations

import asyncio
import contextlib
import itertools
import json
from collections.abc import Sequence
from typing import Any, Final

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
        return [kind_from_table(table) for table in await self._ask("catalogue")]

    async def situation(self) -> Situation:
        """What acts now. Raises TwinsGoneError."""
        table = await self._ask("active")
        playing = None if table["playing"] is None else Playing(**table["playing"])
        return Situation(table["now_ns"], tuple(active_from_table(one) for one in table["faults"]), playing)

    async def inject(self, order: FaultOrder) -> ActiveFault:
        """Put a fault in. Raises UsageError that names the field, TwinsGoneError."""
        return active_from_table(await self._ask("inject", order=order_table(order)))

    async def clear(self, fault: int) -> None:
        """Take a fault out. Raises UsageError where there is no such fault, TwinsGoneError."""
        await self._ask("clear", fault=fault)

    async def clear_all(self) -> None:
        """Take all faults out. Raises TwinsGoneError."""
        await self._ask("clear_all")

    async def scenarios(self) -> Sequence[ScenarioRef]:
        """All scenarios that they can play by name. Raises TwinsGoneError."""
        return [ScenarioRef(**table) for table in await self._ask("scenarios")]

    async def play(self, scenario: str) -> None:
        """Begin a scenario by its name. Raises UsageError where there is none or it does not fit, TwinsGoneError."""
        await self._ask("play", scenario=scenario)

    async def play_text(self, text: str, file: str) -> None:
        """Begin a scenario by its text; ``file`` names it. Raises as ``play``."""
        await self._ask("play", text=text, file=file)

    async def stop(self) -> None:
        """End the scenario that plays. Raises TwinsGoneError."""
        await self._ask("stop")

    async def close(self) -> None:
        """End the connection."""
        streams, self._streams = self._streams, None
        if streams is not None:
            streams[1].close()
            with contextlib.suppress(OSError):
                await streams[1].wait_closed()

    # -- inside ------------------------------------------------------------------------

    async def _ask(self, do: str, **needs: Any) -> Any:
        async with self._lock:
            try:
                answer = await asyncio.wait_for(self._exchange(do, needs), self._answer_s)
            except (OSError, ValueError, KeyError, TypeError, EOFError, TimeoutError) as error:
                await self.close()
                raise TwinsGoneError(reason=_why(error)) from error
            except asyncio.CancelledError:  # an answer may still come, and would be taken for the next one's
                await self.close()
                raise
        if answer["ok"]:
            return answer["result"]
        told = answer["error"]
        field = {"field": told["field"]} if "field" in told else {}
        raise UsageError(reason=told["text"], **field)

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


def _why(error: Exception) -> str:
    if isinstance(error, OSError) and error.strerror:
        return error.strerror
    return str(error) or type(error).__name__


def _place(control: str) -> tuple[str, int]:
    host, _, port = control.rpartition(":")
    if not host or not is_decimal(port) or not 0 < int(port) <= 65535:
        raise UsageError(reason=f"'{control}' is no HOST:PORT of running twins")
    return host, int(port)
