"""Where the short link of an incident leads: the page with replay, moment, loop, camera and signals in its address."""

from __future__ import annotations

from typing import Final
from urllib.parse import urlencode

from app.model.incident import Incident
from app.service.incidents.identity import Standing

ROOM: Final = "/recordings"


def page_link(incident: Incident, standing: Standing) -> str:
    """Path and query of the page. Without the recording it shows the incident, and what is missing.

    ``signals``: those of a plot are separated by commas, plots by semicolons.
    """
    draft = incident.draft
    query = {"incident": incident.code}
    if standing.path is not None:
        query["replay"] = standing.path.name.removesuffix(".mcap")
        query["at"] = str(draft.at_ns)
        if draft.loop is not None:
            query["loop"] = f"{draft.loop.from_ns}-{draft.loop.to_ns}"
        if draft.camera:
            query["camera"] = draft.camera
        if draft.plots:
            query["signals"] = ";".join(",".join(signal.text for signal in plot) for plot in draft.plots)
    return f"{ROOM}?{urlencode(query)}"


def closed_link(code: str) -> str:
    """Where a person is led who must log in first: the page looks the incident up afterwards."""
    return f"{ROOM}?{urlencode({'incident': code})}"
