"""The 3D client in a real browser, in frames of several shapes: nothing but the picture, and the whole rotor in it."""

from __future__ import annotations

import asyncio
import io
import os
import shutil

import numpy as np
import numpy.typing as npt
import pytest
from PIL import Image
from playwright.async_api import Browser, async_playwright

from app.model.address import Address
from app.scene.hub import BladeState, HubScene
from tests.e2e.test_browser import FLAGS
from tests.web.rig import Feeder, Server, running

pytestmark = [pytest.mark.browser, pytest.mark.timeout(240)]

CHROMIUM = os.environ.get("CHROMIUM") or shutil.which("chromium") or "/usr/bin/chromium"
SHAPES = [(360, 520), (280, 700), (900, 600)]
STATES = {11: (0x0237, BladeState.ENABLED), 12: (0x0217, BladeState.WARNING), 13: (0x0218, BladeState.FAULT)}
"""Statusword of each axis, and how its blade must look."""
STRANGERS = """() => [...document.body.querySelectorAll('*')].filter(
  (one) => one.tagName !== 'CANVAS' && !one.querySelector('canvas') && one.getClientRects().length > 0
).length"""
"""Counts elements that take room on the screen and are neither a canvas nor around one."""
BRIGHT = 60
DEADLINE_S = 60.0


async def test_the_view_is_bare_and_holds_all_three_blades() -> None:
    scene = HubScene("a secret of this test")
    try:
        async with running(scene=scene) as server, async_playwright() as playwright:
            traffic = asyncio.create_task(keep_feeding(server.feeder))
            browser = await playwright.chromium.launch(executable_path=CHROMIUM, args=FLAGS)
            for shape in SHAPES:
                await look(browser, server, shape)
            await browser.close()
            traffic.cancel()
    finally:
        await asyncio.to_thread(scene.close)


async def keep_feeding(feeder: Feeder) -> None:
    """Angles and states again and again, as if polled. At 0 degrees the blades are seen at their broadest."""
    while True:
        for node, (status, _) in STATES.items():
            feeder.read(node, Address(0x6064), bytes(4))
            feeder.read(node, Address(0x6041), status.to_bytes(2, "little"))
        await asyncio.sleep(0.2)


async def look(browser: Browser, server: Server, shape: tuple[int, int]) -> None:
    """Open the view in a frame of this shape and look at the picture."""
    context = await browser.new_context(viewport={"width": shape[0], "height": shape[1]})
    name, _, secret = server.cookie.partition("=")
    await context.add_cookies([{"name": name, "value": secret, "url": server.origin}])
    page = await context.new_page()
    errors: list[str] = []
    page.on("pageerror", lambda error: errors.append(str(error)))
    await page.goto(f"{server.origin}/viser/?hideViserLogo")
    async with asyncio.timeout(DEADLINE_S):
        while True:
            picture = np.asarray(Image.open(io.BytesIO(await page.screenshot())).convert("RGB")).astype(int)
            if all(blade_is_seen(picture, state) for _, state in STATES.values()):
                break
    assert await page.evaluate(STRANGERS) == 0
    assert errors == []
    edge = np.concatenate([picture[0], picture[-1], picture[:, 0], picture[:, -1]])
    assert edge.max() < BRIGHT, f"{shape}: the rotor is cut off"
    await context.close()


def blade_is_seen(picture: npt.NDArray[np.int_], state: BladeState) -> bool:
    """Some part of the picture has the hue of this state."""
    wanted = np.array(state.value) / max(state.value)
    bright = picture.max(axis=2)
    lit = bright > BRIGHT
    hue = picture[lit] / bright[lit][:, None]
    return bool((np.abs(hue - wanted).max(axis=1) < 0.12).sum() > 50)
