//! Maps emitted in single precision, in Rust and in C, are compiled, run, and compared with the
//! interpreted ones to the bit.

use std::fs;
use std::process::Command;

use grazemap::emission::{
    EmissionError, EmitOptions, EmittedCrate, EmittedModule, EmittedShape, Target, emitted_module,
};
use grazemap::expansion::{LocalMap, SectionKind, Stage};
use grazemap::iteration::{DiscreteMap, HornerMap, SingleMap};
use grazemap::numeric::FloatFormat;

use crate::support::driver;
use crate::support::synthetic::{self, Numbers};

/// State and parameters.
type Point = ([f32; 2], [f32; 2]);

fn named(name: &str, mut map: LocalMap) -> LocalMap {
    map.scene = name.into();
    map
}

fn single(target: Target, shape: EmittedShape) -> EmitOptions {
    EmitOptions { target, shape, precision: FloatFormat::F32, lanes: 16, ..EmitOptions::default() }
}

/// Maps of both shapes, the longest printed in blocks, with their emissions.
fn maps(target: Target) -> Vec<(SingleMap, EmittedModule)> {
    let factored = |name: &str, smooth: u32, weight: u32, kind: SectionKind| {
        let map = named(name, synthetic::map(smooth, weight, kind));
        let module = emitted_module(&map, None, &single(target, EmittedShape::Factored));
        let module = module.expect("the test can be set up");
        (HornerMap::new(&map).in_single(), module)
    };
    let composed = synthetic::composed(6);
    let pass = named("pass", synthetic::map(3, 4, SectionKind::Tangency));
    let options = single(target, EmittedShape::Composed);
    let module = emitted_module(&pass, Some(&composed), &options).expect("the test can be set up");
    vec![
        factored("tangency", 3, 4, SectionKind::Tangency),
        factored("stroboscopic", 4, 5, SectionKind::Stroboscopic),
        factored("long", 7, 8, SectionKind::Tangency),
        (HornerMap::composed(&pass, &composed).in_single(), module),
    ]
}

fn points(count: usize) -> Vec<Point> {
    let mut numbers = Numbers::new(5);
    let single = |values: [f64; 2]| values.map(|value| value as f32);
    (0..count)
        .map(|_| synthetic::point(&mut numbers))
        .map(|(state, parameters)| (single(state), single(parameters)))
        .collect()
}

/// Image, Jacobian and number of contacts, interpreted.
fn interpreted(map: &SingleMap, (state, parameters): &Point) -> (Vec<f64>, u32) {
    let wide = |values: &[f32; 2]| values.map(f64::from);
    let (mut image, mut jacobian) = ([0.0; 2], [0.0; 4]);
    let (state, parameters) = (wide(state), wide(parameters));
    let info = map.step_jacobian(&state, &parameters, &mut image, &mut jacobian);
    let mut again = [0.0; 2];
    assert_eq!(map.step(&state, &parameters, &mut again), info);
    assert_eq!(again, image);
    ([&image[..], &jacobian].concat(), info.contacts())
}

#[test]
fn compiled_single_maps_give_the_bits_of_the_interpreted_ones() {
    let (maps, points) = (maps(Target::Rust), points(100));
    let query = |(module, point): (&EmittedModule, &Point)| {
        let numbers = point.0.iter().chain(&point.1);
        let bits: Vec<String> = numbers.map(|x| x.to_bits().to_string()).collect();
        format!("{} {}", module.identifier, bits.join(" "))
    };
    let modules: Vec<&EmittedModule> = maps.iter().map(|(_, module)| module).collect();
    let pairs = modules.iter().flat_map(|&module| points.iter().map(move |point| (module, point)));
    let answers = driver::run(&modules, &pairs.map(query).collect::<Vec<_>>());
    assert_eq!(answers.len(), maps.len() * points.len());
    let mut touched = 0;
    for (number, answer) in answers.iter().enumerate() {
        let map = &maps[number / points.len()].0;
        let (expected, contacts) = interpreted(map, &points[number % points.len()]);
        // The image, the depth, the Jacobian.
        assert_eq!([&answer[..2], &answer[3..7]].concat(), expected);
        assert_eq!(answer[2] > 0.0, contacts == 1);
        touched += contacts;
    }
    assert!((100..300).contains(&touched), "{touched} of 400 touch");
}

/// CUDA's keywords are defined for the CPU as in `tests/emission/c.rs`: the kernels run as C, one
/// thread at a time.
const PROGRAM: &str = "
#include <stdio.h>
#include <string.h>
#define __CUDACC__
#define __global__
#define __host__
#define __device__
static struct { unsigned x; } blockIdx, blockDim = {1}, threadIdx;
#include \"NAME.cu\"
static const float points[][4] = {POINTS};
static const double from[] = LARGE_POINT;
static const float widths[] = LARGE_WINDOW_STATE;
int main(void)
{
    for (unsigned n = 0; n < sizeof points / sizeof points[0]; n++) {
        const float *state = points[n], *parameters = points[n] + 2;
        float image[2], depths[1], jacobian[4], again[2], frozen[LARGE_COEFFICIENTS], left[2];
        int contacts = NAME_step_jacobian(state, parameters, image, depths, jacobian), made;
        NAME_freeze(parameters, frozen);
        if (NAME_step_frozen(frozen, state, again, depths) != contacts || memcmp(image, again, sizeof image)) return 1;
        NAME_steps(1, state, parameters, again, depths, &made);
        if (made != contacts || memcmp(image, again, sizeof image)) return 2;
        if (!NAME_inside(state, parameters) || from[0] != 0.5 || widths[0] != 0.2f) return 3;
        memcpy(left, state, sizeof left);
        if (NAME_settle(parameters, left, 3, 2, 1e30f).period != 1) return 4;
        printf(\"%.9g %.9g %d\", (double)image[0], (double)image[1], contacts);
        for (int k = 0; k < 4; k++) printf(\" %.9g\", (double)jacobian[k]);
        printf(\"\\n\");
    }
    return 0;
}
";

#[test]
fn single_maps_in_c_give_the_bits_of_the_interpreted_ones() {
    let points = points(100);
    let row = |(state, parameters): &Point| {
        let numbers = state.iter().chain(parameters);
        let numbers: Vec<String> = numbers.map(|value| format!("{value:?}f")).collect();
        format!("{{{}}}", numbers.join(", "))
    };
    let rows: Vec<String> = points.iter().map(row).collect();
    let folder = tempfile::tempdir().expect("the test can be set up");
    for (map, module) in maps(Target::Cuda) {
        let name = &module.identifier;
        let files = EmittedCrate::standalone(&module).expect("one file").files;
        for (path, content) in &files {
            let text = String::from_utf8_lossy(content);
            assert!(!text.contains("double") && text.contains("float"));
            fs::write(folder.path().join(path), content).expect("the test can be set up");
        }
        let program = PROGRAM
            .replace("POINTS", &rows.join(",\n"))
            .replace("NAME", name)
            .replace("LARGE", &name.to_uppercase());
        let found = run(&program, folder.path());
        for (point, found) in points.iter().zip(&found) {
            let (expected, contacts) = interpreted(&map, point);
            assert_eq!([&found[..2], &found[3..]].concat(), expected);
            assert_eq!(found[2], f64::from(contacts));
        }
        assert_eq!(found.len(), points.len());
    }
}

/// Compiles a program in C99, which must not print anything, and returns the single-precision
/// numbers that it prints.
fn run(program: &str, folder: &std::path::Path) -> Vec<Vec<f64>> {
    fs::write(folder.join("program.c"), program).expect("the test can be set up");
    let mut compiler = Command::new("cc");
    compiler.args(["-std=c99", "-Wall", "-Wextra", "-pedantic", "-Werror"]);
    compiler.args(["-Wdouble-promotion", "-O1", "-ffp-contract=off"]);
    if cfg!(target_feature = "fma") {
        // As the interpreter in this process: fused or not.
        compiler.arg("-mfma");
    }
    let compiler = compiler.args(["program.c", "-o", "program", "-lm"]);
    let output = compiler.current_dir(folder).output();
    let output = output.expect("a linker that Rust needs compiles C as well");
    let said = String::from_utf8_lossy(&output.stderr);
    assert!(output.status.success(), "{said}");
    let output = Command::new(folder.join("program")).output();
    let output = output.expect("it was compiled");
    assert!(output.status.success(), "{:?}", output.status);
    let number = |word: &str| f64::from(word.parse::<f32>().expect("a number"));
    let text = String::from_utf8(output.stdout).expect("numbers");
    text.lines().map(|line| line.split(' ').map(number).collect()).collect()
}

/// Nine decimal digits distinguish single-precision numbers; sums of some hundred terms of size up
/// to 0.2 are rounded to a few 2⁻²⁴.
#[test]
fn single_precision_is_as_far_from_double_as_its_roundings() {
    let map = synthetic::map(4, 5, SectionKind::Stroboscopic);
    let double = HornerMap::new(&map);
    let single = double.in_format(FloatFormat::F32);
    let mut largest: f64 = 0.0;
    for (state, parameters) in points(100) {
        let (state, parameters) = (state.map(f64::from), parameters.map(f64::from));
        let (mut exact, mut rounded) = ([0.0; 2], [0.0; 2]);
        double.step(&state, &parameters, &mut exact);
        single.step(&state, &parameters, &mut rounded);
        let differences = exact.iter().zip(&rounded).map(|(a, b)| (a - b).abs());
        largest = differences.fold(largest, f64::max);
    }
    let roundings = largest / FloatFormat::F32.roundoff();
    assert!((0.05..10.0).contains(&roundings), "{roundings}");
}

#[test]
fn what_single_precision_cannot_hold_is_refused() {
    let mut map = named("large", synthetic::map(1, 1, SectionKind::Tangency));
    let rust = single(Target::Rust, EmittedShape::Factored);
    assert!(emitted_module(&map, None, &rust).is_ok());
    map.window.state[0] = 1e39;
    let refused = emitted_module(&map, None, &rust);
    assert!(matches!(refused, Err(EmissionError::TooLarge { .. })));
    map.window.state[0] = f64::INFINITY;
    let Some(Stage::Leg(leg)) = map.stages.last_mut() else {
        unreachable!("the last stage is a leg")
    };
    leg.image[0].coefficients_mut()[1] = 1e39;
    let refused = emitted_module(&map, None, &rust).expect_err("too large");
    let message = refused.to_string();
    assert!(message.contains("1e39") && message.contains("single"));
    assert!(emitted_module(&map, None, &EmitOptions::default()).is_ok());
}

#[test]
fn the_registry_of_the_catalogue_is_of_maps_in_double_precision() {
    let modules: Vec<EmittedModule> = maps(Target::Rust).into_iter().map(|pair| pair.1).collect();
    assert!(matches!(
        EmittedCrate::catalogue(&modules),
        Err(EmissionError::SingleInCatalogue { name }) if name == "tangency"
    ));
}
