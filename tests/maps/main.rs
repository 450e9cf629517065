//! Jets and the local maps made of them, against closed forms, exact images and direct simulation.

#[path = "../support/mod.rs"]
mod support;

mod discrete_maps;
mod economised_maps;
mod expansions;
mod extremes;
mod flown_images;
mod flown_maps;
mod hits;
mod jets;
mod linear_series;
mod orders_where_xi_vanishes;
mod power_laws;
mod public_images;
mod public_two_maps;
mod section_images;
mod several_masses_maps;
mod soft_depths;
mod soft_images;
mod soft_jacobians;
mod soft_laws;
mod soft_series;
mod soft_two_masses;
