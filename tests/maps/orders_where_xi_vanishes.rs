//! Orders that determine how the next depth depends on the present one, at a generic graze and
//! where `xi_1` vanishes.
//!
//! `cargo test --test maps -- orders_where_xi_vanishes:: --nocapture` prints the table of
//! docs/mathematics/orders.md. The reference is direct simulation in double-double; on these
//! sections the depth of a point is its first offset, `h = delta − x`.

use grazemap::analysis::{DirectEnd, DirectImage, MapEvaluation};
use grazemap::convergence::MapFamily;
use grazemap::expansion::MapOrders;
use grazemap::hybrid::HybridSystem;
use grazemap::numeric::Dd;

use crate::support::scenes::grazing;

/// Orders tabulated.
const ORDERS: [(u32, u32); 6] = [(1, 1), (1, 3), (2, 1), (2, 2), (2, 3), (3, 5)];

/// Depth variables, a factor 10 apart.
const DEPTHS: [f64; 2] = [1e-2, 1e-3];

/// Errors of the slope, by orders and then by depth.
struct Slopes {
    exact: [f64; 2],
    errors: Vec<[f64; 2]>,
}

/// `du_1/du_0` at the depth `u_0 = y²`, all else at the graze, by central differences in `y`.
fn slope(y: f64, next: impl Fn(Dd) -> Dd) -> f64 {
    let step = 1e-5 * y;
    let at = |y: f64| next(Dd::from(y) * Dd::from(y));
    ((at(y + step) - at(y - step)) / Dd::from(4.0 * y * step)).to_f64()
}

fn slopes(name: &str) -> Slopes {
    let (scene, orbit) = grazing(name);
    let system = HybridSystem::new(&scene.model);
    let direct = DirectImage::<Dd>::new(&system, &scene, &orbit).expect("a map");
    let zero = vec![Dd::from(0.0); scene.expansion.active.len()];
    let exact = DEPTHS.map(|y| {
        slope(y, |depth| {
            let image = direct.clone().image(&[depth, Dd::from(0.0)], &zero);
            let image = image.expect("finite offsets");
            assert_eq!(image.end, DirectEnd::Returned);
            image.offsets[0]
        })
    });
    let highest = MapOrders { smooth_order: 3, contact_weight: 5 };
    let family = MapFamily::new(&scene, &orbit, highest).expect("a simple graze");
    let errors = ORDERS.map(|(smooth_order, contact_weight)| {
        let orders = MapOrders { smooth_order, contact_weight };
        let map = family.map(orders).expect("lower orders");
        let map = MapEvaluation::<Dd>::new(&map);
        let mut errors =
            DEPTHS.map(|y| slope(y, |depth| map.image(&[depth, Dd::from(0.0)], &zero).offsets[0]));
        errors.iter_mut().zip(exact).for_each(|(slope, exact)| *slope -= exact);
        errors
    });
    println!("{name}: slope {:.5} at y = 1e-2, {:.5} at 1e-3", exact[0], exact[1]);
    for ((n, w), [deep, shallow]) in ORDERS.iter().zip(&errors) {
        println!("  ({n}, {w}): off by {deep:.1e}, {shallow:.1e}");
    }
    Slopes { exact, errors: errors.to_vec() }
}

/// The slope is `−ξ/2y + η + …`: the lowest orders have its first term, and are off by a constant.
#[test]
fn at_a_generic_graze_the_lowest_orders_have_the_leading_slope() {
    let slopes = slopes("linear");
    let [deep, shallow] = slopes.exact;
    // Ten times shallower, ten times steeper, to the relative size O(y) of the next term.
    assert!((shallow / deep / 10.0 - 1.0).abs() < 0.1, "{deep}, {shallow}");
    for (orders, errors) in ORDERS.iter().zip(&slopes.errors) {
        let relative = errors[1] / shallow;
        assert!(relative.abs() < 1e-2, "{orders:?}: {relative:e}");
    }
}

/// With `ξ = 0` the slope is `η + O(y)`, which the lowest orders do not contain.
#[test]
fn where_xi_vanishes_the_slope_needs_the_quadratic_terms_of_both_factors() {
    for name in ["linear_codim2", "mems_codim2"] {
        let slopes = slopes(name);
        let size = slopes.exact[1].abs();
        for (&(n, w), errors) in ORDERS.iter().zip(&slopes.errors) {
            let shrinks = errors[1].abs() < 0.2 * errors[0].abs();
            if n >= 2 && w >= 2 {
                assert!(shrinks, "{name} ({n}, {w}): {errors:?}");
            } else {
                // A constant, of the size of the slope itself.
                assert!(!shrinks && errors[1].abs() > 1e-2 * size, "{name} ({n}, {w}): {errors:?}");
            }
        }
    }
}
