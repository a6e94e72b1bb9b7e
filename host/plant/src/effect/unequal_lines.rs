//! Encoder lines whose four edges are not a quarter of a line apart.
//!
//! Duty cycle and phase of the two channels repeat with every line, and so do the positions of the edges. Data sheets
//! call this "phase error" and "pulse width error" in electrical degrees, 90° to a count. Not modelled: differences
//! between lines.

/// Deviation of the four edges of a line from even spacing.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct UnequalLines {
    /// Offsets in counts of the edges at whole counts 0 to 3 modulo 4; each above −0.5 and below 0.5.
    pub offsets: [f64; 4],
}

impl UnequalLines {
    /// Returns the position of edge `count`, in counts of an even encoder.
    fn edge(&self, count: f64) -> f64 {
        let of_line = count.rem_euclid(4.0) as usize;
        count + self.offsets.get(of_line).copied().unwrap_or(0.0)
    }

    /// Converts an even encoder's reading, in fractional counts. The result is whole at an edge and linear between
    /// edges.
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
