//! Direct simulation of orbits that graze to within rounding: a contact that is almost none has
//! almost no effect. The oracle is the same simulation in double-double, in which these contacts
//! are deep.

use grazemap::analysis::{DirectEnd, DirectImage, DirectMap};
use grazemap::hybrid::HybridSystem;
use grazemap::iteration::{DiscreteMap, StepInfo};
use grazemap::model::{Model, Scene};
use grazemap::numeric::Dd;
use grazemap::orbit::GrazingOrbit;
use xtask::near_grazing::passages;

use crate::scattered;
use crate::support::needs_wide_registers;
use crate::support::scenes::{grazing_by, text};

/// A cart between two buffers, which it grazes on both sides in each period.
const CART: &str = r#"
[model]
name = "a cart between two buffers"
states = ["x", "v"]
parameters = { zeta = 0.1, gap = 1.0, k = 20.0, c = 0.5, F = 1.0, omega = 1.5, eps = 0.1 }
[model.phase]
name = "theta"
rate = "omega"
period = "2*pi"
[model.flow]
x = "v"
v = "F*cos(theta) - 2*zeta*v - x - eps*x^3"
[[model.surface]]
name = "right"
event = "gap - x"
contact = { v = "free - k*(x - gap) - c*v" }
[[model.surface]]
name = "left"
event = "gap + x"
contact = { v = "free - k*(x + gap) - c*v" }
[grazing]
passages = ["right", "left"]
solve_for = "F"
symmetry = "half-period"
[section]
kind = "stroboscopic"
phase = "0"
[expansion]
active = ["F"]
"#;

/// A driven pendulum at a soft bumper, on the tangency section.
const PENDULUM: &str = r#"
[model]
name = "a driven pendulum at a soft bumper"
states = ["phi", "w"]
parameters = { c = 0.1, mu = 0.05, gap = 0.6, k = 40, d = 0.4, A = 0.2, Omega = 0.7 }
[model.phase]
name = "tau"
rate = "Omega"
period = "2*pi"
[model.flow]
phi = "w"
w = "A*sin(tau) - sin(phi) - c*w - mu*tanh(3*w)"
[[model.surface]]
name = "bumper"
event = "gap - phi"
contact = { w = "free - k*(phi - gap)*abs(phi) - d*w" }
[grazing]
solve_for = "A"
[expansion]
active = ["A"]
"#;

const LANES: usize = 8;

/// Direct simulation of section points in double precision and in double-double.
struct Images<'s> {
    rounded: DirectImage<'s, f64>,
    exact: DirectImage<'s, Dd>,
}

impl<'s> Images<'s> {
    fn new(system: &'s HybridSystem, scene: &Scene, orbit: &GrazingOrbit) -> Self {
        Self {
            rounded: DirectImage::new(system, scene, orbit).expect("finite parameters"),
            exact: DirectImage::new(system, scene, orbit).expect("finite parameters"),
        }
    }

    /// Largest difference of the images of a point.
    fn error(&mut self, offsets: &[f64]) -> f64 {
        let parameters = self.rounded.parameters();
        let rounded = self.rounded.image(offsets, &vec![0.0; parameters]);
        let exact: Vec<Dd> = offsets.iter().map(|&offset| Dd::from(offset)).collect();
        let exact = self.exact.image(&exact, &vec![Dd::ZERO; parameters]);
        let (rounded, exact) = (rounded.expect("finite"), exact.expect("finite"));
        assert_eq!(exact.end, DirectEnd::Returned, "{offsets:?}");
        if rounded.end != DirectEnd::Returned {
            return f64::INFINITY;
        }
        let pairs = rounded.offsets.iter().zip(&exact.offsets);
        let errors = pairs.map(|(&rounded, &exact)| (Dd::from(rounded) - exact).abs().to_f64());
        errors.fold(0.0, f64::max)
    }

    /// Offsets, among some points near the graze, at which the images differ by more than `most`.
    fn wrong(&mut self, size: f64, count: usize, most: f64) -> Vec<Vec<f64>> {
        let dimension = self.rounded.dimension();
        (0..count)
            .map(|number| (0..dimension).map(|c| size * scattered(number, c)).collect())
            .filter(|offsets: &Vec<f64>| self.error(offsets) > most)
            .collect()
    }
}

fn check(
    text: &str,
    overrides: &[(&str, &str)],
    lowered: fn(&Model) -> HybridSystem,
    points: &[[f64; 2]],
    most: f64,
) {
    let (scene, orbit) = grazing_by(text, "graze", overrides);
    let system = lowered(&scene.model);
    let mut images = Images::new(&system, &scene, &orbit);
    let name = &scene.model.name;
    for point in points {
        let error = images.error(point);
        assert!(error < most, "{name} {overrides:?} {point:?}: {error:e}");
    }
    for size in [1e-16, 1e-15, 3e-15, 1e-14] {
        let wrong = images.wrong(size, 400, most);
        assert!(
            wrong.is_empty(),
            "{name} {overrides:?} {size:e}: {} wrong, the first {:?}",
            wrong.len(),
            wrong[0]
        );
    }
}

#[test]
fn a_soft_contact_of_a_depth_within_rounding_is_over_at_once() {
    let points = [
        [1.1102230246251565e-16, 3.3306690738754696e-16],
        [8.253012333566935e-16, 7.546358846884749e-17],
        [0.0, 0.0],
    ];
    check(CART, &[], HybridSystem::new, &points, 1e-13);
    // A stiffer buffer with little damping, and a soft one with much.
    for (k, c) in [("1e4", "0.1"), ("5", "20")] {
        let overrides = [("k", k), ("c", c)];
        check(CART, &overrides, HybridSystem::new, &[], 1e-12);
    }
}

#[test]
fn a_contact_within_rounding_of_a_section_point_does_not_hide_it() {
    let points = [[6.496000127039587e-15, 8.25837518467344e-15]];
    check(PENDULUM, &[], HybridSystem::new, &points, 1e-13);
}

/// Sections of the catalogue's scenes: their own, the phase of the graze, another phase.
const SECTIONS: [&[(&str, &str)]; 3] = [
    &[],
    &[("section.kind", "stroboscopic")],
    &[("section.kind", "stroboscopic"), ("section.phase", "1")],
];

/// NOTE: an impact of a depth within rounding has a speed of its root.
#[test]
fn a_rigid_contact_of_a_depth_within_rounding_has_a_speed_within_its_root() {
    for name in ["linear", "moving_stop", "mems"] {
        let text = text(name);
        for section in SECTIONS {
            check(text, section, HybridSystem::new, &[], 1e-6);
            if name == "linear" {
                check(text, section, HybridSystem::without_exact_flow, &[], 1e-6);
            }
        }
    }
}

/// Compares images of points near the graze in lanes with those of each point alone: equal to the
/// last bit.
fn agree(text: &str, section: &[(&str, &str)], lowered: fn(&Model) -> HybridSystem, size: f64) {
    let (scene, orbit) = grazing_by(text, "graze", section);
    let system = lowered(&scene.model);
    let map = DirectMap::new(&system, &scene, &orbit).expect("finite parameters");
    let (dimension, active) = (map.dimension(), DiscreteMap::parameters(&map));
    let parameters = vec![0.0; active];
    let mut lanes = map.in_lanes::<LANES>(&[&parameters[..]; LANES]).expect("one rigid stop");
    for round in 0..100 {
        let place = |place: usize| scattered(round * LANES + place / dimension, place % dimension);
        let states: Vec<f64> = (0..LANES * dimension).map(|n| size * place(n)).collect();
        let (mut images, mut infos) = (vec![0.0; states.len()], [StepInfo::default(); LANES]);
        lanes.step(&[true; LANES], &states, &mut images, &mut infos);
        let [states, images] = [&states, &images].map(|all| all.chunks_exact(dimension));
        for ((state, image), in_lanes) in states.zip(images).zip(infos) {
            let mut alone = vec![0.0; dimension];
            let info = map.step(state, &parameters, &mut alone);
            let context = format!("{section:?} {state:?}");
            assert_eq!(in_lanes, info, "{context}");
            let bits = |values: &[f64]| values.iter().map(|v| v.to_bits()).collect::<Vec<_>>();
            assert_eq!(bits(image), bits(&alone), "{context}");
        }
    }
}

#[test]
fn grazes_within_rounding_are_those_of_single_orbits_in_lanes() {
    if !needs_wide_registers() {
        return;
    }
    for name in ["linear", "moving_stop", "impact_pair", "mems"] {
        let text = text(name);
        for section in SECTIONS {
            for size in [1e-16, 1e-15, 3e-15, 1e-14] {
                agree(text, section, HybridSystem::without_exact_flow, size);
                if name != "mems" {
                    agree(text, section, HybridSystem::new, size);
                }
            }
        }
    }
}

/// The oracle starts from the same numbers in double-double; `xtask near-grazing` flies a
/// million passages.
#[test]
fn passages_of_any_depth_in_lanes_are_those_of_double_double() {
    if !needs_wide_registers() {
        return;
    }
    let sections: [&[_]; 3] = [
        &[],
        &[("section.kind", "stroboscopic")],
        &[("section.kind", "stroboscopic"), ("section.phase", "1")],
    ];
    for scene in ["foale", "moving_stop", "impact_pair"] {
        for section in sections {
            let case = passages::Case { scene, section, lowered: HybridSystem::new };
            let tally = case.graze().expect("a grazing orbit").passages(0..40);
            assert!(tally.wrong.is_empty(), "{:#?}", tally.wrong);
            assert!(tally.contacts > 80 && tally.together > 150, "{scene} {section:?} {tally:?}");
        }
    }
}
