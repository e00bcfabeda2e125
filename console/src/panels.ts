// What is shown before and after a spot: lists of names and values, never more than text.
import type { Before, Finding, Line, SelfTest, Spot } from "./link";

export const make = <K extends keyof HTMLElementTagNameMap>(
  tag: K,
  text = "",
  className = "",
): HTMLElementTagNameMap[K] => {
  const element = document.createElement(tag);
  element.textContent = text;
  element.className = className;
  return element;
};

export const byId = (id: string) => document.getElementById(id)!;

export function list(lines: Line[]): HTMLDListElement {
  const dl = make("dl", "", "lines");
  for (const line of lines) {
    const row = make("div");
    row.append(make("dt", line.name), make("dd", line.value));
    dl.append(row);
  }
  return dl;
}

// Shape and word beside the colour.
const kMarks: Record<string, string> = { good: "✓", warn: "△", bad: "✕" };
function mark(health: string): HTMLSpanElement {
  return make("span", `${kMarks[health] ?? "·"} ${health}`, `mark ${health}`);
}

function findings(list: Finding[]): HTMLElement {
  const dl = make("dl", "", "lines");
  for (const finding of list) {
    const row = make("div");
    const dd = make("dd");
    dd.append(mark(finding.health), ` ${finding.found}`);
    if (finding.advice) dd.append(make("small", finding.advice));
    row.append(make("dt", finding.topic), dd);
    dl.append(row);
  }
  return dl;
}

export function showBefore(before: Before): void {
  byId("device").textContent = before.device;
  const groups: [string, HTMLElement, boolean][] = [
    ["Aim", list(before.aim), true],
    ["Limits", list(before.limits), true],
    ["Declared prior", list(before.prior), true],
    ["Model and certificate", list(before.model), true],
    ["Calibration", list(before.calibration), true],
    [worst(before.real_time), findings(before.real_time), false],
  ];
  byId("before-groups").replaceChildren(
    ...groups.map(([title, content, open]) => {
      const box = make("details");
      box.open = open;
      box.append(make("summary", title), content);
      return box;
    }),
  );
}

function worst(list: Finding[]): string {
  const bad = list.filter((f) => f.health === "bad").length;
  const warn = list.filter((f) => f.health === "warn").length;
  return `Real-time health: ${bad > 0 ? `✕ ${bad} bad, ` : ""}${warn > 0 ? `△ ${warn} to look at` : bad > 0 ? "" : "✓ good"}`.replace(/, $/, "");
}

export function showSelfTest(test: SelfTest | null): void {
  const host = byId("test-items");
  if (!test) {
    host.replaceChildren(make("p", "The device is tested when a spot starts."));
    return;
  }
  const table = make("table");
  const head = make("tr");
  for (const title of ["Item", "Result", "Found", "Accepted"]) {
    const cell = make("th", title);
    cell.scope = "col";
    head.append(cell);
  }
  table.append(make("caption", test.passed ? "✓ passed" : "✕ FAILED: not armed", test.passed ? "" : "alarm"), head);
  for (const item of test.items) {
    const row = make("tr");
    const name = make("th", item.name);
    name.scope = "row";
    const result = make("td");
    result.append(mark(item.good ? "good" : "bad"));
    row.append(name, result, make("td", item.found), make("td", item.accepted));
    table.append(row);
  }
  host.replaceChildren(table);
}

const kNumbers: [string, string, string, number][] = [
  ["peak_estimate_max_K", "Highest estimated peak", "K", 2],
  ["peak_true_max_K", "Highest true peak (simulated eye)", "K", 2],
  ["limit_K", "Limit", "K", 2],
  ["limit_violations", "Cycles above the limit", "", 0],
  ["time_to_95_percent_ms", "95 % of the reference after", "ms", 1],
  ["rms_error_after_50_ms_K", "RMS error after 50 ms", "K", 2],
  ["absorption_estimate", "Absorption factor", "", 3],
  ["absorption_sigma", "its standard deviation", "", 3],
  ["energy_mJ", "Energy", "mJ", 2],
  ["exposure_ms", "Exposure", "ms", 1],
  ["thermal_dose_upper", "Thermal dose, upper bound", "", -1],
  ["cycles", "Cycles", "", 0],
  ["overruns", "Overruns", "", 0],
  ["detections", "Noticed by the supervisor", "", 0],
  ["seed", "Seed", "", 0],
];

const written = (value: number, digits: number) =>
  digits < 0 ? value.toPrecision(3) : value.toFixed(digits);

export function showSpot(spot: Spot, token: string): void {
  byId("after").hidden = false;
  byId("after-title").textContent = `Spot ${spot.spot}: ${spot.stopped || spot.failure ? "▲ stopped" : "■ done"}`;
  byId("after-why").textContent = [spot.why, spot.failure, spot.what_to_do, spot.log_alarm && `The log is not complete: ${spot.log_alarm}`]
    .filter((words) => words)
    .join(" ");
  byId("after").classList.toggle("abnormal", Boolean(spot.stopped || spot.failure || spot.log_alarm));
  const lines = kNumbers
    .filter(([key]) => typeof spot[key] === "number")
    .map(([key, name, unit, digits]) => ({
      name,
      value: `${written(spot[key] as number, digits)} ${unit}`,
    }));
  byId("after-numbers").replaceChildren(...list([...lines, { name: "Run folder", value: spot.folder }]).children);
  const links = byId("after-links");
  links.replaceChildren();
  if (spot.failure) return;
  for (const [file, name] of [["report.html", "Report"], ["summary.json", "Summary"], ["run.csv", "Table"], ["config.toml", "Configuration"]]) {
    const link = make("a", name);
    link.href = `/runs/${spot.spot}/${file}?token=${encodeURIComponent(token)}`;
    link.target = "_blank";
    link.rel = "noopener";
    links.append(link, " ");
  }
}
