"""The PROFIBUS driver on a pseudo-terminal: the contract against a twin, the order of start-up, and another master."""

from __future__ import annotations

import asyncio
import os
import subprocess
import sys
from collections.abc import AsyncIterator, Callable
from pathlib import Path

import pytest

from app.drivers.contract import TWIN_NAME, Driver, LinkState, Written
from app.drivers.profibus import WATCHDOG_MS, plan_of_gsd
from app.drivers.profibus_config import ProfibusStation, parse_profibus
from app.drivers.profibus_driver import ProfibusDriver
from app.drivers.profibus_station import StationState
from app.drivers.table import driver_class
from app.errors import (
    BusLostError,
    BusOpenError,
    DeviceError,
    ForeignMasterError,
    IdentityError,
    NoAnswerError,
    OvertakenError,
    PkwRefusedError,
    PreconditionError,
    RefusedError,
    UsageError,
)
from app.model.address import Address
from app.model.description import Bus, Verify
from app.model.texts import error_text, load_texts
from app.twins.ed2.device import Settings
from app.twins.ed2.dp_slave import DpState
from app.wire.frame import Direction, Fdl, Frame
from app.wire.profibus import dp
from app.wire.profibus.decoder import ProfibusDecoder
from app.wire.profibus.dp import Command, DataExchange, GlobalControl, Service, SetPrm
from app.wire.profibus.fdl import Telegram, Token, decode
from app.wire.profibus.pkw import PkwError
from app.wire.profibus.pzd import AS_PKW, AS_PRINTED, First, Order, encode_pzd
from app.wire.profibus.telegrams import ACTUAL as ACTUAL_SIGNAL
from app.wire.profibus.telegrams import CONTROL_WORD, SETPOINT, TELEGRAM_TYPES, assumed_modules
from app.wire.profibus.telegrams import RAMP_VELOCITY as RAMP_VELOCITY_SIGNAL
from app.wire.records import Outcome, SaveSeen, SdoAccess, SdoSeen, SlaveSeen, SlaveState
from tests.drivers.contract_suite import Bench, DriverContract
from tests.drivers.profibus_rig import (
    ABSENT,
    ACTUAL,
    BAUD,
    CONTROLWORD,
    DEADLINE_S,
    ED2,
    LOCAL,
    NODE,
    RAMP_ACCELERATION,
    RAMP_VELOCITY,
    STATUSWORD,
    STORE,
    Wire,
    connected,
    gone,
    ip,
    wire,
)
from tests.drivers.wire import stamper, until

pytestmark = pytest.mark.alone
"""The twin is heard in the time of its wire: another process on the same cores would hold it up."""
OTHER, SECOND_NODE = 1, 7
SETPOINT_VALUE = ip(12, 21)
FIRST, SECOND = (100).to_bytes(4, "little"), (200).to_bytes(4, "little")


class TestContract(DriverContract):
    @pytest.fixture
    async def bench(self) -> AsyncIterator[Bench]:
        with wire() as line:
            async with connected(line.config(NODE)) as driver:

                async def switch() -> None:
                    line.power_off()
                    await gone(driver, NODE)
                    line.power_on()

                yield Bench(
                    driver=driver,
                    node=NODE,
                    absent_node=ABSENT,
                    readable=tuple(entry.address for entry in ED2 if entry.access.readable)[:20],
                    writable=RAMP_VELOCITY,
                    first=FIRST,
                    second=SECOND,
                    read_only=STATUSWORD,
                    read_only_data=bytes(2),
                    unknown=ip(0, 250),
                    switch=switch,
                )


class Line:
    """What a master said, from the frames of a driver."""

    def __init__(self, driver: ProfibusDriver) -> None:
        self.frames: list[Frame] = []
        driver.subscribe(self.frames.extend)

    @property
    def asked(self) -> list[Service]:
        sent = [frame for frame in self.frames if frame.direction is Direction.TX]
        telegrams = [decode(frame.payload.data) for frame in sent if isinstance(frame.payload, Fdl)]
        return [dp.decode_request(each) for each in telegrams if isinstance(each, Telegram)]


def unconnected(line: Wire, *stations: int | ProfibusStation, listen_s: float = 0.05) -> ProfibusDriver:
    return ProfibusDriver(line.config(*stations), stamper(), descriptions=(ED2,), listen_s=listen_s)


async def becomes(driver: ProfibusDriver, state: LinkState) -> None:
    async with asyncio.timeout(DEADLINE_S):
        await driver._until(lambda: driver.status.state is state)


def test_the_table_knows_the_driver() -> None:
    assert driver_class(Bus.PROFIBUS_DP) is ProfibusDriver
    kept_to: Driver = ProfibusDriver(parse_profibus("/dev/null@500000,6"), stamper())
    assert kept_to.status.state is LinkState.CLOSED


def test_without_its_library_an_error_says_how_to_get_it() -> None:
    program = """
import sys
sys.modules["pyprofibus"] = None
from app.drivers.table import driver_class
from app.errors import ExtraMissingError
from app.model.description import Bus
from app.model.texts import error_text, load_texts
try:
    driver_class(Bus.PROFIBUS_DP)
except ExtraMissingError as error:
    print(error_text(load_texts("en"), error))
"""
    ran = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, timeout=60, check=True)
    assert "pip install 'hubside[profibus]'" in ran.stdout


# -- from the first probe to the last word ---------------------------------------------------------


async def test_a_station_is_probed_parametrised_and_then_sent_a_controlword_of_0() -> None:
    with wire() as line:
        driver = unconnected(line, NODE)
        said = Line(driver)
        await driver.connect()
        try:
            await driver.read(NODE, STATUSWORD)
        finally:
            await driver.close()
        names = [type(each) for each in said.asked]
        assert names[:3] == [dp.FdlStatus, dp.SlaveDiag, dp.GetCfg]
        exchanges = names.index(DataExchange)
        parameters = next(each for each in said.asked if isinstance(each, SetPrm))
        assert (parameters.lock, parameters.watchdog_ms) == (True, WATCHDOG_MS)
        assert names.index(SetPrm) < names.index(dp.ChkCfg) < exchanges
        assert all(each.outputs[8:] == bytes(6) for each in said.asked if isinstance(each, DataExchange))


async def test_leaving_clears_first_and_then_gives_the_slave_back() -> None:
    with wire() as line:
        driver = unconnected(line, NODE)
        said = Line(driver)
        await driver.connect()
        states = [line.device.slave.state]
        await driver.close()
        last = said.asked[-2:]
        assert last[0] == GlobalControl(Command.CLEAR)
        assert isinstance(last[1], SetPrm)
        assert last[1].unlock
        assert [*states, line.device.slave.state] == [DpState.DATA_EXCHANGE, DpState.WAIT_PRM]
        assert driver.status.state is LinkState.CLOSED


async def test_a_line_can_be_opened_again_after_it_was_closed() -> None:
    with wire() as line:
        driver = unconnected(line, NODE)
        for _ in range(2):
            await driver.connect()
            assert len(await driver.read(NODE, RAMP_VELOCITY)) == 4
            await driver.close()


async def test_a_station_that_nobody_configured_is_spoken_to_from_when_it_is_asked() -> None:
    with wire() as line:
        async with connected(line.config()) as driver:
            states = [driver.status.state]
            assert len(await driver.read(NODE, RAMP_VELOCITY)) == 4
            assert [*states, driver.status.state] == [LinkState.LISTENING, LinkState.CONNECTED]


async def test_a_scan_finds_the_twin_and_says_so() -> None:
    with wire() as line:
        async with connected(line.config()) as driver:
            found = await driver.scan(range(4, 9))
            assert [each.node for each in found] == [NODE]
            assert found[0].description_id == ED2.id
            assert found[0].is_twin
            assert found[0].device_name == f"{TWIN_NAME} ED2"


async def test_connected_is_only_who_answers() -> None:
    """The library itself would be connected for ever."""
    with wire() as line:
        line.power_off()
        async with connected(line.config(NODE)) as driver:
            assert (driver.status.state, driver.status.reason) == (LinkState.LOST, "no station answers")
            line.power_on()
            await becomes(driver, LinkState.CONNECTED)
            assert len(await driver.read(NODE, RAMP_VELOCITY, timeout_s=DEADLINE_S)) == 4
            line.power_off()
            await becomes(driver, LinkState.LOST)


async def test_a_port_that_is_not_there_cannot_be_opened(tmp_path: Path) -> None:
    for path in (tmp_path / "none", tmp_path):
        driver = ProfibusDriver(parse_profibus(f"{path}@500000,6"), stamper())
        with pytest.raises(BusOpenError) as caught:
            await driver.connect()
        assert str(path) in caught.value.details["reason"]


async def test_a_port_that_goes_away_ends_all_that_waits() -> None:
    with wire() as line:
        async with connected(line.config(NODE)) as driver:
            reading = asyncio.ensure_future(driver.read(ABSENT, STATUSWORD, timeout_s=30))
            await asyncio.sleep(0)
            line.thread.stop()
            line.line.close()
            with pytest.raises(BusLostError):
                async with asyncio.timeout(DEADLINE_S):
                    await reading
            await becomes(driver, LinkState.LOST)
            with pytest.raises(NoAnswerError):
                await driver.read(NODE, STATUSWORD)


async def test_two_stations_share_the_line_and_one_that_goes_does_not_stop_the_other() -> None:
    with wire(BAUD, Settings(), Settings(address=SECOND_NODE, places_mm=(100.0, 100.0))) as line:
        async with connected(line.config(NODE, SECOND_NODE)) as driver:
            places = await asyncio.gather(driver.read(NODE, ACTUAL), driver.read(SECOND_NODE, ACTUAL))
            assert [int.from_bytes(each, "little") for each in places] == [250_000, 100_000]
            line.power_off()
            await gone(driver, NODE)
            assert await driver.read(SECOND_NODE, ACTUAL, timeout_s=DEADLINE_S) == places[1]
            assert driver.status.state is LinkState.CONNECTED


def test_two_stations_that_take_too_long_together_are_refused() -> None:
    with pytest.raises(UsageError):
        ProfibusDriver(parse_profibus("/dev/null@9600,6/102,7/102"), stamper())


# -- parameters ----------------------------------------------------------------------------------


async def test_what_the_device_refuses_is_told_by_its_code() -> None:
    with wire() as line:
        async with connected(line.config(NODE)) as driver:
            for address, data, code in (
                (ip(0, 250), None, PkwError.UNKNOWN_PNU),
                (STATUSWORD, bytes(2), PkwError.NOT_CHANGEABLE),
                (LOCAL, b"\2", PkwError.OUT_OF_RANGE),
                (LOCAL, bytes(4), PkwError.WRONG_LENGTH),
            ):
                with pytest.raises(PkwRefusedError) as caught:
                    if data is None:
                        await driver.read(NODE, address)
                    else:
                        await driver.write(NODE, address, data)
                assert caught.value.details["pkw_code"] == code
                for language in ("en", "de"):
                    text = error_text(load_texts(language), caught.value)
                    assert "{" not in text
                    assert f"(code {int(code)})" in text


@pytest.mark.parametrize("data", [b"", b"\1\2\3", bytes(8)])
async def test_what_no_job_can_write_is_refused_before(data: bytes) -> None:
    with wire() as line:
        async with connected(line.config(NODE)) as driver:
            with pytest.raises(RefusedError):
                await driver.write(NODE, RAMP_VELOCITY, data)
            with pytest.raises(UsageError):
                await driver.read(NODE, Address(0x6041))


async def test_a_telegram_without_parameters_has_none() -> None:
    with wire() as line:
        async with connected(line.config(ProfibusStation(NODE, 100))) as driver:
            assert driver.status.state is LinkState.CONNECTED
            with pytest.raises(RefusedError, match="telegram 100"):
                await driver.read(NODE, STATUSWORD)
            with pytest.raises(RefusedError):
                await driver.write(NODE, CONTROLWORD, b"\7\0")


async def test_what_was_saved_survives_and_what_was_not_does_not() -> None:
    with wire() as line:
        async with connected(line.config(NODE)) as driver:
            before = await driver.read(NODE, RAMP_VELOCITY)
            saved, lost = ip(12, 163), RAMP_VELOCITY
            wanted = (1234).to_bytes(4, "little")
            await driver.write(NODE, saved, wanted)
            await driver.save(NODE)
            await driver.write(NODE, lost, FIRST)
            restarting = asyncio.ensure_future(driver.restart(NODE))
            await asyncio.sleep(0)
            line.power_off()
            await gone(driver, NODE)
            line.power_on()
            await restarting
            assert await driver.read(NODE, saved) == wanted
            assert await driver.read(NODE, lost) == before
            with pytest.raises(UsageError):
                await driver.save(NODE, "tuning")


async def test_the_passive_decoder_sees_the_same() -> None:
    with wire() as line:
        driver = unconnected(line, NODE)
        said = Line(driver)
        await driver.connect()
        value = await driver.read(NODE, RAMP_VELOCITY)
        assert await driver.write(NODE, RAMP_VELOCITY, SECOND) is Written.ACKNOWLEDGED
        with pytest.raises(DeviceError):
            await driver.read(NODE, ip(0, 250))
        await driver.save(NODE)
        await driver.close()
    decoder = ProfibusDecoder(driver.bus, {NODE: ED2})
    records = decoder.feed_all(said.frames)
    jobs = [each for each in records if isinstance(each, SdoSeen)]
    assert [(each.access, each.address, each.outcome, each.data) for each in jobs] == [
        (SdoAccess.READ, RAMP_VELOCITY, Outcome.DONE, value),
        (SdoAccess.WRITE, RAMP_VELOCITY, Outcome.DONE, SECOND),
        (SdoAccess.READ, ip(0, 250), Outcome.ABORTED, None),
        (SdoAccess.WRITE, STORE, Outcome.DONE, (0x73617665).to_bytes(4, "little")),
    ]
    assert any(isinstance(each, SaveSeen) for each in records)
    states = [each.state for each in records if isinstance(each, SlaveSeen)]
    assert states[-1] is SlaveState.WAITING
    assert SlaveState.EXCHANGING in states


# -- process data ----------------------------------------------------------------------------------


AT_ZERO = Settings(places_mm=(0.0, 0.0))
"""An actual value of 0 looks the same in either order of words."""


@pytest.mark.parametrize("order", [Order(byte, word) for byte in First for word in First])
@pytest.mark.parametrize("telegram", [1, 102, 103])
async def test_the_order_of_bytes_is_found_before_a_bit_of_the_controlword_is_sent(order: Order, telegram: int) -> None:
    with wire(settings=Settings(order=order)) as line:
        driver = unconnected(line, ProfibusStation(NODE, telegram))
        said = Line(driver)
        await driver.connect()
        try:
            assert await driver.write(NODE, CONTROLWORD, b"\7\0", verify=Verify.EFFECT) is Written.ACKNOWLEDGED
            check = await driver.check_order(NODE)
            assert check.proven == order
            assert line.received[CONTROL_WORD] == 7
            place = int.from_bytes(await driver.read(NODE, ACTUAL), "little", signed=True)
            assert line.received[SETPOINT] == pytest.approx(place, abs=1000)
        finally:
            await driver.close()
        data = [each.outputs[8:] for each in said.asked if isinstance(each, DataExchange)]
        assert {each[:2] for each in data} == {b"\0\0", encode_pzd(((CONTROL_WORD,),), {CONTROL_WORD: 7}, order)}
        assert not any(map(any, data[:10]))


async def test_no_bit_is_sent_while_the_order_is_not_proven() -> None:
    with wire(settings=AT_ZERO) as line:
        driver = unconnected(line, NODE)
        said = Line(driver)
        await driver.connect()
        assert await driver.write(NODE, CONTROLWORD, bytes(2)) is Written.ACKNOWLEDGED
        for address, data in ((CONTROLWORD, b"\7\0"), (SETPOINT_VALUE, FIRST)):
            with pytest.raises(PreconditionError) as caught:
                await driver.write(NODE, address, data)
            for language in ("en", "de"):
                assert "profibus." not in error_text(load_texts(language), caught.value)
        await driver.close()
        assert all(each.outputs[8:] == bytes(6) for each in said.asked if isinstance(each, DataExchange))


@pytest.mark.parametrize(("setting", "goes"), [(AS_PKW, True), (AS_PRINTED, False)])
async def test_the_site_may_tell_the_order_of_words_but_not_against_what_is_seen(setting: Order, goes: bool) -> None:
    with wire(settings=AT_ZERO) as line:
        async with connected(line.config(ProfibusStation(NODE, order=setting))) as driver:
            if goes:
                await driver.write(NODE, CONTROLWORD, b"\7\0", verify=Verify.EFFECT)
                assert line.received[CONTROL_WORD] == 7
            else:
                with pytest.raises(PreconditionError):
                    await driver.write(NODE, CONTROLWORD, b"\7\0", verify=Verify.EFFECT)
                assert not line.received.get(CONTROL_WORD)


async def test_a_station_that_was_gone_begins_with_a_controlword_of_0_and_a_new_proof() -> None:
    with wire() as line:
        async with connected(line.config(NODE)) as driver:
            await driver.write(NODE, CONTROLWORD, b"\7\0", verify=Verify.EFFECT)
            line.power_off()
            await gone(driver, NODE)
            line.power_on()
            await driver.read(NODE, STATUSWORD, timeout_s=DEADLINE_S)
            assert not line.received.get(CONTROL_WORD)
            await driver.write(NODE, CONTROLWORD, b"\3\0", verify=Verify.EFFECT)
            assert line.received[CONTROL_WORD] == 3


async def test_what_a_telegram_carries_is_written_there_and_read_back() -> None:
    """Process data win over PKW: in telegram 103 that goes for the ramps, in 102 for the modes."""
    with wire() as line:
        async with connected(line.config(ProfibusStation(NODE, 103))) as driver:
            assert await driver.write(NODE, RAMP_VELOCITY, SECOND) is Written.READ_BACK
            assert line.received[RAMP_VELOCITY_SIGNAL] == 200
            too_much = (1 << 16).to_bytes(4, "little")
            with pytest.raises(RefusedError):
                await driver.write(NODE, RAMP_ACCELERATION, too_much)


async def test_a_save_needs_an_axis_that_is_not_enabled() -> None:
    with wire() as line:
        async with connected(line.config(NODE)) as driver:
            await driver.write(NODE, CONTROLWORD, b"\7\0", verify=Verify.EFFECT)
            with pytest.raises(PreconditionError):
                await driver.save(NODE)
            await driver.write(NODE, CONTROLWORD, bytes(2), urgent=True)
            await driver.save(NODE)


async def test_a_stop_goes_at_once_and_no_older_command_after_it() -> None:
    with wire() as line:
        async with connected(line.config(NODE)) as driver:
            await driver.write(NODE, CONTROLWORD, b"\7\0", verify=Verify.EFFECT)
            known = driver.commanded(NODE, CONTROLWORD)
            reading = asyncio.gather(*(driver.read(NODE, each.address) for each in ED2 if each.access.readable))
            await driver.write(NODE, CONTROLWORD, bytes(2), urgent=True)
            assert line.received[CONTROL_WORD] == 0
            with pytest.raises(OvertakenError):
                await driver.write(NODE, CONTROLWORD, b"\7\0", verify=Verify.EFFECT, known=known)
            assert line.received[CONTROL_WORD] == 0
            reading.cancel()
            await asyncio.gather(reading, return_exceptions=True)


async def test_process_data_are_told_by_name_once_their_order_is_proven() -> None:
    with wire() as line:
        async with connected(line.config(ProfibusStation(NODE, 102))) as driver:
            await driver.read(NODE, STATUSWORD)
            before = await driver.view(NODE)
            assert (before.state, before.problem) == (StationState.EXCHANGING, None)
            assert (before.order, before.received, before.sent) == (None, None, None)
            assert before.diagnosis is not None
            assert before.diagnosis.ready
            await driver.write(NODE, CONTROLWORD, b"\7\0", verify=Verify.EFFECT)
            after = await driver.view(NODE)
            assert after.order == AS_PKW
            assert after.received is not None
            assert after.sent is not None
            assert after.received[CONTROL_WORD] == 7
            assert after.sent[ACTUAL_SIGNAL] == pytest.approx(250_000, abs=1000)
            assert after.age_s is not None
            assert after.age_s < DEADLINE_S
            absent = await driver.view(ABSENT)
            assert (absent.state, absent.age_s) == (StationState.ABSENT, None)
    with pytest.raises(BusLostError):
        await driver.view(NODE)


async def test_where_the_event_loop_hangs_the_axis_gets_a_controlword_of_0() -> None:
    """The thread of the bus goes on by itself: it must not go on feeding what nobody minds any more."""
    with wire() as line:
        async with connected(line.config(NODE)) as driver:
            await driver.write(NODE, CONTROLWORD, b"\7\0", verify=Verify.EFFECT)
            assert line.received[CONTROL_WORD] == 7
            until(lambda: line.received[CONTROL_WORD] == 0)  # polls in the loop's own thread: nothing else runs there
            assert driver._line.stations[NODE].state is StationState.EXCHANGING
            await driver.write(NODE, CONTROLWORD, b"\7\0", verify=Verify.EFFECT)
            assert line.received[CONTROL_WORD] == 7


async def test_closing_takes_the_controlword_back() -> None:
    with wire() as line:
        driver = unconnected(line, NODE)
        said = Line(driver)
        await driver.connect()
        await driver.write(NODE, CONTROLWORD, b"\7\0", verify=Verify.EFFECT)
        await driver.close()
        assert [type(each) for each in said.asked[-2:]] == [GlobalControl, SetPrm]
        assert isinstance(said.asked[-3], DataExchange)
        assert said.asked[-3].outputs[8:] == bytes(6)


# -- the device's own file --------------------------------------------------------------------------

_GSD = """#Profibus_DP
GSD_Revision = 3
Vendor_Name = "Example"
Model_Name = "Example"
Revision = "1"
Ident_Number = 0x0ED2
Protocol_Ident = 0
Station_Type = 0
Modular_Station = 1
Max_Module = 4
{modules}
"""


def _gsd(path: Path, *names: str, telegram: int = 102) -> Path:
    data = b"".join(module.encode() for module in assumed_modules(TELEGRAM_TYPES[telegram]))
    content = ", ".join(f"0x{byte:02X}" for byte in data)
    modules = "\n".join(f'Module = "{name}" {content}\nEndModule' for name in names)
    file = path / "example.gsd"
    file.write_text(_GSD.format(modules=modules), encoding="latin-1")
    return file


def test_a_module_is_taken_by_its_very_name_only(tmp_path: Path) -> None:
    """The library would take "Telegram 102" for what is most like it."""
    file = _gsd(tmp_path, "Telegram 102")
    assert plan_of_gsd(file, ("Telegram 102",)).output_size == TELEGRAM_TYPES[102].output_size
    for name in ("Telegram 103", "telegram 102", "Telegram", ""):
        with pytest.raises(UsageError, match="Telegram 102"):
            plan_of_gsd(file, (name,))
    with pytest.raises(UsageError):
        plan_of_gsd(tmp_path / "none.gsd", ("Telegram 102",))


async def test_a_device_of_another_ident_number_is_not_parametrised(tmp_path: Path) -> None:
    file = _gsd(tmp_path, "Telegram 102")
    file.write_text(file.read_text(encoding="latin-1").replace("0x0ED2", "0x0815"), encoding="latin-1")
    with wire() as line:
        driver = unconnected(line, ProfibusStation(NODE, 102, file, ("Telegram 102",)))
        said = Line(driver)
        await driver.connect()
        with pytest.raises(IdentityError) as caught:
            await driver.read(NODE, STATUSWORD)
        assert (caught.value.details["expected"], caught.value.details["found"]) == ("0815h", "0ED2h")
        await driver.close()
        assert not any(isinstance(each, SetPrm) for each in said.asked)


async def test_a_configuration_that_the_device_refuses_is_told(tmp_path: Path) -> None:
    """As many bytes, but in modules that the device does not know."""
    file = _gsd(tmp_path, "Telegram 1")
    own = b"".join(module.encode() for module in assumed_modules(TELEGRAM_TYPES[102]))
    content = ", ".join(f"0x{byte:02X}" for byte in own)
    file.write_text(file.read_text(encoding="latin-1").replace(content, "0xF6"), encoding="latin-1")
    with wire() as line:
        async with connected(line.config(ProfibusStation(NODE, None, file, ("Telegram 1",)))) as driver:
            async with asyncio.timeout(DEADLINE_S):
                await driver._until(lambda: driver._line.stations[NODE].problem is not None)
            with pytest.raises(DeviceError) as caught:
                await driver.read(NODE, STATUSWORD)
            assert "Chk_Cfg" in error_text(load_texts("en"), caught.value)


async def test_a_device_is_configured_by_its_own_file(tmp_path: Path) -> None:
    file = _gsd(tmp_path, "Telegram 102", "Telegram 1")
    with wire() as line:
        async with connected(line.config(ProfibusStation(NODE, None, file, ("Telegram 102",)))) as driver:
            assert len(await driver.read(NODE, RAMP_VELOCITY)) == 4
            assert line.device.channels[0].telegram == TELEGRAM_TYPES[102]


# -- another master -------------------------------------------------------------------------------


def _say(line: Wire, data: bytes) -> Callable[[], None]:
    """Put bytes of somebody else on the line."""
    return lambda: line.do(lambda: os.write(line.line.fileno(), data))


async def test_a_token_on_the_line_keeps_us_from_beginning() -> None:
    with wire() as line:
        driver = unconnected(line, NODE, listen_s=2.0)
        said = Line(driver)
        connecting = asyncio.ensure_future(driver.connect())
        async with asyncio.timeout(DEADLINE_S):
            while driver.status.state is not LinkState.LISTENING:  # noqa: ASYNC110  its own event is connect's
                await asyncio.sleep(0.005)
        await asyncio.to_thread(_say(line, Token(OTHER, OTHER).encode()))
        with pytest.raises(ForeignMasterError) as caught:
            await connecting
        assert caught.value.details["master"] == OTHER
        assert said.asked == []
        assert driver.status.state.value == "closed"


async def test_a_slave_of_another_master_is_left_to_it() -> None:
    with wire() as line:
        theirs = dp.encode_request(SetPrm(line.device.slave.ident), OTHER, NODE, fcb=True)
        line.do(lambda: line.device.slave.hear(line.line.now_ns, theirs))
        driver = unconnected(line, NODE)
        said = Line(driver)
        with pytest.raises(ForeignMasterError) as caught:
            await driver.connect()
        assert caught.value.details["master"] == OTHER
        assert not any(isinstance(each, SetPrm | DataExchange) for each in said.asked)
        assert line.device.slave.master == OTHER


async def test_a_master_that_comes_later_ends_everything() -> None:
    with wire() as line:
        async with connected(line.config(NODE)) as driver:
            said = Line(driver)
            theirs = dp.encode_request(dp.SlaveDiag(), OTHER, NODE).encode()
            await asyncio.to_thread(_say(line, theirs))
            await becomes(driver, LinkState.LOST)
            with pytest.raises(ForeignMasterError):
                await driver.read(NODE, STATUSWORD)
            assert not any(isinstance(each, GlobalControl) for each in said.asked)
