//! Encoder lines whose four edges do not lie a quarter of a line apart.
//!
//! Duty cycle and phase of the two channels repeat with every line, so that the places of the edges do, too (data sheets
//! give them as "phase error" and "pulse width error" in electrical degrees, 90° to a count). Leaves out: lines that differ
//! from each other.

/// Where the four edges of a line lie beside their even places.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct UnequalLines {
    /// Counts, of the edges at whole counts 0 to 3 modulo 4; each above −0.5 and below 0.5.
    pub offsets: [f64; 4],
}

impl UnequalLines {
    /// Where edge `count` lies, counts of an even encoder.
    fn edge(&self, count: f64) -> f64 {
        let of_line = count.rem_euclid(4.0) as usize;
        count + self.offsets.get(of_line).copied().unwrap_or(0.0)
    }

    /// What an even encoder's reading, counts with their fraction, becomes: whole where an edge lies, and straight in
    /// between.
    pub fn reading(&self, even: f64) -> f64 {
        let near = even.round();
        let below = if self.edge(near) <= even {
            near
        } else {
            near - 1.0
        };
        let (from, to) = (self.edge(below), self.edge(below + 1.0));
        below + (even - from) / (to - from)
    }
}
