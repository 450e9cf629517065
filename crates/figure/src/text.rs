//! Text with raised and lowered parts, such as `10^{-3}` and `x_{n}`, and the fonts used for
//! bitmaps and for measuring text.

use std::sync::OnceLock;

use plotters::style::{FontDesc, FontFamily, FontStyle, register_font};

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

/// Typeface of bitmaps and of measured text.
///
/// The sans-serif font draws α like a Latin ɑ, so that Greek letters have a font of their own.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Face {
    /// Ubuntu Light.
    Sans,
    /// Hack.
    Greek,
}

impl Face {
    const ALL: [Self; 2] = [Self::Sans, Self::Greek];

    fn of(letter: char) -> Self {
        if ('\u{370}'..='\u{3ff}').contains(&letter) { Self::Greek } else { Self::Sans }
    }

    fn family(self) -> &'static str {
        match self {
            Self::Sans => "grazemap sans",
            Self::Greek => "grazemap greek",
        }
    }

    fn bytes(self) -> &'static [u8] {
        match self {
            Self::Sans => epaint_default_fonts::UBUNTU_LIGHT,
            Self::Greek => epaint_default_fonts::HACK_REGULAR,
        }
    }

    /// Height of the line box relative to the letter size: (ascender + descender) / units per em.
    fn line_box(self) -> f64 {
        match self {
            Self::Sans => 1.121,
            Self::Greek => 1.1640625,
        }
    }

    /// The font at a letter size, in pixels per em.
    pub(super) fn font(self, size: f64) -> Result<FontDesc<'static>, FigureError> {
        static REGISTERED: OnceLock<bool> = OnceLock::new();
        let registered = REGISTERED.get_or_init(|| {
            Self::ALL
                .into_iter()
                .all(|face| register_font(face.family(), FontStyle::Normal, face.bytes()).is_ok())
        });
        if *registered {
            let family = FontFamily::Name(self.family());
            Ok(FontDesc::new(family, size * self.line_box(), FontStyle::Normal))
        } else {
            Err(FigureError::Bitmap("the built-in fonts are unreadable".to_owned()))
        }
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

/// Browsers letter SVGs with wider fonts than the ones measured here.
const RESERVE: f64 = 1.08;

/// Width of text in one typeface, in pixels, at a letter size.
pub(super) fn face_width(face: Face, text: &str, size: f64) -> Result<f64, FigureError> {
    // NOTE: widths come back as whole pixels; measuring large keeps their fractions.
    const MEASURED_AT: f64 = 1000.0;
    let (width, _) = face
        .font(MEASURED_AT)?
        .box_size(text)
        .map_err(|refused| FigureError::Bitmap(refused.to_string()))?;
    Ok(f64::from(width) * size / MEASURED_AT)
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
