"""The diagnosis of a bus over HTTP: a line with its station as documents, the check of an order and its keeping."""

from __future__ import annotations

from pathlib import Path

from app.model.site import load_site
from app.service.sites import Sites
from app.wire.profibus.diagnosis import Diagnosis, Status
from app.wire.profibus.slave_states import DpState, WatchdogState, dp_state, watchdog_state
from tests.drivers.profibus_rig import wire
from tests.service.lines_rig import DEVICE, connected, descriptions, site_text, turbine_of
from tests.web.rig import running

ORDER = f"/api/live/devices/{DEVICE}/order"


async def test_a_station_is_shown_checked_and_its_order_kept(tmp_path: Path) -> None:
    file = tmp_path / "site.toml"
    with wire() as line:
        file.write_text(site_text(line), encoding="utf-8")
        async with connected(line) as connection, running(connection) as server:
            server.bench.site_editor._sites = Sites((turbine_of(line),), descriptions, file=file)
            (bus,) = (await server.client.get("/api/live/bus/lines")).json()
            assert (bus["kind"], bus["state"], bus["master"], bus["bitrate"]) == ("profibus-dp", "connected", 2, 500000)
            (station,) = bus["stations"]
            assert (station["state"], station["problem"], station["order"]) == ("exchanging", None, None)
            assert (station["dp_state"], station["watchdog_state"]) == ("data_exchange", "dp_control")
            assert station["diagnosis"]["ident"] == 0x0ED2
            assert station["diagnosis"]["status"] == ["lines.status.watchdog"]
            assert (station["telegram"]["number"], station["telegram"]["input_size"]) == (1, 14)
            status, actual = station["telegram"]["sent"]
            assert (status["data"], status["signals"][0]["raw"]) == ("00 08", None)
            assert (actual["word"], actual["words"]) == (2, 2)

            check = (await server.client.post(f"{ORDER}/check", json={})).json()
            assert (check["fits"], check["proven"], check["reason_key"]) == (["high-high"], "high-high", None)
            assert set(check["readings"][1]["said"]) == {"low-low", "low-high", "high-low", "high-high"}
            ((known,),) = [one["stations"] for one in (await server.client.get("/api/live/bus/lines")).json()]
            assert known["telegram"]["sent"][0]["signals"][0]["raw"] == 8

            refused = await server.client.post(f"{ORDER}/keep", json={"order": "low-low"})
            assert (refused.status_code, refused.json()["code"]) == (409, "settings")
            assert load_site(file)[0].devices[0].slave.pzd_order == ""
            assert (await server.client.post(f"{ORDER}/keep", json={"order": "high-high"})).status_code == 200
            assert load_site(file)[0].devices[0].slave.pzd_order == "high-high"


def test_where_a_slave_stands_by_its_diagnosis() -> None:
    def told(status: Status) -> Diagnosis:
        return Diagnosis(status | Status.ALWAYS, 2, 0x0ED2)

    assert dp_state(None, exchanging=False) is None
    assert dp_state(told(Status.PARAMETERS_REQUIRED | Status.NOT_READY), exchanging=False) is DpState.WAIT_PRM
    assert dp_state(told(Status.PARAMETER_FAULT), exchanging=False) is DpState.WAIT_PRM
    assert dp_state(told(Status.NOT_READY), exchanging=False) is DpState.WAIT_CFG
    assert dp_state(told(Status.CONFIGURATION_FAULT), exchanging=False) is DpState.WAIT_CFG
    assert dp_state(told(Status.WATCHDOG), exchanging=False) is DpState.DATA_EXCHANGE
    assert dp_state(told(Status.NOT_READY), exchanging=True) is DpState.DATA_EXCHANGE
    assert watchdog_state(None) is None
    assert watchdog_state(told(Status.WATCHDOG)) is WatchdogState.DP_CONTROL
    assert watchdog_state(told(Status(0))) is WatchdogState.BAUD_CONTROL
