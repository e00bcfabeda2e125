"""Code blocks of the documents: every one is run, compiled or read by something."""

import re
import subprocess
import sys
import tomllib

import pytest

import photocoag as pc

from conftest import ROOT

DOCUMENTS = [*ROOT.glob("*.md"), *(ROOT / "docs").rglob("*.md"), *(ROOT / "benchmarks").rglob("*.md"), *(ROOT / "tests").rglob("*.md")]
FENCE = re.compile(r"^```([^\n]*)\n(.*?)^```$", re.M | re.S)

def blocks(language, document=None):
    files = DOCUMENTS if document is None else [ROOT / document]
    return [(str(file.relative_to(ROOT)), code) for file in files for kind, code in FENCE.findall(file.read_text()) if kind == language]


def test_each_language_has_its_test():
    """sh: DocumentedCommands, DocumentFigures. text: DocumentFigures where it is what a command prints. math, directives: ./photocoag docs."""
    known = {"sh", "text", "math", "toml", "python", "c", "cpp", "cmake", "matlab", "bibtex"}
    found = {kind for file in DOCUMENTS for kind, _ in FENCE.findall(file.read_text()) if not kind.startswith("{")}
    assert found <= known, f"no test for code blocks in {found - known}"


def test_every_python_block_is_run_somewhere():
    """README and python.md: test_package. realtime.md: DocumentedPython and here. model-file.md: tests/rom. The others: here, test_console."""
    files = {document for document, _ in blocks("python")}
    assert files == {"README.md", *(f"docs/{name}.md" for name in ("python", "realtime", "model-file", "studies", "console"))}


@pytest.mark.parametrize(("document", "code"), blocks("sh"), ids=lambda value: value[:24])
def test_shell_blocks_are_shell(document, code):
    done = subprocess.run(["bash", "-n"], input=code, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr


@pytest.mark.parametrize(("document", "code"), blocks("toml"), ids=lambda value: value[:24])
def test_toml_blocks_are_what_the_program_reads(document, code, program, tmp_path):
    if "curve" in tomllib.loads(code):
        (tmp_path / "curve.toml").write_text(code)
        program("treat", "--device", "eye", "--set", f"photoacoustics.calibration={tmp_path / 'curve.toml'}", "--set",
                "run.duration_ms=10", "--set", "grid.min_cells=2000", "--out", str(tmp_path / "run"))
        assert str(tmp_path / "curve.toml") in (tmp_path / "run/config.toml").read_text()
    else:
        pc.Config.from_toml(code)


def test_the_consoles_block_is_the_tested_example():
    (_, code), = blocks("python", "docs/console.md")
    assert code in (ROOT / "examples/console/watch.py").read_text()


def run(code, *arguments, folder):
    done = subprocess.run([sys.executable, "-c", code, *arguments], capture_output=True, text=True, check=False, cwd=folder)
    assert done.returncode == 0, done.stderr
    return done.stdout


def test_a_campaigns_table_in_h5py(program, tmp_path):
    (_, code), = blocks("python", "docs/studies.md")
    (tmp_path / "campaign.toml").write_text(
        'spots = 3\nset = ["run.duration_ms=20", "grid.min_cells=2000"]\n[[input]]\nkey = "plant.absorption_factor"\n'
        'distribution = "uniform"\nlow = 0.5\nhigh = 1.5\n')
    (tmp_path / "runs").mkdir()
    program("campaign", str(tmp_path / "campaign.toml"), "--out", str(tmp_path / "runs/demo"))
    assert run(code, folder=tmp_path).split()[1] == "K"


def test_the_realtime_documents_blocks(program, tmp_path):
    log, table = (code for _, code in blocks("python", "docs/realtime.md"))
    program("treat", "--out", str(tmp_path / "runs/first"), "--set", "grid.min_cells=2000", "--set", "run.duration_ms=50")
    program("convert", str(tmp_path / "runs/first"), "--hdf5", str(tmp_path / "first.h5"))
    assert run(log, folder=tmp_path).startswith("50 cycles, first power ")
    assert run(table, folder=tmp_path) == "50 cycles, powers in W\n"


def test_the_c_block_compiles_with_the_exported_controller(program, tmp_path):
    (_, code), = blocks("c")
    program("export-c", "--out", str(tmp_path / "controller"))
    header = next((tmp_path / "controller").rglob("pc_controller.h"))
    (tmp_path / "main.c").write_text(
        '#include "pc_controller.h"\nvoid laser_write(pc_real);\nvoid timer_acknowledge(void);\npc_real volume_temperature(void);\n'
        f"pc_real laser_mean_power(void);\nvoid setup(void);\nvoid TIM2_IRQHandler(void);\n{code}")
    compile_("cc", "-std=c99", "-I", str(header.parent), str(tmp_path / "main.c"))


def test_the_cpp_blocks_compile(tmp_path):
    includes, bodies = set(), []
    for _, code in blocks("cpp"):
        includes |= set(re.findall(r"^#include .*$", code, re.M))
        bodies.append("{\n" + re.sub(r"^#include .*$", "", code, flags=re.M) + "}\n")
    (tmp_path / "main.cpp").write_text(
        "#include <span>\n#include \"photocoag/loop/controller.hpp\"\n#include \"photocoag/loop/treatment_loop.hpp\"\n"
        "#include \"photocoag/safety/supervisor.hpp\"\n" + "\n".join(sorted(includes)) +
        "\nvoid use(photocoag::Controller& controller, photocoag::Supervisor& supervisor,"
        " std::span<photocoag::CycleRecord> records) {\n" + "".join(bodies) + "}\n")
    compile_("c++", "-std=c++20", "-DEIGEN_MAX_STATIC_ALIGN_BYTES=16", "-DEIGEN_MAX_ALIGN_BYTES=64",
             "-DEIGEN_MALLOC_ALREADY_ALIGNED=0", "-I", str(ROOT / "src"), "-isystem", "/usr/include/eigen3", str(tmp_path / "main.cpp"))


def compile_(compiler, *arguments):
    done = subprocess.run([compiler, "-fsyntax-only", "-Wall", "-Wno-unused-variable", "-Werror", *arguments],
                          capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr[:3000]


def test_cmake_blocks_name_installed_libraries():
    """And the C++ reference has a page for each, of all that are installed."""
    installed = set(re.findall(r"photocoag_component\((photocoag_\w+) LINK", (ROOT / "CMakeLists.txt").read_text()))
    assert len(installed) >= 6
    pages = [(file.name, *FENCE.findall(file.read_text())) for file in (ROOT / "docs/site/cpp").glob("*.md")]
    named = [(set(re.findall(r"photocoag::(photocoag_\w+)", cmake[1])), headers) for _, cmake, headers in pages]
    assert all(headers == ("{headers} " + next(iter(names)), "") for names, headers in named)
    assert set().union(*(names for names, _ in named)) == installed


def test_the_citation_is_of_this_version():
    (_, code), = blocks("bibtex")
    citation = (ROOT / "CITATION.cff").read_text()
    assert re.search(r"^version: (\S+)$", citation, re.M)[1] == re.search(r"version = \{(\S+)\}", code)[1] == pc.__version__
    assert re.search(r'^title: "(.+)"$', citation, re.M)[1] in code
    for name in re.findall(r"family-names: (\w+)", citation):
        assert name.replace("ü", '{\\"u}') in code
