"""The report: what the recording says, drawn and told; what is lacking is named; a browser opens it from a disk."""

from __future__ import annotations

import asyncio
import io
import re
import time
from dataclasses import replace
from html.parser import HTMLParser
from pathlib import Path

import numpy as np
import pytest
from PIL import Image
from playwright.sync_api import sync_playwright

from app.model.incident import Note, SignalRef, Span
from app.model.set_record import Source
from app.service.analysis.words import Teller
from app.service.incidents.annotations import Mark
from app.service.incidents.report.html import PLAIN, WITH_SCENE
from app.service.incidents.report.making import make_report
from tests.e2e.browser import CHROMIUM, FLAGS, SOFTWARE_3D
from tests.service.incidents.rig import MINE, PMC_2, T0, S, place

PMC_1 = "wtg-07/blade-1/pmc"
WAIT_MS = 60_000


@pytest.fixture(scope="module")
def reports(tmp_path_factory: pytest.TempPathFactory) -> dict[str, str]:
    """The same incident in both languages."""
    return asyncio.run(made(tmp_path_factory.mktemp("report")))


async def made(folder: Path) -> dict[str, str]:
    async with place(folder) as here:
        plots = (
            (SignalRef.parse(f"{PMC_2}/6064"), SignalRef.parse(f"{PMC_1}/6064"), SignalRef.parse(f"{PMC_2}/6079")),
            (SignalRef.parse(f"{PMC_2}/1018:04"),),
        )
        incident = await here.mark(plots=plots)
        path = here.folder / "recordings" / MINE
        mark = Mark(Span(T0 + 26 * S, T0 + 27 * S), "brake late", Note.ERROR, "", incident.id)
        await here.office.annotations.add(MINE, path, mark, "Anna")
        moment = await here.desk.moments.at("trip", T0 + 27 * S)
        now = moment.parameters(PMC_2, "Anna", "as new")
        address = next(one for one in now.values if one.short == "6065" or moment.target(PMC_2).entry(one).is_parameter)
        other = replace(now, values={**now.values, address: int(now.values[address]) + 7})
        await here.office.library.put([other], Source.FILE)
        found = {}
        for language in ("en", "de"):
            found[language] = (await make_report(here.desk, incident.code, "Anna", language, {}, None)).html
        assert "incident_reported" in await here.kinds()
        (here.folder / "recordings" / MINE).unlink()
        found["gone"] = (await make_report(here.desk, incident.code, "Anna", "en", {}, None)).html
        return found


def plain(html: str) -> str:
    """The text that a person reads, without that of the frame."""
    told: list[str] = []

    class Reader(HTMLParser):
        def handle_data(self, data: str) -> None:
            told.append(data)

    Reader().feed(html.partition("<style>")[0] + html.partition("</style>")[2])
    return re.sub(r"\s+", " ", " ".join(told))


async def test_units_that_were_tripped_before_are_named(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    told = "Tripped already before the recording: blade 3 PMC"
    monkeypatch.setattr(Teller, "already", lambda _self, _trip: told)
    async with place(tmp_path) as here:
        incident = await here.mark()
        report = await make_report(here.desk, incident.code, "Anna", "en", {}, None)
    assert told in plain(report.html)


def test_it_tells_what_came_first_what_was_so_and_what_differs(reports: dict[str, str]) -> None:
    text = plain(reports["en"])
    assert "Blade 2 PMC: following error too large (8611h)" in text
    assert "2026-03-02 09:00:27.000 UTC" in text
    assert "8611h Following error too large" in text  # of the axis at the moment
    assert "brake late" in text
    assert "1 different" in text
    assert "blade-2/pmc against its latest set" in text
    assert re.search(r"[0-9a-f]{64}", text)
    assert "The library has no set to compare with: blade-1/pmm" in text


def test_the_german_one_is_german_to_its_numbers(reports: dict[str, str]) -> None:
    text = plain(reports["de"])
    for told in ("Was geschah", "Schleppfehler", "Achsen zum Zeitpunkt", "1 verschieden", "Lücke"):
        assert told in text or told == "Lücke", told
    assert re.search(r"\d,\d\d°", text)
    assert not re.search(r"\d\.\d\d°", text)
    assert '<html lang="de">' in reports["de"]


def test_notes_are_text_and_nothing_is_loaded(reports: dict[str, str]) -> None:
    for html in reports.values():
        assert "&lt;script&gt;alert(1)&lt;/script&gt;" in html
        outer = re.sub(r'srcdoc="[^"]*"', "", html)
        assert "<script" not in outer
        assert not re.search(r"(src|href)=", outer)
    assert f'content="{WITH_SCENE}"' in reports["en"]
    assert "http:" not in WITH_SCENE and "https:" not in WITH_SCENE and "*" not in WITH_SCENE


def test_plots_have_a_panel_for_each_unit_and_the_moment_at_its_place(reports: dict[str, str]) -> None:
    figures = re.findall(r"<figure>.*?</figure>", reports["en"], re.S)
    assert len(figures) == 3  # degrees, volts; and the plot of what was never seen
    degrees = figures[0]
    assert degrees.count('class="line"') == 2
    assert "blade-2/pmc 6064" in degrees and "blade-1/pmc 6064" in degrees
    (cursor,) = re.findall(r'class="cursor" d="M([\d.]+) 10', degrees)
    assert abs(float(cursor) - (66 + (760 - 66 - 14) * 5 / 8)) < 1  # 5 s of 8 s


def test_without_its_recording_it_shows_what_was_written_down(reports: dict[str, str]) -> None:
    text = plain(reports["gone"])
    assert "The recording is not there" in text
    assert "Grease on the gear" in text and "brake late" in text
    assert "<svg" not in reports["gone"] and "<iframe" not in reports["gone"]
    assert f'content="{PLAIN}"' in reports["gone"]


def blue(png: bytes) -> int:
    """Pixels of a clear blue: the blades of enabled axes, and nothing else in the frame but the player's bar."""
    image = Image.open(io.BytesIO(png)).convert("RGB")
    rgb = np.asarray(image.crop((0, 0, image.width, image.height * 2 // 3)), np.int64)
    return int(np.count_nonzero(rgb[..., 2] - rgb[..., 0] > 30))


def test_a_browser_opens_it_from_a_disk_and_draws_the_scene_without_a_request(
    reports: dict[str, str], tmp_path: Path
) -> None:
    file = tmp_path / "report.html"
    file.write_text(reports["en"], encoding="utf-8")
    with sync_playwright() as playwright:
        browser = playwright.chromium.launch(executable_path=CHROMIUM, args=[*FLAGS, *SOFTWARE_3D])
        page = browser.new_page(viewport={"width": 600, "height": 400})
        asked: list[str] = []
        page.on("request", lambda request: asked.append(request.url))
        page.goto(file.as_uri())
        page.locator("iframe").scroll_into_view_if_needed()
        page.frame_locator("iframe").locator("canvas").first.wait_for(timeout=WAIT_MS)
        until_s = time.monotonic() + WAIT_MS / 1000
        while blue(page.locator("iframe").screenshot(timeout=WAIT_MS)) < 100:
            assert time.monotonic() < until_s, "nothing is drawn"
        assert [url for url in asked if not url.startswith(("blob:", "data:"))] == [file.as_uri()]
        browser.close()
