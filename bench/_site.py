"""The site file of a benchmark: the example turbine on the benchmark's bus."""

from __future__ import annotations

from pathlib import Path
from typing import Final

_EXAMPLE: Final = Path(__file__).parents[1] / "docs" / "sites" / "example.toml"
_CONNECTION: Final = "socketcand:127.0.0.1:29536"
_BITRATE: Final = "bitrate = 500000"


def write_site(folder: Path, address: str, bitrate: int) -> Path:
    """Write it into ``folder``; ``address`` is ``HOST:PORT``. Raises RuntimeError where the example is another one."""
    text = _EXAMPLE.read_text(encoding="utf-8")
    if _CONNECTION not in text or _BITRATE not in text:
        raise RuntimeError(f"{_EXAMPLE} has another connection than expected")
    path = folder / "site.toml"
    text = text.replace(_CONNECTION, f"socketcand:{address}").replace(_BITRATE, f"bitrate = {bitrate}")
    path.write_text(text, encoding="utf-8")
    return path
