"""`export-fmu --fmi 2.0`: FMPy finds nothing wrong, the coupled pair is `simulate` bit for bit, misuse is an error."""

from __future__ import annotations

import ctypes
import math
import re
import subprocess
from pathlib import Path
from typing import Any

import pytest

from fmus import (
    ERROR, HEADERS, MISSING, ROOT, N, Part, Settings, call, doubles, export, instrument, library, numbers, powers, simulated,
)

if not MISSING:
    from fmpy.fmi2 import FMU2Slave
    from fmpy.validation import validate_fmu

__all__ = ["instrument"]  # a fixture

FMI2 = ("--fmi", "2.0")


class Part2(Part):
    """One FMU of FMI 2.0 through FMPy, variables by name."""

    def new(self) -> None:
        self.fmu = FMU2Slave(
            guid=self.description.guid,
            unzipDirectory=str(self.folder),
            modelIdentifier=self.description.coSimulation.modelIdentifier,
            instanceName="one",
        )
        self.fmu.instantiate()

    def set(self, **values: float) -> None:
        for name, value in values.items():
            variable = self.variables[name.replace("__", ".")]
            setter = self.fmu.setInteger if variable.type == "Integer" else self.fmu.setReal
            setter([variable.valueReference], [value])

    def get(self, *names: str) -> list[float]:
        return list(self.fmu.getReal([self.variables[name].valueReference for name in names]))

    def begin(self, start: float = 0.0, **parameters: float) -> None:
        self.fmu.setupExperiment(startTime=start)
        self.set(**parameters)
        self.fmu.enterInitializationMode()
        self.fmu.exitInitializationMode()
        self.start = start
        self.steps = 0


CASES: dict[str, tuple[str, Settings]] = {
    "default": ("", {}),
    "250 Hz": ("configs/paper-250hz-a.toml", {"run.duration_ms": "200"}),
    "stopped by the supervisor": ("", {"safety.exposure_max_ms": "20", "run.duration_ms": "60"}),
}


@pytest.mark.parametrize(("config", "settings"), CASES.values(), ids=CASES.keys())
def test_the_coupled_pair_is_simulate(config: str, settings: Settings, tmp_path: Path) -> None:
    rows = simulated(tmp_path / "run", config, settings)
    parts = []
    for kind in ("eye", "controller"):
        file = export(kind, tmp_path / f"{kind}.fmu", config, settings, *FMI2)
        assert validate_fmu(str(file)) == []
        parts.append(Part2(file, tmp_path / f"a folder, {kind} at 100 %"))
        assert parts[-1].description.fmiVersion == "2.0"
    eye, controller = parts
    eye.begin()
    controller.begin()
    for cycle, power in enumerate(powers(eye, controller, len(rows))):
        assert power == float(rows[cycle]["power_W"]), cycle
        assert eye.get("peak_temperature_true") == [float(rows[cycle]["peak_true_K"])], cycle
        if cycle == 40:  # there and back, through bytes
            for part in parts:
                state = part.fmu.getFMUstate()
                data = part.fmu.serializeFMUstate(state)
                part.fmu.freeFMUstate(state)
                part.fmu.reset()
                part.fmu.setFMUstate(part.fmu.deSerializeFMUstate(data))
    eye.end()
    controller.end()


def test_parameters_are_the_configurations_keys(tmp_path: Path) -> None:
    settings = {"plant.absorption_factor": "0.6", "run.seed": "7", "control.peak_reference_K": "25"}
    expected = [float(row["power_W"]) for row in simulated(tmp_path / "run", "", settings)][:30]
    eye = Part2(export("eye", tmp_path / "eye.fmu", "", None, *FMI2), tmp_path / "eye")
    controller = Part2(export("controller", tmp_path / "c.fmu", "", None, *FMI2), tmp_path / "controller")
    eye.begin(start=3.0, plant__absorption_factor=0.6, run__seed=7)
    controller.begin(start=3.0, control__peak_reference_K=25.0)
    assert list(powers(eye, controller, 30)) == expected
    assert eye.get("time")[0] == pytest.approx(3.03)


LOG = ctypes.CFUNCTYPE(None, ctypes.c_void_p, ctypes.c_char_p, ctypes.c_int, ctypes.c_char_p, ctypes.c_char_p, ctypes.c_char_p)


class Callbacks(ctypes.Structure):
    _fields_ = [("logger", LOG), *[(name, ctypes.c_void_p) for name in ("allocate", "free", "finished", "environment")]]


class Raw2:
    """The library without FMPy between: any argument at all."""

    def __init__(self, part: Part2) -> None:
        self.dll, _ = library(part)
        self.said: list[str] = []
        # The message is a format with one string.
        log = LOG(lambda environment, name, status, category, form, text: self.said.append((form % text).decode()))
        self.callbacks = Callbacks(log)
        self.part = part
        self.dll.fmi2Instantiate.restype = ctypes.c_void_p
        for name in ("fmi2GetVersion", "fmi2GetTypesPlatform"):
            getattr(self.dll, name).restype = ctypes.c_char_p

    def instantiate(self, **other: Any) -> Any:
        given = {"name": b"one", "type": 1, "guid": self.part.description.guid.encode(),
                 "resources": (self.part.folder / "resources").as_uri().encode(), "callbacks": ctypes.byref(self.callbacks)}
        return self.dll.fmi2Instantiate(*{**given, **other}.values(), 0, 0)

    def call(self, name: str, instance: Any, *arguments: Any) -> int:
        return int(getattr(self.dll, name)(ctypes.c_void_p(instance), *arguments))


def declared2() -> list[str]:
    """Those for co-simulation: all that come before the ones for model exchange, and those after."""
    text = (HEADERS / "fmi2Functions.h").read_text()
    names = re.findall(r"^\s*FMI2_Export fmi2\w+TYPE\s+(fmi2\w+);", text, re.MULTILINE)
    first, last = names.index("fmi2EnterEventMode"), names.index("fmi2SetRealInputDerivatives")
    return names[:first] + names[last:]


@pytest.mark.parametrize("kind", ["eye", "controller"])
def test_misuse_is_an_error(kind: str, tmp_path: Path) -> None:
    part = Part2(export(kind, tmp_path / "x.fmu", "", None, *FMI2), tmp_path / "x")
    raw = Raw2(part)
    assert raw.dll.fmi2GetVersion() == b"2.0"
    assert raw.dll.fmi2GetTypesPlatform() == b"default"
    names = declared2()
    assert len(names) == 34
    free = ("fmi2GetVersion", "fmi2GetTypesPlatform", "fmi2FreeInstance", "fmi2Instantiate")
    for junk in (None, 1, 0xDEADBEEF):
        for name in names:
            if name not in free:
                assert raw.call(name, junk, *[ctypes.c_void_p(None)] * 7) == ERROR, name
        raw.dll.fmi2FreeInstance(ctypes.c_void_p(junk))
    for other in ({"name": None}, {"guid": None}, {"guid": b"another"}, {"resources": None}, {"resources": b"/no/uri"},
                  {"resources": b"file:///no/folder"}, {"type": 0}, {"callbacks": None}):
        assert raw.instantiate(**other) is None, other
    assert len(raw.said) == 7  # without callbacks nobody is told
    instance = raw.instantiate()
    assert instance

    def refused(expected: str, name: str, *arguments: Any) -> None:
        raw.said.clear()
        assert raw.call(name, instance, *arguments) == ERROR, name
        assert len(raw.said) == 1
        assert raw.said[0].startswith(f"{name}: ")
        assert expected in raw.said[0], raw.said

    def good(name: str, *arguments: Any) -> None:
        raw.said.clear()
        assert raw.call(name, instance, *arguments) == 0, raw.said

    time = ctypes.c_double
    step = ("fmi2DoStep", time(0.0), time(part.period), 0)
    output = next(one.valueReference for one in part.description.modelVariables if one.causality == "output")
    key = "plant.noise_K" if kind == "eye" else "control.peak_reference_K"
    reference = part.variables[key].valueReference
    value = doubles(0.0)
    setup = ("fmi2SetupExperiment", 0, time(0.0), time(0.0), 0, time(0.0))
    refused("before fmi2SetupExperiment", "fmi2EnterInitializationMode")
    refused("out of order", "fmi2ExitInitializationMode")
    refused("out of order", *step)
    refused("before initialization", "fmi2GetReal", numbers(output), N(1), value)
    good("fmi2SetupExperiment", 0, time(0.0), time(math.nan), 0, time(0.0))
    refused("no span", "fmi2EnterInitializationMode")
    good("fmi2Reset")
    good(*setup)
    refused("out of order", *setup)
    good("fmi2EnterInitializationMode")
    good("fmi2SetReal", numbers(reference), N(1), doubles(1e6))
    refused(key, "fmi2ExitInitializationMode")
    refused("a finite number", "fmi2SetReal", numbers(reference), N(1), doubles(math.nan))
    good("fmi2SetReal", numbers(reference), N(1), doubles(0.3 if kind == "eye" else 30.0))
    good("fmi2ExitInitializationMode")
    refused("unknown value reference", "fmi2GetReal", numbers(10_000), N(1), value)
    refused("unknown value reference", "fmi2SetReal", numbers(10_000), N(1), value)
    refused("another type", "fmi2GetInteger", numbers(output), N(1), value)
    refused("another type", "fmi2GetBoolean", numbers(output), N(1), value)
    refused("no variable", "fmi2GetString", numbers(output), N(1), value)
    refused("cannot be set", "fmi2SetReal", numbers(output), N(1), value)
    refused("null pointer", "fmi2GetReal", None, N(1), value)
    refused("null pointer", "fmi2GetReal", numbers(output), N(1), None)
    refused("not supported", "fmi2CancelStep")
    refused("no variable", "fmi2GetRealOutputDerivatives", numbers(output), N(1), value, value)
    good("fmi2GetReal", None, N(0), None)
    refused("step size", "fmi2DoStep", time(0.0), time(2.0 * part.period), 0)
    refused("step size", "fmi2DoStep", time(0.0), time(math.nan), 0)
    refused("communication point", "fmi2DoStep", time(part.period), time(part.period), 0)
    good(*step)
    good("fmi2GetRealStatus", 2, value)
    assert value[0] == part.period
    refused("null pointer", "fmi2GetRealStatus", 2, None)
    refused("not a saved state", "fmi2SetFMUstate", ctypes.c_void_p(0x1234))
    refused("null pointer", "fmi2GetFMUstate", None)
    good("fmi2Terminate")
    refused("out of order", "fmi2DoStep", time(part.period), time(part.period), 0)
    raw.dll.fmi2FreeInstance(ctypes.c_void_p(instance))
    assert raw.call("fmi2Reset", instance) == ERROR


def test_our_declarations_are_the_standards(tmp_path: Path) -> None:
    source = tmp_path / "both.c"
    ours = ROOT / "src" / "photocoag" / "fmu" / "fmi2.h"
    source.write_text(
        f'#include "fmi2Functions.h"\n#define FMI2_TYPES_ARE_KNOWN\n#include "{ours}"\n'
    )
    subprocess.run(["gcc", "-std=c11", "-Werror", "-fsyntax-only", "-I", str(HEADERS), str(source)], check=True)
    assert sorted(re.findall(r"^FMI2_EXPORT [\w ]+\*? ?\b(fmi2\w+)\(", ours.read_text(), re.MULTILINE)) == sorted(declared2())


def test_what_it_cannot_be_is_refused(tmp_path: Path) -> None:
    for more, said in ((["--source"], "--source"), (["--set", "run.seed=3000000000"], "run.seed")):
        kind = "controller" if more == ["--source"] else "eye"
        done = call("export-fmu", kind, *FMI2, *more, "--out", str(tmp_path / "x.fmu"))
        assert done.returncode == 2
        assert said in done.stderr
        assert not (tmp_path / "x.fmu").exists()
