"""``python -m tests.e2e.screenshots [FOLDER] [ROOM ...]``: pictures of every room of the page, in both themes.

The demo is started and its page opened as a person would; what is in the pictures is what the twins answered. FOLDER is
``docs/img`` where none is given.
"""

from __future__ import annotations

import io
import json
import sys
import tempfile
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Final

from PIL import Image
from playwright.sync_api import Browser, Page, ViewportSize, expect, sync_playwright

from tests.e2e.browser import CHROMIUM, FLAGS, SOFTWARE_3D
from tests.e2e.processes import ROOT, running

FOLDER: Final = ROOT / "docs" / "img"
SIZE: Final[ViewportSize] = {"width": 1366, "height": 768}
WAIT_MS: Final = 60_000
SETTLE_MS: Final = 1_500
"""After everything is there: fonts, transitions, the first points of a plot."""
COLOURS: Final = 256
BUSY: Final = "main .mantine-Loader-root, main .mantine-Skeleton-root, main [aria-busy=true]"
THEMES: Final = ("dark", "light")

SETUP: Final = "/axis?blade=1&tab=setup&picture="


@dataclass(frozen=True)
class Shot:
    """One picture: ``ready`` is a selector of what must be seen before it is taken; ``scene``: with the 3D view.

    ``fault``: the order of a fault that acts while it is taken.
    """

    name: str
    address: str
    ready: str
    language: str = "en"
    scene: bool = False
    themes: tuple[str, ...] = THEMES
    fault: Mapping[str, object] | None = None


SHOTS: Final = (
    Shot("overview", "/", "[data-testid=blade-3] [data-testid=angle]:has-text('°')", scene=True),
    Shot("overview-de", "/", "[data-testid=blade-3] [data-testid=angle]:has-text('°')", "de", True, ("dark",)),
    Shot("axis", "/axis?blade=1", "[data-testid=axis-angle]:has-text('°')", scene=True),
    Shot("axis-temperatures", f"{SETUP}temperatures", "[data-testid=picture-temperatures]"),
    Shot("axis-masks", f"{SETUP}masks", "[data-testid=picture-masks]"),
    Shot("axis-ladder", f"{SETUP}ladder", "[data-testid=picture-ladder]"),
    Shot("axis-battery", f"{SETUP}battery", "[data-testid=battery-picture]"),
    Shot("axis-gear", f"{SETUP}gear", "[data-testid=gear-picture]"),
    Shot("axis-scope", "/axis?blade=1&tab=scope", "[data-testid=arm]"),
    Shot("axis-pdo", "/axis?blade=1&tab=pdo", "main [data-testid^=pdo-]:visible"),
    Shot("parameters", "/parameters?device=wtg-07/blade-1/pmm", "main [data-testid^='value-']"),
    Shot(
        "parameters-side",
        "/parameters?device=wtg-07/blade-1/pmm&view=side&q=3110&edit=3110:01",
        "main [data-testid$='blade-3/pmm-3110:01']:has-text('50.0')",
    ),
    Shot("sets", "/sets", "main [role=row]:has-text('yearly service')"),
    Shot(
        "compare",
        "/sets?tab=compare&columns=live:wtg-07/blade-1/pmc,live:wtg-07/blade-2/pmc,default:wtg-07/blade-1/pmc",
        "[data-testid=compared-607F]",
    ),
    Shot("recordings", "/recordings", "main [role=row] >> nth=1"),
    Shot("bus", "/bus", "[data-testid=trace-row] >> nth=20"),
    Shot("bus-nodes", "/bus?tab=nodes", "main :text('Blade 3 PMC')"),
    Shot("procedures", "/procedures", "main h2"),
    Shot("settings", "/settings", "[data-testid=adapters]"),
    Shot("settings-polling", "/settings?section=polling", "[data-testid=save-polling]"),
    Shot("settings-audit", "/settings?section=audit", "[data-testid=audit-rows]"),
    # Last, for it leaves the twins with a fault.
    Shot(
        "instructor",
        "/instructor?kind=overload&blade=3",
        "[data-testid=fault-mains_failure]",
        scene=True,
        fault={"kind": "mains_failure", "blade": 2, "values": {"remaining_percent": 60}, "seconds": 300},
    ),
)


def main(arguments: Sequence[str]) -> int:
    """Take the pictures, those of the named rooms or all; gives the exit code."""
    folder = Path(arguments[0]) if arguments else FOLDER
    wanted = [shot for shot in SHOTS if not arguments[1:] or shot.name in arguments[1:]]
    if not wanted:
        print(f"rooms: {', '.join(shot.name for shot in SHOTS)}", file=sys.stderr)
        return 2
    folder.mkdir(parents=True, exist_ok=True)
    with tempfile.TemporaryDirectory() as data, sync_playwright() as playwright, demo(Path(data)) as url:
        chromium = playwright.chromium.launch(executable_path=CHROMIUM, args=[*FLAGS, *SOFTWARE_3D])
        cookies = furnish(chromium, url)
        for shot in wanted:
            for theme in shot.themes:
                path = folder / f"{shot.name}-{theme}.png"
                path.write_bytes(packed(picture(chromium, url.split("/?")[0], cookies, shot, theme)))
                print(f"{path} {path.stat().st_size // 1024} kB", flush=True)
        chromium.close()
    return 0


@contextmanager
def demo(data: Path) -> Iterator[str]:
    """``hubside demo`` with an empty data folder; the address that it prints."""
    with running("demo", "--port", "0", "--data", str(data), "--json") as process:
        yield json.loads(process.wait_for('"url"'))["url"]


def furnish(chromium: Browser, url: str) -> list[dict[str, object]]:
    """Open the session, and back the turbine up so that there are sets to see; gives the session's cookies."""
    context = chromium.new_context()
    page = context.new_page()
    page.goto(url)
    expect(page.get_by_test_id("blade-3")).to_contain_text("°", timeout=WAIT_MS)
    answer = context.request.post(f"{url.split('/?')[0]}/api/live/backup", data={"reason": "yearly service"})
    job = answer.json()
    for _ in range(WAIT_MS // 250):
        state = context.request.get(f"{url.split('/?')[0]}/api/live/jobs/{job['id']}").json()["state"]
        if state != "running":
            break
        page.wait_for_timeout(250)
    cookies = [dict(cookie) for cookie in context.cookies()]
    context.close()
    return cookies


def picture(chromium: Browser, origin: str, cookies: list[dict[str, object]], shot: Shot, theme: str) -> bytes:
    """The room as PNG, once it has all it shows."""
    context = chromium.new_context(
        viewport=SIZE,
        locale="de-DE" if shot.language == "de" else "en-GB",
        timezone_id="UTC",
        reduced_motion="reduce",
        color_scheme="light" if theme == "light" else "dark",
    )
    context.add_cookies(cookies)  # type: ignore[arg-type]
    try:
        if shot.fault is not None:
            context.request.delete(f"{origin}/api/instructor/faults")
            context.request.post(f"{origin}/api/instructor/faults", data=dict(shot.fault))
        page = context.new_page()
        page.set_default_timeout(WAIT_MS)
        joint = "&" if "?" in shot.address else "?"
        scene = "" if shot.scene else "&scene=off"
        page.goto(f"{origin}{shot.address}{joint}lang={shot.language}&theme={theme}{scene}")
        page.locator(shot.ready).first.wait_for()
        page.wait_for_function(f"() => !document.querySelector({json.dumps(BUSY)})")
        page.evaluate("() => document.fonts.ready")
        if shot.scene:
            wait_for_scene(page)
        page.wait_for_timeout(SETTLE_MS)
        return page.screenshot(animations="disabled")
    finally:
        context.close()


def wait_for_scene(page: Page) -> None:
    """Until the 3D view has drawn something: many shades instead of one."""
    canvas = page.frame_locator("iframe").locator("canvas").first
    canvas.wait_for()
    for _ in range(WAIT_MS // 500):
        colours = Image.open(io.BytesIO(canvas.screenshot())).convert("L").getcolors()
        if colours is not None and len(colours) > 60:
            return
        page.wait_for_timeout(500)
    raise TimeoutError("the 3D view stayed blank")


def packed(png: bytes) -> bytes:
    """The picture in a palette: a third of the size, no difference to the eye."""
    small = (
        Image.open(io.BytesIO(png)).convert("RGB").quantize(COLOURS, Image.Quantize.MEDIANCUT, dither=Image.Dither.NONE)
    )
    out = io.BytesIO()
    small.save(out, "PNG", optimize=True)
    return out.getvalue()


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
