//! Random oscillators simulated by the program and by an independent simulator.
//!
//! The independent simulator runs without a section. The program is given section points on that
//! orbit, and has to answer each with the next one.

use grazemap::hybrid::HybridSystem;
use grazemap::model::Scene;
use grazemap::orbit::{GrazingOrbit, Location, locate};

use super::attractors;
use super::generator::{self, Choice, Generated};
use super::returns::Orbit;
use crate::independent::{Oscillator, Simulator};
use crate::random::Random;

/// Difference up to which results agree, in units of the orbit's size.
pub const TOLERANCE: f64 = 1e-9;

/// Counts of comparisons and of differences.
#[derive(Clone, Debug, Default)]
pub struct Tally {
    /// Number of oscillators.
    pub oscillators: usize,
    /// Number of grazing orbits found.
    pub grazes: usize,
    /// Number of grazing orbits that pass through another stop.
    pub through: usize,
    /// Number of returns compared.
    pub returns: usize,
    /// Number of returns to a tangency section.
    pub tangencies: usize,
    /// Number of returns with a contact.
    pub contacts: usize,
    /// Number of returns that the program reports as ambiguous.
    pub ambiguous: usize,
    /// Number of returns that both simulations do not have.
    pub ended: usize,
    /// Number of returns that the independent simulator gives up.
    pub unjudged: usize,
    /// Number of parameter values of diagrams that were checked.
    pub attractors: usize,
    /// Number of periods confirmed.
    pub periodic: usize,
    /// Number of parameter values of diagrams at which a point of the orbit has no image.
    pub no_image: usize,
    /// Number of scenes without a map, and thus without a diagram.
    pub no_map: usize,
    /// Number of differences in a chatter.
    pub chatters: usize,
    /// Number of differences that are grown rounding.
    pub grown: usize,
    /// Largest difference not explained in this way.
    pub largest: f64,
    /// Other differences, as text.
    pub wrong: Vec<String>,
}

impl Tally {
    /// Sum of two tallies.
    pub fn and(mut self, other: Self) -> Self {
        self.oscillators += other.oscillators;
        self.grazes += other.grazes;
        self.through += other.through;
        self.returns += other.returns;
        self.tangencies += other.tangencies;
        self.contacts += other.contacts;
        self.ambiguous += other.ambiguous;
        self.ended += other.ended;
        self.unjudged += other.unjudged;
        self.attractors += other.attractors;
        self.periodic += other.periodic;
        self.no_image += other.no_image;
        self.no_map += other.no_map;
        self.chatters += other.chatters;
        self.grown += other.grown;
        self.largest = self.largest.max(other.largest);
        self.wrong.extend(other.wrong);
        self
    }
}

/// Text of a case's scene.
pub fn scene(seed: u64, case: u64, choice: Choice) -> String {
    generator::oscillator(&mut Random::new(seed, case), choice).scene
}

/// Parts of a case, in words.
pub fn kind(seed: u64, case: u64, choice: Choice) -> String {
    generator::oscillator(&mut Random::new(seed, case), choice).kind
}

/// Compares one oscillator by both simulators.
pub fn compared(seed: u64, case: u64, choice: Choice) -> Tally {
    let mut random = Random::new(seed, case);
    let generated = generator::oscillator(&mut random, choice);
    let mut tally = Tally { oscillators: 1, ..Tally::default() };
    if let Err(words) = compare(&generated, choice, &mut random, &mut tally) {
        tally.wrong.push(words);
    }
    for words in &mut tally.wrong {
        *words = format!("case {case} ({}): {words}", generated.kind);
    }
    tally
}

fn compare(
    generated: &Generated,
    choice: Choice,
    random: &mut Random,
    tally: &mut Tally,
) -> Result<(), String> {
    let scene = Scene::parse(&generated.scene, "random").map_err(|error| error.to_string())?;
    let oscillator = Oscillator::read(&generated.scene, &[])?;
    let found = locate(&scene).map_err(|error| error.to_string())?;
    let mut parameters: Vec<f64> =
        scene.model.parameter_values().iter().map(|value| value.to_f64()).collect();
    let adjusted = scene.grazing.solve_for[0];
    // NOTE: a fortieth of the period of a mass on a spring of 1.
    let look = (generated.look * std::f64::consts::TAU / generated.rate).min(0.15);
    let orbit = match found {
        Location::Located(orbit) => Some(orbit),
        Location::NotLocated(_) => None,
    };
    if let Some(orbit) = &orbit {
        tally.grazes += 1;
        parameters = orbit.parameters().iter().map(|value| value.to_f64()).collect();
        touches(orbit, &oscillator, look, tally)?;
    }
    let system = HybridSystem::new(&scene.model);
    let mut offsets = Vec::new();
    for _ in 0..choice.places {
        let mut parameters = parameters.clone();
        let nearness = 10f64.powf(random.between(-5.0, -0.3));
        let sign = if random.one_in(2) { 1.0 } else { -1.0 };
        offsets.push(sign * nearness * parameters[adjusted]);
        parameters[adjusted] *= 1.0 + sign * nearness;
        let simulator = Simulator::new(&oscillator, &parameters, look);
        let periods = choice.periods;
        let subject = Orbit { system: &system, simulator, periods, size: 1.0 };
        subject.followed(random, generated.phase, tally);
    }
    if !choice.diagrams || !orbit.is_some_and(|orbit| orbit.is_physical()) {
        return Ok(());
    }
    offsets.sort_by(f64::total_cmp);
    let name = &scene.model.parameters[adjusted].name;
    let text = generated.scene.clone() + &attractors::tables(name, &offsets, &oscillator.states);
    for kind in [
        vec![],
        vec![
            ("section.kind".to_owned(), "stroboscopic".to_owned()),
            ("section.phase".to_owned(), format!("{}", generated.phase)),
        ],
    ] {
        let scene = Scene::parse_with(&text, "random", &kind).map_err(|error| error.to_string())?;
        let found = locate(&scene).map_err(|error| error.to_string())?;
        let Location::Located(orbit) = found else { continue };
        attractors::diagrams(&scene, &orbit, &oscillator, look, tally)?;
    }
    Ok(())
}

/// Checks that a grazing orbit closes, touches its stop and passes through none.
fn touches(
    orbit: &GrazingOrbit,
    oscillator: &Oscillator,
    look: f64,
    tally: &mut Tally,
) -> Result<(), String> {
    let point = orbit.grazing_point();
    let double = |values: &[grazemap::numeric::Dd]| -> Vec<f64> {
        values.iter().map(|value| value.to_f64()).collect()
    };
    let (start, parameters) = (double(&point.state), double(&point.parameters));
    let mut free = Simulator::new(oscillator, &parameters, look);
    free.place(&start);
    let [gap, speed, turns] = free.gap_twice(point.surface);
    let size = start.iter().fold(1.0f64, |size, value| size.max(value.abs()));
    if gap.abs().max(speed.abs()) > TOLERANCE * size || turns <= 0.0 {
        return Err(format!("at the graze h = {gap:e}, h' = {speed:e}, h'' = {turns:e}"));
    }
    let period = orbit.period.to_f64();
    let mut least = f64::INFINITY;
    let looks = (period / look).ceil() as usize;
    let step = period / looks as f64;
    let stops = oscillator.stops.len();
    for number in 1..looks {
        free.fly(step).map_err(|reason| format!("the grazing orbit ends: {reason:?}"))?;
        for stop in 0..stops {
            let at_graze = number < 2 || number + 2 > looks;
            if stop != point.surface || !at_graze {
                least = least.min(free.gap(stop).0);
            }
        }
    }
    free.fly(step).map_err(|reason| format!("the grazing orbit ends: {reason:?}"))?;
    let last = start.len() - 1;
    for (place, (&end, &start)) in free.state.iter().zip(&start).enumerate() {
        let turns = if place == last { std::f64::consts::TAU } else { 0.0 };
        let apart = (end - start - turns).abs();
        // NOTE: an unstable orbit amplifies its rounding by its multipliers.
        let spread =
            orbit.multipliers.iter().fold(1.0f64, |most, [re, im]| most.max(re.hypot(*im)));
        if apart > TOLERANCE * size * spread {
            return Err(format!("the grazing orbit does not close by {apart:e}, in {place}"));
        }
    }
    let said = orbit.clearance.unwrap_or(f64::INFINITY);
    tally.through += usize::from(least < -1e-6);
    // NOTE: sampling misses a minimum by the square of half an interval.
    let blur = 10.0 * turns.abs().max(1.0) * step * step;
    if (least < -blur) != (said < -blur) && (least - said).abs() > blur {
        return Err(format!("the grazing orbit passes a stop by {least:e}, {said:e} are said"));
    }
    Ok(())
}
