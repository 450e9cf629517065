//! Maps emitted in C and CUDA are compiled as C, run, and compared with the map evaluated from its
//! jets.
//!
//! On the CPU, CUDA's keywords are defined as macros that run the threads one after another, so
//! that the same source runs as C. If a CUDA compiler is installed, it compiles the source as well.

use std::fmt::Write as _;
use std::fs;
use std::path::Path;
use std::process::Command;

use grazemap::emission::{
    EmitOptions, EmittedCrate, EmittedModule, EmittedShape, Target, emitted_module,
};
use grazemap::expansion::{ComposedMap, Expander, LocalMap, MapOrders, SectionKind};
use grazemap::iteration::{
    DifferentiableMap, DiscreteMap, HornerMap, MapOrbit, OrbitRequest, Period,
};

use crate::support::scenes::grazing;
use crate::support::synthetic::{self, Numbers};

/// Definitions of CUDA's keywords for the CPU: threads of two blocks, one after another.
const SHIM: &str = "
#include <stdio.h>
#include <string.h>
#define __CUDACC__
#define __global__
#define __host__
#define __device__
static struct { unsigned x; } blockIdx, blockDim = {4}, threadIdx;
#define LAUNCH(call) for (blockIdx.x = 0; blockIdx.x < 2; blockIdx.x++) \\
    for (threadIdx.x = 0; threadIdx.x < blockDim.x; threadIdx.x++) call
";

fn emitted(
    map: &LocalMap,
    composed: Option<&ComposedMap>,
    target: Target,
    shape: EmittedShape,
) -> EmittedModule {
    let options = EmitOptions { target, shape, ..EmitOptions::default() };
    emitted_module(map, composed, &options).expect("the test can be set up")
}

/// Writes the files of an emission and returns the name of its only one.
fn write(module: &EmittedModule, folder: &Path) -> String {
    let files = EmittedCrate::standalone(module).expect("the test can be set up").files;
    assert_eq!(files.len(), 1);
    for (path, text) in &files {
        fs::write(folder.join(path), text).expect("the test can be set up");
    }
    files.into_keys().next().expect("one file")
}

/// Runs a compiler, which must not print anything.
fn compile(compiler: &str, arguments: &[&str], folder: &Path) {
    let strict = ["-Wall", "-Wextra", "-pedantic", "-Werror", "-O1"];
    let output = Command::new(compiler)
        .args(strict)
        .args(arguments)
        .current_dir(folder)
        .output()
        .expect("a linker that Rust needs compiles C as well");
    let said = String::from_utf8_lossy(&output.stderr);
    assert!(output.status.success(), "{said}");
}

/// Compiles a program in C99 and returns the numbers that it prints, line by line.
fn run(program: &str, folder: &Path) -> Vec<Vec<f64>> {
    fs::write(folder.join("program.c"), program).expect("the test can be set up");
    let arguments = ["-std=c99", "program.c", "-o", "program", "-lm"];
    compile("cc", &arguments, folder);
    let output = Command::new(folder.join("program")).output().expect("it was compiled");
    assert!(output.status.success(), "{:?}", output.status);
    let text = String::from_utf8(output.stdout).expect("numbers");
    let line = |line: &str| line.split(' ').map(|word| word.parse().expect("a number")).collect();
    text.lines().map(line).collect()
}

/// An initialiser of an array of arrays.
fn rows(rows: impl Iterator<Item = Vec<f64>>) -> String {
    let row = |row: Vec<f64>| {
        let numbers: Vec<String> = row.iter().map(|value| format!("{value:?}")).collect();
        format!("{{{}}}", numbers.join(", "))
    };
    rows.map(row).collect::<Vec<_>>().join(",\n")
}

fn named(name: &str, mut map: LocalMap) -> LocalMap {
    map.scene = name.into();
    map
}

/// Program that prints image, depth, contacts and Jacobian at every point, and fails if forms or
/// kernels differ in a bit.
fn stepping_program(name: &str, file: &str, points: &[([f64; 2], [f64; 2])]) -> String {
    let points = rows(points.iter().map(|(state, parameters)| [*state, *parameters].concat()));
    let mut text = String::new();
    let body = "
static const double points[][4] = {POINTS};
int main(void)
{
    const int count = sizeof points / sizeof points[0];
    for (int n = 0; n < count; n++) {
        const double *state = points[n], *parameters = points[n] + 2;
        double image[2], depths[1], jacobian[4], again[2], all[5 * 2], images[5 * 2], deep[5], frozen[NAME_COEFFICIENTS];
        double parameter[5 * 2], derivatives[8];
        int contacts = m_step_jacobian(state, parameters, image, depths, jacobian), made[5];
        if (m_step(state, parameters, again, depths) != contacts || memcmp(image, again, sizeof image)) return 1;
        if (m_step_derivatives(state, parameters, again, depths, derivatives) != contacts) return 5;
        if (memcmp(image, again, sizeof image)) return 6;
        m_freeze(parameters, frozen);
        if (m_step_frozen(frozen, state, again, depths) != contacts || memcmp(image, again, sizeof image)) return 2;
        if (!m_inside(state, parameters)) return 3;
        for (int k = 0; k < 10; k++) { all[k] = state[k / 5]; parameter[k] = parameters[k / 5]; }
        LAUNCH(m_steps(5, all, parameter, images, deep, made);)
        for (int k = 0; k < 5; k++)
            if (images[k] != image[0] || images[5 + k] != image[1] || deep[k] != depths[0] || made[k] != contacts) return 4;
        printf(\"%.17g %.17g %.17g %d\", image[0], image[1], depths[0], contacts);
        for (int k = 0; k < 4; k++) printf(\" %.17g\", jacobian[k]);
        for (int k = 0; k < 8; k++) printf(\" %.17g\", derivatives[k]);
        printf(\"\\n\");
    }
    return 0;
}
";
    let body =
        body.replace("POINTS", &points).replace("NAME_", &format!("{}_", name.to_uppercase()));
    write!(text, "{SHIM}#include \"{file}\"\n{}", body.replace("m_", &format!("{name}_")))
        .expect("memory");
    text
}

#[test]
fn cuda_sources_run_as_c_and_equal_the_interpreted_map() {
    let mut numbers = Numbers::new(5);
    let points: Vec<_> = (0..100).map(|_| synthetic::point(&mut numbers)).collect();
    let composed = synthetic::composed(6);
    let tangency = named("tangency", synthetic::map(3, 4, SectionKind::Tangency));
    let stroboscopic = named("stroboscopic", synthetic::map(4, 5, SectionKind::Stroboscopic));
    let long = named("long", synthetic::map(7, 8, SectionKind::Tangency));
    let pass = named("pass", synthetic::map(3, 4, SectionKind::Tangency));
    let factored = |map: LocalMap| {
        let module = emitted(&map, None, Target::Cuda, EmittedShape::Factored);
        (HornerMap::new(&map), module)
    };
    let one_pass = emitted(&pass, Some(&composed), Target::Cuda, EmittedShape::Composed);
    let mut maps: Vec<_> = [tangency, stroboscopic, long].map(factored).into();
    maps.push((HornerMap::composed(&pass, &composed), one_pass));
    let mut touched = 0;
    for (map, module) in &maps {
        let folder = tempfile::tempdir().expect("the test can be set up");
        let file = write(module, folder.path());
        let found = run(&stepping_program(&module.identifier, &file, &points), folder.path());
        assert_eq!(found.len(), points.len());
        for ((state, parameters), found) in points.iter().zip(&found) {
            let (mut image, mut jacobian) = ([0.0; 2], [0.0; 4]);
            let info = map.step_jacobian(state, parameters, &mut image, &mut jacobian);
            let mut derivatives = [0.0; 8];
            map.step_derivatives(state, parameters, &mut image, &mut derivatives);
            let expected = [&image[..], &jacobian, &derivatives].concat();
            let found_numbers = [&found[..2], &found[4..]].concat();
            for (found, expected) in found_numbers.iter().zip(&expected) {
                // The compilers may fuse where the interpreter does not; Jacobians hold 1/y.
                assert!(
                    (found - expected).abs() <= 1e-12 * expected.abs().max(1.0),
                    "{found} {expected}"
                );
            }
            assert_eq!(found[3], f64::from(info.contacts()));
            touched += info.contacts();
        }
    }
    assert!((100..300).contains(&touched), "{touched} of 400 points touch");
}

#[test]
fn a_chart_finds_the_periods_that_orbits_of_the_interpreted_map_have() {
    let (scene, orbit) = grazing("cantilever_3_5_soft");
    let orders = MapOrders { smooth_order: 3, contact_weight: 4 };
    let map = Expander::new(&scene, &orbit).and_then(|expander| expander.expand(orders));
    let map = map.expect("a simple graze");
    let interpreted = HornerMap::new(&map);
    let sweep: Vec<Vec<f64>> = (0..160).map(|n| vec![-2e-5 + 2e-6 * f64::from(n), 0.0]).collect();
    let module = emitted(&map, None, Target::Cuda, EmittedShape::Factored);
    let folder = tempfile::tempdir().expect("the test can be set up");
    let file = write(&module, folder.path());
    let program = "
static const double parameters[][2] = {POINTS};
int main(void)
{
    for (unsigned n = 0; n < sizeof parameters / sizeof parameters[0]; n++) {
        double state[2] = {0.0, 0.0};
        m_attractor found;
        LAUNCH(m_chart(1, state, parameters[n], 20000, 24, 1e-10, &found);)
        printf(\"%d %d %d %.17g %.17g\\n\", found.period, found.contacts, found.left > 0, state[0], state[1]);
    }
    return 0;
}
";
    let program = program
        .replace("POINTS", &rows(sweep.iter().cloned()))
        .replace("m_", "cantilever_3_5_soft_");
    let found = run(&format!("{SHIM}#include \"{file}\"\n{program}"), folder.path());
    let mut periods = std::collections::BTreeSet::new();
    let mut request = OrbitRequest::new(20_000, 96, &map.window.state);
    request.period_tolerance = 1e-7;
    for (parameters, found) in sweep.iter().zip(&found) {
        let orbit = MapOrbit::of(&interpreted, &[0.0; 2], parameters, &request);
        // An orbit that still approaches its period is judged by the tolerance.
        let Period::Periodic(period @ 1..=24) = orbit.period else {
            continue;
        };
        let contacts = orbit.contacts_per_period().expect("periodic").contacts;
        assert_eq!(found[..2], [period as f64, f64::from(contacts)], "{parameters:?}");
        periods.insert((contacts, period));
    }
    assert!(periods.len() >= 3, "{periods:?}");
}

#[test]
fn an_orbit_that_leaves_says_so() {
    let map = named("leaving", synthetic::map(3, 4, SectionKind::Tangency));
    let module = emitted(&map, None, Target::C, EmittedShape::Factored);
    let folder = tempfile::tempdir().expect("the test can be set up");
    let file = write(&module, folder.path());
    let program = format!(
        "#include <stdio.h>\n#include \"{file}\"
int main(void)
{{
    const double window[] = LEAVING_WINDOW_PARAMETERS;
    const double parameters[][2] = {{{{0.0, 0.0}}, {{0.0, 0.0}}, {{1.1 * window[0], 0.0}}}};
    double states[][2] = {{{{1e3, 0.0}}, {{0.0, 0.0}}, {{0.0, 0.0}}}};
    for (int n = 0; n < 3; n++) {{
        leaving_attractor found = leaving_settle(parameters[n], states[n], n == 0 ? 50 : 1, n == 0 ? 3 : 0, 1e-9);
        printf(\"%d %lld %d\\n\", found.period, found.left, leaving_inside(states[n], parameters[n]));
    }}
    return 0;
}}
"
    );
    let escaped_inside_and_beyond = [[-1.0, 1.0, 0.0], [0.0, 0.0, 1.0], [0.0, 1.0, 0.0]];
    assert_eq!(run(&program, folder.path()), escaped_inside_and_beyond);
}

#[test]
fn one_header_is_c_and_a_shared_library_and_the_kernels_are_cuda() {
    let map = named("tangency", synthetic::map(3, 4, SectionKind::Tangency));
    let folder = tempfile::tempdir().expect("the test can be set up");
    let header = write(&emitted(&map, None, Target::C, EmittedShape::Factored), folder.path());
    for standard in ["-std=c99", "-std=c11"] {
        compile("cc", &[standard, "-fsyntax-only", "-x", "c", &header], folder.path());
    }
    let shared =
        ["-shared", "-fPIC", "-DGRAZEMAP_LINKAGE=", "-x", "c", &header, "-o", "tangency.so"];
    compile("cc", &shared, folder.path());
    let library = fs::read(folder.path().join("tangency.so")).expect("it was compiled");
    let exported = |name: &[u8]| library.windows(name.len()).any(|bytes| bytes == name);
    assert!(exported(b"tangency_step_jacobian\0") && exported(b"tangency_settle\0"));
    let kernels = write(&emitted(&map, None, Target::Cuda, EmittedShape::Factored), folder.path());
    if Command::new("nvcc").arg("--version").output().is_ok() {
        let compiled =
            Command::new("nvcc").args(["-c", &kernels]).current_dir(folder.path()).output();
        assert!(compiled.expect("a compiler of CUDA").status.success());
    }
}
