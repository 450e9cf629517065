//! A flown contact as numbers: the polynomials of the free flow about it, and its linear law.

use serde::{Deserialize, Serialize};

use super::arithmetic::Arithmetic;
use crate::jet::Jet;
use crate::numeric::{Real, Scalar};

/// A grazing passage whose contact is flown exactly:
///
/// ```text
/// y = √max(0, depth(x, p)),   entry at s_e = −y σ from the minimum of the gap,
/// z' = A z + g(s),            release where ρ(s) + r·z = 0,
/// x ↦ x + section(back(s, z; x, p); x, p)
/// ```
///
/// with the free flow's gap, force `g` and release function `ρ` as series in the time `s` from the
/// minimum. It is the identity, exactly, where `y = 0`.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct FlownContact<S: Scalar = f64> {
    /// `−h_min`, a polynomial in (coordinates; parameters) without constant term.
    pub depth: Jet<S>,
    /// `H_2, H_3, …` of the gap `h = −y² + Σ H_k s^k`.
    pub(super) gap: Vec<Jet<S>>,
    /// `σ` to low weight, in `(y; coordinates; parameters)`: where its Newton steps begin.
    pub(super) entry: Jet<S>,
    /// The contact's linear law.
    pub(super) law: LinearLaw<S>,
    /// What the contact has added at the time of the minimum, in `(s; z)` or `(s; z; coordinates;
    /// parameters)`.
    pub(super) back: Vec<Jet<S>>,
    /// Correction of each coordinate, in (what was added; coordinates; parameters).
    pub(super) section: Vec<Jet<S>>,
    /// The contact time over `y`, nearly.
    pub(super) contact_time: ContactTime<S>,
    /// How many steps are flown.
    pub(super) plan: FlightPlan,
    /// Largest correction of each coordinate over the window, for bounds.
    pub(super) largest: Vec<f64>,
}

/// `z' = A z + g`, released where `ρ + r·z = 0`, with `ρ + r·z` rising there.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub(super) struct LinearLaw<S: Scalar> {
    pub(super) matrix: Vec<Vec<S>>,
    /// The components with a force, and the forces along the free flow.
    pub(super) forces: Vec<(usize, Drive<S>)>,
    pub(super) release_row: Vec<S>,
    /// The release function along the free flow.
    pub(super) release: Drive<S>,
}

/// A function along the free flow: a combination of 1, the gap and its rate, and a series for the
/// rest.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub(super) struct Drive<S: Scalar> {
    pub(super) constant: S,
    pub(super) gap: S,
    pub(super) gap_rate: S,
    /// Coefficients of the rest in the time from the minimum; empty where the combination says
    /// all.
    pub(super) rest: Vec<Jet<S>>,
}

/// `κ(y) = P(y)/Q(y)`, positive; lowest power first.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub(super) struct ContactTime<S> {
    pub(super) numerator: Vec<S>,
    pub(super) denominator: Vec<S>,
}

/// The fixed numbers of steps with which every contact is flown.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct FlightPlan {
    /// Newton steps for the entry.
    pub entry: usize,
    /// Taylor steps along the contact.
    pub steps: usize,
    /// Powers of time in each.
    pub order: usize,
    /// Newton steps for the release.
    pub release: usize,
}

impl<S: Scalar> FlownContact<S> {
    /// Number of coordinates.
    pub fn dimension(&self) -> usize {
        self.section.len()
    }

    /// Steps flown.
    pub fn plan(&self) -> FlightPlan {
        self.plan
    }

    /// Largest correction of each coordinate that was met on the window.
    pub fn largest_corrections(&self) -> &[f64] {
        &self.largest
    }

    /// The image of a point (coordinates; parameters) by a contact of depth variable `y`, whatever
    /// the depth there.
    pub fn act_at<A: Arithmetic<Scalar = S>>(
        &self,
        arithmetic: &mut A,
        y: &A::Value,
        point: &[A::Value],
    ) -> Vec<A::Value> {
        let corrections = self.corrections(arithmetic, y, point);
        let pairs = corrections.iter().zip(point);
        let image = pairs.map(|(correction, start)| arithmetic.add(correction, start));
        image.collect()
    }

    /// Every polynomial of the passage.
    pub fn polynomials(&self) -> impl Iterator<Item = &Jet<S>> {
        let drives = self.law.forces.iter().map(|(_, force)| force);
        let rests = drives.chain([&self.law.release]).flat_map(|d| &d.rest);
        let rest = self.gap.iter().chain(&self.back).chain(&self.section);
        [&self.depth, &self.entry]
            .into_iter()
            .chain(rests)
            .chain(rest)
    }
}

impl FlownContact {
    /// Whether its parts have the sizes of a map in so many coordinates and parameters.
    pub fn fits(&self, coordinates: usize, parameters: usize) -> bool {
        let (plain, moved) = (coordinates + parameters, self.law.matrix.len());
        let in_space = |jets: &[Jet<f64>], allowed: &[usize]| {
            let mut spaces = jets.iter().map(|jet| jet.space().variables());
            spaces.all(|found| allowed.contains(&found))
        };
        let drives = self.law.forces.iter().map(|(_, force)| force);
        let mut drives = drives.chain([&self.law.release]);
        let one = std::slice::from_ref;
        in_space(one(&self.depth), &[plain])
            && in_space(one(&self.entry), &[plain + 1])
            && in_space(&self.gap, &[plain])
            && in_space(&self.back, &[1 + moved, 1 + moved + plain])
            && in_space(&self.section, &[self.back.len() + plain])
            && drives.all(|drive| in_space(&drive.rest, &[plain]))
            && self.law.matrix.iter().all(|row| row.len() == moved)
            && self.law.forces.iter().all(|&(place, _)| place < moved)
            && self.law.release_row.len() == moved
            && [self.section.len(), self.largest.len()] == [coordinates; 2]
            && !(self.contact_time.numerator.is_empty() || self.contact_time.denominator.is_empty())
    }
}

impl<S: Scalar> LinearLaw<S> {
    /// The same law with its release function turned over.
    pub(super) fn turned(self) -> Self {
        let release = self.release;
        Self {
            release_row: self.release_row.into_iter().map(|value| -value).collect(),
            release: Drive {
                constant: -release.constant,
                gap: -release.gap,
                gap_rate: -release.gap_rate,
                rest: release.rest.iter().map(|jet| -jet).collect(),
            },
            ..self
        }
    }
}

impl<S: Real> FlownContact<S> {
    /// The same with its numbers as another type.
    pub fn map_scalars<T: Real>(&self, convert: impl Fn(S) -> T + Copy) -> FlownContact<T> {
        let jets = |jets: &[Jet<S>]| jets.iter().map(|jet| jet.map_scalars(convert)).collect();
        let numbers = |numbers: &[S]| numbers.iter().copied().map(convert).collect();
        let drive = |drive: &Drive<S>| Drive {
            constant: convert(drive.constant),
            gap: convert(drive.gap),
            gap_rate: convert(drive.gap_rate),
            rest: jets(&drive.rest),
        };
        let forces = self.law.forces.iter();
        FlownContact {
            depth: self.depth.map_scalars(convert),
            gap: jets(&self.gap),
            entry: self.entry.map_scalars(convert),
            law: LinearLaw {
                matrix: self.law.matrix.iter().map(|row| numbers(row)).collect(),
                forces: forces.map(|(i, force)| (*i, drive(force))).collect(),
                release_row: numbers(&self.law.release_row),
                release: drive(&self.law.release),
            },
            back: jets(&self.back),
            section: jets(&self.section),
            contact_time: ContactTime {
                numerator: numbers(&self.contact_time.numerator),
                denominator: numbers(&self.contact_time.denominator),
            },
            plan: self.plan,
            largest: self.largest.clone(),
        }
    }

    /// Whether every coefficient is finite.
    pub fn is_finite(&self) -> bool {
        let law = self
            .law
            .matrix
            .iter()
            .flatten()
            .chain(&self.law.release_row);
        let time = &self.contact_time;
        let numbers = law.chain(&time.numerator).chain(&time.denominator);
        self.polynomials().all(Jet::is_finite) && numbers.copied().all(Scalar::is_finite)
    }
}
