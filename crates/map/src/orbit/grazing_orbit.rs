//! The grazing orbit, as plain data, and its passages in the order in which a section meets them.
//!
//! [`Grazes`] lists the passages of a period that graze and the condition that determines each (an
//! equation, the symmetry, or none), and holds the half-period symmetry
//! `(x, theta) -> (-x, theta + period/2)`.

use serde::{Deserialize, Serialize};

use super::free_flow::Minimum;
use super::outcome::{NamedValues, NotLocated, OrbitError};
use super::section::{Geometry, PoincareSection, PoincareSectionKind, reduced};
use crate::model::{Digest, Model, OrbitContact, Scene, Symmetry};
use crate::numeric::{Dd, Real, Scalar};

/// A point where an orbit of the free flow touches a surface: `h = 0`, `h' = 0`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct GrazingPoint {
    /// Surface (index into [`Model::surfaces`](crate::model::Model::surfaces)).
    pub surface: usize,
    /// Full state; the phase in `[0, period)`.
    pub state: Vec<Dd>,
    /// All parameters of the model.
    pub parameters: Vec<Dd>,
    /// `h''` along the free flow; positive.
    pub normal_acceleration: Dd,
    /// Time since the first grazing point of the period, in `[0, period of the orbit)`.
    pub time: Dd,
    /// The section moved along the orbit to this point; the contact acts in its coordinates.
    pub section: PoincareSection,
}

/// A hit of a grazing orbit: a contact with a normal velocity.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct OrbitHit {
    /// Surface (index into [`Model::surfaces`](crate::model::Model::surfaces)).
    pub surface: usize,
    /// Full state just before the hit; the phase in `[0, period)`.
    pub state: Vec<Dd>,
    /// Normal velocity `|h'|` at the hit; positive.
    pub speed: Dd,
    /// Time since the first grazing point of the period, in `[0, period of the orbit)`.
    pub time: Dd,
    /// Whether the orbit comes to rest against the surface, at once or by ever smaller rebounds.
    #[serde(default)]
    pub rests: bool,
}

/// A periodic orbit that grazes: of the free flow, and of the hits that the scene names.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct GrazingOrbit {
    /// Identifier of the scene.
    pub scene: String,
    /// Digest of the scene's text.
    pub digest: Digest,
    /// Grazing passages of one period, in order; the first starts the orbit.
    pub passages: Vec<GrazingPoint>,
    /// Hits of one period, in order of time.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub hits: Vec<OrbitHit>,
    /// Duration of one period of the orbit: `periods · period/rate`, in units of time.
    pub period: Dd,
    /// Largest residual of closure, `h` and `h'`, computed in double-double.
    pub residual: f64,
    /// The section and its coordinates.
    pub section: PoincareSection,
    /// Full state at the intersection of the orbit with the section.
    pub section_point: Vec<Dd>,
    /// Jacobian of `P_smooth` in the section's coordinates, by rows.
    pub monodromy: Vec<Vec<Dd>>,
    /// Eigenvalues of the monodromy, `[re, im]`, the largest first.
    pub multipliers: Vec<[f64; 2]>,
    /// `xi_1 … xi_6` from the first passage to itself: `xi_n = h_x · Mⁿ · β`
    /// (docs/mathematics/orbit.md).
    pub xi: Vec<Dd>,
    /// Conditions `xi_n` between every two passages, ordered by `from`, then `to`.
    pub conditions: Vec<GrazingConditions<Dd>>,
    /// Lowest minimum of any event function along the orbit, grazing passages excepted. Negative if
    /// the orbit passes through a surface and is therefore no orbit of the oscillator with its
    /// stops.
    pub clearance: Option<f64>,
    /// Deepest passage through a surface, if there is one.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub penetration: Option<Penetration>,
    /// Values of the adjusted parameter at the other grazes that the search met along the curve of
    /// periodic orbits.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub other_grazes: Vec<f64>,
    /// Distance from the scene's guess in the full state (the phase taken modulo its period).
    pub guess_distance: Option<f64>,
}

/// A passage of an orbit of the free flow through a surface.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Penetration {
    /// Surface (index into [`Model::surfaces`](crate::model::Model::surfaces)).
    pub surface: usize,
    /// `-h` at the deepest point; positive.
    pub depth: f64,
    /// Full state at the deepest point; the phase in `[0, period)`.
    pub state: Vec<f64>,
    /// Time from the first grazing point to the deepest point.
    pub time: f64,
}

/// `xi_1, xi_2, …` from one grazing passage to another.
///
/// `xi_n = ∇h_to · M_n · β_from`, with `M_n` the derivative of the free flow from the graze `from`
/// to the `n`-th graze `to` that follows it, and `β_from` the direction in which `D` stretches
/// there. The time between them is `n` periods from a graze to itself, and `n − 1` periods and a
/// part of one to another. Positive: the gap opens; negative: the surface is met again; zero: a
/// point of codimension two.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct GrazingConditions<S> {
    /// Passage that stretches (index into the orbit's passages).
    pub from: usize,
    /// Passage whose gap opens or closes (index into the orbit's passages).
    pub to: usize,
    /// `xi_1, xi_2, …`; empty if contact at `from` has no effect.
    pub values: Vec<S>,
}

/// Outcome of the search for a grazing orbit.
#[derive(Clone, Debug, PartialEq)]
pub enum Location {
    /// A grazing orbit.
    Located(Box<GrazingOrbit>),
    /// No grazing orbit, with the reason.
    NotLocated(NotLocated),
}

impl Location {
    /// The orbit, or the reason why there is none.
    ///
    /// # Errors
    ///
    /// [`NotLocated`] if the search ended without an orbit.
    pub fn into_result(self) -> Result<GrazingOrbit, NotLocated> {
        match self {
            Location::Located(orbit) => Ok(*orbit),
            Location::NotLocated(reason) => Err(reason),
        }
    }
}

impl GrazingOrbit {
    /// The first grazing point.
    pub fn grazing_point(&self) -> &GrazingPoint {
        &self.passages[0]
    }

    /// All parameters of the model at which the orbit grazes.
    pub fn parameters(&self) -> &[Dd] {
        &self.grazing_point().parameters
    }

    /// Whether the orbit stays on the free side of every surface between its grazing passages.
    pub fn is_physical(&self) -> bool {
        self.clearance.is_none_or(|clearance| clearance >= 0.0)
    }

    /// The orbit, if it is an orbit of the oscillator with its stops.
    ///
    /// # Errors
    ///
    /// [`NotLocated::PassesThrough`] if the orbit of the free flow passes through a surface.
    pub fn physical(&self, scene: &Scene) -> Result<&Self, NotLocated> {
        match &self.penetration {
            None => Ok(self),
            Some(penetration) => Err(penetration.refusal(scene, self)),
        }
    }

    /// Names and values of the section's coordinates at the section point.
    pub fn section_coordinates<'a>(&self, scene: &'a Scene) -> Vec<(&'a str, Dd)> {
        let names = self.section.coordinate_names(&scene.model);
        let values =
            self.section.coordinates.iter().map(|&component| self.section_point[component]);
        names.into_iter().zip(values).collect()
    }
}

impl Penetration {
    /// The deepest of the minima of event functions along an orbit, if it is negative.
    pub(super) fn deepest(scene: &Scene, minima: &[Minimum]) -> Option<Self> {
        let deepest = minima.iter().min_by(|a, b| a.event.total_cmp(&b.event));
        deepest.filter(|deepest| deepest.event < 0.0).map(|deepest| Self {
            surface: deepest.surface,
            depth: -deepest.event,
            state: with_reduced_phase(scene, deepest.state.clone()),
            time: deepest.time,
        })
    }

    /// Reason to refuse the orbit: it passes through a surface.
    fn refusal(&self, scene: &Scene, orbit: &GrazingOrbit) -> NotLocated {
        let model = &scene.model;
        let name = |surface: usize| model.surfaces[surface].name.clone();
        let adjusted = scene.grazing.solve_for.iter();
        let adjusted = adjusted.map(|&parameter| {
            let value = orbit.parameters()[parameter].to_f64();
            (model.parameters[parameter].name.clone(), value)
        });
        let (place, value) = match (&model.phase, self.state.last()) {
            (Some(phase), Some(&value)) => (phase.name.clone(), value),
            _ => ("time since the graze".to_owned(), self.time),
        };
        NotLocated::PassesThrough {
            surface: name(self.surface),
            depth: self.depth,
            place: NamedValues(vec![(place, value)]),
            grazed: orbit.passages.iter().map(|graze| name(graze.surface)).collect(),
            at: NamedValues(adjusted.collect()),
        }
    }
}

/// A full state whose phase is in `[0, period)`.
pub(super) fn with_reduced_phase<S: Real>(scene: &Scene, mut state: Vec<S>) -> Vec<S> {
    if let (Some(phase), Some(value)) = (&scene.model.phase, state.last_mut()) {
        *value = S::from_dd(reduced(value.to_dd(), phase.period));
    }
    state
}

/// Longest time from a hit to the minimum that its approach would have had, as a share of the
/// period; direct simulation uses the same bound.
const LONGEST_LEAD: f64 = 0.25;

/// A hit, seen from the section.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FollowingHit {
    /// Surface (index).
    pub surface: usize,
    /// Time from the section point to the minimum that the approach would have had, as a share of
    /// the period, in `[0, 1)`.
    pub share: f64,
    /// Whether the orbit comes to rest against the surface.
    pub rests: bool,
}

/// Largest modulus of a multiplier that is zero to rounding.
const FORGOTTEN: f64 = 1e-13;

/// A passage within this share of the period from the section counts as on it.
const ON_SECTION: f64 = 1e-24;

/// Largest `f64` below 1, the largest share of a period.
const BELOW_ONE: f64 = 1.0 - f64::EPSILON / 2.0;

/// A grazing passage, seen from the section.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FollowingPassage {
    /// Index into [`GrazingOrbit::passages`].
    pub place: usize,
    /// Surface of the passage (index).
    pub surface: usize,
    /// Time from the section point to the passage, in `[0, period of the orbit)`.
    pub time: Dd,
    /// Time from the section point as a share of the period, in `[0, 1)`.
    pub share: f64,
}

impl GrazingOrbit {
    /// Passages of one period in the order in which they follow the section point.
    ///
    /// On a section between passages the list begins with the next passage, even if the scene names
    /// another one first.
    pub fn passages_after_section(&self, scene: &Scene) -> Vec<FollowingPassage> {
        let until_first = self.time_to_first_passage(scene);
        let passages = self.passages.iter().enumerate();
        let mut following: Vec<_> = passages
            .map(|(place, passage)| {
                let time = from_section(until_first + passage.time, self.period);
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

    /// Hits of one period, in order from the first graze.
    pub fn hits_after_section(&self, scene: &Scene) -> Vec<FollowingHit> {
        let until_first = self.time_to_first_passage(scene);
        let hits = self.hits.iter().map(|hit| {
            let geometry = Geometry::new(&scene.model, hit.surface);
            let acceleration = geometry.at(&hit.state, self.parameters()).acceleration();
            let longest = self.period * Dd::from(LONGEST_LEAD);
            let turns = acceleration * longest > hit.speed;
            let lead = if turns { hit.speed / acceleration } else { Dd::ZERO };
            let lead = if acceleration > Dd::ZERO && !turns { longest } else { lead };
            let time = from_section(until_first + hit.time + lead, self.period);
            FollowingHit {
                surface: hit.surface,
                share: (time / self.period).to_f64().min(BELOW_ONE),
                rests: hit.rests,
            }
        });
        hits.collect()
    }

    /// Whether a rest against a stop leaves nothing of a deviation: every multiplier is zero to
    /// rounding.
    pub fn forgets(&self) -> bool {
        let vanishes = |[re, im]: &[f64; 2]| re.hypot(*im) <= FORGOTTEN;
        self.hits.iter().any(|hit| hit.rests) && self.multipliers.iter().all(vanishes)
    }

    /// Contacts of one period in order, from the first graze.
    pub fn contacts(&self) -> Vec<OrbitContact> {
        let grazes = self.passages.iter().map(|at| (at.time, OrbitContact::Graze(at.surface)));
        let hits = self.hits.iter().map(|at| (at.time, OrbitContact::Hit(at.surface)));
        let mut contacts: Vec<(Dd, OrbitContact)> = grazes.chain(hits).collect();
        contacts.sort_by(|a, b| a.0.to_f64().total_cmp(&b.0.to_f64()));
        contacts.into_iter().map(|(_, contact)| contact).collect()
    }

    /// Reason to refuse the orbit, if its hits are not those that the scene names.
    pub(super) fn other_hits(&self, scene: &Scene) -> Option<NotLocated> {
        let order = scene.grazing.hits.order.as_ref()?;
        let found = self.contacts();
        if found == *order {
            return None;
        }
        let model = &scene.model;
        let name = |contact: &OrbitContact| {
            let name = &model.surfaces[contact.surface()].name;
            match contact {
                OrbitContact::Graze(_) => format!("{name:?}"),
                OrbitContact::Hit(_) => format!("{{ hit = {name:?} }}"),
            }
        };
        let adjusted = scene.grazing.solve_for.iter().map(|&parameter| {
            let value = self.parameters()[parameter].to_f64();
            (model.parameters[parameter].name.clone(), value)
        });
        Some(NotLocated::OtherHits {
            found: found.iter().map(name).collect(),
            named: order.iter().map(name).collect(),
            at: NamedValues(adjusted.collect()),
        })
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
        self.period * from_section(ahead, clock.period) / advance
    }
}

/// Time reduced to `[0, period)`; a time within rounding of 0 or of the period becomes 0.
fn from_section(time: Dd, period: Dd) -> Dd {
    let rest = reduced(time, period);
    let near = period * Dd::from(ON_SECTION);
    if rest <= near || period - rest <= near { Dd::ZERO } else { rest }
}

/// The grazing passages of a scene's orbit.
///
/// The first `independent` passages are equations of the orbit, one adjusted parameter each. With
/// the half-period symmetry the second half of the passages mirrors the first. All other passages
/// have to touch without an equation.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Grazes {
    /// Surfaces grazed in one period, in order.
    pub(super) surfaces: Vec<usize>,
    /// Number of grazes that are equations.
    pub(super) independent: usize,
    /// Symmetry of the orbit.
    pub(super) symmetry: Symmetry,
}

impl Grazes {
    /// The grazes that a scene requests.
    ///
    /// NOTE: an orbit of an even number of forcing periods cannot be its own mirror image. Half of
    /// it lasts whole periods, and `(x, theta) -> (-x, theta + period/2)` shifts the phase by half
    /// a period.
    pub(super) fn of(scene: &Scene) -> Result<Self, OrbitError> {
        let grazing = &scene.grazing;
        let (surfaces, symmetry) = (grazing.passages.clone(), grazing.symmetry);
        let (named, passages) = (grazing.solve_for.len(), surfaces.len());
        if symmetry == Symmetry::HalfPeriod {
            if grazing.periods.is_multiple_of(2) {
                let periods = grazing.periods;
                return Err(OrbitError::EvenPeriods { periods });
            }
            if !passages.is_multiple_of(2) {
                return Err(OrbitError::UnpairedPassages { passages });
            }
        }
        let grazes = Self { surfaces, independent: named, symmetry };
        let most = grazes.unmirrored();
        if named == 0 || named > most {
            return Err(OrbitError::AdjustedParameters { named, most });
        }
        Ok(grazes)
    }

    /// Number of passages that are not mirror images.
    pub(super) fn unmirrored(&self) -> usize {
        match self.symmetry {
            Symmetry::None => self.surfaces.len(),
            Symmetry::HalfPeriod => self.surfaces.len() / 2,
        }
    }

    /// Only the first graze.
    pub(super) fn first(&self) -> Self {
        Self { surfaces: self.surfaces[..1].to_vec(), independent: 1, symmetry: self.symmetry }
    }

    /// Share of the period that determines the orbit: 1, or 1/2 with the symmetry.
    pub(super) fn share(&self) -> f64 {
        match self.symmetry {
            Symmetry::None => 1.0,
            Symmetry::HalfPeriod => 0.5,
        }
    }

    /// Factor of the states after that share of the period: 1, or −1 with the symmetry.
    pub(super) fn image(&self) -> f64 {
        match self.symmetry {
            Symmetry::None => 1.0,
            Symmetry::HalfPeriod => -1.0,
        }
    }

    /// Phase advance of a forced orbit in one of its periods; `None` without a phase.
    pub(super) fn advance(scene: &Scene) -> Option<Dd> {
        let periods = Dd::from(scene.grazing.periods as f64);
        let phase = scene.model.phase.as_ref();
        phase.map(|phase| phase.period * periods)
    }
}

/// A passage that touches its surface.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Touch<S> {
    /// Surface that is touched (index).
    pub(super) surface: usize,
    /// Time since the first graze, in `[0, period of the orbit)`.
    pub(super) time: S,
    /// Full state; the phase in `[0, period)`.
    pub(super) state: Vec<S>,
}

/// Largest departure from the symmetry, relative to the largest rate of a state, that counts as
/// rounding in double-double.
const ROUNDING: f64 = 1e-24;

/// The mirror image of a full state, its phase in `[0, period)`.
pub(super) fn mirrored<S: Real>(model: &Model, state: &[S]) -> Vec<S> {
    let mut image: Vec<S> = state.iter().map(|&value| -value).collect();
    if let (Some(clock), Some(phase), Some(&value)) = (&model.phase, image.last_mut(), state.last())
    {
        let shifted = value.to_dd() + clock.period * Dd::from(0.5);
        *phase = S::from_dd(reduced(shifted, clock.period));
    }
    image
}

/// Checks `f(-x, theta + period/2) = -f(x, theta)` at full states where the field is finite.
///
/// # Errors
///
/// [`OrbitError::NotSymmetric`] with the largest departure.
pub(super) fn check_field(
    model: &Model,
    geometry: &Geometry,
    points: &[Vec<Dd>],
    parameters: &[Dd],
) -> Result<(), OrbitError> {
    let rates = |state: &[Dd]| geometry.at(state, parameters).flow();
    let mut largest = 0.0_f64;
    let mut worst: Option<(f64, OrbitError)> = None;
    for point in points {
        let image = mirrored(model, point);
        let pairs = rates(point).into_iter().zip(rates(&image));
        for (component, (here, there)) in pairs.enumerate().take(model.states.len()) {
            let departure = (here + there).magnitude();
            if !departure.is_finite() {
                continue;
            }
            largest = largest.max(here.magnitude());
            if worst.as_ref().is_none_or(|(most, _)| departure > *most) {
                let error = OrbitError::NotSymmetric {
                    component: model.states[component].clone(),
                    phase: point.last().map_or(f64::NAN, |phase| phase.to_f64()),
                    rate: here.to_f64(),
                    mirrored: there.to_f64(),
                };
                worst = Some((departure, error));
            }
        }
    }
    match worst {
        Some((departure, error)) if departure > ROUNDING * largest => Err(error),
        _ => Ok(()),
    }
}
