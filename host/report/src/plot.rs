//! Content of a figure: series over two axes, markers, and texts.

use super::error::ReportError;

/// Meaning of a series; each role has one colour throughout a document.
///
/// The colours are those of Okabe and Ito (2008), "Color Universal Design"; readers with common colour-vision
/// deficiencies can distinguish them.
#[derive(Clone, Copy, Debug, Eq, PartialEq)]
pub enum Role {
    /// A measurement (blue).
    Measured,
    /// A model (vermillion).
    Model,
    /// Residual between the two (reddish purple).
    Residual,
    /// A command, a nominal or a true value (ink).
    Reference,
    /// Noise floor, tolerance, or background (grey).
    Noise,
    /// State before a step, or training data (orange).
    Before,
    /// State after a step, or hold-out data (bluish green).
    After,
    /// A further series (sky blue).
    Other,
}

impl Role {
    /// All roles, in the order recommended for series without a natural role.
    pub const ALL: [Role; 8] = [
        Role::Measured,
        Role::Model,
        Role::After,
        Role::Before,
        Role::Residual,
        Role::Other,
        Role::Reference,
        Role::Noise,
    ];

    /// Name used in style sheets and data.
    pub(crate) fn name(self) -> &'static str {
        match self {
            Role::Measured => "measured",
            Role::Model => "model",
            Role::Residual => "residual",
            Role::Reference => "reference",
            Role::Noise => "noise",
            Role::Before => "before",
            Role::After => "after",
            Role::Other => "other",
        }
    }

    /// Colour on white.
    pub(crate) fn light(self) -> &'static str {
        match self {
            Role::Measured => "#0072b2",
            Role::Model => "#d55e00",
            Role::Residual => "#b8608f",
            Role::Reference => "#1b1f24",
            Role::Noise => "#8a929c",
            Role::Before => "#d08f00",
            Role::After => "#009e73",
            Role::Other => "#56b4e9",
        }
    }

    /// The same hue, lighter for a dark background.
    pub(crate) fn dark(self) -> &'static str {
        match self {
            Role::Measured => "#4aa8e0",
            Role::Model => "#f07f2e",
            Role::Residual => "#dd92bd",
            Role::Reference => "#e8eaed",
            Role::Noise => "#8d96a1",
            Role::Before => "#f0b53a",
            Role::After => "#2cc79a",
            Role::Other => "#9ad6f7",
        }
    }
}

/// How a series is drawn.
#[derive(Clone, Debug, PartialEq)]
pub enum Style {
    /// Points joined in their order; also for closed curves such as confidence ellipses.
    Line,
    /// Dots.
    Points,
    /// Held from each sample to the next.
    Steps,
    /// The area between two curves; `y` is empty or holds a curve within it.
    Band {
        /// Lower edge, one value per sample.
        low: Vec<f64>,
        /// Upper edge, one value per sample.
        high: Vec<f64>,
    },
    /// Bars from zero; several series of bars stand side by side.
    Bars,
    /// Dots with a vertical bar of `y` ± half width.
    ErrorBars {
        /// Half the bar's height, one value per sample.
        half_width: Vec<f64>,
    },
}

/// One curve, cloud or set of bars.
#[derive(Clone, Debug, PartialEq)]
pub struct Series {
    /// Name in the legend.
    pub name: String,
    /// Abscissae in the unit of the x axis; a value that is not finite is a gap. NaN in all coordinates ends a piece of the
    /// curve or band and is not counted as missing.
    pub x: Vec<f64>,
    /// Ordinates in the unit of the y axis; a value that is not finite is a gap.
    pub y: Vec<f64>,
    /// Style of drawing.
    pub style: Style,
    /// Meaning of the series.
    pub role: Role,
    /// True for a dashed line, for a second curve of the same role.
    pub dashed: bool,
}

impl Series {
    /// Creates a series of the given style.
    pub fn new(
        name: impl Into<String>,
        role: Role,
        style: Style,
        x: Vec<f64>,
        y: Vec<f64>,
    ) -> Self {
        Self {
            name: name.into(),
            x,
            y,
            style,
            role,
            dashed: false,
        }
    }

    /// Creates a line.
    pub fn line(name: impl Into<String>, role: Role, x: Vec<f64>, y: Vec<f64>) -> Self {
        Self::new(name, role, Style::Line, x, y)
    }

    /// Creates a cloud of dots.
    pub fn points(name: impl Into<String>, role: Role, x: Vec<f64>, y: Vec<f64>) -> Self {
        Self::new(name, role, Style::Points, x, y)
    }

    /// Creates an area between two curves.
    pub fn band(
        name: impl Into<String>,
        role: Role,
        x: Vec<f64>,
        low: Vec<f64>,
        high: Vec<f64>,
    ) -> Self {
        Self::new(name, role, Style::Band { low, high }, x, Vec::new())
    }

    /// Makes the line dashed.
    #[must_use]
    pub fn dashed(mut self) -> Self {
        self.dashed = true;
        self
    }
}

/// One axis.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Axis {
    /// Quantity.
    pub label: String,
    /// Unit, if the quantity has one.
    pub unit: Option<String>,
    /// True for a logarithmic axis. Values that are not positive are gaps, counted in the figure's note.
    pub log: bool,
    /// Names of the positions 0, 1, 2, …; if not empty, the axis shows no numbers.
    pub categories: Vec<String>,
}

impl Axis {
    /// Creates a linear axis; an empty unit means no unit.
    pub fn new(label: impl Into<String>, unit: &str) -> Self {
        Self {
            label: label.into(),
            unit: (!unit.is_empty()).then(|| unit.to_owned()),
            ..Self::default()
        }
    }

    /// Creates a logarithmic axis.
    pub fn log(label: impl Into<String>, unit: &str) -> Self {
        Self {
            log: true,
            ..Self::new(label, unit)
        }
    }

    /// Creates an axis of named positions 0, 1, 2, ….
    pub fn categories(label: impl Into<String>, names: Vec<String>) -> Self {
        Self {
            categories: names,
            ..Self::new(label, "")
        }
    }

    /// Returns quantity and unit as written beside the axis.
    pub(crate) fn title(&self) -> String {
        match (&self.unit, self.label.is_empty()) {
            (Some(unit), false) => format!("{} ({unit})", self.label),
            (Some(unit), true) => unit.clone(),
            (None, _) => self.label.clone(),
        }
    }
}

/// Direction of a marker line.
#[derive(Clone, Copy, Debug, Eq, PartialEq)]
pub enum Direction {
    /// At one abscissa, from bottom to top.
    Vertical,
    /// At one ordinate, from side to side.
    Horizontal,
}

/// A labelled line across the figure; always within the figure's range.
#[derive(Clone, Debug, PartialEq)]
pub struct Marker {
    /// Direction of the line.
    pub direction: Direction,
    /// Position on its axis, in the unit of the axis.
    pub at: f64,
    /// Text beside the line.
    pub label: String,
}

impl Marker {
    /// Creates a line at one abscissa.
    pub fn vertical(at: f64, label: impl Into<String>) -> Self {
        Self {
            direction: Direction::Vertical,
            at,
            label: label.into(),
        }
    }

    /// Creates a line at one ordinate.
    pub fn horizontal(at: f64, label: impl Into<String>) -> Self {
        Self {
            direction: Direction::Horizontal,
            at,
            label: label.into(),
        }
    }
}

/// A figure.
#[derive(Clone, Debug, PartialEq)]
pub struct Plot {
    /// Description of the figure in words; also its alternative text.
    pub title: String,
    /// Abscissa.
    pub x: Axis,
    /// Ordinate.
    pub y: Axis,
    /// Series in the order of drawing, later ones on top.
    pub series: Vec<Series>,
    /// Labelled lines.
    pub markers: Vec<Marker>,
    /// True for equal scales on both axes, for ellipses and paths. Linear axes only.
    pub equal_aspect: bool,
    /// Note, for example number of samples, RMS and command. May be empty.
    pub note: String,
    /// Height in px at a width of 760 px.
    pub height: u32,
}

impl Plot {
    /// Default height of a figure, px.
    pub const HEIGHT: u32 = 320;

    /// Creates a figure without series.
    pub fn new(title: impl Into<String>, x: Axis, y: Axis) -> Self {
        Self {
            title: title.into(),
            x,
            y,
            series: Vec::new(),
            markers: Vec::new(),
            equal_aspect: false,
            note: String::new(),
            height: Self::HEIGHT,
        }
    }

    /// Adds a series on top.
    #[must_use]
    pub fn with(mut self, series: Series) -> Self {
        self.series.push(series);
        self
    }

    /// Adds a marker.
    #[must_use]
    pub fn mark(mut self, marker: Marker) -> Self {
        self.markers.push(marker);
        self
    }

    /// Sets the note.
    #[must_use]
    pub fn note(mut self, note: impl Into<String>) -> Self {
        self.note = note.into();
        self
    }

    /// Checks that every series has equal numbers of ordinates (and edges) and abscissae, and that the settings are
    /// consistent.
    ///
    /// # Errors
    /// [`ReportError::Lengths`], [`ReportError::Aspect`] or [`ReportError::Height`].
    pub(crate) fn check(&self) -> Result<(), ReportError> {
        if self.equal_aspect && (self.x.log || self.y.log) {
            return Err(ReportError::Aspect {
                figure: self.title.clone(),
            });
        }
        if !(120..=2000).contains(&self.height) {
            return Err(ReportError::Height {
                figure: self.title.clone(),
                height: self.height,
            });
        }
        for series in &self.series {
            let n = series.x.len();
            let lengths = |what: &'static str, found: usize| ReportError::Lengths {
                figure: self.title.clone(),
                series: series.name.clone(),
                what,
                found,
                expected: n,
            };
            let band = matches!(series.style, Style::Band { .. });
            if series.y.len() != n && !(band && series.y.is_empty()) {
                return Err(lengths("ordinates", series.y.len()));
            }
            match &series.style {
                Style::Band { low, high } => {
                    if low.len() != n {
                        return Err(lengths("lower edges", low.len()));
                    }
                    if high.len() != n {
                        return Err(lengths("upper edges", high.len()));
                    }
                }
                Style::ErrorBars { half_width } if half_width.len() != n => {
                    return Err(lengths("half widths", half_width.len()));
                }
                _ => {}
            }
        }
        Ok(())
    }
}
