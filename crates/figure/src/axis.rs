//! Axes: what they are called, how they are scaled, and where a value lands on them.

use std::cmp::Ordering;

use super::FigureError;

/// How values are spread along an axis.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum AxisScale {
    /// Equal differences, equal distances.
    Linear,
    /// Equal ratios, equal distances; positive values only.
    Log10,
    /// Linear within about `±threshold`, logarithmic beyond, through zero: `sign(x) log10(1 +
    /// |x|/threshold)`.
    Symlog {
        /// Where linear turns into logarithmic; positive.
        threshold: f64,
    },
}

impl AxisScale {
    /// Distance along the axis, up to scale and shift; NaN where the axis has no place for it.
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
    /// What is measured along it; a power of ten common to the ticks is added to it.
    pub label: String,
    /// How values are spread.
    pub scale: AxisScale,
    /// Ends of the axis; `None` takes them from the data.
    pub range: Option<(f64, f64)>,
}

/// A second scale of a linear axis, on the other side of the picture: its values plus a constant.
#[derive(Debug, Clone, PartialEq)]
pub struct ShiftedScale {
    /// What is measured along it.
    pub label: String,
    /// What is added to the values of the axis.
    pub shift: f64,
}

impl ShiftedScale {
    /// The ends of the scale, where doubles can tell ticks apart between them.
    pub(super) fn ends(&self, axis: &Axis, ends: (f64, f64)) -> Option<(f64, f64)> {
        let shifted = (ends.0 + self.shift, ends.1 + self.shift);
        let shown = axis.scale == AxisScale::Linear && self.shift.is_finite();
        (shown && !too_narrow(shifted)).then_some(shifted)
    }
}

impl Axis {
    /// A linear axis that shows all data.
    pub fn linear(label: impl Into<String>) -> Self {
        Self { label: label.into(), scale: AxisScale::Linear, range: None }
    }

    /// A logarithmic axis that shows all positive data.
    pub fn log10(label: impl Into<String>) -> Self {
        Self { scale: AxisScale::Log10, ..Self::linear(label) }
    }

    /// The same axis with fixed ends; where doubles cannot tell ticks apart between them, it is
    /// drawn wider.
    #[must_use]
    pub fn with_range(mut self, lower: f64, upper: f64) -> Self {
        self.range = Some((lower, upper));
        self
    }

    /// Ends of the axis as places, with a margin where they come from the data.
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

/// Ends nearer than doubles can tell ticks apart between them.
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
}
