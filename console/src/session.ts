// A session's spots: what is next, a map, a list, its limits. An outcome has a shape and a word
// beside its colour; the list says all that the map shows.
import type { Role, Session, SessionSpot } from "./link";
import { byId, list, make } from "./panels";

const kNamespace = "http://www.w3.org/2000/svg";

// Of radius 1 around (0, 0); class of its colour.
const kCircle = "M-1 0a1 1 0 1 0 2 0a1 1 0 1 0-2 0Z";
const kShapes: Record<string, [string, string]> = {
  planned: [kCircle, "open"],
  treated: [kCircle, "full"],
  "goal-missed": ["M0-1L1 .8H-1Z", "full"],
  "over-limit": ["M0-1.15L1.15 0L0 1.15L-1.15 0Z", "alarm"],
  stopped: ["M-.9-.9H.9V.9H-.9Z", "alarm"],
  "device-fault": ["M-.85-.85L.85 .85M-.85 .85L.85-.85", "alarm-line"],
  interrupted: ["M-.8-.8H.8V.8H-.8ZM-.8 .8L.8-.8", "warn"],
  "may-have-emitted": [`${kCircle}M-.3-.3A.32 .32 0 1 1 .1 .1L0 .3M0 .5V.6`, "warn"],
  skipped: ["M-.9 0H.9", "open"],
  running: ["M-.7-1L1 0L-.7 1Z", "full"],
};

function svg(tag: string, attributes: Record<string, string | number>): SVGElement {
  const element = document.createElementNS(kNamespace, tag);
  for (const [name, value] of Object.entries(attributes)) element.setAttribute(name, String(value));
  return element;
}

function shape(kind: string, x: number, y: number, radius: number): SVGElement {
  const [path, style] = kShapes[kind] ?? kShapes.planned;
  return svg("path", {
    d: path,
    class: `spot ${style}`,
    transform: `translate(${x.toFixed(1)} ${y.toFixed(1)}) scale(${radius.toFixed(2)})`,
  });
}

function key(kind: string): SVGElement {
  const box = svg("svg", { viewBox: "0 0 16 16", width: 16, height: 16, class: "spot-key", "aria-hidden": "true" });
  box.append(shape(kind, 8, 8, 6));
  return box;
}

const running = (session: Session, spot: SessionSpot) =>
  spot.name === session.spot && (session.phase === "treating" || session.phase === "writing");
const kindOf = (session: Session, spot: SessionSpot) => (running(session, spot) ? "running" : spot.ending);
function wordsOf(session: Session, spot: SessionSpot): string {
  if (running(session, spot)) return session.phase === "treating" ? "running" : "being written";
  return spot.wanted && spot.attempts > 0 ? `${spot.words}; to be repeated` : spot.words;
}

function nearest(spots: SessionSpot[]): number {
  let least = Infinity;
  for (let i = 0; i < spots.length; ++i) {
    for (let k = 0; k < i; ++k) {
      const distance = Math.hypot(spots[i].x_um - spots[k].x_um, spots[i].y_um - spots[k].y_um);
      if (distance > 0) least = Math.min(least, distance);
    }
  }
  return least;
}

let gap = { of: "", um: Infinity }; // of the plan that is shown

function drawMap(session: Session): void {
  const spots = session.spots;
  if (gap.of !== session.folder) gap = { of: session.folder, um: nearest(spots) };
  const xs = spots.map((spot) => spot.x_um);
  const ys = spots.map((spot) => spot.y_um);
  const left = Math.min(...xs);
  const top = Math.max(...ys);
  const across = Math.max(...xs) - left;
  const down = top - Math.min(...ys);
  const margin = 30;
  const width = 360;
  const scale = Math.min(
    (width - 2 * margin) / Math.max(across, 1e-3),
    (260 - 2 * margin) / Math.max(down, 1e-3),
    64 / gap.um,
  );
  const fits = Number.isFinite(scale) && across + down > 0 ? scale : 1;
  const radius = Math.min(10, Math.max(2.5, 0.26 * gap.um * fits));
  const names = gap.um * fits >= 30 || spots.length === 1;
  const inset = (width - across * fits) / 2;
  const height = 2 * margin + down * fits;
  const drawing = svg("svg", { viewBox: `0 0 ${width} ${height.toFixed(1)}`, role: "img" });
  drawing.setAttribute("aria-label", `Map of ${spots.length} spots; the list says what became of each`);
  for (const spot of spots) {
    const x = inset + (spot.x_um - left) * fits;
    const y = margin + (top - spot.y_um) * fits;
    const group = svg("g", {});
    const title = svg("title", {});
    title.textContent = `${spot.name}: ${wordsOf(session, spot)}`;
    group.append(title, shape(kindOf(session, spot), x, y, radius));
    if (spot.name === session.spot) group.append(svg("circle", { cx: x, cy: y, r: radius + 4, class: "spot now" }));
    if (names) {
      const label = svg("text", { x, y: y + radius + 14, "text-anchor": "middle" });
      label.textContent = spot.name;
      group.append(label);
    }
    drawing.append(group);
  }
  byId("map").replaceChildren(drawing);
}

function cell(tag: "td" | "th", ...content: (string | Node)[]): HTMLTableCellElement {
  const made = make(tag);
  made.append(...content);
  return made;
}

function row(session: Session, spot: SessionSpot, token: string, repeat: ((spot: string) => void) | null): HTMLElement {
  const made = make("tr");
  if (spot.name === session.spot) made.setAttribute("aria-current", "true");
  const name = cell("th", spot.name);
  name.scope = "row";
  const words = make("span", ` ${wordsOf(session, spot)}`);
  const outcome = cell("td", key(kindOf(session, spot)), words);
  if (spot.why && !running(session, spot) && spot.ending !== "treated") outcome.append(make("small", spot.why));
  const known = spot.run !== undefined && !running(session, spot);
  const peak = known && typeof spot.peak_K === "number" ? `${spot.peak_K.toFixed(2)} K` : "";
  const energy = known && typeof spot.energy_mJ === "number" ? `${spot.energy_mJ.toFixed(2)} mJ` : "";
  const numbers = cell("td", peak, make("br"), energy);
  const acts = cell("td");
  if (known && spot.ending !== "may-have-emitted") {
    const link = make("a", "Report");
    link.href = `/runs/${spot.run}/report.html?token=${encodeURIComponent(token)}`;
    link.target = "_blank";
    link.rel = "noopener";
    link.setAttribute("aria-label", `Report of ${spot.name}`);
    acts.append(link);
  }
  if (repeat) {
    const button = make("button", "Repeat");
    button.type = "button";
    button.setAttribute("aria-label", `Repeat ${spot.name}`);
    button.addEventListener("click", () => repeat(spot.name));
    acts.append(button);
  }
  made.append(name, outcome, numbers, acts);
  return made;
}

/** What of the session's limits is used up; the time goes on by itself. */
export function showLimits(session: Session): void {
  const next = session.spots.find((spot) => spot.name === session.spot);
  const lines = session.limits.map((limit) => {
    const elapsed = session.begun_unix_s > 0 ? Date.now() * 1e-3 - session.begun_unix_s : 0;
    const used = limit.used ?? elapsed;
    const digits = limit.unit === "mJ" ? 2 : 0;
    const amount = [used.toFixed(digits), limit.most === null ? "" : `of ${limit.most}`, limit.unit];
    const value = amount.filter((word) => word).join(" ");
    return { name: limit.name, value: limit.most === null ? `${value}, not limited` : value };
  });
  if (next && session.phase === "before") {
    lines.push({ name: "Next spot at most", value: `${next.most_energy_mJ.toFixed(2)} mJ` });
  }
  lines.push({ name: "Folder", value: session.folder });
  byId("session-limits").replaceChildren(list(lines));
}

/** One sentence of what the session does or waits for. */
export function sessionWords(session: Session): string {
  const spot = session.spots.find((one) => one.name === session.spot);
  const plan = spot ? `${spot.reference_K} K, ${spot.duration_ms} ms` : "";
  switch (session.phase) {
    case "preparing":
      return "Preparing the next spot.";
    case "before":
      return `Spot ${session.spot} is next: ${plan}.`;
    case "starting":
      return `Spot ${session.spot} begins${session.pause_ms > 0 ? `, after the pause of ${session.pause_ms} ms` : ""}.`;
    case "treating":
      return `Spot ${session.spot}: ${plan}.`;
    case "writing":
      return `Spot ${session.spot} is over; its files are being written.`;
    case "after":
      return `Spot ${session.spot}: ${spot?.words ?? "over"}. Accept it, or have it repeated.`;
    default:
      return `The session has ended: ${session.why}`.replace(/\.?$/, ".");
  }
}

export function showSession(session: Session, role: Role | null, operates: boolean, token: string, send: (command: string) => void): void {
  byId("session").hidden = false;
  const done = session.spots.filter((spot) => ["treated", "goal-missed", "over-limit"].includes(spot.ending)).length;
  byId("session-title").textContent = `Session: ${session.title}`;
  byId("session-count").textContent = `${done} of ${session.spots.length} spots treated.`;
  drawMap(session);
  const may = new Set(operates && role?.choices?.includes("repeat") ? role.spots : []);
  const body = make("tbody");
  for (const spot of session.spots) {
    body.append(row(session, spot, token, may.has(spot.name) ? (name) => send(`repeat ${name}`) : null));
  }
  const host = byId("spots");
  const focused = (document.activeElement as HTMLElement | null)?.getAttribute("aria-label");
  host.querySelector("tbody")!.replaceWith(body);
  if (focused) host.querySelector<HTMLElement>(`[aria-label="${focused}"]`)?.focus();
  showLimits(session);
}
