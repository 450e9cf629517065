//! `grazemap converge`: truncation orders against direct simulation; speed against accuracy.

use serde::Serialize;

use super::arguments::ConvergeOptions;
use super::error::CliError;
use super::output::Results;
use super::prepare::{grazing_orbit, prepare, settle};
use super::progress::Bar;
use super::window_edge::{warn_of_edges, window_edges};
use grazemap::convergence::{ConvergenceOptions, ConvergenceStudy, converge};
use grazemap::expansion::Expander;
use grazemap::report::{
    ReportError, SectionDocument, accuracy_words, chosen_words, convergence_figures,
    convergence_table, sections_words, to_dense_json, validity_words, without_times,
};

pub(super) fn run(options: &ConvergeOptions) -> Result<(), CliError> {
    let (options, fresh) = (&options.scene, options.fresh as usize);
    let scene = prepare(options)?.scene;
    let settled = settle(&scene, &grazing_orbit(&scene)?, options.common.quiet)?;
    let (scene, orbit) = (&settled.scene, &settled.orbit);
    let swept = ConvergenceOptions {
        fresh,
        sections: settled.verdict.is_none(),
        ..ConvergenceOptions::of(scene)
    };
    let expander = Expander::new(scene, orbit)?;
    let bar = Bar::new("convergence", &options.common);
    let mut study = converge(scene, orbit, &swept, &bar)?;
    drop(bar);
    if let Some(verdict) = &settled.verdict {
        study.sections = verdict.others.clone();
    }
    let section = SectionDocument::settled(&settled);
    let highest = study
        .orders
        .iter()
        .map(|result| result.contact_weight)
        .max();
    let edges = window_edges(&expander, highest.unwrap_or(1))?;
    warn_of_edges(scene, edges, options.common.quiet);
    let table = convergence_table(&study)?;
    let direct = format!(
        "direct simulation ({}): {:.0} ns a return, error {:.1e}",
        study.direct.method, study.direct.period_ns, study.direct.error_estimate
    );
    let text = format!(
        "{}\n{direct}\n{}\n{}{}\n{}\n",
        table.to_text(),
        chosen_words(&study),
        sections_line(&study),
        validity_words(&study.validity),
        accuracy_words(&study.accuracy)
    );
    let results = Results {
        text,
        json: to_dense_json(&StudyDocument {
            study: &study,
            section: &section,
        })?,
        csv: Some(table.to_csv()?),
        files: convergence_files(&study, &section)?,
    };
    results.deliver("converge", &options.common)
}

/// A study as it is written to JSON.
#[derive(Serialize)]
struct StudyDocument<'a> {
    #[serde(flatten)]
    study: &'a ConvergenceStudy,
    section: &'a SectionDocument,
}

/// What other sections cost, on a line of its own.
fn sections_line(study: &ConvergenceStudy) -> String {
    match sections_words(study) {
        words if words.is_empty() => words,
        words => words + "\n",
    }
}

/// Data and pictures of a study. Files named `speed` hold measured times, the others the same bytes
/// from run to run.
pub(super) fn convergence_files(
    study: &ConvergenceStudy,
    section: &SectionDocument,
) -> Result<Vec<(String, Vec<u8>)>, ReportError> {
    let untimed = without_times(study);
    let document = StudyDocument {
        study: &untimed,
        section,
    };
    let mut files = vec![
        (
            "convergence.json".to_owned(),
            to_dense_json(&document)?.into_bytes(),
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
