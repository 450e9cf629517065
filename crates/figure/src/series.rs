//! Elements of a figure (series of points, guides, annotations), and their colours, which stay
//! distinct for colour-blind readers, on white and in grey print.
//!
//! Reference: Okabe and Ito, "Color Universal Design" (2008), without its yellow, which is too pale
//! on white; the "muted" scheme of Tol, "Colour schemes" (SRON/EPS/TN/09-002, 2021), for cells; the
//! viridis ramp of matplotlib for ordered series, and PuOr of Brewer, "ColorBrewer" (2002), turned
//! round, for values of two signs.

/// Line pattern.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Stroke {
    /// Solid: stable branches and measured curves.
    Solid,
    /// Dashed: unstable branches.
    Dashed,
    /// Dotted: everything that is only for comparison.
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
    /// Marker for the series with this index; neighbours differ in shape.
    pub fn numbered(index: usize) -> Self {
        const ALL: [Marker; 5] =
            [Marker::Circle, Marker::Square, Marker::Diamond, Marker::Triangle, Marker::Ring];
        ALL[index % ALL.len()]
    }
}

/// Style in which a series is drawn.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum SeriesStyle {
    /// Small dots for very many points; dots in the same cell of a grid are drawn once.
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
    /// Style in which it is drawn.
    pub style: SeriesStyle,
    /// Colour of the series.
    pub color: SeriesColor,
}

/// The colour of a series.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum SeriesColor {
    /// Colour of the palette at the index of the series in its figure.
    Own,
    /// Colour of the palette at another index.
    Palette(usize),
    /// Grey, for untrusted results.
    Grey,
    /// The ink of the axes, over a chart of cells.
    Ink,
}

impl SeriesColor {
    /// Colour of the series with this index among `count` series.
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
    /// A series of very many points as dots.
    pub fn dots(name: impl Into<String>, points: Vec<[f64; 2]>) -> Self {
        Self { name: name.into(), points, style: SeriesStyle::Dots, color: SeriesColor::Own }
    }

    /// A series of points with a marker each.
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

    /// Gives the series the palette's colour of this index, to share it with another series.
    #[must_use]
    pub fn with_color(mut self, index: usize) -> Self {
        self.color = SeriesColor::Palette(index);
        self
    }

    /// Draws the series in grey.
    #[must_use]
    pub fn in_grey(mut self) -> Self {
        self.color = SeriesColor::Grey;
        self
    }

    /// Draws the series in the ink of the axes.
    #[must_use]
    pub fn in_ink(mut self) -> Self {
        self.color = SeriesColor::Ink;
        self
    }
}

/// A thin grey line for comparison.
#[derive(Debug, Clone, PartialEq)]
pub enum Guide {
    /// Horizontal line at one value of the vertical axis.
    Horizontal {
        /// The value.
        at: f64,
        /// Words beside the line; may be empty.
        label: String,
    },
    /// Vertical line at one value of the horizontal axis.
    Vertical {
        /// The value.
        at: f64,
        /// Words beside the line; may be empty.
        label: String,
    },
    /// Power law `y = through.1 (x / through.0)^exponent` from `through.0` to `to`: a straight line
    /// on two logarithmic axes. All coordinates must be positive.
    Slope {
        /// Start of the line.
        through: [f64; 2],
        /// Exponent of the law.
        exponent: f64,
        /// Horizontal value of the end of the line.
        to: f64,
        /// Words beside the line; may be empty.
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

/// Red, green, blue.
pub(super) type Rgb = [u8; 3];

/// Ink of axes and text.
pub(super) const INK: Rgb = [0x1f, 0x23, 0x28];
/// Ink of secondary text and guides.
pub(super) const FAINT_INK: Rgb = [0x6a, 0x70, 0x78];
/// Colour of untrusted results.
pub(super) const GREY: Rgb = [0xb3, 0xb7, 0xbc];
/// Colour of cells in which nothing happens.
pub(super) const PALE: Rgb = [0xf7, 0xee, 0xc3];
/// Colour of cells in which nothing repeats.
pub(super) const CHAOS: Rgb = [0xf4, 0xa5, 0x82];
/// Lines of the grid.
pub(super) const GRID: Rgb = [0xe6, 0xe8, 0xeb];
/// The paper.
pub(super) const PAPER: Rgb = [0xff, 0xff, 0xff];

/// Assignment of colours to the series of a figure.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Palette {
    /// Unrelated series.
    Categorical,
    /// Series in an order, such as truncation orders: dark to light.
    Sequential,
}

const CATEGORICAL: [Rgb; 8] = [
    [0x00, 0x72, 0xb2],
    [0xd5, 0x5e, 0x00],
    [0x00, 0x9e, 0x73],
    [0xcc, 0x79, 0xa7],
    [0xe6, 0x9f, 0x00],
    [0x56, 0xb4, 0xe9],
    [0x8c, 0x56, 0x4b],
    [0x30, 0x34, 0x3a],
];

/// Colours of areas.
pub(super) const CELLS: [Rgb; 9] = [
    [0x88, 0xcc, 0xee],
    [0xdd, 0xcc, 0x77],
    [0xcc, 0x66, 0x77],
    [0x11, 0x77, 0x33],
    [0xaa, 0x44, 0x99],
    [0x99, 0x99, 0x33],
    [0x88, 0x22, 0x55],
    [0x44, 0xaa, 0x99],
    [0x33, 0x22, 0x88],
];

const DIVERGING: [Rgb; 9] = [
    [0x2d, 0x00, 0x4b],
    [0x54, 0x27, 0x88],
    [0x80, 0x73, 0xac],
    [0xb2, 0xab, 0xd2],
    [0xf7, 0xf7, 0xf7],
    [0xfd, 0xb8, 0x63],
    [0xe0, 0x82, 0x14],
    [0xb3, 0x58, 0x06],
    [0x7f, 0x3b, 0x08],
];

const VIRIDIS: [Rgb; 9] = [
    [0x44, 0x01, 0x54],
    [0x47, 0x2d, 0x7b],
    [0x3b, 0x52, 0x8b],
    [0x2c, 0x72, 0x8e],
    [0x21, 0x91, 0x8c],
    [0x28, 0xae, 0x80],
    [0x5e, 0xc9, 0x62],
    [0xad, 0xdc, 0x30],
    [0xfd, 0xe7, 0x25],
];

impl Palette {
    /// The colour of one of `count` series.
    pub(super) fn color(self, index: usize, count: usize) -> Rgb {
        match self {
            Self::Categorical => CATEGORICAL[index % CATEGORICAL.len()],
            Self::Sequential => {
                // NOTE: the ramp's last fifth is too pale on white.
                let last = count.max(2) - 1;
                viridis(0.82 * index.min(last) as f64 / last as f64)
            }
        }
    }
}

/// Colour of the viridis ramp at a fraction from 0 to 1.
pub(super) fn viridis(fraction: f64) -> Rgb {
    along(&VIRIDIS, fraction)
}

/// Colour of the diverging ramp at a share from −1 to 1.
pub(super) fn diverging(share: f64) -> Rgb {
    along(&DIVERGING, 0.5 * (1.0 + share))
}

fn along(ramp: &[Rgb; 9], fraction: f64) -> Rgb {
    let along = fraction.clamp(0.0, 1.0) * (ramp.len() - 1) as f64;
    let below = (along as usize).min(ramp.len() - 2);
    mixed(ramp[below], ramp[below + 1], along - below as f64)
}

/// Mixture of two colours; the second has the share `weight`.
pub(super) fn mixed(first: Rgb, second: Rgb, weight: f64) -> Rgb {
    std::array::from_fn(|i| {
        let (from, to) = (f64::from(first[i]), f64::from(second[i]));
        (from + weight * (to - from)).round() as u8
    })
}

/// Colour on dark paper: the inks, greys and paper exchanged, other colours as light as they must
/// be to be seen.
pub(super) fn on_dark(color: Rgb) -> Rgb {
    const PAPER_DARK: Rgb = [0x16, 0x18, 0x1b];
    const WHITE: Rgb = [0xff; 3];
    /// Least ratio of luminances at which a line is seen.
    const CONTRAST: f64 = 4.0;
    match color {
        PAPER => PAPER_DARK,
        INK => [0xe7, 0xe9, 0xec],
        FAINT_INK => [0x9b, 0xa2, 0xab],
        GREY => [0x62, 0x68, 0x70],
        GRID => [0x2c, 0x30, 0x35],
        _ => {
            let paler = (0..=10).map(|tenths| mixed(color, WHITE, 0.1 * f64::from(tenths)));
            let floor = luminance(PAPER_DARK) + 0.05;
            let seen = |color: &Rgb| (luminance(*color) + 0.05) / floor >= CONTRAST;
            paler.into_iter().find(seen).unwrap_or(WHITE)
        }
    }
}

/// Relative luminance, from 0 to 1 (Web Content Accessibility Guidelines 2.2).
fn luminance(color: Rgb) -> f64 {
    let linear = color.map(|channel| {
        let value = f64::from(channel) / 255.0;
        if value <= 0.04045 { value / 12.92 } else { ((value + 0.055) / 1.055).powf(2.4) }
    });
    0.2126 * linear[0] + 0.7152 * linear[1] + 0.0722 * linear[2]
}
