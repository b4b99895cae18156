"""Answers whose JSON is made in a worker thread: a large one made in the event loop would hold up everybody else."""

from __future__ import annotations

import asyncio
from collections.abc import Callable, Sequence
from typing import Final, TypeVar

from fastapi import Response
from pydantic import TypeAdapter

T = TypeVar("T")
JSON: Final = "application/json"


async def made_apart(adapter: TypeAdapter[T], make: Callable[[], T]) -> Response:
    """What ``make`` gives, as JSON; both in a worker thread."""
    return Response(await asyncio.to_thread(lambda: adapter.dump_json(make())), media_type=JSON)


async def list_made_apart(adapter: TypeAdapter[T], make: Callable[[], Sequence[T]]) -> Response:
    """As ``made_apart``, item by item: writing one holds up other threads, writing all would do so for longer."""

    def body() -> bytes:
        return b"[" + b",".join(adapter.dump_json(one) for one in make()) + b"]"

    return Response(await asyncio.to_thread(body), media_type=JSON)
