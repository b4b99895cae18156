"""What the browser gets of the 3D client: its own page, shown bare and framed so that all three blades are seen."""

from __future__ import annotations

import math
from typing import Final

CAMERA_M: Final = (-48.5, -24.5, 9.5)
"""From upwind, aside and above, so far away that perspective shortens no blade much."""
LOOK_AT_M: Final = (0.6, -0.6, 2.6)
_HALF_HEIGHT_M: Final = 13.6
_HALF_WIDTH_M: Final = 14.6
"""What must be seen around the point looked at, margins included."""

_DISTANCE_M: Final = math.dist(CAMERA_M, LOOK_AT_M)
FOV_RAD: Final = 2 * math.atan(_HALF_HEIGHT_M / _DISTANCE_M)
"""Vertical angle of view where the frame is as wide as high, or wider."""

_BARE: Final = """<style>
html, body, #root {{ height: 100%; margin: 0; overflow: hidden; }}
body :not(canvas):not(:has(canvas)):not(style):not(script) {{ display: none !important; }}
</style><script>
// The client reconnects only while its window has the focus, which a docked frame seldom has.
Document.prototype.hasFocus = () => true;
// It also prepares a sorter for point clouds that makes code from text: our policy refuses that, this view needs none.
addEventListener("unhandledrejection", (event) => event.reason instanceof EvalError && event.preventDefault());
// A narrow frame needs a wider angle; the client takes it from its address.
const query = new URLSearchParams(location.search);
const half = Math.max({half_height:.4f}, {half_width:.4f} * innerHeight / Math.max(1, innerWidth));
if (!query.has("initialCameraFov")) {{
  query.set("initialCameraFov", (2 * Math.atan(half)).toFixed(4));
  history.replaceState(null, "", "?" + query);
}}
</script>"""
"""The rule names no class of the client, for they change with every version: whatever neither is nor holds a canvas
(control panel, notices, dialogs) is not shown."""


def bare_page(page: bytes) -> bytes:
    """The client's page with our style and script at the start of its head, before anything of its own runs."""
    ours = _BARE.format(half_height=_HALF_HEIGHT_M / _DISTANCE_M, half_width=_HALF_WIDTH_M / _DISTANCE_M)
    head, mark, rest = page.partition(b"<head>")
    return head + mark + ours.encode() + rest
