//! Layout of results for people and programs: tables, figures, CSV, NPY, JSON, one HTML page.
//!
//! This floor lays out plain values (numbers, points, words). Output is reproducible: it contains
//! no dates, no machine paths, and does not depend on hash order.
//!
//! Deliberately absent: computing anything new. Thinning a drawing and rounding a printed number
//! are layout, and both are stated beside their result.

mod atlas_figure;
mod atlas_listing;
mod basin_figure;
mod branch_listing;
mod chart_figure;
mod choice;
mod citation;
mod contact_listing;
mod convergence_page;
mod curve_listing;
mod derivatives_listing;
mod diagram_figure;
mod equations;
mod error;
mod files;
mod fit_listing;
mod image_listing;
mod json;
mod live;
mod loci_listing;
mod map_listing;
mod orbit_listing;
mod orbits_listing;
mod page;
mod pieces;
mod run_page;
mod safety_listing;
mod sketch;
mod table;
mod time_series_listing;
mod window_words;

pub use grazemap_figure as figure;

pub use atlas_figure::atlas_figure;
pub use atlas_listing::{AtlasListing, LeafRecord, PointCounts, StepTimes};
pub use basin_figure::{
    basin_array, basin_figure, basin_remarks, basin_rows, basin_table, basin_text, basin_words,
    manifold_rows, manifold_table,
};
pub use branch_listing::{BranchListing, BranchRecord, PointRecord};
pub use chart_figure::{chart_array, chart_figure, chart_rows, chart_timing_table};
pub use choice::{
    SectionCost, SectionDecision, SectionDocument, accuracy_words, chosen_words,
    least_orders_words, limit_words, sections_words, validity_words,
};
pub use contact_listing::{
    ContactListing, SoftImpactListing, SoftStopListing, StopNames, stop_law_words,
};
pub use convergence_page::{
    convergence_figures, convergence_section, convergence_table, convergence_text, without_times,
};
pub use curve_listing::{
    Codimension2, CurveListing, CurvePointListing, FoldListing, MarginListing, MarginParameter,
    SwitchListing, UnresolvedListing, curve_figures,
};
pub use derivatives_listing::{DerivativesListing, EventListing, SidesListing};
pub use diagram_figure::{diagram_array, diagram_figures, diagram_rows, diagram_timing_table};
pub use error::ReportError;
pub use figure::Figure;
pub use files::{
    OutputFolder, PictureForm, check_creatable, check_writable, npy_bytes, pictures, replaced_path,
    write_atomically, write_streamed,
};
pub use fit_listing::{
    fit_remarks, fit_table, fit_text, noise_figures, noise_remarks, noise_table, noise_text,
};
pub use image_listing::{ImageListing, image_outside_words, image_rows};
pub use json::{Document, DocumentKind, Named, to_json, write_json};
pub use live::LiveMap;
pub use loci_listing::{LociListing, LocusPointRecord, LocusRecord, TangencyRecord, loci_searched};
pub use map_listing::{
    ChosenCoefficients, DepthListing, ExpansionParts, LeadingTerm, MapListing, PassageParts,
    PolynomialMap, Term, depth_variables, edge_words,
};
pub use orbit_listing::{ConditionsListing, GrazeStudy, OrbitListing, PassageListing};
pub use orbits_listing::{
    BifurcationsRecord, ContactRecord, LostRecord, OrbitRecord, OrbitsListing, orbits_searched,
};
pub use page::{LivePane, Page, PageFigure, Picture, Provenance, Section, Views};
pub use pieces::{
    CommandEnd, Journal, ShardError, ShardHeader, join_shards, pack_folder, pieces_from_bytes,
    pieces_to_bytes, unpack_folder,
};
pub use run_page::{CrateSummary, RunPage, StageTime, run_page};
pub use safety_listing::{AttractorEnd, OtherAttractor, SafeInterval, SafetyListing, ToleranceBox};
pub use table::{Alignment, Cell, Column, CsvStream, Rows, Table, counted};
pub use time_series_listing::{
    EventRecord, TimeSeriesListing, time_series_columns, time_series_figures, time_series_row,
    time_series_table, time_series_text,
};
pub use window_words::{
    WindowRemark, basin_warnings, bounds_words, chart_computed_words, chart_overlay_words,
    chart_warnings, diagram_warnings, error_words, window_remark, window_words,
};
