//! Noise of the sensor at rest, by the rows that a pose has.

/// Most batches of rows of a pose: two to four long ones tell slow noise, and a few poses give enough degrees of freedom.
const BATCHES: usize = 4;

/// Noise of the mean readings of poses, by how the rows of each pose differ.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct Scatter {
    /// Sums over the poses of the variances of forces and of moments.
    squares: [f64; 2],
    poses: f64,
    freedom: f64,
}

impl Scatter {
    /// Adds a pose.
    pub(crate) fn add(&mut self, batches: &Batches) {
        let Some(variances) = batches.variances() else {
            return;
        };
        for (channel, variance) in variances.iter().enumerate() {
            self.squares[channel / 3] += variance / 3.0;
        }
        self.poses += 1.0;
        self.freedom += 3.0 * (batches.full() - 1) as f64;
    }

    /// Returns the sums over two recordings.
    pub(crate) fn and(self, other: Self) -> Self {
        Self {
            squares: [0, 1].map(|kind| self.squares[kind] + other.squares[kind]),
            poses: self.poses + other.poses,
            freedom: self.freedom + other.freedom,
        }
    }

    /// Returns the noise of forces (N) and of moments (N·m), and its degrees of freedom; `None` if every pose has one row.
    pub(crate) fn noise(&self) -> Option<([f64; 2], f64)> {
        let noise = self.squares.map(|sum| (sum / self.poses).sqrt());
        (self.poses > 0.0).then_some((noise, self.freedom))
    }
}

/// Sums over as many successive rows each: their means differ by noise that is slow, too (batch means, Law & Carson 1979).
/// Two neighbours become one when there are too many, so the memory does not grow with the pose.
pub(crate) struct Batches {
    sums: Vec<[f64; 6]>,
    rows: u64,
    /// Rows of the last one.
    last: u64,
}

impl Batches {
    /// Begins without rows.
    pub(crate) fn new() -> Self {
        Self {
            sums: Vec::with_capacity(BATCHES + 1),
            rows: 1,
            last: 1,
        }
    }

    /// Adds a row.
    pub(crate) fn add(&mut self, readings: &[f64; 6]) {
        if self.last == self.rows {
            if self.sums.len() == BATCHES {
                let pairs = self.sums.chunks_exact(2);
                self.sums = pairs
                    .map(|two| std::array::from_fn(|c| two[0][c] + two[1][c]))
                    .collect();
                self.rows *= 2;
            }
            self.sums.push([0.0; 6]);
            self.last = 0;
        }
        self.last += 1;
        if let Some(sums) = self.sums.last_mut() {
            (sums.iter_mut().zip(readings)).for_each(|(sum, value)| *sum += value);
        }
    }

    /// Returns the number of batches with all their rows.
    fn full(&self) -> usize {
        self.sums.len() - usize::from(self.last < self.rows)
    }

    /// Returns the variance of each mean reading; `None` for fewer than two batches.
    fn variances(&self) -> Option<[f64; 6]> {
        let count = self.full();
        let variance = |channel: usize| {
            let means = self.sums[..count].iter();
            let means: Vec<f64> = means.map(|sums| sums[channel] / self.rows as f64).collect();
            rig_numerics::statistics::squares_about_mean(&means) / (count * (count - 1)) as f64
        };
        (count > 1).then(|| std::array::from_fn(variance))
    }
}
