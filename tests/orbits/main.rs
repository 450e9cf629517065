//! Scenes and their grazing orbits: what scenes mean, where they graze, the curves along which they
//! do.

#[path = "../support/mod.rs"]
mod support;

mod catalogue;
mod grazing_curves;
mod grazing_orbits;
mod margins;
mod model_properties;
mod narrow_forcing;
mod outside;
mod scene;
mod several_grazes;
mod several_masses;
mod two_codim;
