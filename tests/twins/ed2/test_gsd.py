"""The GSD says what the twin does: ident number, modules and lengths."""

from __future__ import annotations

import re

from app.model.bundled import bundled_folder
from app.twins.ed2.device import CONFIGURATIONS, IDENT_EXAMPLE
from app.wire.profibus.configuration import encode_configuration
from app.wire.profibus.telegrams import TELEGRAM_TYPES, assumed_modules

TEXT = (bundled_folder("od", "od") / "gsd" / "hubside_ed2_example.gsd").read_text(encoding="ascii")


def number(key: str) -> int:
    found = re.search(rf"^{re.escape(key)} = (\S+)$", TEXT, re.MULTILINE)
    assert found is not None
    return int(found[1], 0)


def test_the_ident_number_is_that_of_the_twin() -> None:
    assert number("Ident_Number") == IDENT_EXAMPLE


def test_there_is_a_module_for_each_telegram_with_the_identifiers_that_the_twin_takes() -> None:
    modules = dict(re.findall(r'^Module = "Telegram (\d+)" (.+)$', TEXT, re.MULTILINE))
    assert {int(name) for name in modules} == TELEGRAM_TYPES.keys()
    for name, identifiers in modules.items():
        data = bytes(int(one, 0) for one in identifiers.split(", "))
        assert data == encode_configuration(assumed_modules(TELEGRAM_TYPES[int(name)]))


def test_the_longest_data_fit() -> None:
    outputs = max(sum(one.output_size for one in several) for several in CONFIGURATIONS.values())
    inputs = max(sum(one.input_size for one in several) for several in CONFIGURATIONS.values())
    assert number("Max_Output_Len") == outputs
    assert number("Max_Input_Len") == inputs
    assert number("Max_Data_Len") == outputs + inputs
