//! Maps emitted in JavaScript, WebAssembly, Python, Julia and MATLAB, run by their interpreters:
//! they equal the map in this process to the last bit. A language without an interpreter on the
//! machine is skipped, and the test prints so.

use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;

use grazemap::emission::{
    EmissionError, EmitOptions, EmittedCrate, EmittedShape, Target, emitted_module,
};
use grazemap::expansion::{ComposedMap, LocalMap, SectionKind};
use grazemap::iteration::{DifferentiableMap, DiscreteMap, HornerMap};
use grazemap::numeric::FloatFormat;

use crate::support::synthetic::{self, Numbers};

/// Interpreter of a language, with its program.
struct Interpreter {
    target: Target,
    /// Commands that may run it; the first one that works is used.
    commands: &'static [&'static [&'static str]],
    /// Program that a working interpreter runs without an error.
    probe: &'static str,
    file: &'static str,
    /// Program that prints, at every point, image, depth, Jacobian, derivatives, and whether it
    /// lies inside.
    program: &'static str,
}

const INTERPRETERS: [Interpreter; 5] = [
    Interpreter {
        target: Target::JavaScript,
        commands: &[&["node"]],
        probe: "",
        file: "program.mjs",
        program: "
import { readFileSync } from 'node:fs';
import * as map from './map_m.mjs';
for (const line of readFileSync('points.txt', 'utf8').trim().split('\\n')) {
  const numbers = line.split(' ').map(Number);
  const [state, parameters] = [numbers.slice(0, 2), numbers.slice(2)];
  const [image, depths, jacobian] = [[], [], []];
  const [again, deep] = [[], []];
  const made = map.stepJacobian(state, parameters, image, depths, jacobian);
  if (map.step(state, parameters, again, deep) !== made) throw new Error('contacts');
  if (String([again, deep]) !== String([image, depths])) throw new Error('frozen');
  const by = [];
  if (map.stepDerivatives(state, parameters, again, deep, by) !== made) throw new Error('contacts');
  if (String([again, deep]) !== String([image, depths])) throw new Error('derivatives');
  const inside = Number(map.inside(state, parameters));
  console.log([...image, ...depths, ...jacobian, ...by, inside].join(' '));
}
",
    },
    Interpreter {
        target: Target::Wasm,
        commands: &[&["node"]],
        probe: "",
        file: "program.mjs",
        program: "
import { readFileSync } from 'node:fs';
const module = new WebAssembly.Module(readFileSync('map_m.wasm'));
const [section] = WebAssembly.Module.customSections(module, 'grazemap');
const said = JSON.parse(new TextDecoder().decode(section));
const map = new WebAssembly.Instance(module).exports;
const names = ['DIMENSION', 'PARAMETERS', 'PASSAGES', 'COEFFICIENTS', 'LANES'];
const [D, P, S, C, LANES] = names.map((name) => map[name].value);
const ITERATES = 5;
map.memory.grow(2);
const memory = new Float64Array(map.memory.buffer);
let free = map.FREE_MEMORY.value;
const take = (count) => (free += 8 * count) - 8 * count;
const array = (at, count) => [...memory.subarray(at / 8, at / 8 + count)];
const [p, c, x, image, depths, jacobian, by] = [P, C, D, D, S, D * D, D * (D + P)].map(take);
const [ps, cs, xs, images, deep, extents] = [P, C, D, D, S, D + S].map((n) => take(n * LANES));
const record = LANES * (D + S);
const records = take(record * ITERATES);
const same = (a, b, what) => {
  if (!a.every((value, n) => Object.is(value + 0, b[n] + 0))) throw new Error(what);
};
const point = (state, parameters) => {
  memory.set(parameters, p / 8);
  memory.set(state, x / 8);
  map.freeze(p, c);
  return map.step(c, x, image, depths);
};
const lines = readFileSync('points.txt', 'utf8').trim().split('\\n');
const rows = lines.map((line) => line.split(' ').map(Number));
const within = (values, widths) => values.every((v, n) => Math.abs(v) <= widths[n]);
for (let first = 0; first < rows.length; first++) {
  const [state, parameters] = [rows[first].slice(0, D), rows[first].slice(D)];
  const made = point(state, parameters);
  const one = [...array(image, D), ...array(depths, S)];
  if (made !== array(depths, S).filter((depth) => depth > 0).length) throw new Error('contacts');
  map.step_jacobian(c, x, image, depths, jacobian);
  same([...array(image, D), ...array(depths, S)], one, 'jacobian');
  const inside = within(state, said.window_state) && within(parameters, said.window_parameters);
  map.step_derivatives(p, x, image, depths, by);
  same([...array(image, D), ...array(depths, S)], one, 'derivatives');
  const rest = [...array(jacobian, D * D), ...array(by, D * (D + P))];
  console.log([...one, ...rest, Number(inside)].join(' '));
  // The same points in lanes, and their iterates.
  const lane = (l) => rows[(first + l) % rows.length];
  for (let l = 0; l < LANES; l++) {
    for (let n = 0; n < D; n++) memory[xs / 8 + n * LANES + l] = lane(l)[n];
    for (let n = 0; n < P; n++) memory[ps / 8 + n * LANES + l] = lane(l)[D + n];
  }
  memory.fill(0, extents / 8, extents / 8 + record);
  map.freeze_lanes(ps, cs);
  map.step_lanes(cs, xs, images, deep);
  const lanes = [...array(images, D * LANES), ...array(deep, S * LANES)];
  map.iterate_lanes(cs, xs, extents, records, ITERATES, 8 * record);
  same(array(records, record), lanes, 'the first iterate');
  same(array(xs, D * LANES), array(records + 8 * record * (ITERATES - 1), D * LANES), 'the last');
  for (let l = 0; l < LANES; l++) {
    let at = lane(l).slice(0, D);
    const largest = new Array(D + S).fill(0);
    for (let iterate = 0; iterate < ITERATES; iterate++) {
      point(at, lane(l).slice(D));
      const found = [...array(image, D), ...array(depths, S)];
      const here = array(records + 8 * record * iterate, record).filter((_, n) => n % LANES === l);
      same(found, here, 'iterates');
      const reached = [...at.map(Math.abs), ...array(depths, S)];
      reached.forEach((value, n) => (largest[n] = Math.max(largest[n], value)));
      at = array(image, D);
    }
    same(largest, array(extents, record).filter((_, n) => n % LANES === l), 'extents');
  }
}
",
    },
    Interpreter {
        target: Target::Python,
        commands: &[&["target/python/bin/python3"], &["python3"]],
        probe: "import numpy",
        file: "program.py",
        program: "
import numpy as np
import map_m as m
rows = np.loadtxt('points.txt', ndmin=2)
image, depths, jacobian = m.step_jacobian(rows.T[:2], rows.T[2:])
*_, derivatives = m.step_derivatives(rows.T[:2], rows.T[2:])
for n, row in enumerate(rows):
    one = m.step_jacobian(row[:2], row[2:])
    again, deep = m.step(row[:2], row[2:])
    assert (again, deep) == one[:2]
    *same, by = m.step_derivatives(row[:2], row[2:])
    assert tuple(same) == one[:2]
    entries = [entry for line in (*one[2], *by) for entry in line]
    many = [entry for line in (*jacobian, *derivatives) for entry in line]
    numbers = [*again, *deep, *entries]
    together = [np.broadcast_to(v, len(rows))[n] for v in [*image, *depths, *many]]
    assert numbers == together, (numbers, together)
    print(*(repr(float(v)) for v in numbers), int(m.inside(row[:2], row[2:])))
",
    },
    Interpreter {
        target: Target::Julia,
        commands: &[&["julia"]],
        probe: "",
        file: "program.jl",
        program: "
include(\"map_m.jl\")
for line in eachline(\"points.txt\")
    row = parse.(Float64, split(line))
    image, depths, jacobian = map_m.step_jacobian(row[1:2], row[3:4])
    @assert (image, depths) == map_m.step(row[1:2], row[3:4])
    again, deep, by = map_m.step_derivatives(row[1:2], row[3:4])
    @assert (image, depths) == (again, deep)
    numbers = Float64[image..., depths..., jacobian[1]..., jacobian[2]..., by[1]..., by[2]...]
    println(join(numbers, \" \"), \" \", Int(map_m.inside(row[1:2], row[3:4])))
end
",
    },
    Interpreter {
        target: Target::Matlab,
        commands: &[&["octave-cli", "--no-gui", "--quiet"]],
        probe: "",
        file: "program.m",
        program: "
map = map_m();
rows = load('points.txt')';
[image, depths, jacobian] = map.step_jacobian(rows(1:2, :), rows(3:4, :));
[again, deep] = map.step(rows(1:2, :), rows(3:4, :));
assert(isequal([again; deep], [image; depths]));
[again, deep, by] = map.step_derivatives(rows(1:2, :), rows(3:4, :));
assert(isequal([again; deep], [image; depths]));
inside = map.inside(rows(1:2, :), rows(3:4, :));
fprintf([repmat('%.17g ', 1, 15), '%d\\n'], [image; depths; jacobian; by; inside]);
",
    },
];

/// Command that runs a language on this machine, if there is one.
fn command_of(interpreter: &Interpreter) -> Option<Vec<PathBuf>> {
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let whole = |words: &&[&str]| {
        let mut words = words.iter();
        let first = words.next().map(|&word| match word.contains('/') {
            true => root.join(word),
            false => PathBuf::from(word),
        });
        first.into_iter().chain(words.map(PathBuf::from)).collect::<Vec<_>>()
    };
    let works = |words: &Vec<PathBuf>| {
        let flag = if interpreter.probe.is_empty() { "--version" } else { "-c" };
        let mut command = Command::new(&words[0]);
        command.arg(flag);
        if !interpreter.probe.is_empty() {
            command.arg(interpreter.probe);
        }
        command.output().is_ok_and(|output| output.status.success())
    };
    interpreter.commands.iter().map(whole).find(works)
}

/// Output of a map's module in a language at points; `None` if the language cannot be run.
fn run(
    interpreter: &Interpreter,
    (map, composed): (&LocalMap, Option<&ComposedMap>),
    points: &[([f64; 2], [f64; 2])],
) -> Option<Vec<Vec<f64>>> {
    let words = command_of(interpreter)?;
    let folder = tempfile::tempdir().expect("the test can be set up");
    let shape = match composed {
        Some(_) => EmittedShape::Composed,
        None => EmittedShape::Factored,
    };
    let options = EmitOptions { target: interpreter.target, shape, ..EmitOptions::default() };
    let module = emitted_module(map, composed, &options).expect("the map is emitted");
    let crates = EmittedCrate::standalone(&module).expect("the map is emitted");
    for (path, text) in &crates.files {
        // NOTE: node recognises a module by its extension.
        let path = path.replace(".js", ".mjs");
        fs::write(folder.path().join(path), text).expect("the test can be set up");
    }
    let line = |(state, parameters): &([f64; 2], [f64; 2])| {
        let [a, b] = state;
        let [c, d] = parameters;
        format!("{a:?} {b:?} {c:?} {d:?}\n")
    };
    let text: String = points.iter().map(line).collect();
    fs::write(folder.path().join("points.txt"), text).expect("the test can be set up");
    fs::write(folder.path().join(interpreter.file), interpreter.program)
        .expect("the test can be set up");
    let output = Command::new(&words[0])
        .args(&words[1..])
        .arg(interpreter.file)
        .current_dir(folder.path())
        .output()
        .expect("it was found");
    let said = String::from_utf8_lossy(&output.stderr);
    assert!(output.status.success(), "{}: {said}", interpreter.target.word());
    let text = String::from_utf8(output.stdout).expect("numbers");
    let line = |line: &str| line.split(' ').map(|word| word.parse().expect("a number")).collect();
    Some(text.lines().map(line).collect())
}

/// Output expected from the map in this process.
fn expected(map: &HornerMap, points: &[([f64; 2], [f64; 2])]) -> Vec<Vec<f64>> {
    let states = points.iter().flat_map(|(state, _)| *state).collect::<Vec<_>>();
    let parameters = points.iter().flat_map(|(_, own)| *own).collect::<Vec<_>>();
    let depths = map.batch(&states, &parameters, false);
    let row = |(number, (state, own)): (usize, &([f64; 2], [f64; 2]))| {
        let (mut image, mut jacobian) = ([0.0; 2], [0.0; 4]);
        map.step_jacobian(state, own, &mut image, &mut jacobian);
        let depth = depths.rows[number * depths.width + 2];
        let mut derivatives = [0.0; 8];
        map.step_derivatives(state, own, &mut image, &mut derivatives);
        [&image[..], &[depth], &jacobian, &derivatives, &[1.0]].concat()
    };
    points.iter().enumerate().map(row).collect()
}

#[test]
fn maps_in_languages_that_interpret_equal_the_map_in_process() {
    let mut numbers = Numbers::new(9);
    let points: Vec<_> = (0..100).map(|_| synthetic::point(&mut numbers)).collect();
    let named = |mut map: LocalMap| {
        map.scene = "m".into();
        map
    };
    let stroboscopic = named(synthetic::map(4, 5, SectionKind::Stroboscopic));
    let tangency = named(synthetic::map(3, 4, SectionKind::Tangency));
    let composed = synthetic::composed(6);
    for interpreter in &INTERPRETERS {
        let word = interpreter.target.word();
        for (map, one_pass) in [(&stroboscopic, None), (&tangency, Some(&composed))] {
            let Some(found) = run(interpreter, (map, one_pass), &points) else {
                println!("left out: no interpreter of {word} on this machine");
                continue;
            };
            let exact = match one_pass {
                Some(composed) => HornerMap::composed(map, composed),
                None => HornerMap::new(map),
            };
            let bits = |rows: &[Vec<f64>]| -> Vec<Vec<u64>> {
                let row = |row: &Vec<f64>| row.iter().map(|v| (v + 0.0).to_bits()).collect();
                rows.iter().map(row).collect()
            };
            assert_eq!(bits(&found), bits(&expected(&exact, &points)), "{word}");
        }
    }
}

#[test]
fn languages_of_doubles_refuse_single_precision() {
    let map = synthetic::map(3, 4, SectionKind::Tangency);
    for interpreter in &INTERPRETERS {
        let options = EmitOptions {
            target: interpreter.target,
            precision: FloatFormat::F32,
            ..EmitOptions::default()
        };
        let refused = emitted_module(&map, None, &options);
        assert!(matches!(refused, Err(EmissionError::SingleInDouble { .. })));
    }
}
