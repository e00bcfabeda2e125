"""Eye and controller as FMUs, coupled with FMPy; beside the same treatment by `photocoag simulate`.

photocoag export-fmu eye --out eye.fmu
photocoag export-fmu controller --out controller.fmu
photocoag simulate --out run
python couple.py eye.fmu controller.fmu --run run --figure fmu.svg
"""

from __future__ import annotations

import argparse
import csv
import tempfile
from pathlib import Path

import fmpy
from fmpy.fmi3 import FMU3Slave


class Part:
    """An FMU that is stepped, its variables by name."""

    def __init__(self, file: str, folder: str) -> None:
        description = fmpy.read_model_description(file)
        simulation = description.coSimulation
        self.references = {one.name: one.valueReference for one in description.modelVariables}
        self.period = float(simulation.fixedInternalStepSize)
        self.stop = float(description.defaultExperiment.stopTime)
        self.steps = 0
        self.fmu = FMU3Slave(
            guid=description.guid,
            unzipDirectory=fmpy.extract(file, folder),
            modelIdentifier=simulation.modelIdentifier,
            instanceName=simulation.modelIdentifier,
        )
        self.fmu.instantiate()
        self.fmu.enterInitializationMode(startTime=0.0)
        self.fmu.exitInitializationMode()

    def get(self, name: str) -> float:
        return float(self.fmu.getFloat64([self.references[name]])[0])

    def set(self, name: str, value: float) -> None:
        self.fmu.setFloat64([self.references[name]], [value])

    def step(self) -> None:
        self.fmu.doStep(self.steps * self.period, self.period)
        self.steps += 1


def treat(eye: Part, controller: Part) -> list[tuple[float, float, float]]:
    """Time, power and true peak of every period."""
    rows = []
    for _ in range(round(eye.stop / eye.period)):
        eye.set("power", controller.get("power"))
        eye.step()
        controller.set("volume_temperature", eye.get("volume_temperature"))
        controller.set("applied_power", eye.get("applied_power"))
        controller.step()
        rows.append((eye.steps * eye.period, eye.get("applied_power"), eye.get("peak_temperature_true")))
    return rows


def draw(rows: list[tuple[float, float, float]], run: str | None, figure: str) -> None:
    import matplotlib

    matplotlib.use("svg")
    matplotlib.rcParams["svg.hashsalt"] = "photocoag"
    from matplotlib import pyplot

    drawing, (above, below) = pyplot.subplots(2, 1, sharex=True, figsize=(7, 4.5), layout="constrained")
    time = [1e3 * row[0] for row in rows]
    above.plot(time, [row[2] for row in rows], label="the two FMUs")
    below.step([0.0, *time], [1e3 * row[1] for row in (rows[0], *rows)], label="the two FMUs")
    if run is not None:
        with (Path(run) / "run.csv").open() as file:
            every = [row for row in csv.DictReader(file) if int(row["cycle"]) % 10 == 0]
        then = [1e3 * float(row["time_s"]) for row in every]
        above.plot(then, [float(row["peak_true_K"]) for row in every], "o", mfc="none", label="simulate")
        below.plot(then, [1e3 * float(row["power_W"]) for row in every], "o", mfc="none", label="simulate")
    above.set_ylabel("true peak, K")
    below.set_ylabel("power, mW")
    below.set_xlabel("time, ms")
    above.legend()
    drawing.savefig(figure, metadata={"Date": None})


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("eye")
    parser.add_argument("controller")
    parser.add_argument("--run", help="run folder of simulate with the same configuration")
    parser.add_argument("--figure", help="SVG to write")
    options = parser.parse_args()
    with tempfile.TemporaryDirectory() as folder:
        rows = treat(Part(options.eye, f"{folder}/eye"), Part(options.controller, f"{folder}/controller"))
    print(f"{len(rows)} periods, peak at most {max(row[2] for row in rows):.2f} K")
    if options.run is not None:
        with (Path(options.run) / "run.csv").open() as file:
            powers = [float(row["power_W"]) for row in csv.DictReader(file)]
        equal = sum(power == row[1] for power, row in zip(powers, rows, strict=True))
        print(f"powers equal to those of simulate, bit for bit: {equal} of {len(powers)}")
    if options.figure is not None:
        draw(rows, options.run, options.figure)


if __name__ == "__main__":
    main()
