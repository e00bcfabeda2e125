"""The exported controller as a MEX function in Octave: the powers of simulate, and misuse is an error."""

import csv
import os
import shutil
import subprocess

import pytest

from conftest import ROOT

MAY_SKIP = os.environ.get("PHOTOCOAG_OCTAVE") != "required"
HERE = all(shutil.which(tool) for tool in ("octave-cli", "mkoctfile"))
pytestmark = pytest.mark.skipif(MAY_SKIP and not HERE, reason="no Octave that compiles (octave, octave-dev)")

# Powers agree to the bit or differ by roundings in the order of sums: export-c's bar.
BAR_W = 1e-12

CASES = {
    "default": {},
    "N = 10 near the limit": {"control.horizon": "10", "control.peak_reference_K": "31.5"},
    "delayed weight, penalties": {
        "control.state_weight": "delayed", "control.power_weight": "50", "control.power_change_weight": "1000",
    },
    "a missing sample": {
        "plant.zero_power_sample": "missing", "plant.absorption_factor": "2", "control.peak_reference_K": "10",
        "control.peak_max_K": "12",
    },
}


def octave(folder, code):
    done = subprocess.run(
        ["octave-cli", "--quiet", "--no-init-file", "--norc", "--eval", f"addpath('{ROOT / 'matlab'}'); {code}"],
        cwd=folder, capture_output=True, text=True, check=False,
    )
    assert done.returncode == 0, done.stderr
    return done.stdout


def built(program, folder, settings, *more):
    options = [part for key, value in settings.items() for part in ("--set", f"{key}={value}")]
    program("export-c", *options, *more, "--out", str(folder / "controller"))
    octave(folder, "photocoag_build('controller');")
    return options


@pytest.fixture(scope="module")
def folder(program, tmp_path_factory):
    made = tmp_path_factory.mktemp("mex")
    built(program, made, {})
    return made


def replayed(folder, rows):
    """Powers, estimates and counts of every period, from the samples and powers of a run."""
    columns = "\n".join(f"{row['volume_measured_K'] or 'NaN'} {row['power_W']}" for row in rows)
    (folder / "inputs.txt").write_text(columns + "\n")
    printed = octave(
        folder,
        "x = load('inputs.txt'); [c, power] = photocoag_controller('new'); printf('%.17g 0 0\\n', power);"
        "for k = 1:rows(x) - 1, y = x(k, 1); if isnan(y), y = []; end;"
        "[power, d] = photocoag_controller('step', c, y, x(k, 2));"
        "printf('%.17g %.17g %d\\n', power, d.peak_K, d.solver_iterations); end",
    )
    return [tuple(float(one) for one in line.split()) for line in printed.splitlines()]


@pytest.mark.parametrize("name", list(CASES))
def test_powers_are_those_of_simulate(name, program, tmp_path):
    options = built(program, tmp_path, CASES[name])
    more = ["--set", "safety.supervisor=off"]
    program("simulate", *options, *more, "--out", str(tmp_path / "run"))
    with (tmp_path / "run/run.csv").open() as file:
        rows = list(csv.DictReader(file))
    ours = replayed(tmp_path, rows)
    assert len(ours) == len(rows) >= 250
    differences = [abs(power - float(row["power_W"])) for (power, _, _), row in zip(ours, rows)]
    assert name != "a missing sample" or any(row["volume_measured_K"] == "" for row in rows)
    print(f"{name}: {sum(d == 0.0 for d in differences)} of {len(rows)} bit for bit, at most {max(differences):.1e} W")
    assert max(differences) <= BAR_W
    assert len({power for power, _, _ in ours}) > len(rows) // 2
    for (_, peak, changes), before, row in zip(ours[1:], rows, rows[1:]):
        assert peak == pytest.approx(float(before["peak_estimate_K"]), abs=1e-9)
        assert changes == float(row["solver_iterations"])


def test_single_precision_builds_and_treats(program, tmp_path):
    built(program, tmp_path, {}, "--float")
    printed = octave(tmp_path, "a = photocoag_controller('about'); disp(a.precision); [c, p] = photocoag_controller('new');"
                     "printf('%.9g', p);").split()
    assert printed[0] == "single" and 0.0 < float(printed[1]) <= 0.1 + 1e-7


def test_two_controllers_share_nothing(folder):
    printed = octave(
        folder,
        "a = photocoag_controller('new'); b = photocoag_controller('new'); c = photocoag_controller('new');"
        "for k = 1:40, p = photocoag_controller('step', a, 0.2 * k, 0.05); photocoag_controller('step', b, 40, 0.1);"
        "q = photocoag_controller('step', c, 0.2 * k, 0.05); printf('%d ', p == q); end; printf('\\n%d', p);",
    ).split()
    assert printed[:40] == ["1"] * 40 and printed[40] != "0"


def test_no_number_is_no_power(folder):
    for sample, power in (("NaN", "0.05"), ("Inf", "0.05"), ("5", "NaN"), ("5", "-Inf")):
        printed = octave(folder, "c = photocoag_controller('new');"
                         f"[p, d] = photocoag_controller('step', c, {sample}, {power}); printf('%g %s', p, d.status);")
        assert printed == "0 bad_input", (sample, power)
    printed = octave(folder, "c = photocoag_controller('new'); photocoag_controller('step', c, 1, 0.1);"
                     "[p, d] = photocoag_controller('step', c, [], 0.05); printf('%g %s', p, d.sample);").split()
    assert float(printed[0]) > 0.0 and printed[1] == "none"


MISUSE = [
    "photocoag_controller()", "photocoag_controller(1)", "photocoag_controller('steps')", "photocoag_controller('')",
    "photocoag_controller(['step'; 'step'])", "photocoag_controller(repmat('a', 1, 1e6))", "photocoag_controller('step')",
    "photocoag_controller('step', c)", "photocoag_controller('step', c, 1)", "photocoag_controller('step', c, 1, 2, 3)",
    "photocoag_controller('step', c, 'a', 0.1)", "photocoag_controller('step', c, [1 2], 0.1)",
    "photocoag_controller('step', c, 1, [])", "photocoag_controller('step', c, 1i, 0.1)",
    "photocoag_controller('step', c, {1}, 0.1)", "photocoag_controller('step', c, 1, struct())",
    "photocoag_controller('step', c, single(1), 0.1)", "photocoag_controller('step', c, sparse(1), 0.1)",
    "photocoag_controller('step', 0, 1, 0.1)", "photocoag_controller('step', NaN, 1, 0.1)",
    "photocoag_controller('step', -1, 1, 0.1)", "photocoag_controller('step', 1e300, 1, 0.1)",
    "photocoag_controller('step', c + 0.5, 1, 0.1)", "photocoag_controller('step', c, {}, 0.1)",
    "photocoag_controller('free', gone)", "photocoag_controller('step', gone, 1, 0.1)", "x = photocoag_controller('free', c)",
    "[a, b] = photocoag_controller('about')", "for k = 1:64, photocoag_controller('new'); end",
]


def test_wrong_arguments_are_errors_and_change_nothing(folder):
    tried = "".join(f"try, {call}; disp('taken'); catch e, disp(e.identifier); end;" for call in MISUSE)
    printed = octave(
        folder,
        "gone = photocoag_controller('new'); photocoag_controller('free', gone); c = photocoag_controller('new');"
        "d = photocoag_controller('new');" + tried +
        "printf('%d', photocoag_controller('step', c, 1, 0.1) == photocoag_controller('step', d, 1, 0.1));",
    ).split()
    assert printed == ["photocoag:controller"] * len(MISUSE) + ["1"]


def test_without_a_build_it_says_what_to_do(program, tmp_path):
    code = "try, {}; catch e, disp(e.identifier); end"
    assert octave(tmp_path, code.format("photocoag_controller('new')")).strip() == "photocoag:not_built"
    assert octave(tmp_path, code.format("photocoag_build('nowhere')")).strip() == "photocoag:folder"


def test_a_step_is_measured(folder):
    """Reported, not judged: microseconds of processor time a step."""
    printed = octave(
        folder,
        "c = photocoag_controller('new'); p = 0.05; for k = 1:1000, p = photocoag_controller('step', c, 20, p); end;"
        "t = cputime; for k = 1:20000, p = photocoag_controller('step', c, 20, p); end; printf('%g', (cputime - t) / 20e-3);",
    )
    print(f"{float(printed):.1f} us a step in Octave")
    assert 0.0 < float(printed) * 1e-6
