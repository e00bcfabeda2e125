"""QP solvers that come as Python packages on the recorded problems of `photocoag bench qp --export FILE`.

Every problem is  min 1/2 u' H u + g' u,  lower <= u <= upper,  G u <= limit,  with u over u_max.
Two times per solver, in microseconds:
  call  measured here around the call, the solver's interface to Python included;
  own   measured by the solver itself, where it does that (update and solve, without Python).
The u0 error is against the exact answer in the file, in units of u_max; solvers run one after another on
each problem, cold, at the tolerance given in the table. DAQP and qpOASES are measured from C and C++: ../qp_peers.cpp.
"""

import argparse
import json
import time

import numpy as np
import piqp
from proxsuite import proxqp

REPETITIONS = 3


class Problem:
    def __init__(self, raw):
        n = len(raw["g"])
        self.horizon = raw["horizon"]
        self.H = np.array(raw["H"]).reshape(n, n)
        self.g = np.array(raw["g"])
        self.lower = np.array(raw["lower"])
        self.upper = np.array(raw["upper"])
        self.G = np.array(raw["G"]).reshape(-1, n)
        self.limit = np.array(raw["limit"])
        self.u0 = raw["u0"]


# Each peer is a class: made once per horizon, then solve(problem) -> (u0, own time in us or None).


class Piqp:
    name = "PIQP dense (default)"

    def __init__(self, first):
        self.solver = piqp.DenseSolver()
        self.solver.settings.compute_timings = True
        self.solver.settings.verbose = False
        p = first
        self.solver.setup(p.H, p.g, None, None, p.G, None, p.limit, p.lower, p.upper)

    def solve(self, p):
        self.solver.update(P=p.H, c=p.g, G=p.G, h_u=p.limit, x_l=p.lower, x_u=p.upper)
        status = self.solver.solve()
        info = self.solver.result.info
        own = 1e6 * (info.update_time + info.solve_time)
        return (self.solver.result.x[0] if status == piqp.PIQP_SOLVED else None), own


class ProxQp:
    name = "ProxQP dense (1e-9)"

    def __init__(self, first):
        p = first
        m, n = p.G.shape
        self.none = np.full(m, -1e20)
        self.qp = proxqp.dense.QP(n, 0, m, True)
        self.qp.settings.eps_abs = 1e-9
        self.qp.settings.compute_timings = True
        self.qp.settings.initial_guess = proxqp.InitialGuess.NO_INITIAL_GUESS
        self.qp.init(p.H, p.g, None, None, p.G, self.none, p.limit, p.lower, p.upper)

    def solve(self, p):
        self.qp.update(H=p.H, g=p.g, C=p.G, l=self.none, u=p.limit, l_box=p.lower, u_box=p.upper)
        self.qp.solve()
        info = self.qp.results.info
        solved = info.status == proxqp.PROXQP_SOLVED
        return (self.qp.results.x[0] if solved else None), info.setup_time + info.solve_time


def measure(peer, problem):
    begin = time.perf_counter_ns()
    u0, own = peer.solve(problem)
    return u0, own, (time.perf_counter_ns() - begin) / 1e3


def run(problems):
    rows = []
    horizons = sorted({p.horizon for p in problems})
    for horizon in horizons:
        mine = [p for p in problems if p.horizon == horizon]
        peers = []
        for kind in (Piqp, ProxQp):
            try:
                peer = kind(mine[0])
                measure(peer, mine[0])
                peers.append(peer)
            except Exception as problem:  # one peer that does not work must not stop the others
                print(f"N = {horizon}, {kind.name}: left out: {str(problem).splitlines()[0]}")
        calls = {peer.name: [] for peer in peers}
        owns = {peer.name: [] for peer in peers}
        errors = {peer.name: 0.0 for peer in peers}
        failed = {peer.name: 0 for peer in peers}
        for _ in range(REPETITIONS):
            for problem in mine:
                for peer in peers:
                    u0, own, call = measure(peer, problem)
                    calls[peer.name].append(call)
                    if own is not None:
                        owns[peer.name].append(own)
                    if u0 is None:
                        failed[peer.name] += 1
                    else:
                        errors[peer.name] = max(errors[peer.name], abs(u0 - problem.u0))
        for peer in peers:
            own = np.array(owns[peer.name] or [np.nan])
            call = np.array(calls[peer.name])
            rows.append({
                "horizon": horizon, "name": peer.name,
                "own_median_us": float(np.median(own)), "own_p99_us": float(np.percentile(own, 99)),
                "call_median_us": float(np.median(call)), "call_p99_us": float(np.percentile(call, 99)),
                "power_error_of_u_max": errors[peer.name], "not_solved": failed[peer.name]})
            r = rows[-1]
            print(f"{horizon:3}  {peer.name:26} {r['own_median_us']:9.2f} {r['own_p99_us']:9.2f} "
                  f"{r['call_median_us']:9.2f} {r['call_p99_us']:9.2f}  {errors[peer.name]:8.1e}"
                  + (f"  {failed[peer.name]} not solved" if failed[peer.name] else ""))
    return rows


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("problems")
    parser.add_argument("--json")
    arguments = parser.parse_args()
    with open(arguments.problems, encoding="utf-8") as file:
        # The other choices of weights and N = 50 are for ../qp_peers.cpp.
        first = [raw for raw in json.load(file) if raw["weights"] == "R1 = R2 = 0" and raw["horizon"] <= 20]
        problems = [Problem(raw) for raw in first]
    print(f"{len(problems)} problems, {REPETITIONS} times each, us")
    print(f"{'N':>3}  {'solver':26} {'own':>9} {'own 99 %':>9} {'call':>9} {'call 99 %':>9}  u0 error / u_max")
    rows = run(problems)
    if arguments.json:
        with open(arguments.json, "w", encoding="utf-8") as file:
            json.dump(rows, file, indent=2)


if __name__ == "__main__":
    main()
