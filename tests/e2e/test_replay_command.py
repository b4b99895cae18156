"""``hubside replay``: a recording from anywhere, served by one command."""

from __future__ import annotations

import json
import shutil
import urllib.request
from http.cookiejar import CookieJar
from pathlib import Path

from tests.e2e.processes import ROOT, hubside, running

SAMPLE = ROOT / "recordings" / "scenarios" / "3-following-error.mcap"


def test_a_recording_from_anywhere_is_served_and_its_address_leads_to_it(tmp_path: Path) -> None:
    path = tmp_path / "stick" / "turbine 7.mcap"
    path.parent.mkdir()
    shutil.copy(SAMPLE, path)
    data = tmp_path / "data"
    with running("replay", str(path), "--port", "0", "--data", str(data), "--json") as process:
        url = json.loads(process.wait_for('"url"'))["url"]
        browser = urllib.request.build_opener(
            urllib.request.ProxyHandler({}), urllib.request.HTTPCookieProcessor(CookieJar())
        )
        with browser.open(url) as page:
            assert page.url.endswith("/recordings?replay=turbine+7")
        origin = url.partition("/?")[0]
        with browser.open(f"{origin}/api/recordings") as answer:
            assert json.load(answer)["files"][0]["name"] == "turbine 7.mcap"
        request = urllib.request.Request(
            f"{origin}/api/replay",
            json.dumps({"recording": "turbine 7.mcap"}).encode(),
            {"Content-Type": "application/json"},
        )
        with browser.open(request) as answer:
            assert json.load(answer)["turbine"] == "wtg-07"
        with browser.open(f"{origin}/api/live/turbine") as answer:
            assert json.load(answer) is None


def test_what_cannot_be_replayed_is_told_before_anything_is_served(tmp_path: Path) -> None:
    bad = tmp_path / "bad.mcap"
    bad.write_bytes(b"nothing of it")
    answer = hubside("replay", str(bad))
    assert answer.code == 2
    assert "bad.mcap" in answer.err
    log = tmp_path / "trip.asc"
    log.write_text("date Mon Jan 1 00:00:00.000 2024\n")
    answer = hubside("replay", str(log))
    assert answer.code == 2
    assert "hubside import" in answer.err
