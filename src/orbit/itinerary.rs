//! The passages of one period as the section sees them.

use crate::model::Scene;
use crate::numeric::Dd;

use super::point::GrazingOrbit;
use super::section::PoincareSectionKind;

/// A passage nearer to the section than this share of the period lies on it.
const ON_SECTION: f64 = 1e-24;

/// The largest share of a period.
const BELOW_ONE: f64 = 1.0 - f64::EPSILON / 2.0;

/// A grazing passage as a section sees it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FollowingPassage {
    /// Its place in [`GrazingOrbit::passages`].
    pub place: usize,
    /// Its surface.
    pub surface: usize,
    /// Time from the section point to it, in `[0, period of the orbit)`.
    pub time: Dd,
    /// The same as a share of the period, in `[0, 1)`.
    pub share: f64,
}

impl GrazingOrbit {
    /// The passages of one period in the order in which they follow the section point.
    ///
    /// A section between passages is first followed by the next one, whichever the scene names
    /// first.
    pub fn passages_after_section(&self, scene: &Scene) -> Vec<FollowingPassage> {
        let until_first = self.time_to_first_passage(scene);
        let passages = self.passages.iter().enumerate();
        let mut following: Vec<_> = passages
            .map(|(place, passage)| {
                let time = reduced(until_first + passage.time, self.period);
                FollowingPassage {
                    place,
                    surface: passage.surface,
                    time,
                    share: (time / self.period).to_f64().min(BELOW_ONE),
                }
            })
            .collect();
        following.sort_by(|a, b| a.time.to_f64().total_cmp(&b.time.to_f64()));
        following
    }

    /// Time from the section point to the first passage that the scene names; 0 on a tangency
    /// section.
    fn time_to_first_passage(&self, scene: &Scene) -> Dd {
        let (PoincareSectionKind::Stroboscopic { phase }, Some(clock)) =
            (self.section.kind, &scene.model.phase)
        else {
            return Dd::ZERO;
        };
        let ahead = self.grazing_point().state[scene.model.dimension() - 1] - phase;
        let advance = clock.period * Dd::from(scene.grazing.periods as f64);
        self.period * reduced(ahead, clock.period) / advance
    }
}

/// A time in `[0, period)`; one that misses 0 or the period by rounding is 0.
fn reduced(time: Dd, period: Dd) -> Dd {
    let rest = time - (time / period).floor() * period;
    let near = period * Dd::from(ON_SECTION);
    if rest <= near || period - rest <= near {
        Dd::ZERO
    } else {
        rest
    }
}
