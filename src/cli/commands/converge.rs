//! `grazemap converge`: truncation orders against direct simulation; speed against accuracy.

use serde::Serialize;

use super::sweeps::pictures;
use super::{open, settle, warn_of_edges};
use crate::cli::arguments::ConvergeOptions;
use crate::cli::output::{Bar, CliError, Results};
use crate::cli::resume::Resumable;
use grazemap::convergence::ConvergenceStudy;
use grazemap::pipeline::StudyRequest;
use grazemap::report::{
    DocumentKind, ReportError, SectionDocument, accuracy_words, chosen_words, convergence_figures,
    convergence_table, sections_words, to_json, validity_words, without_times,
};

pub(in crate::cli) fn run(options: &ConvergeOptions) -> Result<(), CliError> {
    let outlets = &options.scene.common.outlets;
    let settled = settle(open(&options.scene)?, outlets.quiet)?;
    let request = StudyRequest { fresh: options.fresh as usize, sections: true, chosen: None };
    let decisive = [&*settled.graze().to_json()?, &options.fresh.to_string()];
    let resumable = Resumable::begin("converge", outlets.folder(), &decisive, outlets.quiet);
    let bar = Bar::new("convergence", outlets.quiet).resuming(0, resumable.journal());
    let study = settled.study(&request, &bar)?;
    drop(bar);
    let section = settled.section();
    let weights = study.orders.iter().map(|result| result.orders.contact_weight);
    let edges = settled.window_edges(weights.max().unwrap_or(1))?;
    warn_of_edges(settled.scene(), &edges, outlets.quiet);
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
        json: to_json(&StudyDocument::new(&study, &section))?,
        csv: Some(table.to_csv()?),
        files: convergence_files(&study, &section)?,
    };
    results.deliver("converge", outlets)?;
    resumable.finish();
    Ok(())
}

/// A study as it is written to JSON.
#[derive(Serialize)]
struct StudyDocument<'a> {
    document: DocumentKind,
    format: u32,
    #[serde(flatten)]
    study: &'a ConvergenceStudy,
    section: &'a SectionDocument,
}

impl<'a> StudyDocument<'a> {
    fn new(study: &'a ConvergenceStudy, section: &'a SectionDocument) -> Self {
        Self { document: DocumentKind::Convergence, format: DocumentKind::FORMAT, study, section }
    }
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
    let document = StudyDocument::new(&untimed, section);
    let mut files = vec![
        ("convergence.json".to_owned(), to_json(&document)?.into_bytes()),
        ("convergence.csv".to_owned(), convergence_table(&untimed)?.to_csv()?.into_bytes()),
        ("convergence-speed.csv".to_owned(), convergence_table(study)?.to_csv()?.into_bytes()),
    ];
    for (ending, figure, _) in convergence_figures(study) {
        files.extend(pictures(&format!("convergence{ending}"), &figure));
    }
    Ok(files)
}
