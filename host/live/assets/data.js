"use strict";
// The last samples, with the least and the largest value of every block, so that a long view is drawn from few numbers.
const CAPACITY = 10 * 65536, BLOCK = 64;

class Ring {
  constructor(columns) {
    this.columns = columns;
    this.count = 0;
    this.data = columns.map(() => new Float64Array(CAPACITY));
    this.low = columns.map(() => new Float64Array(CAPACITY / BLOCK));
    this.high = columns.map(() => new Float64Array(CAPACITY / BLOCK));
    this.t = this.data[0];
    this.period = 0.001;
  }
  // Number of the oldest sample; the block that is being overwritten is left out.
  get first() { return Math.max(0, (Math.floor(this.count / BLOCK) + 1) * BLOCK - CAPACITY); }
  at(column, k) { return this.data[column][k % CAPACITY]; }
  push(values) {
    const slot = this.count % CAPACITY, block = Math.floor(slot / BLOCK), fresh = slot % BLOCK === 0;
    for (let c = 0; c < values.length; c++) {
      const v = values[c];
      this.data[c][slot] = v;
      if (fresh || v < this.low[c][block]) this.low[c][block] = v;
      if (fresh || v > this.high[c][block]) this.high[c][block] = v;
    }
    this.count++;
  }
  // Number of the first sample at or after a time.
  find(time) {
    let a = this.first, b = this.count;
    while (a < b) { const m = (a + b) >>> 1; if (this.at(0, m) < time) a = m + 1; else b = m; }
    return a;
  }
  nearest(time) {
    if (!this.count) return -1;
    const k = Math.min(this.find(time), this.count - 1);
    return k > this.first && Math.abs(this.at(0, k - 1) - time) < Math.abs(this.at(0, k) - time) ? k - 1 : k;
  }
  // The samples a to b of some columns for `pixels` places: all, or the least and the largest of each step. Steps begin
  // at multiples of their length, so that a picture that scrolls does not flicker. A gap gives an empty value.
  picture(columns, a, b, pixels) {
    const out = [[]].concat(columns.map(() => [])), x = out[0];
    a = Math.max(a, this.first); b = Math.min(b, this.count);
    const limit = 1.5 * this.period, gap = () => { for (let i = 1; i < out.length; i++) out[i].push(null); };
    if (b - a <= 3 * pixels) {
      for (let k = a; k < b; k++) {
        const t = this.at(0, k);
        if (k > a && t - this.at(0, k - 1) > limit) { x.push((t + this.at(0, k - 1)) / 2); gap(); }
        x.push(t);
        for (let i = 0; i < columns.length; i++) out[i + 1].push(this.at(columns[i], k));
      }
      return out;
    }
    let step = Math.ceil((b - a) / pixels);
    const whole = step >= BLOCK;
    if (whole) step = Math.ceil(step / BLOCK) * BLOCK;
    for (let k = Math.floor(a / step) * step; k < b; k += step) {
      const from = Math.max(k, this.first), to = Math.min(k + step, this.count);
      if (to <= from) continue;
      const t0 = this.at(0, from), t1 = this.at(0, to - 1);
      x.push(t0, Math.max((t0 + t1) / 2, t0));
      for (let i = 0; i < columns.length; i++) {
        const c = columns[i];
        let low = Infinity, high = -Infinity;
        if (whole) {
          for (let j = from; j < to; j += BLOCK) {
            const n = Math.floor((j % CAPACITY) / BLOCK);
            if (this.low[c][n] < low) low = this.low[c][n];
            if (this.high[c][n] > high) high = this.high[c][n];
          }
        } else {
          for (let j = from; j < to; j++) { const v = this.at(c, j); if (v < low) low = v; if (v > high) high = v; }
        }
        out[i + 1].push(low, high);
      }
      if (t1 - t0 > (to - from) * limit || (to < b && this.at(0, to) - t1 > limit)) { x.push(t1); gap(); }
    }
    return out;
  }
}

// Numbers with the digits that their step needs, and an ASCII minus.
function fixed(value, digits) {
  const text = value.toFixed(Math.min(Math.max(digits, 0), 12));
  return /^-0(\.0*)?$/.test(text) ? text.slice(1) : text;
}
function significant(value, digits) {
  if (value == null || !isFinite(value)) return "-";
  if (value === 0) return "0";
  const size = Math.floor(Math.log10(Math.abs(value)));
  return size < -4 || size > 5 ? value.toExponential(digits - 1) : fixed(value, digits - 1 - size);
}
