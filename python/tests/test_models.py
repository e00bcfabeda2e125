"""Models: matrices that belong to each other and to the responses."""

import json
import pickle

import numpy as np
import pytest
import scipy.linalg
import scipy.sparse.linalg

import photocoag as pc


def test_discrete_matrices_belong_to_the_continuous_ones(model):
    assert np.allclose(scipy.linalg.expm(model.A * model.period), model.A_d, rtol=1e-9, atol=1e-12)
    gain = np.linalg.solve(model.A, (model.A_d - np.eye(model.order)) @ model.B(1.1))
    assert np.allclose(gain, model.B_d(1.1), rtol=1e-8)


def test_python_control_gives_the_same_response(config, model):
    import control

    times = np.linspace(0.0, 0.2, 201)
    ours = pc.response(config, 0.02, times, model=model)
    alpha = config.plant.absorption_factor
    theirs = control.forced_response(model.to_control(alpha), times, np.full(201, 0.02)).outputs
    assert np.allclose(theirs, [ours["volume_K"], ours["peak_K"]], rtol=1e-6, atol=1e-9)
    discrete = model.to_control(alpha, discrete=True)
    assert discrete.dt == model.period
    theirs = control.forced_response(discrete, times, np.full(201, 0.02)).outputs
    assert np.allclose(theirs, [ours["volume_K"], ours["peak_K"]], rtol=1e-6, atol=1e-9)


def test_responses_are_the_programs(config, program, tmp_path, model):
    model.save(tmp_path / "model.json")
    for kind, more in (("full", []), ("reduced", []), (model, ["--rom", str(tmp_path / "model.json")])):
        csv = tmp_path / "response.csv"
        name = kind if isinstance(kind, str) else "reduced"
        program("response", "--model", name, *more, "--power", "0.02", "--times", "0.1,0.001", "--csv", str(csv))
        ours = pc.response(config, 0.02, [0.1, 0.001], model=kind)
        theirs = np.genfromtxt(csv, delimiter=",", names=True)
        for column in ("time_s", "peak_K", "volume_K"):
            assert (ours[column] == theirs[column]).all()


def test_sparse_matrices_have_the_steady_state(config):
    full = pc.FullOrderModel(config)
    assert full.A.shape == (full.states, full.states) and full.E.shape == full.A.shape
    assert abs(full.A - full.A.T).max() < 1e-12 * abs(full.A).max()
    alpha = config.plant.absorption_factor
    heat = full.E @ full.b(alpha)
    temperatures = scipy.sparse.linalg.spsolve(full.A, -0.02 * heat)
    steady = pc.response(config, 0.02, [5000.0])
    assert full.c_peak @ temperatures == pytest.approx(steady["peak_K"][0], rel=1e-6)
    assert full.c_volume(alpha) @ temperatures == pytest.approx(steady["volume_K"][0], rel=1e-6)


def test_certify_proves_what_the_program_proves(config, program):
    proof = pc.certify(config.set("control.horizon", 3), absorption=(0.5, 1.5), free=(10, 32))
    theirs = json.loads(
        program("certify", "--set", "control.horizon=3", "--alpha", "0.5,1.5", "--free", "10,32", "--json"))
    assert proof == {key: theirs[key] for key in proof}
    assert 0 < proof["changes_seen"] <= proof["changes_proved"] <= proof["hard_bound"] and proof["boxes"] > 1
    for name, value in (("absorption", (2, 1)), ("absorption", (0.01, 1)), ("choroid", (1, 2)), ("free", "low"),
                        ("previous", (0, 3)), ("boxes", 0)):
        with pytest.raises(pc.ConfigError) as refused:
            pc.certify(config.set("control.horizon", 2), **{name: value})
        assert refused.value.key == name, value
    with pytest.raises(pc.ConfigError) as refused:
        pc.certify(config.set("control.horizon", 6))
    assert refused.value.key == "control.horizon"


def test_plants_step_as_the_response_says(config, model):
    alpha = config.plant.absorption_factor
    for plant, kind in ((pc.FullOrderModel(config).plant(), "full"), (model.plant(alpha), "reduced")):
        for _ in range(10):
            plant.step(0.02)
        steps = pc.response(config, 0.02, [0.01], model=kind)
        assert plant.outputs() == pytest.approx((steps["volume_K"][0], steps["peak_K"][0]), rel=1e-9)


def test_files_and_pickles_keep_every_bit(model, tmp_path):
    model.save(tmp_path / "model.json")
    for again in (pc.ReducedModel.load(tmp_path / "model.json"), pickle.loads(pickle.dumps(model))):
        assert again == model and (again.A == model.A).all()


def test_a_damaged_file_is_named(model, tmp_path):
    content = json.loads(model.to_json())
    content["period_s"] = content.get("period_s", 0.001) * 2
    for text in ("", "{}", model.to_json()[:-200], json.dumps(content), "\x00" * 100):
        file = tmp_path / "model.json"
        file.write_text(text)
        with pytest.raises(pc.ConfigError) as caught:
            pc.ReducedModel.load(file)
        assert str(file) in str(caught.value)


def test_a_model_for_another_period_is_refused(config, model):
    slow = config.set("control.period_ms", 4)
    for part in (pc.Controller, pc.Estimator):
        with pytest.raises(pc.ConfigError) as caught:
            part(model, slow)
        assert caught.value.key == "control.period_ms"
        assert "4 ms" in caught.value.found and "1 ms" in caught.value.found


def test_the_controller_steps_as_in_the_loop(config, model):
    config = config.set("safety.supervisor", "off")  # which may lower what the controller wants
    controller = pc.Controller(model, config)
    power = controller.start()
    for row in pc.simulate(config).cycles:
        assert power == row["power_W"]
        power = controller.step(row["volume_measured_K"], row["power_W"])
        assert controller.estimate["absorption_factor"] == row["absorption_estimate"]


@pytest.mark.parametrize("bad", [None, "x", float("nan"), float("inf"), 1j, [1.0], True, 0.0, 99.0])
def test_factors_that_are_none_are_refused(model, bad):
    for call in (model.B, model.C_volume, model.B_d, model.plant):
        with pytest.raises(pc.ConfigError) as caught:
            call(bad)
        assert caught.value.key == "absorption_factor"


@pytest.mark.parametrize("times", [None, "0.1", [[0.1]], [float("nan")], [-1.0], [1j], {}, [None], [1e9]])
def test_times_that_are_none_are_refused(config, times):
    with pytest.raises(pc.ConfigError):
        pc.response(config, 0.02, times)
