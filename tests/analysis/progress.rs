//! Progress of long commands: its bound is stated, and it moves inside their parts.

use std::sync::Mutex;

use grazemap::analysis::Progress;
use grazemap::pipeline::{AtlasKeys, SafeKeys};
use grazemap::prelude::*;

use crate::support::scenes::scene;

/// Units expected and done after every report.
#[derive(Default)]
struct Reports(Mutex<Vec<[u64; 2]>>);

impl Reports {
    fn add(&self, units: [u64; 2]) {
        let mut reports = self.0.lock().expect("whole");
        let last = reports.last().copied().unwrap_or_default();
        reports.push([last[0] + units[0], last[1] + units[1]]);
    }

    /// Units done at every report, in order; all that was expected is done at the end, and never
    /// more than was expected so far.
    fn done(self) -> Vec<u64> {
        let reports = self.0.into_inner().expect("whole");
        assert!(reports.iter().all(|[expected, done]| done <= expected), "{reports:?}");
        let [expected, done] = *reports.last().expect("a report");
        assert_eq!(done, expected);
        reports.iter().map(|[_, done]| *done).collect()
    }
}

impl Progress for Reports {
    fn expect(&self, total: u64) {
        self.add([total, 0]);
    }

    fn advance(&self, units: u64) {
        self.add([0, units]);
    }
}

#[test]
fn an_atlas_counts_its_boxes_inside_a_point_and_states_their_bound() {
    let scene = scene("linear");
    let graze = scene.graze().expect("a graze");
    for (boxes, plane) in [(15, false), (7, true)] {
        // One point needs all boxes, as the tolerance is never met.
        let keys = AtlasKeys { tolerance: 1e-300, boxes, points: 1, plane, ..AtlasKeys::default() };
        let reports = Reports::default();
        keys.answer(&graze, &reports).expect("an atlas");
        let done = reports.done();
        // In hundredths: each box, the point when it is measured and timed, each row of the plane.
        let units = u64::from(boxes) + 2 + if plane { 160 } else { 0 };
        assert_eq!(done.last(), Some(&(100 * units)));
        assert!((0..=u64::from(boxes)).all(|unit| done.contains(&(100 * unit))), "{done:?}");
        // Steps inside of boxes.
        assert!(done.iter().filter(|&&done| done % 100 != 0).count() > boxes as usize, "{done:?}");
    }
}

#[test]
fn safe_moves_inside_its_searches_and_inside_a_branch() {
    let scene = scene("linear");
    let reports = Reports::default();
    let keys = SafeKeys { points: 2, ..SafeKeys::default() };
    keys.answer(&scene, &reports).expect("an answer");
    let done = reports.done();
    let parts = done.last().expect("a report") / 1000;
    // The last parts are branches, and each of them is reported in many steps.
    let inside = |part: u64| done.iter().filter(|&&done| done / 1000 == part).count();
    let steps: Vec<usize> = (0..parts).map(inside).collect();
    assert!(*steps.last().expect("a part") > 20, "{steps:?}");
}
