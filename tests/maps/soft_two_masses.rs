//! One grazing passage of a two-mass oscillator with an elastic or prestressed stop: four states
//! and a phase.
//!
//! Truth: the images D_R at zero net time in tests/data/soft/public_two_*_soft.json (32 digits;
//! README there).

use grazemap::expansion::{
    Contact, DepthSeries, Graze, Passage, SectionChart, Variables, discontinuity,
};
use grazemap::numeric::{Dd, Scalar};
use grazemap::orbit::{PoincareSection, PoincareSectionKind};
use serde_json::Value;

use crate::support::reference::{exact, exact_list, read};
use crate::support::scenes::orbit;
use crate::support::systems::two_masses;

/// The image of an offset of the full state and the parameter, and its depth variable.
fn image(contact: &Contact<Dd>, offset: &[Dd]) -> (Vec<Dd>, Dd) {
    let y = contact.depth.evaluate(offset).max(Dd::ZERO).sqrt();
    let terms = contact.linear.iter().zip(&contact.quadratic).zip(offset);
    let image = terms.map(|((linear, quadratic), &start)| {
        start + y * (linear.evaluate(offset) + y * quadratic.evaluate(offset))
    });
    (image.collect(), y)
}

/// Share of the radius of convergence in y up to which an image counts as shallow.
const SHALLOW: f64 = 0.125;

/// Largest error of the images at zero net time, of shallow passages and of all.
fn worst_errors(file: &Value, graze: &[Dd], contact: &Contact<Dd>, radius: f64) -> [f64; 2] {
    let mut worst = [0.0_f64; 2];
    for row in file["images"].as_array().expect("images") {
        let mut point = exact_list(&row["x_i"]);
        point.push(exact(&row["phase_i"]));
        let offset = point.iter().zip(graze).map(|(&a, &b)| a - b);
        let offset: Vec<_> = offset.chain([exact(&row["d_offset"])]).collect();
        let (found, y) = image(contact, &offset);
        let errors = exact_list(&row["D_R"]).into_iter().zip(graze).zip(found);
        let error = errors.map(|((truth, &graze), found)| (graze + found - truth).magnitude());
        let error = error.fold(0.0, f64::max);
        worst[1] = worst[1].max(error);
        if y.hi <= SHALLOW * radius {
            worst[0] = worst[0].max(error);
        }
    }
    worst
}

#[test]
fn zero_time_images_of_two_masses_fall_with_every_order() {
    for set in ["T1", "T2"] {
        let file = read(&format!("soft/public_two_{set}_soft.json"));
        let scene = two_masses(&file);
        let orbit = orbit(&scene);
        let graze = orbit.grazing_point();
        let position = |name: &str| scene.model.parameters.iter().position(|p| p.name == name);
        let d = position("d").expect("the gap");
        let gap = graze.parameters[d] - exact(&file["d_grazing"]);
        assert!(gap.magnitude() < 1e-28, "{set}");
        let passage = Passage::new(&scene.model, 0, &graze.state, &graze.parameters, &[d])
            .expect("an analytic law");
        let chart = SectionChart {
            section: PoincareSection {
                kind: PoincareSectionKind::Stroboscopic { phase: Dd::ZERO },
                coordinates: (0..5).collect(),
                eliminated: 4,
            },
            point: graze.state.clone(),
        };
        let variables = Variables {
            names: ["x1", "v1", "x2", "v2", "theta", "d"].map(str::to_owned).to_vec(),
            weights: vec![2; 6],
            coordinates: 5,
        };
        let point = &graze.state;
        let graze = Graze { passage, chart, variables };
        let series = DepthSeries::new(&graze, 24).expect("a release");
        let radius = series.radius().expect("an infinite series");
        let mut last = [f64::INFINITY; 2];
        for weight in [2, 4, 6, 8] {
            let contact = discontinuity::<Dd>(&graze, weight).expect("a release");
            let worst = worst_errors(&file, point, &contact, radius);
            println!(
                "{set}, R = {radius:.3}, W = {weight}: {:.1e} shallow, {:.1e} all",
                worst[0], worst[1]
            );
            assert!(worst[0] < 0.05 * last[0], "{set}, W = {weight}: {worst:?} after {last:?}");
            last = worst;
        }
        assert!(last[0] < 1e-10, "{set}: {last:?}");
    }
}
