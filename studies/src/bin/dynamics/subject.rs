//! Scene with its direct simulation and its maps of all orders.

use grazemap::analysis::periodic::{
    Guess, PeriodicOrbit, PeriodicProblem, SectionMap, window_scales,
};
use grazemap::analysis::{DirectImage, DirectMap, MapEvaluation};
use grazemap::convergence::MapFamily;
use grazemap::expansion::{LocalMap, MapOrders, MapWindow};
use grazemap::hybrid::HybridSystem;
use grazemap::iteration::PassageSet;
use grazemap::model::Scene;
use grazemap::numeric::{Dd, Real};
use grazemap::orbit::{GrazingOrbit, locate};
use grazemap_studies::held::branch;

/// Highest orders of the maps. All lower maps are truncations of one expansion.
pub(crate) const HIGHEST: (u32, u32) = (7, 10);

/// Scene, located and lowered.
pub(crate) struct Subject {
    pub(crate) name: &'static str,
    pub(crate) scene: Scene,
    pub(crate) orbit: GrazingOrbit,
    pub(crate) system: HybridSystem,
}

impl Subject {
    pub(crate) fn new(name: &'static str) -> Self {
        let scene = Scene::of_catalogue(name).expect("a good scene");
        let location = locate(&scene).expect("no wrong input");
        let orbit = location.into_result().expect("it grazes");
        let system = HybridSystem::new(&scene.model);
        Self { name, scene, orbit, system }
    }

    pub(crate) fn maps(&self) -> Maps<'_> {
        let highest = orders(HIGHEST);
        Maps {
            family: MapFamily::new(&self.scene, &self.orbit, highest).expect("an analytic graze"),
        }
    }

    /// Direct simulation in double-double.
    pub(crate) fn exact(&self) -> DirectImage<'_, Dd> {
        DirectImage::new(&self.system, &self.scene, &self.orbit).expect("good parameters")
    }

    /// Direct simulation in double precision.
    pub(crate) fn double(&self) -> DirectMap<'_> {
        DirectMap::new(&self.system, &self.scene, &self.orbit).expect("good parameters")
    }
}

/// Maps of a scene, of all orders up to the highest.
pub(crate) struct Maps<'a> {
    family: MapFamily<'a>,
}

impl Maps<'_> {
    pub(crate) fn local(&self, pair: (u32, u32)) -> LocalMap {
        self.family.map(orders(pair)).expect("small spaces")
    }

    /// Map of an order in double-double: its only errors are truncation and the rounding of
    /// coefficients.
    pub(crate) fn exact(&self, pair: (u32, u32)) -> MapEvaluation<Dd> {
        MapEvaluation::new(&self.local(pair))
    }

    pub(crate) fn window(&self) -> MapWindow {
        self.local((1, 1)).window
    }

    /// Problem of orbits of `returns` returns, the first of which makes contact. The first active
    /// parameter is free.
    pub(crate) fn problem(&self, returns: usize) -> PeriodicProblem {
        let mut itinerary = vec![PassageSet::default(); returns];
        itinerary[0].insert(0);
        PeriodicProblem {
            returns,
            free: 0,
            itinerary: Some(itinerary),
            scales: window_scales(&self.window()),
        }
    }
}

/// Depth variables `y` up to that of a window, ascending: `y²` in steps of a quarter decade over
/// these decades.
pub(crate) fn depths(deepest: f64, decades: i32) -> Vec<f64> {
    let depth = |k| deepest * 10f64.powf(f64::from(k) / 4.0);
    (-4 * decades..=0).map(depth).collect()
}

/// One-impact orbits of period one at these depths `y²`, with the second active parameter at an
/// offset.
///
/// The first coordinate of these scenes is the distance beyond the stop, so that it equals `y²`.
pub(crate) fn one_impact<S: Real>(
    map: &mut (impl SectionMap<S> + ?Sized),
    problem: &PeriodicProblem,
    unfolding: f64,
    depths: &[f64],
) -> Vec<PeriodicOrbit<S>> {
    let guess =
        Guess { state: vec![S::zero(); 2], parameters: vec![S::zero(), S::from_f64(unfolding)] };
    let depths: Vec<S> = depths.iter().map(|&depth| S::from_f64(depth)).collect();
    branch(map, problem, 0, &depths, &guess)
}

pub(crate) fn orders((smooth_order, contact_weight): (u32, u32)) -> MapOrders {
    MapOrders { smooth_order, contact_weight }
}

/// Orders as `(N, W)`.
pub(crate) fn written((n, w): (u32, u32)) -> String {
    format!("({n}, {w})")
}
