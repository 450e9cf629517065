//! Points that cover a cube evenly.

/// Point of the additive sequence of the generalised golden ratio: `frac(1/2 + n/φ^k)`, `φ^(d+1) =
/// φ + 1`.
///
/// Any consecutive points of it cover the unit cube evenly. Source: Roberts 2018, *The unreasonable
/// effectiveness of quasirandom sequences*.
///
/// ```
/// use grazemap_jet::numeric::low_discrepancy;
/// let points: Vec<_> = (0..100).map(|index| low_discrepancy(index, 2)).collect();
/// let quarter = points.iter().filter(|point| point[0] < 0.5 && point[1] < 0.5).count();
/// assert!((24..=26).contains(&quarter));
/// ```
pub fn low_discrepancy(index: usize, dimension: usize) -> Vec<f64> {
    let mut ratio: f64 = 1.5;
    for _ in 0..60 {
        let nearer = (1.0 + ratio).powf(1.0 / (dimension as f64 + 1.0));
        if nearer == ratio {
            break;
        }
        ratio = nearer;
    }
    (1..=dimension).map(|k| (0.5 + (index + 1) as f64 * ratio.powi(-(k as i32))).fract()).collect()
}
