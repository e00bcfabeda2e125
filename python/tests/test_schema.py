"""`photocoag config --schema`: what editors complete and check TOML with, held against the program."""

from __future__ import annotations

import json
import os
import subprocess
import tomllib
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import jsonschema
import pytest

import photocoag as pc

ROOT = Path(__file__).resolve().parents[2]
PROGRAM = os.environ.get("PHOTOCOAG_PROGRAM", "photocoag")


def printed(*arguments: str) -> str:
    return subprocess.run([PROGRAM, "config", *arguments], check=True, capture_output=True, text=True).stdout


@pytest.fixture(scope="module")
def validator() -> jsonschema.Draft202012Validator:
    schema = json.loads(printed("--schema"))
    jsonschema.Draft202012Validator.check_schema(schema)
    return jsonschema.Draft202012Validator(schema)


def keys(table: dict[str, Any], path: str = "") -> Iterator[tuple[str, dict[str, Any]]]:
    """Every key of the schema that is no table of keys."""
    for name, value in table["properties"].items():
        if "properties" in value:
            yield from keys(value, f"{path}{name}.")
        else:
            yield path + name, value


def as_table(key: str, value: object) -> dict[str, Any]:
    for name in reversed(key.split(".")):
        value = {name: value}
    assert isinstance(value, dict)
    return value


@pytest.mark.parametrize("file", sorted((ROOT / "configs").glob("*.toml")), ids=lambda file: file.stem)
def test_shipped_configurations_are_valid(file: Path, validator: jsonschema.Draft202012Validator) -> None:
    validator.validate(tomllib.loads(file.read_text()))
    validator.validate(tomllib.loads(printed("--config", str(file))))  # complete, as resolved


def test_the_schema_has_every_printed_key_and_its_default(validator: jsonschema.Draft202012Validator) -> None:
    complete = tomllib.loads(printed("--set", "plant.tissue.spot_radius_um=90"))
    known = dict(keys(validator.schema))
    count = 0
    for section, table in complete.items():
        for name, value in table.items():
            for key, found in value.items() if name == "tissue" else [("", value)]:
                full = ".".join(part for part in (section, name, key) if part)
                count += 1
                if not full.endswith((".layers", "tissue.spot_radius_um")):
                    assert known[full]["default"] == found, full
    assert count == len([key for key in known if not key.startswith("prior")])


BAD = {
    "unknown section": "[contrl]\nperiod_ms = 1",
    "unknown key": "[control]\nperiodms = 1",
    "key of another section": "[control]\nnoise_K = 1",
    "text for a number": "[control]\nperiod_ms = '1'",
    "number for a word": "[control]\nsolver = 1",
    "unknown word": "[control]\nsolver = 'Dense'",
    "fraction of a horizon": "[control]\nhorizon = 2.5",
    "number for a section": "control = 1",
    "no layers": "[tissue]\nlayers = []",
    "layer without thickness": "[tissue]\nlayers = [{name = 'RPE', absorption_per_m = 1}]",
    "layer with an unknown key": "[tissue.layers.RPE]\nthickness = 1",
    "renamed layer": "[tissue.layers.RPE]\nname = 'other'",
    "prior without a bound": "[[prior]]\nkey = 'plant.noise_K'\ndistribution = 'uniform'\nlow = 0.1",
    "parameter of another distribution": "[[prior]]\nkey = 'plant.noise_K'\ndistribution = 'uniform'\n"
    "low = 0.1\nhigh = 1\nsigma = 1",
    "sigma of nothing": "[[prior]]\nkey = 'plant.noise_K'\ndistribution = 'normal'\nmean = 0.3\nsigma = 0\n"
    "low = 0.1\nhigh = 1",
    "correlation of one": "[[prior_correlation]]\nbetween = ['a', 'b']\nvalue = 1",
}


@pytest.mark.parametrize("text", BAD.values(), ids=BAD.keys())
def test_what_the_program_refuses_the_schema_refuses(
    text: str, validator: jsonschema.Draft202012Validator, tmp_path: Path
) -> None:
    assert not validator.is_valid(tomllib.loads(text))
    file = tmp_path / "bad.toml"
    file.write_text(text)
    with pytest.raises(pc.ConfigError):
        pc.Config.load(file)


def test_both_refuse_what_lies_outside_a_range(validator: jsonschema.Draft202012Validator) -> None:
    checked = 0
    for key, schema in keys(validator.schema):
        if schema.get("type") not in ("number", "integer"):
            continue
        outside = [schema["maximum"] * 1.0001 + 1e-9 if schema["type"] == "number" else schema["maximum"] + 1]
        if "exclusiveMinimum" in schema:
            outside.append(schema["exclusiveMinimum"])
        else:
            outside.append(schema["minimum"] - 1)
        for value in outside:
            if abs(value) > 2**63 - 1:
                continue
            assert not validator.is_valid(as_table(key, value)), key
            with pytest.raises(pc.ConfigError) as error:
                pc.Config().set(key, value)
            assert error.value.key == key
            checked += 1
    assert checked > 150
