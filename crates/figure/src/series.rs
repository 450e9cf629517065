//! What a figure draws: series of points, guides, annotations.

use super::palette::{GREY, INK, Palette, Rgb};

/// How a line is interrupted.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Stroke {
    /// Stable branches and measured curves.
    Solid,
    /// Unstable branches.
    Dashed,
    /// Everything that is only for comparison.
    Dotted,
}

/// The shape that marks a point.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Marker {
    /// Filled circle.
    Circle,
    /// Ring, as at a point where `xi_1 = 0`.
    Ring,
    /// Filled square.
    Square,
    /// Filled diamond.
    Diamond,
    /// Filled triangle.
    Triangle,
    /// Two crossed strokes.
    Cross,
}

impl Marker {
    /// A marker for the series of an index, so that neighbours differ without colour too.
    pub fn numbered(index: usize) -> Self {
        const ALL: [Marker; 5] =
            [Marker::Circle, Marker::Square, Marker::Diamond, Marker::Triangle, Marker::Ring];
        ALL[index % ALL.len()]
    }
}

/// How a series is drawn.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum SeriesStyle {
    /// Small dots for very many points, thinned by cell of a grid.
    Dots,
    /// One marker at every point.
    Markers(Marker),
    /// A line through the points.
    Line(Stroke),
    /// A line with a marker at every point.
    LineWithMarkers(Stroke, Marker),
}

/// Points that belong together.
#[derive(Debug, Clone, PartialEq)]
pub struct Series {
    /// Name in the legend; empty for none.
    pub name: String,
    /// Horizontal and vertical values. A point that is not finite interrupts a line.
    pub points: Vec<[f64; 2]>,
    /// How it is drawn.
    pub style: SeriesStyle,
    /// Its colour.
    pub color: SeriesColor,
}

/// The colour of a series.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum SeriesColor {
    /// The palette's, by the index of the series in its figure.
    Own,
    /// The palette's, by another index.
    Palette(usize),
    /// Grey, of what is not to be trusted.
    Grey,
    /// The ink of the axes, over a chart of cells.
    Ink,
}

impl SeriesColor {
    /// The colour of a series of an index among so many.
    pub(super) fn of(self, index: usize, palette: Palette, count: usize) -> Rgb {
        match self {
            Self::Own => palette.color(index, count),
            Self::Palette(other) => palette.color(other, count),
            Self::Grey => GREY,
            Self::Ink => INK,
        }
    }
}

impl Series {
    /// Very many points as dots.
    pub fn dots(name: impl Into<String>, points: Vec<[f64; 2]>) -> Self {
        Self { name: name.into(), points, style: SeriesStyle::Dots, color: SeriesColor::Own }
    }

    /// Points with a marker each.
    pub fn markers(name: impl Into<String>, marker: Marker, points: Vec<[f64; 2]>) -> Self {
        Self { style: SeriesStyle::Markers(marker), ..Self::dots(name, points) }
    }

    /// A line.
    pub fn line(name: impl Into<String>, stroke: Stroke, points: Vec<[f64; 2]>) -> Self {
        Self { style: SeriesStyle::Line(stroke), ..Self::dots(name, points) }
    }

    /// A solid line with a marker at every point.
    pub fn line_with_markers(
        name: impl Into<String>,
        marker: Marker,
        points: Vec<[f64; 2]>,
    ) -> Self {
        Self {
            style: SeriesStyle::LineWithMarkers(Stroke::Solid, marker),
            ..Self::dots(name, points)
        }
    }

    /// The same series in a colour of the palette, shared with another series.
    #[must_use]
    pub fn with_color(mut self, index: usize) -> Self {
        self.color = SeriesColor::Palette(index);
        self
    }

    /// The same series in grey.
    #[must_use]
    pub fn in_grey(mut self) -> Self {
        self.color = SeriesColor::Grey;
        self
    }

    /// The same series in the ink of the axes.
    #[must_use]
    pub fn in_ink(mut self) -> Self {
        self.color = SeriesColor::Ink;
        self
    }
}

/// A line for comparison, thin and grey.
#[derive(Debug, Clone, PartialEq)]
pub enum Guide {
    /// At one value of the vertical axis.
    Horizontal {
        /// The value.
        at: f64,
        /// Words beside it; may be empty.
        label: String,
    },
    /// At one value of the horizontal axis.
    Vertical {
        /// The value.
        at: f64,
        /// Words beside it; may be empty.
        label: String,
    },
    /// A power law `y = through.1 (x / through.0)^exponent` from `through.0` to `to`: a straight
    /// line on two logarithmic axes. Needs positive coordinates.
    Slope {
        /// A point on it.
        through: [f64; 2],
        /// The exponent of the law.
        exponent: f64,
        /// Horizontal value of its other end.
        to: f64,
        /// Words beside it; may be empty.
        label: String,
    },
}

/// Words beside a point, such as `G`, `PD` or `SN`.
#[derive(Debug, Clone, PartialEq)]
pub struct Annotation {
    /// The point.
    pub at: [f64; 2],
    /// The words.
    pub text: String,
    /// A marker at the point itself.
    pub marker: Option<Marker>,
}

impl Annotation {
    /// Words beside a point with a ring around it.
    pub fn ring(at: [f64; 2], text: impl Into<String>) -> Self {
        Self { at, text: text.into(), marker: Some(Marker::Ring) }
    }
}
