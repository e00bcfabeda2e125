"""The C functions of the FMUs: all there, as the standard declares them; misuse is an error; sources compile."""

from __future__ import annotations

import ctypes
import math
import re
import subprocess
from pathlib import Path
from typing import Any

import pytest

from fmus import (
    ERROR, HEADERS, MISSING, ROOT, N, Part, Raw, call, declared, doubles, export, files, instrument, library, numbers, pair,
    powers, simulated,
)

if not MISSING:
    import fmpy
    from fmpy.validation import validate_fmu

__all__ = ["files", "instrument", "pair"]  # fixtures


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
        assert sorted(name for name in symbols[2::3] if name.startswith("fmi3")) == sorted(declared())
        assert all(name.startswith(("fmi2", "fmi3")) for name in symbols[2::3])


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


@pytest.mark.parametrize("config", ["", "configs/uncertain-eye.toml"], ids=["default", "chance"])
def test_the_source_fmu_compiles_and_treats_as_simulate_does(config: str, tmp_path: Path) -> None:
    settings = {"control.horizon": "10"}
    source = export("controller", tmp_path / "c.fmu", config, settings, "--source")
    assert validate_fmu(str(source)) == []
    rows = simulated(tmp_path / "run", config, {**settings, "safety.supervisor": "off"})
    eye = Part(export("eye", tmp_path / "eye.fmu", config), tmp_path / "eye")
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
