//! Search for the largest errors of a map on its window: ascents from the worst points of a sample.
//!
//! An error is largest at an end of the window or on the verge of contact; both are faces on which
//! a variable is fixed or solved for. An ascent moves one variable after another, to its ends and
//! by decreasing steps, with the depth of a passage held. Then it moves that depth, over all
//! decades and through zero. Derivatives are not used, because those of an error have a pole on the
//! verge. Images in double precision guide the ascent; the result is the error at its summit in
//! double-double. If the two differ, the ascent is repeated in double-double.

use std::collections::BTreeMap;
use std::collections::btree_map::Entry;

use super::sample::{SamplePoint, WindowSample};
use super::truth::{ExactImages, ExactReturns, MOST_PRODUCTS, errors, nan_or_larger};
use crate::iteration::{DiscreteMap, parallel};

/// Successive steps of a variable, relative to its half-width.
const STEPS: [f64; 3] = [0.5, 0.12, 0.03];

/// Largest number of rounds through all variables with one step.
const ROUNDS: usize = 4;

/// Largest relative difference between the errors in double precision and in double-double at a
/// confirmed summit.
const CONFIRMED: f64 = 0.1;

/// Largest number of images of one ascent.
const MOST_IMAGES: usize = 160;

/// Depth, relative to the window's, below which a contact is on the verge.
const SHALLOW: f64 = 1e-3;

/// Factor between successive depths tried, and number of halvings of that factor.
const DECADES: (f64, usize) = (1e-2, 8);

/// Smallest depth tried besides 0, relative to the window's.
const LEAST: f64 = 1e-15;

/// Factor from the depth at which an error is largest to the depth at which other variables are
/// moved: on the verge itself the depth hides the dependence of the error on them.
const ABOVE_VERGE: f64 = 30.0;

/// Share of a coordinate's largest error in the sample below which the worst point of a class
/// starts no ascent.
const WORTH: f64 = 0.1;

/// Largest error of each coordinate; NaN if the map has no image.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Largest {
    /// Largest errors everywhere.
    pub(super) errors: Vec<f64>,
    /// Largest errors with no passage on the verge of contact.
    pub(super) off_verge: Vec<f64>,
}

impl Largest {
    fn new(dimension: usize) -> Self {
        Self { errors: vec![0.0; dimension], off_verge: vec![0.0; dimension] }
    }

    /// NaN errors of a window without any image.
    pub(super) fn none(dimension: usize) -> Self {
        Self { errors: vec![f64::NAN; dimension], off_verge: vec![f64::NAN; dimension] }
    }

    /// Whether the error of a coordinate is significantly larger on the verge of contact than
    /// elsewhere.
    pub(super) fn is_on_verge(&self, coordinate: usize) -> bool {
        self.errors[coordinate] > ON_VERGE * self.off_verge[coordinate]
    }

    fn add(&mut self, errors: &[f64], on_verge: bool) {
        raise(&mut self.errors, errors);
        if !on_verge {
            raise(&mut self.off_verge, errors);
        }
    }
}

/// Raises the largest errors; NaN counts as larger than any number.
fn raise(largest: &mut [f64], errors: &[f64]) {
    for (largest, &error) in largest.iter_mut().zip(errors) {
        *largest = nan_or_larger(*largest, error);
    }
}

/// Factor by which an error on the verge of contact must exceed that elsewhere to be attributed to
/// the verge.
const ON_VERGE: f64 = 1.1;

/// Class of a passage's depth, relative to the window's.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
enum Band {
    Free,
    Verge,
    Middle,
    Deep,
}

impl Band {
    fn of(share: f64) -> Self {
        match share {
            share if share.abs() < SHALLOW => Self::Verge,
            share if share < 0.0 => Self::Free,
            share if share < 0.5 => Self::Middle,
            _ => Self::Deep,
        }
    }
}

/// A map on a window, and the returns that it is compared with.
pub(super) struct Ascents<'a> {
    pub(super) returns: &'a ExactReturns<'a>,
    pub(super) run: &'a dyn DiscreteMap,
    pub(super) sample: &'a WindowSample,
}

impl Ascents<'_> {
    /// Largest errors over a sample and over the ascents from its worst points.
    pub(super) fn largest(&self, images: &ExactImages) -> Largest {
        let mut largest = Largest::new(self.run.dimension());
        let measured = images.pairs().map(|(point, image)| {
            let bands = self.bands(&self.sample.depths_at(&point.state, &point.parameters));
            (point, bands, errors(self.run, point, image))
        });
        let measured: Vec<MeasuredPoint<'_>> = measured.collect();
        for (_, bands, errors) in &measured {
            largest.add(errors, bands.contains(&Band::Verge));
        }
        let starts = self.starts(&measured, &largest.errors);
        let most = MOST_PRODUCTS / starts.len().max(1);
        let ascend = |returns: &mut ExactReturns<'_>, (start, coordinates): Start| {
            let (point, _, errors) = &measured[start];
            let mut largest = Largest::new(errors.len());
            let mut unsure = coordinates;
            for rounded in [true, false] {
                let mut ascent = Ascent {
                    map: self,
                    returns,
                    rounded,
                    known: BTreeMap::new(),
                    images: 0,
                    products: 0,
                    most,
                    summits: vec![[None, None]; errors.len()],
                };
                unsure.iter().for_each(|&coordinate| ascent.climb(point, errors, coordinate));
                unsure.retain(|&coordinate| !ascent.confirms(coordinate));
                ascent.add_summits(&mut largest);
            }
            largest
        };
        let found = parallel::map_with(starts, || self.returns.clone(), ascend);
        for found in found {
            raise(&mut largest.errors, &found.errors);
            raise(&mut largest.off_verge, &found.off_verge);
        }
        largest
    }

    fn bands(&self, depths: &[f64]) -> Vec<Band> {
        depths.iter().map(|depth| Band::of(depth / self.sample.deepest())).collect()
    }

    /// Worst point of each coordinate among the points whose depths are in the same bands.
    fn starts(&self, measured: &[MeasuredPoint<'_>], largest: &[f64]) -> Vec<Start> {
        let mut worst: BTreeMap<(Vec<Band>, usize), usize> = BTreeMap::new();
        for (number, (_, bands, errors)) in measured.iter().enumerate() {
            let verge = bands.contains(&Band::Verge);
            for (coordinate, (&own, &most)) in errors.iter().zip(largest).enumerate() {
                let error = |number: usize| measured[number].2[coordinate];
                if !verge && own < WORTH * most {
                    continue;
                }
                match worst.entry((bands.clone(), coordinate)) {
                    Entry::Vacant(entry) => {
                        entry.insert(number);
                    }
                    Entry::Occupied(mut entry) => {
                        if own > error(*entry.get()) {
                            entry.insert(number);
                        }
                    }
                }
            }
        }
        let mut starts: BTreeMap<usize, Vec<usize>> = BTreeMap::new();
        for ((_, coordinate), number) in worst {
            starts.entry(number).or_default().push(coordinate);
        }
        starts.into_iter().collect()
    }
}

/// A point, the bands of its depths, and its errors.
type MeasuredPoint<'a> = (&'a SamplePoint, Vec<Band>, Vec<f64>);

/// Number of a starting point, and the coordinates whose errors are to be increased from it.
type Start = (usize, Vec<usize>);

/// A passage's depth that is held, and the variable that is moved to reach it.
#[derive(Clone, Copy, Debug)]
struct Held {
    passage: usize,
    variable: usize,
    depth: f64,
}

/// Offsets of the variables (coordinates; parameters), one of them solved for if a depth is held.
#[derive(Clone, Debug)]
struct Place {
    offsets: Vec<f64>,
    held: Option<Held>,
}

/// An ascent from one point.
struct Ascent<'a, 'b> {
    map: &'a Ascents<'a>,
    returns: &'a mut ExactReturns<'b>,
    /// Whether images in double precision guide the ascent.
    rounded: bool,
    /// Errors known so far, by the precision of the image (`true`: double) and the bits of the
    /// offsets.
    known: BTreeMap<(bool, Vec<u64>), Option<Vec<f64>>>,
    images: usize,
    products: usize,
    /// Largest number of products of series.
    most: usize,
    /// Points of the largest error of each coordinate, everywhere and off the verge.
    summits: Vec<[Option<Summit>; 2]>,
}

/// The point of a largest error.
#[derive(Clone, Debug)]
struct Summit {
    point: SamplePoint,
    /// Errors at the point, by the images that guide the ascent.
    errors: Vec<f64>,
}

impl Ascent<'_, '_> {
    /// Increases the error of a coordinate.
    fn climb(&mut self, point: &SamplePoint, errors: &[f64], coordinate: usize) {
        self.images = 0;
        let offsets = [point.state.as_slice(), &point.parameters].concat();
        let mut best = (errors[coordinate], Place { held: self.held(point), offsets });
        self.over_depths(&mut best, coordinate);
        let deepest = self.map.sample.deepest();
        let hidden = |held: Held| held.depth != 0.0 && held.depth.abs() < SHALLOW * deepest;
        let Some(held) = best.1.held.filter(|&held| hidden(held)) else {
            self.over_variables(&mut best, coordinate);
            self.over_depths(&mut best, coordinate);
            return;
        };
        let depth = ABOVE_VERGE * held.depth.abs();
        let above = Place { held: Some(Held { depth, ..held }), ..best.1.clone() };
        if let Some(mut above) = self.tried(above, coordinate) {
            self.over_variables(&mut above, coordinate);
            self.over_depths(&mut above, coordinate);
        }
    }

    /// Passage of a point whose depth is held: the last one on the verge, otherwise the deepest
    /// contact.
    fn held(&self, point: &SamplePoint) -> Option<Held> {
        let sample = self.map.sample;
        let depths = sample.depths_at(&point.state, &point.parameters);
        let on_verge =
            |&passage: &usize| Band::of(depths[passage] / sample.deepest()) == Band::Verge;
        let deepest = |&a: &usize, &b: &usize| depths[a].total_cmp(&depths[b]);
        let passages = 0..depths.len();
        let contact = passages.clone().filter(|&passage| depths[passage] > 0.0).max_by(deepest);
        let passage = passages.rev().find(on_verge).or(contact)?;
        Some(Held { passage, variable: sample.steepest[passage], depth: depths[passage] })
    }

    /// Moves the held depth: over decades on both sides of contact, then in between.
    fn over_depths(&mut self, best: &mut (f64, Place), coordinate: usize) {
        let deepest = self.map.sample.deepest();
        let at = |best: &(f64, Place), depth: f64| {
            let held = best.1.held?;
            Some(Place { held: Some(Held { depth, ..held }), ..best.1.clone() })
        };
        let mut share = 1.0;
        let mut depths = vec![0.0];
        while share > LEAST {
            depths.extend([share, -share]);
            share *= DECADES.0;
        }
        for share in depths {
            let Some(place) = at(best, share * deepest) else { return };
            self.improve(best, place, coordinate);
        }
        let mut factor = DECADES.0;
        for _ in 0..DECADES.1 {
            factor = factor.sqrt();
            let Some(depth) = best.1.held.map(|held| held.depth) else { return };
            for depth in [depth * factor, (depth / factor).min(deepest)] {
                if let Some(place) = at(best, depth) {
                    self.improve(best, place, coordinate);
                }
            }
        }
    }

    /// Moves the variables except the one solved for, one after another, and the depth if it is not
    /// on the verge.
    fn over_variables(&mut self, best: &mut (f64, Place), coordinate: usize) {
        let widths = self.map.sample.widths();
        let deepest = self.map.sample.deepest();
        for step in STEPS {
            for _ in 0..ROUNDS {
                let before = best.clone();
                for (variable, &width) in widths.iter().enumerate() {
                    let here = best.1.offsets[variable];
                    let moved = [-here, -width, width, here - step * width, here + step * width];
                    for offset in moved.map(|offset| offset.clamp(-width, width)) {
                        if best.1.held.is_some_and(|held| held.variable == variable) {
                            continue;
                        }
                        let mut place = best.1.clone();
                        place.offsets[variable] = offset;
                        self.improve(best, place, coordinate);
                    }
                }
                let held = best.1.held.filter(|held| held.depth > SHALLOW * deepest);
                if let Some(held) = held {
                    for depth in [held.depth * (1.0 - step), held.depth / (1.0 - step)] {
                        let held = Some(Held { depth: depth.min(deepest), ..held });
                        let place = Place { held, ..best.1.clone() };
                        self.improve(best, place, coordinate);
                    }
                }
                if best.0 <= before.0 {
                    break;
                }
                // Continues as far again in the same direction.
                let pairs = best.1.offsets.iter().zip(&before.1.offsets).zip(&widths);
                let further =
                    pairs.map(|((&here, &was), &width)| (2.0 * here - was).clamp(-width, width));
                let place = Place { offsets: further.collect(), ..best.1.clone() };
                self.improve(best, place, coordinate);
            }
        }
    }

    /// Replaces the best place if the error at another place is larger.
    fn improve(&mut self, best: &mut (f64, Place), place: Place, coordinate: usize) {
        if let Some(tried) = self.tried(place, coordinate).filter(|tried| tried.0 > best.0) {
            *best = tried;
        }
    }

    /// Error of a coordinate at a place, brought to the held depth; `None` if that is outside the
    /// window or has no image.
    fn tried(&mut self, place: Place, coordinate: usize) -> Option<(f64, Place)> {
        if self.images >= MOST_IMAGES || self.products >= self.most {
            return None;
        }
        let place = self.met(place)?;
        let sample = self.map.sample;
        let (state, parameters) = place.offsets.split_at(sample.coordinates());
        let depths = sample.depths_at(state, parameters);
        let on_verge = self.map.bands(&depths).contains(&Band::Verge);
        let depth = depths.into_iter().fold(f64::NEG_INFINITY, f64::max);
        let point = SamplePoint { state: state.to_vec(), parameters: parameters.to_vec(), depth };
        if !sample.holds(&point) {
            return None;
        }
        let errors = self.errors_at(&point, self.rounded)?;
        self.note(&point, &errors, on_verge);
        Some((errors[coordinate], place))
    }

    /// Errors at a point, by an image in double precision or in double-double; `None` if there is
    /// no image.
    fn errors_at(&mut self, point: &SamplePoint, rounded: bool) -> Option<Vec<f64>> {
        let offsets = point.state.iter().chain(&point.parameters);
        let bits: Vec<u64> = offsets.map(|offset| offset.to_bits()).collect();
        if let Some(known) = self.known.get(&(rounded, bits.clone())) {
            return known.clone();
        }
        let image = match rounded {
            true => self.returns.rounded_image(point),
            false => self.returns.image(point).map(|(image, products)| (image.known(), products)),
        };
        let (image, products) = image.unwrap_or((None, 0));
        self.images += 1;
        self.products += products;
        let errors = image.map(|image| errors(self.map.run, point, &image));
        self.known.insert((rounded, bits), errors.clone());
        errors
    }

    /// Records the errors at a point if they are the largest.
    fn note(&mut self, point: &SamplePoint, errors: &[f64], on_verge: bool) {
        for (coordinate, summits) in self.summits.iter_mut().enumerate() {
            let places = if on_verge { 1 } else { 2 };
            for summit in &mut summits[..places] {
                let known = summit.as_ref().map_or(f64::NEG_INFINITY, |s| s.errors[coordinate]);
                let found = errors[coordinate];
                if found.is_nan() && !known.is_nan() || found > known {
                    *summit = Some(Summit { point: point.clone(), errors: errors.to_vec() });
                }
            }
        }
    }

    /// Whether the error at the summit of a coordinate is confirmed in double-double.
    fn confirms(&mut self, coordinate: usize) -> bool {
        let Some(summit) = self.summits[coordinate][0].clone().filter(|_| self.rounded) else {
            return true;
        };
        let exact = self.errors_at(&summit.point, false);
        let seen = summit.errors[coordinate];
        exact.is_some_and(|exact| (exact[coordinate] - seen).abs() <= CONFIRMED * seen)
    }

    /// Adds the errors at the summits.
    fn add_summits(&mut self, largest: &mut Largest) {
        for summits in std::mem::take(&mut self.summits) {
            for (summit, on_verge) in summits.into_iter().zip([true, false]) {
                let Some(Summit { point, errors }) = summit else { continue };
                let exact = match self.rounded {
                    true => self.errors_at(&point, false),
                    false => Some(errors),
                };
                exact.iter().for_each(|errors| largest.add(errors, on_verge));
            }
        }
    }

    /// The place brought to the held depth; another variable is solved for if the first one would
    /// leave its half-width.
    fn met(&self, mut place: Place) -> Option<Place> {
        let Some(held) = place.held else { return Some(place) };
        let sample = self.map.sample;
        let solved = |place: &mut Place, variable: usize| {
            let from = place.offsets[variable];
            let met = sample.solved(held.passage, variable, &mut place.offsets, held.depth);
            if met.is_none() {
                place.offsets[variable] = from;
            }
            met.is_some()
        };
        if solved(&mut place, held.variable) {
            return Some(place);
        }
        let other = |&variable: &usize| variable != held.variable;
        for variable in sample.by_reach(held.passage).into_iter().filter(other) {
            if solved(&mut place, variable) {
                place.held = Some(Held { variable, ..held });
                return Some(place);
            }
        }
        None
    }
}
