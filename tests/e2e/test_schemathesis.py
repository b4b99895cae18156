"""Requests made up from the OpenAPI document, against the demo: nothing breaks, every answer is as the document says.

Destructive routes are among them: what they meet are twins.
"""

from __future__ import annotations

import json
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any, Final

import httpx
import pytest
import schemathesis
from hypothesis import HealthCheck, Phase, settings
from schemathesis.checks import not_a_server_error
from schemathesis.specs.openapi.checks import (
    content_type_conformance,
    response_headers_conformance,
    response_schema_conformance,
    status_code_conformance,
)

from app.web.generate import openapi
from tests.e2e.processes import running

pytestmark = [pytest.mark.timeout(300), pytest.mark.alone]

EXAMPLES: Final = 8
"""Made-up requests of each operation, besides the document's examples and the limits of its types."""
EXPERT: Final = {"name": "Eva", "password": "blade and hub 12", "role": "expert"}
TURBINE: Final = "wtg-07"
CHECKS: Final = [
    not_a_server_error,
    status_code_conformance,
    content_type_conformance,
    response_headers_conformance,
    response_schema_conformance,
]
ENDS_ITS_SESSION: Final = "/api/logout"

PLACES: Final = {"turbine": TURBINE, "station": "blade-1", "device": "pmc", "description_id": "oat-pmc"}
"""Paths that exist; all other parts of requests are made up."""

RECURSIVE: Final = ("POST /api/search", "POST /api/search/signature")
"""A signature is a tree: the limits of its parts in all their combinations are 177,000 requests. It is made up only."""

schema = schemathesis.openapi.from_dict(
    openapi(),
    config=schemathesis.Config.from_dict(
        {
            "parameters": {f"path.{name}": at for name, at in PLACES.items()},
            "operations": [{"include-name": name, "phases": {"coverage": {"enabled": False}}} for name in RECURSIVE],
        }
    ),
)


@dataclass
class Demo:
    """A running demo: ``client`` is an expert's, ``leaving`` another session of hers that may end."""

    origin: str
    client: httpx.Client
    leaving: httpx.Client

    def connect(self) -> None:
        """Have the twins connected, whatever the request before did."""
        if self.client.get("/api/live/turbine").json() is None:
            answer = self.client.post("/api/live/connect", json={"turbine": TURBINE})
            assert answer.status_code == 200, answer.text


@pytest.fixture(scope="module")
def demo(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Demo]:
    """``hubside demo`` with one user, the expert."""
    data = tmp_path_factory.mktemp("data")
    with running("demo", "--port", "0", "--data", str(data), "--json") as process:
        url = json.loads(process.wait_for('"url"'))["url"]
        origin = url.split("/?")[0]
        options: dict[str, Any] = {"base_url": origin, "trust_env": False, "timeout": 60}
        with httpx.Client(**options) as client, httpx.Client(**options) as leaving:
            client.get(url)
            made = client.post("/api/users", json=EXPERT)
            assert made.status_code == 200, made.text
            for one in (client, leaving):
                answer = one.post("/api/login", json={"name": EXPERT["name"], "password": EXPERT["password"]})
                assert answer.status_code == 200, answer.text
            yield Demo(origin, client, leaving)
        assert not [line for line in process.lines if "Traceback" in line], "\n".join(process.lines)


@schema.parametrize()
@settings(
    max_examples=EXAMPLES,
    deadline=None,
    derandomize=True,
    database=None,
    phases=[Phase.explicit, Phase.generate],
    suppress_health_check=list(HealthCheck),
)
def test_the_api_keeps_its_word(case: schemathesis.Case[Any], demo: Demo) -> None:
    demo.connect()
    client = demo.leaving if case.path == ENDS_ITS_SESSION else demo.client
    case.call_and_validate(base_url=demo.origin, cookies=dict(client.cookies), checks=CHECKS, timeout=60)
