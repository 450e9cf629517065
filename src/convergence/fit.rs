//! The slope of an error in logarithms, on the range where truncation is what it measures.

/// A straight line through the logarithms of a size and of an error.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SlopeFit {
    /// Exponent of the error.
    pub slope: f64,
    /// Standard error of the slope.
    pub uncertainty: f64,
    /// Smallest and largest size used.
    pub range: [f64; 2],
}

/// Fewest points a slope is measured on.
const FEWEST: usize = 4;

/// Most points a slope is measured on: larger sizes are further from the asymptotic law.
const MOST: usize = 8;

/// Fits `error ≈ c size^slope` by least squares in logarithms.
///
/// `points`: size, error, and the floor that rounding sets to the error, by descending size. Used
/// are the smallest sizes at which, from the largest size down, the error still exceeds the floor:
/// at most eight. `None` if these are fewer than four.
pub fn fit_slope(points: &[(f64, f64, f64)]) -> Option<SlopeFit> {
    let clear = |&&(_, error, floor): &&(f64, f64, f64)| error.is_finite() && error > floor;
    let usable: Vec<_> = points
        .iter()
        .skip_while(|point| !clear(point))
        .take_while(clear)
        .collect();
    let used = &usable[usable.len().saturating_sub(MOST)..];
    if used.len() < FEWEST {
        return None;
    }
    let logs: Vec<_> = used
        .iter()
        .map(|(size, error, _)| (size.ln(), error.ln()))
        .collect();
    let (slope, uncertainty) = least_squares(&logs);
    Some(SlopeFit {
        slope,
        uncertainty,
        range: [used[used.len() - 1].0, used[0].0],
    })
}

/// Slope of a line and its standard error.
fn least_squares(points: &[(f64, f64)]) -> (f64, f64) {
    let count = points.len() as f64;
    let mean_x = points.iter().map(|point| point.0).sum::<f64>() / count;
    let mean_y = points.iter().map(|point| point.1).sum::<f64>() / count;
    let spread: f64 = points.iter().map(|point| (point.0 - mean_x).powi(2)).sum();
    let slope = points
        .iter()
        .map(|point| (point.0 - mean_x) * (point.1 - mean_y))
        .sum::<f64>()
        / spread;
    let residual = |point: &(f64, f64)| point.1 - mean_y - slope * (point.0 - mean_x);
    let variance = points
        .iter()
        .map(|point| residual(point).powi(2))
        .sum::<f64>()
        / (count - 2.0);
    (slope, (variance / spread).sqrt())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_power_law_over_a_floor_keeps_its_exponent() {
        let size = |k: i32| 2.0f64.powf(-0.5 * f64::from(k));
        let points: Vec<_> = (0..60)
            .map(|k| (size(k), 3.0 * size(k).powi(5) + 1e-18, 1e-15))
            .collect();
        let fit = fit_slope(&points).expect("many points");
        // The floor adds at most a share of 1e-3 at the smallest of eight sizes.
        assert!(
            (fit.slope - 5.0).abs() < 1e-3 && fit.uncertainty < 1e-3,
            "{fit:?}"
        );
        assert!(fit.range[0] < fit.range[1]);
    }

    #[test]
    fn too_short_a_range_has_no_slope() {
        let points: Vec<_> = (0..20)
            .map(|k| (2.0f64.powi(-k), 2.0f64.powi(-9 * k), 1e-7))
            .collect();
        assert_eq!(fit_slope(&points), None);
    }
}
