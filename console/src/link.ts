// The WebSocket: messages in, commands out, again and again until it holds.

export interface Live {
  type: "live";
  state: string;
  reason: string;
  spot: number;
  emission: boolean;
  power_W: number | null;
  cycle: number;
  planned_cycles: number;
  energy_J: number;
  exposure_s: number;
  thermal_dose: number;
  detections: number;
  overruns: number;
  dropped: number;
  age_ms: number | null;
  rows: (number | string | null)[][];
}
export interface Line {
  name: string;
  value: string;
}
export interface Finding {
  topic: string;
  health: string;
  found: string;
  advice: string;
}
export interface Before {
  type: "before";
  device: string;
  browser_starts: boolean;
  self_test_first: boolean;
  period_ms: number;
  peak_reference_K: number;
  peak_max_K: number;
  power_max_W: number;
  planned_ms: number;
  aim: Line[];
  limits: Line[];
  model: Line[];
  prior: Line[];
  calibration: Line[];
  real_time: Finding[];
}
export interface SelfTest {
  type: "self_test";
  passed: boolean;
  items: { name: string; good: boolean; found: string; accepted: string }[];
}
export interface Spot {
  type: "spot";
  spot: number;
  failure: string;
  state: string;
  why: string;
  what_to_do: string;
  stopped: boolean;
  folder: string;
  log_alarm: string;
  [number: string]: number | string | boolean | null;
}
export interface Hello {
  type: "hello";
  protocol: number;
  program: string;
  client: number;
  columns: { name: string; unit: string }[];
}
export interface Role {
  type: "role";
  operator: number;
  clients: number;
  choices: string[];
  run_on: boolean;
  spots: string[]; // that may be named
}
export interface SessionSpot {
  name: string;
  x_um: number;
  y_um: number;
  reference_K: number;
  duration_ms: number;
  most_energy_mJ: number;
  ending: string;
  words: string;
  wanted: boolean;
  attempts: number;
  run?: number;
  why?: string;
  energy_mJ?: number | null;
  peak_K?: number | null;
  peak_is_true?: boolean;
}
export interface Session {
  type: "session";
  title: string;
  folder: string;
  phase: string;
  spot: string;
  why: string;
  pause_ms: number;
  begun_unix_s: number;
  limits: { name: string; used: number | null; most: number | null; unit: string }[];
  spots: SessionSpot[];
}
export interface Answer {
  type: "answer";
  command: string;
  done: boolean;
  why: string;
}
export type Message = Live | Before | SelfTest | Spot | Hello | Role | Session | Answer;

const kRetryMs = 300;

/** The token is in the address's fragment, which no browser sends; kept for a reload. */
export function token(): string {
  const given = new URLSearchParams(location.hash.slice(1)).get("token");
  if (given) sessionStorage.setItem("token", given);
  return given ?? sessionStorage.getItem("token") ?? "";
}

export class Link {
  private socket: WebSocket | null = null;
  private ever = false;

  constructor(
    private readonly heard: (message: Message) => void,
    private readonly changed: (connected: boolean, ever: boolean) => void,
  ) {
    this.connect();
  }

  get connected(): boolean {
    return this.socket?.readyState === WebSocket.OPEN;
  }

  /** False: not sent, there is no connection. */
  send(command: string): boolean {
    if (!this.connected) return false;
    this.socket!.send(JSON.stringify({ command }));
    return true;
  }

  private connect(): void {
    const socket = new WebSocket(`ws://${location.host}/ws?token=${encodeURIComponent(token())}`);
    this.socket = socket;
    socket.onopen = () => {
      this.ever = true;
      this.changed(true, true);
    };
    socket.onmessage = (event) => this.heard(JSON.parse(event.data as string) as Message);
    socket.onclose = () => {
      if (this.socket !== socket) return;
      this.changed(false, this.ever);
      setTimeout(() => this.connect(), kRetryMs);
    };
  }
}
