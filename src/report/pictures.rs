//! Figures as files.

use rayon::prelude::*;

use super::Figure;

/// Files by their names.
type Files = Vec<(String, Vec<u8>)>;

/// Figures by the names of their files, without their endings, as SVG and PNG, and what is to be
/// said of them: one that cannot be drawn costs no data.
pub fn pictures<'a>(
    figures: impl IntoParallelIterator<Item = (&'a str, &'a Figure)>,
) -> (Files, Vec<String>) {
    let drawn: Vec<_> =
        figures.into_par_iter().map(|(stem, figure)| picture(stem, figure)).collect();
    let (files, remarks): (Vec<_>, Vec<_>) = drawn.into_iter().unzip();
    (files.concat(), remarks.concat())
}

/// One of them.
fn picture(stem: &str, figure: &Figure) -> (Files, Vec<String>) {
    let svg = || figure.to_svg().map(String::into_bytes);
    let (svg, png) = rayon::join(svg, || figure.to_png());
    let (mut files, mut remarks) = (Files::new(), Vec::new());
    for (ending, drawn) in [("svg", svg), ("png", png)] {
        let name = format!("{stem}.{ending}");
        match drawn {
            Ok(bytes) => files.push((name, bytes)),
            Err(error) => remarks.push(format!("warning: {name} is not written: {error}")),
        }
    }
    (files, remarks)
}
