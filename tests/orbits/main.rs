//! Scenes and their grazing orbits: meaning of scenes, grazing points, grazing curves.

#[path = "../support/mod.rs"]
mod support;

mod catalogue;
mod derivatives;
mod grazing_curves;
mod grazing_orbits;
mod hits;
mod margins;
mod model_properties;
mod narrow_forcing;
mod outside;
mod scene;
mod several_grazes;
mod several_masses;
mod two_codim;
