// Fewer points for the screen, no spike lost: of every bucket of samples the smallest and the
// largest, in the order in which they came.

/** Where the samples of a bucket begin and end, for at most `buckets` of them. */
export function bucketSize(samples: number, buckets: number): number {
  return Math.max(1, Math.ceil(samples / Math.max(1, buckets)));
}

/** Writes the indices of the smallest and the largest value in [from, to) into `out` at `at`. */
export function extremes(
  value: (index: number) => number,
  from: number,
  to: number,
  out: Int32Array,
  at: number,
): void {
  let low = -1;
  let high = -1;
  for (let i = from; i < to; ++i) {
    const v = value(i);
    if (Number.isNaN(v)) continue;
    if (low < 0 || v < value(low)) low = i;
    if (high < 0 || v > value(high)) high = i;
  }
  out[at] = Math.min(low, high);
  out[at + 1] = Math.max(low, high);
}

/**
 * Two points per bucket for one series. A bucket without a value, or with a gap in it, gives nulls.
 */
export function decimate(
  value: (index: number) => number,
  from: number,
  to: number,
  size: number,
): (number | null)[] {
  const points: (number | null)[] = [];
  const found = new Int32Array(2);
  for (let begin = from; begin < to; begin += size) {
    const end = Math.min(begin + size, to);
    if (size === 1) {
      const v = value(begin);
      points.push(Number.isNaN(v) ? null : v);
      continue;
    }
    extremes(value, begin, end, found, 0);
    for (const index of found) points.push(index < 0 ? null : value(index));
  }
  return points;
}
