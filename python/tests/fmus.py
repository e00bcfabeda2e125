"""FMUs as the tests use them: exported, through FMPy, and with raw calls. Not a test."""

from __future__ import annotations

import csv
import ctypes
import os
import re
import subprocess
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

try:
    import fmpy
    from fmpy.fmi3 import FMU3Slave
except ImportError as error:
    fmpy, MISSING = None, str(error)
else:
    MISSING = ""

ROOT = Path(__file__).resolve().parents[2]
PROGRAM = os.environ.get("PHOTOCOAG_PROGRAM", "photocoag")
HEADERS = Path() if fmpy is None else Path(fmpy.__file__).parent / "c-code"
ERROR = 3  # fmi3Error

Settings = dict[str, str]


@pytest.fixture(autouse=True, scope="session")
def instrument() -> None:
    """77: skipped, as tests/CMakeLists.txt says."""
    if MISSING:
        pytest.exit(f"no FMPy: {MISSING}", returncode=77)


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
        # FMI 2.0 knows no fixed step but the experiment's.
        self.period = float(self.description.coSimulation.fixedInternalStepSize or self.description.defaultExperiment.stepSize)
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


@pytest.fixture(scope="module")
def files(tmp_path_factory: pytest.TempPathFactory) -> dict[str, Path]:
    folder = tmp_path_factory.mktemp("fmu")
    return {kind: export(kind, folder / f"{kind}.fmu") for kind in ("eye", "controller")}


@pytest.fixture
def pair(files: dict[str, Path], tmp_path: Path) -> tuple[Part, Part]:
    return Part(files["eye"], tmp_path / "eye"), Part(files["controller"], tmp_path / "controller")


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
