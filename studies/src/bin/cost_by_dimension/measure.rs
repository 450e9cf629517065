//! Costs of computing and of stepping a map, at one pair of orders.

use std::hint::black_box;
use std::time::Instant;

use grazemap::expansion::{Expander, ExpansionError, MapOrders};
use grazemap::iteration::{DiscreteMap, HornerMap};
use grazemap::numeric::Scalar;

/// Number of runs for work shorter than [`LONG`]. The fastest counts, since other work on the
/// machine only adds time.
pub(crate) const RUNS: usize = 9;
/// Time in seconds above which one run is enough.
const LONG: f64 = 0.2;
/// Operations of one timed run, at least.
const OPERATIONS: usize = 400_000;
/// Offset of every coordinate and parameter of the starting point.
pub(crate) const OFFSET: f64 = 1e-4;

/// Times and counts of a map.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Cost {
    pub(crate) orders: MapOrders,
    /// Numbers of monomials of a leg, and of the contact's space with `y`.
    pub(crate) monomials: [usize; 2],
    /// Coefficient products of one product of two jets of a leg.
    pub(crate) products: usize,
    /// Times in seconds: jets of the legs, jets of `D`, composition.
    pub(crate) seconds: [f64; 3],
    /// Operations (multiply-adds, products and sums) of a step: factored, composed; then with
    /// frozen parameters: factored, composed.
    pub(crate) operations: [usize; 4],
    /// Times of an interpreted step in nanoseconds, in the same order.
    pub(crate) step_ns: [f64; 4],
}

/// The cost of the map of an expander.
pub(crate) fn cost(expander: &Expander<'_>, orders: MapOrders) -> Result<Cost, ExpansionError> {
    let variables = expander.variables();
    let (legs, legs_s) = timed(|| expander.legs(orders.smooth_order));
    let (contacts, contact_s) = timed(|| expander.contacts(orders.contact_weight));
    let map = expander.assemble(orders, legs?, contacts?);
    let (composed, composed_s) = timed(|| expander.compose(&map));
    let maps = [HornerMap::new(&map), HornerMap::composed(&map, &composed?)];
    let [factored, composed] = &maps;
    let frozen = maps.each_ref().map(|map| map.freeze(&vec![OFFSET; map.parameters()]));
    let leg_space = variables.smooth_space(2 * orders.smooth_order)?;
    let operations = [
        factored.count().total(),
        composed.count().total(),
        factored.frozen_count().total(),
        composed.frozen_count().total(),
    ];
    let forms: [&dyn DiscreteMap; 4] = [factored, composed, &frozen[0], &frozen[1]];
    Ok(Cost {
        orders,
        monomials: [leg_space.len(), variables.contact_space(orders.contact_weight)?.len()],
        products: leg_space.products(),
        seconds: [legs_s, contact_s, composed_s],
        operations,
        step_ns: std::array::from_fn(|k| step_ns(forms[k], operations[k])),
    })
}

/// Time of one step in nanoseconds, repeated at the same point.
pub(crate) fn step_ns(map: &dyn DiscreteMap, operations: usize) -> f64 {
    let (state, parameters) = (vec![OFFSET; map.dimension()], vec![OFFSET; map.parameters()]);
    let mut image = vec![0.0; map.dimension()];
    let steps = steps_of(operations);
    let (_, seconds) = timed(|| {
        for _ in 0..steps {
            map.step(black_box(&state), black_box(&parameters), &mut image);
            black_box(&mut image);
        }
    });
    1e9 * seconds / steps as f64
}

/// Number of steps of one timed run.
pub(crate) fn steps_of(operations: usize) -> usize {
    (OPERATIONS / operations.max(1)).clamp(10, 20_000)
}

/// Time of one multiply-add in nanoseconds, with many in flight and nothing else: for a double, and
/// per lane of eight.
pub(crate) fn multiply_add_ns() -> [f64; 2] {
    [rate::<f64, 16>(), rate::<grazemap::numeric::Lanes<8>, 2>() / 8.0]
}

fn rate<S: Scalar, const SUMS: usize>() -> f64 {
    const ROUNDS: usize = 20_000;
    let (_, seconds) = timed(|| {
        let factor = black_box(S::from_f64(0.999));
        let mut sums = [S::from_f64(0.1); SUMS];
        for _ in 0..ROUNDS {
            sums.iter_mut().for_each(|sum| *sum = sum.mul_add(factor, factor));
        }
        black_box(sums)
    });
    1e9 * seconds / (ROUNDS * SUMS) as f64
}

/// Result, and time of the fastest run in seconds.
fn timed<T>(mut work: impl FnMut() -> T) -> (T, f64) {
    let mut once = || {
        let start = Instant::now();
        let made = black_box(work());
        (made, start.elapsed().as_secs_f64())
    };
    let (mut made, mut fastest) = once();
    for _ in 1..RUNS {
        if fastest > LONG {
            break;
        }
        let (again, seconds) = once();
        (made, fastest) = (again, fastest.min(seconds));
    }
    (made, fastest)
}
