use grazemap::analysis::periodic::*;
use grazemap::analysis::{DirectImage, MapEvaluation};
use grazemap::convergence::MapFamily;
use grazemap::expansion::MapOrders;
use grazemap::hybrid::HybridSystem;
use grazemap::model::{Scene, catalogue};
use grazemap::numeric::{Dd, Real};
use grazemap::orbit::locate;
use std::time::Instant;

fn show(tag: &str, orbits: &[PeriodicOrbit<Dd>]) {
    for o in orbits {
        let m = o.multipliers().unwrap();
        println!(
            "{tag} x={:.3e} p={:.12e} mult={:.6},{:.6} det={:.6} extra={} contacts={:?} res={:.1e}",
            o.states[0][0].to_f64(), o.parameters[0].to_f64(), m[0], m[1], o.determinant().unwrap().to_f64(), o.extra_contacts,
            o.itinerary.iter().map(|s| s.len()).collect::<Vec<_>>(), o.residual
        );
    }
}

fn main() {
    let names: Vec<String> = std::env::args().skip(1).collect();
    for arg in &names {
        let mut parts = arg.split(':');
        let name = parts.next().unwrap();
        let returns: usize = parts.next().map_or(1, |s| s.parse().unwrap());
        let scene = Scene::parse(catalogue::text(name).unwrap(), name).unwrap();
        let orbit = locate(&scene).unwrap().into_result().unwrap();
        println!("== {name} n={returns} window {:?}", scene.window.depth);
        let system = HybridSystem::new(&scene.model);
        let mut direct = DirectImage::<Dd>::new(&system, &scene, &orbit).unwrap();
        let family = MapFamily::new(&scene, &orbit, MapOrders { smooth_order: 7, contact_weight: 10 }).unwrap();
        let highest = family.map(family.highest()).unwrap();
        let mut itinerary = vec![grazemap::iteration::PassageSet::default(); returns];
        itinerary[0].insert(0);
        let problem = PeriodicProblem { returns, free: 0, itinerary: Some(itinerary), scales: window_scales(&highest.window) };
        let guess = Guess { state: vec![Dd::ZERO; highest.dimension()], parameters: vec![Dd::ZERO; highest.parameters.len()] };
        let d = scene.window.depth;
        let values: Vec<Dd> = (0..7).map(|k| Dd::from(d * 0.01 * 10f64.powf(k as f64 / 3.0))).collect();
        let t = Instant::now();
        let truth = branch(&mut direct, &problem, 0, &values, &guess);
        println!("direct {:?} for {}", t.elapsed(), truth.len());
        show("direct", &truth);
        for (n, w) in [(1, 1), (1, 2), (1,3), (2, 1), (2, 2), (2, 3), (3, 3), (3, 4), (5, 6), (7,10)] {
            let map = family.map(MapOrders { smooth_order: n, contact_weight: w }).unwrap();
            let mut map = MapEvaluation::<Dd>::new(&map);
            let t = Instant::now();
            let orbits = branch(&mut map, &problem, 0, &values, &guess);
            let t = t.elapsed();
            let err: Vec<String> = orbits.iter().zip(&truth).map(|(a, b)| format!("{:.1e}", (a.parameters[0] - b.parameters[0]).to_f64())).collect();
            println!("({n},{w}) {:?} dp={err:?}", t);
            show("  ", &orbits[orbits.len().saturating_sub(1)..]);
        }
    }
}
