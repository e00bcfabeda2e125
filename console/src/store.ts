// The rows of the running spot, in memory of fixed size: what a spot of a minute at 1 kHz takes.
import { bucketSize, decimate } from "./decimate";

const kRows = 65536; // a power of two

export const kColumns = [
  "cycle",
  "time_s",
  "power_W",
  "power_command_W",
  "readback_W",
  "volume_measured_K",
  "volume_predicted_K",
  "peak_estimate_K",
  "peak_sigma_K",
  "peak_true_K",
  "absorption_estimate",
  "absorption_sigma",
  "wake_late_ns",
  "compute_ns",
  "slack_ns",
] as const;
export type Column = (typeof kColumns)[number];
type Cell = number | string | null;

export class Store {
  private data = new Map<Column, Float64Array>();
  private place = new Map<Column, number>();
  private words = new Map<string, number>();
  private first = 0; // numbers of the rows kept: [first, end)
  private end = 0;
  private last: Cell[] = [];
  missing = 0; // cycles that never came

  constructor() {
    for (const name of kColumns) this.data.set(name, new Float64Array(kRows));
  }

  setColumns(names: string[]): void {
    names.forEach((name, index) => this.words.set(name, index));
    for (const name of kColumns) this.place.set(name, names.indexOf(name));
  }

  clear(): void {
    this.first = this.end = this.missing = 0;
    this.last = [];
  }

  get size(): number {
    return this.end - this.first;
  }

  add(row: Cell[]): void {
    const cycle = row[this.place.get("cycle")!] as number;
    const before = this.size > 0 ? this.at("cycle", this.end - 1) : cycle - 1;
    if (cycle > before + 1) {
      this.missing += cycle - before - 1;
      this.push(null); // a gap in every curve
    }
    this.push(row);
    this.last = row;
  }

  private push(row: Cell[] | null): void {
    const slot = this.end & (kRows - 1);
    for (const name of kColumns) {
      const cell = row ? row[this.place.get(name)!] : null;
      this.data.get(name)![slot] = typeof cell === "number" ? cell : Number.NaN;
    }
    if (!row && this.size > 0) {
      for (const name of ["time_s", "cycle"] as const) {
        const kept = this.data.get(name)!;
        kept[slot] = kept[(this.end - 1) & (kRows - 1)];
      }
    }
    ++this.end;
    this.first = Math.max(this.first, this.end - kRows);
  }

  at(name: Column, row: number): number {
    return this.data.get(name)![row & (kRows - 1)];
  }

  /** Newest value of a column; NaN if there is none. */
  newest(name: Column): number {
    return this.size > 0 ? this.at(name, this.end - 1) : Number.NaN;
  }

  /** Newest word of a column. */
  word(name: string): string {
    const index = this.words.get(name);
    return index === undefined || this.last.length === 0 ? "" : String(this.last[index]);
  }

  /** The first row at or after a time, s. */
  private since(time: number): number {
    let low = this.first;
    let high = this.end;
    while (low < high) {
      const middle = (low + high) >> 1;
      if (this.at("time_s", middle) < time) low = middle + 1;
      else high = middle;
    }
    return low;
  }

  /**
   * Times, ms, and curves since `from`, s, with at most two points per pixel. All curves share the
   * times; within a bucket a curve has its smallest and its largest value, in the order they came.
   */
  curves(
    from: number,
    pixels: number,
    series: ((row: number) => number)[],
  ): [number[], ...(number | null)[][]] {
    const begin = this.since(from);
    const size = bucketSize(this.end - begin, pixels);
    const times: number[] = [];
    for (let row = begin; row < this.end; row += size) {
      times.push(this.at("time_s", row) * 1e3);
      if (size > 1) {
        const end = Math.min(row + size, this.end);
        times.push(this.at("time_s", (row + end - 1) >> 1) * 1e3);
      }
    }
    return [times, ...series.map((value) => decimate(value, begin, this.end, size))];
  }
}
