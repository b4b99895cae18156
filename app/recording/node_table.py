"""The table ``nodes`` of a recording: which device stands where, and what describes it."""

from __future__ import annotations

from collections.abc import Mapping
from typing import NamedTuple

from app.errors import UsageError
from app.model.description import Bus, Description
from app.model.description_file import load_builtin
from app.model.site import MAX_NODE
from app.wire.profibus.order_proof import order_text, read_order
from app.wire.profibus.pzd import Order

NodeKey = tuple[str, int]
"""Bus and node."""
ServerTable = Mapping[NodeKey, str]
"""``host:port`` of the nodes of Modbus TCP buses."""
OrderTable = Mapping[NodeKey, Order]
"""What a site says of the process data of nodes on PROFIBUS."""


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
        if 1 <= node <= MAX_NODE[description.bus]:
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


def read_orders(table: Mapping[str, str]) -> dict[NodeKey, Order]:
    """The table ``orders`` (``dp0/6``: ``low-high``); what names no node or no order is passed over."""
    found = {}
    for key, text in table.items():
        bus, _, number = key.rpartition("/")
        try:
            found[bus, int(number)] = read_order(text)
        except ValueError:
            continue
    return found


def order_table(orders: OrderTable) -> dict[str, str]:
    """What ``read_orders`` reads."""
    return {f"{bus}/{node}": order_text(order) for (bus, node), order in orders.items()}


def read_protocols(table: Mapping[str, str]) -> dict[str, Bus]:
    """The table ``protocols`` (``dp0``: ``profibus-dp``); one that is not known is passed over."""
    known = {one.value: one for one in Bus}
    return {bus: known[name] for bus, name in table.items() if name in known}
