//! `grazemap expand`: coefficients of `P_smooth`, `D` and their composition.

use super::{map, open, remark_on_window};
use crate::cli::arguments::SceneOptions;
use crate::cli::output::{CliError, Results};
use grazemap::convergence::Choice;
use grazemap::model::Scene;
use grazemap::report::{
    ChosenCoefficients, MapListing, ReportError, least_orders_words, window_words,
};

pub(in crate::cli) fn run(options: &SceneOptions) -> Result<(), CliError> {
    let map = map(open(options)?, options.common.outlets.quiet)?;
    let listing = map.listing()?;
    remark_on_window(&map, options.common.outlets.quiet);
    let choice = map.choice().map_or_else(String::new, choice_words);
    let text = text(map.scene(), listing)? + &window_words(&listing.window) + &choice;
    let csv = listing.coefficient_table()?.to_csv()?;
    let results = Results::named("map", text, map.to_json()?, Some(csv));
    results.deliver("expand", &options.common.outlets)
}

/// What a choice says of itself beside its orders.
fn choice_words(choice: &Choice) -> String {
    let coefficients = ChosenCoefficients::of(choice).words();
    let least = least_orders_words(choice);
    let words = format!("{coefficients}\n{}", least.trim_start());
    words.trim_end().to_owned() + "\n"
}

/// The expansion's sizes as a person reads them.
fn text(scene: &Scene, document: &MapListing) -> Result<String, ReportError> {
    let orders = document.orders;
    let laws = document.depth.iter().enumerate().map(|(passage, laws)| {
        let contact = document.discontinuity.get(passage);
        match contact.and_then(|contact| contact.surface.as_ref()) {
            Some(surface) => format!("passage {} at `{surface}`\n{}", passage + 1, laws.words()),
            None => laws.words(),
        }
    });
    let laws: String = laws.collect();
    Ok(format!(
        "expansion of `{}`: P_smooth to degree {}, D to weight {}\nsection: {}\n{}{}\nterms\n{}",
        scene.identifier,
        orders.smooth_order,
        orders.contact_weight,
        document.section.words(),
        document.section.decision_line(),
        laws,
        document.size_table()?.to_text()
    ))
}
