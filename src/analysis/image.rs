//! Images of rows of offsets under the map, its parts, or direct simulation, iterated.

use rayon::prelude::*;

use super::direct_image::{DirectEnd, DirectImage};
use super::error::{AnalysisError, check_length};
use super::evaluation::{MapEvaluation, MapImage};
use crate::expansion::{LocalMap, WindowBound};
use crate::hybrid::HybridSystem;
use crate::model::Scene;
use crate::numeric::{Dd, Real};
use crate::orbit::GrazingOrbit;

/// What computes an image.
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
    /// All of them, with the words for them.
    pub const ALL: [(&'static str, Self); 5] = [
        ("map", Self::Map),
        ("guarded", Self::Guarded),
        ("direct", Self::Direct),
        ("smooth", Self::Smooth),
        ("discontinuity", Self::Discontinuity),
    ];
}

/// The numbers an image is computed in.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Precision {
    /// Single precision, of polynomials.
    F32,
    /// Double precision.
    #[default]
    F64,
    /// Double-double.
    Dd,
}

impl Precision {
    /// All of them, with the words for them.
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

/// What is asked of [`images`].
#[derive(Clone, Debug, PartialEq)]
pub struct ImageRequest {
    /// Starting points.
    pub rows: Vec<ImageRow>,
    /// Images per row.
    pub iterations: usize,
    /// What computes them.
    pub using: Using,
    /// In which numbers.
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
    /// The bounds of the window that the point that was mapped is outside of.
    pub exceeded: Vec<WindowBound>,
    /// Contacts elsewhere in the period; `None` for polynomials, which know of none.
    pub extra_contacts: Option<usize>,
    /// How a direct simulation ended; `None` for polynomials.
    pub end: Option<DirectEnd>,
}

impl ImageRecord {
    /// Whether the point that was mapped lies within the window.
    pub fn inside(&self) -> bool {
        self.exceeded.is_empty()
    }
}

/// Images of rows of offsets, row by row, each row's iterations in order.
///
/// A row ends early where it has no finite image; the record says so. Rows are computed on all
/// cores; the result does not depend on their number.
///
/// # Errors
///
/// [`AnalysisError::Length`] if a row does not fit the section or the active parameters;
/// [`AnalysisError::Hybrid`] if an offset is not finite; [`AnalysisError::SingleSimulation`] for
/// direct simulation in single precision.
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
    match (request.using, request.precision) {
        (Using::Direct | Using::Guarded, Precision::F32) => Err(AnalysisError::SingleSimulation),
        (Using::Direct | Using::Guarded, Precision::F64) => {
            flown::<f64>(scene, orbit, map, request)
        }
        (Using::Direct | Using::Guarded, Precision::Dd) => flown::<Dd>(scene, orbit, map, request),
        (_, Precision::F32) => mapped::<f32>(map, request),
        (_, Precision::F64) => mapped::<f64>(map, request),
        (_, Precision::Dd) => mapped::<Dd>(map, request),
    }
}

/// Images by direct simulation: all of them, or those of points outside the map's window.
fn flown<S: Real>(
    scene: &Scene,
    orbit: &GrazingOrbit,
    map: &LocalMap,
    request: &ImageRequest,
) -> Result<Vec<ImageRecord>, AnalysisError> {
    let exceeded = exceeded::<S>(map);
    let system = HybridSystem::new(&scene.model);
    let direct = DirectImage::<S>::new(&system, scene, orbit)?;
    let guarded = (request.using == Using::Guarded).then(|| MapEvaluation::new(map));
    let fly = |direct: &mut DirectImage<S>, row| {
        iterate(row, request, &exceeded, |state, parameters, inside| {
            if let Some(map) = guarded.as_ref().filter(|_| inside) {
                return Ok(Image::of(map.image(state, parameters)));
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
    let rows = (0..request.rows.len()).into_par_iter();
    let rows = rows.map_init(|| direct.clone(), fly);
    let rows: Vec<Vec<ImageRecord>> = rows.collect::<Result<_, _>>()?;
    Ok(rows.concat())
}

/// Images by the map or a part of it.
fn mapped<S: Real>(
    map: &LocalMap,
    request: &ImageRequest,
) -> Result<Vec<ImageRecord>, AnalysisError> {
    let exceeded = exceeded::<S>(map);
    let evaluation = match request.using {
        Using::Smooth => MapEvaluation::<S>::smooth(map),
        Using::Discontinuity => MapEvaluation::discontinuity(map),
        Using::Map | Using::Guarded | Using::Direct => MapEvaluation::new(map),
    };
    let step =
        |state: &[S], parameters: &[S], _| Ok(Image::of(evaluation.image(state, parameters)));
    let rows = (0..request.rows.len()).into_par_iter();
    let rows = rows.map(|row| iterate(row, request, &exceeded, step));
    let rows: Vec<Vec<ImageRecord>> = rows.collect::<Result<_, _>>()?;
    Ok(rows.concat())
}

/// The bounds of the window of a map that a point is outside of.
fn exceeded<S: Real>(map: &LocalMap) -> impl Fn(&[S], &[S]) -> Vec<WindowBound> {
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

impl<S: Real> Image<S> {
    /// One by polynomials.
    fn of(image: MapImage<S>) -> Self {
        Self { contacts: image.contacts(), offsets: image.offsets, extra_contacts: None, end: None }
    }
}

/// All images of one row.
fn iterate<S: Real>(
    row: usize,
    request: &ImageRequest,
    exceeded: &impl Fn(&[S], &[S]) -> Vec<WindowBound>,
    mut step: impl FnMut(&[S], &[S], bool) -> Result<Image<S>, AnalysisError>,
) -> Result<Vec<ImageRecord>, AnalysisError> {
    let convert = |values: &[Dd]| values.iter().map(|&value| S::from_dd(value)).collect();
    let start = &request.rows[row];
    let (mut state, parameters): (Vec<S>, Vec<S>) =
        (convert(&start.state), convert(&start.parameters));
    let mut records = Vec::with_capacity(request.iterations);
    for iteration in 1..=request.iterations {
        let exceeded = exceeded(&state, &parameters);
        let image = step(&state, &parameters, exceeded.is_empty())?;
        let finite = image.offsets.iter().all(|value| value.is_finite());
        records.push(ImageRecord {
            row,
            iteration,
            offsets: image.offsets.iter().map(|value| value.to_dd()).collect(),
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
