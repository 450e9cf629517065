//! The flight through a contact with powers of the penetration, degree by degree of its jets.
//!
//! In the time `t = y T u`, `u` from 0 to 1, the penetration is `y² u H` beside the entry and
//! `y² v H`, `v = 1 − u`, beside a release at the surface, with `H > 0`. A power is then
//! `d^β = y^{2β} u^β H^β`. With a formal variable for `y^{2β}` and another for `y^{2β} u^β` every
//! coefficient of the jets is analytic in `u`, and known at the nodes of a quadrature. An integral
//! over the time has a factor `y`, so that the part of one degree of every jet follows from lower
//! ones.

use std::sync::Arc;

use nalgebra::{DMatrix, DVector};

use super::law::{Output, PowerLaw};
use super::quadrature::{Integrals, Nodes};
use crate::expansion::approach::{Approach, DepthVariable};
use crate::expansion::error::{ContactLawError, ExpansionError, PowerProblem};
use crate::expansion::routes::Graze;
use crate::expansion::variables::shift_depth_power;
use crate::flow::evaluate;
use crate::jet::elementary::{power_part, product_part, quotient_part};
use crate::jet::{Jet, JetSpace};
use crate::numeric::{Dd, Real, Scalar};

/// Weight at which the release is told.
const RELEASE_WEIGHT: u32 = 4;
/// Share of the largest coefficient below which one counts as zero, in double-double.
const VANISHING: f64 = 1e-22;
/// Share of a whole contact's time beyond which an early release is too near to the surface.
const LATEST: f64 = 0.9;
/// Largest number of nodes.
const MOST_NODES: usize = 120;

/// A contact with powers of the penetration, and how it ends.
#[derive(Clone, Debug)]
pub(in crate::expansion) struct PowerFlight<'a> {
    law: &'a PowerLaw,
    /// Share of the time to the surface at which the contact ends, at the grazing point; `None` for
    /// a release at the surface.
    early: Option<f64>,
}

impl<'a> PowerFlight<'a> {
    /// Tells how the contact ends near the graze.
    ///
    /// # Errors
    ///
    /// [`ContactLawError`] if the contact does not push back, has no release near the graze, or
    /// has powers whose corrections are not whole powers of `y`.
    pub(in crate::expansion) fn new(
        graze: &Graze,
        law: &'a PowerLaw,
    ) -> Result<Self, ExpansionError> {
        let surface = || graze.passage.surface.clone();
        let refused = |exponent: Dd, problem| {
            let (surface, exponent) = (surface(), exponent.to_f64());
            ExpansionError::from(ContactLawError::Power { surface, exponent, problem })
        };
        if let Some(&exponent) = law.exponents.iter().find(|&&beta| whole_power(beta).is_none()) {
            return Err(refused(exponent, PowerProblem::NotHalfWhole));
        }
        let kind = DepthVariable::Replacing;
        let approach = Approach::<Dd>::new(graze, RELEASE_WEIGHT, kind)?;
        let entry = approach.entry()?;
        let parameters = graze.passage.parameter_jets(&approach.space, approach.first_parameter);
        let powers = law.exponents.iter().map(|_| Jet::zero(&approach.space));
        let inputs: Vec<_> = entry.state.into_iter().chain(parameters).chain(powers).collect();
        let values = evaluate(&law.program, &approach.space, &inputs);
        let value = |output: Output| &values[law.dimension + output as usize];
        let contact_acceleration = value(Output::Acceleration).head().to_f64();
        let free_acceleration = 2.0 * approach.gap[2].head().to_f64();
        if contact_acceleration <= 0.0 {
            let surface = surface();
            let pressed =
                ContactLawError::Acceleration { surface, contact_acceleration, free_acceleration };
            return Err(pressed.into());
        }
        let (release, rate) = (value(Output::Release), value(Output::ReleaseRate));
        let size = rate.max_abs().max(values.iter().fold(0.0, |size, jet| size.max(jet.max_abs())));
        if release.max_abs() <= VANISHING * size {
            return Ok(Self { law, early: None });
        }
        let speed = -shift_depth_power(value(Output::Velocity), -1).head().to_f64();
        let whole = 2.0 * speed / contact_acceleration;
        let time = -shift_depth_power(release, -1).head().to_f64() / rate.head().to_f64();
        let share = time / whole;
        let at_the_graze = release.head().magnitude() > VANISHING * size;
        if at_the_graze || !(share > 0.0 && share < LATEST) {
            let release = release.head().to_f64();
            let none =
                ContactLawError::NoRelease { surface: surface(), release, contact_acceleration };
            return Err(none.into());
        }
        let root = law.exponents.iter().find(|&&beta| whole_power(beta) == Some(1));
        match root {
            Some(&exponent) => Err(refused(exponent, PowerProblem::EarlyRoot)),
            None => Ok(Self { law, early: Some(share) }),
        }
    }

    /// Flies from the entry to the release; returns the state there and the contact time.
    ///
    /// # Errors
    ///
    /// [`ExpansionError::Jet`] if the space of the flight would be too large.
    pub(in crate::expansion) fn exit<S: Real>(
        &self,
        entry: &[Jet<S>],
        parameters: &[Jet<S>],
    ) -> Result<(Vec<Jet<S>>, Jet<S>), ExpansionError> {
        let spaces = PowerSpace::new(entry[0].space(), &self.law.exponents)?;
        let flown = Flown::new(self, &spaces, entry, parameters)?.run();
        let state = flown.exit.iter().map(|jet| spaces.lowered(jet)).collect();
        let time = spaces.lowered(&flown.time);
        Ok((state, shift_depth_power(&time, 1)))
    }
}

/// Power of `y` in `d^β`, if it is whole.
fn whole_power(exponent: Dd) -> Option<u8> {
    let power = exponent + exponent;
    let whole = power.lo == 0.0 && power.hi.fract() == 0.0 && (1.0..=64.0).contains(&power.hi);
    whole.then_some(power.hi as u8)
}

/// One class of powers `d^β` in the space of a flight.
struct Class {
    /// Exponent `β`.
    exponent: Dd,
    /// Factor `y` of the power that is written out: 1, or 0 where `2β ≤ 1`.
    written: u8,
    /// Power of `y` for which the formal variable stands.
    power: u8,
}

/// Space of a flight: that of the entry, a formal variable per class that is constant in time, and
/// one per class with the factor `u^β`.
struct PowerSpace {
    near: Arc<JetSpace>,
    space: Arc<JetSpace>,
    classes: Vec<Class>,
    /// Powers of the variables with `u^β`, of which each monomial has one kind.
    kinds: Vec<Vec<u8>>,
    /// Kind of each monomial.
    kind_of: Vec<usize>,
    /// Monomial with the constant variables in place of those with `u^β`.
    collapsed: Vec<usize>,
    /// Monomial times `y`, if the space keeps it.
    times_y: Vec<Option<usize>>,
    /// Monomial times the written factor and the variable with `u^β`, by class.
    times_power: Vec<Vec<Option<usize>>>,
}

impl PowerSpace {
    fn new(near: &Arc<JetSpace>, exponents: &[Dd]) -> Result<Self, ExpansionError> {
        let classes: Vec<Class> = exponents
            .iter()
            .map(|&exponent| {
                let whole = whole_power(exponent).unwrap_or(1);
                let written = u8::from(whole > 1);
                Class { exponent, written, power: whole - written }
            })
            .collect();
        let formal = classes.iter().map(|class| u32::from(class.power));
        let weights: Vec<u32> =
            near.weights().iter().copied().chain(formal.clone()).chain(formal).collect();
        let space = JetSpace::new(&weights, near.order())?;
        let (own, count) = (near.variables(), classes.len());
        let mut kinds: Vec<Vec<u8>> = Vec::new();
        let (mut kind_of, mut collapsed, mut times_y) = (Vec::new(), Vec::new(), Vec::new());
        let mut times_power = vec![Vec::new(); count];
        for monomial in 0..space.len() {
            let exponents = space.exponents(monomial);
            let moving = exponents[own + count..].to_vec();
            let known = kinds.iter().position(|kind| *kind == moving);
            kind_of.push(known.unwrap_or_else(|| {
                kinds.push(moving.clone());
                kinds.len() - 1
            }));
            let raised = |change: &dyn Fn(&mut [u8])| {
                let mut target = exponents.to_vec();
                change(&mut target);
                space.monomial(&target)
            };
            let still = raised(&|target| {
                for (class, power) in moving.iter().enumerate() {
                    target[own + class] += power;
                    target[own + count + class] = 0;
                }
            });
            collapsed.push(still.unwrap_or(monomial));
            times_y.push(raised(&|target| target[0] += 1));
            for (number, class) in classes.iter().enumerate() {
                times_power[number].push(raised(&|target| {
                    target[0] += class.written;
                    target[own + count + number] += 1;
                }));
            }
        }
        let near = Arc::clone(near);
        Ok(Self { near, space, classes, kinds, kind_of, collapsed, times_y, times_power })
    }

    /// A jet of the entry in the space of the flight.
    fn raised<S: Real>(&self, jet: &Jet<S>) -> Jet<S> {
        let same: Vec<_> = (0..self.near.variables()).map(Some).collect();
        jet.reinterpret(&self.space, &same)
    }

    /// A jet without time in the space of the entry: each formal variable is the power of `y` for
    /// which it stands.
    fn lowered<S: Real>(&self, jet: &Jet<S>) -> Jet<S> {
        let mut result = Jet::zero(&self.near);
        let own = self.near.variables();
        let mut target = vec![0; own];
        for (exponents, value) in jet.terms().filter(|(_, value)| *value != S::zero()) {
            target.copy_from_slice(&exponents[..own]);
            let formal = exponents[own..].iter().zip(&self.classes);
            let power: u32 =
                formal.map(|(&count, class)| u32::from(count) * u32::from(class.power)).sum();
            let Ok(power) = u8::try_from(u32::from(target[0]) + power) else { continue };
            target[0] = power;
            if let Some(monomial) = self.near.monomial(&target) {
                result.coefficients_mut()[monomial] += value;
            }
        }
        result
    }
}

/// Half of a contact, or a whole one with an early release: values at nodes in the time from the
/// surface.
struct Side<S: Scalar> {
    /// Whether the time runs back from the release.
    backward: bool,
    nodes: Nodes<S>,
    /// Integrals by kind of monomial.
    integrals: Vec<Integrals<S>>,
    /// One tape of the law's program per node.
    tapes: Vec<Vec<S>>,
    /// `H` at each node and, for an early release, at the end.
    gaps: Vec<Gap<S>>,
}

/// The penetration over `y² u`, `H = T (σ − T A)`, and its powers at one place.
#[derive(Clone)]
struct Gap<S: Scalar> {
    /// `A`, the mean of `h''` with weights `u − u'`.
    mean: Vec<S>,
    /// `σ − T A`.
    slope: Vec<S>,
    value: Vec<S>,
    euler: Vec<S>,
    /// `H^β` by class, and its Euler derivative.
    powers: Vec<[Vec<S>; 2]>,
}

/// Result of a flight in its own space.
struct Released<S: Scalar> {
    exit: Vec<Jet<S>>,
    /// Contact time over `y`.
    time: Jet<S>,
}

/// A flight in progress.
struct Flown<'a, S: Scalar> {
    law: &'a PowerLaw,
    spaces: &'a PowerSpace,
    sides: Vec<Side<S>>,
    entry: Vec<Jet<S>>,
    exit: Vec<Vec<S>>,
    /// Tape of the law's program at the release, for an early one.
    end: Option<Vec<S>>,
    /// `−h'/y` at the entry.
    entry_speed: Jet<S>,
    /// `∫ h'' du`, `∫ (1 − u) h'' du` and the speed at the release over `y`.
    whole: [Vec<S>; 3],
    time: Vec<S>,
    /// Rate of the release function at the grazing point.
    release_rate: S,
    scratch: Vec<S>,
}

impl<'a, S: Real> Flown<'a, S> {
    fn new(
        flight: &PowerFlight<'a>,
        spaces: &'a PowerSpace,
        entry: &[Jet<S>],
        parameters: &[Jet<S>],
    ) -> Result<Self, ExpansionError> {
        let law = flight.law;
        let space = &spaces.space;
        let len = space.len();
        let entry: Vec<_> = entry.iter().map(|jet| spaces.raised(jet)).collect();
        let parameters: Vec<_> = parameters.iter().map(|jet| spaces.raised(jet)).collect();
        let powers = law.exponents.iter().map(|_| Jet::zero(space));
        let inputs: Vec<_> = entry.iter().chain(&parameters).cloned().chain(powers).collect();
        let values = evaluate(&law.program, space, &inputs);
        let value = |output: Output| &values[law.dimension + output as usize];
        let mut tape = vec![S::zero(); law.program.slots() * len];
        for (slot, jet) in parameters.iter().enumerate() {
            let start = (law.dimension + slot) * len;
            tape[start..start + len].copy_from_slice(jet.coefficients());
        }
        for (slot, jet) in entry.iter().enumerate() {
            tape[slot * len] = jet.head();
        }
        let (length, singular, directions) = match flight.early {
            None => (S::from_f64(0.5), 2.0, &[false, true][..]),
            Some(share) => (S::one(), 1.0 / share, &[false][..]),
        };
        let count = nodes_for(singular, S::ROUNDOFF);
        let side = |&backward: &bool| {
            let nodes = Nodes::new(count, length);
            let integrals = spaces.kinds.iter().map(|kind| {
                let terms = kind.iter().zip(&spaces.classes);
                let exponent = terms.fold(Dd::ZERO, |sum, (&power, class)| {
                    sum + Dd::from_f64(f64::from(power)) * class.exponent
                });
                nodes.integrals(S::from_dd(exponent))
            });
            let integrals = integrals.collect::<Result<Vec<_>, _>>();
            let places = count + usize::from(flight.early.is_some());
            Ok(Side {
                backward,
                integrals: integrals?,
                tapes: vec![tape.clone(); count],
                gaps: vec![Gap::new(len, law.exponents.len()); places],
                nodes,
            })
        };
        let sides = directions.iter().map(side).collect::<Result<_, ExpansionError>>()?;
        Ok(Self {
            law,
            spaces,
            sides,
            exit: vec![vec![S::zero(); len]; entry.len()],
            end: flight.early.is_some().then_some(tape),
            entry_speed: -&shift_depth_power(value(Output::Velocity), -1),
            release_rate: value(Output::ReleaseRate).head(),
            entry,
            whole: [(); 3].map(|()| vec![S::zero(); len]),
            time: vec![S::zero(); len],
            scratch: vec![S::zero(); len],
        })
    }

    fn run(mut self) -> Released<S> {
        for (exit, entry) in self.exit.iter_mut().zip(&self.entry) {
            exit[0] = entry.head();
        }
        for degree in 0..=self.spaces.space.order() {
            self.accelerations(degree);
            match self.end.is_some() {
                true => self.early_time(degree),
                false => self.time_to_surface(degree),
            }
            self.penetrations(degree);
            self.states(degree);
        }
        let space = &self.spaces.space;
        let jet = |values: Vec<S>| Jet::from_coefficients(space, values);
        Released { exit: self.exit.into_iter().map(jet).collect(), time: jet(self.time) }
    }

    /// Part of one degree of every output of the law at every node, and of the means of `h''`.
    fn accelerations(&mut self, degree: usize) {
        let Self { law, spaces, sides, whole, scratch, .. } = self;
        let space = &*spaces.space;
        let len = space.len();
        let slot = law.slot(Output::Acceleration) * len;
        let range = space.degree_range(degree);
        for side in sides {
            for (tape, gap) in side.tapes.iter_mut().zip(&side.gaps) {
                gap.write_powers(spaces, law, degree, tape);
                law.program.advance(space, degree, tape, scratch);
            }
            for monomial in range.clone() {
                let integrals = &side.integrals[spaces.kind_of[monomial]];
                let values: DVector<S> = DVector::from_iterator(
                    side.tapes.len(),
                    side.tapes.iter().map(|tape| tape[slot + monomial]),
                );
                if values.iter().all(|value| *value == S::zero()) {
                    continue;
                }
                for (place, gap) in side.gaps.iter_mut().enumerate() {
                    gap.mean[monomial] = match place < values.len() {
                        true => row_times(&integrals.moment, place, &values),
                        false => dot(&integrals.moment_at_end, &values),
                    };
                }
                let total = dot(&integrals.total, &values);
                let first = dot(&integrals.first, &values);
                let still = spaces.collapsed[monomial];
                whole[0][still] += total;
                whole[1][still] += if side.backward { first } else { total - first };
            }
        }
    }

    /// Part of the contact time over `y` to the surface: `T = σ / ∫ (1 − u) h'' du`.
    fn time_to_surface(&mut self, degree: usize) {
        let space = &*self.spaces.space;
        let range = space.degree_range(degree);
        let out = &mut self.scratch[..range.len()];
        let speed = self.entry_speed.coefficients();
        quotient_part(space, degree, speed, &self.whole[1], &self.time, out);
        self.time[range].copy_from_slice(out);
    }

    /// Part of the contact time over `y` to an early release, from the next part of the release
    /// function: the time enters it with its rate at the grazing point, times `y`.
    fn early_time(&mut self, degree: usize) {
        let spaces = self.spaces;
        let next = degree + 1;
        if next > spaces.space.order() {
            return;
        }
        self.penetrations(degree);
        self.states(degree);
        let slot = self.law.slot(Output::Release) * spaces.space.len();
        let Some(tape) = &self.end else { return };
        for monomial in spaces.space.degree_range(degree) {
            if let Some(raised) = spaces.times_y[monomial] {
                self.time[monomial] = -tape[slot + raised] / self.release_rate;
            }
        }
    }

    /// Part of `H` and its powers at every place.
    fn penetrations(&mut self, degree: usize) {
        let Self { law, spaces, sides, whole, time, entry_speed, scratch, .. } = self;
        let space = &*spaces.space;
        let range = space.degree_range(degree);
        let out = &mut scratch[..range.len()];
        // Speed at the release over y: −σ + T ∫ h'' du.
        product_part(space, degree, time, &whole[0], out);
        let speed = entry_speed.coefficients();
        for (value, monomial) in out.iter().zip(range.clone()) {
            whole[2][monomial] = *value - speed[monomial];
        }
        for side in sides {
            let speed = if side.backward { &whole[2][..] } else { speed };
            for gap in &mut side.gaps {
                gap.advance(space, degree, speed, time, &law.exponents, out);
            }
        }
    }

    /// The next part of the state at every node and at the release.
    fn states(&mut self, degree: usize) {
        let Self { law, spaces, sides, time, entry, exit, scratch, end, .. } = self;
        let space = &*spaces.space;
        let (len, next) = (space.len(), degree + 1);
        if next > space.order() {
            return;
        }
        let range = space.degree_range(degree);
        for component in 0..law.dimension {
            let slot = law.program.output(component) * len;
            let rates: Vec<DMatrix<S>> = sides
                .iter()
                .map(|side| {
                    let mut rates = DMatrix::from_element(side.nodes.len(), range.len(), S::zero());
                    for (node, tape) in side.tapes.iter().enumerate() {
                        let out = &mut scratch[..range.len()];
                        product_part(space, degree, time, &tape[slot..slot + len], out);
                        rates
                            .row_mut(node)
                            .iter_mut()
                            .zip(&*out)
                            .for_each(|(to, &from)| *to = from);
                    }
                    rates
                })
                .collect();
            let of_exit = space.degree_range(next);
            exit[component][of_exit.clone()]
                .copy_from_slice(&entry[component].coefficients()[of_exit.clone()]);
            for (side, rates) in sides.iter().zip(&rates) {
                for (place, monomial) in range.clone().enumerate() {
                    let total = &side.integrals[spaces.kind_of[monomial]].total;
                    if let Some(raised) = spaces.times_y[spaces.collapsed[monomial]] {
                        exit[component][raised] += dot_column(total, rates, place);
                    }
                }
            }
            for (side, rates) in sides.iter_mut().zip(&rates) {
                let (start, sign) = match side.backward {
                    false => (entry[component].coefficients(), S::one()),
                    true => (&exit[component][..], -S::one()),
                };
                let first = component * len;
                for (node, tape) in side.tapes.iter_mut().enumerate() {
                    tape[first + of_exit.start..first + of_exit.end]
                        .copy_from_slice(&start[of_exit.clone()]);
                    for (place, monomial) in range.clone().enumerate() {
                        let primitive = &side.integrals[spaces.kind_of[monomial]].primitive;
                        if let Some(raised) = spaces.times_y[monomial] {
                            let mut sum = S::zero();
                            for column in 0..primitive.ncols() {
                                sum += primitive[(node, column)] * rates[(column, place)];
                            }
                            tape[first + raised] += sign * sum;
                        }
                    }
                }
            }
        }
        let Some(tape) = end else { return };
        for (component, exit) in exit.iter().enumerate() {
            let range = space.degree_range(next);
            tape[component * len + range.start..component * len + range.end]
                .copy_from_slice(&exit[range]);
        }
        if let Some(gap) = sides.first().and_then(|side| side.gaps.last()) {
            gap.write_still_powers(spaces, law, next, tape);
        }
        if degree == 0 {
            law.program.advance(space, 0, tape, scratch);
        }
        law.program.advance(space, next, tape, scratch);
    }
}

impl<S: Real> Gap<S> {
    fn new(len: usize, classes: usize) -> Self {
        let zero = vec![S::zero(); len];
        Self {
            mean: zero.clone(),
            slope: zero.clone(),
            value: zero.clone(),
            euler: zero.clone(),
            powers: vec![[zero.clone(), zero]; classes],
        }
    }

    /// Part of one degree of `H` and its powers; `speed` is `σ`.
    fn advance(
        &mut self,
        space: &JetSpace,
        degree: usize,
        speed: &[S],
        time: &[S],
        exponents: &[Dd],
        out: &mut [S],
    ) {
        let range = space.degree_range(degree);
        let euler = S::from_f64(degree as f64);
        product_part(space, degree, time, &self.mean, out);
        for (value, monomial) in out.iter().zip(range.clone()) {
            self.slope[monomial] = speed[monomial] - *value;
        }
        product_part(space, degree, time, &self.slope, out);
        for (value, monomial) in out.iter().zip(range.clone()) {
            (self.value[monomial], self.euler[monomial]) = (*value, euler * *value);
        }
        for ([power, power_euler], &exponent) in self.powers.iter_mut().zip(exponents) {
            let (base, base_euler) = (&self.value, &self.euler);
            let exponent = S::from_dd(exponent);
            power_part(space, exponent, degree, base, base_euler, power, power_euler, out);
            for (value, monomial) in out.iter().zip(range.clone()) {
                (power[monomial], power_euler[monomial]) = (*value, euler * *value);
            }
        }
    }

    /// Writes the part of one degree of every power of the penetration to a tape.
    fn write_powers(&self, spaces: &PowerSpace, law: &PowerLaw, degree: usize, tape: &mut [S]) {
        self.write(spaces, law, degree, tape, |monomial| monomial);
    }

    /// The same at the end of the contact, where `u = 1`.
    fn write_still_powers(
        &self,
        spaces: &PowerSpace,
        law: &PowerLaw,
        degree: usize,
        tape: &mut [S],
    ) {
        self.write(spaces, law, degree, tape, |monomial| spaces.collapsed[monomial]);
    }

    fn write(
        &self,
        spaces: &PowerSpace,
        law: &PowerLaw,
        degree: usize,
        tape: &mut [S],
        place: impl Fn(usize) -> usize,
    ) {
        let space = &*spaces.space;
        let first = law.program.inputs() - spaces.classes.len();
        for (number, class) in spaces.classes.iter().enumerate() {
            let weight = usize::from(class.written + class.power);
            let slot = (first + number) * space.len();
            tape[slot + space.degree_range(degree).start..slot + space.degree_range(degree).end]
                .fill(S::zero());
            let Some(source) = degree.checked_sub(weight) else { continue };
            for monomial in space.degree_range(source) {
                if let Some(raised) = spaces.times_power[number][monomial] {
                    tape[slot + place(raised)] += self.powers[number][0][monomial];
                }
            }
        }
    }
}

/// Number of nodes for functions whose nearest singularity is at `singular`, the interval being
/// `(0, 1)`.
fn nodes_for(singular: f64, roundoff: f64) -> usize {
    let place = 2.0 * singular - 1.0;
    let growth = place + (place * place - 1.0).sqrt();
    let needed = -roundoff.ln() / growth.ln() + 4.0;
    (needed.ceil() as usize).min(MOST_NODES)
}

fn dot<S: Real>(row: &DVector<S>, values: &DVector<S>) -> S {
    row.iter().zip(values).fold(S::zero(), |sum, (&a, &b)| sum + a * b)
}

fn row_times<S: Real>(matrix: &DMatrix<S>, row: usize, values: &DVector<S>) -> S {
    let terms = values.iter().enumerate();
    terms.fold(S::zero(), |sum, (column, &value)| sum + matrix[(row, column)] * value)
}

fn dot_column<S: Real>(row: &DVector<S>, matrix: &DMatrix<S>, column: usize) -> S {
    let terms = row.iter().enumerate();
    terms.fold(S::zero(), |sum, (place, &value)| sum + value * matrix[(place, column)])
}
