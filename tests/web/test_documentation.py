"""The OpenAPI document names the problems of every route and gives examples that the routes themselves accept."""

from __future__ import annotations

from typing import Any

import pytest
from fastapi.routing import iter_route_contexts
from pydantic import TypeAdapter

from app.web.app import create_api
from app.web.documentation import document
from app.web.models import Problem
from app.web.problem import MEDIA_TYPE

APP = create_api(None)
DOCUMENT = document(APP)
OPERATIONS = {
    operation["operationId"]: operation for methods in DOCUMENT["paths"].values() for operation in methods.values()
}


@pytest.mark.parametrize("name", OPERATIONS)
def test_every_route_says_what_it_does_and_which_problems_it_answers(name: str) -> None:
    operation = OPERATIONS[name]
    assert operation["description"]
    answers = operation["responses"]
    assert {"401", "403", "default"} <= answers.keys()
    assert {"200", "201"} & answers.keys()
    for status, answer in answers.items():
        if status.startswith("2"):
            continue
        assert list(answer["content"]) == [MEDIA_TYPE], (name, status)
        for example in answer["content"][MEDIA_TYPE].get("examples", {}).values():
            problem = Problem.model_validate(example["value"])
            assert str(problem.status) == status
            assert "–" not in problem.text and not problem.text.startswith("error."), problem.text


def test_every_body_has_an_example_that_its_route_accepts() -> None:
    seen = 0
    for route in iter_route_contexts(APP.routes):
        if str(route.path) not in DOCUMENT["paths"]:  # what refuses all that writes to a replay
            assert "{path:path}" in str(route.path)
            continue
        for method in route.methods or ():
            operation: dict[str, Any] = DOCUMENT["paths"][str(route.path)][method.lower()]
            for field in route.dependant.body_params:
                example = operation["requestBody"]["content"]["application/json"]["example"]
                TypeAdapter[Any](field.field_info.annotation).validate_python(example)
                seen += 1
    assert seen >= 20


def test_a_route_on_a_device_names_what_the_bus_may_do() -> None:
    assert {"404", "409", "422", "502", "503", "504"} <= OPERATIONS["write"]["responses"].keys()
    assert "409" not in OPERATIONS["session"]["responses"]
