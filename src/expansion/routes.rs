//! Which legs one period with one passage is made of.

use super::leg::Route;
use super::section_chart::SectionChart;
use crate::model::Scene;
use crate::numeric::Dd;
use crate::orbit::{GrazingOrbit, PoincareSectionKind};

/// The legs of one period, as places on the grazing orbit.
#[derive(Clone, Debug)]
pub struct Routes {
    /// From the section to the graze, where the section lies elsewhere.
    pub before: Option<Route>,
    /// From the graze to the next section point.
    pub after: Route,
    /// From the section to the section, one period later.
    pub whole: Route,
}

impl Routes {
    /// The routes of a scene's section along its grazing orbit.
    pub fn of(scene: &Scene, orbit: &GrazingOrbit) -> Self {
        let section = SectionChart {
            section: orbit.section.clone(),
            point: orbit.section_point.clone(),
        };
        let graze = grazing_chart(orbit);
        let advance = phase_advance(scene);
        let whole = Route {
            from: section.clone(),
            to: section.clone(),
            duration: orbit.period,
            phase_advance: advance,
        };
        let to_graze = advance_to_graze(scene, orbit);
        if to_graze == Dd::ZERO {
            let (before, after) = (None, whole.clone());
            return Self {
                before,
                after,
                whole,
            };
        }
        let duration = orbit.period * to_graze / advance;
        // The charts' own phases already differ by the advance, up to a whole period.
        let phase = scene.model.dimension() - 1;
        let wrap = to_graze - (graze.point[phase] - section.point[phase]);
        let before = Route {
            from: section.clone(),
            to: graze.clone(),
            duration,
            phase_advance: wrap,
        };
        let after = Route {
            from: graze,
            to: section,
            duration: orbit.period - duration,
            phase_advance: advance - wrap,
        };
        Self {
            before: Some(before),
            after,
            whole,
        }
    }
}

/// The chart in which the contact happens: the scene's section, through the grazing point.
pub(super) fn grazing_chart(orbit: &GrazingOrbit) -> SectionChart {
    SectionChart {
        section: orbit.section.clone(),
        point: orbit.grazing_point().state.clone(),
    }
}

/// Advance of the phase over one period of the orbit; 0 for an autonomous system.
fn phase_advance(scene: &Scene) -> Dd {
    let periods = Dd::from(scene.grazing.periods as f64);
    let phase = scene.model.phase.as_ref();
    phase.map_or(Dd::ZERO, |phase| phase.period * periods)
}

/// Advance of the phase from the section to the graze, in `[0, period)`; 0 on a tangency section.
fn advance_to_graze(scene: &Scene, orbit: &GrazingOrbit) -> Dd {
    let (PoincareSectionKind::Stroboscopic { phase }, Some(clock)) =
        (orbit.section.kind, &scene.model.phase)
    else {
        return Dd::ZERO;
    };
    let difference = orbit.grazing_point().state[scene.model.dimension() - 1] - phase;
    if difference < Dd::ZERO {
        difference + clock.period
    } else {
        difference
    }
}
