"""`export-fmu`: FMPy finds nothing wrong, coupled eye and controller are `simulate` bit for bit, misuse is an error."""

from __future__ import annotations

import csv
import ctypes
import math
import os
import re
import subprocess
import sys
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pytest

try:
    import fmpy
    from fmpy.fmi3 import FMU3Slave
    from fmpy.validation import validate_fmu
except ImportError as missing:  # 77: skipped, as tests/CMakeLists.txt says
    pytest.exit(f"no FMPy: {missing}", returncode=77)

ROOT = Path(__file__).resolve().parents[2]
PROGRAM = os.environ.get("PHOTOCOAG_PROGRAM", "photocoag")
HEADERS = Path(fmpy.__file__).parent / "c-code"
ERROR = 3  # fmi3Error

Settings = dict[str, str]


def call(*arguments: str) -> subprocess.CompletedProcess[str]:
    return subprocess.run([PROGRAM, *arguments], capture_output=True, text=True, check=False)


def export(kind: str, out: Path, config: str = "", settings: Settings | None = None, *more: str) -> Path:
    options = list(more)
    options += ["--config", str(ROOT / config)] if config else []
    for key, value in (settings or {}).items():
        options += ["--set", f"{key}={value}"]
    done = call("export-fmu", kind, *options, "--out", str(out))
    if "was not built with this program" in done.stderr:
        pytest.exit(done.stderr, returncode=77)
    assert done.returncode == 0, done.stderr
    return out


class Part:
    """One FMU through FMPy, variables by name."""

    def __init__(self, file: Path, folder: Path) -> None:
        self.description = fmpy.read_model_description(str(file))
        if not folder.exists():  # a library that is loaded is not written again
            fmpy.extract(str(file), str(folder))
        self.folder = folder
        self.variables = {one.name: one for one in self.description.modelVariables}
        self.period = float(self.description.coSimulation.fixedInternalStepSize)
        self.said: list[str] = []
        self.new()

    def new(self) -> None:
        description = self.description
        self.fmu = FMU3Slave(
            guid=description.guid,
            unzipDirectory=str(self.folder),
            modelIdentifier=description.coSimulation.modelIdentifier,
            instanceName="one",
        )
        self.fmu.instantiate()

    def set(self, **values: float) -> None:
        for name, value in values.items():
            variable = self.variables[name.replace("__", ".")]
            setter = self.fmu.setInt64 if variable.type == "Int64" else self.fmu.setFloat64
            setter([variable.valueReference], [value])

    def get(self, *names: str) -> list[float]:
        return list(self.fmu.getFloat64([self.variables[name].valueReference for name in names]))

    def begin(self, start: float = 0.0, **parameters: float) -> None:
        self.set(**parameters)
        self.fmu.enterInitializationMode(startTime=start)
        self.fmu.exitInitializationMode()
        self.start = start
        self.steps = 0

    def step(self) -> None:
        self.fmu.doStep(self.start + self.steps * self.period, self.period)
        self.steps += 1

    def end(self) -> None:
        self.fmu.terminate()
        self.fmu.freeInstance()


def powers(eye: Part, controller: Part, cycles: int) -> Iterator[float]:
    """The eye first, then the controller with its sample: the order of Algorithm 1."""
    for _ in range(cycles):
        (power,) = controller.get("power")
        eye.set(power=power)
        eye.step()
        sample, applied = eye.get("volume_temperature", "applied_power")
        controller.set(volume_temperature=sample, applied_power=applied)
        controller.step()
        yield applied


def simulated(folder: Path, config: str, settings: Settings) -> list[dict[str, str]]:
    options = ["--config", str(ROOT / config)] if config else []
    for key, value in settings.items():
        options += ["--set", f"{key}={value}"]
    done = call("simulate", *options, "--out", str(folder))
    assert done.returncode in (0, 1), done.stderr
    with (folder / "run.csv").open() as file:
        return list(csv.DictReader(file))


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


@pytest.fixture(scope="module")
def files(tmp_path_factory: pytest.TempPathFactory) -> dict[str, Path]:
    folder = tmp_path_factory.mktemp("fmu")
    return {kind: export(kind, folder / f"{kind}.fmu") for kind in ("eye", "controller")}


@pytest.fixture
def pair(files: dict[str, Path], tmp_path: Path) -> tuple[Part, Part]:
    return Part(files["eye"], tmp_path / "eye"), Part(files["controller"], tmp_path / "controller")


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


def declared() -> list[str]:
    text = (HEADERS / "fmi3Functions.h").read_text()
    return re.findall(r"^FMI3_Export fmi3\w+TYPE\s+(fmi3\w+);", text, re.MULTILINE)


def library(part: Part) -> tuple[ctypes.CDLL, str]:
    path = next((part.folder / "binaries").glob(f"*/{part.description.coSimulation.modelIdentifier}.so"))
    return ctypes.CDLL(str(path)), str(path)


LOG = ctypes.CFUNCTYPE(None, ctypes.c_void_p, ctypes.c_int, ctypes.c_char_p, ctypes.c_char_p)


class Raw:
    """The library without FMPy between: any argument at all."""

    def __init__(self, part: Part) -> None:
        self.dll, _ = library(part)
        self.said: list[str] = []
        self.log = LOG(lambda environment, status, category, message: self.said.append(message.decode()))
        self.resources = str(part.folder / "resources") + os.sep
        self.token = part.description.guid
        self.dll.fmi3InstantiateCoSimulation.restype = ctypes.c_void_p
        self.dll.fmi3InstantiateModelExchange.restype = ctypes.c_void_p
        self.dll.fmi3InstantiateScheduledExecution.restype = ctypes.c_void_p
        self.dll.fmi3GetVersion.restype = ctypes.c_char_p

    def instantiate(self, name: Any = b"one", token: Any = "", resources: Any = "", event_mode: bool = False) -> Any:
        token = token if token != "" else self.token.encode()
        resources = resources if resources != "" else self.resources.encode()
        return self.dll.fmi3InstantiateCoSimulation(
            name, token, resources, False, False, event_mode, False, None, ctypes.c_size_t(0), None, self.log, None
        )

    def call(self, name: str, instance: Any, *arguments: Any) -> int:
        return int(getattr(self.dll, name)(ctypes.c_void_p(instance), *arguments))


def numbers(*values: int) -> Any:
    return (ctypes.c_uint32 * len(values))(*values)


def doubles(*values: float) -> Any:
    return (ctypes.c_double * len(values))(*values)


N = ctypes.c_size_t


@pytest.mark.parametrize("kind", ["eye", "controller"])
def test_every_function_is_there_and_refuses_null(kind: str, files: dict[str, Path], tmp_path: Path) -> None:
    raw = Raw(Part(files[kind], tmp_path / kind))
    assert raw.dll.fmi3GetVersion() == b"3.0"
    names = declared()
    assert len(names) == 75
    for junk in (None, 1, 0xDEADBEEF):
        for name in names:
            if name in ("fmi3GetVersion", "fmi3FreeInstance") or "Instantiate" in name:
                continue
            arguments = [ctypes.c_void_p(None)] * 11
            assert raw.call(name, junk, *arguments) == ERROR, name
        raw.dll.fmi3FreeInstance(ctypes.c_void_p(junk))
    for kind_of_fmu, count in (("ModelExchange", 7), ("ScheduledExecution", 10)):
        function = getattr(raw.dll, f"fmi3Instantiate{kind_of_fmu}")
        assert function(*[ctypes.c_void_p(None)] * count) is None


@pytest.mark.parametrize("kind", ["eye", "controller"])
def test_misuse_is_an_error_that_says_why(kind: str, files: dict[str, Path], tmp_path: Path) -> None:
    part = Part(files[kind], tmp_path / kind)
    raw = Raw(part)
    assert raw.instantiate(name=None) is None
    assert raw.instantiate(token=b"another") is None
    assert raw.instantiate(resources=b"/nowhere") is None
    assert raw.instantiate(event_mode=True) is None
    assert len(raw.said) == 4
    instance = raw.instantiate()
    assert instance
    fine = [ctypes.byref(ctypes.c_bool()) for _ in range(3)] + [ctypes.byref(ctypes.c_double())]
    time = ctypes.c_double

    def refused(expected: str, name: str, *arguments: Any) -> None:
        raw.said.clear()
        assert raw.call(name, instance, *arguments) == ERROR, name
        assert len(raw.said) == 1
        assert raw.said[0].startswith(f"{name}: ")
        assert expected in raw.said[0], raw.said

    def good(name: str, *arguments: Any) -> None:
        raw.said.clear()
        assert raw.call(name, instance, *arguments) == 0, raw.said

    output = next(one.valueReference for one in part.description.modelVariables if one.causality == "output")
    value = doubles(0.0)
    # Out of order.
    refused("out of order", "fmi3DoStep", time(0.0), time(part.period), False, *fine)
    refused("out of order", "fmi3ExitInitializationMode")
    refused("out of order", "fmi3Terminate")
    refused("before initialization", "fmi3GetFloat64", numbers(output), N(1), value, N(1))
    refused("no span", "fmi3EnterInitializationMode", False, time(0.0), time(math.nan), False, time(0.0))
    refused("no span", "fmi3EnterInitializationMode", False, time(0.0), time(1.0), True, time(0.0))
    refused("not supported", "fmi3EnterEventMode")
    refused("not supported", "fmi3EnterStepMode")
    good("fmi3EnterInitializationMode", False, time(0.0), time(0.0), False, time(0.0))
    refused("out of order", "fmi3EnterInitializationMode", False, time(0.0), time(0.0), False, time(0.0))
    # A parameter that the configuration refuses.
    key = "plant.noise_K" if kind == "eye" else "control.peak_reference_K"
    reference = part.variables[key].valueReference
    good("fmi3SetFloat64", numbers(reference), N(1), doubles(1e6), N(1))
    refused(key, "fmi3ExitInitializationMode")
    refused("a finite number", "fmi3SetFloat64", numbers(reference), N(1), doubles(math.nan), N(1))
    good("fmi3SetFloat64", numbers(reference), N(1), doubles(0.3 if kind == "eye" else 30.0), N(1))
    good("fmi3ExitInitializationMode")
    # References, counts, pointers.
    refused("unknown value reference", "fmi3GetFloat64", numbers(10_000), N(1), value, N(1))
    refused("unknown value reference", "fmi3SetFloat64", numbers(10_000), N(1), value, N(1))
    refused("another type", "fmi3GetBoolean", numbers(output), N(1), (ctypes.c_bool * 1)(), N(1))
    refused("no variable", "fmi3GetFloat32", numbers(output), N(1), value, N(1))
    refused("cannot be set", "fmi3SetFloat64", numbers(output), N(1), value, N(1))
    refused("cannot be set", "fmi3SetFloat64", numbers(reference), N(1), value, N(1))
    refused("null pointer", "fmi3GetFloat64", None, N(1), value, N(1))
    refused("null pointer", "fmi3GetFloat64", numbers(output), N(1), None, N(1))
    refused("null pointer", "fmi3GetFloat64", numbers(output), N(1), value, N(2))
    good("fmi3GetFloat64", None, N(0), None, N(0))
    good("fmi3GetFloat64", numbers(0, output), N(2), doubles(0.0, 0.0), N(2))
    # Steps.
    refused("step size", "fmi3DoStep", time(0.0), time(2.0 * part.period), False, *fine)
    refused("step size", "fmi3DoStep", time(0.0), time(0.5 * part.period), False, *fine)
    refused("step size", "fmi3DoStep", time(0.0), time(math.nan), False, *fine)
    refused("communication point", "fmi3DoStep", time(part.period), time(part.period), False, *fine)
    refused("null pointer", "fmi3DoStep", time(0.0), time(part.period), False, None, None, None, None)
    if kind == "eye":
        for power in (math.nan, math.inf, -0.01, 11.0):
            good("fmi3SetFloat64", numbers(part.variables["power"].valueReference), N(1), doubles(power), N(1))
            refused("power", "fmi3DoStep", time(0.0), time(part.period), False, *fine)
        good("fmi3SetFloat64", numbers(part.variables["power"].valueReference), N(1), doubles(0.02), N(1))
    good("fmi3DoStep", time(0.0), time(part.period), False, *fine)
    refused("communication point", "fmi3DoStep", time(0.0), time(part.period), False, *fine)
    # States of nobody.
    refused("not a saved state", "fmi3SetFMUState", None)
    refused("not a saved state", "fmi3SetFMUState", ctypes.c_void_p(0x1234))
    refused("not a saved state", "fmi3SerializedFMUStateSize", ctypes.c_void_p(0x1234), ctypes.byref(N()))
    refused("null pointer", "fmi3GetFMUState", None)
    good("fmi3FreeFMUState", ctypes.byref(ctypes.c_void_p(None)))
    state = ctypes.c_void_p(None)
    good("fmi3GetFMUState", ctypes.byref(state))
    good("fmi3GetFMUState", ctypes.byref(state))
    refused("null pointer", "fmi3SerializeFMUState", state, None, N(0))
    good("fmi3Terminate")
    refused("out of order", "fmi3DoStep", time(part.period), time(part.period), False, *fine)
    good("fmi3GetFloat64", numbers(output), N(1), value, N(1))
    good("fmi3SetFMUState", state)
    good("fmi3DoStep", time(part.period), time(part.period), False, *fine)
    good("fmi3Reset")
    # Freed: its handle is nobody's.
    raw.dll.fmi3FreeInstance(ctypes.c_void_p(instance))
    raw.dll.fmi3FreeInstance(ctypes.c_void_p(instance))
    assert raw.call("fmi3Reset", instance) == ERROR


def test_it_depends_on_libc_and_libm_alone(pair: tuple[Part, Part]) -> None:
    for part in pair:
        _, path = library(part)
        dynamic = subprocess.run(["readelf", "-d", path], check=True, capture_output=True, text=True).stdout
        needed = re.findall(r"\(NEEDED\).*\[(.*)\]", dynamic)
        assert needed
        for name in needed:
            assert re.fullmatch(r"lib[cm]\.so\.6|ld-linux.*", name), needed
        symbols = subprocess.run(
            ["nm", "-D", "--defined-only", path], check=True, capture_output=True, text=True
        ).stdout.split()
        assert sorted(symbols[2::3]) == sorted(declared())


def test_our_declarations_are_the_standards(tmp_path: Path) -> None:
    source = tmp_path / "both.c"
    source.write_text(
        '#define FMI3_Export extern\n#include "fmi3Functions.h"\n#define FMI3_TYPES_ARE_KNOWN\n#include "fmi3.h"\n'
    )
    folders = ["-I", str(HEADERS), "-I", str(ROOT / "src" / "fmu" / "c")]
    subprocess.run(["gcc", "-std=c11", "-Werror", "-fsyntax-only", *folders, str(source)], check=True)
    ours = (ROOT / "src" / "fmu" / "c" / "fmi3.h").read_text()
    values = tmp_path / "values.c"
    names = re.findall(r"\bfmi3[A-Z]\w+", "".join(re.findall(r"typedef enum \{(.*?)\}", ours, re.DOTALL)))
    assert len(names) == 14
    for folder in (HEADERS, ROOT / "src" / "fmu" / "c"):
        header = "fmi3Functions.h" if folder == HEADERS else "fmi3.h"
        order = ",".join(f"[{name}]=1" for name in names[:5])
        values.write_text(
            f'#define FMI3_Export extern\n#include "{header}"\nchar checked[] = {{{order}}};\n'
            "_Static_assert(fmi3OK == 0 && fmi3Error == 3 && fmi3Fatal == 4 && fmi3Dependent == 5 && "
            'fmi3IntervalChanged == 2 && sizeof checked == 5, "");\n'
        )
        subprocess.run(["gcc", "-std=c11", "-Werror", "-fsyntax-only", "-I", str(folder), str(values)], check=True)


def compiled(part_file: Path, folder: Path) -> Part:
    """A source FMU with the library that its buildDescription.xml describes."""
    part = fmpy.read_model_description(str(part_file))
    fmpy.extract(str(part_file), str(folder))
    (files,) = part.buildConfigurations[0].sourceFileSets
    assert files.language == "C99"
    binaries = folder / "binaries" / fmpy.platform_tuple
    binaries.mkdir(parents=True)
    strict = ["-std=c99", "-O2", "-ffp-contract=off", "-Wall", "-Wextra", "-Wpedantic", "-Werror"]
    link = ["-fPIC", "-shared", "-Wl,-z,defs", "-o", str(binaries / f"{part.coSimulation.modelIdentifier}.so")]
    subprocess.run(["gcc", *strict, *link, *files.sourceFiles, "-lm"], check=True, cwd=folder / "sources")
    return Part(part_file, folder)


@pytest.fixture(scope="module")
def source(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("source")
    return export("controller", folder / "c.fmu", "", {"control.horizon": "10"}, "--source")


def test_the_source_fmu_compiles_and_treats_as_simulate_does(source: Path, tmp_path: Path) -> None:
    assert validate_fmu(str(source)) == []
    settings = {"control.horizon": "10", "safety.supervisor": "off"}
    rows = simulated(tmp_path / "run", "", settings)
    eye = Part(export("eye", tmp_path / "eye.fmu"), tmp_path / "eye")
    controller = compiled(source, tmp_path / "c")
    eye.begin()
    controller.begin()
    for row, power in zip(rows, powers(eye, controller, len(rows)), strict=True):
        assert power == pytest.approx(float(row["power_W"]), abs=1e-12)
        if row is rows[100]:  # there and back, through bytes
            state = controller.fmu.getFMUState()
            data = controller.fmu.serializeFMUState(state)
            controller.fmu.freeFMUState(state)
            controller.fmu.reset()
            controller.fmu.setFMUState(controller.fmu.deserializeFMUState(data))
            with pytest.raises(Exception, match="Deserialize"):
                controller.fmu.deserializeFMUState(b"x" + data[1:])
    controller.end()


def test_the_source_fmu_refuses_misuse(source: Path, tmp_path: Path) -> None:
    part = compiled(source, tmp_path / "c")
    raw = Raw(part)
    for name in declared():
        if name in ("fmi3GetVersion", "fmi3FreeInstance") or "Instantiate" in name:
            continue
        assert raw.call(name, None, *[ctypes.c_void_p(None)] * 11) == ERROR, name
    assert raw.instantiate(name=None) is None
    assert raw.instantiate(token=b"another") is None
    assert raw.instantiate(event_mode=True) is None
    instance = raw.instantiate()
    assert instance
    raw.said.clear()
    time, fine = ctypes.c_double, [ctypes.byref(ctypes.c_bool()) for _ in range(3)] + [ctypes.byref(ctypes.c_double())]
    step = ("fmi3DoStep", instance, time(0.0), time(part.period), False)
    output = numbers(part.variables["power"].valueReference)
    bad = [
        ("fmi3ExitInitializationMode", instance),
        (*step, *fine),
        ("fmi3GetFloat64", instance, output, N(1), doubles(0.0), N(1)),
        ("fmi3EnterInitializationMode", instance, False, time(0.0), time(math.nan), False, time(0.0)),
    ]
    late = [
        ("fmi3GetFloat64", instance, numbers(10_000), N(1), doubles(0.0), N(1)),
        ("fmi3GetInt64", instance, output, N(1), doubles(0.0), N(1)),
        ("fmi3GetFloat64", instance, None, N(1), doubles(0.0), N(1)),
        ("fmi3GetFloat64", instance, output, N(1), doubles(0.0), N(2)),
        ("fmi3SetFloat64", instance, output, N(1), doubles(0.0), N(1)),
        (*step[:3], time(2.0 * part.period), False, *fine),
        (*step[:2], time(1.0), *step[3:], *fine),
        (*step, None, None, None, None),
        ("fmi3SetFMUState", instance, ctypes.c_void_p(0x1234)),
        ("fmi3FreeFMUState", instance, ctypes.byref(ctypes.c_void_p(0x1234))),
        ("fmi3GetFMUState", instance, ctypes.byref(ctypes.c_void_p(0x1234))),
    ]
    for call_ in bad:
        assert raw.call(*call_) == ERROR, call_
    assert raw.call("fmi3EnterInitializationMode", instance, False, time(0.0), time(0.0), False, time(0.0)) == 0
    assert raw.call("fmi3ExitInitializationMode", instance) == 0
    for call_ in late:
        assert raw.call(*call_) == ERROR, call_
    assert len(raw.said) == len(bad) + len(late)
    assert raw.call(*step, *fine) == 0
    assert raw.call("fmi3SetFloat64", instance, numbers(1), N(1), doubles(math.nan), N(1)) == 0
    assert raw.call("fmi3DoStep", instance, time(part.period), time(part.period), False, *fine) == 0
    raw.dll.fmi3FreeInstance(ctypes.c_void_p(instance))


def test_the_eye_has_no_sources(tmp_path: Path) -> None:
    done = call("export-fmu", "eye", "--source", "--out", str(tmp_path / "x.fmu"))
    assert done.returncode == 2
    assert "--source" in done.stderr
    done = call("export-fmu", "controller", "--source", "--set", "estimator.kind=mhe", "--out", str(tmp_path / "x.fmu"))
    assert done.returncode == 2
    assert "estimator.kind" in done.stderr


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
