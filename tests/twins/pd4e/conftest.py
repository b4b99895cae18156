"""The fixtures of the PD4-E twin."""

from __future__ import annotations

from collections.abc import Iterator

import pytest

from tests.twins.pd4e.rig import Client, Rig, running


@pytest.fixture
def rig() -> Iterator[Rig]:
    """A twin of the stepper variant with a free shaft."""
    with running() as made:
        yield made


@pytest.fixture
def client(rig: Rig) -> Client:
    """A client of it."""
    return rig.client
