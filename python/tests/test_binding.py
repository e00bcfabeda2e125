"""Promises of the layer between C++ and Python: units, names, errors, the interpreter's lock, Ctrl-C."""

import json
import pickle
import subprocess
import sys
import threading
import time

import numpy as np
import pytest

import photocoag as pc

CALLS = {
    "simulate_many": "pc.simulate_many(pc.Config(), range(200_000), threads=2)",
    "several configurations": "pc.simulate_many([pc.Config()] * 100_000, threads=2)",
    "campaign": "pc.campaign({'spots': 2_000_000, 'input': [{'key': 'plant.absorption_factor', 'distribution': 'uniform',"
                " 'low': 0.5, 'high': 1.5}]}, threads=2)",
}


@pytest.mark.parametrize("name", CALLS)
def test_ctrl_c_ends_it(name):
    code = (
        "import photocoag as pc, threading, os, signal\n"
        "threading.Timer(1.0, os.kill, (os.getpid(), signal.SIGINT)).start()\n"
        f"try:\n    {CALLS[name]}\nexcept KeyboardInterrupt:\n    print('stopped')\n"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, timeout=120, check=False)
    assert done.stdout == "stopped\n", done.stderr


@pytest.mark.parametrize("call", [
    lambda config: pc.simulate_many(config, range(300)),
    lambda config: pc.campaign({"spots": 300, "set": ["plant.model=reduced"]}),
    lambda config: pc.simulate(config.set("run.duration_ms", 60000)),
    lambda config: pc.reduce(config, cache=False),
], ids=["simulate_many", "campaign", "simulate", "reduce"])
def test_other_threads_go_on(config, call):
    """With the lock held the main thread would not count at all between the beginning and the end."""
    begun, ended, counted = threading.Event(), threading.Event(), 0

    def work():
        begun.set()
        call(config)
        ended.set()

    thread = threading.Thread(target=work)
    thread.start()
    begun.wait()
    while not ended.is_set():
        time.sleep(0.001)
        counted += 1
    thread.join()
    assert counted > 10


def test_a_models_attributes_are_the_files(config, model):
    """One by one: units, and which is which."""
    file = json.loads(model.to_json())
    continuous, discrete = file["continuous"], file["discrete"]
    assert (model.order, model.period, model.full_order_states) == (file["order"], discrete["period_s"], file["full_order_states"])
    assert np.array_equal(model.A, continuous["A"]) and np.array_equal(model.A_d, discrete["A"])
    assert np.array_equal(model.C_peak, np.ravel(continuous["C_peak"]))
    assert (model.method, model.discretization) == (file["method"], discrete["discretization"])
    for output in ("peak", "volume"):
        assert np.array_equal(model.error[f"{output}_relative"], file["error"][f"{output}_relative"])
        assert model.error[f"{output}_relative_max"] == max(file["error"][f"{output}_relative"])
        proved = file["certificate"][output]
        assert model.certificate[f"{output}_relative_max"] == proved["bound_relative_max"]
        assert model.certificate[f"{output}_treatment_relative_max"] == proved["treatment_bound_relative_max"]
    assert model.certificate["treatment_duration_s"] == file["certificate"]["treatment_duration_s"]
    assert not np.array_equal(model.error["peak_relative"], model.error["volume_relative"])
    assert list(model.absorption_range) == [min(model.error["absorption_factor"]), max(model.error["absorption_factor"])]


def test_the_grid_is_in_metres(config):
    full = pc.FullOrderModel(config)
    depth = 1e-6 * sum(layer["thickness_um"] for layer in config.tissue.layers)
    assert full.radial_edges_m[0] == full.axial_edges_m[0] == 0.0
    assert full.radial_edges_m[-1] == pytest.approx(1e-6 * config.tissue.domain_radius_um)
    assert full.axial_edges_m[-1] == pytest.approx(depth)
    rings = np.pi * np.diff(full.radial_edges_m**2)
    assert np.allclose(full.E.diagonal(), np.outer(np.diff(full.axial_edges_m), rings).ravel(), rtol=1e-9)


def test_the_estimators_attributes_belong_together(config, model):
    """With the values that the run records for the same samples."""
    estimator = pc.Estimator(model, config)
    assert estimator.absorption_sigma == config.estimator.absorption_sigma_initial
    run = pc.simulate(config).cycles
    for row in run[:50]:
        estimator.update(row["volume_measured_K"], row["power_W"])
        assert estimator.absorption_factor == row["absorption_estimate"]
        assert estimator.absorption_sigma == row["absorption_sigma"]
        assert estimator.outputs() == (row["volume_estimate_K"], row["peak_estimate_K"])
    covariance = estimator.covariance
    assert covariance.shape == (model.order + 1, model.order + 1) and np.allclose(covariance, covariance.T)
    assert covariance[-1, -1] == pytest.approx(estimator.absorption_sigma**2, rel=1e-9)
    assert model.C_peak @ estimator.state == pytest.approx(estimator.outputs()[1], rel=1e-9)


def test_the_controllers_attributes(config, model):
    controller = pc.Controller(model, config)
    assert controller.period == 1e-3
    power = controller.start()
    controller.step(1.0, power)
    estimate = controller.estimate
    assert controller.outputs() == pytest.approx((estimate["volume_K"], estimate["peak_K"]))


def test_loop_seconds_are_seconds(run):
    assert run.loop_seconds == run.summary["loop_wall_s"]
    assert pickle.loads(pickle.dumps(run)).loop_seconds == run.loop_seconds


def test_every_error_is_whole_and_pickles(tmp_path, config, model):
    (tmp_path / "model.json").write_text("{}")
    calls = {
        "control.horizon": lambda: config.set("control.horizon", 1),
        "config": lambda: pc.simulate(None),
        "seed": lambda: pc.simulate(config, seed=-1),
        "threads": lambda: pc.simulate_many(config, [1], threads=0),
        "seeds": lambda: pc.simulate_many(config, 3),
        "times": lambda: pc.response(config, 0.01, [[0.1]]),
        "controller": lambda: pc.simulate(config, controller=object()),
        "absorption_factor": lambda: model.B(0.0),
        "volume_temperature": lambda: pc.Estimator(model, config).update("x", 0.0),
        "applied_power": lambda: pc.Controller(model, config).step(1.0, float("nan")),
        "model": lambda: pc.Controller(None, config),
        "control.period_ms": lambda: pc.Controller(model, config.set("control.period_ms", 2)),
    }
    for key, call in calls.items():
        with pytest.raises(pc.ConfigError) as caught:
            call()
        error = caught.value
        assert error.key == key and error.found and error.accepted, (key, vars(error))
        again = pickle.loads(pickle.dumps(error))
        assert type(again) is pc.ConfigError and vars(again) == vars(error) and str(again) == str(error)
