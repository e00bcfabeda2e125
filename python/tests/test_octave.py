"""MATLAB and Octave: runs and models, read as docs/matlab.md says, with the numbers of Python."""

import os
import re
import shutil
import subprocess

import numpy as np
import pytest

import photocoag as pc

from conftest import ROOT

# Continuous integration installs it: there nothing is skipped.
MAY_SKIP = os.environ.get("PHOTOCOAG_OCTAVE") != "required"
pytestmark = pytest.mark.skipif(MAY_SKIP and shutil.which("octave-cli") is None, reason="no Octave (octave, octave-control)")


@pytest.fixture(scope="module")
def folder(program, tmp_path_factory):
    """The first notebook's treatment and the model it was treated with."""
    made = tmp_path_factory.mktemp("octave")
    program("simulate", "--set", "plant.absorption_factor=0.5", "--seed", "7", "--out", str(made / "run"))
    program("convert", str(made / "run"), "--mat", str(made / "first.mat"), "--hdf5", str(made / "first.h5"))
    program("reduce", "--out", str(made / "first.json"))
    program("export-c", "--out", str(made / "controller"))
    (made / "matlab").symlink_to(ROOT / "matlab")
    return made


@pytest.fixture(scope="module")
def run():
    return pc.simulate(pc.Config().set("plant.absorption_factor", 0.5), seed=7)


@pytest.fixture(scope="module")
def model():
    return pc.reduce(pc.Config())


@pytest.fixture
def octave(folder):
    def call(code):
        """What `code` prints."""
        done = subprocess.run(
            ["octave-cli", "--quiet", "--no-init-file", "--norc", "--eval", f"addpath('matlab'); {code}"],
            cwd=folder, capture_output=True, text=True, check=False,
        )
        assert done.returncode == 0, done.stderr
        return done.stdout

    return call


def numbers(text):
    return np.array([float(one) for one in text.split()])


def test_every_column_of_a_mat_file(octave, run):
    printed = octave(
        "r = load('first.mat'); for n = fieldnames(r.cycles)', v = r.cycles.(n{1}); printf('%s|%s|', n{1}, r.units.(n{1}));"
        "if isnumeric(v), printf(' %.17g', v); end, printf('\\n'); end"
    )
    rows = [line.split("|") for line in printed.splitlines()]
    assert {name for name, _, _ in rows} == set(run.cycles.dtype.names)
    compared = 0
    for name, unit, values in rows:
        assert unit == run.units[name], name
        if run.cycles[name].dtype.kind in "fiu":
            assert np.array_equal(numbers(values), run.cycles[name].astype(float), equal_nan=True), name
            compared += 1
    assert compared >= 13


def test_an_hdf5_file_with_its_words(octave, run):
    power = numbers(octave("r = load('first.h5'); printf('%.17g\\n', r.cycles.power_W);"))
    assert (power == run.cycles["power_W"]).all()
    printed = octave("r = load('first.h5'); t = r.cycles.safety_reason; if size(t, 1) ~= 250, t = t'; end;"
                     "printf('%s\\n', cellstr(t){:});").splitlines()
    words = [line.strip(" \0") for line in printed]
    assert words == list(run.cycles["safety_reason"]) and len(set(words)) > 1


def test_matrices_are_those_of_python(octave, model):
    fields = {"A": lambda _: model.A, "A_d": lambda _: model.A_d, "B": model.B, "B_d": model.B_d,
              "C": lambda alpha: np.vstack([model.C_volume(alpha), model.C_peak])}
    for alpha in (0.35, 0.5, 1.1, 1.5):
        code = "".join(f"printf(' %.17g', m.{name}.'); printf('\\n');" for name in fields)
        for name, line in zip(fields, octave(f"m = photocoag_model('first.json', {alpha}); {code}").splitlines()):
            ours = fields[name](alpha)
            assert np.allclose(numbers(line), np.ravel(ours), rtol=1e-9, atol=1e-12 * np.abs(ours).max()), name


def test_ss_of_the_control_package(octave, model):
    """Static gains of `ss`, and a step response at ten periods."""
    if MAY_SKIP and "control" not in octave("p = pkg('list'); for k = 1:numel(p), disp(p{k}.name); end"):
        pytest.skip("no octave-control")
    printed = octave(
        "pkg load control; m = photocoag_model('first.json', 0.5); s = m.ss; disp(isa(s, 'ss')); "
        "y = s.outputname; u = s.inputname; printf('%s\\n', y{:}, u{:}); printf('%.12g\\n', dcgain(s)); y = step(s, 0:0.001:0.01); printf('%.12g\\n', y(11, :));"
    ).split()
    assert printed[:4] == ["1", "volume_K", "peak_K", "power_W"]
    values = np.array([float(one) for one in printed[4:]])
    c = np.vstack([model.C_volume(0.5), model.C_peak])
    assert np.allclose(values[:2], -c @ np.linalg.solve(model.A, model.B(0.5)), rtol=1e-8)
    x = np.zeros(model.order)
    for _ in range(10):
        x = model.A_d @ x + model.B_d(0.5)
    assert np.allclose(values[2:], c @ x, rtol=1e-6)


def test_the_first_treatment_has_pythons_numbers(octave, run, model):
    printed = octave("first_treatment('first.mat', 'first.json')")
    assert re.search(r"^250 cycles", printed) and "power_W in W" in printed
    peak, distance = (float(one) for one in re.findall(r"([0-9.]+) K", printed))
    assert peak == pytest.approx(run.summary["peak_true_max_K"], abs=0.005)
    alpha = run.cycles["absorption_estimate"][-1]
    x, peaks = np.zeros(model.order), []
    for power in run.cycles["power_W"]:
        x = model.A_d @ x + model.B_d(alpha) * power
        peaks.append(model.C_peak @ x)
    assert distance == pytest.approx(abs(np.array(peaks) - run.cycles["peak_true_K"]).max(), abs=0.005)


def test_the_documents_blocks_run(octave, run, model):
    blocks = re.findall(r"```matlab\n(.*?)```", (ROOT / "docs/matlab.md").read_text(), re.S)
    if MAY_SKIP and shutil.which("mkoctfile") is None:  # test_mex skips, too
        blocks = [block for block in blocks if "photocoag_controller" not in block and "closed_loop" not in block]
    printed = octave("\n".join(  # all but the picture
        "\n".join(line for line in block.splitlines() if not line.startswith("plot(")) for block in blocks))
    assert f"highest peak {run.summary['peak_true_max_K']:.2f} K" in printed
    gain = -model.C_peak @ np.linalg.solve(model.A, model.B(0.5))
    assert f"{gain:.0f} K per watt in the end, steps of 1 ms" in printed
    if "photocoag_controller" in "".join(blocks):
        assert re.search(r"^0\.\d+ W, estimated peak \d+\.\d+ K$", printed, re.M)
        peak, alpha = re.search(r"250 periods, peak at most ([0-9.]+) K, estimated absorption factor ([0-9.]+)", printed).groups()
        assert 29.0 < float(peak) < 33.0 and 1.0 < float(alpha) < 1.2


def test_damaged_and_foreign_files_are_refused(octave, folder):
    (folder / "other.json").write_text('{"format": "something else", "version": 1}')
    for call in ("photocoag_model('other.json', 1)", "photocoag_model('first.json', -1)"):
        assert "refused photocoag:" in octave(f"try, {call}; catch e, disp(['refused ' e.identifier]); end")
