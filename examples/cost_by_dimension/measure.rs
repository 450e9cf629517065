//! What a map costs to make and to step, at one pair of orders.

use std::hint::black_box;
use std::time::Instant;

use grazemap::expansion::{Expander, ExpansionError, MapOrders};
use grazemap::iteration::{DiscreteMap, HornerMap};
use grazemap::numeric::Scalar;

/// Runs of which the fastest counts, for work shorter than [`LONG`]: other work on the machine only
/// adds time.
const RUNS: usize = 9;
/// Seconds from which one run is enough.
const LONG: f64 = 0.2;
/// Steps of one timed run: at least this many operations.
const OPERATIONS: usize = 400_000;
/// Offset of every coordinate and parameter of the point that is mapped.
const OFFSET: f64 = 1e-4;

/// Times and counts of a map.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Cost {
    pub(crate) orders: MapOrders,
    /// Monomials of a leg, of the contact's space with `y`.
    pub(crate) monomials: [usize; 2],
    /// Coefficient products of one product of two jets of a leg.
    pub(crate) products: usize,
    /// Seconds for the legs' jets, for those of `D`, for the composition.
    pub(crate) seconds: [f64; 3],
    /// Multiply-adds, products and sums of a step: factored, composed; with the parameters folded
    /// in: factored, composed.
    pub(crate) operations: [usize; 4],
    /// Nanoseconds of an interpreted step: as above.
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

/// Nanoseconds of one step, the same point again and again.
pub(crate) fn step_ns(map: &dyn DiscreteMap, operations: usize) -> f64 {
    let (state, parameters) = (vec![OFFSET; map.dimension()], vec![OFFSET; map.parameters()]);
    let mut image = vec![0.0; map.dimension()];
    let steps = (OPERATIONS / operations.max(1)).clamp(10, 20_000);
    let (_, seconds) = timed(|| {
        for _ in 0..steps {
            map.step(black_box(&state), black_box(&parameters), &mut image);
            black_box(&mut image);
        }
    });
    1e9 * seconds / steps as f64
}

/// Nanoseconds of one multiply-add, many of them in flight and nothing else: of a double, and of
/// each lane of eight.
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

/// A result and the seconds of the fastest making of it.
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
