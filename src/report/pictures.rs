//! Figures as files.

use super::Figure;

/// A figure as SVG and PNG. One that cannot be drawn costs no data: that is a remark instead.
pub fn pictures(stem: &str, figure: &Figure, remarks: &mut Vec<String>) -> Vec<(String, Vec<u8>)> {
    let svg = || figure.to_svg().map(String::into_bytes);
    let (svg, png) = rayon::join(svg, || figure.to_png());
    let drawn = [("svg", svg), ("png", png)];
    let picture = |(ending, bytes): (&str, Result<Vec<u8>, _>)| match bytes {
        Ok(bytes) => Some((format!("{stem}.{ending}"), bytes)),
        Err(error) => {
            remarks.push(format!("warning: {stem}.{ending} is not written: {error}"));
            None
        }
    };
    drawn.into_iter().filter_map(picture).collect()
}
