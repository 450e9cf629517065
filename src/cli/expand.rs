//! `grazemap expand`: coefficients of `P_smooth`, `D` and their composition.

use super::arguments::SceneOptions;
use super::error::CliError;
use super::output::Results;
use super::prepare::{grazing_orbit, map_orders, prepare};
use super::window_edge::warn_of_edge;
use crate::expansion::{
    ComposedMap, Contact, Expander, Leg, LocalMap, MapOrders, RADIUS_ORDER, WindowEdge,
};
use crate::model::Scene;
use crate::orbit::GrazingOrbit;
use crate::report::{DEPTH_VARIABLE, ExpansionParts, MapDocument, ReportError, to_exact_json};

/// Everything that is expanded for a map.
#[derive(Debug)]
pub(super) struct Expanded {
    /// The map, stage by stage.
    pub(super) map: LocalMap,
    /// The map in one polynomial pass.
    pub(super) composed: ComposedMap,
    /// What is written about it.
    pub(super) document: MapDocument,
}

pub(super) fn run(options: &SceneOptions) -> Result<(), CliError> {
    let scene = prepare(options)?.scene;
    let orbit = grazing_orbit(&scene)?;
    let orders = map_orders(&scene, &orbit)?;
    let document = expand(&scene, &orbit, orders, options.common.quiet)?.document;
    let csv = document.coefficient_table()?.to_csv()?;
    let results = Results::named(
        "map",
        text(&document)?,
        to_exact_json(&document)?,
        Some(csv),
    );
    results.deliver("expand", &options.common)
}

/// Expands a scene's map about its orbit; warns, unless `quiet`, of a window deeper than its series.
pub(super) fn expand(
    scene: &Scene,
    orbit: &GrazingOrbit,
    orders: MapOrders,
    quiet: bool,
) -> Result<Expanded, CliError> {
    let expander = Expander::new(scene, orbit)?;
    refuse_depth_variable(&expander)?;
    let contact: Contact = expander.contact(orders.contact_weight)?;
    let map = expander.assemble(orders, expander.legs(orders.smooth_order)?, contact.clone());
    let smooth: Leg = expander.smooth(orders.smooth_order)?;
    let composed = expander.compose(&map)?;
    let depth_series = expander.depth_series(RADIUS_ORDER)?;
    let window_edge = WindowEdge::new(&depth_series, scene.window.depth, orders.contact_weight);
    warn_of_edge(scene, window_edge.as_ref(), quiet);
    let lost_digits = expander.lost_digits(orders)?;
    let parts = ExpansionParts {
        variables: expander.variables(),
        orders,
        smooth: &smooth,
        contact: &contact,
        composed: &composed,
        depth_series: &depth_series,
        window_edge,
        lost_digits: &lost_digits,
    };
    let document = MapDocument::new(scene, orbit, parts);
    Ok(Expanded {
        map,
        composed,
        document,
    })
}

/// A variable of the scene named as the depth variable could not be told from it.
fn refuse_depth_variable(expander: &Expander<'_>) -> Result<(), CliError> {
    let variables = expander.variables();
    match variables
        .names
        .iter()
        .position(|name| name == DEPTH_VARIABLE)
    {
        Some(place) => Err(CliError::DepthVariableName {
            name: DEPTH_VARIABLE.to_owned(),
            kind: if place < variables.coordinates {
                "state"
            } else {
                "parameter"
            },
        }),
        None => Ok(()),
    }
}

/// The expansion's sizes as a person reads them.
fn text(document: &MapDocument) -> Result<String, ReportError> {
    let orders = document.orders;
    Ok(format!(
        "expansion of `{}`: P_smooth to degree {}, D to weight {}\nsection: {}\n{}\nterms\n{}",
        document.scene,
        orders.smooth_order,
        orders.contact_weight,
        document.section.words(),
        document.depth.words(),
        document.size_table()?.to_text()
    ))
}
