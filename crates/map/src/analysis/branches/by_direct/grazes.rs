//! Grazes on branches of direct simulation.
//!
//! The graze of a passage that has a variable is a border of the unknowns and is reached exactly;
//! that of any other passage lies just ahead of the end of a branch. A contact of another stop
//! begins and ends between two orbits of a branch, or ends the branch: at a rigid stop orbits with
//! the contact vary as the root of the depth. Such a graze is found from the side without the
//! contact, on which orbits are smooth.

use nalgebra::DVector;

use super::{AT_GRAZE, DirectBranches, DirectPoint, DirectTrace, in_points_of};
use crate::analysis::branches::data::{Branch, BranchEnd, BranchLabel, BranchPoint, Special};
use crate::analysis::branches::trace::{exact_or_zero, toggled};
use crate::analysis::periodic::{
    ContactItinerary, DirectOrbit, DirectOrbitEquations, FoundOrbit, OrbitContact,
};
use crate::continuation::{
    ContinuationPoint, Linearised, apart, by_chords, corrected, dot, moved, tangent_at, unit_vector,
};
use crate::numeric::{Dd, converted, last_that_holds};

/// Speed below which a contact grazes, relative to its largest speed along the branch.
const SLOW: f64 = 1e-3;
/// Ratio of the speeds of successive orbits towards the graze of a later passage, and most orbits.
const SLOWER: f64 = 1e-2;
const GRAZE_STEPS: usize = 3;
/// Bisection steps towards a graze that belongs to no passage.
const HALVINGS: usize = 45;
/// Largest distance of a graze from its refinement in double-double: a contact may be too weak for
/// double precision.
const FAR_AT_GRAZE: f64 = 1e-2;
/// Distance along a branch, in units, within which its end grazes.
const AHEAD: f64 = 1e-4;
/// Largest distance, in units, of the last orbit with a contact from the graze at which it ends.
const FAR_FROM_END: f64 = 1e-3;

/// Speed of a contact, and the orbit that makes it, in double-double.
type FinePoint = (Dd, ContinuationPoint<Dd, DirectOrbit<Dd>>);
/// Unknowns of an orbit, the orbit, and its residuals.
type FlownOrbit = (Vec<f64>, DirectOrbit<f64>, DVector<f64>);

impl<'a> DirectBranches<'a> {
    /// Passages with zero speed or gap at the end of a branch.
    pub(super) fn grazing(
        &self,
        equations: &DirectOrbitEquations<'a, f64>,
        point: &DirectPoint,
    ) -> Vec<usize> {
        let unknowns = point.unknowns.iter().enumerate();
        let touching = unknowns.filter(|(_, value)| value.abs() <= AT_GRAZE);
        touching.filter_map(|(unknown, _)| equations.passage_of(unknown)).collect()
    }

    /// Graze between two points of a branch at which a contact outside the passages begins or ends,
    /// by bisection.
    pub(super) fn graze_between(
        &self,
        itinerary: &ContactItinerary,
        points: [&DirectPoint; 2],
    ) -> Option<BranchPoint> {
        let [from, to] = points.map(|point| &point.linearised.extra);
        if has_same_contacts(from, to) {
            return None;
        }
        let mut equations = self.equations_with(itinerary, &points[0].linearised.extra);
        let found = self.graze_on_chord(&mut equations, points);
        let found = found.unwrap_or_else(|| graze_on_tangent(&mut equations, points));
        let surface = self.surface_between(from, to);
        Some(self.at_graze(&equations, points[0], found, Special { surface, ..graze() }))
    }

    /// Graze just ahead of an end of a branch, of a stop without a passage or of a passage without
    /// a variable: orbits ahead make one contact more there.
    pub(super) fn graze_ahead(
        &self,
        itinerary: &ContactItinerary,
        end: &DirectPoint,
    ) -> Option<BranchPoint> {
        let mut equations = self.equations_with(itinerary, &end.linearised.extra);
        // The tangent points in the direction in which the branch was followed.
        let outward = &end.tangent;
        let last = last_with_its_contacts(&mut equations, end, AHEAD, outward);
        let beyond = moved(&last.0, outward, AHEAD);
        if let Some((ahead, _)) = equations.flown_orbit(&beyond) {
            let more =
                ahead.extra_contacts > last.1.extra_contacts && !has_same_contacts(&ahead, &last.1);
            let surface = self.surface_between(&last.1, &ahead);
            let special = Special { surface, ..graze() };
            return more.then(|| self.at_graze(&equations, end, last, special));
        }
        let points = equations.points();
        let begins = |&[number, passage]: &[usize; 2]| {
            let with = self.equations(&toggled(itinerary, number, passage)).in_points(points);
            with.is_some_and(|mut with| with.flown_orbit(&beyond).is_some())
        };
        let begun = passages_without_variable(&equations)
            .filter(|&[number, passage]| !itinerary.returns()[number].contains(passage))
            .find(begins)?;
        Some(self.at_graze(&equations, end, last, Special { grazing: vec![begun], ..graze() }))
    }

    /// Name of the surface that one of two orbits hits more often than the other.
    fn surface_between(&self, a: &DirectOrbit<f64>, b: &DirectOrbit<f64>) -> Option<String> {
        let mut pairs = a.hits.iter().zip(&b.hits);
        let place = pairs.position(|(a, b)| a != b)?;
        Some(self.scene.model.surfaces[place].name.clone())
    }

    /// Ends branches at a graze where the branch without the contact ends at it.
    ///
    /// NOTE: with the contact, orbits vary as the root of its depth, and the last one is not at the
    /// graze.
    pub(super) fn end_at_grazes(&self, branches: &mut [Branch]) {
        let is_graze = |point: &&BranchPoint| {
            let special = point.special.as_ref();
            special.is_some_and(|at| at.label == BranchLabel::Graze && at.grazing.is_empty())
        };
        let ends = branches.iter().flat_map(|branch| [branch.points.first(), branch.points.last()]);
        let grazes: Vec<BranchPoint> = ends.flatten().filter(is_graze).cloned().collect();
        let (along, unit) = (self.request.along, self.units.parameters[0]);
        let apart = |graze: &BranchPoint, last: &FoundOrbit| {
            let FoundOrbit { parameters, states, .. } = &graze.orbit;
            let pairs = states.iter().zip(&last.states);
            let apart = pairs.map(|(a, b)| self.image.circle().apart(a, b, &self.units.state));
            let ahead = (parameters[along] - last.parameters[along]).abs() / unit;
            apart.fold(ahead, f64::max)
        };
        for branch in branches {
            for side in 0..2 {
                if branch.ends[side] != BranchEnd::StepTooSmall {
                    continue;
                }
                let place = if side == 0 { 0 } else { branch.points.len() - 1 };
                let last = &branch.points[place].orbit;
                let is_without = |graze: &&BranchPoint| {
                    graze.orbit.itinerary == last.itinerary
                        && graze.orbit.extra_contacts < last.extra_contacts
                };
                let distances = grazes.iter().filter(is_without).map(|at| (apart(at, last), at));
                let nearest = distances.min_by(|a, b| a.0.total_cmp(&b.0));
                let Some((_, graze)) = nearest.filter(|(distance, _)| *distance < FAR_FROM_END)
                else {
                    continue;
                };
                branch.ends[side] = BranchEnd::Graze;
                let place = if side == 0 { 0 } else { branch.points.len() };
                branch.points.insert(place, graze.clone());
            }
        }
    }

    /// Point of a branch at the graze of passages, or of a stop that has none.
    fn at_graze(
        &self,
        equations: &DirectOrbitEquations<'a, f64>,
        near: &DirectPoint,
        (unknowns, extra, residual): FlownOrbit,
        special: Special,
    ) -> BranchPoint {
        let tangent = vec![0.0; unknowns.len()];
        let linearised = Linearised { residual, extra, ..near.linearised.clone() };
        let point = DirectPoint { unknowns, tangent, linearised, tests: Vec::new() };
        let orbit = self.found(equations, &point, true);
        BranchPoint { orbit, special: Some(special) }
    }

    /// Orbit at such a graze, where orbits depend smoothly enough on the contact, as at a compliant
    /// stop.
    fn graze_on_chord(
        &self,
        equations: &mut DirectOrbitEquations<'a, f64>,
        [from, to]: [&DirectPoint; 2],
    ) -> Option<FlownOrbit> {
        let chord = moved(&to.unknowns, &from.unknowns, -1.0);
        let (mut shares, mut found) = ([0.0, 1.0], None);
        for _ in 0..HALVINGS {
            let middle = 0.5 * (shares[0] + shares[1]);
            let start = moved(&from.unknowns, &chord, middle);
            // Derivatives by differences would mix both sides of the graze; those of the first
            // point are used throughout.
            let there = by_chords(&from.linearised.jacobian, &chord, start, |unknowns| {
                equations.flown_orbit(unknowns)
            })?;
            let same = has_same_contacts(&there.1, &from.linearised.extra);
            shares[usize::from(!same)] = middle;
            found = Some(there);
        }
        found
    }

    /// Refines a grazing orbit to the rounding of double-double, with speed or gap zero held at the
    /// grazing passages; also returns the derivative of the parameter by the speed of the contact
    /// that begins, if there is exactly one.
    pub(super) fn refined_graze(
        &self,
        itinerary: &ContactItinerary,
        point: &DirectPoint,
    ) -> Option<(FoundOrbit, Option<f64>)> {
        let fine = self.equations_of(&self.fine, itinerary);
        let mut fine = in_points_of(fine, &point.linearised.extra);
        let own = |unknown: usize| fine.passage_of(unknown).is_some();
        let grazes = |&unknown: &usize| own(unknown) && point.unknowns[unknown].abs() <= AT_GRAZE;
        let grazing: Vec<usize> = (0..point.unknowns.len()).filter(grazes).collect();
        let at = point.unknowns.iter().enumerate().map(|(unknown, &value)| {
            if grazing.contains(&unknown) { Dd::ZERO } else { Dd::from(value) }
        });
        let at: Vec<Dd> = at.collect();
        let normal = unit_vector(at.len(), *grazing.first()?);
        let (unknowns, linearised) = corrected(&mut fine, &at, &at, &normal)?;
        let slope = self.slope(&mut fine, &unknowns, &linearised, &grazing);
        let near = apart(&converted(&unknowns), &point.unknowns) < FAR_AT_GRAZE;
        let found = ContinuationPoint { unknowns, tangent: at, linearised, tests: Vec::new() };
        near.then(|| (self.found(&fine, &found, true), slope))
    }

    /// Graze of a passage without a variable at an end of a branch, where a contact becomes slow:
    /// orbits of the branch in double-double at ever smaller speeds of that contact, and the line
    /// through the last two of them, extended to the speed zero.
    ///
    /// NOTE: in double precision a contact as deep as its rounding is lost, while its speed is
    /// still the square root of that depth, and the parameter is proportional to the speed.
    pub(super) fn extrapolated_graze(
        &self,
        itinerary: &ContactItinerary,
        (trace, end): (&DirectTrace, usize),
        contact: [usize; 2],
    ) -> Option<FoundOrbit> {
        let orbit = |place: usize| &trace.points[place].linearised.extra;
        let mut fine = in_points_of(self.equations_of(&self.fine, itinerary), orbit(end));
        let mut solved = |place: usize| {
            fine.seek_near(orbit(place));
            self.fine_point(&mut fine, converted(&trace.points[place].unknowns), contact)
        };
        // The last orbits may be rounding; then others are taken, of ever larger speeds.
        let count = trace.points.len();
        let inward = (0..count).map(|number| if end == 0 { number } else { count - 1 - number });
        let mut starts: Vec<FinePoint> = Vec::new();
        let mut least = 0.0;
        for place in inward {
            let speed = orbit(place).speed_of(contact).filter(|speed| *speed >= least);
            let Some(speed) = speed else { continue };
            least = 2.0 * speed;
            match solved(place) {
                Some(start) if starts.first().is_none_or(|near| near.0 < start.0) => {
                    starts.push(start);
                }
                _ => starts.clear(),
            }
            if starts.len() == 2 {
                break;
            }
        }
        let [mut near, mut far] = <[FinePoint; 2]>::try_from(starts).ok()?;
        let along_line = |far: &FinePoint, near: &FinePoint, speed: Dd| {
            let share = (near.0 - speed) / (far.0 - near.0);
            let pairs = near.1.unknowns.iter().zip(&far.1.unknowns);
            pairs.map(|(&near, &far)| near + (near - far) * share).collect::<Vec<Dd>>()
        };
        for _ in 0..GRAZE_STEPS {
            let speed = near.0 * Dd::from(SLOWER);
            match self.fine_point(&mut fine, along_line(&far, &near, speed), contact) {
                Some(next) if next.0 < near.0 => far = std::mem::replace(&mut near, next),
                _ => break,
            }
        }
        let parameters = fine.parameters(&along_line(&far, &near, Dd::ZERO));
        let orbit = self.found(&fine, &near.1, true);
        Some(FoundOrbit {
            parameters: parameters.iter().map(|value| value.to_f64()).collect(),
            ..orbit
        })
    }

    /// Orbit at a value of the parameter in double-double, with the speed of a contact.
    fn fine_point(
        &self,
        fine: &mut DirectOrbitEquations<'a, Dd>,
        guess: Vec<Dd>,
        contact: [usize; 2],
    ) -> Option<FinePoint> {
        let normal = unit_vector(guess.len(), guess.len() - 1);
        let (unknowns, linearised) = corrected(fine, &guess, &guess, &normal)?;
        let speed = linearised.extra.speed_of(contact).filter(|speed| *speed > Dd::ZERO)?;
        let point = ContinuationPoint { unknowns, tangent: guess, linearised, tests: Vec::new() };
        Some((speed, point))
    }

    /// Derivative of the parameter by the speed of the contact that begins at a graze; `None`
    /// unless there is exactly one.
    fn slope(
        &self,
        fine: &mut DirectOrbitEquations<'a, Dd>,
        unknowns: &[Dd],
        linearised: &Linearised<Dd, DirectOrbit<Dd>>,
        grazing: &[usize],
    ) -> Option<f64> {
        let mut begins = grazing.iter().filter(|&&unknown| fine.begins_with_contact_at(unknown));
        let (Some(&unknown), None) = (begins.next(), begins.next()) else { return None };
        let by_variable = fine.speed_by_variable(unknowns, unknown)?;
        let tangent = tangent_at(&linearised.jacobian, &unit_vector(unknowns.len(), unknown))?;
        let parameter = exact_or_zero(tangent.last()?.to_f64()) * self.units.parameters[0];
        let slope = parameter / (tangent[unknown] * by_variable).to_f64();
        slope.is_finite().then_some(slope)
    }
}

fn graze() -> Special {
    Special::new(BranchLabel::Graze)
}

/// Orbit at the graze between two points of a branch that belongs to no passage, from the side
/// without the contact, on which orbits are smooth.
fn graze_on_tangent(
    equations: &mut DirectOrbitEquations<'_, f64>,
    points: [&DirectPoint; 2],
) -> FlownOrbit {
    let contacts = |point: &DirectPoint| point.linearised.extra.extra_contacts;
    let [from, to] = match contacts(points[0]) < contacts(points[1]) {
        true => points,
        false => [points[1], points[0]],
    };
    let chord = moved(&to.unknowns, &from.unknowns, -1.0);
    let ahead = dot(&chord, &chord) / dot(&from.tangent, &chord);
    last_with_its_contacts(equations, from, ahead, &chord)
}

/// Whether two orbits of a branch make the same contacts. Those that the nominal orbit names are
/// told by their time, which may pass from one to another while the orbit makes as many; and a
/// rest is one of these whatever the number of its rebounds.
fn has_same_contacts<S>(a: &DirectOrbit<S>, b: &DirectOrbit<S>) -> bool {
    a.extra_contacts == b.extra_contacts || a.hits == b.hits
}

/// Last orbit that makes the contacts of `from`, which may be `from` itself, at most `ahead` along
/// its tangent, on a plane with the normal `normal`.
fn last_with_its_contacts(
    equations: &mut DirectOrbitEquations<'_, f64>,
    from: &DirectPoint,
    ahead: f64,
    normal: &[f64],
) -> FlownOrbit {
    let Linearised { residual, extra: contacts, .. } = &from.linearised;
    let mut last = (from.unknowns.clone(), contacts.clone(), residual.clone());
    last_that_holds(0.0, 1.0, HALVINGS, |share| {
        let start = moved(&from.unknowns, &from.tangent, share * ahead);
        let there = corrected(equations, &start, &start, normal);
        let there = there.filter(|(_, there)| has_same_contacts(&there.extra, contacts));
        let holds = there.is_some();
        if let Some((unknowns, there)) = there {
            last = (unknowns, there.extra, there.residual);
        }
        holds
    });
    last
}

/// Returns and passages whose graze is no border of the unknowns: those after the section's own,
/// and where points have no variables of passages, all.
fn passages_without_variable(
    equations: &DirectOrbitEquations<'_, f64>,
) -> impl Iterator<Item = [usize; 2]> + use<> {
    let itinerary = equations.itinerary();
    let first = usize::from(equations.replaced().is_some());
    let (returns, passages) = (itinerary.period(), itinerary.passages());
    (0..returns).flat_map(move |number| (first..passages).map(move |passage| [number, passage]))
}

/// Return and passage of a contact with nearly zero speed of the orbit at the end of a branch,
/// whose graze is no border of the unknowns.
pub(super) fn slow_contact(
    equations: &DirectOrbitEquations<'_, f64>,
    points: &[BranchPoint],
    end: usize,
) -> Option<[usize; 2]> {
    passages_without_variable(equations).find(|&[number, passage]| {
        let speed = |point: &BranchPoint| {
            let mut contacts = point.orbit.contacts.iter();
            let own =
                |contact: &&OrbitContact| (contact.number, contact.passage) == (number, passage);
            contacts.find(own).map(|contact| contact.speed.abs())
        };
        let fastest = points.iter().filter_map(speed).fold(0.0, f64::max);
        speed(&points[end]).is_some_and(|last| last <= SLOW * fastest)
    })
}
