//! Economised maps, with the same monomials fitted to the window, compared with direct simulation
//! in double-double.
//!
//! `cargo test --test maps -- economised_maps:: --nocapture` prints the errors on fresh points.

use grazemap::analysis::{DirectEnd, DirectImage, MapEvaluation};
use grazemap::convergence::{MapFamily, SamplePoint, WindowSample};
use grazemap::expansion::{LocalMap, MapOrders, Stage};
use grazemap::hybrid::HybridSystem;
use grazemap::jet::Jet;
use grazemap::model::Scene;
use grazemap::numeric::Dd;
use grazemap::orbit::GrazingOrbit;

use crate::support::scenes::grazing;
use crate::support::tiers;

struct Case {
    scene: Scene,
    orbit: GrazingOrbit,
}

impl Case {
    fn new(name: &str) -> Self {
        let (scene, orbit) = grazing(name);
        Self { scene, orbit }
    }

    /// Taylor map and economised map, and points of the window that were not used for the fit.
    fn maps(&self, orders: MapOrders) -> ([LocalMap; 2], Vec<SamplePoint>) {
        let highest = MapOrders {
            smooth_order: orders.smooth_order + 3,
            contact_weight: orders.contact_weight + 4,
        };
        let family = MapFamily::new(&self.scene, &self.orbit, highest).expect("an expansion");
        let taylor = family.map(orders).expect("lower orders");
        let economised = family.economised(orders).expect("points in the window");
        let points =
            WindowSample::new(&family.map(highest).expect("the highest")).points(5000, 150);
        ([taylor, economised], points)
    }

    /// Largest error of each map.
    fn errors(&self, maps: &[LocalMap; 2], points: &[SamplePoint]) -> [f64; 2] {
        let system = HybridSystem::new(&self.scene.model);
        let mut direct = DirectImage::<Dd>::new(&system, &self.scene, &self.orbit).expect("a map");
        let maps = maps.each_ref().map(MapEvaluation::<Dd>::new);
        let (mut worst, mut compared) = ([0.0_f64; 2], 0);
        for point in points {
            let exact = |values: &[f64]| values.iter().map(|&x| Dd::from(x)).collect::<Vec<_>>();
            let (state, parameters) = (exact(&point.state), exact(&point.parameters));
            let truth = direct.image(&state, &parameters).expect("finite offsets");
            if truth.end != DirectEnd::Returned || truth.extra_contacts > 0 {
                continue;
            }
            compared += 1;
            for (worst, map) in worst.iter_mut().zip(&maps) {
                let image = map.image(&state, &parameters).offsets;
                let errors = image.iter().zip(&truth.offsets);
                let error = errors.map(|(&a, &b)| (a - b).to_f64().abs());
                *worst = worst.max(error.fold(0.0, f64::max));
            }
        }
        assert!(compared > 100, "{compared} points");
        worst
    }
}

fn jets(map: &LocalMap) -> impl Iterator<Item = &Jet<f64>> {
    map.stages.iter().flat_map(Stage::polynomials)
}

#[test]
fn economised_maps_err_several_times_less_at_the_same_monomials() {
    let scenes = [
        ("linear", 4),
        ("mems", 4),
        // Its window ends near the radius of its contact: the higher orders fitted to are not exact
        // there either.
        ("cantilever_3_5_soft", 4),
        ("soft_b", 5),
        ("soft_c", 5),
        ("moving_stop", 4),
        ("impact_pair", 4),
        ("two_stops_t1", 4),
    ];
    let contact_weight = 6;
    let mut logarithms = 0.0;
    let mut count = 0;
    for &(name, smooth_order) in tiers::part(&scenes, 4) {
        count += 1;
        let case = Case::new(name);
        let orders = MapOrders { smooth_order, contact_weight };
        let (maps, points) = case.maps(orders);
        let [taylor, economised] = case.errors(&maps, &points);
        println!("{name} {orders:?}: Taylor {taylor:.1e}, economised {economised:.1e}");
        assert!(taylor > 1.5 * economised, "{name}: {taylor:e} and {economised:e}");
        logarithms += (taylor / economised).ln();
        let spaces = jets(&maps[0]).zip(jets(&maps[1]));
        for (taylor, economised) in spaces {
            assert_eq!(taylor.space().weights(), economised.space().weights());
            assert_eq!(taylor.space().order(), economised.space().order());
            assert_eq!(taylor.nonzero(), economised.nonzero());
        }
    }
    let mean = (logarithms / f64::from(count)).exp();
    println!("geometric mean of the gains: {mean:.1}");
    assert!(mean > 4.0, "{mean}");
}

#[test]
fn the_graze_and_the_leading_law_are_not_moved() {
    let case = Case::new("impact_pair");
    let orders = MapOrders { smooth_order: 3, contact_weight: 4 };
    let ([taylor, economised], _) = case.maps(orders);
    let zero = |count: usize| vec![0.0; count];
    let (state, parameters) = (zero(taylor.dimension()), zero(taylor.parameters.len()));
    let image = MapEvaluation::<f64>::new(&economised).image(&state, &parameters);
    assert!(image.offsets.iter().chain(&image.depths).all(|&value| value == 0.0));
    let mut moved = false;
    for (a, b) in taylor.stages.iter().zip(&economised.stages) {
        if let (Stage::Contact(a), Stage::Contact(b)) = (a, b) {
            for (a, b) in a.linear.iter().zip(&b.linear) {
                assert_eq!(a.head(), b.head());
                moved |= a.coefficients() != b.coefficients();
            }
        }
    }
    assert!(moved, "the other coefficients are fitted");
}
