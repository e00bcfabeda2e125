"""TinyMPC's C++ for N = 5 at one absorption factor: tinympc_code.py MODEL FOLDER RHO TOLERANCE.

The limit is on an output and TinyMPC bounds states: the first state is the peak over 30 K, the others are its share of
the other modes. Their scale is small, so that rho, which acts on all states, does not hold them.
"""

import json
import sys

import numpy as np
import tinympc.interface as tinympc

ALPHA, N, UNIT, POWER_MAX, LIMIT, SMALL = 0.7363, 5, 30.0, 0.03, 30.05, 0.01
R = 1e-6  # has to be above 0
model = json.load(open(sys.argv[1]))
folder, rho, tolerance = sys.argv[2], float(sys.argv[3]), float(sys.argv[4])
A = np.array(model["discrete"]["A"])
C = np.array(model["continuous"]["C_peak"]).ravel()
order = len(C)
theta = [
    np.exp(-p["fixed_front"] - ALPHA * p["scaled_front"]) - np.exp(-p["fixed_back"] - ALPHA * p["scaled_back"])
    for p in model["theta"]["points"]
]
terms = np.array(model["discrete"]["B"])
B = (terms if terms.shape[0] == order else terms.T) @ theta
T = np.diag(C * SMALL / UNIT)
T[0] = C / UNIT
Q = np.diag(np.eye(order)[0])
x_max = np.full((order, N), 1e17)
x_max[0, 1:] = LIMIT / UNIT

tinympc.subprocess.check_call = lambda *command, **options: 0  # no Python module of what is generated
solver = tinympc.TinyMPC()
# The generator adds rho to Q and R once more than its iteration takes away.
A_t, B_t = T @ A @ np.linalg.inv(T), (T @ B * POWER_MAX)[:, None]
solver.setup(A_t, B_t, Q - rho * np.eye(order), np.array([[R - rho]]), N, rho=rho, x_min=np.full((order, N), -1e17),
             x_max=x_max, u_min=np.zeros((1, N - 1)), u_max=np.ones((1, N - 1)))
# Two: after one the answer before would do.
solver.update_settings(abs_pri_tol=tolerance, abs_dua_tol=tolerance, max_iter=1000, check_termination=2)
solver.codegen(folder)

# The last stage is weighted by the Riccati solution P, rho in it: the state that makes up for that.
P, G = Q + rho * np.eye(order), np.array([[R + rho]])
for _ in range(20000):
    K = np.linalg.solve(G + B_t.T @ P @ B_t, B_t.T @ P @ A_t)
    P = Q + rho * np.eye(order) + A_t.T @ P @ (A_t - B_t @ K)
last = np.linalg.solve(P, (P - rho * np.eye(order))[:, 0])


def written(values):
    return "{" + ", ".join(f"{value:.17g}" for value in values) + "}"


with open(folder + "/states.h", "w") as file:
    file.write(f"static const double states_of[{order}][{order}] = {{{', '.join(map(written, T))}}};\n")
    file.write(f"static const double last_reference[{order}] = {written(last)};\n")
