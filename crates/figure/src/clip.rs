//! Lines cut at the edges of the plot area (Liang and Barsky, 1984).

use super::drawing::Point;

/// The plot area.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Area {
    pub(super) left: f64,
    pub(super) top: f64,
    pub(super) right: f64,
    pub(super) bottom: f64,
}

impl Area {
    pub(super) fn width(&self) -> f64 {
        self.right - self.left
    }

    pub(super) fn height(&self) -> f64 {
        self.bottom - self.top
    }

    /// Whether a point is inside, the edge included.
    pub(super) fn holds(&self, (x, y): Point) -> bool {
        x >= self.left - 1e-6
            && x <= self.right + 1e-6
            && y >= self.top - 1e-6
            && y <= self.bottom + 1e-6
    }

    /// The part of a segment inside, if any.
    fn cut(&self, a: Point, b: Point) -> Option<(Point, Point)> {
        let (dx, dy) = (b.0 - a.0, b.1 - a.1);
        let sides = [
            (-dx, a.0 - self.left),
            (dx, self.right - a.0),
            (-dy, a.1 - self.top),
            (dy, self.bottom - a.1),
        ];
        let (mut from, mut to) = (0.0_f64, 1.0_f64);
        for (p, q) in sides {
            if p == 0.0 {
                if q < 0.0 {
                    return None;
                }
            } else if p < 0.0 {
                from = from.max(q / p);
            } else {
                to = to.min(q / p);
            }
        }
        let at = |t: f64| (a.0 + t * dx, a.1 + t * dy);
        (from <= to).then(|| (at(from), at(to)))
    }

    /// The pieces of a line inside, interrupted at points that are not finite.
    ///
    /// Steps shorter than a fifth of a pixel are joined with the next.
    pub(super) fn pieces(&self, points: impl Iterator<Item = Point>) -> Vec<Vec<Point>> {
        let mut pieces: Vec<Vec<Point>> = Vec::new();
        let mut before: Option<Point> = None;
        for point in points {
            if !(point.0.is_finite() && point.1.is_finite()) {
                before = None;
                continue;
            }
            let Some(last) = before.replace(point) else {
                continue;
            };
            if let Some((from, to)) = self.cut(last, point) {
                match pieces.last_mut() {
                    Some(piece) if piece.last() == Some(&from) => piece.push(to),
                    _ => pieces.push(vec![from, to]),
                }
            }
        }
        pieces.into_iter().map(joined).collect()
    }
}

fn joined(piece: Vec<Point>) -> Vec<Point> {
    let last = piece.len() - 1;
    let mut kept: Vec<Point> = Vec::with_capacity(piece.len());
    for (index, point) in piece.into_iter().enumerate() {
        let far = kept.last().is_none_or(|k| (k.0 - point.0).hypot(k.1 - point.1) >= 0.2);
        if far || index == last {
            kept.push(point);
        }
    }
    kept
}

#[cfg(test)]
mod tests {
    use super::*;

    const AREA: Area = Area { left: 0.0, top: 0.0, right: 10.0, bottom: 10.0 };

    #[test]
    fn lines_end_at_the_edge_and_at_gaps() {
        let line = [(-5.0, 5.0), (5.0, 5.0), (5.0, 15.0), (f64::NAN, 0.0), (1.0, 1.0), (2.0, 2.0)];
        let pieces = AREA.pieces(line.into_iter());
        assert_eq!(
            pieces,
            [vec![(0.0, 5.0), (5.0, 5.0), (5.0, 10.0)], vec![(1.0, 1.0), (2.0, 2.0)]]
        );
    }

    #[test]
    fn lines_outside_are_not_drawn() {
        assert!(AREA.pieces([(-1.0, 5.0), (5.0, 50.0)].into_iter()).is_empty());
        assert!(AREA.pieces([(3.0, 3.0)].into_iter()).is_empty());
    }
}
