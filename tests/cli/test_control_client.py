"""The client of running twins: what it makes of answers, of silence and of lost connections."""

from __future__ import annotations

import asyncio
from collections.abc import Awaitable, Callable, Iterator
from pathlib import Path

import pytest

from app.cli.control_client import ControlClient
from app.errors import TwinsGoneError, UsageError
from app.model.fault import CATALOGUE, FaultOrder
from app.service.instructor import Instructor, ScenarioRef
from app.twins.control_server import ControlServer
from app.twins.line_thread import LineThread
from tests.twins.turbine_rig import TurbineRig

TOKEN = "c0ffee"
Serve = Callable[[asyncio.StreamReader, asyncio.StreamWriter], Awaitable[None]]


@pytest.fixture
def server(tmp_path: Path) -> Iterator[ControlServer]:
    (tmp_path / "short.toml").write_text(
        'title = "Short"\nduration_s = 600\nseed = 3\nnote = "Look."', encoding="utf-8"
    )
    rig = TurbineRig()
    with LineThread(rig.line) as thread, ControlServer(thread, rig.instructor, TOKEN, tmp_path) as made:
        yield made


def test_it_is_what_the_service_asks_for(server: ControlServer) -> None:
    async def use() -> None:
        client = ControlClient(server.address, TOKEN, "socketcand:127.0.0.1:1")
        instructor: Instructor = client
        assert instructor.address == "socketcand:127.0.0.1:1"
        assert list(await instructor.catalogue()) == list(CATALOGUE.values())
        assert list(await instructor.scenarios()) == [ScenarioRef("short", "Short", 600.0, 3, "Look.")]
        fault = await instructor.inject(FaultOrder("bloc_weak", blade=2, seconds=600))
        assert fault.order.values["ohm_factor"] == 5.0
        now = await instructor.situation()
        assert now.faults == (fault,)
        assert now.playing is None
        await instructor.play("short")
        playing = (await instructor.situation()).playing
        assert playing is not None
        assert (playing.scenario, playing.duration_s) == ("short", 600.0)
        await instructor.stop()
        await instructor.clear_all()
        assert (await instructor.situation()).faults == ()
        with pytest.raises(UsageError) as caught:
            await instructor.inject(FaultOrder("node_gone", node=77))
        assert caught.value.details["field"] == "node"
        await client.close()

    asyncio.run(use())


def test_many_ask_at_once(server: ControlServer) -> None:
    async def use() -> None:
        client = ControlClient(server.address, TOKEN)
        faults = await asyncio.gather(*(client.inject(FaultOrder("node_gone", node=node)) for node in (1, 2, 3, 11)))
        assert [fault.order.node for fault in faults] == [1, 2, 3, 11]
        await client.close()

    asyncio.run(use())


def test_a_connection_that_broke_is_opened_anew(server: ControlServer) -> None:
    async def use() -> None:
        client = ControlClient(server.address, TOKEN)
        await client.situation()
        client._token = "wrong"
        with pytest.raises(TwinsGoneError):
            await client.situation()
        client._token = TOKEN
        assert (await client.situation()).faults == ()
        await client.close()

    asyncio.run(use())


def test_a_request_that_was_given_up_does_not_get_its_answer_mixed_up(server: ControlServer) -> None:
    async def use() -> None:
        client = ControlClient(server.address, TOKEN)
        for _ in range(20):
            asking = asyncio.create_task(client.catalogue())
            await asyncio.sleep(0)
            asking.cancel()
            await asyncio.gather(asking, return_exceptions=True)
            assert (await client.situation()).playing is None
        await client.close()

    asyncio.run(use())


async def never(reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
    await reader.read()
    writer.close()


def says(answer: bytes) -> Serve:
    async def serve(reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
        await reader.readline()
        writer.write(answer)
        writer.close()

    return serve


@pytest.mark.parametrize(
    "serve",
    [
        never,
        says(b""),
        says(b"hello\n"),
        says(b"[]\n"),
        says(b'{"id": 1}\n'),
        says(b'{"id": 9, "ok": true, "result": null}\n'),
        says(b'{"id": 1, "ok": true, "result": {"now_ns": 0}}\n'),
        says(b'{"id": 1, "ok": true, "result": {"now_ns": 0, "faults": [{"id": "x"}], "playing": null}}\n'),
        says(b'{"id": 1, "ok": true, "result": 3}\n'),
        says(b"x" * (1 << 21)),
    ],
)
def test_whoever_answers_no_sense_is_gone(serve: Serve) -> None:
    async def use() -> None:
        async with await asyncio.start_server(serve, "127.0.0.1", 0) as twins:
            port = twins.sockets[0].getsockname()[1]
            client = ControlClient(f"127.0.0.1:{port}", TOKEN, answer_s=0.5)
            with pytest.raises(TwinsGoneError) as caught:
                await client.situation()
            assert caught.value.details["reason"]
            await client.close()

    asyncio.run(use())


@pytest.mark.parametrize("control", ["", "127.0.0.1", "127.0.0.1:0", "127.0.0.1:99999", ":4", "127.0.0.1:x"])
def test_what_is_no_address_is_refused(control: str) -> None:
    with pytest.raises(UsageError):
        ControlClient(control, TOKEN)
