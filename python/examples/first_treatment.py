"""A first treatment: simulate it, read the results, save a figure."""

from __future__ import annotations

import sys

import photocoag as pc


def main(picture: str | None = None) -> None:
    config = pc.Config().set("plant.absorption_factor", 0.5)
    run = pc.simulate(config, seed=7)
    print(run)
    print(f"95 % of the reference after {1e3 * run.summary['time_to_95_percent_s']:g} ms")
    late = run.cycles[run.cycles["time_s"] > 0.05]
    print(f"mean power after 50 ms {1e3 * late['power_W'].mean():.2f} mW")
    if picture is not None:
        run.plot().savefig(picture)


if __name__ == "__main__":
    main(*sys.argv[1:2])
