//! The flight through a contact with powers of the penetration, degree by degree of its jets.
//!
//! In the time `t = y T u`, `u` from 0 to 1, the penetration is `y² u (1 − u) H` with `H > 0`, or
//! `y² u H` where the contact ends before the surface. A power `d^β` is then `y^{2β}` times a
//! number and `H^β` at each node of a quadrature. For a whole `2β` the first factor is a power of
//! `y`, otherwise a variable of its own, the last of its space. An integral over the time has a
//! factor `y`, so that the part of one degree of every jet follows from lower ones.

use std::sync::Arc;

use super::corrections::{LARGEST_EXPONENT, WeightScale};
use super::law::{Output, PowerLaw};
use super::quadrature::{Quadrature, growth};
use crate::expansion::approach::{Approach, DepthVariable};
use crate::expansion::error::{ContactLawError, ExpansionError, PowerProblem};
use crate::expansion::routes::Graze;
use crate::expansion::variables::shift_depth_power;
use crate::jet::elementary::{power_part, product_part, quotient_part};
use crate::jet::{Jet, JetSpace};
use crate::numeric::{Dd, Real, Scalar};

/// Weight of the expansion that decides whether a contact ends at the surface or before it.
const RELEASE_WEIGHT: u32 = 4;
/// Share of the largest coefficient below which one counts as zero, in double-double.
const VANISHING: f64 = 1e-22;
/// Share of a whole contact's time beyond which an early release is too near to the surface.
const LATEST: f64 = 0.9;
/// Largest number of nodes for half-whole powers.
const MOST_NODES: usize = 120;
/// Smallest power of `y` in a power of the penetration.
const SMALLEST_POWER: f64 = 0.1;

/// A contact with powers of the penetration, and how it ends.
#[derive(Clone, Debug)]
pub(in crate::expansion) struct PowerFlight<'a> {
    law: &'a PowerLaw,
    /// Share of the time to the surface at which the contact ends, at the grazing point; `None` for
    /// a release at the surface.
    early: Option<f64>,
}

impl<'a> PowerFlight<'a> {
    /// Decides whether the contact ends at the surface or before it, near the graze.
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
        let is_out_of_range = |&&beta: &&Dd| {
            !(SMALLEST_POWER..=LARGEST_EXPONENT).contains(&depth_power(beta).to_f64())
        };
        if let Some(&exponent) = law.exponents.iter().find(is_out_of_range) {
            return Err(refused(exponent, PowerProblem::OutOfRange));
        }
        let kind = DepthVariable::Replacing;
        let approach = Approach::<Dd>::new(graze, RELEASE_WEIGHT, kind)?;
        let entry = approach.entry()?;
        let parameters = graze.passage.parameter_jets(&approach.space, approach.first_parameter);
        let values = law.on_surface(&entry.state, &parameters);
        let value = |output: Output| &values[law.place(output)];
        let contact_acceleration = value(Output::Acceleration).head().to_f64();
        let free_acceleration = 2.0 * approach.gap[2].head().to_f64();
        if contact_acceleration <= 0.0 {
            let surface = surface();
            let pressed =
                ContactLawError::Acceleration { surface, contact_acceleration, free_acceleration };
            return Err(pressed.into());
        }
        let (release, rate) = (value(Output::Release), value(Output::ReleaseRate));
        let size = values.iter().map(Jet::max_abs).fold(0.0, f64::max);
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
        let root = law.exponents.iter().find(|&&beta| depth_power(beta).to_f64() <= 1.0);
        match root {
            Some(&exponent) => Err(refused(exponent, PowerProblem::EarlyRoot)),
            None => Ok(Self { law, early: Some(share) }),
        }
    }

    /// Exponents of `y` in the powers that are variables of their own.
    ///
    /// An early release divides by `y`: what is left of the power then is the variable.
    pub(in crate::expansion) fn own_variables(&self) -> Vec<Dd> {
        let powers = self.law.exponents.iter().map(|&exponent| depth_power(exponent));
        let beside = Dd::from_f64(f64::from(self.beside()));
        powers.filter(|&power| whole(power).is_none()).map(|power| power - beside).collect()
    }

    /// Power of `y` beside a variable of its own in a power of the penetration.
    fn beside(&self) -> u8 {
        u8::from(self.early.is_some())
    }

    /// Space of the flight: `(y; coordinates; parameters)` and, after them, the powers of `y` that
    /// are variables of their own.
    ///
    /// # Errors
    ///
    /// [`ExpansionError::Jet`] if it would be too large.
    pub(in crate::expansion) fn space(
        &self,
        narrow: &Arc<JetSpace>,
    ) -> Result<Arc<JetSpace>, ExpansionError> {
        let own = self.own_variables();
        if own.is_empty() {
            return Ok(Arc::clone(narrow));
        }
        let scale = WeightScale::of(&own);
        let weights = narrow.weights().iter().map(|weight| scale.unit * weight);
        let own = own.into_iter().map(|power| scale.weight(power));
        let weights: Vec<u32> = weights.chain(own).collect();
        Ok(JetSpace::new(&weights, scale.unit as usize * narrow.order())?)
    }

    /// Flies from the entry to the release, in the [space](Self::space) of the flight; returns the
    /// state there and the contact time.
    ///
    /// # Errors
    ///
    /// [`ExpansionError::Numeric`] if the matrix of the quadrature is singular.
    pub(in crate::expansion) fn exit<S: Real>(
        &self,
        entry: &[Jet<S>],
        parameters: &[Jet<S>],
    ) -> Result<(Vec<Jet<S>>, Jet<S>), ExpansionError> {
        let space = entry[0].space();
        let flown = Flown::new(self, space, entry, parameters)?.run();
        let jet = |values: Vec<S>| Jet::from_coefficients(space, values);
        let state = flown.exit.into_iter().map(jet).collect();
        Ok((state, shift_depth_power(&jet(flown.time), 1)))
    }
}

/// Power of `y` in `d^β`.
fn depth_power(exponent: Dd) -> Dd {
    exponent + exponent
}

/// A power as a whole number, if it is one.
fn whole(power: Dd) -> Option<u8> {
    (power.lo == 0.0 && power.hi.fract() == 0.0).then_some(power.hi as u8)
}

/// A product of powers of the variables of a space, by which jets are multiplied.
struct Raised {
    /// Its weight.
    weight: usize,
    /// Monomial times the product, for every monomial that the space keeps.
    monomials: Vec<Option<usize>>,
}

impl Raised {
    /// The product of powers of variables, each with its number.
    fn new(space: &JetSpace, powers: &[(usize, u8)]) -> Self {
        let of = |monomial| {
            let mut target = space.exponents(monomial).to_vec();
            for &(variable, power) in powers {
                target[variable] = target[variable].checked_add(power)?;
            }
            space.monomial(&target)
        };
        let weight = |&(variable, power): &(usize, u8)| {
            space.weights()[variable] as usize * usize::from(power)
        };
        Self {
            weight: powers.iter().map(weight).sum(),
            monomials: (0..space.len()).map(of).collect(),
        }
    }
}

/// The penetration over `y²` and its base, `H = T (σ − T A)`, and its powers at one place.
#[derive(Clone)]
struct Gap<S: Scalar> {
    /// Share of the speed `σ` at the place.
    share: S,
    /// `A`, the mean of `h''`.
    mean: Vec<S>,
    /// `σ − T A`, with the share of `σ`.
    slope: Vec<S>,
    value: Vec<S>,
    euler: Vec<S>,
    /// `H^β` by class, and its Euler derivative.
    powers: Vec<[Vec<S>; 2]>,
}

/// A flight in progress.
struct Flown<'a, S: Scalar> {
    law: &'a PowerLaw,
    space: &'a JetSpace,
    quadrature: Quadrature<S>,
    /// One tape of the law's program per node.
    tapes: Vec<Vec<S>>,
    /// The penetration at each place.
    gaps: Vec<Gap<S>>,
    /// Power of the base of each place, by class.
    bases: Vec<Vec<S>>,
    /// Factor of the powers of the penetration, by class.
    raised: Vec<Raised>,
    /// Factor `y`.
    times_y: Raised,
    entry: Vec<Jet<S>>,
    exit: Vec<Vec<S>>,
    /// Tape of the law's program at the release, for an early one.
    end: Option<Vec<S>>,
    /// Speed `−h'/y` at the entry, and `h'/y` at the release.
    speeds: [Vec<S>; 2],
    /// `∫ h'' du` and `∫ (1 − u) h'' du`.
    total: Vec<S>,
    moment: Vec<S>,
    /// Contact time over `y`.
    time: Vec<S>,
    /// Rate of the release function at the grazing point.
    release_rate: S,
    scratch: Vec<S>,
}

impl<'a, S: Real> Flown<'a, S> {
    fn new(
        flight: &PowerFlight<'a>,
        space: &'a Arc<JetSpace>,
        entry: &[Jet<S>],
        parameters: &[Jet<S>],
    ) -> Result<Self, ExpansionError> {
        let law = flight.law;
        let len = space.len();
        let values = law.on_surface(entry, parameters);
        let value = |output: Output| &values[law.place(output)];
        let mut tape = vec![S::zero(); law.program.slots() * len];
        for (slot, jet) in parameters.iter().enumerate() {
            let start = (law.dimension + slot) * len;
            tape[start..start + len].copy_from_slice(jet.coefficients());
        }
        for (slot, jet) in entry.iter().enumerate() {
            tape[slot * len] = jet.head();
        }
        let least = law.exponents.iter().map(|beta| beta.to_f64()).fold(1.0, f64::min);
        let half_whole = flight.own_variables().is_empty();
        let quadrature: Quadrature<S> = match (flight.early, half_whole) {
            (None, true) => {
                Quadrature::between(nodes_between(space.order(), &law.exponents, S::ROUNDOFF))
            }
            (None, false) => Quadrature::between_any(least),
            (Some(share), true) => Quadrature::after(nodes_after(share, S::ROUNDOFF)),
            (Some(share), false) => Quadrature::after_any(share, least),
        }?;
        let bases = quadrature.places.iter().map(|place| {
            let powers = law.exponents.iter();
            powers.map(|&exponent| place.base.powf(S::from_dd(exponent))).collect()
        });
        let bases = bases.collect();
        let mut own = space.variables() - flight.own_variables().len();
        let raised = law.exponents.iter().map(|&exponent| match whole(depth_power(exponent)) {
            Some(power) => Raised::new(space, &[(0, power)]),
            None => {
                own += 1;
                Raised::new(space, &[(0, flight.beside()), (own - 1, 1)])
            }
        });
        let gaps = quadrature.places.iter();
        let gaps = gaps.map(|place| Gap::new(place.share, len, law.exponents.len()));
        let zero = vec![S::zero(); len];
        let speed = -&shift_depth_power(value(Output::Velocity), -1);
        let mut exit = vec![zero.clone(); entry.len()];
        for (exit, entry) in exit.iter_mut().zip(entry) {
            exit[0] = entry.head();
        }
        Ok(Self {
            law,
            space,
            tapes: vec![tape.clone(); quadrature.primitive.len()],
            gaps: gaps.collect(),
            quadrature,
            bases,
            raised: raised.collect(),
            times_y: Raised::new(space, &[(0, 1)]),
            entry: entry.to_vec(),
            exit,
            end: flight.early.is_some().then_some(tape),
            speeds: [speed.coefficients().to_vec(), zero.clone()],
            total: zero.clone(),
            moment: zero.clone(),
            time: zero.clone(),
            release_rate: value(Output::ReleaseRate).head(),
            scratch: zero,
        })
    }

    fn run(mut self) -> Self {
        for degree in 0..=self.space.order() {
            self.accelerations(degree);
            match self.end.is_some() {
                true => self.early_time(degree),
                false => self.time_to_surface(degree),
            }
            self.penetrations(degree);
            self.states(degree);
        }
        self
    }

    /// Part of one degree of every output of the law at every node, and of the means of `h''`.
    fn accelerations(&mut self, degree: usize) {
        let Self { law, space, quadrature, tapes, gaps, bases, raised, scratch, .. } = self;
        let slot = law.program.output(law.place(Output::Acceleration)) * space.len();
        for (node, tape) in tapes.iter_mut().enumerate() {
            gaps[node].write_powers(space, law, &bases[node], raised, degree, tape);
            law.program.advance(*space, degree, tape, scratch);
        }
        for monomial in space.degree_range(degree) {
            let values: Vec<S> = tapes.iter().map(|tape| tape[slot + monomial]).collect();
            for (gap, place) in gaps.iter_mut().zip(&quadrature.places) {
                gap.mean[monomial] = place.mean.of(&values);
            }
            self.total[monomial] = quadrature.total.of(&values);
            self.moment[monomial] = quadrature.moment.of(&values);
        }
    }

    /// Part of the contact time over `y` to the surface: `T = σ / ∫ (1 − u) h'' du`.
    fn time_to_surface(&mut self, degree: usize) {
        let range = self.space.degree_range(degree);
        let out = &mut self.scratch[..range.len()];
        quotient_part(self.space, degree, &self.speeds[0], &self.moment, &self.time, out);
        self.time[range].copy_from_slice(out);
    }

    /// Part of the contact time over `y` to an early release, from the next part of the release
    /// function: the time enters it with its rate at the grazing point, times `y`.
    fn early_time(&mut self, degree: usize) {
        if degree + self.times_y.weight > self.space.order() {
            return;
        }
        self.penetrations(degree);
        self.states(degree);
        let slot = self.law.program.output(self.law.place(Output::Release)) * self.space.len();
        let Some(tape) = &self.end else { return };
        for monomial in self.space.degree_range(degree) {
            if let Some(raised) = self.times_y.monomials[monomial] {
                self.time[monomial] = -tape[slot + raised] / self.release_rate;
            }
        }
    }

    /// Part of `H` and its powers at every place.
    fn penetrations(&mut self, degree: usize) {
        let Self { law, space, quadrature, gaps, speeds, total, time, scratch, .. } = self;
        let range = space.degree_range(degree);
        let out = &mut scratch[..range.len()];
        // Speed at the release over y: −σ + T ∫ h'' du.
        product_part(*space, degree, time, total, out);
        for (value, monomial) in out.iter().zip(range) {
            speeds[1][monomial] = *value - speeds[0][monomial];
        }
        for (gap, place) in gaps.iter_mut().zip(&quadrature.places) {
            let speed = &speeds[usize::from(place.from_end)];
            gap.advance(space, degree, speed, time, &law.exponents, out);
        }
    }

    /// The next part of the state at every node and at the release.
    fn states(&mut self, degree: usize) {
        let Self {
            law, space, quadrature, tapes, time, times_y, entry, exit, scratch, end, ..
        } = self;
        let (len, next) = (space.len(), degree + times_y.weight);
        if next > space.order() {
            return;
        }
        let (range, raised_range) = (space.degree_range(degree), space.degree_range(next));
        let count = tapes.len();
        let mut rates = vec![vec![S::zero(); count]; range.len()];
        for component in 0..law.dimension {
            let slot = law.program.output(component) * len;
            for (node, tape) in tapes.iter().enumerate() {
                let out = &mut scratch[..range.len()];
                product_part(*space, degree, time, &tape[slot..slot + len], out);
                rates.iter_mut().zip(&*out).for_each(|(rates, &value)| rates[node] = value);
            }
            let start = &entry[component].coefficients()[raised_range.clone()];
            exit[component][raised_range.clone()].copy_from_slice(start);
            let first = component * len;
            for tape in tapes.iter_mut() {
                tape[first + raised_range.start..first + raised_range.end].copy_from_slice(start);
            }
            for (rates, monomial) in rates.iter().zip(range.clone()) {
                let Some(raised) = times_y.monomials[monomial] else { continue };
                let whole = quadrature.total.of(rates);
                exit[component][raised] += whole;
                for (tape, primitive) in tapes.iter_mut().zip(&quadrature.primitive) {
                    let part = primitive.row.of(rates);
                    tape[first + raised] += if primitive.to_end { whole - part } else { part };
                }
            }
        }
        let Some(tape) = end else { return };
        for (component, exit) in exit.iter().enumerate() {
            let part = &exit[raised_range.clone()];
            tape[component * len + raised_range.start..component * len + raised_range.end]
                .copy_from_slice(part);
        }
        if degree == 0 {
            law.program.advance(*space, 0, tape, scratch);
        }
        self.gaps[count].write_powers(space, law, &self.bases[count], &self.raised, next, tape);
        law.program.advance(*space, next, tape, scratch);
    }
}

impl<S: Real> Gap<S> {
    fn new(share: S, len: usize, classes: usize) -> Self {
        let zero = vec![S::zero(); len];
        Self {
            share,
            mean: zero.clone(),
            slope: zero.clone(),
            value: zero.clone(),
            euler: zero.clone(),
            powers: vec![[zero.clone(), zero]; classes],
        }
    }

    /// Part of one degree of `H` and its powers; `speed` is `σ`, and `time` is `T`.
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
            self.slope[monomial] = self.share * speed[monomial] - *value;
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
    fn write_powers(
        &self,
        space: &JetSpace,
        law: &PowerLaw,
        bases: &[S],
        raised: &[Raised],
        degree: usize,
        tape: &mut [S],
    ) {
        let first = law.program.inputs() - law.exponents.len();
        for (class, (raised, &base)) in raised.iter().zip(bases).enumerate() {
            let Some(source) = degree.checked_sub(raised.weight) else { continue };
            let slot = (first + class) * space.len();
            for monomial in space.degree_range(source) {
                if let Some(raised) = raised.monomials[monomial] {
                    tape[slot + raised] = base * self.powers[class][0][monomial];
                }
            }
        }
    }
}

/// Number of nodes of a contact between two zeros of the penetration: coefficients are polynomials
/// in the sine and cosine of `2φ` and in `φ`, of a degree that grows with order and exponents.
fn nodes_between(order: usize, exponents: &[Dd], roundoff: f64) -> usize {
    let digits = -roundoff.log10();
    let highest = exponents.iter().fold(0.0, |highest, exponent| exponent.to_f64().max(highest));
    (digits.ceil() as usize + 2 * order + 4 * highest.ceil() as usize).min(MOST_NODES)
}

/// Number of nodes of a contact that ends before the surface at a share of its whole time: the
/// nearest singularity in `φ = √u` is at the surface.
fn nodes_after(share: f64, roundoff: f64) -> usize {
    let needed = -roundoff.ln() / growth(2.0 / share.sqrt() - 1.0).ln() + 4.0;
    (needed.ceil() as usize).min(MOST_NODES)
}
