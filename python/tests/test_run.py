"""Simulation: the program's numbers, as arrays."""

import json
import os
import pickle

import numpy as np
import pytest

import photocoag as pc

from conftest import ROOT

CASES = {
    "paper": [],
    "reduced eye": ["plant.model=reduced", "run.seed=7"],
    "250 Hz": ["control.period_ms=4", "control.power_change_weight=5e4", "plant.absorption_factor=0.5"],
    "delayed, other tissue": ["control.delay_cycles=1", "plant.tissue.spot_radius_um=95"],
    "unsupervised": ["safety.supervisor=off", "run.duration_ms=40"],
    "osqp": ["control.solver=osqp", "run.duration_ms=50"],
}


def of(settings):
    config = pc.Config()
    for one in settings:
        key, value = one.split("=")
        config = config.set(key, value if value.isalpha() else float(value) if "." in value or "e" in value else int(value))
    return config


@pytest.mark.parametrize("name", CASES)
def test_bytes_are_the_programs(name, program, tmp_path):
    if name == "osqp" and not pc._core.has_osqp:
        pytest.skip("built without OSQP")
    arguments = [part for one in CASES[name] for part in ("--set", one)]
    program("simulate", *arguments, "--out", str(tmp_path / "run"))
    run = pc.simulate(of(CASES[name]))
    assert run.to_csv() == (tmp_path / "run/run.csv").read_text()
    theirs = json.loads((tmp_path / "run/summary.json").read_text())
    ours = dict(run.summary)
    assert theirs.pop("loop_wall_s") > 0 and ours.pop("loop_wall_s") > 0
    assert ours == theirs and ours["source_hash"] == pc.__source_hash__


@pytest.mark.parametrize("name", ["uncertain-eye", "two-unknowns"])
def test_bytes_of_a_file_are_the_programs(name, program, tmp_path):
    file = ROOT / f"configs/{name}.toml"
    program("simulate", "--config", str(file), "--out", str(tmp_path / "run"))
    config = pc.Config.from_dict(pc.Config.load(file).to_dict())
    assert pc.simulate(config).to_csv() == (tmp_path / "run/run.csv").read_text()


def test_cycles_are_the_columns_of_the_csv(run):
    lines = run.to_csv().splitlines()
    assert lines[0].split(",") == list(run.cycles.dtype.names)
    for row in (0, 100, 249):
        cells = dict(zip(lines[0].split(","), lines[row + 1].split(",")))
        for name, cell in cells.items():
            value = run.cycles[name][row]
            assert (str(value) == cell) or float(cell) == value
    assert run.cycles["time_s"].dtype == np.float64 and run.units["time_s"] == "s"
    assert run.cycles["solver_status"][0] == "solved"


def test_run_files_and_pictures(run):
    frame = run.to_pandas()
    assert len(frame) == len(run) == 250 and frame.attrs["units"]["power_W"] == "W"
    assert frame["peak_true_K"].max() == run.summary["peak_true_max_K"]
    figure = run.plot()
    assert len(figure.axes) == 4 and figure._repr_png_().startswith(b"\x89PNG")
    assert "250 cycles" in repr(run) and "<table>" in run._repr_html_()


def test_seed_is_the_configurations(config, run):
    assert pc.simulate(config, seed=1).to_csv() == run.to_csv()
    other = pc.simulate(config, seed=2)
    assert other.config.run.seed == 2 and other.to_csv() != run.to_csv()


def test_a_saved_run_is_a_run_folder(run, tmp_path):
    run.save(tmp_path / "run")
    assert (tmp_path / "run/run.csv").read_text() == run.to_csv()
    assert {f.name for f in (tmp_path / "run").iterdir()} >= {"config.toml", "summary.json", "report.html"}
    assert pc.Config.load(tmp_path / "run/config.toml") == run.config
    with pytest.raises(pc.ConfigError):
        run.save(tmp_path / "run")


def test_a_run_folder_is_read(run, tmp_path):
    run.save(tmp_path / "run")
    again = pc.Run.load(tmp_path / "run")
    assert again.to_csv() == run.to_csv() and again.units == run.units and again.config == run.config
    assert {**again.summary, "loop_wall_s": 0} == {**run.summary, "loop_wall_s": 0}
    assert (again.cycles == run.cycles).all() and len(again.plot().axes) == 4
    for file in ("run.csv", "summary.json", "config.toml"):
        whole = (tmp_path / "run" / file).read_text()
        (tmp_path / "run" / file).write_text("[broken")
        with pytest.raises(pc.ConfigError, match=file):
            pc.Run.load(tmp_path / "run")
        (tmp_path / "run" / file).write_text(whole)
    for bad in (None, 3, tmp_path / "none", "a\0b"):
        with pytest.raises(pc.ConfigError):
            pc.Run.load(bad)


def test_a_simulation_leaves_no_file(config, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    pc.simulate(config, cache=False)
    assert os.listdir(tmp_path) == []


def test_runs_pickle(run):
    again = pickle.loads(pickle.dumps(run))
    assert again.to_csv() == run.to_csv() and again.summary == run.summary
    assert (again.cycles["power_W"] == run.cycles["power_W"]).all()
    with pytest.raises(pc.ConfigError, match="unpickled"):
        again.save("anywhere")


def test_many_are_the_same_as_one_by_one(config):
    seeds = [3, 1, 2**62]
    told = []
    runs = pc.simulate_many(config, seeds, threads=2, progress=lambda done, total: told.append((done, total)))
    assert [run.to_csv() for run in runs] == [pc.simulate(config, seed=s).to_csv() for s in seeds]
    assert [run.config.run.seed for run in runs] == seeds and told[-1] == (3, 3)
    several = [config.set("control.horizon", n) for n in (2, 8)]
    assert [run.config for run in pc.simulate_many(several)] == several
    assert [run.to_csv() for run in pc.simulate_many(several)] == [pc.simulate(c).to_csv() for c in several]


def test_a_sweep_is_a_table(config):
    table = pc.sweep(config, {"control.horizon": [2, 5], "plant.model": ["reduced"]}, seeds=[1, 2])
    assert list(table["control.horizon"]) == [2, 2, 5, 5] and list(table["run.seed"]) == [1, 2, 1, 2]
    assert (table["limit_violations"] == 0).all()


def test_treat_is_paced(config):
    run = pc.treat(config.set("run.duration_ms", 30))
    assert run.summary["cycles"] == 30 and run.summary["scheduling"]


def test_what_cannot_be_simulated_is_refused(config):
    for bad in (None, {}, "paper-1khz.toml"):
        with pytest.raises(pc.ConfigError) as caught:
            pc.simulate(bad)
        assert caught.value.key == "config"
    for seed in (-1, 2**63, 1.5, "1", True):
        with pytest.raises(pc.ConfigError) as caught:
            pc.simulate(config, seed=seed)
        assert caught.value.key == "seed"
