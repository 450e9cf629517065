//! Names allowed in a scene, and the known name nearest to a mistyped one.

use super::graph::{Binary, Unary};

/// Longest name accepted, in bytes.
pub(super) const LONGEST_NAME: usize = 64;

/// A function of the expression language.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Function {
    /// One argument.
    Unary(Unary),
    /// Two arguments.
    Binary(Binary),
}

impl Function {
    /// Number of arguments.
    pub(super) fn arity(self) -> usize {
        match self {
            Function::Unary(_) => 1,
            Function::Binary(_) => 2,
        }
    }
}

/// Every function of the language by name.
const FUNCTIONS: [(&str, Function); 17] = [
    ("sqrt", Function::Unary(Unary::Sqrt)),
    ("exp", Function::Unary(Unary::Exp)),
    ("log", Function::Unary(Unary::Log)),
    ("sin", Function::Unary(Unary::Sin)),
    ("cos", Function::Unary(Unary::Cos)),
    ("tan", Function::Unary(Unary::Tan)),
    ("asin", Function::Unary(Unary::Asin)),
    ("acos", Function::Unary(Unary::Acos)),
    ("atan", Function::Unary(Unary::Atan)),
    ("atan2", Function::Binary(Binary::Atan2)),
    ("sinh", Function::Unary(Unary::Sinh)),
    ("cosh", Function::Unary(Unary::Cosh)),
    ("tanh", Function::Unary(Unary::Tanh)),
    ("abs", Function::Unary(Unary::Abs)),
    ("sign", Function::Unary(Unary::Sign)),
    ("min", Function::Binary(Binary::Min)),
    ("max", Function::Binary(Binary::Max)),
];

/// The constant of the language.
pub(super) const PI: &str = "pi";

/// Name of a component's free-flight expression in a contact law.
pub(super) const FREE: &str = "free";

/// Name of the penetration `−h` in a contact law, unless the scene gives it to something else.
pub(super) const PENETRATION: &str = "d";

/// Function with a given name.
pub(super) fn function(name: &str) -> Option<Function> {
    FUNCTIONS.iter().find(|(known, _)| *known == name).map(|&(_, function)| function)
}

/// Names of all functions.
pub(super) fn function_names() -> impl Iterator<Item = &'static str> {
    FUNCTIONS.iter().map(|&(name, _)| name)
}

/// Remedy for a switch between two laws.
const SWITCH: &str = "a law that switches at a surface is a `[[model.surface]]` with `contact`; \
                      elsewhere `(1 + sign(x))/2`, or smooth `(1 + tanh(k*x))/2`";

/// Remedy for a function that is not analytic.
const STEPS: &str = "no such function is analytic; `tanh(k*sin(theta))` is a square wave";

/// Names and characters of other languages, with their spelling in this one.
const SPELLINGS: &[(&[&str], &str)] = &[
    (&["heaviside", "h", "step", "unitstep", "u"], SWITCH),
    (&["if", "ifelse", "iif", "where", "piecewise", "select"], SWITCH),
    (&["<", ">", "=", "?", "&", "\u{2264}", "\u{2265}"], SWITCH),
    (&["floor", "ceil", "round", "mod", "fmod", "square", "sawtooth", "%"], STEPS),
    (&["ln", "loge"], "the natural logarithm is `log`"),
    (&["log10", "lg"], "write `log(x)/log(10)`"),
    (&["log2", "ld"], "write `log(x)/log(2)`"),
    (&["pow", "power"], "a power is `a^b`"),
    (&["arcsin"], "the arc sine is `asin`"),
    (&["arccos"], "the arc cosine is `acos`"),
    (&["arctan"], "the arc tangent is `atan`"),
    (&["arctan2"], "the angle of a point is `atan2(y, x)`"),
    (&["sgn", "signum"], "the sign is `sign`"),
    (&["fabs", "|"], "the absolute value is `abs(x)`"),
    (&["sqr"], "a square is `x^2`"),
    (&["cbrt"], "write `x^(1/3)`"),
    (&["cot"], "write `cos(x)/sin(x)`"),
    (&["sec"], "write `1/cos(x)`"),
    (&["csc", "cosec"], "write `1/sin(x)`"),
    (&["coth"], "write `1/tanh(x)`"),
    (&["sech"], "write `1/cosh(x)`"),
    (&["csch"], "write `1/sinh(x)`"),
    (&["asinh", "arcsinh"], "write `log(x + sqrt(x^2 + 1))`"),
    (&["acosh", "arccosh"], "write `log(x + sqrt(x^2 - 1))`"),
    (&["atanh", "arctanh"], "write `log((1 + x)/(1 - x))/2`"),
    (&["pi", "\u{3c0}"], "the number is `pi`"),
    (&["tau", "\u{3c4}"], "a turn is `2*pi`"),
    (&["e", "euler"], "the number is `exp(1)`"),
    (&["t", "time"], "time enters as a phase: see `[model.phase]`, and write `cos(theta)`"),
    (&["\u{b7}", "\u{d7}", "\u{2217}", "\u{22c5}"], "a product is `*`"),
    (&["\u{2212}", "\u{2013}", "\u{2014}"], "a minus is `-`"),
    (&["\u{b2}"], "a square is `^2`"),
    (&["\u{b3}"], "a cube is `^3`"),
    (&["[", "]", "{", "}"], "brackets are `(` and `)`"),
];

/// Spelling in this language of a name or character of another language.
pub(super) fn spelling(foreign: &str) -> Option<&'static str> {
    let lower = foreign.to_lowercase();
    let known = SPELLINGS.iter().find(|(names, _)| names.contains(&&*lower));
    known.map(|&(_, spelling)| spelling)
}

/// Whether a name is reserved: a function, `pi` or `free`, or a number such as `nan` and `inf`,
/// which a table of results could not tell from a value.
pub(super) fn is_reserved(name: &str) -> bool {
    name == PI || name == FREE || function(name).is_some() || name.parse::<f64>().is_ok()
}

/// Whether a text has the form of a name: `[A-Za-z_][A-Za-z0-9_]*`, not too long.
pub(super) fn is_name(text: &str) -> bool {
    let first = text.bytes().next().is_some_and(|byte| byte.is_ascii_alphabetic() || byte == b'_');
    first
        && text.len() <= LONGEST_NAME
        && text.bytes().all(|byte| byte.is_ascii_alphanumeric() || byte == b'_')
}

/// The known name nearest to `name`; `None` if none is near enough to be a misspelling.
pub fn nearest<'a>(name: &str, known: impl IntoIterator<Item = &'a str>) -> Option<String> {
    if name.len() > LONGEST_NAME {
        return None;
    }
    let allowed = (name.chars().count() / 3).max(1);
    known
        .into_iter()
        .filter(|candidate| candidate.len() <= LONGEST_NAME)
        .map(|candidate| (strsim::damerau_levenshtein(name, candidate), candidate))
        .filter(|(distance, candidate)| {
            *distance <= allowed && *distance < candidate.chars().count()
        })
        .min_by_key(|(distance, _)| *distance)
        .map(|(_, candidate)| candidate.to_owned())
}

/// Keywords of Rust that cannot name a module or a variable.
const KEYWORDS: [&str; 51] = [
    "abstract", "as", "async", "await", "become", "box", "break", "const", "continue", "crate",
    "do", "dyn", "else", "enum", "extern", "false", "final", "fn", "for", "gen", "if", "impl",
    "in", "let", "loop", "macro", "match", "mod", "move", "mut", "override", "priv", "pub", "ref",
    "return", "self", "static", "struct", "super", "trait", "true", "try", "type", "typeof",
    "unsafe", "unsized", "use", "virtual", "where", "while", "yield",
];

/// Names of files that every Rust crate has.
const CRATE_FILES: [&str; 2] = ["lib", "main"];

/// Whether a name is a keyword of Rust.
pub(super) fn is_rust_word(name: &str) -> bool {
    name == "_" || name == "Self" || KEYWORDS.contains(&name)
}

/// Identifier of a scene from the name of its file: lower case, `[a-z][a-z0-9_]*`, never a keyword
/// of Rust nor the name of a file that every crate has.
pub(super) fn identifier(file_name: &str) -> String {
    let base = file_name.rsplit(['/', '\\']).next().unwrap_or_default();
    let stem = base.strip_suffix(".toml").unwrap_or(base);
    let mut identifier: String = (stem.chars().take(LONGEST_NAME))
        .map(
            |letter| {
                if letter.is_ascii_alphanumeric() { letter.to_ascii_lowercase() } else { '_' }
            },
        )
        .collect();
    if !identifier.starts_with(|first: char| first.is_ascii_lowercase()) {
        identifier.insert_str(0, if identifier.starts_with('_') { "scene" } else { "scene_" });
    }
    if KEYWORDS.contains(&identifier.as_str()) || CRATE_FILES.contains(&identifier.as_str()) {
        identifier.push_str("_scene");
    }
    identifier.truncate(LONGEST_NAME);
    identifier
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn identifiers_are_module_names_whatever_the_file_is_called() {
        for (file, expected) in [
            ("scenes/linear.toml", "linear"),
            ("Foale (2.2).toml", "foale__2_2_"),
            ("7beams.toml", "scene_7beams"),
            ("fn.toml", "fn_scene"),
            ("lib.toml", "lib_scene"),
            ("main.toml", "main_scene"),
            ("union.toml", "union"),
            ("", "scene_"),
            (".toml", "scene_"),
            ("__.toml", "scene__"),
            ("µ.toml", "scene_"),
        ] {
            assert_eq!(identifier(file), expected, "{file}");
        }
        assert_eq!(identifier(&"7".repeat(80)).len(), LONGEST_NAME);
    }

    #[test]
    fn a_slip_of_the_keyboard_finds_the_name_and_another_word_does_not() {
        let known = ["velocity", "position", "r"];
        assert_eq!(nearest("velocty", known).as_deref(), Some("velocity"));
        assert_eq!(nearest("zeta", known), None);
        assert_eq!(nearest("q", known), None);
    }
}
