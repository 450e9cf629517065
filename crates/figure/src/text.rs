//! Text with raised and lowered parts, such as `10^{-3}` and `x_{n}`, and the fonts by which it is
//! measured, and drawn in bitmaps and PDF.

use std::sync::OnceLock;

use skrifa::instance::{LocationRef, Size};
use skrifa::outline::{DrawSettings, OutlinePen};
use skrifa::{FontRef, GlyphId, MetadataProvider as _};
use tiny_skia::{Path, PathBuilder};

use super::FigureError;

/// Level of a run of text relative to the line.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Level {
    Line,
    Raised,
    Lowered,
}

impl Level {
    /// Size of the letters relative to those on the line.
    pub(super) fn scale(self) -> f64 {
        match self {
            Self::Line => 1.0,
            Self::Raised | Self::Lowered => 0.72,
        }
    }

    /// Shift of the baseline downwards, in letter sizes of the line.
    pub(super) fn shift(self) -> f64 {
        match self {
            Self::Line => 0.0,
            Self::Raised => -0.38,
            Self::Lowered => 0.2,
        }
    }
}

/// Text cut into runs. An opening without its closing brace is ordinary text.
pub(super) fn runs(text: &str) -> Vec<(Level, String)> {
    let mut runs = Vec::new();
    let mut line = String::new();
    let mut rest = text;
    while let Some(first) = rest.chars().next() {
        if let Some((level, inside, after)) = shifted(rest) {
            push(&mut runs, Level::Line, std::mem::take(&mut line));
            push(&mut runs, level, inside.to_owned());
            rest = after;
        } else {
            // NOTE: a control character would make the document ill-formed.
            line.push(if first.is_control() { ' ' } else { first });
            rest = &rest[first.len_utf8()..];
        }
    }
    push(&mut runs, Level::Line, line);
    runs
}

fn push(runs: &mut Vec<(Level, String)>, level: Level, text: String) {
    if !text.is_empty() {
        runs.push((level, text));
    }
}

fn shifted(text: &str) -> Option<(Level, &str, &str)> {
    let (level, rest) = match (text.strip_prefix("^{"), text.strip_prefix("_{")) {
        (Some(rest), _) => (Level::Raised, rest),
        (_, Some(rest)) => (Level::Lowered, rest),
        _ => return None,
    };
    let (inside, after) = rest.split_once('}')?;
    (!inside.contains(char::is_control)).then_some((level, inside, after))
}

/// Symbol for a name, as the field writes it: Greek letters for their names, an underscore for a
/// lowered part.
///
/// ```
/// use grazemap_figure::symbol;
///
/// assert_eq!(symbol("alpha"), "α");
/// assert_eq!(symbol("omega_n"), "ω_{n}");
/// assert_eq!(symbol("gap"), "gap");
/// ```
pub fn symbol(name: &str) -> String {
    match name.split_once('_') {
        Some((base, index)) if !base.is_empty() && !index.is_empty() => {
            format!("{}_{{{}}}", letter(base), letter(index))
        }
        _ => letter(name).to_owned(),
    }
}

fn letter(name: &str) -> &str {
    const LETTERS: [(&str, &str); 21] = [
        ("alpha", "α"),
        ("beta", "β"),
        ("gamma", "γ"),
        ("delta", "δ"),
        ("epsilon", "ε"),
        ("zeta", "ζ"),
        ("eta", "η"),
        ("theta", "θ"),
        ("kappa", "κ"),
        ("lambda", "λ"),
        ("mu", "μ"),
        ("nu", "ν"),
        ("xi", "ξ"),
        ("rho", "ρ"),
        ("sigma", "σ"),
        ("tau", "τ"),
        ("phi", "φ"),
        ("psi", "ψ"),
        ("omega", "ω"),
        ("Delta", "Δ"),
        ("Omega", "Ω"),
    ];
    LETTERS.iter().find_map(|&(spelled, greek)| (spelled == name).then_some(greek)).unwrap_or(name)
}

/// Text escaped for use between tags and inside quoted attributes of HTML and SVG.
///
/// Characters that XML forbids (most control characters) become U+FFFD.
pub fn escape_html(text: &str) -> String {
    let mut escaped = String::with_capacity(text.len());
    for c in text.chars() {
        match c {
            '&' => escaped.push_str("&amp;"),
            '<' => escaped.push_str("&lt;"),
            '>' => escaped.push_str("&gt;"),
            '"' => escaped.push_str("&quot;"),
            '\'' => escaped.push_str("&#39;"),
            '\t' | '\n' => escaped.push(c),
            c if c.is_control() || matches!(c, '\u{fffe}' | '\u{ffff}') => escaped.push('\u{fffd}'),
            c => escaped.push(c),
        }
    }
    escaped
}

/// Typeface of drawn and of measured text.
///
/// The sans-serif font draws α like a Latin ɑ, so that Greek letters have a font of their own,
/// which lends the letters that the other lacks too.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Face {
    /// Ubuntu Light.
    Sans,
    /// Hack.
    Greek,
}

impl Face {
    fn of(letter: char) -> Self {
        let is_greek = ('\u{370}'..='\u{3ff}').contains(&letter);
        let lent = || Self::Sans.glyph(letter).is_none() && Self::Greek.glyph(letter).is_some();
        if is_greek || lent() { Self::Greek } else { Self::Sans }
    }

    /// Width of the strokes that are laid around letters, in letter sizes: the sans-serif font is a
    /// light one, and looks regular with them.
    pub(super) fn weight(self) -> f64 {
        match self {
            Self::Sans => 0.03,
            Self::Greek => 0.0,
        }
    }

    fn font(self) -> Result<&'static FontRef<'static>, FigureError> {
        static FONTS: OnceLock<Option<[FontRef<'static>; 2]>> = OnceLock::new();
        let fonts = FONTS.get_or_init(|| {
            let sans = FontRef::new(epaint_default_fonts::UBUNTU_LIGHT).ok()?;
            let greek = FontRef::new(epaint_default_fonts::HACK_REGULAR).ok()?;
            Some([sans, greek])
        });
        let [sans, greek] = fonts.as_ref().ok_or(FigureError::Font)?;
        Ok(match self {
            Self::Sans => sans,
            Self::Greek => greek,
        })
    }

    fn glyph(self, letter: char) -> Option<GlyphId> {
        self.font().ok()?.charmap().map(letter)
    }
}

/// Text without markup, cut where the typeface changes.
pub(super) fn faces(text: &str) -> Vec<(Face, String)> {
    let mut faces: Vec<(Face, String)> = Vec::new();
    for letter in text.chars() {
        let face = Face::of(letter);
        match faces.last_mut() {
            Some((last, run)) if *last == face => run.push(letter),
            _ => faces.push((face, letter.to_string())),
        }
    }
    faces
}

/// Outlines of letters, put into a path at a place of the baseline, in pixels.
struct Outlines {
    path: PathBuilder,
    at: (f32, f32),
}

/// Fonts have `y` upwards.
impl OutlinePen for Outlines {
    fn move_to(&mut self, x: f32, y: f32) {
        self.path.move_to(self.at.0 + x, self.at.1 - y);
    }

    fn line_to(&mut self, x: f32, y: f32) {
        self.path.line_to(self.at.0 + x, self.at.1 - y);
    }

    fn quad_to(&mut self, cx: f32, cy: f32, x: f32, y: f32) {
        let (left, base) = self.at;
        self.path.quad_to(left + cx, base - cy, left + x, base - y);
    }

    fn curve_to(&mut self, ax: f32, ay: f32, bx: f32, by: f32, x: f32, y: f32) {
        let (left, base) = self.at;
        self.path.cubic_to(left + ax, base - ay, left + bx, base - by, left + x, base - y);
    }

    fn close(&mut self) {
        self.path.close();
    }
}

/// Outlines of text in one typeface that begins at a place of the baseline, and its width, in
/// pixels; no outlines if it is blank.
pub(super) fn outlined(
    face: Face,
    text: &str,
    size: f64,
    (x, y): (f64, f64),
) -> Result<(Option<Path>, f64), FigureError> {
    let font = face.font()?;
    let glyphs = font.outline_glyphs();
    let mut outlines = Outlines { path: PathBuilder::new(), at: (x as f32, y as f32) };
    let mut width = 0.0;
    for letter in text.chars() {
        let glyph = font.charmap().map(letter).unwrap_or(GlyphId::NOTDEF);
        outlines.at.0 = (x + width) as f32;
        if let Some(outline) = glyphs.get(glyph) {
            let settings = DrawSettings::unhinted(Size::new(size as f32), LocationRef::default());
            outline.draw(settings, &mut outlines).map_err(|_| FigureError::Font)?;
        }
        width += advance(font, glyph) * size;
    }
    Ok((outlines.path.finish(), width))
}

/// Distance from a letter to the next, in letter sizes.
fn advance(font: &FontRef<'_>, glyph: GlyphId) -> f64 {
    let metrics = font.glyph_metrics(Size::new(1.0), LocationRef::default());
    f64::from(metrics.advance_width(glyph).unwrap_or(0.0))
}

/// Browsers letter SVGs with wider fonts than the ones measured here.
const RESERVE: f64 = 1.08;

/// Width of text in one typeface, in pixels, at a letter size.
fn face_width(face: Face, text: &str, size: f64) -> Result<f64, FigureError> {
    let font = face.font()?;
    let glyph = |letter| font.charmap().map(letter).unwrap_or(GlyphId::NOTDEF);
    Ok(text.chars().map(|letter| advance(font, glyph(letter)) * size).sum())
}

/// Width that text with markup may take in either painter.
pub(super) fn width(text: &str, size: f64) -> Result<f64, FigureError> {
    let mut total = 0.0;
    for (level, run) in runs(text) {
        for (face, run) in faces(&run) {
            total += face_width(face, &run, size * level.scale())?;
        }
    }
    Ok(total * RESERVE)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn greek_letters_have_a_font_of_their_own() {
        let run = |face, text: &str| (face, text.to_owned());
        assert_eq!(
            faces("α − α*"),
            [
                run(Face::Greek, "α"),
                run(Face::Sans, " − "),
                run(Face::Greek, "α"),
                run(Face::Sans, "*")
            ]
        );
        assert_ne!(
            face_width(Face::Greek, "α", 12.0).expect("a font"),
            face_width(Face::Sans, "α", 12.0).expect("a font")
        );
    }

    #[test]
    fn runs_follow_the_markup_and_forgive_what_is_open() {
        assert_eq!(
            runs("10^{−3} x_{n}"),
            [
                (Level::Line, "10".to_owned()),
                (Level::Raised, "−3".to_owned()),
                (Level::Line, " x".to_owned()),
                (Level::Lowered, "n".to_owned()),
            ]
        );
        assert_eq!(runs("a^{b"), [(Level::Line, "a^{b".to_owned())]);
        assert_eq!(runs("a\nb"), [(Level::Line, "a b".to_owned())]);
        assert!(runs("").is_empty());
    }
}
