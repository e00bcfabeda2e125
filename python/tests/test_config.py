"""Configurations: the program's keys, units and errors."""

import math
import pickle

import numpy as np
import pytest

import photocoag as pc

from conftest import ROOT


def test_defaults_are_those_of_the_program(config, program):
    assert program("config") == config.to_toml()


def test_keys_are_attributes_and_items(config):
    assert config.control.horizon == config["control.horizon"] == config["control"]["horizon"] == 5
    assert config["tissue.layers.RPE"]["thickness_um"] == 6.0
    assert "horizon" in dir(config.control) and "control" in dir(config)


def test_set_makes_a_new_one(config):
    other = config.set("plant.absorption_factor", 0.5)
    assert (config.plant.absorption_factor, other.plant.absorption_factor) == (1.1, 0.5)
    assert other != config and other == config.set("plant.absorption_factor", 0.5)
    assert hash(other) == hash(config.update({"plant.absorption_factor": 0.5}))
    with pytest.raises(AttributeError, match="set"):
        config.control.horizon = 3


def test_the_plants_tissue_follows_the_tissue_as_with_set(config, program):
    changed = config.set("tissue.layers.RPE.thickness_um", 5).set("plant.tissue.spot_radius_um", 90)
    changed = changed.set("tissue.layers.RPE.thickness_um", 7)
    assert changed.to_toml() == program(
        "config", "--set", "tissue.layers.RPE.thickness_um=5", "--set",
        "plant.tissue.spot_radius_um=90", "--set", "tissue.layers.RPE.thickness_um=7")


@pytest.mark.parametrize("file", sorted((ROOT / "configs").glob("*.toml")), ids=lambda f: f.stem)
def test_round_trips(file):
    config = pc.Config.load(file)
    assert pc.Config.from_toml(config.to_toml()) == config
    assert pc.Config.from_dict(config.to_dict()) == config
    assert pickle.loads(pickle.dumps(config)) == config
    assert pickle.loads(pickle.dumps(config)).set("run.seed", 3) == config.set("run.seed", 3)


def test_numpy_values_are_values(config):
    assert config.set("control.horizon", np.int64(7)).control.horizon == 7
    assert config.set("plant.noise_K", np.float32(0.5)).plant.noise_K == 0.5


@pytest.mark.parametrize(
    ("key", "value", "found", "accepted"),
    [
        ("control.horizon", 1, "1", "2 to 50"),
        ("control.horizon", 2.5, "2.5", "integer"),
        ("control.power_max_W", math.nan, "nan", "number"),
        ("control.power_max_W", "much", '"much"', "number"),
        ("control.solver", "magic", '"magic"', "dense"),
        ("plant.absorption_factor", -math.inf, "-inf", "number"),
    ],
)
def test_errors_name_key_found_and_accepted(config, key, value, found, accepted):
    with pytest.raises(pc.ConfigError) as caught:
        config.set(key, value)
    assert caught.value.key == key
    assert caught.value.found.startswith(found)
    assert accepted in caught.value.accepted
    assert "--set" not in str(caught.value)
    again = pickle.loads(pickle.dumps(caught.value))
    assert (again.key, again.found, str(again)) == (key, caught.value.found, str(caught.value))


def test_unknown_keys_name_the_nearest(config):
    with pytest.raises(pc.ConfigError, match="horizon") as caught:
        config.set("control.horizn", 3)
    assert caught.value.key == "control.horizn"
    with pytest.raises(AttributeError, match="horizon"):
        config.control.horizn
    with pytest.raises(KeyError):
        config["control.horizn"]


def test_files_are_named(tmp_path):
    file = tmp_path / "bad.toml"
    file.write_text("[control]\nhorizon = 0\n")
    with pytest.raises(pc.ConfigError) as caught:
        pc.Config.load(file)
    assert caught.value.where == f"{file}:2" and caught.value.key == "control.horizon"
    with pytest.raises(pc.ConfigError, match="none.toml"):
        pc.Config.load(tmp_path / "none.toml")
