"""A connection to twins on a served line, as the tests of the use cases have it."""

from __future__ import annotations

from tests.service.conftest import connection, served

__all__ = ["connection", "served"]
