//! Placement of words beside points, where they cover least.
//!
//! A covered marker weighs more than the choice among the eight positions, so that words leave
//! markers free wherever they can.

use super::FigureError;
use super::drawing::{Anchor, Area, Direction, Point, Shape};
use super::series::Rgb;
use super::text::width;

/// Half of a marker's size, in pixels: words nearer to its centre cover it.
const MARKER: f64 = 4.0;

/// Weight of a covered marker; the last of the positions has 3.5.
const COVERED: f64 = 4.0;

/// Weight of covered words.
const OVERLAPPING: f64 = 1e4;

/// Distance of words from their point.
const GAP: f64 = 7.0;

/// Number of distances that are tried, each a line farther than the one before.
const RINGS: i32 = 5;

/// Positions around a point, in units of the distance; the first is the best.
const POSITIONS: [(f64, f64); 8] = [
    (1.0, -1.0),
    (-1.0, -1.0),
    (1.0, 1.0),
    (-1.0, 1.0),
    (0.0, -1.4),
    (0.0, 1.4),
    (1.4, 0.0),
    (-1.4, 0.0),
];

/// Finds room for words and remembers the areas already taken.
#[derive(Debug)]
pub(super) struct Labeller {
    area: Area,
    /// Points of the series, which words should not cover.
    obstacles: Vec<Point>,
    taken: Vec<Area>,
}

impl Labeller {
    pub(super) fn new(area: Area, obstacles: Vec<Point>) -> Self {
        Self { area, obstacles, taken: Vec::new() }
    }

    /// Places words near a point: in the best of eight positions around it, or farther away if all
    /// of them cover other words.
    pub(super) fn beside(
        &mut self,
        at: Point,
        text: &str,
        size: f64,
        color: Rgb,
    ) -> Result<Shape, FigureError> {
        let (wide, tall) = (width(text, size)?, size);
        let mut best: Option<(f64, Area)> = None;
        // Larger distances are tried only if there is no room beside the point.
        for ring in 0..RINGS {
            if best.as_ref().is_some_and(|(least, _)| *least < OVERLAPPING) {
                break;
            }
            let gap = GAP + f64::from(ring) * tall;
            for (rank, (dx, dy)) in POSITIONS.into_iter().enumerate() {
                let x = at.0 + dx * gap + (dx.clamp(-1.0, 1.0) - 1.0) / 2.0 * wide;
                let y = at.1 + dy * gap + (dy.clamp(-1.0, 1.0) - 1.0) / 2.0 * tall;
                let room = Area { left: x, top: y, right: x + wide, bottom: y + tall };
                let cost = self.cost(&room) + rank as f64 * 0.5;
                if best.as_ref().is_none_or(|(least, _)| cost < *least) {
                    best = Some((cost, room));
                }
            }
        }
        let (_, room) = best.expect("eight positions were tried");
        self.taken.push(room);
        Ok(Shape::Text {
            at: (room.left, room.top + 0.82 * tall),
            anchor: Anchor::Start,
            direction: Direction::Across,
            size,
            color,
            text: text.to_owned(),
            halo: true,
        })
    }

    fn cost(&self, room: &Area) -> f64 {
        let corners = [(room.left, room.top), (room.right, room.bottom)];
        let outside = corners.iter().filter(|&&corner| !self.area.holds(corner)).count();
        let overlapping = self.taken.iter().filter(|other| overlap(room, other)).count();
        let reach = Area {
            left: room.left - MARKER,
            top: room.top - MARKER,
            right: room.right + MARKER,
            bottom: room.bottom + MARKER,
        };
        let covered = self.obstacles.iter().filter(|&&point| reach.holds(point)).count();
        1e6 * outside as f64 + OVERLAPPING * overlapping as f64 + COVERED * covered as f64
    }
}

fn overlap(a: &Area, b: &Area) -> bool {
    a.left < b.right && b.left < a.right && a.top < b.bottom && b.top < a.bottom
}

#[cfg(test)]
mod tests {
    use super::super::series::INK;
    use super::*;

    #[test]
    fn a_label_leaves_markers_free_where_it_can() {
        let area = Area { left: 0.0, top: 0.0, right: 300.0, bottom: 200.0 };
        let at = (150.0, 100.0);
        // All but the position below and to the left have a marker in them or at their edge.
        let crowd = vec![(165.0, 78.0), (135.0, 78.0), (165.0, 110.0), (150.0, 82.0)];
        let mut labeller = Labeller::new(area, crowd);
        let placed = labeller.beside(at, "(4, 5)", 12.0, INK);
        placed.expect("the font is built in");
        let room = &labeller.taken[0];
        assert!(room.right < at.0 && room.top > at.1, "{room:?}");
    }

    #[test]
    fn many_labels_at_one_point_do_not_overlap() {
        let area = Area { left: 0.0, top: 0.0, right: 300.0, bottom: 200.0 };
        let mut labeller = Labeller::new(area, Vec::new());
        for _ in 0..14 {
            let placed = labeller.beside((150.0, 100.0), "PD BP GR", 12.0, INK);
            placed.expect("the font is built in");
        }
        let rooms = &labeller.taken;
        let pairs =
            rooms.iter().enumerate().flat_map(|(n, a)| rooms[..n].iter().map(move |b| (a, b)));
        assert!(pairs.into_iter().all(|(a, b)| !overlap(a, b)), "{rooms:?}");
    }

    #[test]
    fn labels_stay_inside_and_do_not_overlap() {
        let area = Area { left: 0.0, top: 0.0, right: 300.0, bottom: 200.0 };
        let mut labeller = Labeller::new(area, Vec::new());
        let corner = (299.0, 1.0);
        for at in [corner, (150.0, 100.0), (150.0, 100.0)] {
            let placed = labeller.beside(at, "PD", 12.0, INK);
            placed.expect("the font is built in");
        }
        let rooms = &labeller.taken;
        assert!(!overlap(&rooms[1], &rooms[2]));
        assert!(area.holds((rooms[0].left, rooms[0].top)));
        assert!(area.holds((rooms[0].right, rooms[0].bottom)));
    }
}
