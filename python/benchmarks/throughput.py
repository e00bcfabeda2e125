"""What Python costs: a controller's step, a controller in Python on the full-order eye, many treatments.

    build/python/clean/bin/python python/benchmarks/throughput.py

Best of several repetitions; the C++ figures beside them come from `./photocoag bench` and `./photocoag campaign`.
"""

from __future__ import annotations

import time
from collections.abc import Callable

import photocoag as pc


class ProportionalIntegral:
    def __init__(self) -> None:
        self._integral = 0.0

    def step(self, volume_temperature: float, applied_power: float, /) -> float:
        error = 13.0 - volume_temperature
        self._integral += 1e-3 * error
        return 0.002 * error + 0.2 * self._integral


def best(call: Callable[[], object], repetitions: int) -> float:
    times = []
    for _ in range(repetitions):
        begin = time.perf_counter()
        call()
        times.append(time.perf_counter() - begin)
    return min(times)


def main() -> None:
    config = pc.Config()
    model = pc.reduce(config)
    controller = pc.Controller(model, config)

    def steps() -> None:
        for _ in range(1000):
            controller.step(13.0, 0.02)

    pc.simulate(config)
    print(f"Controller.step                      {1e3 * best(steps, 20):8.2f} us")
    print(f"simulate, full order, 250 cycles     {1e3 * best(lambda: pc.simulate(config), 10):8.2f} ms")
    print(f"  its loop alone                     {1e3 * min(pc.simulate(config).loop_seconds for _ in range(10)):8.2f} ms")
    own = best(lambda: pc.simulate(config, controller=ProportionalIntegral()), 10)
    print(f"the same with a PI controller        {1e3 * own:8.2f} ms")
    print(f"simulate_many, 1,000 seeds           {best(lambda: pc.simulate_many(config, range(1000)), 2):8.2f} s")


if __name__ == "__main__":
    main()
