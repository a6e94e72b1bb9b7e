//! A plot as a still picture: scalable and printable, readable without JavaScript.

use std::fmt::Write;

use super::axis::{Tick, linear_ticks, log_ticks};
use super::error::ReportError;
use super::escape::text;
use super::plot::{Axis, Direction, Plot, Role};
use super::scene::{Drawn, Scene, Shape, marker_drawable};
use super::thin::thin;

/// Width of every picture in SVG units.
const WIDTH: f64 = 760.0;
/// Font size.
const FONT: f64 = 13.0;
/// Maximum number of points of a curve in the picture: about two per unit of width.
const POINTS: usize = 1600;

/// Source of the colours.
#[derive(Clone, Copy, PartialEq)]
enum Palette {
    /// Style sheet of the page, for light and dark display and print.
    Page,
    /// Literal colours on white, for a standalone picture.
    Own,
}

impl Palette {
    fn role(self, role: Role) -> String {
        match self {
            Palette::Page => format!("var(--{})", role.name()),
            Palette::Own => role.light().to_owned(),
        }
    }

    fn named(self, name: &str, own: &str) -> String {
        match self {
            Palette::Page => format!("var(--{name})"),
            Palette::Own => own.to_owned(),
        }
    }
}

/// Returns a plot as a standalone SVG text on white, with title and legend in the picture.
///
/// # Errors
/// [`ReportError::Lengths`], [`ReportError::Aspect`], [`ReportError::Height`] for inconsistent data;
/// [`ReportError::NothingToDraw`] if no series has a finite point.
pub fn svg(plot: &Plot) -> Result<String, ReportError> {
    let scene = Scene::new(plot)?.ok_or_else(|| ReportError::NothingToDraw {
        figure: plot.title.clone(),
    })?;
    let mut out = String::from("<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n");
    Canvas::new(&scene, Palette::Own, "plot").draw(&mut out);
    out.push('\n');
    Ok(out)
}

/// Returns the picture for a page, which has its own heading and legend; `id` is unique in the page.
pub(crate) fn inline(scene: &Scene<'_>, id: &str) -> String {
    let mut out = String::new();
    Canvas::new(scene, Palette::Page, id).draw(&mut out);
    out
}

/// Estimates the width of a text in most sans-serif fonts, rather too large than too small.
fn width_of(text: &str) -> f64 {
    text.chars().count() as f64 * FONT * 0.58
}

/// Returns the ticks that lie in a range.
fn within(ticks: &[Tick], (low, high): (f64, f64)) -> impl Iterator<Item = &Tick> {
    let slack = (high - low) * 1e-9;
    ticks
        .iter()
        .filter(move |t| t.at >= low - slack && t.at <= high + slack)
}

/// Geometry of one picture.
struct Canvas<'a> {
    scene: &'a Scene<'a>,
    palette: Palette,
    id: &'a str,
    left: f64,
    right: f64,
    top: f64,
    bottom: f64,
    height: f64,
    x_range: (f64, f64),
    y_range: (f64, f64),
    x_ticks: Vec<Tick>,
    y_ticks: Vec<Tick>,
    /// Left end and line of each legend entry.
    legend: Vec<(f64, f64)>,
}

fn ticks(axis: &Axis, (low, high): (f64, f64), count: usize) -> Vec<Tick> {
    if !axis.categories.is_empty() {
        let named = axis.categories.iter().enumerate();
        named
            .map(|(i, name)| Tick {
                at: i as f64,
                label: name.clone(),
            })
            .collect()
    } else if axis.log {
        log_ticks(low, high, count)
    } else {
        linear_ticks(low, high, count)
    }
}

impl<'a> Canvas<'a> {
    fn new(scene: &'a Scene<'a>, palette: Palette, id: &'a str) -> Self {
        let plot = scene.plot;
        let mut legend = Vec::new();
        let mut head = 10.0;
        if palette == Palette::Own {
            head = 34.0;
            let (mut x, mut y) = (16.0, 50.0);
            for series in &scene.series {
                let width = 30.0 + width_of(series.name) + 18.0;
                if x + width > WIDTH - 10.0 && x > 16.0 {
                    x = 16.0;
                    y += 20.0;
                }
                legend.push((x, y));
                x += width;
            }
            if !legend.is_empty() {
                head = y + 14.0;
            }
        }
        if !plot.y.title().is_empty() {
            head += 20.0;
        }
        let body = f64::from(plot.height);
        let bottom_margin = if plot.x.title().is_empty() {
            28.0
        } else {
            48.0
        };
        let extra: f64 = if palette == Palette::Own {
            head - 30.0
        } else {
            0.0
        };
        let height = body + extra.max(0.0);
        let (top, bottom) = (head, height - bottom_margin);
        let (mut x_range, mut y_range) = (scene.x_range, scene.y_range);
        let y_count = ((bottom - top) / 38.0).clamp(2.0, 12.0) as usize;
        let right = WIDTH - 16.0;
        let margin = |ticks: &[Tick]| {
            let widest = ticks.iter().map(|t| width_of(&t.label)).fold(0.0, f64::max);
            (widest + 14.0).clamp(34.0, 200.0)
        };
        let mut left = margin(&ticks(&plot.y, y_range, y_count));
        if plot.equal_aspect {
            equalise(&mut x_range, &mut y_range, right - left, bottom - top);
            left = margin(&ticks(&plot.y, y_range, y_count));
        }
        let y_ticks = ticks(&plot.y, y_range, y_count);
        let x_ticks = ticks(&plot.x, x_range, 8);
        Self {
            scene,
            palette,
            id,
            left,
            right,
            top,
            bottom,
            height,
            x_range,
            y_range,
            x_ticks,
            y_ticks,
            legend,
        }
    }

    fn x(&self, value: f64) -> f64 {
        self.left + share(value, self.x_range, self.scene.plot.x.log) * (self.right - self.left)
    }

    fn y(&self, value: f64) -> f64 {
        self.bottom - share(value, self.y_range, self.scene.plot.y.log) * (self.bottom - self.top)
    }

    fn draw(&self, out: &mut String) {
        let plot = self.scene.plot;
        let description = text(&self.scene.description());
        let font = match self.palette {
            Palette::Page => String::new(),
            Palette::Own => {
                " font-family=\"system-ui, 'Segoe UI', Roboto, Helvetica, Arial, sans-serif\""
                    .to_owned()
            }
        };
        // Writing into a String cannot fail: the results of `write!` below are ignored on purpose.
        let _ = write!(
            out,
            "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 {WIDTH} {}\" role=\"img\" \
             aria-label=\"{description}\" font-size=\"{FONT}\"{font}{}>",
            coordinate(self.height),
            match self.palette {
                Palette::Page => String::new(),
                Palette::Own =>
                    format!(" width=\"{WIDTH}\" height=\"{}\"", coordinate(self.height)),
            }
        );
        if self.palette == Palette::Own {
            let _ = write!(
                out,
                "<rect width=\"{WIDTH}\" height=\"{}\" fill=\"#fff\"/>\
                 <text x=\"16\" y=\"24\" font-size=\"16\" font-weight=\"600\" fill=\"#1b1f24\">{}</text>",
                coordinate(self.height),
                text(&plot.title)
            );
            for (series, (x, y)) in self.scene.series.iter().zip(&self.legend) {
                self.swatch(out, series, *x, *y);
            }
        }
        self.axes(out);
        let _ = write!(
            out,
            "<clipPath id=\"{0}-clip\"><rect x=\"{1}\" y=\"{2}\" width=\"{3}\" height=\"{4}\"/></clipPath>\
             <g clip-path=\"url(#{0}-clip)\">",
            self.id,
            coordinate(self.left),
            coordinate(self.top),
            coordinate(self.right - self.left),
            coordinate(self.bottom - self.top)
        );
        for series in &self.scene.series {
            self.series(out, series);
        }
        out.push_str("</g>");
        self.markers(out);
        out.push_str("</svg>");
    }

    fn swatch(&self, out: &mut String, series: &Drawn<'_>, x: f64, y: f64) {
        let colour = self.palette.role(series.role);
        out.push_str(&swatch(series.shape, series.dashed, &colour, x, y - 4.5));
        let _ = write!(
            out,
            "<text x=\"{}\" y=\"{}\" fill=\"#1b1f24\">{}</text>",
            coordinate(x + 28.0),
            coordinate(y),
            text(series.name)
        );
    }

    /// Draws grid, frame, numbers and titles of both axes.
    fn axes(&self, out: &mut String) {
        self.grid(out);
        let frame = self.palette.named("axis", "#aab2bb");
        let _ = write!(
            out,
            "<path d=\"M{0} {1}V{2}H{3}\" style=\"stroke:{frame};stroke-width:1;fill:none\"/>",
            coordinate(self.left),
            coordinate(self.top),
            coordinate(self.bottom),
            coordinate(self.right)
        );
        let quiet = self.palette.named("quiet", "#5b6570");
        let _ = write!(out, "<g style=\"fill:{quiet}\">");
        self.numbers(out);
        self.titles(out);
        out.push_str("</g>");
    }

    fn grid(&self, out: &mut String) {
        let grid = self.palette.named("grid", "#e6e9ed");
        let _ = write!(out, "<g style=\"stroke:{grid};stroke-width:1;fill:none\">");
        for tick in within(&self.x_ticks, self.x_range) {
            let x = coordinate(self.x(tick.at));
            let _ = write!(
                out,
                "<path d=\"M{x} {}V{}\"/>",
                coordinate(self.top),
                coordinate(self.bottom)
            );
        }
        for tick in within(&self.y_ticks, self.y_range) {
            let y = coordinate(self.y(tick.at));
            let _ = write!(
                out,
                "<path d=\"M{} {y}H{}\"/>",
                coordinate(self.left),
                coordinate(self.right)
            );
        }
        out.push_str("</g>");
    }

    /// Writes the numbers or names beside the ticks.
    fn numbers(&self, out: &mut String) {
        let named = !self.scene.plot.x.categories.is_empty();
        let mut free = f64::NEG_INFINITY;
        for tick in within(&self.x_ticks, self.x_range) {
            let (x, half) = (self.x(tick.at), 0.5 * width_of(&tick.label));
            if tick.label.is_empty() || (x - half < free && !named) {
                continue;
            }
            free = x + half + 6.0;
            // A label below the last tick must not leave the picture.
            let x = x.min(WIDTH - half).max(half);
            let _ = write!(
                out,
                "<text x=\"{}\" y=\"{}\" text-anchor=\"middle\">{}</text>",
                coordinate(x),
                coordinate(self.bottom + 18.0),
                text(&tick.label)
            );
        }
        for tick in within(&self.y_ticks, self.y_range) {
            if tick.label.is_empty() {
                continue;
            }
            let _ = write!(
                out,
                "<text x=\"{}\" y=\"{}\" text-anchor=\"end\">{}</text>",
                coordinate(self.left - 8.0),
                coordinate(self.y(tick.at) + 4.5),
                text(&tick.label)
            );
        }
    }

    /// Writes quantity and unit of both axes.
    fn titles(&self, out: &mut String) {
        let plot = self.scene.plot;
        let (x_title, y_title) = (plot.x.title(), plot.y.title());
        if !x_title.is_empty() {
            let _ = write!(
                out,
                "<text x=\"{}\" y=\"{}\" text-anchor=\"end\">{}</text>",
                coordinate(self.right),
                coordinate(self.bottom + 40.0),
                text(&x_title)
            );
        }
        if !y_title.is_empty() {
            let _ = write!(
                out,
                "<text x=\"4\" y=\"{}\">{}</text>",
                coordinate(self.top - 12.0),
                text(&y_title)
            );
        }
    }

    /// Returns the indices to draw: fewer than in the zoomable figure.
    fn chosen(&self, series: &Drawn<'_>) -> Vec<usize> {
        let channels: Vec<&[f64]> = [&series.x, &series.y, &series.low, &series.high]
            .into_iter()
            .filter(|c| !c.is_empty())
            .map(Vec::as_slice)
            .collect();
        thin(series.x.len(), &channels, POINTS)
    }

    fn curve(&self, series: &Drawn<'_>, values: &[f64], steps: bool) -> String {
        let mut path = String::new();
        let mut pen = false;
        for i in self.chosen(series) {
            let (Some(x), Some(y)) = (series.x.get(i), values.get(i)) else {
                continue;
            };
            if x.is_nan() || y.is_nan() {
                pen = false;
                continue;
            }
            let (x, y) = (coordinate(self.x(*x)), coordinate(self.y(*y)));
            let _ = match (pen, steps) {
                (false, _) => write!(path, "M{x} {y}"),
                (true, true) => write!(path, "H{x}V{y}"),
                (true, false) => write!(path, "L{x} {y}"),
            };
            pen = true;
        }
        path
    }

    fn series(&self, out: &mut String, series: &Drawn<'_>) {
        let colour = self.palette.role(series.role);
        let dash = if series.dashed {
            ";stroke-dasharray:6 4"
        } else {
            ""
        };
        let stroke = format!(
            "fill:none;stroke:{colour};stroke-width:1.6;stroke-linejoin:round;stroke-linecap:round{dash}"
        );
        match series.shape {
            Shape::Line | Shape::Steps => {
                let path = self.curve(series, &series.y, series.shape == Shape::Steps);
                let _ = write!(out, "<path d=\"{path}\" style=\"{stroke}\"/>");
            }
            Shape::Points => {
                let dots = self.dots(series);
                let _ = write!(
                    out,
                    "<path d=\"{dots}\" style=\"fill:none;stroke:{colour};stroke-width:4.4;\
                     stroke-linecap:round;stroke-opacity:.75\"/>"
                );
            }
            Shape::Band => {
                let area = self.area(series);
                let _ = write!(
                    out,
                    "<path d=\"{area}\" style=\"fill:{colour};fill-opacity:.2;stroke:none\"/>"
                );
                if !series.y.is_empty() {
                    let path = self.curve(series, &series.y, false);
                    let _ = write!(out, "<path d=\"{path}\" style=\"{stroke}\"/>");
                }
            }
            Shape::Bars { width, offset } => {
                let path = self.bars(series, width, offset);
                let _ = write!(
                    out,
                    "<path d=\"{path}\" style=\"fill:{colour};fill-opacity:.85;stroke:none\"/>"
                );
            }
            Shape::ErrorBars => {
                let (path, dots) = (self.error_bars(series), self.dots(series));
                let _ = write!(
                    out,
                    "<path d=\"{path}\" style=\"fill:none;stroke:{colour};stroke-width:1.3\"/>\
                     <path d=\"{dots}\" style=\"fill:none;stroke:{colour};stroke-width:6;stroke-linecap:round\"/>"
                );
            }
        }
    }

    /// Returns one point of no length for every sample.
    fn dots(&self, series: &Drawn<'_>) -> String {
        let mut dots = String::new();
        for i in self.chosen(series) {
            let (x, y) = (series.x[i], series.y[i]);
            if !x.is_nan() && !y.is_nan() {
                let _ = write!(
                    dots,
                    "M{} {}h0",
                    coordinate(self.x(x)),
                    coordinate(self.y(y))
                );
            }
        }
        dots
    }

    /// Returns the outlines of bars from zero; `width` and `offset` are in units of x.
    fn bars(&self, series: &Drawn<'_>, width: f64, offset: f64) -> String {
        let base = if self.scene.plot.y.log {
            self.bottom
        } else {
            self.y(0.0)
        };
        let mut path = String::new();
        for (x, y) in series.x.iter().zip(&series.y) {
            if x.is_nan() || y.is_nan() {
                continue;
            }
            let a = coordinate(self.x(x + offset - 0.5 * width));
            let b = coordinate(self.x(x + offset + 0.5 * width));
            let _ = write!(
                path,
                "M{a} {0}V{1}H{b}V{0}z",
                coordinate(base),
                coordinate(self.y(*y))
            );
        }
        path
    }

    /// Returns the vertical bars of dots with errors, with a cross stroke at each end.
    fn error_bars(&self, series: &Drawn<'_>) -> String {
        let mut path = String::new();
        for i in self.chosen(series) {
            let (x, y) = (series.x[i], series.y[i]);
            if x.is_nan() || y.is_nan() {
                continue;
            }
            // An edge that a logarithmic axis cannot show extends to the end of the axis.
            let low = Some(series.low[i]).filter(|v| !v.is_nan());
            let high = Some(series.high[i]).filter(|v| !v.is_nan());
            let (Some(bottom), Some(top)) = (
                low.map(|v| self.y(v)).or_else(|| high.map(|_| self.bottom)),
                high.map(|v| self.y(v)),
            ) else {
                continue;
            };
            let px = self.x(x);
            let _ = write!(
                path,
                "M{0} {1}V{2}M{3} {1}h8M{3} {2}h8",
                coordinate(px),
                coordinate(bottom),
                coordinate(top),
                coordinate(px - 4.0)
            );
        }
        path
    }

    /// Returns the closed outline of a band, one piece for each run without gaps.
    fn area(&self, series: &Drawn<'_>) -> String {
        let mut path = String::new();
        let mut run: Vec<usize> = Vec::new();
        let chosen = self.chosen(series);
        let whole =
            |i: usize| !series.x[i].is_nan() && !series.low[i].is_nan() && !series.high[i].is_nan();
        for i in chosen.into_iter().map(Some).chain([None]) {
            if let Some(i) = i
                && whole(i)
            {
                run.push(i);
                continue;
            }
            let upper = run.iter().map(|i| (series.x[*i], series.high[*i]));
            let lower = run.iter().rev().map(|i| (series.x[*i], series.low[*i]));
            for (k, (x, y)) in upper.chain(lower).enumerate() {
                let _ = write!(
                    path,
                    "{}{} {}",
                    if k == 0 { 'M' } else { 'L' },
                    coordinate(self.x(x)),
                    coordinate(self.y(y))
                );
            }
            if !run.is_empty() {
                path.push('z');
            }
            run.clear();
        }
        path
    }

    /// Returns true if the label of a vertical marker belongs to the left of its line: to the right it leaves the plot, or
    /// crosses the line of another marker, which it does not to the left.
    fn label_leftwards(&self, at: f64, width: f64) -> bool {
        let plot = self.scene.plot;
        let others = || {
            let vertical = (plot.markers.iter())
                .filter(|m| m.direction == Direction::Vertical && marker_drawable(plot, m));
            vertical.map(|m| self.x(m.at)).filter(|x| *x != at)
        };
        let crossed = |a: f64, b: f64| others().any(|x| a < x && x < b);
        let (right, left) = (at + 10.0 + width, at - 10.0 - width);
        right > self.right || (crossed(at, right) && left > self.left && !crossed(left, at))
    }

    fn markers(&self, out: &mut String) {
        let plot = self.scene.plot;
        let ink = self.palette.named("marker", "#3d4650");
        let paper = self.palette.named("card", "#fff");
        // Right ends of the labels of vertical markers, line by line from the top.
        let mut lines: Vec<Vec<(f64, f64)>> = Vec::new();
        let mut heights: Vec<f64> = Vec::new();
        for marker in plot.markers.iter().filter(|m| marker_drawable(plot, m)) {
            let width = width_of(&marker.label) * 0.92;
            let (path, x, y, anchor) = match marker.direction {
                Direction::Vertical => {
                    let at = self.x(marker.at);
                    let leftwards = self.label_leftwards(at, width);
                    let (a, b) = if leftwards {
                        (at - 6.0 - width, at - 6.0)
                    } else {
                        (at + 6.0, at + 6.0 + width)
                    };
                    let free = |line: &Vec<(f64, f64)>| line.iter().all(|(c, d)| b < *c || *d < a);
                    let line = lines.iter().position(free).unwrap_or(lines.len());
                    if line == lines.len() {
                        lines.push(Vec::new());
                    }
                    lines[line].push((a, b));
                    let path = format!(
                        "M{} {}V{}",
                        coordinate(at),
                        coordinate(self.top),
                        coordinate(self.bottom)
                    );
                    let y = self.top + 13.0 + 16.0 * line as f64;
                    let anchor = if leftwards { "end" } else { "start" };
                    (path, if leftwards { b } else { a }, y, anchor)
                }
                Direction::Horizontal => {
                    let at = self.y(marker.at);
                    let above = at - 5.0 - FONT > self.top;
                    let mut y = if above { at - 5.0 } else { at + FONT + 3.0 };
                    while heights.iter().any(|h| (h - y).abs() < FONT) {
                        y += if above { -FONT } else { FONT };
                    }
                    heights.push(y);
                    let path = format!(
                        "M{} {}H{}",
                        coordinate(self.left),
                        coordinate(at),
                        coordinate(self.right)
                    );
                    (path, self.right - 4.0, y, "end")
                }
            };
            let _ = write!(
                out,
                "<path d=\"{path}\" style=\"fill:none;stroke:{ink};stroke-width:1.1;stroke-dasharray:2 3\"/>\
                 <text x=\"{}\" y=\"{}\" text-anchor=\"{anchor}\" font-size=\"12\" \
                 style=\"fill:{ink};stroke:{paper};stroke-width:3;paint-order:stroke;stroke-linejoin:round\">{}</text>",
                coordinate(x),
                coordinate(y),
                text(&marker.label)
            );
        }
    }
}

/// Returns a legend sample of a series, 22 by 9, with its left middle at the given position.
pub(crate) fn swatch(shape: Shape, dashed: bool, colour: &str, x: f64, y: f64) -> String {
    let dash = if dashed { ";stroke-dasharray:5 3" } else { "" };
    let (x0, y0) = (coordinate(x), coordinate(y));
    match shape {
        Shape::Line => format!(
            "<path d=\"M{x0} {y0}h22\" style=\"fill:none;stroke:{colour};stroke-width:2.2{dash}\"/>"
        ),
        Shape::Steps => format!(
            "<path d=\"M{x0} {}h11v-6h11\" style=\"fill:none;stroke:{colour};stroke-width:2{dash}\"/>",
            coordinate(y + 3.0)
        ),
        Shape::Points => format!(
            "<path d=\"M{} {}h0M{} {}h0M{} {}h0\" style=\"fill:none;stroke:{colour};stroke-width:4.4;stroke-linecap:round\"/>",
            coordinate(x + 3.0),
            coordinate(y + 2.0),
            coordinate(x + 11.0),
            coordinate(y - 2.0),
            coordinate(x + 19.0),
            coordinate(y + 1.0)
        ),
        Shape::Band => format!(
            "<path d=\"M{x0} {}h22v9h-22z\" style=\"fill:{colour};fill-opacity:.3;stroke:none\"/>",
            coordinate(y - 4.5)
        ),
        Shape::Bars { .. } => format!(
            "<path d=\"M{x0} {}h22v9h-22z\" style=\"fill:{colour};fill-opacity:.85;stroke:none\"/>",
            coordinate(y - 4.5)
        ),
        Shape::ErrorBars => format!(
            "<path d=\"M{0} {1}v10m-4 0h8m-8 -10h8\" style=\"fill:none;stroke:{colour};stroke-width:1.3\"/>\
             <path d=\"M{0} {y0}h0\" style=\"fill:none;stroke:{colour};stroke-width:5.5;stroke-linecap:round\"/>",
            coordinate(x + 11.0),
            coordinate(y - 5.0)
        ),
    }
}

/// Returns the relative position of a value in a range; 0 to 1 inside it.
fn share(value: f64, (low, high): (f64, f64), log: bool) -> f64 {
    if log {
        (value.log10() - low.log10()) / (high.log10() - low.log10())
    } else {
        (value - low) / (high - low)
    }
}

/// Widens one of the ranges about its middle until both axes have the same scale.
fn equalise(x: &mut (f64, f64), y: &mut (f64, f64), width: f64, height: f64) {
    let scale = ((x.1 - x.0) / width).max((y.1 - y.0) / height);
    for (range, length) in [(x, width), (y, height)] {
        let middle = 0.5 * (range.0 + range.1);
        *range = (middle - 0.5 * scale * length, middle + 0.5 * scale * length);
    }
}

/// Formats a coordinate with one decimal: a tenth of a unit is below the resolution of screens and printers.
fn coordinate(value: f64) -> String {
    // The exact position far outside the picture does not matter, and renderers limit the values.
    let text = format!("{:.1}", value.clamp(-1e5, 1e5));
    let text = text.strip_suffix(".0").unwrap_or(&text);
    if text == "-0" { "0" } else { text }.to_owned()
}
