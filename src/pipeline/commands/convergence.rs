//! `converge`: truncation orders against direct simulation; speed against accuracy.

use serde::{Deserialize, Serialize};

use crate::analysis::Progress;
use crate::convergence::ConvergenceStudy;
use crate::model::Shape;
use crate::pipeline::remarks::edge_remark;
use crate::pipeline::{Answer, Error, Settled, StudyRequest};
use crate::report::{
    DocumentKind, SectionDocument, convergence_figures, convergence_table, convergence_text,
    to_json, without_times,
};

/// The keys of `converge`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct ConvergenceKeys {
    /// Fresh points at which the chosen map is compared with direct simulation.
    pub fresh: u32,
}

impl Default for ConvergenceKeys {
    /// As many fresh points as a study takes by itself.
    fn default() -> Self {
        Self { fresh: StudyRequest::FRESH as u32 }
    }
}

impl ConvergenceKeys {
    /// The study, laid out.
    ///
    /// # Errors
    ///
    /// As [`Settled::study`].
    pub fn answer(&self, settled: &Settled, progress: &dyn Progress) -> Result<Answer, Error> {
        let request = StudyRequest { fresh: self.fresh as usize, sections: true, chosen: None };
        let study = settled.study(&request, progress)?;
        let weights = study.orders.iter().map(|result| result.orders.contact_weight);
        let edges = settled.window_edges(weights.max().unwrap_or(1))?;
        // Contacts that are flown are not truncated.
        let series = settled.scene().emit.shape != Shape::Flown;
        let remark = edge_remark(&edges).filter(|_| series);
        let identifier = &settled.scene().identifier;
        let remark = remark.map(|words| format!("warning: `{identifier}`: {words}"));
        let answer = study_answer(&study, &settled.section())?;
        Ok(Answer { remarks: remark.into_iter().collect(), ..answer })
    }
}

/// A study, laid out. Tables named `speed` hold measured times, the others the same from run to
/// run.
pub(in crate::pipeline) fn study_answer(
    study: &ConvergenceStudy,
    section: &SectionDocument,
) -> Result<Answer, Error> {
    let untimed = without_times(study);
    let (text, document) = (convergence_text(study)?, StudyDocument::new(study, section));
    let timeless = to_json(&StudyDocument::new(&untimed, section))?;
    let figures = convergence_figures(study).into_iter();
    let answer =
        Answer::new("convergence", text, to_json(&document)?, convergence_table(&untimed)?)
            .with_figures(figures.map(|(ending, figure, _)| (ending, figure)));
    let mut answer = Answer { timeless: Some(timeless), ..answer };
    answer.tables.push(("convergence-speed", convergence_table(study)?));
    Ok(answer)
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
