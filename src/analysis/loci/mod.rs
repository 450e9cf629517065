//! Loci in two parameters: saddle-nodes, flips, Neimark–Sacker points and the grazes of periodic
//! orbits of any itinerary, with their points of codimension two.
//!
//! One idea: the orbits of an itinerary with one condition more are a curve, regular where the
//! curve meets a graze, for the depth variables are among its unknowns. See
//! docs/mathematics/loci.md.

mod data;
mod equations;
mod tangency;
mod trace;

pub use data::{Loci, LociRequest, Locus, LocusEnd, LocusKind, LocusPoint, Tangency};
pub use equations::CodimensionTwo;

use crate::expansion::LocalMap;
use trace::MapLoci;

/// The loci asked for.
pub fn loci(map: &LocalMap, request: &LociRequest) -> Loci {
    let by_map = MapLoci::new(map, request);
    let traces = by_map.all();
    Loci {
        loci: traces.iter().map(|trace| by_map.described(trace)).collect(),
        tangencies: by_map.tangencies(&traces),
    }
}
