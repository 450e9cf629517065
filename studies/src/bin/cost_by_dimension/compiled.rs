//! Times of emitted steps, compiled by `rustc` for any machine of this kind.

use std::error::Error;
use std::fs;
use std::process::Command;

use grazemap::Map;
use grazemap::pipeline::EmitRequest;

use crate::measure::{OFFSET, RUNS, steps_of};

/// Program that times the emitted module `map`, and prints the nanoseconds of a step.
const PROGRAM: &str = r#"
use std::{hint::black_box, time::Instant};
mod map;
fn main() {
    let (state, parameters) = ([OFFSET; map::DIMENSION], [OFFSET; map::PARAMETERS]);
    let (mut image, mut depths) = ([0.0; map::DIMENSION], [0.0; map::PASSAGES]);
    let mut fastest = f64::INFINITY;
    for _ in 0..RUNS {
        let start = Instant::now();
        for _ in 0..STEPS {
            map::step_on_slices(black_box(&state), black_box(&parameters), &mut image, &mut depths);
            black_box(&mut image);
        }
        fastest = fastest.min(start.elapsed().as_secs_f64());
    }
    println!("{}", 1e9 * fastest / STEPS as f64);
}
"#;

/// Time of one step of an emitted map in nanoseconds, repeated at the same point.
pub(crate) fn compiled_step_ns(map: &Map, operations: usize) -> Result<f64, Box<dyn Error>> {
    let request = EmitRequest { measure: false, derivatives: false, ..EmitRequest::default() };
    let folder = tempfile::tempdir()?;
    fs::write(folder.path().join("map.rs"), &map.module(request)?.content)?;
    let constants = format!(
        "const OFFSET: f64 = {OFFSET:?};\nconst RUNS: usize = {RUNS};\nconst STEPS: usize = {};\n",
        steps_of(operations)
    );
    fs::write(folder.path().join("main.rs"), constants + PROGRAM)?;
    let arguments = ["--edition", "2021", "-O", "--cap-lints", "allow", "--cfg", "feature=\"std\""];
    let mut compiler = Command::new("rustc");
    compiler.args(arguments).args(["main.rs", "-o", "main"]).current_dir(folder.path());
    if !compiler.status()?.success() {
        return Err("the emitted map does not compile".into());
    }
    let output = Command::new(folder.path().join("main")).output()?;
    Ok(String::from_utf8(output.stdout)?.trim().parse()?)
}
