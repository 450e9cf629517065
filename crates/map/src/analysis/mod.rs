//! Analyses of a map, by the map and by direct simulation: images of section points, periodic
//! orbits, bifurcation diagrams, two-parameter charts, basins, branches, loci, fits, noise; soft
//! stops of a wanted restitution.
//!
//! Deliberately absent: plotting, files, progress bars.

mod atlas_plane;
pub mod basin;
pub mod branches;
pub mod chart;
pub mod diagram;
mod direct_image;
mod direct_map;
mod error;
mod evaluation;
pub mod fit;
mod free_flight;
mod image;
pub mod loci;
mod memory;
mod motion;
pub mod noise;
pub mod orbits;
mod pace;
pub mod periodic;
mod progress;
mod refinement;
mod region_atlas;
mod section_frame;
mod section_table;
pub mod soft_stop;
mod time_series;
mod work;

use serde::{Deserialize, Deserializer};

pub use atlas_plane::{AtlasPlane, PlaneCell};
pub use diagram::{MeasuredSide, measure_graze};
pub(crate) use direct_image::products_of_step;
pub use direct_image::{DirectEnd, DirectImage, SectionImage, direct_image};
pub use direct_map::{DirectLanes, DirectMap, GuardedMap, guarded};
pub use error::AnalysisError;
pub use evaluation::{Arrival, DepthEvaluation, MapEvaluation, MapImage};
pub use free_flight::{FreeFlight, SectionChange};
pub use image::{ImageRecord, ImageRequest, ImageRow, Precision, Using, images};
pub use memory::{
    atlas_bytes, basin_bytes, batch_bytes, chart_bytes, charts_bytes, diagram_bytes,
    diagrams_bytes, image_bytes, noise_bytes, orbit_bytes, series_bytes,
};
pub use motion::MotionEvents;
pub use pace::seconds_per_return;
pub(crate) use progress::place_of;
pub use progress::{
    Gathered, Joining, NoProgress, PartProgress, Pieces, Progress, Shard, Share, SubProgress,
};
pub use region_atlas::{AtlasRegion, AtlasStudy, AtlasWork, StroboscopicPoint, atlas_study};
pub use section_frame::{EscapeBound, SectionFrame, escape_bounds, itinerary};
pub use time_series::{
    EarlyEnd, SeriesPoint, TimeSeries, TimeSeriesRequest, each_moment, time_series,
};
pub use work::MOST_WORK;

/// Reads a number of a document. JSON has no NaN and writes `null`, which is read as NaN; binary
/// formats store NaN itself.
pub(crate) fn number_or_nan<'de, D: Deserializer<'de>>(deserializer: D) -> Result<f64, D::Error> {
    if !deserializer.is_human_readable() {
        return f64::deserialize(deserializer);
    }
    Ok(Option::deserialize(deserializer)?.unwrap_or(f64::NAN))
}

/// Reads a list of numbers, each as [`number_or_nan`] reads one.
pub(crate) fn numbers_or_nan<'de, D: Deserializer<'de>>(
    deserializer: D,
) -> Result<Vec<f64>, D::Error> {
    if !deserializer.is_human_readable() {
        return Vec::deserialize(deserializer);
    }
    let values = Vec::<Option<f64>>::deserialize(deserializer)?;
    Ok(values.into_iter().map(|value| value.unwrap_or(f64::NAN)).collect())
}
