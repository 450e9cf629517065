//! Atlas about a grazing orbit: the fields of `atlas --json`, and its table.

use serde::Serialize;

use super::table::significant;
use super::{Named, Table, counted};
use crate::analysis::AtlasStudy;

/// Digits of ends of ranges, and of the phase.
const DIGITS: usize = 6;
/// Points beyond the tolerance that the text lists; the document lists all.
const LISTED: usize = 10;

/// Answer of `atlas`.
#[derive(Clone, Debug, Serialize)]
pub struct AtlasListing {
    /// Phase of the section.
    pub phase: f64,
    /// Forcing periods of one return.
    pub periods: usize,
    /// Ranges by name: states, then parameters that are coordinates of the atlas.
    pub region: Named<[f64; 2]>,
    /// Largest error asked for, in widths of the region.
    pub tolerance: f64,
    /// Order of the polynomials.
    pub order: usize,
    /// Most halvings of a box.
    pub depth: u32,
    /// Boxes expanded.
    pub expanded: usize,
    /// Whether the bound on expanded boxes was reached.
    pub limit_reached: bool,
    /// Leaves by kind.
    pub leaves: Vec<LeafRecord>,
    /// Memory of the atlas.
    pub bytes: usize,
    /// Points compared with direct simulation.
    pub points: PointCounts,
    /// Largest error of an image from polynomials, in widths of the region.
    pub largest_error: f64,
    /// Points whose image errs by more than the tolerance.
    pub violations: Vec<Named<f64>>,
    /// Times in nanoseconds; `null` where nothing was timed.
    pub times: Option<StepTimes>,
    /// Compliant stops, whose grazes have no leaves.
    pub compliant: Vec<String>,
}

/// Leaves of one kind.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct LeafRecord {
    /// `smooth`, `grazed`, `direct`, or `not made` for boxes to which no point came.
    pub kind: &'static str,
    /// Number of leaves.
    pub leaves: usize,
    /// Share of the region.
    pub share: f64,
}

/// Points by the source of their image.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
pub struct PointCounts {
    /// Images from polynomials.
    pub tabulated: usize,
    /// Images from direct simulation.
    pub direct: usize,
    /// Points without an image.
    pub without_image: usize,
}

/// Times of one step, in nanoseconds.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct StepTimes {
    /// Step by the leaves.
    pub step: f64,
    /// Step with the parameters fixed; `null` without parameters in the region.
    pub frozen_step: Option<f64>,
    /// Direct return from the same points.
    pub direct: f64,
}

impl AtlasListing {
    /// Listing of a study.
    pub fn new(study: &AtlasStudy) -> Self {
        let AtlasStudy { region, options, counts, shares, measurement, .. } = study;
        let made = shares.smooth + shares.grazed + shares.direct;
        let record = |kind, leaves, share| LeafRecord { kind, leaves, share };
        let names = region.ranges.iter().map(|(name, _)| name);
        let named =
            |point: &Vec<f64>| Named::new(names.clone().cloned().zip(point.iter().copied()));
        let nanoseconds = |seconds: f64| 1e9 * seconds;
        let times = study.step.zip(study.direct).map(|(step, direct)| StepTimes {
            step: nanoseconds(step),
            frozen_step: study.frozen_step.map(nanoseconds),
            direct: nanoseconds(direct),
        });
        Self {
            phase: region.phase,
            periods: region.periods,
            region: Named(region.ranges.clone()),
            tolerance: options.tolerance,
            order: options.order,
            depth: options.depth,
            expanded: study.expanded,
            limit_reached: study.is_exhausted,
            leaves: vec![
                record("smooth", counts.smooth, shares.smooth),
                record("grazed", counts.grazed, shares.grazed),
                record("direct", counts.direct, shares.direct),
                record("not made", counts.open, (1.0 - made).max(0.0)),
            ],
            bytes: study.bytes,
            points: PointCounts {
                tabulated: measurement.tabulated,
                direct: measurement.direct,
                without_image: measurement.without_image,
            },
            largest_error: measurement.largest_error,
            violations: measurement.violations.iter().map(named).collect(),
            times,
            compliant: study.compliant.clone(),
        }
    }

    /// Listing without measured times.
    pub fn without_times(&self) -> Self {
        Self { times: None, ..self.clone() }
    }

    /// Table of the leaves.
    pub fn table(&self) -> Table {
        Table::of(&self.leaves)
            .text("kind", |record| record.kind)
            .count("leaves", |record| record.leaves)
            .number("share of the region", 4, |record| record.share)
            .made()
    }

    /// Answer as text.
    pub fn text(&self, scene: &str) -> String {
        let range = |(name, [low, high]): &(String, [f64; 2])| {
            format!("{name} {} to {}", significant(*low, DIGITS), significant(*high, DIGITS))
        };
        let region: Vec<String> = self.region.0.iter().map(range).collect();
        let PointCounts { tabulated, direct, without_image } = self.points;
        let mut text = format!(
            "atlas of `{scene}`: return to the phase {} after {}\nregion: {}\ntolerance {:e} in \
             widths of the region, order {}, at most {} halvings\n\n{}\n{} expanded, {} kB\n{}: \
             {tabulated} by polynomials, {direct} by direct simulation, {without_image} without \
             image\n{}\n",
            significant(self.phase, DIGITS),
            counted(self.periods, "period"),
            region.join(", "),
            self.tolerance,
            self.order,
            self.depth,
            self.table().to_text(),
            counted(self.expanded, "box"),
            self.bytes.div_ceil(1000),
            counted(tabulated + direct + without_image, "point"),
            self.error_words(),
        );
        if let Some(StepTimes { step, frozen_step, direct }) = self.times {
            text.push_str(&format!(
                "a step takes {step:.0} ns, a direct return {direct:.0} ns: {} times\n",
                significant(direct / step, 2)
            ));
            if let Some(frozen) = frozen_step {
                text.push_str(&format!(
                    "with the parameters fixed a step takes {frozen:.0} ns: {} times\n",
                    significant(direct / frozen, 2)
                ));
            }
        }
        text
    }

    /// Largest error, and points beyond the tolerance.
    fn error_words(&self) -> String {
        if self.points.tabulated == 0 {
            return "no image from polynomials to compare".to_owned();
        }
        let beyond = self.violations.len();
        let mut words = format!(
            "largest error {:.1e}; {}",
            self.largest_error,
            match beyond {
                0 => "no point beyond the tolerance".to_owned(),
                _ => format!("{} beyond the tolerance:", counted(beyond, "point")),
            }
        );
        for point in self.violations.iter().take(LISTED) {
            let values = point.0.iter().map(|(name, value)| format!("{name} = {value}"));
            words.push_str(&format!("\n  {}", values.collect::<Vec<_>>().join(", ")));
        }
        if beyond > LISTED {
            words.push_str(&format!("\n  and {} more", beyond - LISTED));
        }
        words
    }

    /// Warnings: the bound on boxes was reached, grazes of compliant stops.
    pub fn remarks(&self) -> Vec<String> {
        let limit = self.limit_reached.then(|| {
            format!(
                "note: the atlas is not complete: the bound of {} was reached, and points of \
                 other boxes were simulated; more boxes can be asked for",
                counted(self.expanded, "expanded box")
            )
        });
        let compliant = (!self.compliant.is_empty()).then(|| {
            let names: Vec<String> =
                self.compliant.iter().map(|name| format!("`{name}`")).collect();
            format!(
                "note: compliant stops ({}): boxes that their graze cuts have no polynomials and \
                 are simulated",
                names.join(", ")
            )
        });
        [limit, compliant].into_iter().flatten().collect()
    }
}
