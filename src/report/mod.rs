//! Results as people and other programs read them: tables, figures, CSV, NPY, JSON, one HTML page.
//!
//! The floor takes plain values (numbers, points, words) and lays them out. Same input, same bytes:
//! no dates, no machine paths, no hash order.
//!
//! Deliberately absent: computing anything new. Thinning of a drawing and rounding of a printed
//! number are layout, and both are stated beside what they were done to.

mod base64;
mod error;
pub mod figure;
mod files;
mod json;
mod npy;
mod number;
mod page;
mod table;
mod table_text;

pub use error::ReportError;
pub use figure::Figure;
pub use files::{OutputFolder, write_atomically};
pub use json::to_json;
pub use npy::npy_bytes;
pub use page::{Page, PageFigure, Provenance, Section};
pub use table::{Alignment, Cell, Column, Table};
