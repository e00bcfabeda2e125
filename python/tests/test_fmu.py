"""`export-fmu`: FMPy finds nothing wrong, coupled eye and controller are `simulate` bit for bit."""

from __future__ import annotations

import math
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path

import pytest

from fmus import MISSING, ROOT, Part, Settings, call, export, files, instrument, pair, powers, simulated

if not MISSING:
    import fmpy
    from fmpy.validation import validate_fmu

__all__ = ["files", "instrument", "pair"]  # fixtures


CASES: dict[str, tuple[str, Settings]] = {
    "default": ("", {}),
    "delay": ("", {"control.delay_cycles": "1", "run.duration_ms": "100"}),
    "250 Hz": ("configs/paper-250hz-a.toml", {"run.duration_ms": "200"}),
    "chance": ("configs/uncertain-eye.toml", {"run.duration_ms": "60"}),
    "reduced eye, bench, moving horizon": (
        "",
        {
            "plant.model": "reduced",
            "plant.power_lag_periods": "0.1",
            "plant.sample_averaging_periods": "0.2",
            "plant.sample_gain": "1.05",
            "estimator.kind": "mhe",
            "safety.supervisor": "off",
            "run.duration_ms": "60",
        },
    ),
    "drifting eye of another tissue": (
        "",
        {"plant.absorption_drift_per_s": "1", "plant.tissue.spot_radius_um": "95", "run.duration_ms": "60"},
    ),
    "stopped by the supervisor": ("", {"safety.exposure_max_ms": "20", "run.duration_ms": "60"}),
}


@pytest.mark.parametrize(("config", "settings"), CASES.values(), ids=CASES.keys())
def test_the_coupled_pair_is_simulate(config: str, settings: Settings, tmp_path: Path) -> None:
    rows = simulated(tmp_path / "run", config, settings)
    eye = Part(export("eye", tmp_path / "eye.fmu", config, settings), tmp_path / "eye")
    controller = Part(export("controller", tmp_path / "controller.fmu", config, settings), tmp_path / "controller")
    for file in ("eye.fmu", "controller.fmu"):
        assert validate_fmu(str(tmp_path / file)) == []
    eye.begin()
    controller.begin()
    expected = [float(row["power_W"]) for row in rows]
    assert max(expected) > 0.0
    for cycle, power in enumerate(powers(eye, controller, len(rows))):
        row = rows[cycle]
        assert power == expected[cycle], cycle
        if cycle + 1 < len(rows):  # after the last one simulate writes nothing more
            assert controller.get("peak_estimate") == [float(row["peak_estimate_K"])], cycle
        assert eye.get("peak_temperature_true") == [float(row["peak_true_K"])], cycle
    eye.end()
    controller.end()


def test_parameters_are_the_configurations_keys(pair: tuple[Part, Part], tmp_path: Path) -> None:
    settings = {"plant.absorption_factor": "0.6", "run.seed": "7", "control.peak_reference_K": "25"}
    expected = [float(row["power_W"]) for row in simulated(tmp_path / "run", "", settings)][:50]
    eye, controller = pair
    eye.begin(start=3.0, plant__absorption_factor=0.6, run__seed=7)
    controller.begin(start=3.0, control__peak_reference_K=25.0)
    assert list(powers(eye, controller, 50)) == expected
    assert eye.get("time")[0] == pytest.approx(3.05)


def test_a_saved_state_goes_on_in_the_same_way(pair: tuple[Part, Part]) -> None:
    eye, controller = pair
    eye.begin()
    controller.begin()
    list(powers(eye, controller, 30))
    saved = [(part, part.fmu.getFMUState(), part.steps) for part in pair]
    kept = [part.fmu.serializeFMUState(state) for part, state, _ in saved]
    expected = list(powers(eye, controller, 30))
    for part, state, steps in saved:
        part.fmu.setFMUState(state)
        part.fmu.freeFMUState(state)
        part.steps = steps
    assert list(powers(eye, controller, 30)) == expected
    # As bytes into new instances, also before they are initialised.
    for (part, _, steps), data in zip(saved, kept, strict=True):
        part.fmu.freeInstance()
        part.new()
        part.fmu.setFMUState(part.fmu.deserializeFMUState(data))
        part.steps = steps
        with pytest.raises(Exception, match="Deserialize"):
            part.fmu.deserializeFMUState(data[:-1])
        with pytest.raises(Exception, match="Deserialize"):
            part.fmu.deserializeFMUState(b"x" + data[1:])
    assert list(powers(eye, controller, 30)) == expected


def test_instances_share_nothing(files: dict[str, Path], tmp_path: Path) -> None:
    first = Part(files["controller"], tmp_path / "controller")
    alone = Part(files["controller"], tmp_path / "alone")
    second = Part(files["controller"], tmp_path / "controller")
    for part in (first, second, alone):
        part.begin()
    for k in range(20):
        sample = 10.0 * (1.0 - math.exp(-k / 5.0))
        for part in (first, alone):
            part.set(volume_temperature=sample, applied_power=0.02)
            part.step()
        second.set(volume_temperature=0.5 * sample, applied_power=0.01)
        second.step()
        assert first.get("power", "peak_estimate") == alone.get("power", "peak_estimate")
    assert first.get("peak_estimate") != second.get("peak_estimate")
    second.fmu.freeInstance()
    first.step()
    first.end()


def test_a_master_that_steps_both_at_once_is_stopped_by_the_supervisor(pair: tuple[Part, Part]) -> None:
    eye, controller = pair
    eye.begin()
    controller.begin()
    for _ in range(10):
        (power,) = controller.get("power")
        sample, applied = eye.get("volume_temperature", "applied_power")
        eye.set(power=power)
        controller.set(volume_temperature=sample, applied_power=applied)
        eye.step()
        controller.step()
    assert controller.fmu.getInt64([controller.variables["safety_state"].valueReference]) == [6]
    assert controller.get("power") == [0.0]


def test_reset_begins_anew(pair: tuple[Part, Part]) -> None:
    eye, controller = pair
    results = []
    for _ in range(2):
        eye.begin()
        controller.begin()
        results.append(list(powers(eye, controller, 20)))
        eye.fmu.reset()
        controller.fmu.reset()
    assert results[0] == results[1]


def test_fmpys_own_loop_runs_it(files: dict[str, Path]) -> None:
    for file in files.values():
        result = fmpy.simulate_fmu(str(file), stop_time=0.05, output_interval=1e-3)
        assert len(result) == 51


REFUSED: dict[str, tuple[str, str, Callable[[], bool]]] = {
    "pulses": ("eye", "photoacoustics.sampling=pulses", lambda: True),
    "pulses, controller": ("controller", "photoacoustics.sampling=pulses", lambda: True),
    "OSQP": (
        "controller",
        "control.solver=osqp",
        lambda: call("config", "--set", "control.solver=osqp").returncode == 0,
    ),
}


@pytest.mark.parametrize(("kind", "setting", "sensible"), REFUSED.values(), ids=REFUSED.keys())
def test_what_it_does_not_carry_is_refused_by_name(
    kind: str, setting: str, sensible: Callable[[], bool], tmp_path: Path
) -> None:
    if not sensible():
        pytest.skip("this build has no OSQP")
    done = call("export-fmu", kind, "--set", setting, "--out", str(tmp_path / "x.fmu"))
    assert done.returncode == 2
    assert setting.split("=")[0] in done.stderr
    assert not (tmp_path / "x.fmu").exists()


def test_the_same_bytes_again_and_no_file_is_overwritten(files: dict[str, Path], tmp_path: Path) -> None:
    again = export("controller", tmp_path / "controller.fmu")
    assert again.read_bytes() == files["controller"].read_bytes()
    done = call("export-fmu", "controller", "--out", str(again))
    assert done.returncode == 2
    assert "--out" in done.stderr


def test_the_example_says_that_all_powers_are_equal(files: dict[str, Path], tmp_path: Path) -> None:
    simulated(tmp_path / "run", "", {})
    figure = tmp_path / "fmu.svg"
    example = [sys.executable, str(ROOT / "examples" / "fmu" / "couple.py")]
    options = ["--run", str(tmp_path / "run"), "--figure", str(figure)]
    done = subprocess.run(
        [*example, str(files["eye"]), str(files["controller"]), *options], check=True, capture_output=True, text=True
    )
    assert "bit for bit: 250 of 250" in done.stdout
    assert "</svg>" in figure.read_text()
