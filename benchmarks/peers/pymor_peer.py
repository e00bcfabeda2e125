"""pyMOR against `photocoag reduce`: order 6 from the same matrices, time and error side by side.

Started by run.sh, which exports the matrices. Both sides are judged by the same outputs of the full-order model
(validation.csv: constant and on/off power, 400 ms, alphas that nobody trained on). pyMOR's models get the exact input
and output of every validation alpha, projected; photocoag's pay for their DEIM. Times: pyMOR from loaded matrices to
reduced bases; photocoag the whole process, with making the model, measuring its error and the certificate.
"""
import argparse
import csv
import json
import pathlib
import subprocess
import time

import numpy as np
import scipy.io
import scipy.linalg
import scipy.sparse
from pymor.algorithms.pod import pod
from pymor.algorithms.timestepping import ImplicitEulerTimeStepper
from pymor.core.defaults import set_defaults
from pymor.core.logger import set_log_levels
from pymor.models.iosys import LTIModel
from pymor.reductors.bt import BTReductor
from pymor.solvers.matrix_equations.adi import ADILyapunovSolver
from pymor.solvers.matrix_equations.default import MatrixEquationSolvers

ORDER = 6


def read_validation(path):
    """Per signal: powers, and outputs as steps x (peaks of all alphas, volumes of all alphas)."""
    with open(path, newline="") as file:
        rows = list(csv.reader(file))
    signals = {}
    for row in rows[1:]:
        signals.setdefault(row[0], []).append([float(v) for v in row[1:]])
    arrays = {name: np.array(values) for name, values in signals.items()}
    return {name: (a[:, 1], a[:, 2:]) for name, a in arrays.items()}, arrays["constant"][0, 0]


def model_of(matrices, columns, gains):
    """LTIModel of some alphas. Every output is scaled to a gain of 1, all volume temperatures together count as much as
    the peak, as in photocoag's own balanced truncation. E becomes the identity by its square root."""
    root = np.sqrt(matrices["E"].diagonal())
    scale = scipy.sparse.diags(1.0 / root)
    a = (scale @ matrices["A"] @ scale).tocsc()
    b = (scale @ matrices["B"][:, columns]).toarray() / gains[0]
    rows = [0] + [1 + k for k in columns]
    c = (matrices["C"][rows] @ scale).toarray()
    c[1:] /= np.sqrt(len(columns)) * (gains[1] / gains[0])[:, None]
    return LTIModel.from_matrices(a, b, c), root


def balanced_truncation(matrices, columns, gains, solver):
    fom, root = model_of(matrices, columns, gains)
    fom = fom.with_(matrix_equation_solvers=MatrixEquationSolvers(lyapunov_lr=solver))
    reductor = BTReductor(fom)
    reductor.reduce(ORDER)
    return reductor.V.to_numpy() / root[:, None], reductor.W.to_numpy() / root[:, None]


def proper_orthogonal_decomposition(matrices, columns, gains, period, steps):
    fom, root = model_of(matrices, columns, gains)
    fom = fom.with_(T=steps * period, time_stepper=ImplicitEulerTimeStepper(nt=steps))
    snapshots = fom.solution_space.empty()
    for k in range(len(columns)):
        unit = np.zeros(len(columns))
        unit[k] = 1.0
        snapshots.append(fom.solve(input=unit))
    modes, _ = pod(snapshots, modes=ORDER)
    basis = modes.to_numpy() / root[:, None]
    return basis, basis


def errors(matrices, trial, test, columns, validation, period):
    """Largest error of peak and volume relative to their largest values, the worst over alphas and signals."""
    e = test.T @ (matrices["E"] @ trial)
    a = np.linalg.solve(e, test.T @ (matrices["A"] @ trial))
    b = np.linalg.solve(e, test.T @ matrices["B"][:, columns].toarray())
    peak = matrices["C"][[0]] @ trial
    volume = matrices["C"][[1 + k for k in columns]] @ trial
    block = scipy.linalg.expm(period * np.block([[a, b], [np.zeros((len(columns), ORDER + len(columns)))]]))
    decay, gain = block[:ORDER, :ORDER], block[:ORDER, ORDER:]
    count = len(columns)
    worst = [0.0, 0.0]
    for power, reference in validation.values():
        state = np.zeros((ORDER, count))
        outputs = np.empty_like(reference)
        for k, u in enumerate(power):
            state = decay @ state + gain * u
            outputs[k, :count] = peak @ state
            outputs[k, count:] = np.einsum("ai,ia->a", volume, state)
        relative = np.abs(outputs - reference).max(axis=0) / np.abs(reference).max(axis=0)
        worst = [max(worst[0], relative[:count].max()), max(worst[1], relative[count:].max())]
    return worst


def ours(program, method, folder):
    file = folder / f"{method}.json"
    begin = time.perf_counter()
    subprocess.run([program, "reduce", "--method", method, "--order", str(ORDER), "--out", str(file)], check=True,
                   stderr=subprocess.DEVNULL)
    seconds = time.perf_counter() - begin
    error = json.loads(file.read_text())["error"]
    return seconds, [max(error[k]) for k in ("peak_relative", "volume_relative")]


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--program", required=True)
    parser.add_argument("--matrices", type=pathlib.Path, required=True, help="folder with both exports")
    parser.add_argument("--json", type=pathlib.Path)
    options = parser.parse_args()
    set_log_levels({"pymor": "WARNING"})

    def load(folder):
        return {k: scipy.io.mmread(folder / f"{k}.mtx").tocsc() for k in "EABC"}

    training = load(options.matrices / "training")
    judged = load(options.matrices / "validation")
    validation, period = read_validation(options.matrices / "validation" / "validation.csv")
    # Gains of both outputs at the end of 400 ms of 1 W, for each training alpha.
    signals, _ = read_validation(options.matrices / "training" / "validation.csv")
    count = training["B"].shape[1]
    gains = signals["constant"][1][-1].reshape(2, count)
    columns, judged_columns = list(range(count)), list(range(judged["B"].shape[1]))
    steps = len(validation["constant"][0])

    rows = []
    # All eigenvalues are real, for which Wachspress shifts are optimal; with its default, projection shifts, and its
    # default tolerance pyMOR needs several times as long. A sparse LU of a symmetric matrix: ordering for A' + A.
    set_defaults({"pymor.bindings.scipy.ScipySpSolveSolver.permc_spec": "MMD_AT_PLUS_A"})
    solver = ADILyapunovSolver(adi_tol=1e-8, adi_shifts="wachspress_shifts", wachspress_tol=1e-6)
    methods = {
        "balanced truncation": lambda: balanced_truncation(training, columns, gains, solver),
        "POD of step responses": lambda: proper_orthogonal_decomposition(training, columns, gains, period, steps),
    }
    own = {"balanced-two-sided": [], "pod-deim": []}
    for name, method in methods.items():
        for method_of_ours, times in own.items():  # interleaved: before and after each of pyMOR's
            times.extend(ours(options.program, method_of_ours, options.matrices)[0] for _ in range(3))
        begin = time.perf_counter()
        trial, test = method()
        seconds = time.perf_counter() - begin
        peak, volume = errors(judged, trial, test, judged_columns, validation, period)
        rows.append({"model": f"pyMOR, {name}", "seconds": seconds, "peak_error": peak, "volume_error": volume})
    for method, times in own.items():
        seconds, (peak, volume) = ours(options.program, method, options.matrices)
        rows.append({"model": f"photocoag, {method}", "seconds": float(np.median(times + [seconds])),
                     "peak_error": peak, "volume_error": volume})

    print(f"Order {ORDER} from {training['A'].shape[0]} states; error: worst over {len(judged_columns)} alphas")
    print(f"{'':<50} {'seconds':>8} {'peak %':>8} {'volume %':>8}")
    for row in rows:
        print(f"{row['model']:<50} {row['seconds']:8.2f} {100 * row['peak_error']:8.2f} "
              f"{100 * row['volume_error']:8.2f}")
    slowest = max(r["seconds"] for r in rows if r["model"].startswith("photocoag"))
    for row in rows:
        if row["model"].startswith("pyMOR"):
            print(f"{row['model']}: {row['seconds'] / slowest:.0f} times the slower of ours")
    if options.json:
        options.json.write_text(json.dumps(rows, indent=2) + "\n")


if __name__ == "__main__":
    main()
