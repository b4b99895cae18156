"""The table ``nodes`` of a recording: which device stands where, and what describes it."""

from __future__ import annotations

from collections.abc import Mapping
from typing import NamedTuple

from app.errors import UsageError
from app.model.description import Description
from app.model.description_file import load_builtin
from app.model.site import MAX_NODE

NodeKey = tuple[str, int]
"""Bus and node."""
ServerTable = Mapping[NodeKey, str]
"""``host:port`` of the nodes of Modbus TCP buses."""


class NodeName(NamedTuple):
    """What a recording says of a node. ``slug``: turbine/station/device, empty where it is not named."""

    slug: str
    description_id: str


def read_nodes(table: Mapping[str, str]) -> dict[NodeKey, NodeName]:
    """The table (``can0/11``: slug and description) by bus and node; a key that names no node is passed over."""
    found = {}
    for key, told in table.items():
        bus, _, number = key.rpartition("/")
        if bus and number.isdecimal():
            slug, _, description_id = told.rpartition(" ")
            found[bus, int(number)] = NodeName(slug, description_id)
    return found


def described(table: Mapping[str, str]) -> dict[NodeKey, Description]:
    """What describes the nodes; one that none of our own descriptions fits is left out."""
    found = {}
    for (bus, node), name in read_nodes(table).items():
        try:
            description = load_builtin(name.description_id)
        except UsageError:
            continue
        if 1 <= node <= MAX_NODE.get(description.bus, 0):
            found[bus, node] = description
    return found


def read_servers(table: Mapping[str, str]) -> dict[NodeKey, str]:
    """The table ``servers`` (``lan/1``: ``host:port``) by bus and node; a key that names no node is passed over."""
    found = {}
    for key, server in table.items():
        bus, _, number = key.rpartition("/")
        if bus and number.isdecimal():
            found[bus, int(number)] = server
    return found


def server_table(servers: ServerTable) -> dict[str, str]:
    """What ``read_servers`` reads."""
    return {f"{bus}/{node}": server for (bus, node), server in servers.items()}
