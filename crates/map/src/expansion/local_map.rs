//! The local map: polynomials in offsets, stage by stage, with its section, parameters and window.

use std::sync::Arc;

use serde::{Deserialize, Serialize};

use super::flown::FlownContact;
use super::power_law::PowerCorrections;
use crate::jet::Jet;
use crate::model::{Digest, MapOrders, Scene};
use crate::numeric::{Dd, Real, Scalar, unbounded, unbounded_number};
use crate::orbit::{GrazingOrbit, PoincareSectionKind};

/// A local map `P` near a grazing orbit, as the sequence of its stages.
///
/// States and parameters are offsets: states from the section point of the grazing orbit,
/// parameters from their grazing values. Every stage maps the same number of coordinates
/// ([`dimension`](LocalMap::dimension)). The last stage also removes the nominal advance of the
/// phase, so that the map can be iterated.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct LocalMap {
    /// Identifier of the scene.
    pub scene: String,
    /// Digest of the scene's text.
    pub digest: Digest,
    /// The section and its coordinates.
    pub section: MapSection,
    /// Active parameters, in order.
    pub parameters: Vec<ActiveParameter>,
    /// Truncation orders; the contact weight is 0 if contacts are not expanded.
    pub orders: MapOrders,
    /// Name of the surface of each passage, in the order in which the passages follow the section.
    pub surfaces: Vec<String>,
    /// Legs and contacts, in the order in which they act.
    pub stages: Vec<Stage>,
    /// Window in which the map is to be trusted.
    pub window: MapWindow,
    /// Orders of the map that the coefficients were fitted to on the window; `None` if they are
    /// those of the Taylor series.
    pub fitted_to: Option<MapOrders>,
}

/// Section of a map.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct MapSection {
    /// Kind of the section.
    pub kind: SectionKind,
    /// Names of the coordinates.
    pub coordinates: Vec<String>,
    /// Section point of the grazing orbit: one value per coordinate.
    pub point: Vec<Dd>,
    /// Phase of a stroboscopic section.
    pub phase: Option<Dd>,
}

/// Kind of a section.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum SectionKind {
    /// Tangency: `h' = 0` at the graze.
    Tangency,
    /// Stroboscopic: a fixed forcing phase.
    Stroboscopic,
}

/// A parameter kept as a variable.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct ActiveParameter {
    /// Name of the parameter.
    pub name: String,
    /// Value at the graze.
    pub value: Dd,
}

/// Half-widths of the window in which the map is to be trusted, in offsets; infinite for an open
/// bound.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct MapWindow {
    /// Largest depth `y²`.
    #[serde(with = "unbounded_number")]
    pub depth: f64,
    /// One half-width per coordinate.
    #[serde(with = "unbounded")]
    pub state: Vec<f64>,
    /// One half-width per active parameter.
    #[serde(with = "unbounded")]
    pub parameter: Vec<f64>,
}

impl MapWindow {
    /// Window that a scene states, on the section's coordinates and the active parameters; bounds
    /// that it does not state are infinite.
    pub fn stated(scene: &Scene, orbit: &GrazingOrbit) -> Self {
        let window = &scene.window;
        let coordinates = orbit.section.coordinates.iter();
        let active = scene.expansion.active.iter();
        Self {
            depth: window.depth,
            state: coordinates.map(|&component| window.state[component]).collect(),
            parameter: active.map(|&parameter| window.parameter[parameter]).collect(),
        }
    }

    /// All bounds: of the depth, of each coordinate, of each parameter.
    pub fn bounds(&self) -> impl Iterator<Item = f64> {
        [self.depth].into_iter().chain(self.state.iter().chain(&self.parameter).copied())
    }

    /// All bounds, in the order of [`bounds`](Self::bounds), mutable.
    pub fn bounds_mut(&mut self) -> impl Iterator<Item = &mut f64> {
        [&mut self.depth].into_iter().chain(self.state.iter_mut().chain(&mut self.parameter))
    }

    /// Whether no bound is finite.
    pub fn is_unbounded(&self) -> bool {
        self.bounds().all(|bound| bound == f64::INFINITY)
    }

    /// Whether offsets of the state, offsets of the parameters and depths of the passages lie
    /// within the window; parameters that are not given count as 0.
    pub fn holds<S: Real>(&self, state: &[S], parameters: &[S], depths: &[S]) -> bool {
        self.exceeded(state, parameters, depths).next().is_none()
    }

    /// Bounds that are exceeded by offsets of the state, offsets of the parameters or depths of the
    /// passages.
    pub fn exceeded<S: Real>(
        &self,
        state: &[S],
        parameters: &[S],
        depths: &[S],
    ) -> impl Iterator<Item = ExceededBound> {
        let beyond = |(place, (value, &width)): (usize, (&S, &f64))| {
            let is_within = value.to_f64().abs() <= width;
            (!is_within).then_some(place)
        };
        let states = state.iter().zip(&self.state).enumerate().filter_map(beyond);
        let parameters = parameters.iter().zip(&self.parameter).enumerate().filter_map(beyond);
        let deep = depths.iter().enumerate().filter(|(_, depth)| {
            let is_within = depth.to_f64() <= self.depth;
            !is_within
        });
        let depths = deep.map(|(passage, _)| ExceededBound::Depth(passage));
        let states = states.map(ExceededBound::State);
        states.chain(parameters.map(ExceededBound::Parameter)).chain(depths)
    }
}

/// A bound of a window.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ExceededBound {
    /// Half-width of a coordinate, by its number.
    State(usize),
    /// Half-width of an active parameter, by its number.
    Parameter(usize),
    /// Depth of a passage, by its number.
    Depth(usize),
}

/// One stage of a local map.
#[derive(Clone, Debug, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Stage {
    /// A piece of free flow.
    Leg(Leg),
    /// A grazing passage.
    Contact(Contact),
    /// A grazing passage with an exactly flown contact.
    Flown(Box<FlownContact>),
}

impl Stage {
    /// Whether this is a grazing passage.
    pub fn is_passage(&self) -> bool {
        !matches!(self, Self::Leg(_))
    }

    /// All polynomials of the stage.
    pub fn polynomials(&self) -> Vec<&Jet<f64>> {
        match self {
            Self::Leg(leg) => leg.image.iter().collect(),
            Self::Contact(contact) => {
                let corrections = contact.linear.iter().chain(&contact.quadratic);
                corrections.chain([&contact.depth]).chain(contact.powers.polynomials()).collect()
            }
            Self::Flown(flown) => flown.polynomials().collect(),
        }
    }
}

/// A leg: each image coordinate as a polynomial in (coordinates; parameters), without constant
/// term.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct Leg<S: Scalar = f64> {
    /// One polynomial per coordinate.
    pub image: Vec<Jet<S>>,
}

/// A grazing passage in canonical form, with `y = √max(0, depth(x, p))`:
///
/// ```text
/// x_i ↦ x_i + y linear_i(x, p) + y² quadratic_i(x, p)
/// ```
///
/// and, for a contact with powers of the penetration, terms with powers of `y` that are not whole.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct Contact<S: Scalar = f64> {
    /// Depth `−h_min`, a polynomial in (coordinates; parameters) without constant term.
    pub depth: Jet<S>,
    /// Coefficient of `y`, one polynomial per coordinate.
    pub linear: Vec<Jet<S>>,
    /// Coefficient of `y²`, one polynomial per coordinate.
    pub quadratic: Vec<Jet<S>>,
    /// Terms with powers of `y` that are not whole.
    #[serde(default, skip_serializing_if = "PowerCorrections::is_empty")]
    pub powers: PowerCorrections<S>,
    /// Corrections in the depth variable, as expanded; `None` if coefficients were fitted or
    /// dropped for a tolerance.
    pub depth_form: Option<Arc<DepthForm<S>>>,
}

/// Corrections `D(x, p) − x` of a passage in `(y; x', p)`, with `y² = depth` in place of one of the
/// coordinates.
///
/// A power of the depth in [`Contact`] is a single power of `y` here. No digits are lost if
/// coordinates and parameters are larger than the depth, their difference.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct DepthForm<S: Scalar = f64> {
    /// Number of the replaced coordinate.
    pub replaced: usize,
    /// One polynomial in (y; coordinates; parameters) per coordinate.
    pub corrections: Vec<Jet<S>>,
}

impl<S: Scalar> Contact<S> {
    /// Polynomials of the correction of a coordinate: the coefficients of `y`, of `y²`, and of the
    /// terms with powers of `y` that are not whole.
    pub(super) fn corrections(&self, coordinate: usize) -> impl Iterator<Item = &Jet<S>> {
        let powers = self.powers.terms.iter();
        let powers =
            powers.flat_map(move |term| [&term.linear[coordinate], &term.quadratic[coordinate]]);
        [&self.linear[coordinate], &self.quadratic[coordinate]].into_iter().chain(powers)
    }
}

impl<S: Real> Contact<S> {
    /// Whether every coefficient is finite.
    pub fn is_finite(&self) -> bool {
        let mut jets = self.linear.iter().chain(&self.quadratic).chain([&self.depth]);
        jets.all(Jet::is_finite) && self.powers.is_finite()
    }

    /// Rounds the coefficients to `f64`.
    pub fn to_f64(&self) -> Contact {
        let round = |jets: &[Jet<S>]| jets.iter().map(Jet::to_f64).collect();
        Contact {
            depth: self.depth.to_f64(),
            linear: round(&self.linear),
            quadratic: round(&self.quadratic),
            powers: self.powers.map(Jet::to_f64),
            depth_form: self.depth_form.as_ref().map(|form| {
                Arc::new(DepthForm {
                    replaced: form.replaced,
                    corrections: round(&form.corrections),
                })
            }),
        }
    }
}

impl LocalMap {
    /// Number of coordinates.
    pub fn dimension(&self) -> usize {
        self.section.coordinates.len()
    }

    /// Whether the contacts of this map are expanded. A map by
    /// [`free_flight`](super::free_flight()) has corrections of NaN, so that no point in contact
    /// has an image.
    pub fn has_contacts(&self) -> bool {
        self.orders.contact_weight > 0
    }

    /// Whether a contact of this map is flown exactly.
    pub fn is_flown(&self) -> bool {
        self.stages.iter().any(|stage| matches!(stage, Stage::Flown(_)))
    }

    /// Whether every stage is a polynomial in (depth variables; coordinates; parameters).
    pub fn is_polynomial(&self) -> bool {
        self.stages.iter().all(|stage| match stage {
            Stage::Leg(_) => true,
            Stage::Contact(contact) => contact.powers.is_empty(),
            Stage::Flown(_) => false,
        })
    }

    /// Number of coefficients that are not zero.
    pub fn coefficients(&self) -> usize {
        let polynomials = self.stages.iter().flat_map(Stage::polynomials);
        polynomials.map(Jet::nonzero).sum()
    }

    /// Number of grazing passages.
    pub fn passages(&self) -> usize {
        self.stages.iter().filter(|stage| stage.is_passage()).count()
    }
}

/// The section with its coordinates and the section point of the grazing orbit.
pub(super) fn map_section(scene: &Scene, orbit: &GrazingOrbit) -> MapSection {
    let (kind, phase) = match orbit.section.kind {
        PoincareSectionKind::Tangency => (SectionKind::Tangency, None),
        PoincareSectionKind::Stroboscopic { phase } => (SectionKind::Stroboscopic, Some(phase)),
    };
    let (coordinates, point) = orbit
        .section_coordinates(scene)
        .into_iter()
        .map(|(name, value)| (name.to_owned(), value))
        .unzip();
    MapSection { kind, coordinates, point, phase }
}

/// Active parameters with their grazing values.
pub(super) fn active_parameters(scene: &Scene, orbit: &GrazingOrbit) -> Vec<ActiveParameter> {
    let active = |&parameter: &usize| ActiveParameter {
        name: scene.model.parameters[parameter].name.clone(),
        value: orbit.parameters()[parameter],
    };
    scene.expansion.active.iter().map(active).collect()
}

/// The scene's window on the section's coordinates and the active parameters, with an assumed depth
/// if the scene states none.
pub(super) fn map_window(scene: &Scene, orbit: &GrazingOrbit) -> MapWindow {
    MapWindow { depth: scene.window.assumed_depth(), ..MapWindow::stated(scene, orbit) }
}
