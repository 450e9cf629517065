//! `grazemap expand`: coefficients of `P_smooth`, `D` and their composition.

use super::arguments::SceneOptions;
use super::error::CliError;
use super::output::Results;
use super::prepare::{Plan, grazing_orbit, plan, prepare, settle};
use super::window_edge::warn_of_edges;
use grazemap::expansion::{
    ComposedMap, Expander, ExpansionError, LocalMap, RADIUS_ORDER, Stage, WindowEdge,
};
use grazemap::model::Shape;
use grazemap::orbit::GrazingOrbit;
use grazemap::report::{
    ChosenCoefficients, ExpansionParts, MapDocument, PassageParts, ReportError, depth_variables,
    least_orders_words, to_exact_json,
};

/// Everything that is expanded for a map.
#[derive(Debug)]
pub(super) struct Expanded {
    /// The map, stage by stage, in the shape the scene asks for, with the coefficients that were
    /// chosen.
    pub(super) map: LocalMap,
    /// The map of series in one polynomial pass, with the coefficients that were chosen.
    pub(super) composed: ComposedMap,
    /// What is written about it: coefficients of the Taylor series at its orders.
    pub(super) document: MapDocument,
    /// What its contacts leave out at the edge of the window, by passage; none where their series
    /// end or are flown.
    pub(super) window_edges: Vec<WindowEdge>,
}

pub(super) fn run(options: &SceneOptions) -> Result<(), CliError> {
    let scene = prepare(options)?.scene;
    let orbit = grazing_orbit(&scene)?;
    let settled = settle(&scene, &orbit, options.common.quiet)?;
    let plan = plan(&settled)?;
    let document = expand(&plan, &settled.orbit, options.common.quiet)?.document;
    let csv = document.coefficient_table()?.to_csv()?;
    let results = Results::named(
        "map",
        text(&document)? + &choice_words(&plan),
        to_exact_json(&document)?,
        Some(csv),
    );
    results.deliver("expand", &options.common)
}

/// Expands the map of a plan about its orbit; warns, unless `quiet`, of a window deeper than its
/// series.
pub(super) fn expand(plan: &Plan, orbit: &GrazingOrbit, quiet: bool) -> Result<Expanded, CliError> {
    let (scene, orders) = (&plan.scene, plan.orders);
    let expander = Expander::new(scene, orbit)?;
    refuse_depth_variables(&expander)?;
    let series = expander.expand(orders)?;
    let composed = expander.compose(&series)?;
    let contacts = series.stages.iter().filter_map(|stage| match stage {
        Stage::Contact(contact) => Some(contact),
        Stage::Leg(_) | Stage::Flown(_) => None,
    });
    let passages = contacts.enumerate().map(|(passage, contact)| {
        let depth_series = expander.depth_series(passage, RADIUS_ORDER)?;
        let (depth, weight) = (scene.window.depth, orders.contact_weight);
        Ok(PassageParts {
            surface: &series.surfaces[passage],
            variables: expander.variables_at(passage),
            contact,
            window_edge: WindowEdge::new(&depth_series, depth, weight),
            depth_series,
        })
    });
    let passages = passages.collect::<Result<Vec<_>, ExpansionError>>()?;
    let edges = passages.iter().filter_map(|passage| passage.window_edge);
    let window_edges: Vec<_> = edges.collect();
    warn_of_edges(scene, window_edges.iter().copied(), quiet);
    let parts = ExpansionParts {
        variables: expander.variables(),
        orders,
        smooth: &expander.smooth(orders.smooth_order)?,
        passages: &passages,
        composed: &composed,
        lost_digits: &expander.lost_digits(orders)?,
        choice: plan.choice.as_ref(),
        section: &plan.section,
    };
    let document = MapDocument::new(scene, orbit, parts);
    let map = plan.map(orbit)?;
    let composed = match map.fitted_to {
        Some(_) if scene.emit.shape == Shape::Composed => expander.compose(&map)?,
        _ => composed,
    };
    Ok(Expanded {
        window_edges: match scene.emit.shape {
            Shape::Flown => Vec::new(),
            _ => window_edges,
        },
        map,
        composed,
        document,
    })
}

/// What a choice says of itself beside its orders; nothing where none was made.
fn choice_words(plan: &Plan) -> String {
    plan.choice.as_ref().map_or(String::new(), |choice| {
        let coefficients = ChosenCoefficients::of(choice).words();
        let least = least_orders_words(choice);
        format!("{coefficients}\n{}", least.trim_start())
            .trim_end()
            .to_owned()
            + "\n"
    })
}

/// A variable of the scene named as a depth variable could not be told from it.
fn refuse_depth_variables(expander: &Expander<'_>) -> Result<(), CliError> {
    let depths = depth_variables(expander.passages());
    for passage in 0..expander.passages() {
        let variables = expander.variables_at(passage);
        let mut named = variables.names.iter().enumerate();
        if let Some((place, name)) = named.find(|(_, name)| depths.contains(name)) {
            return Err(CliError::DepthVariableName {
                name: name.clone(),
                kind: if place < variables.coordinates {
                    "state"
                } else {
                    "parameter"
                },
            });
        }
    }
    Ok(())
}

/// The expansion's sizes as a person reads them.
fn text(document: &MapDocument) -> Result<String, ReportError> {
    let orders = document.orders;
    let laws = document.depth.as_slice().iter().enumerate();
    let laws: String = laws
        .map(
            |(passage, laws)| match &document.discontinuity.as_slice()[passage].surface {
                Some(surface) => {
                    format!("passage {} at `{surface}`\n{}", passage + 1, laws.words())
                }
                None => laws.words(),
            },
        )
        .collect();
    Ok(format!(
        "expansion of `{}`: P_smooth to degree {}, D to weight {}\nsection: {}\n{}{}\nterms\n{}",
        document.scene,
        orders.smooth_order,
        orders.contact_weight,
        document.section.words(),
        document.section.decision_line(),
        laws,
        document.size_table()?.to_text()
    ))
}
