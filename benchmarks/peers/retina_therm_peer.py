"""retina-therm against photocoag: the peak temperature at 100 times after switching on 30 mW, paper's geometry.

retina-therm integrates Green's functions of unbounded tissue (times are those of its functions, in a Python that is
running; photocoag's are those of whole processes). photocoag has boundaries of zero temperature rise: once on the paper's layers, whose front boundary lies 190 um before
the RPE, and once with 2 mm of clear tissue in front and behind, where both describe the same problem. Started by
run.sh.
"""
import argparse
import csv
import io
import json
import math
import pathlib
import subprocess
import time

import mpmath
import numpy as np
from retina_therm.greens_functions import CWRetinaLaserExposure

POWER_W = 0.03
ALPHA = 0.7363
SPOT_RADIUS_CM = 100e-4
PEAK_DEPTH_CM = 193e-4
TIMES_S = np.arange(1, 101) * 1e-3

RETINA_THERM = {
    "laser": {
        "profile": "flattop",
        "one_over_e_radius": f"{SPOT_RADIUS_CM} cm",
        "irradiance": f"{POWER_W / (math.pi * SPOT_RADIUS_CM**2)} W/cm^2",
    },
    "thermal": {"rho": "0.993 g/cm^3", "c": "4.176 J/g/K", "k": "0.00627 W/cm/K"},
    "layers": [
        {"thickness": "6e-4 cm", "position": "190e-4 cm", "absorption_coefficient": f"{ALPHA * 1204} 1/cm"},
        {"thickness": "400e-4 cm", "position": "200e-4 cm", "absorption_coefficient": "26.622 1/cm"},
    ],
}
UNBOUNDED = """tissue.layers=[
  { name = "vitreous",    thickness_um = 2000.0, absorption_per_m = 0.0 },
  { name = "retina",      thickness_um = 190.0,  absorption_per_m = 0.0 },
  { name = "RPE",         thickness_um = 6.0,    absorption_per_m = 120400.0, scaled_by = "alpha" },
  { name = "unpigmented", thickness_um = 4.0,    absorption_per_m = 0.0 },
  { name = "choroid",     thickness_um = 400.0,  absorption_per_m = 2662.2 },
  { name = "sclera",      thickness_um = 2000.0, absorption_per_m = 0.0 } ]""".replace("\n", " ")


def retina_therm(**settings):
    begin = time.perf_counter()
    model = CWRetinaLaserExposure(RETINA_THERM | {"simulation": {"with_units": False} | settings})
    values = model.temperature_rise(PEAK_DEPTH_CM, 0.0, TIMES_S, method="quad")
    return time.perf_counter() - begin, np.array(values, dtype=float)


def photocoag(program, model, *settings):
    """The whole process: start, building the model (or reading it from its cache), 100 times, printing."""
    arguments = [program, "response", "--model", model, "--power", str(POWER_W), "--csv", "-",
                 "--times", ",".join(f"{t:g}" for t in TIMES_S), "--set", f"plant.absorption_factor={ALPHA}"]
    for setting in settings:
        arguments += ["--set", setting]
    begin = time.perf_counter()
    result = subprocess.run(arguments, check=True, capture_output=True, text=True)
    seconds = time.perf_counter() - begin
    return seconds, np.array([float(row["peak_K"]) for row in csv.DictReader(io.StringIO(result.stdout))])


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--program", required=True)
    parser.add_argument("--json", type=pathlib.Path)
    options = parser.parse_args()
    mpmath.mp.dps = 100  # as its command line does
    exact = "retina-therm, 100 digits"
    contenders = {
        exact: lambda: retina_therm(use_multi_precision=True, use_approximations=False),
        "retina-therm, doubles (its default)": lambda: retina_therm(use_multi_precision=False,
                                                                    use_approximations=True),
        "photocoag, full model, unbounded": lambda: photocoag(options.program, "full", UNBOUNDED),
        "photocoag, full model, paper's layers": lambda: photocoag(options.program, "full"),
        "photocoag, reduced model, paper's layers": lambda: photocoag(options.program, "reduced"),
    }
    seconds = {name: [] for name in contenders}
    values = {}
    for turn in range(5):  # interleaved
        for name, run in contenders.items():
            if name == exact and turn > 0:
                continue  # takes long, and serves as the reference
            elapsed, values[name] = run()
            seconds[name].append(elapsed)
    reference = values[exact]
    rows = [{"contender": name, "median_s": float(np.median(seconds[name])), "first_s": seconds[name][0],
             "largest_difference": float(np.abs(value / reference - 1).max()),
             "peak_100ms_K": float(value[-1])} for name, value in values.items()]
    print(f"Peak at {len(TIMES_S)} times, 1 to 100 ms, {POWER_W} W, alpha {ALPHA}")
    print(f"{'':<42} {'median s':>9} {'first s':>9} {'largest difference':>19} {'at 100 ms':>11}")
    for row in rows:
        print(f"{row['contender']:<42} {row['median_s']:9.4f} {row['first_s']:9.4f} "
              f"{100 * row['largest_difference']:17.4f} % {row['peak_100ms_K']:9.4f} K")
    if options.json:
        options.json.write_text(json.dumps(rows, indent=2) + "\n")


if __name__ == "__main__":
    main()
