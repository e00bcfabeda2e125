"""Whatever is passed in: a result, or an exception that says what is accepted; never a crash."""

import math

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

import photocoag as pc

CALM = settings(max_examples=150, deadline=None, derandomize=True, database=None,
                suppress_health_check=list(HealthCheck))
KEYS = [f"{s}.{k}" for s, table in pc.Config().to_dict().items() if isinstance(table, dict) for k in table]

anything = st.recursive(
    st.none() | st.booleans() | st.integers() | st.floats() | st.text() | st.binary() | st.complex_numbers(),
    lambda inner: st.lists(inner, max_size=4) | st.dictionaries(st.text(), inner, max_size=3),
    max_leaves=6,
)
arrays = st.sampled_from([
    np.array(math.nan), np.zeros(0), np.zeros((2, 2)), np.array([1e400]), np.array(["x"]),
    np.array([None]), np.float32(0.5), np.int8(-1), np.array([True]), np.zeros(3, dtype="M8[s]"),
])
values = anything | arrays


def refused(call):
    """None if it went well."""
    try:
        call()
    except pc.ConfigError as error:
        assert error.key or error.where, error
        assert error.accepted or error.problem, error
        return error
    return None


@CALM
@given(st.sampled_from(KEYS) | st.text(), values)
def test_set(key, value):
    refused(lambda: pc.Config().set(key, value))


@CALM
@given(st.dictionaries(st.sampled_from(["control", "plant", "tissue", "run"]) | st.text(), values, max_size=4))
def test_from_dict(content):
    refused(lambda: pc.Config.from_dict(content))


@CALM
@given(st.text() | st.binary() | st.none())
def test_from_toml(text):
    refused(lambda: pc.Config.from_toml(text))


@CALM
@given(values, values)
def test_controller_and_estimator(sample, power):
    if not hasattr(test_controller_and_estimator, "parts"):
        config = pc.Config()
        model = pc.reduce(config)
        test_controller_and_estimator.parts = pc.Controller(model, config), pc.Estimator(model, config)
    controller, estimator = test_controller_and_estimator.parts

    def step():
        assert 0.0 <= controller.step(sample, power) <= 0.1

    error = refused(step)
    assert error is None or error.key in ("volume_temperature", "applied_power")
    refused(lambda: estimator.update(sample, power))
    assert np.isfinite(estimator.state).all()


@CALM
@given(values, values, values)
def test_response(power, times, kind):
    refused(lambda: pc.response(pc.Config().set("plant.model", "reduced"), power, times, model="reduced"))
    refused(lambda: pc.response(pc.Config().set("grid.min_cells", 2000), 0.01, [0.001], model=kind))


@CALM
@given(values)
def test_what_a_controller_answers(answer):
    class Own:
        def step(self, volume_temperature, applied_power):
            return answer

    config = pc.Config().set("run.duration_ms", 3).set("plant.model", "reduced")
    refused(lambda: pc.simulate(config, controller=Own()))


@CALM
@given(values)
def test_what_a_plant_answers(answer):
    class Own:
        def step(self, power):
            pass

        def outputs(self):
            return answer

    refused(lambda: pc.simulate(pc.Config().set("run.duration_ms", 3), plant=Own()))


@CALM
@given(values, values)
def test_what_an_estimator_holds(state, factor):
    class Own:
        def __init__(self):
            self.state, self.absorption_factor = state, factor

        def update(self, volume_temperature, applied_power):
            pass

    config = pc.Config().set("run.duration_ms", 3).set("plant.model", "reduced")
    refused(lambda: pc.simulate(config, estimator=Own()))


@CALM
@given(values, values)
def test_seeds_and_threads(seeds, threads):
    config = pc.Config().set("run.duration_ms", 1).set("plant.model", "reduced")
    refused(lambda: pc.simulate_many(config, seeds, threads=threads if not isinstance(threads, int) else 2))
    refused(lambda: pc.simulate(config, seed=threads))


@CALM
@given(st.data())
def test_damaged_model_files(data):
    if not hasattr(test_damaged_model_files, "text"):
        test_damaged_model_files.text = pc.reduce(pc.Config()).to_json()
    text = test_damaged_model_files.text
    at = data.draw(st.integers(0, len(text) - 1))
    end = data.draw(st.integers(at, min(len(text), at + 40)))
    damaged = text[:at] + data.draw(st.text(max_size=20)) + text[end:]
    error = refused(lambda: pc.ReducedModel.from_json(damaged))
    assert error is not None or damaged.split() == text.split() or pc.ReducedModel.from_json(damaged).to_json() == text


@pytest.mark.parametrize("name", ["simulate", "treat", "reduce", "FullOrderModel"])
@CALM
@given(config=values)
def test_things_that_are_no_configuration(name, config):
    with pytest.raises(pc.ConfigError) as caught:
        getattr(pc, name)(config)
    assert caught.value.key == "config"


@CALM
@given(values)
def test_things_that_are_no_campaign(campaign):
    error = refused(lambda: pc.campaign(campaign))
    assert error is not None
