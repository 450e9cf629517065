//! The font that bitmaps are lettered with and text is measured by.

use std::sync::OnceLock;

use plotters::style::{FontDesc, FontFamily, FontStyle, register_font};

use super::FigureError;
use super::markup::runs;

const FAMILY: &str = "grazemap sans";
/// Height of the font's line box against its letter size: (ascender + descender) / units per em.
const LINE_BOX: f64 = 1.121;
/// Browsers letter SVGs with wider fonts than the one measured here.
const RESERVE: f64 = 1.08;

/// The font at a letter size, in pixels per em.
pub(super) fn font(size: f64) -> Result<FontDesc<'static>, FigureError> {
    static REGISTERED: OnceLock<bool> = OnceLock::new();
    let registered = REGISTERED.get_or_init(|| {
        let bytes = epaint_default_fonts::UBUNTU_LIGHT;
        register_font(FAMILY, FontStyle::Normal, bytes).is_ok()
    });
    if *registered {
        let family = FontFamily::Name(FAMILY);
        Ok(FontDesc::new(family, size * LINE_BOX, FontStyle::Normal))
    } else {
        Err(FigureError::Bitmap("the built-in font is unreadable".to_owned()))
    }
}

/// Width of text without markup, in pixels, at a letter size.
pub(super) fn run_width(text: &str, size: f64) -> Result<f64, FigureError> {
    // NOTE: widths come back as whole pixels; measuring large keeps their fractions.
    const MEASURED_AT: f64 = 1000.0;
    let (width, _) = font(MEASURED_AT)?
        .box_size(text)
        .map_err(|refused| FigureError::Bitmap(refused.to_string()))?;
    Ok(f64::from(width) * size / MEASURED_AT)
}

/// Width that text with markup may take in either painter.
pub(super) fn width(text: &str, size: f64) -> Result<f64, FigureError> {
    let mut total = 0.0;
    for (level, run) in runs(text) {
        total += run_width(&run, size * level.scale())?;
    }
    Ok(total * RESERVE)
}
