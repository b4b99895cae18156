"""The 3D client in a real browser: nothing but the picture, the whole rotor in it, and its talk with the page."""

from __future__ import annotations

import asyncio
import io
import os
import shutil
from collections.abc import AsyncIterator, Callable
from contextlib import asynccontextmanager
from typing import Any

import numpy as np
import numpy.typing as npt
import pytest
from PIL import Image
from playwright.async_api import Browser, BrowserContext, Page, async_playwright

from app.model.address import Address
from app.scene.hub import BladeState, HubScene
from tests.e2e.test_browser import FLAGS
from tests.web.rig import Feeder, Server, running

pytestmark = [pytest.mark.browser, pytest.mark.timeout(300)]

CHROMIUM = os.environ.get("CHROMIUM") or shutil.which("chromium") or "/usr/bin/chromium"
SHAPES = [(360, 520), (900, 600)]
STATES = {11: (0x0237, BladeState.ENABLED), 12: (0x0217, BladeState.WARNING), 13: (0x0218, BladeState.FAULT)}
"""Statusword of each axis, and how its blade must look."""
STRANGERS = """() => [...document.body.querySelectorAll('*')].filter(
  (one) => one.tagName !== 'CANVAS' && !one.querySelector('canvas') && one.getClientRects().length > 0
).length"""
"""Counts elements that take room on the screen and are neither a canvas nor around one."""
FRAMED = """() => {
  window.told = [];
  addEventListener('message', (event) => event.data?.hubside && told.push(event.data));
  const frame = document.createElement('iframe');
  frame.src = '/viser/?hideViserLogo&darkMode';
  frame.style = 'position: fixed; inset: 0; border: 0; width: 360px; height: 520px';
  document.documentElement.replaceChildren(document.createElement('body'));
  document.body.append(frame);
}"""
"""Makes of the page one that holds the view in a frame, as ours does, and keeps what it is told."""
TELL = """(view) => document.querySelector('iframe').contentWindow.postMessage(
  {hubside: 'view', theme: 'dark', camera: 'front', selected: null, ghosts: true, ...view}, location.origin)"""
BRIGHT = 75
DEADLINE_S = 90.0


@asynccontextmanager
async def browsing() -> AsyncIterator[tuple[Browser, Server, HubScene]]:
    """A browser, and a server whose three blades have angles and states again and again."""
    scene = HubScene("a secret of this test")
    try:
        async with running(scene=scene) as server, async_playwright() as playwright:
            traffic = asyncio.create_task(keep_feeding(server.feeder))
            browser = await playwright.chromium.launch(executable_path=CHROMIUM, args=FLAGS)
            yield browser, server, scene
            await browser.close()
            traffic.cancel()
    finally:
        await asyncio.to_thread(scene.close)


async def keep_feeding(feeder: Feeder) -> None:
    """As if polled. At 0 degrees the blades are seen at their broadest."""
    while True:
        for node, (status, _) in STATES.items():
            feeder.read(node, Address(0x6064), bytes(4))
            feeder.read(node, Address(0x6041), status.to_bytes(2, "little"))
        await asyncio.sleep(0.2)


async def context_of(browser: Browser, server: Server, shape: tuple[int, int]) -> BrowserContext:
    """A browser profile that has a session."""
    context = await browser.new_context(viewport={"width": shape[0], "height": shape[1]})
    name, _, secret = server.cookie.partition("=")
    await context.add_cookies([{"name": name, "value": secret, "url": server.origin}])
    context.set_default_timeout(DEADLINE_S * 1000)
    return context


async def test_the_view_is_bare_and_holds_all_three_blades() -> None:
    async with browsing() as (browser, server, _):
        for shape in SHAPES:
            await look(browser, server, shape)


async def look(browser: Browser, server: Server, shape: tuple[int, int]) -> None:
    """Open the view in a frame of this shape and look at the picture."""
    context = await context_of(browser, server, shape)
    page = await context.new_page()
    errors: list[str] = []
    page.on("pageerror", lambda error: errors.append(str(error)))
    await page.goto(f"{server.origin}/viser/?hideViserLogo&darkMode")
    async with asyncio.timeout(DEADLINE_S):
        while True:
            picture = await picture_of(page)
            if all(blade_is_seen(picture, state) for _, state in STATES.values()):
                break
    assert await page.evaluate(STRANGERS) == 0
    assert errors == []
    edge = np.concatenate([picture[0], picture[:, 0], picture[:, -1]])  # the tower may reach the lower one
    assert edge.max() < BRIGHT, f"{shape}: the rotor is cut off"
    await context.close()


async def picture_of(page: Page) -> npt.NDArray[np.int_]:
    """What is on the screen: height, width, red-green-blue."""
    return np.asarray(Image.open(io.BytesIO(await page.screenshot())).convert("RGB")).astype(int)


def blade_is_seen(picture: npt.NDArray[np.int_], state: BladeState) -> bool:
    """Some part of the picture has the hue of this state."""
    wanted = np.array(state.rgb) / max(state.rgb)
    bright = picture.max(axis=2)
    lit = bright > BRIGHT
    hue = picture[lit] / bright[lit][:, None]
    return bool((np.abs(hue - wanted).max(axis=1) < 0.15).sum() > 50)


async def test_a_click_selects_and_the_page_sets_camera_and_theme_of_its_own_view() -> None:
    async with browsing() as (browser, server, scene):
        context = await context_of(browser, server, SHAPES[0])
        page = await context.new_page()
        await page.goto(f"{server.origin}/viser/nothing-but-our-origin")
        await page.evaluate(FRAMED)
        assert (await told(page, "link", lambda message: message["up"]))["up"]

        root = await place(page, "root-2")
        await page.mouse.click(root["x"], root["y"])
        assert (await told(page, "select", lambda message: message["blade"] == 2))["blade"] == 2
        assert not await was_told(page, "freed")

        await page.evaluate(TELL, {"camera": "blade-3", "theme": "light", "selected": 2})
        await told(page, "places", lambda message: is_near_middle(message, "root-3"))
        frame = page.frames[1]
        assert await frame.evaluate("() => document.documentElement.dataset.theme") == "light"
        ground = (await picture_of(page))[4, 4]
        assert ground.min() > 120, "the ground stays dark in the light theme"

        await page.mouse.move(100, 100)
        await page.mouse.down()
        await page.mouse.move(160, 130, steps=3)
        await page.mouse.up()
        await told(page, "freed", lambda _message: True)

        await page.evaluate("() => { told.length = 0 }")
        scene._server._websock_server.disconnect_all_clients()
        await told(page, "link", lambda message: not message["up"])
        await told(page, "link", lambda message: message["up"])
        await context.close()


async def told(page: Page, kind: str, fits: Callable[[Any], bool]) -> Any:
    """The latest message of this kind that fits, as soon as there is one."""
    async with asyncio.timeout(DEADLINE_S):
        while True:
            messages = await page.evaluate("(kind) => told.filter((one) => one.hubside === kind)", kind)
            found = next((message for message in reversed(messages) if fits(message)), None)
            if found is not None:
                return found
            await asyncio.sleep(0.1)


async def was_told(page: Page, kind: str) -> bool:
    """Such a message came."""
    return bool(await page.evaluate("(kind) => told.some((one) => one.hubside === kind)", kind))


async def place(page: Page, name: str) -> Any:
    """Where a label belongs, once the scene is there and can be hit."""
    async with asyncio.timeout(DEADLINE_S):
        while True:
            if blade_is_seen(await picture_of(page), BladeState.WARNING):
                break
    message = await told(page, "places", lambda _message: True)
    return next(one for one in message["places"] if one["id"] == name)


def is_near_middle(message: Any, name: str) -> bool:
    """This label belongs into the middle third of the frame."""
    at = next(one for one in message["places"] if one["id"] == name)
    return bool(abs(at["x"] / message["width"] - 0.5) < 1 / 4 and abs(at["y"] / message["height"] - 0.5) < 1 / 4)
