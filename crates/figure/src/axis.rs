//! Axes: names, scales, the place of a value, and ticks.
//!
//! Ticks are round values with exact, short labels. A linear tick is a whole multiple of `m·10^e`
//! with `m` in {1, 2, 5}; its text is made from the whole number, so that no rounding shows. A
//! power of ten common to all ticks moves to the label of the axis.

use std::cmp::Ordering;

use super::FigureError;

/// Scale of an axis: the function from values to distances along it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum AxisScale {
    /// Linear: equal differences are equal distances.
    Linear,
    /// Logarithmic: equal ratios are equal distances; positive values only.
    Log10,
    /// Symmetric logarithmic: `sign(x) log10(1 + |x|/threshold)`, linear within about `±threshold`
    /// and logarithmic beyond.
    Symlog {
        /// Value at which linear turns into logarithmic; positive.
        threshold: f64,
    },
}

impl AxisScale {
    /// Distance of a value along the axis, up to scale and shift; NaN if the value is not on the
    /// scale.
    pub(super) fn place(self, value: f64) -> f64 {
        match self {
            Self::Linear => value,
            Self::Log10 if value > 0.0 => value.log10(),
            Self::Log10 => f64::NAN,
            Self::Symlog { threshold } => value.signum() * (1.0 + value.abs() / threshold).log10(),
        }
    }

    /// The value at a place; the inverse of [`AxisScale::place`].
    pub(super) fn value(self, place: f64) -> f64 {
        match self {
            Self::Linear => place,
            Self::Log10 => 10_f64.powf(place),
            Self::Symlog { threshold } => {
                place.signum() * threshold * (10_f64.powf(place.abs()) - 1.0)
            }
        }
    }

    fn name(self) -> &'static str {
        match self {
            Self::Linear => "linear",
            Self::Log10 => "logarithmic",
            Self::Symlog { .. } => "symmetric logarithmic",
        }
    }
}

/// One axis of a figure.
#[derive(Debug, Clone, PartialEq)]
pub struct Axis {
    /// Name of the quantity; a power of ten common to the ticks is added.
    pub label: String,
    /// Scale of the axis.
    pub scale: AxisScale,
    /// Ends of the axis; `None` takes them from the data.
    pub range: Option<(f64, f64)>,
    /// Names of rows in place of ticks, the first at 0 and each further one at one less; empty for
    /// an axis of numbers. Rows are shown on a vertical axis only.
    pub rows: Vec<String>,
}

/// A second scale of a linear axis, on the opposite side of the picture: its values plus a
/// constant.
#[derive(Debug, Clone, PartialEq)]
pub struct ShiftedScale {
    /// Name of the quantity.
    pub label: String,
    /// Number added to the values of the axis.
    pub shift: f64,
}

impl ShiftedScale {
    /// Ends of the second scale; `None` if the axis is not linear or is too short for distinct
    /// ticks in `f64`.
    pub(super) fn ends(&self, axis: &Axis, ends: (f64, f64)) -> Option<(f64, f64)> {
        let shifted = (ends.0 + self.shift, ends.1 + self.shift);
        let shown = axis.scale == AxisScale::Linear && self.shift.is_finite();
        (shown && !too_narrow(shifted)).then_some(shifted)
    }
}

impl Axis {
    /// A linear axis that shows all data.
    pub fn linear(label: impl Into<String>) -> Self {
        Self { label: label.into(), scale: AxisScale::Linear, range: None, rows: Vec::new() }
    }

    /// A vertical axis of named rows, the first at 0 on top and each further one at one less.
    pub fn of_rows(names: Vec<String>) -> Self {
        let last = 1.0 - names.len().max(1) as f64;
        Self { rows: names, ..Self::linear("").with_range(last - 0.6, 0.6) }
    }

    /// A logarithmic axis that shows all positive data.
    pub fn log10(label: impl Into<String>) -> Self {
        Self { scale: AxisScale::Log10, ..Self::linear(label) }
    }

    /// Fixes the ends of the axis. A range too short for distinct ticks in `f64` is drawn wider.
    #[must_use]
    pub fn with_range(mut self, lower: f64, upper: f64) -> Self {
        self.range = Some((lower, upper));
        self
    }

    /// Ends of the axis as places, with a margin if they come from the data.
    ///
    /// # Errors
    ///
    /// [`FigureError::AxisRange`] for an explicit range that is reversed or empty, not finite or
    /// not on the scale, and for a symmetric logarithmic threshold that is not positive.
    pub(super) fn ends(&self, data: impl Iterator<Item = f64>) -> Result<(f64, f64), FigureError> {
        if let AxisScale::Symlog { threshold } = self.scale
            && !(threshold > 0.0 && threshold.is_finite())
        {
            return Err(self.refuse(threshold, threshold));
        }
        let Some((lower, upper)) = self.range else {
            return Ok(with_margin(extremes(data.map(|value| self.scale.place(value)))));
        };
        let places = (self.scale.place(lower), self.scale.place(upper));
        let finite = lower.is_finite() && upper.is_finite() && (upper - lower).is_finite();
        let ascending = places.0.partial_cmp(&places.1) == Some(Ordering::Less);
        if !finite || !ascending {
            return Err(self.refuse(lower, upper));
        }
        Ok(if too_narrow(places) { with_margin(Some(places)) } else { places })
    }

    fn refuse(&self, lower: f64, upper: f64) -> FigureError {
        FigureError::AxisRange { axis: self.label.clone(), lower, upper, scale: self.scale.name() }
    }
}

/// Whether the ends are too close together for distinct ticks in `f64`.
fn too_narrow((lower, upper): (f64, f64)) -> bool {
    upper - lower <= 1e-13 * lower.abs().max(upper.abs()) || upper - lower < 1e-290
}

fn extremes(places: impl Iterator<Item = f64>) -> Option<(f64, f64)> {
    places
        // NOTE: beyond 1e300 the width of the axis would overflow.
        .filter(|place| place.abs() < 1e300)
        .fold(None, |ends, place| match ends {
            None => Some((place, place)),
            Some((lower, upper)) => Some((place.min(lower), place.max(upper))),
        })
}

fn with_margin(ends: Option<(f64, f64)>) -> (f64, f64) {
    const MARGIN: f64 = 0.04;
    match ends {
        None => (0.0, 1.0),
        Some((lower, upper)) if too_narrow((lower, upper)) => {
            let half = if lower == 0.0 { 1.0 } else { 0.1 * lower.abs().max(1e-280) };
            (lower - half, upper + half)
        }
        Some((lower, upper)) => {
            let margin = MARGIN * (upper - lower);
            (lower - margin, upper + margin)
        }
    }
}

/// One tick.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Tick {
    /// Place along the axis.
    pub(super) place: f64,
    /// Label with markup; empty for a grid line without a label.
    pub(super) text: String,
}

/// The ticks of one axis.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Ticks {
    /// Ticks in ascending order.
    pub(super) ticks: Vec<Tick>,
    /// Power of ten that multiplies every text; 0 for none.
    pub(super) power: i32,
}

/// Ticks of named rows, the first on top: row `i` lies at `−i`.
pub(super) fn row_ticks(names: &[String]) -> Ticks {
    let tick =
        |(number, name): (usize, &String)| Tick { place: -(number as f64), text: name.clone() };
    let mut ticks: Vec<Tick> = names.iter().enumerate().map(tick).collect();
    ticks.reverse();
    Ticks { ticks, power: 0 }
}

/// Ticks between two places, about `wanted` of them.
pub(super) fn ticks(scale: AxisScale, ends: (f64, f64), wanted: usize) -> Ticks {
    match scale {
        AxisScale::Linear => linear(ends, wanted),
        AxisScale::Log10 if ends.1 - ends.0 < 0.7 => within_a_decade(ends, wanted),
        AxisScale::Log10 => decades(ends, wanted),
        AxisScale::Symlog { threshold } => symmetric(scale, threshold, ends, wanted),
    }
}

fn linear((lower, upper): (f64, f64), wanted: usize) -> Ticks {
    let step = Step::near((upper - lower) / wanted.max(1) as f64);
    let power = common_power(lower.abs().max(upper.abs()));
    let ticks = step
        .multiples(lower, upper)
        .map(|k| Tick { place: step.at(k), text: step.text(k, power) })
        .collect();
    Ticks { ticks, power }
}

/// The step between ticks, `mantissa · 10^exponent`.
#[derive(Debug, Clone, Copy)]
struct Step {
    mantissa: i64,
    exponent: i32,
}

impl Step {
    /// The smallest of 1, 2, 5 times a power of ten that is at least `rough`, up to rounding.
    fn near(rough: f64) -> Self {
        let exponent = rough.log10().floor() as i32;
        let ratio = rough / 10_f64.powi(exponent);
        let (mantissa, carry) = match ratio {
            r if r < 1.2 => (1, 0),
            r if r < 2.4 => (2, 0),
            r if r < 6.0 => (5, 0),
            _ => (1, 1),
        };
        Self { mantissa, exponent: exponent + carry }
    }

    fn at(self, k: i64) -> f64 {
        // NOTE: dividing by an exact power of ten rounds once; multiplying by 10^-n rounds twice.
        let whole = (k * self.mantissa) as f64;
        match self.exponent {
            e @ -300..0 => whole / 10_f64.powi(-e),
            e => whole * 10_f64.powi(e),
        }
    }

    fn multiples(self, lower: f64, upper: f64) -> impl Iterator<Item = i64> {
        let size = self.at(1);
        let slack = 1e-9;
        let first = (lower / size - slack).ceil() as i64;
        let last = (upper / size + slack).floor() as i64;
        (first..=last).take(100)
    }

    /// `k` steps, divided by `10^power`, as a decimal written from the whole number.
    fn text(self, k: i64, power: i32) -> String {
        let whole = k * self.mantissa;
        let exponent = self.exponent - power;
        if whole == 0 {
            return "0".to_owned();
        }
        let sign = if whole < 0 { "−" } else { "" };
        let digits = whole.unsigned_abs().to_string();
        if exponent >= 0 {
            return format!("{sign}{digits}{}", "0".repeat(exponent as usize));
        }
        let decimals = exponent.unsigned_abs() as usize;
        let padded = format!("{digits:0>width$}", width = decimals + 1);
        let (before, after) = padded.split_at(padded.len() - decimals);
        format!("{sign}{before}.{after}")
    }
}

/// Power of ten to take out of the labels; 0 if the numbers are short without it.
fn common_power(largest: f64) -> i32 {
    let exponent = (largest * (1.0 + 1e-12)).log10().floor();
    if !(-2.0..4.0).contains(&exponent) && exponent.is_finite() { exponent as i32 } else { 0 }
}

fn within_a_decade((lower, upper): (f64, f64), wanted: usize) -> Ticks {
    let values = (10_f64.powf(lower), 10_f64.powf(upper));
    let mut found = linear(values, wanted);
    found.ticks.retain(|tick| tick.place > 0.0);
    for tick in &mut found.ticks {
        tick.place = tick.place.log10();
    }
    found
}

fn decades((lower, upper): (f64, f64), wanted: usize) -> Ticks {
    let slack = 1e-9;
    let (first, last) = ((lower - slack).ceil() as i32, (upper + slack).floor() as i32);
    let stride = (f64::from(last - first + 1) / wanted.max(1) as f64).ceil().max(1.0) as i32;
    let labelled = |k: i32| k.rem_euclid(stride) == 0;
    let mut ticks = Vec::new();
    for k in first - 1..=last {
        if k >= first && (stride <= 3 || labelled(k)) {
            let text = if labelled(k) { power_of_ten(k) } else { String::new() };
            ticks.push(Tick { place: f64::from(k), text });
        }
        if last - first < 4 {
            ticks.extend(between_decades(k, (lower, upper), last - first));
        }
    }
    Ticks { ticks, power: 0 }
}

/// Grid lines at 2 to 9 times a power of ten; 2 and 5 are labelled if there are few decades.
fn between_decades(k: i32, (lower, upper): (f64, f64), span: i32) -> impl Iterator<Item = Tick> {
    (2..10).filter_map(move |m| {
        let place = f64::from(k) + f64::from(m).log10();
        let named = span < 1 && (m == 2 || m == 5);
        let text = if named { format!("{m}×{}", power_of_ten(k)) } else { String::new() };
        (place >= lower && place <= upper).then_some(Tick { place, text })
    })
}

fn symmetric(scale: AxisScale, threshold: f64, ends: (f64, f64), wanted: usize) -> Ticks {
    let largest = scale.value(ends.0).abs().max(scale.value(ends.1).abs());
    let (first, last) = (threshold.log10().ceil() as i32, largest.log10().floor() as i32);
    let count = f64::from((last - first + 1).max(1)) * 2.0;
    let stride = (count / wanted.max(1) as f64).ceil().max(1.0) as i32;
    let mut ticks = vec![Tick { place: 0.0, text: "0".to_owned() }];
    for k in (first..=last).filter(|k| (last - k).rem_euclid(stride) == 0) {
        let place = scale.place(10_f64.powi(k));
        ticks.push(Tick { place, text: power_of_ten(k) });
        ticks.push(Tick { place: -place, text: format!("−{}", power_of_ten(k)) });
    }
    ticks.retain(|tick| tick.place >= ends.0 && tick.place <= ends.1);
    ticks.sort_by(|a, b| a.place.total_cmp(&b.place));
    Ticks { ticks, power: 0 }
}

fn power_of_ten(exponent: i32) -> String {
    match exponent {
        0 => "1".to_owned(),
        1 => "10".to_owned(),
        k => format!("10^{{{}}}", k.to_string().replace('-', "−")),
    }
}

/// ` (10^{k})` for an axis label, or nothing.
pub(super) fn power_suffix(power: i32) -> String {
    match power {
        0 => String::new(),
        k => format!("  (10^{{{}}})", k.to_string().replace('-', "−")),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn places_and_values_are_inverse() {
        let symlog = AxisScale::Symlog { threshold: 1e-3 };
        for scale in [AxisScale::Linear, AxisScale::Log10, symlog] {
            for value in [1e-6, 0.02, 3.0, 4e5] {
                // Two elementary functions and their conditioning: a few hundred roundings at most.
                let back = scale.value(scale.place(value));
                assert!((back / value - 1.0).abs() < 1e-10, "{scale:?} {value} {back}");
            }
        }
        assert!(AxisScale::Log10.place(-1.0).is_nan());
        assert!((symlog.place(-2.0) + symlog.place(2.0)).abs() < 1e-15);
    }

    #[test]
    fn ranges_that_cannot_be_shown_are_refused() {
        for (lower, upper) in [(1.0, 1.0), (2.0, 1.0), (f64::NAN, 1.0), (-f64::MAX, f64::MAX)] {
            let axis = Axis::linear("x").with_range(lower, upper);
            assert!(axis.ends([].into_iter()).is_err(), "{lower} {upper}");
        }
        assert!(Axis::log10("x").with_range(0.0, 1.0).ends([].into_iter()).is_err());
        let mut symlog = Axis::linear("x");
        symlog.scale = AxisScale::Symlog { threshold: 0.0 };
        assert!(symlog.ends([1.0].into_iter()).is_err());
    }

    #[test]
    fn a_range_of_a_few_roundings_is_drawn_wider() {
        let next = 0.1_f64.next_up().next_up();
        let ends = Axis::linear("x").with_range(0.1, next).ends([].into_iter());
        let (lower, upper) = ends.expect("ascending");
        assert!(lower < 0.1 && upper > next && upper - lower > 1e-3, "{lower} {upper}");
    }

    #[test]
    fn data_without_extent_still_give_an_axis() {
        for data in
            [vec![], vec![f64::NAN], vec![0.0], vec![5.0, 5.0], vec![f64::MAX], vec![5e-324]]
        {
            let (lower, upper) = Axis::linear("x").ends(data.into_iter()).expect("no range given");
            assert!(lower < upper && (upper - lower).is_finite());
        }
    }

    fn texts(scale: AxisScale, ends: (f64, f64), wanted: usize) -> Vec<String> {
        let found = ticks(scale, ends, wanted);
        found.ticks.into_iter().map(|tick| tick.text).filter(|text| !text.is_empty()).collect()
    }

    #[test]
    fn linear_ticks_show_no_rounding() {
        let found = texts(AxisScale::Linear, (0.0, 0.6), 6);
        assert_eq!(found, ["0", "0.1", "0.2", "0.3", "0.4", "0.5", "0.6"]);
        let found = texts(AxisScale::Linear, (-1.5, 1.5), 6);
        assert_eq!(found, ["−1.5", "−1.0", "−0.5", "0", "0.5", "1.0", "1.5"]);
    }

    #[test]
    fn offsets_take_their_power_of_ten_out() {
        let found = ticks(AxisScale::Linear, (-1e-3, 5e-3), 6);
        assert_eq!(found.power, -3);
        assert_eq!(found.ticks[0].text, "−1");
        assert_eq!(found.ticks.last().map(|tick| tick.text.as_str()), Some("5"));
        assert_eq!(ticks(AxisScale::Linear, (0.0, 250_000.0), 5).power, 5);
    }

    #[test]
    fn many_decades_are_not_all_named() {
        let found = texts(AxisScale::Log10, (-16.0, 0.0), 6);
        assert_eq!(found, ["10^{−15}", "10^{−12}", "10^{−9}", "10^{−6}", "10^{−3}", "1"]);
        let found = texts(AxisScale::Log10, (0.1, 0.4), 4);
        assert_eq!(found, ["1.5", "2.0", "2.5"]);
    }

    #[test]
    fn a_symmetric_axis_has_a_zero_and_both_signs() {
        let scale = AxisScale::Symlog { threshold: 1e-3 };
        let ends = (scale.place(-1.0), scale.place(1.0));
        let found = texts(scale, ends, 9);
        assert_eq!(found.len(), 9);
        assert_eq!(found[0], "−1");
        assert_eq!(found[4], "0");
    }
}
