//! `grazemap converge`: truncation orders against direct simulation; speed against accuracy.

use super::arguments::ConvergeOptions;
use super::error::CliError;
use super::output::Results;
use super::prepare::{grazing_orbit, prepare};
use super::progress::Bar;
use super::window_edge::{warn_of_edges, window_edges};
use crate::convergence::{ConvergenceOptions, ConvergenceStudy, converge};
use crate::expansion::Expander;
use crate::report::{
    ReportError, accuracy_words, chosen_words, convergence_figures, convergence_table,
    to_dense_json, validity_words, without_times,
};

pub(super) fn run(arguments: &ConvergeOptions) -> Result<(), CliError> {
    let options = &arguments.scene;
    let scene = prepare(options)?.scene;
    let orbit = grazing_orbit(&scene)?;
    let swept = ConvergenceOptions {
        fresh: arguments.fresh as usize,
        ..ConvergenceOptions::of(&scene)
    };
    let expander = Expander::new(&scene, &orbit)?;
    let edges = window_edges(&expander, swept.highest.contact_weight)?;
    warn_of_edges(&scene, edges, options.common.quiet);
    let bar = Bar::new("convergence", &options.common);
    let study = converge(&scene, &orbit, &swept, &bar)?;
    drop(bar);
    let table = convergence_table(&study)?;
    let direct = format!(
        "direct simulation: {:.0} ns a return, error {:.1e}",
        study.direct.period_ns, study.direct.error_estimate
    );
    let text = format!(
        "{}\n{direct}\n{}\n{}\n{}\n",
        table.to_text(),
        chosen_words(&study),
        validity_words(&study.validity),
        accuracy_words(&study.accuracy)
    );
    let results = Results {
        text,
        json: to_dense_json(&study)?,
        csv: Some(table.to_csv()?),
        files: convergence_files(&study)?,
    };
    results.deliver("converge", &options.common)
}

/// Data and pictures of a study. Files named `speed` hold measured times, the others the same bytes from run to run.
pub(super) fn convergence_files(
    study: &ConvergenceStudy,
) -> Result<Vec<(String, Vec<u8>)>, ReportError> {
    let untimed = without_times(study);
    let mut files = vec![
        (
            "convergence.json".to_owned(),
            to_dense_json(&untimed)?.into_bytes(),
        ),
        (
            "convergence.csv".to_owned(),
            convergence_table(&untimed)?.to_csv()?.into_bytes(),
        ),
        (
            "convergence-speed.csv".to_owned(),
            convergence_table(study)?.to_csv()?.into_bytes(),
        ),
    ];
    for (ending, figure, _) in convergence_figures(study) {
        files.push((
            format!("convergence{ending}.svg"),
            figure.to_svg()?.into_bytes(),
        ));
        files.push((format!("convergence{ending}.png"), figure.to_png()?));
    }
    Ok(files)
}
