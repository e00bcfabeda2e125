"""The exported controller beside simulate, as the documents' figures show it: C of both precisions, MEX in Octave."""

import re
import subprocess
import sys

import pytest

import test_mex
from conftest import ROOT

EXAMPLE = [sys.executable, str(ROOT / "examples/embed/beside.py")]
FOUND = re.compile(r"^(.*): (\d+) of 250 powers bit for bit, the others within (\S+) W$", re.M)


@pytest.fixture(scope="module")
def folder(program, tmp_path_factory):
    made = tmp_path_factory.mktemp("beside")
    program("simulate", "--set", "safety.supervisor=off", "--out", str(made / "run"))
    program("export-c", "--out", str(made / "double"))
    program("export-c", "--float", "--out", str(made / "single"))
    return made


def beside(folder, *options):
    """Of each name: how many powers are equal to the bit, and how far the others are off."""
    figure = folder / "figure.svg"
    done = subprocess.run(
        [*EXAMPLE, str(folder / "run"), *options, "--figure", str(figure)], capture_output=True, text=True, check=False
    )
    assert done.returncode == 0, done.stderr
    assert "</svg>" in figure.read_text()
    return {name: (int(equal), float(off)) for name, equal, off in FOUND.findall(done.stdout)}


def test_the_documents_figures_of_c(folder):
    found = beside(folder, "--c", str(folder / "double"), "--c", str(folder / "single"))
    said = (ROOT / "docs/embedding-c.md").read_text()
    off, single = map(float, re.search(r"powers are equal.*?within (\S+) W.*?within (\S+) W", said, re.S).groups())
    # Sums of another order: on another processor the last digits may differ, not by much.
    assert off / 3 < found["C, double precision"][1] < 3 * off < 1e-12
    assert single / 3 < found["C, single precision"][1] < 3 * single < 1e-5


def test_another_run_is_seen_to_differ(folder, program):
    program("export-c", "--set", "control.peak_reference_K=29", "--out", str(folder / "other"))
    ((equal, off),) = beside(folder, "--c", str(folder / "other")).values()
    assert equal < 250
    assert off > 1e-4


@pytest.mark.skipif(test_mex.MAY_SKIP and not test_mex.HERE, reason="no Octave that compiles (octave, octave-dev)")
def test_the_documents_figure_of_octave(folder):
    found = beside(folder, "--c", str(folder / "double"), "--octave", str(folder / "double"))
    assert found["MEX function in Octave, double precision"][1] <= 1e-12
