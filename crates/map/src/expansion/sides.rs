//! Series of a trajectory on both sides of a graze.
//!
//! A trajectory that just touches a surface has no derivative there, but a series on each side.
//! With the depth `d(ξ) = −h_min` of the free flow, in the start and the parameters `ξ`, the state
//! at the end is
//!
//! ```text
//! X(ξ)                      where d ≤ 0: no contact
//! R(ξ) + √d(ξ) S(ξ)         where d > 0: contact
//! ```
//!
//! The jets of the start fly to the graze, pass the discontinuity mapping of the full state, and
//! fly on as jets in `(y; ξ)` with `y² = d`. See docs/mathematics/hits.md.

use std::sync::Arc;

use super::discontinuity::discontinuity;
use super::error::ExpansionError;
use super::passage::Passage;
use super::routes::{Graze, SectionChart};
use super::variables::{DEVIATION_WEIGHT, Variables, fold_depth_powers, lift};
use crate::jet::{Jet, JetError, JetSpace, substitute, substitute_all};
use crate::model::Scene;
use crate::numeric::Dd;
use crate::orbit::{
    DerivativesError, JetsAlong, PoincareSection, PoincareSectionKind, Trajectory, Turn,
};

/// Series of the state at the end of a trajectory that grazes, on both sides of the graze.
///
/// Variables are those of [`JetsAlong`]: the components of the full state at the start, then the
/// parameters.
#[derive(Clone, Debug)]
pub struct SidesOfGraze {
    /// Surface that is grazed (index).
    pub surface: usize,
    /// Time of the graze since the start.
    pub time: f64,
    /// Gap at its minimum, nearly 0.
    pub gap: f64,
    /// Depth `d = −h_min` of the free flow beyond the surface; its value is that of `−gap`.
    pub depth: Jet<Dd>,
    /// State and events where the depth is negative.
    pub clear: JetsAlong,
    /// Part `R` of the full state where the depth is positive.
    pub regular: Vec<Jet<Dd>>,
    /// Factor `S` of the root of the depth, to one order less.
    pub root: Vec<Jet<Dd>>,
}

/// Reason why a trajectory has no series on the sides of a graze.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum SidesError {
    /// The trajectory has no derivatives but for the graze.
    #[error(transparent)]
    Derivatives(#[from] DerivativesError),
    /// The contact has no expansion.
    #[error(transparent)]
    Expansion(#[from] ExpansionError),
    /// The contact's force is a power of the penetration that makes no series in the root.
    #[error(
        "`{surface}` is grazed at t = {time}; its force is a power of the penetration, and the \
         state behind it is no series in the root of the depth"
    )]
    Powers {
        /// Name of the surface.
        surface: String,
        /// Time since the start.
        time: f64,
    },
}

impl From<JetError> for SidesError {
    fn from(error: JetError) -> Self {
        DerivativesError::from(error).into()
    }
}

/// Shares of the work: events, the flight of the jets without contact, and with it.
const SHARES: [f64; 3] = [0.05, 0.25, 0.7];

/// Expands the state at the end of a trajectory on both sides of its graze, to an order in the
/// start and the parameters `free`; `None` if it does not graze. `watch` is told the share that is
/// done.
///
/// Arguments are those of [`jets_along`](crate::orbit::jets_along). A gap of up to 1e-12 of its
/// range counts as a graze; coefficients err by as much.
///
/// # Errors
///
/// [`SidesError`] if the trajectory grazes twice or has no derivatives apart from the graze, and if
/// the contact has no series in the root of the depth.
pub fn sides_of_graze(
    scene: &Scene,
    (start, free): (&[Dd], &[usize]),
    span: (Option<Dd>, usize),
    order: u32,
    watch: &dyn Fn(f64),
) -> Result<Option<SidesOfGraze>, SidesError> {
    let found = |share| watch(SHARES[0] * share);
    let space = JetSpace::uniform(start.len() + free.len(), order as usize)?;
    let through = Trajectory::through_graze(scene, (start, free), span, &space, &found)?;
    let Some(trajectory) = through else { return Ok(None) };
    let Some(graze) = trajectory.graze() else { return Ok(None) };
    let to_end = |share| watch(SHARES[0] + SHARES[1] * share);
    let clear = trajectory.jets_along(&to_end)?;
    let start = trajectory.start_jets();
    let near = trajectory.fly(&start, 0, [Dd::ZERO, graze.time], &|_| {})?.state;
    let weight = DEVIATION_WEIGHT * order;
    let passage = passage(scene, &trajectory, &near, free, graze)?;
    let contact = discontinuity::<Dd>(&passage, weight)?;
    if !contact.powers.terms.is_empty() {
        let surface = scene.model.surfaces[graze.surface].name.clone();
        return Err(SidesError::Powers { surface, time: graze.time.to_f64() });
    }
    let own = near.iter().map(|jet| jet.add_constant(-jet.head()));
    let parameters = (0..free.len()).map(|at| Jet::variable(&space, start.len() + at, Dd::ZERO));
    let deviations: Vec<_> = own.chain(parameters).collect();
    let mut depth = substitute(&contact.depth, &deviations);
    depth.coefficients_mut()[0] = -graze.gap;
    let linear = substitute_all(&contact.linear, &deviations);
    let quadratic = substitute_all(&contact.quadratic, &deviations);
    let weights: Vec<u32> =
        std::iter::once(1).chain(vec![DEVIATION_WEIGHT; deviations.len()]).collect();
    let with_depth = JetSpace::new(&weights, weight as usize)?;
    let y = Jet::variable(&with_depth, 0, Dd::ZERO);
    let behind = near.iter().zip(&linear).zip(&quadratic).map(|((near, linear), quadratic)| {
        let even = near + &(&depth * quadratic);
        &lift(&even, &with_depth) + &(&y * &lift(linear, &with_depth))
    });
    let behind: Vec<_> = behind.collect();
    let on = |share| watch(SHARES[0] + SHARES[1] + SHARES[2] * share);
    let end = trajectory.fly(&behind, 1, [graze.time, trajectory.duration()], &on)?.state;
    let part = |first: u8, space: &Arc<JetSpace>| -> Vec<Jet<Dd>> {
        let fold = |jet| fold_depth_powers(jet, first, weight, &depth, space);
        end.iter().map(fold).collect()
    };
    let lower = JetSpace::uniform(deviations.len(), order as usize - 1)?;
    let (regular, root) = (part(0, &space), part(1, &lower));
    let (surface, time, gap) = (graze.surface, graze.time.to_f64(), graze.gap.to_f64());
    Ok(Some(SidesOfGraze { surface, time, gap, depth, clear, regular, root }))
}

/// Passage of a trajectory at its graze, in the full state at the time of the graze.
fn passage(
    scene: &Scene,
    trajectory: &Trajectory,
    near: &[Jet<Dd>],
    free: &[usize],
    graze: Turn,
) -> Result<Graze, ExpansionError> {
    let model = &scene.model;
    let point: Vec<Dd> = near.iter().map(Jet::head).collect();
    let names = model.full_state_names().into_iter();
    let parameters = free.iter().map(|&at| model.parameters[at].name.as_str());
    let names: Vec<String> = names.chain(parameters).map(str::to_owned).collect();
    let section = PoincareSection {
        // The contact takes no net time, as that of a section of a fixed phase.
        kind: PoincareSectionKind::Stroboscopic { phase: Dd::ZERO },
        coordinates: (0..point.len()).collect(),
        eliminated: point.len(),
    };
    let law = Passage::new(model, graze.surface, &point, trajectory.parameters(), free)?;
    Ok(Graze {
        passage: law,
        variables: Variables {
            weights: vec![DEVIATION_WEIGHT; names.len()],
            coordinates: point.len(),
            names,
        },
        chart: SectionChart { section, point },
    })
}
