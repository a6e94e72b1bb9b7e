//! Zero-phase low-pass of many signals at once, computed only at the rows that are kept.
//!
//! A forward and a backward pass through H are one convolution with the two-sided response of H(z)·H(1/z). All poles of
//! H are simple, so partial fractions give h(m) = d·δ(m) + Σ ρₖ·pₖ^|m| over the poles pₖ (the parallel form; Oppenheim
//! & Schafer, Discrete-Time Signal Processing, §6.3): a sum over the past and a sum over the future of the sample. Both
//! sums are needed only at kept rows. A block of samples between two kept rows enters by its sums Σ p^i·x, two real
//! ones per pole and direction. All recursions run at the rate of the kept rows. At one row in 33 and order 8 a sample
//! costs 16 multiplications instead of the 40 of the sections, without a recursion from sample to sample. Except for
//! rounding the result equals that of [`LowPass::zero_phase`], including the ends.

use nalgebra::Complex;

use super::filter::LowPass;

/// Poles that are processed together: conjugate pairs, or a single real pole.
const POLES: usize = 4;
/// Real and imaginary part of each pole in a group.
const PARTS: usize = 2 * POLES;
/// Minimum number of buffered blocks beyond the future memory: more blocks mean fewer repeated sums over the future.
const WINDOW: usize = 128;

/// A group of poles: real parts first, then imaginary parts. Unused places are zero.
#[derive(Clone, Debug, PartialEq)]
struct Group {
    /// Row i of a block: p^(step−1−i) for the past, then p^(i+1) for the future.
    weights: Vec<[f64; 2 * PARTS]>,
    /// p^step.
    power: [f64; PARTS],
    /// ρ, doubled where the pole stands for a conjugate pair.
    residue: [f64; PARTS],
    /// 1/(1 − p): sum over a constant past.
    past: [f64; PARTS],
    /// p/(1 − p): sum over a constant future.
    future: [f64; PARTS],
}

fn parts(values: impl Iterator<Item = Complex<f64>>) -> [f64; PARTS] {
    let mut out = [0.0; PARTS];
    for (k, value) in values.enumerate().take(POLES) {
        (out[k], out[POLES + k]) = (value.re, value.im);
    }
    out
}

/// `sums + power·state`, complex.
#[inline(always)]
fn advance(state: &[f64; PARTS], power: &[f64; PARTS], sums: &[f64; PARTS]) -> [f64; PARTS] {
    let mut next = *sums;
    for k in 0..POLES {
        let (re, im) = (state[k], state[POLES + k]);
        next[k] += power[k] * re - power[POLES + k] * im;
        next[POLES + k] += power[k] * im + power[POLES + k] * re;
    }
    next
}

/// Real part of `residue·state`, summed over the poles.
#[inline(always)]
fn real_part(state: &[f64; PARTS], residue: &[f64; PARTS]) -> f64 {
    let mut terms = [0.0; POLES];
    for k in 0..POLES {
        terms[k] = residue[k] * state[k] - residue[POLES + k] * state[POLES + k];
    }
    (terms[0] + terms[1]) + (terms[2] + terms[3])
}

/// A low-pass in parallel form that keeps one row in every `step`.
#[derive(Clone, Debug, PartialEq)]
pub struct Decimator {
    groups: Vec<Group>,
    direct: f64,
    step: usize,
    /// Blocks after which the future has no effect any more.
    memory: usize,
}

impl Decimator {
    /// Builds the form for `filter` forward and backward, with one row kept in every `step` ≥ 1.
    pub fn new(filter: &LowPass, step: usize) -> Self {
        let step = step.max(1);
        let one = Complex::new(1.0, 0.0);
        let all: Vec<Complex<f64>> = filter
            .poles()
            .iter()
            .flat_map(|p| [Some(*p), (p.im != 0.0).then(|| p.conj())])
            .flatten()
            .collect();
        let gain = filter.leading().powi(2);
        let residue = |p: Complex<f64>| {
            let ratio = (one + p) * (one + p) / p;
            let mut value = Complex::new(gain, 0.0);
            // Factor by factor, so that powers of high order neither overflow nor underflow.
            for other in &all {
                value *= ratio / (one - other * p);
                if *other != p {
                    value /= one - other / p;
                }
            }
            if p.im == 0.0 { value } else { value * 2.0 }
        };
        let groups = filter
            .poles()
            .chunks(POLES)
            .map(|poles| {
                let of =
                    |f: &dyn Fn(Complex<f64>) -> Complex<f64>| parts(poles.iter().map(|p| f(*p)));
                let weights = (0..step)
                    .map(|i| {
                        let past = of(&|p| p.powu((step - 1 - i) as u32));
                        let future = of(&|p| p.powu((i + 1) as u32));
                        let mut row = [0.0; 2 * PARTS];
                        row[..PARTS].copy_from_slice(&past);
                        row[PARTS..].copy_from_slice(&future);
                        row
                    })
                    .collect();
                Group {
                    weights,
                    power: of(&|p| p.powu(step as u32)),
                    residue: of(&residue),
                    past: of(&|p| one / (one - p)),
                    future: of(&|p| p / (one - p)),
                }
            })
            .collect();
        let last: Complex<f64> = all.iter().map(|p| -p).product();
        Self {
            groups,
            direct: gain / last.re,
            step,
            memory: filter.settle_samples().div_ceil(step) + 1,
        }
    }

    /// Returns the step: one row in this number is kept.
    pub fn step(&self) -> usize {
        self.step
    }

    /// Returns a stream for `columns` signals.
    pub fn stream(&self, columns: usize) -> Stream<'_> {
        let capacity = self.memory + self.memory.max(WINDOW);
        let groups = self.groups.len();
        Stream {
            form: self,
            columns,
            capacity,
            filled: 0,
            done: 0,
            started: false,
            past: vec![[0.0; PARTS]; groups * columns],
            future: vec![[0.0; PARTS]; groups * columns * capacity],
            outputs: vec![0.0; columns * capacity],
            last: vec![0.0; columns],
        }
    }
}

/// Signals that pass through a [`Decimator`], in constant memory.
///
/// Rows come in blocks of [`Decimator::step`]; each block ends at a kept row. The signals are assumed constant before
/// the first row and after the last one.
#[derive(Clone, Debug)]
pub struct Stream<'a> {
    form: &'a Decimator,
    columns: usize,
    /// Number of blocks in the buffer.
    capacity: usize,
    filled: usize,
    /// Number of blocks already returned.
    done: usize,
    started: bool,
    /// Sums over the past at the last kept row, [group][column].
    past: Vec<[f64; PARTS]>,
    /// Sums over each block as the future of the kept row before it, [group][column][block].
    future: Vec<[f64; PARTS]>,
    /// Contribution of the past, [column][block].
    outputs: Vec<f64>,
    /// Last value of each column.
    last: Vec<f64>,
}

#[inline(always)]
fn block_sums(rows: &[f64], weights: &[[f64; 2 * PARTS]]) -> [f64; 2 * PARTS] {
    let mut sums = [0.0; 2 * PARTS];
    for (x, w) in rows.iter().zip(weights) {
        for k in 0..2 * PARTS {
            sums[k] += x * w[k];
        }
    }
    sums
}

impl Stream<'_> {
    /// Takes `blocks` blocks; column c starts at `chunk[c·stride]`. Calls `take(first, c, values)` with the finished
    /// filtered values of column c at the kept rows `first`, `first + 1`, …, counted from the first block.
    pub fn push(
        &mut self,
        chunk: &[f64],
        stride: usize,
        blocks: usize,
        take: &mut dyn FnMut(usize, usize, &[f64]),
    ) {
        let step = self.form.step;
        let mut from = 0;
        while from < blocks {
            let count = (blocks - from).min(self.capacity - self.filled);
            for c in 0..self.columns {
                let start = c * stride + from * step;
                self.push_column(c, &chunk[start..start + count * step]);
            }
            self.started = true;
            self.filled += count;
            from += count;
            if self.filled == self.capacity {
                self.hand_out(false, take);
            }
        }
    }

    fn push_column(&mut self, c: usize, rows: &[f64]) {
        let (step, capacity) = (self.form.step, self.capacity);
        let (Some(&first), Some(&last)) = (rows.first(), rows.last()) else {
            return;
        };
        self.last[c] = last;
        let out = &mut self.outputs[c * capacity + self.filled..];
        for (block, y) in rows.chunks_exact(step).zip(out.iter_mut()) {
            *y = self.form.direct * block[step - 1];
        }
        for (g, group) in self.form.groups.iter().enumerate() {
            let place = g * self.columns + c;
            let mut state = if self.started {
                self.past[place]
            } else {
                group.past.map(|p| p * first)
            };
            let future = &mut self.future[place * capacity + self.filled..];
            for ((block, ahead), y) in rows.chunks_exact(step).zip(future).zip(out.iter_mut()) {
                let sums = block_sums(block, &group.weights);
                let (past, coming) = sums.split_at(PARTS);
                let (Ok(past), Ok(coming)) = (past.try_into(), coming.try_into()) else {
                    continue;
                };
                state = advance(&state, &group.power, past);
                *ahead = coming;
                *y += real_part(&state, &group.residue);
            }
            self.past[place] = state;
        }
    }

    /// Sums the future backwards and returns all kept rows whose future is known, or all rows at the end.
    fn hand_out(&mut self, end: bool, take: &mut dyn FnMut(usize, usize, &[f64])) {
        let capacity = self.capacity;
        let ready = if end {
            self.filled
        } else {
            self.filled - self.form.memory
        };
        for c in 0..self.columns {
            let outputs = &mut self.outputs[c * capacity..(c + 1) * capacity];
            for (g, group) in self.form.groups.iter().enumerate() {
                let place = (g * self.columns + c) * capacity;
                let future = &mut self.future[place..place + capacity];
                let mut state = if end {
                    group.future.map(|p| p * self.last[c])
                } else {
                    [0.0; PARTS]
                };
                for b in (0..self.filled).rev() {
                    if b < ready {
                        outputs[b] += real_part(&state, &group.residue);
                    }
                    state = advance(&state, &group.power, &future[b]);
                }
                future.copy_within(ready..self.filled, 0);
            }
            take(self.done, c, &outputs[..ready]);
            outputs.copy_within(ready..self.filled, 0);
        }
        self.filled -= ready;
        self.done += ready;
    }

    /// Returns the remaining rows; the signals are assumed constant after their last row.
    pub fn finish(mut self, take: &mut dyn FnMut(usize, usize, &[f64])) {
        self.hand_out(true, take);
    }
}

#[cfg(test)]
#[allow(clippy::unwrap_used)]
mod tests {
    use super::*;
    use rand::{RngExt, SeedableRng};

    /// Compares with the sections run forward and backward, which define the filter.
    #[test]
    fn parallel_form_gives_what_the_sections_give() {
        let mut g = rand_pcg::Pcg64::seed_from_u64(5);
        let rate = 1000.0;
        for (filter, step) in [
            (LowPass::decimator(33, rate), 33),
            (LowPass::decimator(2, rate), 2),
            (LowPass::decimator(400, rate), 400),
            (LowPass::butterworth(4, 40.0, rate), 1),
            (LowPass::butterworth(1, 3.0, rate), 1),
            (LowPass::butterworth(5, 200.0, rate), 3),
            (LowPass::butterworth(11, 30.0, rate), 7),
        ] {
            let filter = filter.unwrap();
            let form = Decimator::new(&filter, step);
            let blocks = 900usize.max(6 * filter.settle_samples() / step);
            let rows = blocks * step;
            let columns = 3;
            // A large constant, a line with noise and noise alone.
            let signals: Vec<Vec<f64>> = (0..columns)
                .map(|c| {
                    (0..rows)
                        .map(|k| match c {
                            0 => 1000.0,
                            1 => 1e-3 * k as f64 + g.random::<f64>(),
                            _ => g.random::<f64>() - 0.5,
                        })
                        .collect()
                })
                .collect();
            let mut stream = form.stream(columns);
            let mut found = vec![Vec::new(); columns];
            let mut take = |first: usize, c: usize, values: &[f64]| {
                assert_eq!(found[c].len(), first);
                found[c].extend_from_slice(values);
            };
            // In chunks of changing length.
            let mut from = 0;
            let mut length = 1;
            while from < blocks {
                let count = length.min(blocks - from);
                let stride = count * step + 5;
                let mut chunk = vec![f64::NAN; columns * stride];
                for (c, signal) in signals.iter().enumerate() {
                    chunk[c * stride..c * stride + count * step]
                        .copy_from_slice(&signal[from * step..(from + count) * step]);
                }
                stream.push(&chunk, stride, count, &mut take);
                from += count;
                length = length % 17 + 3;
            }
            stream.finish(&mut take);
            // The sections get the same constant continuation, long enough to settle.
            let pad = 2 * filter.settle_samples();
            for (signal, found) in signals.iter().zip(&found) {
                let mut long = vec![signal[0]; pad];
                long.extend_from_slice(signal);
                long.extend(std::iter::repeat_n(signal[rows - 1], pad));
                let expected = filter.zero_phase(&long);
                let size = signal.iter().fold(0.0f64, |m, x| m.max(x.abs()));
                assert_eq!(found.len(), blocks);
                for (b, y) in found.iter().enumerate() {
                    let e = expected[pad + (b + 1) * step - 1];
                    assert!(
                        (y - e).abs() < 1e-10 * size,
                        "step {step}, block {b}: {y} for {e}"
                    );
                }
            }
        }
    }
}
