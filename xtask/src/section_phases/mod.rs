//! Returns to sections at every phase, compared with a simulation without a section: all scenes of
//! the catalogue with a forcing phase, at parameters near those of the graze.
//!
//! `cargo run --release -p xtask -- section-phases` prints a line for every scene (a minute), and
//! every return that is wrong.

pub mod campaign;

use std::error::Error;

use campaign::{Campaign, Tally};
use grazemap::hybrid::HybridSystem;
use grazemap::model::{Model, Scene, catalogue};
use rayon::prelude::*;

use crate::{Outcome, Verdict};

/// Number of phases of sections in a period.
const PHASES: usize = 16;
/// Number of orbits at every parameter.
const ORBITS: usize = 8;
/// Factors applied to the adjusted parameter.
const FACTORS: [f64; 7] = [0.6, 0.8, 0.95, 1.0, 1.05, 1.2, 1.5];

/// Arguments of the command: none.
#[derive(Debug, clap::Args)]
pub struct SectionPhases {}

impl SectionPhases {
    /// Compares the returns of all scenes.
    ///
    /// # Errors
    ///
    /// A scene of the catalogue that cannot be read.
    pub fn run(&self) -> Outcome {
        let names: Vec<_> = catalogue::names().collect();
        let tallies: Result<Vec<_>, _> = names.par_iter().map(|name| of_scene(name)).collect();
        let tallies = tallies.map_err(|error| -> Box<dyn Error> { error })?;
        println!("scene                    agreed   held  ambiguous  ended  wrong");
        let mut wrong = 0;
        for (name, tally) in names.iter().zip(tallies) {
            let Tally { agreed, held, ambiguous, ended, .. } = tally;
            wrong += tally.wrong.len();
            println!("{name:24}{agreed:7}{held:7}{ambiguous:11}{ended:7}{:7}", tally.wrong.len());
            tally.wrong.iter().for_each(|words| println!("    {words}"));
        }
        Ok(Verdict::of(wrong))
    }
}

fn of_scene(name: &str) -> Result<Tally, Box<dyn Error + Send + Sync>> {
    let scene = Scene::of_catalogue(name)?;
    let system = HybridSystem::new(&scene.model);
    let mut tally = Tally::default();
    for factor in FACTORS {
        let mut parameters = values(&scene.model);
        scene.grazing.solve_for.iter().for_each(|&place| parameters[place] *= factor);
        let campaign = Campaign { system: &system, parameters, phases: PHASES };
        for number in 0..ORBITS {
            campaign.follow(&start(&scene, number), &mut tally);
        }
    }
    Ok(tally)
}

fn values(model: &Model) -> Vec<f64> {
    model.parameter_values().iter().map(|value| value.to_f64()).collect()
}

/// Random state of the size of the guess, or of 1, at a random phase.
fn start(scene: &Scene, number: usize) -> Vec<f64> {
    let steps = [0.754_877, 0.569_840, 0.430_160, 0.324_718, 0.245_122];
    let scattered = |place: usize| (0.31 + (number + 1) as f64 * steps[place % 5]).fract();
    let (states, phase) = (scene.model.states.len(), scene.model.phase.as_ref());
    let guess = scene.grazing.guess.clone().unwrap_or_else(|| vec![0.5; states]);
    let state = |place: usize| guess[place] * (2.0 * scattered(place) - 1.0);
    let phase = phase.map(|phase| phase.period.to_f64() * scattered(states));
    (0..states).map(state).chain(phase).collect()
}
