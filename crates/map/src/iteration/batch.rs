//! Many independent points at once: sixteen in step, on all cores.

use rayon::prelude::*;

use super::forms::Freezer;
use super::horner::HornerMap;
use crate::jet::kernel::LaneInterpreter;
use crate::numeric::{self, Lanes, widest};

/// Points in step.
const LANES: usize = 16;

/// Points that one task takes: what handing it over costs is nothing beside it.
const TASK: usize = 4096;

/// What a map gives at many points.
#[derive(Clone, Debug, PartialEq)]
pub struct Batch {
    /// Rows of numbers, one for every point: those of the image, the depths `−h_min` of the
    /// passages (negative without contact), and the derivatives, if asked for, of every coordinate
    /// of the image by the coordinates and then by the parameters.
    pub rows: Vec<f64>,
    /// Numbers of a row.
    pub width: usize,
}

impl HornerMap {
    /// Images of many states, at one row of parameters for all or at a row for each: the numbers
    /// that single steps give, to the last bit.
    ///
    /// ```
    /// use grazemap_map::expansion::{Expander, MapOrders};
    /// use grazemap_map::iteration::{DiscreteMap, HornerMap};
    /// use grazemap_map::model::{Scene, catalogue};
    /// use grazemap_map::orbit::locate;
    ///
    /// let text = catalogue::text("linear").expect("in the catalogue");
    /// let scene = Scene::parse(text, "linear.toml")?;
    /// let orbit = locate(&scene)?.into_result()?;
    /// let orders = MapOrders { smooth_order: 3, contact_weight: 4 };
    /// let map = HornerMap::new(&Expander::new(&scene, &orbit)?.expand(orders)?);
    /// let batch = map.batch(&[1e-6, 0.0, 2e-6, 0.0], &[1e-7, 0.0], false);
    /// let mut single = [0.0; 2];
    /// map.step(&[2e-6, 0.0], &[1e-7, 0.0], &mut single);
    /// assert_eq!(batch.rows[batch.width..][..2], single);
    /// # Ok::<(), Box<dyn std::error::Error>>(())
    /// ```
    ///
    /// # Panics
    ///
    /// If the states are no rows of the map's length, or the parameters neither one row nor a row
    /// for every state.
    pub fn batch(&self, states: &[f64], parameters: &[f64], derivatives: bool) -> Batch {
        let (dimension, count) = (self.kernel().dimension, self.kernel().parameters);
        let points = states.len() / dimension;
        assert_eq!(states.len(), points * dimension, "rows of {dimension} coordinates");
        let each = parameters.len() != count;
        assert!(!each || parameters.len() == points * count, "rows of {count} parameters");
        let freezer = self.forms().batch(derivatives, each);
        let coefficients = freezer.coefficients(if each { &[] } else { parameters });
        let width = freezer.outputs();
        let mut rows = vec![0.0; points * width];
        let tasks = rows.par_chunks_mut(TASK * width).zip(states.par_chunks(TASK * dimension));
        tasks.enumerate().for_each(|(task, (rows, states))| {
            let own =
                |first: usize| &parameters[first * count..][..states.len() / dimension * count];
            let inputs = [(states, dimension), (if each { own(task * TASK) } else { &[] }, count)];
            fill(freezer, &coefficients, &inputs[..if each { 2 } else { 1 }], rows);
        });
        Batch { rows, width }
    }
}

/// Runs a kernel with one set of coefficients at many points: of each, the numbers of its own from
/// every one of the inputs (rows, and how long they are), then a row of outputs.
pub(super) fn fill(
    freezer: &Freezer,
    coefficients: &[f64],
    inputs: &[(&[f64], usize)],
    rows: &mut [f64],
) {
    widest(Points { map: freezer.in_lanes(&[coefficients.to_vec()]), inputs, rows });
}

struct Points<'a> {
    map: LaneInterpreter<Lanes<LANES>>,
    inputs: &'a [(&'a [f64], usize)],
    rows: &'a mut [f64],
}

impl numeric::Kernel for Points<'_> {
    type Output = ();

    #[inline(always)]
    fn run(mut self) {
        let outputs = self.map.outputs();
        for (block, rows) in self.rows.chunks_mut(LANES * outputs).enumerate() {
            let lanes = rows.len() / outputs;
            let mut places = self.map.inputs_mut().iter_mut();
            for &(values, width) in self.inputs {
                let values = &values[block * LANES * width..];
                for (number, place) in (0..width).zip(&mut places) {
                    for lane in 0..lanes {
                        place[lane] = values[lane * width + number];
                    }
                }
            }
            self.map.run();
            for number in 0..outputs {
                let values = self.map.output(number);
                for lane in 0..lanes {
                    rows[lane * outputs + number] = values[lane];
                }
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use crate::expansion::{Expander, MapOrders};
    use crate::iteration::{DiscreteMap, HornerMap};
    use crate::model::{Scene, catalogue};
    use crate::orbit::locate;

    #[test]
    fn a_batch_is_its_steps() {
        let source = catalogue::text("linear").expect("it is in the catalogue");
        let scene = Scene::parse(source, "linear.toml").expect("a scene");
        let orbit = locate(&scene).expect("a search").into_result().expect("a simple graze");
        let orders = MapOrders { smooth_order: 5, contact_weight: 6 };
        let map = Expander::new(&scene, &orbit).and_then(|it| it.expand(orders)).expect("a map");
        let map = HornerMap::new(&map);
        // More than one task, and a block that is not full.
        let points = super::TASK + 21;
        let offset = |n: usize| 1e-5 * ((n * 7919 % 1000) as f64 / 500.0 - 1.0);
        let states: Vec<f64> = (0..2 * points).map(offset).collect();
        let each: Vec<f64> = (0..2 * points).map(|n| 0.01 * offset(n + 5)).collect();
        for parameters in [&each[..], &each[..2]] {
            let batch = map.batch(&states, parameters, true);
            assert_eq!(map.batch(&states, parameters, false).rows[..3], batch.rows[..3]);
            for point in 0..points {
                let own = if parameters.len() == 2 { parameters } else { &each[2 * point..][..2] };
                let (mut image, mut jacobian) = ([0.0; 2], [0.0; 4]);
                map.step_jacobian(&states[2 * point..][..2], own, &mut image, &mut jacobian);
                let row = &batch.rows[point * batch.width..][..batch.width];
                assert_eq!(row[..2], image);
                // Of the derivatives those by the coordinates.
                assert_eq!([row[3], row[4], row[7], row[8]], jacobian);
            }
        }
    }
}
