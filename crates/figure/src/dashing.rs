//! Interrupted lines for a painter that knows only whole ones.

use super::drawing::Point;

/// The drawn parts of a line, by lengths of strokes and gaps in turn.
pub(super) fn dashed(points: &[Point], pattern: &[f64]) -> Vec<Vec<Point>> {
    let mut drawn = Vec::new();
    let mut dash: Vec<Point> = points.first().copied().into_iter().collect();
    let (mut index, mut left) = (0, pattern[0]);
    for pair in points.windows(2) {
        let (mut a, b) = (pair[0], pair[1]);
        let mut length = (b.0 - a.0).hypot(b.1 - a.1);
        while length > left {
            let t = left / length;
            a = (a.0 + t * (b.0 - a.0), a.1 + t * (b.1 - a.1));
            length -= left;
            if index % 2 == 0 {
                dash.push(a);
                drawn.push(std::mem::take(&mut dash));
            } else {
                dash = vec![a];
            }
            index += 1;
            left = pattern[index % pattern.len()];
        }
        left -= length;
        if index % 2 == 0 {
            dash.push(b);
        }
    }
    if dash.len() > 1 {
        drawn.push(dash);
    }
    drawn
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn dashes_keep_their_lengths_around_corners() {
        let found = dashed(&[(0.0, 0.0), (3.0, 0.0), (3.0, 5.0)], &[2.0, 2.0]);
        assert_eq!(found, [vec![(0.0, 0.0), (2.0, 0.0)], vec![(3.0, 1.0), (3.0, 3.0)],]);
    }
}
