"""Settings (a key, a JSON value) and favourites (a person's list of addresses for each description)."""

from __future__ import annotations

import json
from collections.abc import Sequence
from typing import Any

from sqlalchemy import Connection, delete, insert, select

from app.store.schema import favourites, settings


def get_setting(connection: Connection, key: str) -> Any:
    """The value of a setting, or None."""
    found = connection.scalar(select(settings.c.value).where(settings.c.key == key))
    return None if found is None else json.loads(found)


def put_setting(connection: Connection, key: str, value: Any) -> None:
    """Keep the value of a setting; None forgets it."""
    connection.execute(delete(settings).where(settings.c.key == key))
    if value is not None:
        connection.execute(insert(settings), {"key": key, "value": json.dumps(value, ensure_ascii=False)})


def get_favourites(connection: Connection, person: str, description_id: str) -> list[str]:
    """Addresses in the person's order."""
    query = (
        select(favourites.c.address)
        .where(favourites.c.person == person, favourites.c.description_id == description_id)
        .order_by(favourites.c.position)
    )
    return list(connection.scalars(query))


def put_favourites(connection: Connection, person: str, description_id: str, addresses: Sequence[str]) -> None:
    """Replace the person's list."""
    connection.execute(
        delete(favourites).where(favourites.c.person == person, favourites.c.description_id == description_id)
    )
    rows = [
        {"person": person, "description_id": description_id, "address": address, "position": position}
        for position, address in enumerate(dict.fromkeys(addresses))
    ]
    if rows:
        connection.execute(insert(favourites), rows)
