"""OSQP's generated C, single precision, for the condensed problem of N = 5: osqp_code.py FOLDER [RHO].

H upper triangular, A = [I; G] with G lower triangular; all numbers change in every cycle.
"""

import sys

import numpy as np
import osqp
import scipy.sparse as sparse

N = 4
# Some impulse response, K: the numbers are replaced before the first solve, the pattern stays.
RESPONSE = np.array([4.0, 1.9, 1.4, 1.1])
G = np.array([[RESPONSE[k - j] if j <= k else 0.0 for j in range(N)] for k in range(N)])

solver = osqp.OSQP()
solver.setup(
    sparse.csc_matrix(np.triu(2.0 * G.T @ G)),
    -2.0 * G.T @ np.full(N, 10.0),
    sparse.csc_matrix(np.vstack([np.eye(N), G])),
    np.r_[np.zeros(N), np.full(N, -1e20)],
    np.r_[np.ones(N), np.full(N, 12.0)],
    rho=float(sys.argv[2]) if len(sys.argv) > 2 else 100.0,
    eps_abs=1e-3,
    eps_rel=1e-3,
    verbose=False,
)
solver.codegen(
    sys.argv[1],
    parameters="matrices",
    use_float=True,
    printing_enable=False,
    profiling_enable=False,
    interrupt_enable=False,
    force_rewrite=True,
    compile=False,
)
