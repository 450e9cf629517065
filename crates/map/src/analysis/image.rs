//! Repeated images of rows of offsets under the map, its parts, or direct simulation.

use super::direct_image::{DirectEnd, DirectImage};
use super::error::{AnalysisError, check_contacts, check_length};
use super::evaluation::MapEvaluation;
use crate::expansion::{ExceededBound, LocalMap};
use crate::hybrid::HybridSystem;
use crate::iteration::parallel;
use crate::iteration::{DiscreteMap, HornerMap};
use crate::model::Scene;
use crate::numeric::{Dd, Real, converted};
use crate::orbit::GrazingOrbit;

/// Method that computes an image.
#[derive(Clone, Copy, Debug, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Using {
    /// The local map.
    Map,
    /// The local map inside its window, direct simulation outside.
    Guarded,
    /// Direct simulation.
    Direct,
    /// `P_smooth` alone.
    Smooth,
    /// `D` alone.
    Discontinuity,
}

impl Using {
    /// All methods, with the words for them.
    pub const ALL: [(&'static str, Self); 5] = [
        ("map", Self::Map),
        ("guarded", Self::Guarded),
        ("direct", Self::Direct),
        ("smooth", Self::Smooth),
        ("discontinuity", Self::Discontinuity),
    ];
}

/// Number type an image is computed in.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Precision {
    /// Single precision, for polynomials only.
    F32,
    /// Double precision.
    #[default]
    F64,
    /// Double-double.
    Dd,
}

impl Precision {
    /// All precisions, with the words for them.
    pub const ALL: [(&'static str, Self); 3] =
        [("f64", Self::F64), ("f32", Self::F32), ("dd", Self::Dd)];
}

/// One starting point, in offsets.
#[derive(Clone, Debug, PartialEq)]
pub struct ImageRow {
    /// One offset per coordinate of the section.
    pub state: Vec<Dd>,
    /// One offset per active parameter.
    pub parameters: Vec<Dd>,
}

/// Request of [`images`].
#[derive(Clone, Debug, PartialEq)]
pub struct ImageRequest {
    /// Starting points.
    pub rows: Vec<ImageRow>,
    /// Images per row.
    pub iterations: usize,
    /// Method that computes the images.
    pub using: Using,
    /// Number type.
    pub precision: Precision,
}

/// One image.
#[derive(Clone, Debug, PartialEq)]
pub struct ImageRecord {
    /// Row of the request, from 0.
    pub row: usize,
    /// Iteration, from 1.
    pub iteration: usize,
    /// Offsets of the image; NaN where there is none.
    pub offsets: Vec<Dd>,
    /// Passages that made contact.
    pub contacts: usize,
    /// Bounds of the window that the mapped point exceeds.
    pub exceeded: Vec<ExceededBound>,
    /// Contacts beyond one per passage, and at surfaces that do not graze; `None` for polynomials.
    pub extra_contacts: Option<usize>,
    /// End of a direct simulation; `None` for polynomials.
    pub end: Option<DirectEnd>,
}

impl ImageRecord {
    /// Whether the mapped point lies within the window.
    pub fn inside(&self) -> bool {
        self.exceeded.is_empty()
    }
}

/// Images of rows of offsets, row by row, each row's iterations in order.
///
/// A row ends early after an image that is not finite; its last record holds that image. Rows are
/// computed on all cores; the result does not depend on their number.
///
/// # Errors
///
/// [`AnalysisError::Length`] if a row does not fit the section or the active parameters;
/// [`AnalysisError::Hybrid`] if an offset is not finite; [`AnalysisError::SingleSimulation`] for
/// direct simulation in single precision; [`AnalysisError::NoContacts`] for images by contacts that
/// are not expanded.
pub fn images(
    scene: &Scene,
    orbit: &GrazingOrbit,
    map: &LocalMap,
    request: &ImageRequest,
) -> Result<Vec<ImageRecord>, AnalysisError> {
    for row in &request.rows {
        check_length("offsets of the state", map.dimension(), row.state.len())?;
        check_length("offsets of the parameters", map.parameters.len(), row.parameters.len())?;
    }
    if !matches!(request.using, Using::Direct | Using::Smooth) {
        check_contacts(map)?;
    }
    match (request.using, request.precision) {
        (Using::Direct | Using::Guarded, Precision::F32) => Err(AnalysisError::SingleSimulation),
        (Using::Direct, Precision::F64) => flown(scene, orbit, map, request, None::<&Emitted>),
        (Using::Guarded, Precision::F64) => {
            flown(scene, orbit, map, request, Some(&Emitted::new(map)))
        }
        (Using::Direct, Precision::Dd) => {
            flown(scene, orbit, map, request, None::<&MapEvaluation<Dd>>)
        }
        (Using::Guarded, Precision::Dd) => {
            flown(scene, orbit, map, request, Some(&MapEvaluation::<Dd>::new(map)))
        }
        (Using::Map, Precision::F64) => mapped(map, request, &Emitted::new(map)),
        (_, Precision::F32) => mapped(map, request, &evaluation::<f32>(map, request.using)),
        (_, Precision::F64) => mapped(map, request, &evaluation::<f64>(map, request.using)),
        (_, Precision::Dd) => mapped(map, request, &evaluation::<Dd>(map, request.using)),
    }
}

/// The map or a part of it, evaluated from its coefficients.
fn evaluation<S: Real>(map: &LocalMap, using: Using) -> MapEvaluation<S> {
    match using {
        Using::Smooth => MapEvaluation::smooth(map),
        Using::Discontinuity => MapEvaluation::discontinuity(map),
        Using::Map | Using::Guarded | Using::Direct => MapEvaluation::new(map),
    }
}

/// Function from a point to its image at fixed parameters.
type ImageFunction<'a, S> = Box<dyn Fn(&[S]) -> Image<S> + 'a>;

/// A method that maps points at fixed parameters.
trait Mapped<S>: Sync {
    /// The step at the given parameters.
    fn at<'a>(&'a self, parameters: &'a [S]) -> ImageFunction<'a, S>;
}

impl<S: Real> Mapped<S> for MapEvaluation<S> {
    fn at<'a>(&'a self, parameters: &'a [S]) -> ImageFunction<'a, S> {
        Box::new(move |state| {
            let image = self.image(state, parameters);
            let contacts = image.contacts();
            Image { contacts, offsets: image.offsets, extra_contacts: None, end: None }
        })
    }
}

/// The map with the factored operations of the emitted code, its parameters folded in; results are
/// equal to the last bit.
struct Emitted(HornerMap);

impl Emitted {
    fn new(map: &LocalMap) -> Self {
        Self(HornerMap::new(map))
    }
}

impl Mapped<f64> for Emitted {
    fn at<'a>(&'a self, parameters: &'a [f64]) -> ImageFunction<'a, f64> {
        let frozen = self.0.freeze(parameters);
        Box::new(move |state| {
            let mut offsets = vec![0.0; state.len()];
            let contacts = frozen.step(state, &[], &mut offsets).passages.len();
            Image { offsets, contacts, extra_contacts: None, end: None }
        })
    }
}

/// Images by direct simulation. With `guarded`, that map computes the images of points inside its
/// window.
fn flown<S: Real>(
    scene: &Scene,
    orbit: &GrazingOrbit,
    map: &LocalMap,
    request: &ImageRequest,
    guarded: Option<&impl Mapped<S>>,
) -> Result<Vec<ImageRecord>, AnalysisError> {
    let exceeded = exceeded::<S>(map);
    let system = HybridSystem::new(&scene.model);
    let direct = DirectImage::<S>::new(&system, scene, orbit)?;
    let fly = |direct: &mut DirectImage<S>, row: usize| {
        let parameters = converted(&request.rows[row].parameters);
        let guarded = guarded.map(|map| map.at(&parameters));
        iterate(row, request, &exceeded, |state, parameters, inside| {
            if let Some(step) = guarded.as_ref().filter(|_| inside) {
                return Ok(step(state));
            }
            let image = direct.image(state, parameters)?;
            Ok(Image {
                offsets: image.offsets,
                contacts: image.contacts,
                extra_contacts: Some(image.extra_contacts),
                end: Some(image.end),
            })
        })
    };
    let rows = parallel::try_map_with(0..request.rows.len(), || direct.clone(), fly)?;
    Ok(rows.concat())
}

/// Images by the map or a part of it.
fn mapped<S: Real>(
    map: &LocalMap,
    request: &ImageRequest,
    by: &impl Mapped<S>,
) -> Result<Vec<ImageRecord>, AnalysisError> {
    let exceeded = exceeded::<S>(map);
    let rows = parallel::try_map(0..request.rows.len(), |row| {
        let parameters = converted(&request.rows[row].parameters);
        let step = by.at(&parameters);
        iterate(row, request, &exceeded, |state, _, _| Ok(step(state)))
    })?;
    Ok(rows.concat())
}

/// Bounds of the window of a map that a point exceeds.
fn exceeded<S: Real>(map: &LocalMap) -> impl Fn(&[S], &[S]) -> Vec<ExceededBound> {
    let depths = MapEvaluation::<S>::depths(map);
    move |state, parameters| {
        let depths = depths.at(state, parameters);
        map.window.exceeded(state, parameters, &depths).collect()
    }
}

/// One image by any method.
struct Image<S> {
    offsets: Vec<S>,
    contacts: usize,
    extra_contacts: Option<usize>,
    end: Option<DirectEnd>,
}

/// All images of one row.
fn iterate<S: Real>(
    row: usize,
    request: &ImageRequest,
    exceeded: &impl Fn(&[S], &[S]) -> Vec<ExceededBound>,
    mut step: impl FnMut(&[S], &[S], bool) -> Result<Image<S>, AnalysisError>,
) -> Result<Vec<ImageRecord>, AnalysisError> {
    let start = &request.rows[row];
    let (mut state, parameters) = (converted(&start.state), converted(&start.parameters));
    let mut records = Vec::with_capacity(request.iterations);
    for iteration in 1..=request.iterations {
        let exceeded = exceeded(&state, &parameters);
        let image = step(&state, &parameters, exceeded.is_empty())?;
        let finite = image.offsets.iter().all(|value| value.is_finite());
        records.push(ImageRecord {
            row,
            iteration,
            offsets: converted(&image.offsets),
            contacts: image.contacts,
            exceeded,
            extra_contacts: image.extra_contacts,
            end: image.end,
        });
        if !finite {
            break;
        }
        state = image.offsets;
    }
    Ok(records)
}
