//! Images of section points, periodic orbits, bifurcation diagrams, two-parameter charts: what a
//! map does, by the map and by direct simulation.
//!
//! Deliberately absent: plotting, files, progress bars.

pub mod basin;
pub mod branches;
pub mod chart;
pub mod continuation;
pub mod diagram;
mod direct_image;
mod direct_map;
mod error;
mod escape;
mod evaluation;
pub mod fit;
mod free_flight;
mod graze_measurement;
mod guarded_map;
mod image;
pub mod loci;
pub mod noise;
pub(crate) mod nulls;
pub mod orbits;
pub mod periodic;
mod progress;
mod refinement;
mod section_frame;
mod share;
mod time_series;

pub(crate) use diagram::low_discrepancy;
pub(crate) use direct_image::products_of_step;
pub use direct_image::{DirectEnd, DirectImage, SectionImage, direct_image};
pub use direct_map::{DirectLanes, DirectMap};
pub use error::AnalysisError;
pub use escape::{EscapeBound, escape_bounds};
pub use evaluation::{Arrival, DepthEvaluation, MapEvaluation, MapImage};
pub use free_flight::{FreeFlight, SectionChange};
pub use graze_measurement::{MeasuredSide, measure_graze};
pub use guarded_map::{GuardedMap, guarded};
pub use image::{ImageRecord, ImageRequest, ImageRow, Precision, Using, images};
pub(crate) use progress::place_of;
pub use progress::{NoProgress, Part, Progress};
pub use section_frame::{SectionFrame, itinerary};
pub use share::{Gathered, Joining, Pieces, Shard, Share};
pub use time_series::{
    EarlyEnd, SeriesPoint, TimeSeries, TimeSeriesRequest, each_moment, time_series,
};
