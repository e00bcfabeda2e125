// Five figures over one time axis. Lines differ by dash and width, not by colour alone.
import uPlot from "uplot";
import "uplot/dist/uPlot.min.css";
import type { Before } from "./link";
import type { Column, Store } from "./store";

interface Curve {
  label: string;
  dash?: number[];
  width?: number;
  points?: boolean;
  faint?: boolean;
  value: (store: Store, row: number) => number;
}
interface Figure {
  title: string;
  unit: string;
  curves: Curve[];
  band?: [number, number]; // curves between which there is a shade
  level?: { label: string; at: number; alarm?: boolean }[];
  floor?: [number, number]; // y range that is always shown
  span?: number; // or what the y range has at least
  now: (store: Store) => string;
}

const kWindow = 5; // s, while it runs
const column =
  (name: Column, scale = 1) =>
  (store: Store, row: number) =>
    store.at(name, row) * scale;
const side = (mean: Column, sigma: Column, deviations: number) => (store: Store, row: number) =>
  store.at(mean, row) + deviations * store.at(sigma, row);
const fixed = (value: number, digits: number) =>
  Number.isFinite(value) ? value.toFixed(digits) : "–";

function figures(before: Before): Figure[] {
  return [
    {
      title: "Peak temperature rise",
      unit: "K",
      curves: [
        { label: "estimate − 2σ", faint: true, value: side("peak_estimate_K", "peak_sigma_K", -2) },
        { label: "estimate + 2σ", faint: true, value: side("peak_estimate_K", "peak_sigma_K", 2) },
        { label: "estimate", width: 2, value: column("peak_estimate_K") },
        { label: "true (simulated eye)", dash: [2, 3], value: column("peak_true_K") },
      ],
      band: [1, 0],
      level: [
        { label: `reference ${before.peak_reference_K} K`, at: before.peak_reference_K },
        { label: `limit ${before.peak_max_K.toFixed(2)} K`, at: before.peak_max_K, alarm: true },
      ],
      floor: [0, before.peak_max_K * 1.1],
      now: (s) =>
        `${fixed(s.newest("peak_estimate_K"), 2)} ± ${fixed(2 * s.newest("peak_sigma_K"), 2)} K`,
    },
    {
      title: "Volume temperature rise",
      unit: "K",
      curves: [
        { label: "measured", points: true, faint: true, value: column("volume_measured_K") },
        { label: "predicted", width: 2, value: column("volume_predicted_K") },
      ],
      floor: [0, 5],
      now: (s) =>
        `measured ${fixed(s.newest("volume_measured_K"), 2)} K, predicted ${fixed(s.newest("volume_predicted_K"), 2)} K`,
    },
    {
      title: "Power",
      unit: "mW",
      curves: [
        { label: "commanded", width: 2, value: column("power_command_W", 1e3) },
        { label: "read back", dash: [2, 3], value: column("readback_W", 1e3) },
      ],
      level: [{ label: `limit ${before.power_max_W * 1e3} mW`, at: before.power_max_W * 1e3 }],
      floor: [0, before.power_max_W * 1.1e3],
      now: (s) =>
        `commanded ${fixed(s.newest("power_command_W") * 1e3, 1)} mW, read back ${fixed(s.newest("readback_W") * 1e3, 1)} mW`,
    },
    {
      title: "Absorption factor α",
      unit: "",
      curves: [
        { label: "estimate − 2σ", faint: true, value: side("absorption_estimate", "absorption_sigma", -2) },
        { label: "estimate + 2σ", faint: true, value: side("absorption_estimate", "absorption_sigma", 2) },
        { label: "estimate", width: 2, value: column("absorption_estimate") },
      ],
      band: [1, 0],
      span: 0.2,
      now: (s) =>
        `${fixed(s.newest("absorption_estimate"), 3)} ± ${fixed(2 * s.newest("absorption_sigma"), 3)}`,
    },
    {
      title: "Cycle time and slack",
      unit: "µs",
      curves: [
        { label: "wake-up late", faint: true, value: column("wake_late_ns", 1e-3) },
        { label: "computing", width: 2, value: column("compute_ns", 1e-3) },
        { label: "slack", dash: [2, 3], value: column("slack_ns", 1e-3) },
      ],
      level: [{ label: `period ${before.period_ms * 1e3} µs`, at: before.period_ms * 1e3 }],
      floor: [0, before.period_ms * 1.1e3],
      now: (s) =>
        `computing ${fixed(s.newest("compute_ns") * 1e-3, 0)} µs, slack ${fixed(s.newest("slack_ns") * 1e-3, 0)} µs`,
    },
  ];
}

const ink = (name: string) => getComputedStyle(document.documentElement).getPropertyValue(name).trim();

class Panel {
  private plot: uPlot | null = null;
  private readonly host = document.createElement("div");
  private readonly now = document.createElement("output");
  span: [number, number] = [0, 1];

  constructor(
    parent: HTMLElement,
    private readonly figure: Figure,
  ) {
    const box = document.createElement("figure");
    const caption = document.createElement("figcaption");
    const title = document.createElement("h3");
    title.textContent = [figure.title, figure.unit].filter((word) => word).join(", ");
    this.now.className = "live";
    this.now.setAttribute("aria-live", "off");
    caption.append(title, this.now);
    const key = document.createElement("ul");
    key.className = "key";
    for (const curve of figure.curves) {
      if (curve.label.endsWith("− 2σ")) continue;
      const entry = document.createElement("li");
      const line = document.createElement("i");
      line.className = curve.points ? "dots" : curve.dash ? "dash" : !curve.faint ? "solid" : curve.label.endsWith("σ") ? "band" : "thin";
      entry.append(line, curve.label.replace("+ 2σ", "± 2σ"));
      key.append(entry);
    }
    this.host.className = "plot";
    this.host.setAttribute("aria-hidden", "true");
    box.append(caption, key, this.host);
    parent.append(box);
  }

  build(): void {
    this.plot?.destroy();
    const strong = ink("--ink");
    const faint = ink("--faint");
    const grid = { stroke: ink("--grid"), width: 1 };
    const figure = this.figure;
    const axis = { stroke: ink("--ink-2"), grid, ticks: grid, font: "12px system-ui, sans-serif" };
    this.plot = new uPlot(
      {
        width: Math.max(200, this.host.clientWidth),
        height: 170,
        legend: { show: false },
        cursor: { sync: { key: "time" }, drag: { x: false, y: false } },
        scales: {
          x: { time: false, range: () => this.span },
          y: {
            range: (_, low, high) => {
              if (figure.floor) {
                const [least, most] = figure.floor;
                return [Math.min(least, low ?? least), Math.max(most, high ?? most)];
              }
              if (low === null || high === null) return [0, 1];
              const spare = Math.max(0.05 * (high - low), ((figure.span ?? 0) - (high - low)) / 2);
              return [low - spare, high + spare];
            },
          },
        },
        axes: [
          { ...axis, size: 34, label: "time, ms", labelSize: 14, labelFont: axis.font, labelGap: 0 },
          { ...axis, size: 58, space: 24 },
        ],
        series: [
          {},
          ...figure.curves.map((curve) => ({
            stroke: curve.faint ? faint : strong,
            width: curve.points ? 0 : (curve.width ?? 1),
            dash: curve.dash,
            points: { show: curve.points ?? false, size: 3, fill: faint, stroke: faint },
            spanGaps: false,
          })),
        ],
        bands: figure.band
          ? [{ series: [figure.band[0] + 1, figure.band[1] + 1], fill: ink("--band") }]
          : [],
        hooks: { draw: [(u) => this.drawLevels(u)] },
      },
      [[], ...figure.curves.map(() => [])] as unknown as uPlot.AlignedData,
      this.host,
    );
  }

  private drawLevels(u: uPlot): void {
    const { ctx, bbox } = u;
    ctx.save();
    ctx.font = `${12 * devicePixelRatio}px system-ui, sans-serif`;
    ctx.textAlign = "right";
    for (const level of this.figure.level ?? []) {
      const y = u.valToPos(level.at, "y", true);
      ctx.strokeStyle = ctx.fillStyle = ink("--ink-2");
      ctx.lineWidth = (level.alarm ? 2 : 1) * devicePixelRatio;
      ctx.setLineDash(level.alarm ? [] : [8 * devicePixelRatio, 5 * devicePixelRatio]);
      ctx.beginPath();
      ctx.moveTo(bbox.left, y);
      ctx.lineTo(bbox.left + bbox.width, y);
      ctx.stroke();
      const below = level.alarm ? -4 : 14;
      ctx.fillText(level.label, bbox.left + bbox.width - 4 * devicePixelRatio, y + below * devicePixelRatio);
    }
    ctx.restore();
  }

  draw(store: Store, from: number, span: [number, number]): void {
    if (!this.plot) return;
    this.now.textContent = this.figure.now(store);
    this.span = span;
    const pixels = Math.max(100, this.plot.bbox.width / devicePixelRatio);
    const series = this.figure.curves.map((curve) => (row: number) => curve.value(store, row));
    this.plot.setData(store.curves(from, pixels, series) as uPlot.AlignedData);
  }

  destroy(): void {
    this.plot?.destroy();
    this.plot = null;
  }

  resize(): void {
    const width = this.host.clientWidth;
    if (this.plot && width > 0 && width !== this.plot.width) this.plot.setSize({ width, height: 170 });
  }
}

export class Charts {
  private readonly panels: Panel[];
  private readonly observer: ResizeObserver;
  whole = false;

  constructor(
    parent: HTMLElement,
    private readonly before: Before,
  ) {
    parent.replaceChildren();
    this.panels = figures(before).map((figure) => new Panel(parent, figure));
    this.rebuild();
    this.observer = new ResizeObserver(() => this.panels.forEach((panel) => panel.resize()));
    this.observer.observe(parent);
  }

  destroy(): void {
    this.observer.disconnect();
    this.panels.forEach((panel) => panel.destroy());
  }

  /** With the colours of the scheme in force. */
  rebuild(): void {
    this.panels.forEach((panel) => panel.build());
  }

  draw(store: Store): void {
    const end = store.size > 0 ? store.newest("time_s") : 0;
    const window = Math.min(kWindow, this.before.planned_ms * 1e-3);
    const from = this.whole ? 0 : Math.max(0, end - window);
    const to = this.whole ? Math.max(end, 1e-3) : Math.max(end, window);
    for (const panel of this.panels) panel.draw(store, from, [from * 1e3, to * 1e3]);
  }
}
