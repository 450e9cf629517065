//! Compiles emitted modules into a program and runs it, in their number format.

use std::fs;
use std::io::Write;
use std::path::Path;
use std::process::{Command, Stdio};

use grazemap::emission::EmittedModule;
use grazemap::numeric::FloatFormat;

/// Compiles, with warnings as errors.
pub(crate) fn rustc(arguments: &[&str], folder: &Path) {
    let output = Command::new("rustc")
        .args(["--edition", "2021", "-D", "warnings"])
        .args(arguments)
        .current_dir(folder)
        .output()
        .expect("the test can be set up");
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
}

/// A program that reads `module x0 x1 p0 p1` (bits of their numbers) and prints image, depth and
/// Jacobian (bits), after checking that frozen and lane forms agree with the step bit for bit.
fn driver(modules: &[&EmittedModule]) -> String {
    let mut text = String::new();
    for module in modules {
        text += &format!("mod {};\n", module.identifier);
    }
    text += "fn main() {\n    for line in std::io::stdin().lines() {\n        let line = line.unwrap();\n";
    text += "        let mut words = line.split(' ');\n        let name = words.next().unwrap();\n";
    text += "        let n: Vec<f64> = words.map(|word| f64::from_bits(word.parse().unwrap())).collect();\n";
    text +=
        "        let (state, parameters) = ([n[0], n[1]], [n[2], n[3]]);\n        match name {\n";
    for module in modules {
        let name = &module.identifier;
        text += &format!("            \"{name}\" => {{\n");
        text += &format!("                use {name} as m;\n");
        text += "                let found = m::step_jacobian(state, parameters);\n                let step = m::step(state, parameters);\n";
        text += "                assert_eq!(step, found.step);\n";
        text += "                assert_eq!(step, m::Frozen::new(parameters).step(state));\n";
        text += "                assert_eq!(found, m::freeze(parameters).step_jacobian(state));\n";
        text += "                let (states, all) = (state.map(|x| [x; m::LANES]), parameters.map(|p| [p; m::LANES]));\n";
        text += "                let lanes = m::step_lanes(&states, &all);\n";
        text += "                assert_eq!(lanes, m::freeze(parameters).step_lanes(&states));\n";
        text += "                assert_eq!(lanes.image, step.image.map(|x| [x; m::LANES]));\n";
        text += "                assert_eq!(lanes.contacts, [step.contacts; m::LANES]);\n";
        text += "                assert!(m::inside(state, parameters) && !m::inside([0.3, 0.0], parameters));\n";
        text += "                let (mut image, mut depths, mut jacobian) = ([0.0; 2], [0.0; m::PASSAGES], [0.0; 4]);\n";
        text += "                let contacts = m::step_jacobian_on_slices(&state, &parameters, &mut image, &mut depths, &mut jacobian);\n";
        text += "                assert_eq!((image, depths, contacts), (step.image, step.depths, Some(step.contacts)));\n";
        text += "                assert_eq!(m::step_on_slices(&state[1..], &parameters, &mut image, &mut depths), None);\n";
        text += "                let found = m::step_derivatives(state, parameters);\n";
        text += "                assert_eq!(found.step, step);\n";
        text += "                let mut derivatives = [0.0; 8];\n";
        text += "                m::step_derivatives_on_slices(&state, &parameters, &mut image, &mut depths, &mut derivatives).unwrap();\n";
        text += "                assert_eq!(found.derivatives.as_flattened(), derivatives);\n";
        text += "                let numbers = image.iter().chain(&depths).chain(&jacobian).chain(&derivatives);\n";
        text += "                println!(\"{}\", numbers.map(|x| x.to_bits().to_string()).collect::<Vec<_>>().join(\" \"));\n";
        text += "            }\n";
    }
    text += "            _ => unreachable!(),\n        }\n    }\n}\n";
    text.replace("f64", &precision(modules).to_string())
}

/// Number format of the modules, which must be the same.
fn precision(modules: &[&EmittedModule]) -> FloatFormat {
    let same = modules.windows(2).all(|pair| pair[0].precision == pair[1].precision);
    assert!(same, "one program runs in one kind of numbers");
    modules[0].precision
}

/// Builds the driver in a fresh folder and answers with one line of numbers per query.
pub(crate) fn run(modules: &[&EmittedModule], queries: &[String]) -> Vec<Vec<f64>> {
    let folder = tempfile::tempdir().expect("the test can be set up");
    for module in modules {
        fs::write(folder.path().join(format!("{}.rs", module.identifier)), &module.content)
            .expect("the test can be set up");
    }
    fs::write(folder.path().join("main.rs"), driver(modules)).expect("the test can be set up");
    let arguments = ["-A", "dead_code", "main.rs", "-o", "driver"];
    rustc(&[&optimised()[..], &arguments].concat(), folder.path());
    let text = answers(&folder.path().join("driver"), queries);
    let single = precision(modules) == FloatFormat::F32;
    let number = |word: &str| {
        let bits: u64 = word.parse().expect("the test can be set up");
        if single {
            f64::from(f32::from_bits(u32::try_from(bits).expect("bits of a single")))
        } else {
            f64::from_bits(bits)
        }
    };
    text.lines().map(|line| line.split(' ').map(number).collect()).collect()
}

/// Options of `rustc` for emitted code that is compared with the interpreter of this process.
pub(crate) fn optimised() -> Vec<&'static str> {
    let mut options = vec!["-O", "--cfg", "feature=\"std\""];
    if cfg!(target_feature = "fma") {
        // Products and sums are fused in both, or in neither.
        options.push("-Ctarget-feature=+fma");
    }
    options
}

/// Output of a program that answers with one line per query.
pub(crate) fn answers(program: &Path, queries: &[String]) -> String {
    let mut child = Command::new(program)
        .stdin(Stdio::piped())
        .stdout(Stdio::piped())
        .spawn()
        .expect("the test can be set up");
    let text = queries.join("\n");
    let mut input = child.stdin.take().expect("the test can be set up");
    let writer = std::thread::spawn(move || {
        input.write_all(text.as_bytes()).expect("the test can be set up")
    });
    let output = child.wait_with_output().expect("the test can be set up");
    writer.join().expect("the test can be set up");
    assert!(output.status.success());
    String::from_utf8(output.stdout).expect("the test can be set up")
}
