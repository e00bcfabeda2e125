"""Do `dense` and four other solvers agree where a problem gives no scale? Started by qp_run agree.

Walking problems: a triple integrator whose jerk is free keeps its centre of pressure between the edges of a foot. The first
two rows have no input in them, and in some problems a limit of some -1e-17 where exact arithmetic has 0. No input has bounds;
`dense`, which needs a box, gets +-1e6. Interior point methods get none.
"""

import json
import sys

import numpy as np

TOLERANCE = 1e-9
STEPS = 16
PERIOD = 0.1
HEIGHT = 0.8 / 9.81
BOX = 1e6


def walking(velocity, rounding):
    k, j = np.mgrid[0:STEPS, 0:STEPS]
    age = k - 1 - j
    jerk = np.where(j < k, PERIOD**3 * (1 / 6 + age / 2 + age**2 / 2) - HEIGHT * PERIOD, 0.0)
    k, j = np.mgrid[0 : STEPS + 1, 0:STEPS]
    speed = np.where(j < k, PERIOD**2 * (k - j - 0.5), 0.0)
    times = np.arange(STEPS)
    drift = velocity * PERIOD * times
    rows = np.empty((2 * STEPS, STEPS))
    limit = np.empty(2 * STEPS)
    rows[0::2], rows[1::2] = jerk, -jerk
    limit[0::2] = np.where(times < 8, 0.065, 0.165) - drift
    limit[1::2] = drift - np.where(times < 8, 0.0, 0.035)
    limit[1] = rounding
    return {
        "horizon": STEPS + 1,
        "H": (speed.T @ speed + 1e-3 * np.eye(STEPS)).ravel().tolist(),
        "g": (speed.T @ np.full(STEPS + 1, velocity - 0.1)).tolist(),
        "lower": [-BOX] * STEPS,
        "upper": [BOX] * STEPS,
        "G": rows.ravel().tolist(),
        "limit": limit.tolist(),
    }


def make(path):
    roundings = [0.0, 0.02, 0.04, 0.0, -7e-18, -3e-17]
    problems = [walking(0.05 + 0.0025 * k, roundings[k % len(roundings)]) for k in range(30)]
    with open(path, "w", encoding="utf-8") as file:
        json.dump(problems, file)


def interior_point(p):
    import piqp

    solver = piqp.DenseSolver()
    solver.settings.verbose = False
    solver.settings.eps_abs = solver.settings.eps_rel = solver.settings.eps_duality_gap_abs = 1e-15
    solver.settings.eps_duality_gap_rel = 1e-15
    solver.settings.max_iter = 1000
    solver.setup(p["H"], p["g"], None, None, p["G"], None, p["limit"], None, None)
    return solver.result.x if solver.solve() == piqp.PIQP_SOLVED else None


def proximal(p):
    from proxsuite import proxqp

    rows, inputs = p["G"].shape
    qp = proxqp.dense.QP(inputs, 0, rows)
    qp.settings.eps_abs = 1e-14
    qp.settings.max_iter = 100000
    qp.init(p["H"], p["g"], None, None, p["G"], np.full(rows, -1e20), p["limit"])
    qp.solve()
    return qp.results.x if qp.results.info.status == proxqp.PROXQP_SOLVED else None


def judge(problems_path, answers_path):
    with open(problems_path, encoding="utf-8") as file:
        problems = json.load(file)
    with open(answers_path, encoding="utf-8") as file:
        answers = json.load(file)
    worst = {}
    for raw, answer in zip(problems, answers):
        n = len(raw["g"])
        p = {"H": np.array(raw["H"]).reshape(n, n), "g": np.array(raw["g"]),
             "G": np.array(raw["G"]).reshape(-1, n), "limit": np.array(raw["limit"])}
        answer["PIQP"] = interior_point(p)
        answer["ProxQP"] = proximal(p)
        own = answer[next(name for name in answer if name.startswith("dense"))]
        for name, u in answer.items():
            if own is None or u is None:
                worst[name] = np.inf
            else:
                worst[name] = max(worst.get(name, 0.0), float(np.abs(np.array(u) - own).max()))
    for name, difference in worst.items():
        print(f"{name:28} {difference:8.1e}")
    return 0 if max(worst.values()) <= TOLERANCE else 1


if __name__ == "__main__":
    if sys.argv[1] == "make":
        make(sys.argv[2])
    else:
        sys.exit(judge(sys.argv[2], sys.argv[3]))
