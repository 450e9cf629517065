use grazemap::convergence::Chooser;
use grazemap::model::{Scene, catalogue};
use grazemap::orbit::locate;
use std::time::Instant;
fn main() {
    let only: Vec<String> = std::env::args().skip(1).collect();
    for name in catalogue::names() {
        if !only.is_empty() && !only.iter().any(|o| o == name) {
            continue;
        }
        let scene = Scene::parse(catalogue::text(name).unwrap(), name).unwrap();
        let t = Instant::now();
        let orbit = locate(&scene).unwrap().into_result().unwrap();
        let lt = t.elapsed().as_secs_f64();
        let t = Instant::now();
        let mut chooser = Chooser::new(&scene, &orbit, 1000).unwrap();
        println!("{name} new {:.2}", t.elapsed().as_secs_f64());
        for tol in [1e-3, 1e-6, 1e-9, 1e-12] {
            let c = chooser.choose(tol).unwrap();
            println!(
                "{name} {lt:.2} {tol:e} met {} ({},{}) {:?} {:?} {:?} ops {} coef {} err {:.2e} fresh {:?} t {:.2} pred {:?} {:?} fit {:?} drop {:?} lim {:?}",
                c.met,
                c.smooth_order,
                c.contact_weight,
                c.shape,
                c.weights,
                c.monomials,
                c.operations,
                c.coefficients,
                c.error.unwrap_or(f64::NAN),
                c.fresh_error,
                c.seconds,
                (c.predicted.smooth_order, c.predicted.contact_weight),
                c.polynomials,
                c.fitted_to.map(|o| (o.smooth_order, o.contact_weight)),
                c.drop_within.map(|d| d / tol),
                c.limit
            );
        }
    }
}
