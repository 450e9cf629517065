//! Tasks whose instructions are counted: `benches/instructions/run` runs this program under a
//! simulator of the processor.
//!
//! usage: `instructions NAME ROUNDS`; without arguments, the names. `return_SCENE` are returns of a
//! scene of the catalogue by direct simulation.

#[path = "support/actuator.rs"]
mod actuator;
#[path = "../tests/support/synthetic.rs"]
mod synthetic;

use std::hint::black_box;

use grazemap::analysis::{DirectEnd, DirectImage};
use grazemap::expansion::SectionKind;
use grazemap::flow::jet_transport;
use grazemap::hybrid::{HybridSystem, Simulator};
use grazemap::iteration::{DiscreteMap, HornerMap};
use grazemap::jet::{Jet, JetSpace};
use grazemap::model::{Scene, catalogue};
use grazemap::numeric::{Lanes, Scalar};
use grazemap::prelude::FindGraze;

/// Name of a task, and the function that runs it a number of times.
type Work = (&'static str, fn(usize));

const WORK: [Work; 6] = [
    ("product_5_6", product::<f64>),
    ("product_5_6_lanes", product::<Lanes<8>>),
    ("flow_1", flow::<1>),
    ("flow_6", flow::<6>),
    ("direct_period", direct_period),
    ("frozen_step", frozen_step),
];

/// First part of the name of a task of returns.
const RETURNS: &str = "return_";

/// Offsets of the first point of these returns.
const START: f64 = 1e-3;

/// Largest half-width of the first active parameter that is used, where a scene names none.
const WIDEST: f64 = 1e-3;

/// One product of two full jets in five variables, order 6.
fn product<S: Scalar>(rounds: usize) {
    let space = JetSpace::uniform(5, 6).expect("a small space");
    let jet = |seed: f64| {
        let value = |m: usize| S::from_f64(((m as f64 + seed) * 0.618).sin());
        Jet::from_coefficients(&space, (0..space.len()).map(value).collect())
    };
    let (a, b, mut out) = (jet(0.3), jet(0.7), Jet::<S>::zero(&space));
    for _ in 0..rounds {
        black_box(&a).multiply_into(black_box(&b), &mut out);
        black_box(&mut out);
    }
}

/// Jets of the actuator's period.
fn flow<const ORDER: usize>(rounds: usize) {
    let field = actuator::electrostatic();
    let space = JetSpace::uniform(5, ORDER).expect("a small space");
    let (states, parameters) = actuator::jets(&space);
    let period = std::f64::consts::PI / 0.6;
    for _ in 0..rounds {
        let flow = jet_transport(&field, black_box(&states), &parameters, period, 1e-15);
        black_box(flow.expect("the orbit is smooth"));
    }
}

/// One forcing period of the scene `linear`, its contacts and near misses.
fn direct_period(rounds: usize) {
    let scene = Scene::of_catalogue("linear").expect("a scene of the catalogue");
    let system = HybridSystem::new(&scene.model);
    let parameters: Vec<f64> =
        scene.model.parameter_values().into_iter().map(f64::from_dd).collect();
    let mut simulator = Simulator::new(&system, &parameters).expect("finite parameters");
    simulator.set_state(&[0.1, 0.0, 0.0]).expect("a finite state");
    let period = simulator.forcing_period().expect("a phase");
    for _ in 0..rounds {
        simulator
            .advance_period(black_box(period), &mut |event| {
                black_box(event);
            })
            .expect("a phase");
    }
}

/// Two returns of a scene of the catalogue to its section by direct simulation, on either side of
/// the graze, each from the image of the one before.
fn direct_returns(name: &str, rounds: usize) {
    let graze =
        Scene::of_catalogue(name).expect("a scene of the catalogue").graze().expect("a graze");
    let (scene, orbit) = (graze.scene(), graze.orbit());
    let system = HybridSystem::new(&scene.model);
    let mut image = DirectImage::<f64>::new(&system, scene, orbit).expect("finite parameters");
    let start = vec![START; orbit.section.coordinates.len()];
    let first = scene.window.parameter[scene.expansion.active[0]].min(WIDEST);
    for offset in [-0.5 * first, 0.5 * first] {
        let mut parameters = vec![0.0; scene.expansion.active.len()];
        parameters[0] = offset;
        let mut point = start.clone();
        for _ in 0..rounds {
            let found = image.image(black_box(&point), &parameters).expect("a finite point");
            point = if found.end == DirectEnd::Returned { found.offsets } else { start.clone() };
        }
    }
}

/// One step of a map of orders (5, 6), its parameters frozen.
fn frozen_step(rounds: usize) {
    let map = synthetic::map(5, 6, SectionKind::Tangency);
    let (state, parameters) = synthetic::point(&mut synthetic::Numbers::new(1));
    let frozen = HornerMap::new(&map).freeze(&parameters);
    let mut image = [0.0; 2];
    for _ in 0..rounds {
        frozen.step(black_box(&state), &[], &mut image);
        black_box(&mut image);
    }
}

fn main() {
    let arguments: Vec<_> = std::env::args().skip(1).collect();
    let [name, rounds] = &arguments[..] else {
        WORK.iter().for_each(|(name, _)| println!("{name}"));
        catalogue::names().for_each(|scene| println!("{RETURNS}{scene}"));
        return;
    };
    let rounds = rounds.parse().expect("a number of rounds");
    match (name.strip_prefix(RETURNS), WORK.iter().find(|(known, _)| known == name)) {
        (Some(scene), _) => direct_returns(scene, rounds),
        (_, Some((_, work))) => work(rounds),
        _ => panic!("no task has the name {name}"),
    }
}
