//! What several test binaries need.
#![allow(dead_code, reason = "each binary uses a part of it")]

pub(crate) mod complex;
pub(crate) mod driver;
pub(crate) mod foale;
pub(crate) mod soft;
pub(crate) mod stages;
pub(crate) mod synthetic;
pub(crate) mod systems;
