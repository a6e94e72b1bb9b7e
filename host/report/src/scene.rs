//! A plot prepared for drawing: checked, thinned, reduced to a few shapes, with chosen ranges. The still picture and
//! the data of the zoomable figure both start from here.

use super::axis::{drawable, extent, padded};
use super::error::ReportError;
use super::escape;
use super::plot::{Axis, Direction, Marker, Plot, Role, Series, Style};
use super::thin::thin;

/// Maximum number of points of a series in a page.
pub(crate) const POINTS: usize = 4000;
/// Margin at each side as a share of the range.
const AIR: f64 = 0.04;
/// Share of the distance between two abscissae that bars fill.
const BAR_FILL: f64 = 0.78;

/// Basic shape of a series.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Shape {
    Line,
    Points,
    Steps,
    Band,
    /// Width, and distance of the bar's middle from its abscissa, both in units of x.
    Bars {
        width: f64,
        offset: f64,
    },
    ErrorBars,
}

impl Shape {
    pub(crate) fn name(self) -> &'static str {
        match self {
            Shape::Line => "line",
            Shape::Points => "points",
            Shape::Steps => "steps",
            Shape::Band => "band",
            Shape::Bars { .. } => "bars",
            Shape::ErrorBars => "errors",
        }
    }
}

/// A series with NaN for gaps and at most [`POINTS`] points.
pub(crate) struct Drawn<'a> {
    pub(crate) name: &'a str,
    pub(crate) role: Role,
    pub(crate) dashed: bool,
    pub(crate) shape: Shape,
    pub(crate) x: Vec<f64>,
    /// Empty for a band without a middle curve.
    pub(crate) y: Vec<f64>,
    /// Lower and upper edges; empty if the shape has none.
    pub(crate) low: Vec<f64>,
    pub(crate) high: Vec<f64>,
}

/// A plot prepared for drawing.
pub(crate) struct Scene<'a> {
    pub(crate) plot: &'a Plot,
    pub(crate) series: Vec<Drawn<'a>>,
    pub(crate) x_range: (f64, f64),
    pub(crate) y_range: (f64, f64),
    /// Changes to the data, as sentences; empty if there were none.
    pub(crate) remarks: Vec<String>,
}

impl<'a> Scene<'a> {
    /// Prepares a plot; returns `None` if no series has a drawable point.
    ///
    /// # Errors
    /// Errors of [`Plot::check`].
    pub(crate) fn new(plot: &'a Plot) -> Result<Option<Self>, ReportError> {
        plot.check()?;
        let bars: Vec<&Series> = plot
            .series
            .iter()
            .filter(|s| s.style == Style::Bars)
            .collect();
        let slot = bar_slot(&bars);
        let mut bar = 0;
        let mut remarks = Vec::new();
        let mut series = Vec::new();
        for source in &plot.series {
            let shape = match source.style {
                Style::Line => Shape::Line,
                Style::Points => Shape::Points,
                Style::Steps => Shape::Steps,
                Style::Band { .. } => Shape::Band,
                Style::ErrorBars { .. } => Shape::ErrorBars,
                Style::Bars => {
                    let width = slot * BAR_FILL / bars.len() as f64;
                    let offset = width * (bar as f64 - 0.5 * (bars.len() - 1) as f64);
                    bar += 1;
                    Shape::Bars { width, offset }
                }
            };
            series.push(drawn(plot, source, shape, &mut remarks));
        }
        let Some((x_range, y_range)) = ranges(plot, &series) else {
            return Ok(None);
        };
        Ok(Some(Self {
            plot,
            series,
            x_range,
            y_range,
            remarks,
        }))
    }

    /// Returns the alternative text for readers who cannot see the picture.
    pub(crate) fn description(&self) -> String {
        use rig_output::format_significant as g;
        let plot = self.plot;
        let names: Vec<&str> = self.series.iter().map(|s| s.name).collect();
        let axis = |title: String, (low, high): (f64, f64), categories: &[String]| {
            if categories.is_empty() {
                format!("{title} from {} to {}", g(low, 3), g(high, 3))
            } else {
                format!("{title} {}", categories.join(", "))
            }
        };
        format!(
            "{}: {} over {}. Shown: {}.",
            plot.title,
            axis(plot.y.title(), self.y_range, &plot.y.categories),
            axis(plot.x.title(), self.x_range, &plot.x.categories),
            names.join("; ")
        )
    }

    /// Returns the data of the zoomable figure as JSON for a script element.
    pub(crate) fn json(&self) -> String {
        let plot = self.plot;
        let x_digits = Digits::of(self.x_range, plot.x.log);
        let y_digits = Digits::of(self.y_range, plot.y.log);
        let axis = |axis: &Axis| {
            let names: Vec<String> = axis.categories.iter().map(|c| escape::json(c)).collect();
            format!(
                "{{\"title\":{},\"log\":{},\"names\":[{}]}}",
                escape::json(&axis.title()),
                axis.log,
                names.join(",")
            )
        };
        let series: Vec<String> = self
            .series
            .iter()
            .map(|s| {
                let (width, offset) = match s.shape {
                    Shape::Bars { width, offset } => (width, offset),
                    _ => (0.0, 0.0),
                };
                format!(
                    "{{\"shape\":\"{}\",\"role\":\"{}\",\"dashed\":{},\"width\":{},\"offset\":{},\
                     \"x\":{},\"y\":{},\"low\":{},\"high\":{}}}",
                    s.shape.name(),
                    s.role.name(),
                    s.dashed,
                    x_digits.write(width),
                    x_digits.write(offset),
                    x_digits.array(&s.x),
                    y_digits.array(&s.y),
                    y_digits.array(&s.low),
                    y_digits.array(&s.high)
                )
            })
            .collect();
        let markers: Vec<String> = plot
            .markers
            .iter()
            .filter(|m| marker_drawable(plot, m))
            .map(|m| {
                let vertical = m.direction == Direction::Vertical;
                let digits = if vertical { &x_digits } else { &y_digits };
                format!(
                    "{{\"vertical\":{vertical},\"at\":{},\"label\":{}}}",
                    digits.write(m.at),
                    escape::json(&m.label)
                )
            })
            .collect();
        // The ranges are written in full: rounding could cut off the edge of a bar.
        format!(
            "{{\"x\":{},\"y\":{},\"range\":[{:e},{:e},{:e},{:e}],\"equal\":{},\"height\":{},\
             \"series\":[{}],\"markers\":[{}]}}",
            axis(&plot.x),
            axis(&plot.y),
            self.x_range.0,
            self.x_range.1,
            self.y_range.0,
            self.y_range.1,
            plot.equal_aspect,
            plot.height,
            series.join(","),
            markers.join(",")
        )
    }
}

/// Returns true if the marker's position can be drawn on its axis.
pub(crate) fn marker_drawable(plot: &Plot, marker: &Marker) -> bool {
    let axis = match marker.direction {
        Direction::Vertical => &plot.x,
        Direction::Horizontal => &plot.y,
    };
    drawable(marker.at, axis.log)
}

/// Returns the smallest distance between the abscissae of bars; one for a single bar.
fn bar_slot(bars: &[&Series]) -> f64 {
    let mut places: Vec<f64> = bars
        .iter()
        .flat_map(|s| s.x.iter().copied())
        .filter(|x| drawable(*x, false))
        .collect();
    places.sort_by(f64::total_cmp);
    let slot = places
        .windows(2)
        .map(|w| w[1] - w[0])
        .filter(|d| *d > 0.0)
        .fold(f64::INFINITY, f64::min);
    if slot.is_finite() { slot } else { 1.0 }
}

/// Thins a series and marks its gaps.
fn drawn<'a>(
    plot: &Plot,
    source: &'a Series,
    shape: Shape,
    remarks: &mut Vec<String>,
) -> Drawn<'a> {
    let gap = |v: f64, log: bool| if drawable(v, log) { v } else { f64::NAN };
    let x_all: Vec<f64> = source.x.iter().map(|v| gap(*v, plot.x.log)).collect();
    let y_all: Vec<f64> = source.y.iter().map(|v| gap(*v, plot.y.log)).collect();
    let (low_all, high_all) = match &source.style {
        Style::Band { low, high } => (low.clone(), high.clone()),
        Style::ErrorBars { half_width } => {
            let edge = |sign: f64| {
                let pairs = y_all.iter().zip(half_width);
                pairs.map(|(y, h)| y + sign * h.abs()).collect::<Vec<_>>()
            };
            (edge(-1.0), edge(1.0))
        }
        _ => (Vec::new(), Vec::new()),
    };
    let low_all: Vec<f64> = low_all.into_iter().map(|v| gap(v, plot.y.log)).collect();
    let high_all: Vec<f64> = high_all.into_iter().map(|v| gap(v, plot.y.log)).collect();

    let count = x_all.len();
    let across = match shape {
        Shape::Band => vec![&low_all, &high_all],
        _ => vec![&y_all],
    };
    let [missing, samples] = missing(source, &x_all, &across);
    if missing > 0 && count > 0 {
        let why = match (plot.x.log, plot.y.log) {
            (false, false) => "have no value",
            _ => "have no value, or none above zero, as the logarithmic axis needs",
        };
        remarks.push(format!(
            "{}: {missing} of {samples} samples {why} and are left as gaps.",
            source.name
        ));
    }

    let forward = x_all.windows(2).all(|w| w[0] <= w[1]);
    let channels: Vec<&[f64]> = [&x_all, &y_all, &low_all, &high_all]
        .into_iter()
        .skip(usize::from(forward))
        .filter(|c| !c.is_empty())
        .map(Vec::as_slice)
        .collect();
    let kept = thin(count, &channels, POINTS);
    if kept.len() < count {
        remarks.push(format!(
            "{}: {} of {count} samples drawn, the extremes of every run of samples among them.",
            source.name,
            kept.len()
        ));
    }
    let pick = |channel: &[f64]| -> Vec<f64> {
        kept.iter()
            .filter_map(|i| channel.get(*i).copied())
            .collect()
    };
    Drawn {
        name: &source.name,
        role: source.role,
        dashed: source.dashed,
        shape,
        x: pick(&x_all),
        y: pick(&y_all),
        low: pick(&low_all),
        high: pick(&high_all),
    }
}

/// A range from its lower to its upper end.
type Range = (f64, f64);

/// Returns the ranges of both axes, or `None` if nothing can be drawn.
fn ranges(plot: &Plot, series: &[Drawn<'_>]) -> Option<(Range, Range)> {
    let visible = |s: &Drawn<'_>, i: usize| {
        let there = |c: &[f64]| c.get(i).is_some_and(|v| !v.is_nan());
        there(&s.x) && (there(&s.y) || (there(&s.low) && there(&s.high)))
    };
    let points = || {
        series
            .iter()
            .flat_map(|s| (0..s.x.len()).map(move |i| (s, i)))
    };
    let at = |direction: Direction| {
        plot.markers
            .iter()
            .filter(move |m| m.direction == direction)
            .map(|m| m.at)
    };
    let x_values = points().filter(|(s, i)| visible(s, *i)).flat_map(|(s, i)| {
        let x = s.x[i];
        match s.shape {
            Shape::Bars { width, offset } => [x + offset - 0.5 * width, x + offset + 0.5 * width],
            _ => [x, x],
        }
    });
    extent(x_values.clone(), plot.x.log)?;
    let x = extent(x_values.chain(at(Direction::Vertical)), plot.x.log)?;
    let y_values = points().filter(|(s, i)| visible(s, *i)).flat_map(|(s, i)| {
        let value = |c: &[f64]| c.get(i).copied().unwrap_or(f64::NAN);
        let base = match s.shape {
            Shape::Bars { .. } if !plot.y.log => 0.0,
            _ => f64::NAN,
        };
        [value(&s.y), value(&s.low), value(&s.high), base]
    });
    let y = extent(y_values.chain(at(Direction::Horizontal)), plot.y.log)?;
    let named = |range: Range, names: &[String]| {
        if names.is_empty() {
            range
        } else {
            (range.0.min(-0.5), range.1.max(names.len() as f64 - 0.5))
        }
    };
    let air = |categories: &[String]| if categories.is_empty() { AIR } else { 0.01 };
    let x = padded(
        named(x, &plot.x.categories),
        plot.x.log,
        air(&plot.x.categories) * 0.5,
    );
    let mut y_padded = padded(
        named(y, &plot.y.categories),
        plot.y.log,
        air(&plot.y.categories) * 1.5,
    );
    // Bars start on the axis, not above it.
    if series.iter().any(|s| matches!(s.shape, Shape::Bars { .. })) && !plot.y.log {
        if y.0 == 0.0 && y.1 > 0.0 {
            y_padded.0 = 0.0;
        } else if y.1 == 0.0 && y.0 < 0.0 {
            y_padded.1 = 0.0;
        }
    }
    Some((x, y_padded))
}

/// Number of digits for the data of an axis: a millionth of its span, or six significant digits on a logarithmic axis.
struct Digits {
    /// Decimal exponent of the last digit written; `None` for six significant digits.
    last: Option<i32>,
}

impl Digits {
    fn of((low, high): Range, log: bool) -> Self {
        let last = (!log).then(|| (high - low).log10().floor() as i32 - 6);
        Self { last }
    }

    fn write(&self, value: f64) -> String {
        if !value.is_finite() {
            return "null".to_owned();
        }
        match self.last {
            Some(last) if (-12..=0).contains(&last) => {
                let text = format!("{value:.*}", (-last) as usize);
                let text = match text.contains('.') {
                    true => text.trim_end_matches('0').trim_end_matches('.'),
                    false => &text,
                };
                match text {
                    "-0" => "0".to_owned(),
                    text => text.to_owned(),
                }
            }
            Some(last) if value != 0.0 => {
                let exponent = value.abs().log10().floor() as i32;
                shortest(value, (exponent - last).clamp(0, 15) as usize)
            }
            _ => shortest(value, 5),
        }
    }

    fn array(&self, values: &[f64]) -> String {
        let items: Vec<String> = values.iter().map(|v| self.write(*v)).collect();
        format!("[{}]", items.join(","))
    }
}

/// Formats a number with `digits` digits after the first one, without trailing zeros.
fn shortest(value: f64, digits: usize) -> String {
    let text = format!("{value:.digits$e}");
    match text.parse::<f64>() {
        Ok(0.0) => "0".to_owned(),
        Ok(rounded) if (1e-4..1e7).contains(&rounded.abs()) => format!("{rounded}"),
        Ok(rounded) => format!("{rounded:e}"),
        Err(_) => "null".to_owned(),
    }
}

/// Returns the numbers of samples that cannot be drawn, and of all. A point that is NaN in all coordinates ends a piece of
/// the curve or of the band and is no sample. `x` and `across` are the coordinates as drawn, with NaN for gaps.
fn missing(source: &Series, x: &[f64], across: &[&Vec<f64>]) -> [usize; 2] {
    let given = match &source.style {
        Style::Band { low, high } => [low, high],
        _ => [&source.y; 2],
    };
    let is_nan = |c: &[f64], i: usize| c.get(i).is_some_and(|v| v.is_nan());
    let ends = |i: usize| source.x[i].is_nan() && given.iter().all(|c| is_nan(c, i));
    let samples = || (0..x.len()).filter(|i| !ends(*i));
    let hole = |i: &usize| is_nan(x, *i) || across.iter().any(|c| is_nan(c, *i));
    [samples().filter(hole).count(), samples().count()]
}
