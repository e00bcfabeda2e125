"""The same closed loop three times: the control problem written with CasADi and OSQP, with do-mpc, and ours.

    pip install casadi do-mpc      # beside photocoag
    python python/benchmarks/peers.py

Same eye, noise, estimator and reduced model; the problem is (E18) with N = 5 and R1 = R2 = 0. Prints lines of code, time to
set up, median time of a cycle (estimator included), the highest peak and the largest difference of a power.
"""

from __future__ import annotations

import contextlib
import inspect
import os
import time
from collections.abc import Callable
from typing import Any

import numpy as np

import photocoag as pc

CONFIG = pc.Config().update({"plant.absorption_factor": 1.1, "safety.supervisor": "off"})
MODEL = pc.reduce(CONFIG)
STAGES = CONFIG.control.horizon - 1
REFERENCE, LIMIT, POWER_MAX = 30.0, 32.0, CONFIG.control.power_max_W


class WithCasadi:
    """The condensed quadratic program, parametric in the state and the input matrix; solved by OSQP."""

    def __init__(self) -> None:
        import casadi as ca

        self.estimator = pc.Estimator(MODEL, CONFIG)
        x0, b = ca.SX.sym("x", MODEL.order), ca.SX.sym("b", MODEL.order)
        u = ca.SX.sym("u", STAGES)
        x, cost, peaks = x0, 0, []
        for k in range(STAGES):
            x = MODEL.A_d @ x + b * u[k]
            peak = ca.dot(MODEL.C_peak, x)
            cost += (peak - REFERENCE) ** 2
            peaks.append(peak)
        problem = {"x": u, "p": ca.vertcat(x0, b), "f": cost, "g": ca.vertcat(*peaks)}
        accuracy = {"eps_abs": 1e-7, "eps_rel": 1e-7, "max_iter": 20000, "verbose": False}
        self.solver = ca.qpsol("mpc", "osqp", problem, {"osqp": accuracy, "error_on_fail": False, "print_time": False})

    def step(self, volume_temperature: float, applied_power: float) -> float:
        self.estimator.update(volume_temperature, applied_power)
        return self.start()

    def start(self) -> float:
        at = np.r_[self.estimator.state, MODEL.B_d(self.estimator.absorption_factor)]
        found = self.solver(p=at, lbx=0.0, ubx=POWER_MAX, lbg=-np.inf, ubg=LIMIT)
        return float(found["x"][0])


class WithDoMpc:
    """The same problem in do-mpc's terms: a linear model, its input matrix a time-varying parameter; solved by IPOPT."""

    def __init__(self) -> None:
        import casadi as ca
        import do_mpc

        self.estimator = pc.Estimator(MODEL, CONFIG)
        model = do_mpc.model.Model("discrete")
        x = model.set_variable("_x", "x", (MODEL.order, 1))
        u = model.set_variable("_u", "u")
        b = model.set_variable("_tvp", "b", (MODEL.order, 1))
        model.set_rhs("x", MODEL.A_d @ x + b * u)
        model.set_expression("peak", ca.dot(MODEL.C_peak, x))
        model.setup()
        self.mpc = do_mpc.controller.MPC(model)
        self.mpc.settings.n_horizon = STAGES
        self.mpc.settings.t_step = MODEL.period
        self.mpc.settings.store_full_solution = False
        self.mpc.settings.supress_ipopt_output()
        error = (model.aux["peak"] - REFERENCE) ** 2
        self.mpc.set_objective(lterm=error, mterm=error)
        self.mpc.set_rterm(u=0.0)
        self.mpc.bounds["lower", "_u", "u"] = 0.0
        self.mpc.bounds["upper", "_u", "u"] = POWER_MAX
        self.mpc.set_nl_cons("limit", model.aux["peak"], ub=LIMIT)
        self.template = self.mpc.get_tvp_template()
        self.mpc.set_tvp_fun(lambda _: self.template)
        self.mpc.setup()
        self.mpc.x0 = np.zeros(MODEL.order)
        self.mpc.set_initial_guess()

    def step(self, volume_temperature: float, applied_power: float) -> float:
        self.estimator.update(volume_temperature, applied_power)
        return self.start()

    def start(self) -> float:
        self.template["_tvp", :, "b"] = MODEL.B_d(self.estimator.absorption_factor)
        return float(self.mpc.make_step(self.estimator.state.reshape(-1, 1))[0, 0])


class WithPhotocoag:
    """Ours."""

    def __init__(self) -> None:
        controller = pc.Controller(MODEL, CONFIG)
        self.start, self.step = controller.start, controller.step


class Timed:
    """Times each step of another controller."""

    def __init__(self, controller: Any) -> None:
        self.controller = controller
        self.start = controller.start
        self.seconds: list[float] = []

    def step(self, volume_temperature: float, applied_power: float) -> float:
        begin = time.perf_counter()
        power = self.controller.step(volume_temperature, applied_power)
        self.seconds.append(time.perf_counter() - begin)
        return power


def lines(make: Callable[[], Any]) -> int:
    return sum(bool(line.strip()) for line in inspect.getsource(make).splitlines())


def main() -> None:
    reference = pc.simulate(CONFIG).cycles["power_W"]
    print("                   lines  set up ms  cycle us   peak K  power differs mW")
    for make in (WithCasadi, WithDoMpc, WithPhotocoag):
        begin = time.perf_counter()
        with open(os.devnull, "w") as nowhere, contextlib.redirect_stdout(nowhere):
            controller = Timed(make())
            set_up = time.perf_counter() - begin
            run = pc.simulate(CONFIG, controller=controller)
        cycle = 1e6 * float(np.median(controller.seconds))
        differs = 1e3 * float(abs(run.cycles["power_W"] - reference).max())
        print(f"{make.__name__:16} {lines(make):7} {1e3 * set_up:10.1f} {cycle:9.1f} "
              f"{run.summary['peak_true_max_K']:8.2f} {differs:17.6f}")


if __name__ == "__main__":
    main()
