//! A value over two quantities as a coloured picture.
//!
//! The colours are those of viridis (van der Walt and Smith 2015): their lightness grows evenly with the value, and readers
//! with colour-vision deficiencies can order them.

use std::fmt::Write;

use super::axis::{Tick, extent, linear_ticks, log_ticks};
use super::error::ReportError;
use super::escape::text;
use super::plot::Axis;

/// Width of the picture in SVG units.
const WIDTH: f64 = 760.0;
/// Font size.
const FONT: f64 = 13.0;
/// Number of colours.
const LEVELS: usize = 48;
/// Anchors of the colour scale.
const ANCHORS: [[f64; 3]; 9] = [
    [68.0, 1.0, 84.0],
    [71.0, 44.0, 122.0],
    [59.0, 81.0, 139.0],
    [44.0, 113.0, 142.0],
    [33.0, 144.0, 141.0],
    [39.0, 173.0, 129.0],
    [92.0, 200.0, 99.0],
    [170.0, 220.0, 50.0],
    [253.0, 231.0, 37.0],
];

/// A value over a grid of two quantities. Both axes are linear.
#[derive(Clone, Debug, PartialEq)]
pub struct HeatMap {
    /// Description of the figure in words; also its alternative text.
    pub title: String,
    /// Abscissa.
    pub x: Axis,
    /// Ordinate.
    pub y: Axis,
    /// The value, and whether its colours are logarithmic.
    pub value: Axis,
    /// Abscissae of the columns, evenly spaced and growing, at least two.
    pub columns: Vec<f64>,
    /// Ordinates of the rows, evenly spaced and growing, at least two.
    pub rows: Vec<f64>,
    /// One list per row, as long as `columns`; a value that is not finite is left blank.
    pub values: Vec<Vec<f64>>,
    /// Points to mark with a label.
    pub marks: Vec<([f64; 2], String)>,
    /// Note. May be empty.
    pub note: String,
    /// Height in px at a width of 760 px.
    pub height: u32,
}

/// A linear scale from a quantity to the picture.
#[derive(Clone, Copy)]
struct Scale {
    from: [f64; 2],
    to: [f64; 2],
}

impl Scale {
    fn at(&self, value: f64) -> f64 {
        let share = (value - self.from[0]) / (self.from[1] - self.from[0]);
        self.to[0] + share * (self.to[1] - self.to[0])
    }
}

impl HeatMap {
    /// Default height, px.
    pub const HEIGHT: u32 = 460;

    /// Checks the numbers of rows, columns and values.
    ///
    /// # Errors
    /// [`ReportError::Grid`], [`ReportError::Height`].
    fn check(&self) -> Result<(), ReportError> {
        let lengths = |what: &'static str, found: usize, expected: usize| ReportError::Grid {
            figure: self.title.clone(),
            what,
            found,
            expected,
        };
        if !(120..=2000).contains(&self.height) {
            return Err(ReportError::Height {
                figure: self.title.clone(),
                height: self.height,
            });
        }
        if self.columns.len() < 2 || self.rows.len() < 2 {
            let least = self.columns.len().min(self.rows.len());
            return Err(lengths("rows or columns", least, 2));
        }
        if self.values.len() != self.rows.len() {
            return Err(lengths(
                "rows of values",
                self.values.len(),
                self.rows.len(),
            ));
        }
        match self.values.iter().find(|r| r.len() != self.columns.len()) {
            Some(row) => Err(lengths("values in a row", row.len(), self.columns.len())),
            None => Ok(()),
        }
    }

    /// Returns the picture, or `None` if no value can be drawn.
    ///
    /// # Errors
    /// As [`Self::check`].
    pub(crate) fn svg(&self) -> Result<Option<String>, ReportError> {
        self.check()?;
        let Some((low, high)) = extent(self.values.iter().flatten().copied(), self.value.log)
        else {
            return Ok(None);
        };
        let height = f64::from(self.height);
        let half = |list: &[f64]| 0.5 * (list[1] - list[0]);
        let ends = |list: &[f64]| {
            let own = half(list);
            [list[0] - own, list[list.len() - 1] + own]
        };
        let x = Scale {
            from: ends(&self.columns),
            to: [64.0, WIDTH - 130.0],
        };
        let y = Scale {
            from: ends(&self.rows),
            to: [height - 48.0, 30.0],
        };
        let mut out = String::new();
        // Writing into a String cannot fail: the results of `write!` in this file are ignored on purpose.
        let _ = write!(
            out,
            "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 {WIDTH} {height}\" role=\"img\" aria-label=\"{}\" font-size=\"{FONT}\">",
            text(&self.title)
        );
        self.cells(&mut out, &x, &y, (low, high));
        self.axes(&mut out, &x, &y);
        self.bar(&mut out, &y, (low, high));
        for ([a, b], label) in &self.marks {
            let (at_x, at_y) = (x.at(*a), y.at(*b));
            let left = at_x > 0.6 * WIDTH;
            let (anchor, shift) = if left { ("end", -8.0) } else { ("start", 8.0) };
            let _ = write!(
                out,
                "<circle cx=\"{at_x:.1}\" cy=\"{at_y:.1}\" r=\"4.5\" fill=\"#fff\" stroke=\"#000\" stroke-width=\"1.5\"/>\
                 <text x=\"{:.1}\" y=\"{:.1}\" text-anchor=\"{anchor}\" fill=\"#fff\" stroke=\"#000\" stroke-width=\"3\" paint-order=\"stroke\">{}</text>",
                at_x + shift,
                (at_y - 7.0).max(y.to[1] + 12.0),
                text(label)
            );
        }
        out.push_str("</svg>");
        Ok(Some(out))
    }

    /// Level of a value among the colours; `None` if it cannot be drawn.
    fn level(&self, value: f64, (low, high): (f64, f64)) -> Option<usize> {
        let place = match self.value.log {
            true => (value / low).ln() / (high / low).ln(),
            false => (value - low) / (high - low),
        };
        let drawn = value.is_finite() && (!self.value.log || value > 0.0);
        // A map of one value has no range: its colour is the lowest.
        let place = if place.is_finite() { place } else { 0.0 };
        drawn.then(|| ((place * LEVELS as f64) as usize).min(LEVELS - 1))
    }

    /// Draws the cells, one path per colour.
    fn cells(&self, out: &mut String, x: &Scale, y: &Scale, range: (f64, f64)) {
        let mut paths = vec![String::new(); LEVELS];
        let width = (x.at(self.columns[1]) - x.at(self.columns[0])).abs();
        let height = (y.at(self.rows[1]) - y.at(self.rows[0])).abs();
        for (row, values) in self.rows.iter().zip(&self.values) {
            for (column, value) in self.columns.iter().zip(values) {
                let Some(level) = self.level(*value, range) else {
                    continue;
                };
                // A little overlap hides the seams.
                let _ = write!(
                    paths[level],
                    "M{:.1} {:.1}h{:.1}v{:.1}h-{:.1}z",
                    x.at(*column) - 0.5 * width,
                    y.at(*row) - 0.5 * height,
                    width + 0.3,
                    height + 0.3,
                    width + 0.3
                );
            }
        }
        for (level, path) in paths.iter().enumerate().filter(|(_, p)| !p.is_empty()) {
            let _ = write!(out, "<path d=\"{path}\" fill=\"{}\"/>", colour(level));
        }
    }

    fn axes(&self, out: &mut String, x: &Scale, y: &Scale) {
        let [left, right] = x.to;
        let [bottom, top] = y.to;
        let _ = write!(
            out,
            "<path d=\"M{left} {top}V{bottom}H{right}\" style=\"stroke:var(--axis);fill:none\"/><g style=\"fill:var(--quiet)\">"
        );
        for tick in linear_ticks(x.from[0], x.from[1], 7) {
            let _ = write!(
                out,
                "<text x=\"{:.1}\" y=\"{:.1}\" text-anchor=\"middle\">{}</text>",
                x.at(tick.at),
                bottom + 18.0,
                text(&tick.label)
            );
        }
        for tick in linear_ticks(y.from[0], y.from[1], 7) {
            let _ = write!(
                out,
                "<text x=\"{:.1}\" y=\"{:.1}\" text-anchor=\"end\">{}</text>",
                left - 8.0,
                y.at(tick.at) + 4.5,
                text(&tick.label)
            );
        }
        let _ = write!(
            out,
            "<text x=\"{right}\" y=\"{:.1}\" text-anchor=\"end\">{}</text><text x=\"4\" y=\"18\">{}</text></g>",
            bottom + 40.0,
            text(&self.x.title()),
            text(&self.y.title())
        );
    }

    /// Draws the scale of the colours.
    fn bar(&self, out: &mut String, y: &Scale, (low, high): (f64, f64)) {
        let [bottom, top] = y.to;
        let left = WIDTH - 104.0;
        let step = (bottom - top) / LEVELS as f64;
        for level in 0..LEVELS {
            let _ = write!(
                out,
                "<rect x=\"{left}\" y=\"{:.1}\" width=\"18\" height=\"{:.1}\" fill=\"{}\"/>",
                bottom - step * (level + 1) as f64,
                step + 0.3,
                colour(level)
            );
        }
        let ticks: Vec<Tick> = match self.value.log {
            true => log_ticks(low, high, 7),
            false => linear_ticks(low, high, 7),
        };
        let _ = write!(out, "<g style=\"fill:var(--quiet)\">");
        for tick in ticks.iter().filter(|t| t.at >= low && t.at <= high) {
            let share = match self.value.log {
                true => (tick.at / low).ln() / (high / low).ln(),
                false => (tick.at - low) / (high - low),
            };
            if share.is_finite() {
                let _ = write!(
                    out,
                    "<text x=\"{}\" y=\"{:.1}\">{}</text>",
                    left + 24.0,
                    bottom - share * (bottom - top) + 4.5,
                    text(&tick.label)
                );
            }
        }
        let _ = write!(
            out,
            "<text x=\"{}\" y=\"18\" text-anchor=\"end\">{}</text></g>",
            WIDTH - 4.0,
            text(&self.value.title())
        );
    }
}

/// Colour of a level.
fn colour(level: usize) -> String {
    let place = (level as f64 + 0.5) / LEVELS as f64 * (ANCHORS.len() - 1) as f64;
    let below = (place as usize).min(ANCHORS.len() - 2);
    let share = place - below as f64;
    let mix = |c: usize| {
        let value = ANCHORS[below][c] + share * (ANCHORS[below + 1][c] - ANCHORS[below][c]);
        value.round() as u8
    };
    format!("#{:02x}{:02x}{:02x}", mix(0), mix(1), mix(2))
}
