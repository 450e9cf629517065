//! The description of a grazing orbit from a root of its equations.

use nalgebra::DMatrix;

use crate::model::Scene;
use crate::numeric::{Dd, Real};

use super::OrbitError;
use super::conditions::{conditions, legs, round};
use super::kick::Kick;
use super::minima::{Minimum, gaps, watching_field};
use super::monodromy::{full_monodromy, multipliers, on_section, section_point};
use super::newton::Root;
use super::outcome::NotLocated;
use super::passages::{SAME, Touch, passages};
use super::point::{GrazingOrbit, GrazingPoint};
use super::section::PoincareSection;
use super::system::ExtendedSystem;

/// How many `xi_n` are computed from every passage to every other.
const XI_COUNT: usize = 6;

/// Largest `|h|` of a passage that no equation holds, relative to the range of `h`.
const TOUCHING: f64 = 1e-20;

/// The orbit at a root, without its distance from a guess.
pub(super) fn describe(
    scene: &Scene,
    system: &ExtendedSystem,
    root: &Root,
) -> Result<Result<GrazingOrbit, NotLocated>, OrbitError> {
    let found = match passages(scene, system, &root.unknowns, TOUCHING)? {
        Ok(found) => found,
        Err(reason) => return Ok(Err(reason)),
    };
    let parameters = system.parameters(&root.unknowns);
    let period = system.period(&root.unknowns);
    let touches = &found.touches;
    let passages = points(scene, system, touches, &parameters)?;
    let legs = legs(&system.field, touches, &parameters, period)?;
    let kicks = kicks(scene, system, &passages)?;
    let conditions = conditions(system, &kicks, touches, &legs, &parameters, XI_COUNT)?;
    let graze = &passages[0];
    let geometry = system.geometry(0);
    let section = graze.section.clone();
    let point = section_point(&scene.model, &system.field, geometry, &section, graze)?;
    let monodromy = if point == graze.state {
        on_section(&round(&legs), &section, &geometry.at(&point, &parameters))
    } else {
        let there = full_monodromy(&system.field, &point, &parameters, period)?;
        on_section(&there, &section, &geometry.at(&point, &parameters))
    };
    Ok(Ok(GrazingOrbit {
        scene: scene.identifier.clone(),
        digest: scene.digest,
        period,
        residual: root.residual.max(found.residual),
        multipliers: multipliers(&monodromy)?,
        monodromy: rows(&monodromy),
        xi: conditions[0].values.clone(),
        conditions,
        section,
        section_point: point,
        clearance: clearance(scene, &passages, period)?,
        guess_distance: None,
        passages,
    }))
}

fn rows(matrix: &DMatrix<Dd>) -> Vec<Vec<Dd>> {
    let rows = matrix.row_iter();
    rows.map(|row| row.iter().copied().collect()).collect()
}

/// The kick of every passage.
pub(super) fn kicks(
    scene: &Scene,
    system: &ExtendedSystem,
    passages: &[GrazingPoint],
) -> Result<Vec<Kick>, OrbitError> {
    let kick = |(passage, point): (usize, &GrazingPoint)| {
        let (state, parameters) = (&point.state, &point.parameters);
        let local = system.geometry(passage).at(state, parameters);
        Kick::of(&scene.model, point.surface, &local, state, parameters)
    };
    passages.iter().enumerate().map(kick).collect()
}

/// Grazing points from touches.
pub(super) fn points<S: Real>(
    scene: &Scene,
    system: &ExtendedSystem,
    touches: &[Touch<S>],
    parameters: &[Dd],
) -> Result<Vec<GrazingPoint>, OrbitError> {
    let point = |(passage, touch): (usize, &Touch<S>)| {
        let state: Vec<Dd> = touch.state.iter().map(|value| value.to_dd()).collect();
        let local = system.geometry(passage).at(&state, parameters);
        Ok(GrazingPoint {
            surface: touch.surface,
            normal_acceleration: local.acceleration(),
            time: touch.time.to_dd(),
            section: PoincareSection::of(scene, touch.surface, &state, parameters)?,
            state,
            parameters: parameters.to_vec(),
        })
    };
    touches.iter().enumerate().map(point).collect()
}

/// Lowest minimum of any event function along an orbit, its grazes excepted; a touch to rounding
/// counts as 0.
pub(super) fn clearance(
    scene: &Scene,
    passages: &[GrazingPoint],
    period: Dd,
) -> Result<Option<f64>, OrbitError> {
    let Some(graze) = passages.first() else {
        return Ok(None);
    };
    let rounded = |values: &[Dd]| {
        values
            .iter()
            .map(|value| value.to_f64())
            .collect::<Vec<_>>()
    };
    let (state, parameters) = (rounded(&graze.state), rounded(&graze.parameters));
    let period = period.to_f64();
    let gaps = gaps(&watching_field(&scene.model), &state, &parameters, period)?;
    let is_graze = |minimum: &Minimum| {
        let mine = passages.iter().filter(|at| at.surface == minimum.surface);
        let apart = |at: &GrazingPoint| (at.time.to_f64() - minimum.time).rem_euclid(period);
        mine.map(apart)
            .any(|apart| apart.min(period - apart) < SAME * period)
    };
    let others = gaps.minima.iter().filter(|minimum| !is_graze(minimum));
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
