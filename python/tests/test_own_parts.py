"""One's own controller, estimator and plant in the closed loop."""

import pickle

import numpy as np
import pytest

import photocoag as pc

from conftest import ROOT


class Proportional:
    def __init__(self):
        self.samples = []

    def step(self, volume_temperature, applied_power):
        self.samples.append((volume_temperature, applied_power))
        return 0.004 * (12.0 - volume_temperature)


class Forwarding:
    """Ours behind an object of Python's own."""

    def __init__(self, part):
        self.part = part

    def __getattr__(self, name):
        return getattr(self.part, name)


def test_ours_passed_in_give_the_same_bytes(config, model, run):
    for parts in (
        {"controller": pc.Controller(model, config)},
        {"estimator": pc.Estimator(model, config)},
        {"plant": pc.FullOrderModel(config).plant()},
        {"controller": pc.Controller(model, config), "plant": pc.FullOrderModel(config).plant()},
    ):
        assert pc.simulate(config, **parts).to_csv().splitlines()[1:] == run.to_csv().splitlines()[1:]
    reduced = config.set("plant.model", "reduced")
    plant = model.plant(config.plant.absorption_factor)
    assert pc.simulate(reduced, plant=plant).to_csv() == pc.simulate(reduced).to_csv()


def test_ours_behind_python_give_the_same_bits(config, model, run):
    plant = Forwarding(pc.FullOrderModel(config).plant())
    assert pc.simulate(config, plant=plant).to_csv() == run.to_csv()
    estimator = Forwarding(pc.Estimator(model, config))
    assert pc.simulate(config, estimator=estimator).to_csv() == run.to_csv()
    controlled = pc.simulate(config, controller=Forwarding(pc.Controller(model, config)))
    for name in ("power_W", "peak_true_K", "volume_measured_K", "absorption_estimate"):
        assert (controlled.cycles[name] == run.cycles[name]).all(), name


def test_quantiles_are_those_of_our_estimator():
    config = pc.Config.load(ROOT / "configs/uncertain-eye.toml")
    model = pc.reduce(config)
    assert pickle.loads(pickle.dumps(model)) == model
    csv = pc.simulate(config).to_csv()
    for parts in ({"controller": pc.Controller(model, config)}, {"estimator": pc.Estimator(model, config)}):
        assert pc.simulate(config, **parts).to_csv() == csv
    assert len(pc.simulate(config, controller=Proportional())) == 250
    kalman = pc.Estimator(pc.reduce(pc.Config()), pc.Config())  # its state is the model's
    with pytest.raises(pc.ConfigError) as caught:
        pc.simulate(config, estimator=Forwarding(kalman))
    assert caught.value.key == "control.robust"
    certain = config.update({"control.robust": "none", "estimator.kind": "posterior"})
    assert len(pc.simulate(certain, estimator=Forwarding(kalman))) == 250


def test_a_controller_gets_the_samples_and_its_power_acts(config):
    part = Proportional()
    run = pc.simulate(config, controller=part)
    assert len(part.samples) == len(run) + 1 and part.samples[0] == (0.0, 0.0)
    samples = np.array(part.samples[1:])
    assert (samples[:, 0] == run.cycles["volume_measured_K"]).all()
    assert (samples[:, 1] == run.cycles["power_W"]).all()
    wanted = np.clip(0.004 * (12.0 - samples[:-1, 0]), 0.0, 0.1)
    assert (run.cycles["power_W"][1:] == wanted).all()


def test_the_noise_is_that_of_the_seed(config, run):
    ours = run.cycles["volume_measured_K"] - run.cycles["volume_true_K"]
    own = pc.simulate(config, controller=Proportional()).cycles
    assert np.allclose(own["volume_measured_K"] - own["volume_true_K"], ours, rtol=0, atol=1e-12)


def test_start_and_outputs_are_optional(config):
    class Full(Proportional):
        def start(self):
            return 0.01

        def outputs(self):
            return 1.0, 2.0

    run = pc.simulate(config, controller=Full())
    assert run.cycles["power_W"][0] == 0.01
    assert (run.cycles["peak_estimate_K"] == 2.0).all()


def test_a_plant_of_ones_own(config):
    class Leaky:
        peak = 0.0

        def step(self, power):
            self.peak = 0.9 * self.peak + 80.0 * power

        def outputs(self):
            return 0.3 * self.peak, self.peak

    run = pc.simulate(config.set("safety.supervisor", "off"), plant=Leaky())
    peak = 0.0
    for row in run.cycles:
        peak = 0.9 * peak + 80.0 * row["power_W"]
        assert row["peak_true_K"] == peak


def raising(*_):
    raise RuntimeError("from inside the loop")


@pytest.mark.parametrize("part", ["controller", "estimator", "plant"])
def test_exceptions_come_through_and_the_laser_is_off(config, model, part):
    ours = {
        "controller": pc.Controller(model, config),
        "estimator": pc.Estimator(model, config),
        "plant": pc.FullOrderModel(config).plant(),
    }[part]
    own = Forwarding(ours)
    setattr(own, "update" if part == "estimator" else "step", raising)
    with pytest.raises(RuntimeError, match="inside the loop"):
        pc.simulate(config, **{part: own})


@pytest.mark.parametrize("answer", [None, "0.01", float("nan"), float("inf"), [0.1], 1j, True])
def test_answers_that_are_not_numbers_are_named(config, answer):
    class Bad:
        def step(self, volume_temperature, applied_power):
            return answer

    with pytest.raises(pc.ConfigError) as caught:
        pc.simulate(config, controller=Bad())
    assert caught.value.key == "controller.step()" and "watts" in caught.value.accepted


def test_objects_without_the_methods_are_refused(config):
    for part in ("controller", "estimator", "plant"):
        with pytest.raises(pc.ConfigError) as caught:
            pc.simulate(config, **{part: object()})
        assert caught.value.key == part and "object" in caught.value.found


def test_wrong_outputs_and_states_are_named(config, model):
    class Plant:
        def step(self, power):
            pass

        def outputs(self):
            return 1.0, 2.0, 3.0

    class Estimator:
        state = np.zeros(3)
        absorption_factor = 1.0

        def update(self, volume_temperature, applied_power):
            pass

    for part, key in (({"plant": Plant()}, "plant.outputs()"), ({"estimator": Estimator()}, "estimator.state")):
        with pytest.raises(pc.ConfigError) as caught:
            pc.simulate(config, **part)
        assert caught.value.key == key


def test_ctrl_c_ends_a_loop_in_python(config):
    class Interrupted(Proportional):
        def step(self, volume_temperature, applied_power):
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        pc.simulate(config, controller=Interrupted())
