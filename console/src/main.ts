// The page: what the server says onto the screen, what the operator wants to the server.
import { Charts } from "./charts";
import { Link, type Before, type Live, type Message, type Role, type Session, token } from "./link";
import { byId, showBefore, showSelfTest, showSpot } from "./panels";
import { sessionWords, showLimits, showSession } from "./session";
import { Store } from "./store";

const kStaleMs = 250;

const kStates: Record<string, [string, string]> = {
  off: ["○ OFF", ""],
  self_test: ["◌ SELF-TEST", "Testing."],
  standby: ["○ STANDBY", "Not armed: nothing can be emitted."],
  ready: ["◐ READY", "Armed: Start emits."],
  treating: ["● TREATING", "The loop runs; it ends by itself, or by STOP."],
  done: ["■ DONE", "Over. Prepare the next spot when this one is understood."],
  safe_stop: ["▲ SAFE STOP", "Latched at 0 W: read why below, then prepare the next spot."],
};

const kOverInSession: Record<string, string> = {
  done: "Over: nothing is emitted.",
  safe_stop: "Latched at 0 W: read why below.",
};

const store = new Store();
let charts: Charts | null = null;
let before: Before | null = null;
let live: Live | null = null;
let me = 0;
let operator = 0;
let role: Role | null = null;
let session: Session | null = null;
let heardAt = performance.now();
let paused = false;
let fresh = false;
let stopAt = 0; // when STOP was sent and 0 W is not yet reported

const text = (id: string, value: string) => {
  const element = byId(id);
  if (element.textContent !== value) element.textContent = value;
};
const show = (id: string, visible: boolean) => {
  byId(id).hidden = !visible;
};

const link = new Link(heard, (connected, ever) => {
  if (!connected) {
    operator = me = 0;
    role = null;
    text("role", "");
    drawSession();
    banner(
      ever
        ? "NO CONNECTION. What is shown is old; the laser's state is not known here. Stop at the device or the terminal. Reconnecting…"
        : "No connection. Is the address complete, with its token? Trying again…",
    );
  }
  controls();
});

function banner(words: string): void {
  const element = byId("banner");
  if (element.textContent !== words) element.textContent = words;
  element.hidden = words === "";
}

function heard(message: Message): void {
  heardAt = performance.now();
  switch (message.type) {
    case "hello":
      me = message.client;
      store.setColumns(message.columns.map((column) => column.name));
      text("program", `${message.program}.`);
      break;
    case "before":
      before = message;
      showBefore(message);
      showSelfTest(null);
      charts?.destroy();
      charts = new Charts(byId("charts"), message);
      fresh = true;
      break;
    case "self_test":
      showSelfTest(message);
      break;
    case "role":
      operator = message.operator;
      role = message;
      text("role", roleWords(message.clients));
      drawSession();
      break;
    case "session":
      session = message;
      drawSession();
      break;
    case "live":
      onLive(message);
      break;
    case "spot":
      showSpot(message, token());
      if (charts && live?.state !== "treating") setWhole(true);
      break;
    case "answer":
      if (!message.done) text("answer", `${message.command}: ${message.why}.`);
      else if (message.command !== "stop") text("answer", "");
      break;
  }
  controls();
}

function drawSession(): void {
  if (!session) return;
  text("session-words", sessionWords(session));
  text("spot-number", session.spot || "–");
  document.body.classList.add("with-session");
  showSession(session, role, operator === me && me > 0, token(), (command) => link.send(command));
}

function roleWords(clients: number): string {
  const tabs = clients === 1 ? "1 tab" : `${clients} tabs`;
  if (operator === me && me > 0) return `This tab operates (${tabs} open).`;
  return operator === 0 ? `Nobody operates (${tabs} open).` : `This tab watches; STOP works (${tabs} open).`;
}

function onLive(message: Live): void {
  if (live && message.spot !== live.spot) {
    store.clear();
    setWhole(false);
    show("after", false);
  }
  live = message;
  for (const row of message.rows) store.add(row);
  fresh ||= message.rows.length > 0;
  const power = message.power_W ?? 0;
  if (stopAt > 0 && !message.emission) {
    text("answer", `0 W reported ${(performance.now() - stopAt).toFixed(0)} ms after STOP.`);
    stopAt = 0;
  }
  text("emission", message.emission ? `☀ ${(power * 1e3).toFixed(1)} mW` : "○ none, 0 W");
  text("energy", (message.energy_J * 1e3).toFixed(2));
  text("exposure", (message.exposure_s * 1e3).toFixed(0));
  text("dose", message.thermal_dose.toPrecision(3));
  if (!session) text("spot-number", message.spot > 0 ? String(message.spot) : "");
  byId("emission-box").classList.toggle("alarm", message.emission);
  byId("state-box").classList.toggle("alarm", message.state === "safe_stop");
  stateWords(message);
}

function stateWords(message: Live): void {
  const [name, words] = kStates[message.state] ?? [message.state, ""];
  text("state", name);
  const over = message.state === "done" || message.state === "safe_stop";
  const parts = [session && over ? kOverInSession[message.state] : words];
  if (message.state === "treating") {
    parts.push(`Cycle ${message.cycle} of ${message.planned_cycles}.`);
    const reason = store.word("safety_reason");
    parts.push(`Supervisor: ${!reason || reason === "none" ? "no objection" : reason.replaceAll("_", " ")}.`);
  }
  if (message.overruns > 0) parts.push(`△ ${message.overruns} overruns.`);
  if (message.detections > 0) parts.push(`△ ${message.detections} noticed by the supervisor.`);
  if (message.dropped + store.missing > 0) parts.push(`△ ${message.dropped + store.missing} cycles not shown here; the log has them.`);
  if (before && !before.browser_starts) parts.push("A device is started at the terminal or by its foot switch.");
  text("state-words", parts.filter((part) => part).join(" "));
}

function controls(): void {
  const state = live?.state ?? "off";
  const mine = link.connected && me > 0 && operator === me;
  const can = mine && (before?.browser_starts ?? false);
  show("arm", can && state === "standby");
  show("start", can && state === "ready");
  show("disarm", can && state === "ready");
  const over = state === "done" || state === "safe_stop";
  show("reset", can && over && (!session || session.phase === "before"));
  text("reset", session ? "Test again" : "Prepare next spot");
  sessionControls(mine, can);
  show("operate", link.connected && me > 0 && operator === 0);
  show("release", mine);
}

function sessionControls(mine: boolean, can: boolean): void {
  show("session-buttons", mine && session !== null);
  show("session-words", session !== null);
  if (!session) return;
  const choices = role?.choices ?? [];
  for (const choice of ["accept", "skip", "continue", "end"]) show(choice, choices.includes(choice));
  show("repeat", choices.includes("repeat") && session.phase === "after");
  show("run_on", can && session.phase !== "ended");
  byId("run_on").setAttribute("aria-pressed", String(role?.run_on ?? false));
}

function stop(): void {
  if (link.send("stop")) {
    if (live?.emission) stopAt = performance.now();
    text("answer", live?.emission ? "STOP sent." : "STOP sent: nothing was emitted.");
  } else {
    text("answer", "STOP could not be sent: no connection. Stop at the device or the terminal.");
  }
}

function setWhole(whole: boolean): void {
  if (charts) charts.whole = whole;
  byId("whole").setAttribute("aria-pressed", String(whole));
  fresh = true;
}

// Twenty times a second, whatever comes or does not come.
function watch(): void {
  const silent = performance.now() - heardAt;
  const age = Math.max(silent, (live?.age_ms ?? 0) + silent);
  const stale = age > kStaleMs;
  document.body.classList.toggle("stale", stale);
  byId("age-box").classList.toggle("alarm", stale);
  text("age", age.toFixed(0));
  if (!link.connected) return;
  if (stale) banner(`NO DATA for ${(age * 1e-3).toFixed(1)} s. What is shown is old.`);
  else banner("");
}

function draw(): void {
  if (fresh && !paused && charts && !document.hidden) {
    charts.draw(store);
    fresh = false;
  }
  requestAnimationFrame(draw);
}

// Space is STOP wherever the focus is; a button that has it is not pressed.
for (const phase of ["keydown", "keyup"] as const) {
  addEventListener(
    phase,
    (event) => {
      if (event.key !== " " || event.ctrlKey || event.altKey || event.metaKey) return;
      event.preventDefault();
      event.stopImmediatePropagation();
      if (phase === "keydown" && !event.repeat) stop();
    },
    true,
  );
}
byId("stop").addEventListener("pointerdown", stop);
byId("stop").addEventListener("click", (event) => {
  if (event.detail === 0) stop(); // by Enter: a pointer has stopped already
});
for (const command of ["arm", "disarm", "start", "reset", "operate", "release", "accept", "repeat", "skip", "continue", "end"]) {
  byId(command).addEventListener("click", () => link.send(command));
}
byId("run_on").addEventListener("click", () => link.send(role?.run_on ? "run_off" : "run_on"));
byId("pause").addEventListener("click", () => {
  paused = !paused;
  byId("pause").setAttribute("aria-pressed", String(paused));
  fresh = true;
});
byId("whole").addEventListener("click", () => setWhole(!(charts?.whole ?? false)));
matchMedia("(prefers-color-scheme: dark)").addEventListener("change", () => {
  charts?.rebuild();
  fresh = true;
});
setInterval(watch, 50);
setInterval(() => session && showLimits(session), 1000);
requestAnimationFrame(draw);
controls();
