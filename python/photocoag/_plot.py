"""Figures in the style of the report."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from ._run import Run

BLUE, ORANGE, GREEN, GREY, RED = "#1f6fb2", "#c4611a", "#3c8d40", "#8a8f98", "#b3261e"


def style(axes: Any, label: str) -> None:
    """The report's axes: a light grid, no box, the label as title."""
    axes.set_title(label, loc="left", fontsize=10)
    axes.grid(True, color="#e3e6ea", linewidth=0.8)
    for side in ("top", "right"):
        axes.spines[side].set_visible(False)
    axes.margins(x=0)


def plot_run(run: Run) -> Figure:
    """Peak, volume temperature, power and absorption estimate over time."""
    from ._figure import ShownFigure

    cycles, control = run.cycles, run.config.control
    time = cycles["time_s"] * 1e3
    figure = ShownFigure(figsize=(8, 8), layout="constrained")
    peak, volume, power, absorption = figure.subplots(4, 1, sharex=True)
    peak.axhline(control.peak_max_K, color=RED, linewidth=1, label="limit")
    peak.axhline(control.peak_reference_K, color=GREY, linewidth=1, linestyle="--", label="reference")
    peak.plot(time, cycles["peak_estimate_K"], color=ORANGE, linewidth=1, label="estimate")
    peak.plot(time, cycles["peak_true_K"], color=BLUE, linewidth=1.4, label="true")
    style(peak, "Peak temperature rise, K")
    volume.plot(time, cycles["volume_measured_K"], ".", color=GREY, markersize=2, label="measured")
    volume.plot(time, cycles["volume_estimate_K"], color=ORANGE, linewidth=1, label="estimate")
    volume.plot(time, cycles["volume_true_K"], color=BLUE, linewidth=1.4, label="true")
    style(volume, "Volume temperature rise, K")
    power.step(time, cycles["power_W"] * 1e3, where="pre", color=GREEN, linewidth=1.2)
    style(power, "Laser power, mW")
    absorption.plot(time, cycles["absorption_estimate"], color=ORANGE, linewidth=1.2, label="estimate")
    absorption.axhline(
        run.config.plant.absorption_factor, color=BLUE, linewidth=1, linestyle="--", label="true"
    )
    style(absorption, "Absorption factor")
    absorption.set_xlabel("time, ms")
    for axes in (peak, volume, absorption):
        axes.legend(fontsize=8, frameon=False, ncols=4, loc="lower right")
    return figure
