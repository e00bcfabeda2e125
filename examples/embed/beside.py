"""The exported controller beside `photocoag simulate`: stepped through a run's samples, as C or as MEX function in Octave.

photocoag simulate --set safety.supervisor=off --out run
photocoag export-c --out double
photocoag export-c --float --out single
python beside.py run --c double --c single --figure beside.svg
python beside.py run --octave double --figure beside-octave.svg
"""

from __future__ import annotations

import argparse
import csv
import os
import subprocess
import tempfile
from pathlib import Path

HERE = Path(__file__).resolve().parent
OCTAVE = """
addpath('{matlab}'); photocoag_build('{controller}', '{out}'); addpath('{out}');
x = load('{out}/inputs.txt');
[c, power] = photocoag_controller('new'); printf('%.17g\\n', power);
for k = 1:rows(x)
  y = x(k, 1); if isnan(y), y = []; end
  printf('%.17g\\n', photocoag_controller('step', c, y, x(k, 2)));
end
"""


def as_c(controller: Path, inputs: str) -> list[float]:
    with tempfile.TemporaryDirectory() as folder:
        sources = [str(one) for one in controller.glob("pc_*.c")]
        flags = ["-std=c99", "-O2", "-ffp-contract=off", f"-I{controller}"]
        program = f"{folder}/replay"
        compiler = os.environ.get("CC", "cc")
        subprocess.run([compiler, *flags, *sources, str(HERE / "replay.c"), "-lm", "-o", program], check=True)
        done = subprocess.run([program], input=inputs, check=True, capture_output=True, text=True)
    return [float(line) for line in done.stdout.split()]


def in_octave(controller: Path, inputs: str) -> list[float]:
    with tempfile.TemporaryDirectory() as folder:
        Path(folder, "inputs.txt").write_text(inputs)
        code = OCTAVE.format(matlab=HERE.parents[1] / "matlab", controller=controller.resolve(), out=folder)
        done = subprocess.run(
            ["octave-cli", "--quiet", "--no-init-file", "--norc", "--eval", code],
            check=True, capture_output=True, text=True,
        )  # fmt: skip
    return [float(line) for line in done.stdout.split()]


def precision(controller: Path) -> str:
    single = "typedef float pc_real" in (controller / "pc_model.h").read_text()
    return "single precision" if single else "double precision"


def draw(time: list[float], powers: list[float], beside: dict[str, list[float]], figure: str) -> None:
    import matplotlib

    matplotlib.use("svg")
    matplotlib.rcParams["svg.hashsalt"] = "photocoag"
    from matplotlib import pyplot

    drawing, (above, below) = pyplot.subplots(2, 1, sharex=True, figsize=(7, 4.5), layout="constrained")
    above.plot(time, [1e3 * power for power in powers], color="0.6", label="simulate")
    for place, (name, ours) in enumerate(beside.items()):
        every = range(5 * place, len(time), 10)
        above.plot([time[k] for k in every], [1e3 * ours[k] for k in every], "os"[place % 2], mfc="none", label=name)
        off = [abs(one - power) for one, power in zip(ours, powers, strict=True)]
        # What is equal to the bit has no place on this axis: its lower end.
        below.semilogy(time, [max(one, 1e-18) for one in off], linewidth=0.8)
    above.set_ylabel("power, mW")
    below.set_ylabel("differs by, W")
    below.set_ylim(5e-19, 1e-4)
    below.set_xlabel("time, ms")
    above.legend()
    drawing.savefig(figure, metadata={"Date": None})


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("run", type=Path, help="run folder of simulate, without supervisor")
    parser.add_argument("--c", type=Path, action="append", default=[], help="folder of export-c, compiled here")
    parser.add_argument("--octave", type=Path, action="append", default=[], help="folder of export-c, built by Octave")
    parser.add_argument("--figure", help="SVG to write")
    options = parser.parse_args()
    with (options.run / "run.csv").open() as file:
        rows = list(csv.DictReader(file))
    powers = [float(row["power_W"]) for row in rows]
    inputs = "".join(f"{row['volume_measured_K'] or 'nan'} {row['power_W']}\n" for row in rows)
    beside = {}
    for folder in options.c:
        beside[f"C, {precision(folder)}"] = as_c(folder, inputs)[: len(rows)]
    for folder in options.octave:
        beside[f"MEX function in Octave, {precision(folder)}"] = in_octave(folder, inputs)[: len(rows)]
    for name, ours in beside.items():
        off = [abs(one - power) for one, power in zip(ours, powers, strict=True)]
        print(f"{name}: {off.count(0.0)} of {len(off)} powers bit for bit, the others within {max(off):.1e} W")
    if options.figure is not None:
        draw([1e3 * float(row["time_s"]) for row in rows], powers, beside, options.figure)


if __name__ == "__main__":
    main()
