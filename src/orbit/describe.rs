//! The description of a grazing orbit from a root of its equations.

use crate::model::Scene;
use crate::numeric::Dd;

use super::OrbitError;
use super::minima::{gaps, watching_field};
use super::monodromy::{XI_COUNT, full_monodromy, multipliers, on_section, section_point, xi};
use super::newton::Root;
use super::point::{GrazingOrbit, GrazingPoint};
use super::section::{PoincareSection, reduced};
use super::system::ExtendedSystem;

/// The orbit at a root, without its distance from a guess.
pub(super) fn describe(
    scene: &Scene,
    surface: usize,
    system: &ExtendedSystem,
    root: &Root,
) -> Result<GrazingOrbit, OrbitError> {
    let mut state = root.unknowns[..system.dimension()].to_vec();
    if let (Some(phase), Some(value)) = (&scene.model.phase, state.last_mut()) {
        *value = reduced(*value, phase.period);
    }
    let parameters = system.parameters(&root.unknowns);
    let local = system.geometry.at(&state, &parameters);
    let section = PoincareSection::of(scene, surface, &state, &parameters)?;
    let graze = GrazingPoint {
        surface,
        state: state.clone(),
        parameters: parameters.clone(),
        normal_acceleration: local.acceleration(),
        time: Dd::ZERO,
        section: section.clone(),
    };
    let period = system.period(&root.unknowns);
    let at_graze = full_monodromy(&system.field, &state, &parameters, period)?;
    let point = section_point(
        &scene.model,
        &system.field,
        &system.geometry,
        &section,
        &graze,
    )?;
    let monodromy = if point == state {
        on_section(&at_graze, &section, &local)
    } else {
        let there = full_monodromy(&system.field, &point, &parameters, period)?;
        on_section(&there, &section, &system.geometry.at(&point, &parameters))
    };
    Ok(GrazingOrbit {
        scene: scene.identifier.clone(),
        digest: scene.digest,
        period,
        residual: root.residual,
        multipliers: multipliers(&monodromy),
        monodromy,
        xi: xi(&at_graze, &local, XI_COUNT),
        section,
        section_point: point,
        clearance: clearance(scene, &graze, period)?,
        guess_distance: None,
        passages: vec![graze],
    })
}

/// Lowest minimum of any event function along an orbit, its graze excepted; a touch to rounding counts as 0.
pub(super) fn clearance(
    scene: &Scene,
    graze: &GrazingPoint,
    period: Dd,
) -> Result<Option<f64>, OrbitError> {
    let rounded = |values: &[Dd]| {
        values
            .iter()
            .map(|value| value.to_f64())
            .collect::<Vec<_>>()
    };
    let (state, parameters) = (rounded(&graze.state), rounded(&graze.parameters));
    let period = period.to_f64();
    let gaps = gaps(&watching_field(&scene.model), &state, &parameters, period)?;
    let near = |time: f64| time.min(period - time) < 1e-6 * period;
    let others = gaps
        .minima
        .iter()
        .filter(|minimum| minimum.surface != graze.surface || !near(minimum.time));
    let touching = |event: f64, surface: usize| event.abs() <= 1e-10 * gaps.largest[surface].abs();
    let values = others.map(|m| {
        if touching(m.event, m.surface) {
            0.0
        } else {
            m.event
        }
    });
    Ok(values.min_by(f64::total_cmp))
}
