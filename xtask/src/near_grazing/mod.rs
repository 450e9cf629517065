//! Direct simulation in lanes near grazes: a million passages with depths down to 1e-14, compared
//! with double-double.
//!
//! `cargo run --release -p xtask -- near-grazing` prints a line for every scene, section and flow
//! method (minutes), and every passage with an error above 1e-6.

pub mod passages;

use grazemap::hybrid::HybridSystem;
use grazemap::numeric::is_wide;
use passages::{Case, Tally, WRONG};
use rayon::prelude::*;

use crate::{Outcome, Verdict};

const AFFINE: [&str; 6] =
    ["linear", "linear_codim2", "foale", "foale_omega_2_2", "moving_stop", "impact_pair"];
const BY_TAYLOR: [&str; 4] = ["mems", "self_excited", "linear", "moving_stop"];

/// Share of passages flown by exact steps, which take a tenth of the time.
const EXACT_SHARE: f64 = 0.95;

/// Number of blocks of eight passages in a piece of work.
const PIECE: usize = 256;

type Section = &'static [(&'static str, &'static str)];

const OWN: Section = &[];
const AT_GRAZE: Section = &[("section.kind", "stroboscopic")];
const ELSEWHERE: Section = &[("section.kind", "stroboscopic"), ("section.phase", "1")];

/// Arguments of the command.
#[derive(Debug, clap::Args)]
pub struct NearGrazing {
    /// Number of passages
    #[arg(default_value_t = 1e6)]
    passages: f64,
}

impl NearGrazing {
    /// Flies the passages, and compares.
    ///
    /// # Errors
    ///
    /// A machine without wide registers, or a scene that does not graze.
    pub fn run(&self) -> Outcome {
        if !is_wide() {
            return Err("there are no lanes without wide registers (AVX2, AVX-512 or NEON)".into());
        }
        let sections = |name: &str| match name {
            "self_excited" => &[OWN][..],
            _ => &[OWN, AT_GRAZE, ELSEWHERE][..],
        };
        let cases = |scenes: &[&'static str], lowered| -> Vec<Case> {
            let each = scenes.iter().flat_map(|&scene| {
                sections(scene).iter().map(move |&section| Case { scene, section, lowered })
            });
            each.collect()
        };
        let exact = cases(&AFFINE, HybridSystem::new);
        let taylor = cases(&BY_TAYLOR, HybridSystem::without_exact_flow);
        let mut all = Tally::default();
        println!(
            "scene            section               flow     passages  contacts  in lanes  largest error  above 1e-6"
        );
        for (cases, share, flow) in
            [(exact, EXACT_SHARE, "exact"), (taylor, 1.0 - EXACT_SHARE, "Taylor")]
        {
            let blocks = (self.passages * share / 8.0 / cases.len() as f64).ceil() as usize;
            for case in cases {
                let tally = measured(case, blocks)?;
                let section = match case.section {
                    [] => "its own",
                    [_] => "phase of the graze",
                    _ => "phase 1",
                };
                println!(
                    "{:17}{section:22}{flow:7}{:10}{:10}{:10}{:15.1e}{:12}",
                    case.scene,
                    tally.passages,
                    tally.contacts,
                    tally.together,
                    tally.largest,
                    tally.wrong.len()
                );
                all = all.and(tally);
            }
        }
        println!(
            "{} passages, {} contacts: {} above {WRONG:e}",
            all.passages,
            all.contacts,
            all.wrong.len()
        );
        all.wrong.iter().take(20).for_each(|words| println!("    {words}"));
        Ok(Verdict::of(all.wrong.len()))
    }
}

fn measured(case: Case, blocks: usize) -> Result<Tally, String> {
    let graze = case.graze()?;
    let pieces = (0..blocks.div_ceil(PIECE)).into_par_iter();
    let piece = |piece: usize| graze.passages(piece * PIECE..blocks.min((piece + 1) * PIECE));
    Ok(pieces.map(piece).reduce(Tally::default, Tally::and))
}
