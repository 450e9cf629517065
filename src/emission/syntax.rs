//! Syntax of the languages of emitted maps: one constant for each.
//!
//! A new language takes a variant of [`Target`], a constant here, and a template.

use super::names::{c_string_literal, string_literal};
use super::options::Target;

/// Syntax of one language. Of two words, the first is for double precision, the second for single.
#[derive(Debug)]
pub(super) struct Syntax {
    /// Word for the language in commands and templates.
    pub(super) word: &'static str,
    /// File of a single map, its identifier between.
    pub(super) file: (&'static str, &'static str),
    /// Other files of a single map.
    pub(super) others: &'static [&'static str],
    /// Path to the folder of the emission from the folder of the module.
    pub(super) root: &'static str,
    /// Name and text of the template of a module.
    pub(super) template: (&'static str, &'static str),
    /// Whether there is only double precision.
    pub(super) is_double_only: bool,
    /// Whether a compiler walks statements recursively, so that long kernels are printed in blocks.
    pub(super) nests_statements: bool,
    /// Type of a state.
    pub(super) real: [&'static str; 2],
    /// Suffix of literals and of function names.
    pub(super) suffix: [&'static str; 2],
    /// Text before and after a statement that binds a result to a name.
    pub(super) binding: [(&'static str, &'static str); 2],
    /// Sign of a product, of arrays element by element.
    pub(super) times: &'static str,
    /// Names of functions, without the suffix.
    pub(super) functions: Functions,
    /// Text before and after the number of a coefficient of the frozen map.
    pub(super) coefficient: (&'static str, &'static str),
    /// Index of the first element of an array; text before and after an index.
    pub(super) index: (usize, &'static str, &'static str),
    /// String literal of a text.
    pub(super) string: fn(&str) -> String,
    /// Infinity.
    pub(super) infinity: [&'static str; 2],
    /// A number that there is not; text before and after one that there is. Always in double
    /// precision.
    pub(super) optional: (&'static str, (&'static str, &'static str)),
}

/// Names of the functions of a kernel.
#[derive(Debug)]
pub(super) struct Functions {
    /// Fused product and sum, with the suffix in capitals; `None` where product and sum are rounded
    /// one after the other.
    pub(super) multiply_add: Option<&'static str>,
    /// Root of the positive part: text before the suffix, and before and after the argument.
    pub(super) root: (&'static str, &'static str, &'static str),
    /// `1/(2 x)`, or 0.
    pub(super) half_reciprocal: &'static str,
}

impl Target {
    /// Syntax of the language. WebAssembly kernels are not text; its header uses the syntax of
    /// JavaScript.
    pub(super) fn syntax(self) -> &'static Syntax {
        match self {
            Self::Rust => &RUST,
            Self::C => &C,
            Self::Cuda => &CUDA,
            Self::JavaScript => &JAVASCRIPT,
            Self::Python => &PYTHON,
            Self::Julia => &JULIA,
            Self::Matlab => &MATLAB,
            Self::Wasm => &WASM,
        }
    }
}

const RUST: Syntax = Syntax {
    word: "rust",
    file: ("src/", ".rs"),
    others: &["Cargo.toml", "src/lib.rs"],
    root: "..",
    template: ("map.rs.tera", include_str!("../../templates/map.rs.tera")),
    is_double_only: false,
    nests_statements: true,
    real: ["f64", "f32"],
    suffix: ["", ""],
    binding: [("let ", ";"); 2],
    times: "*",
    functions: Functions {
        multiply_add: Some("fma"),
        root: ("sqrt(positive_part", "(", "))"),
        half_reciprocal: "half_reciprocal",
    },
    coefficient: ("c(", ")"),
    index: (0, "[", "]"),
    string: string_literal,
    infinity: ["f64::INFINITY", "f32::INFINITY"],
    optional: ("None", ("Some(", ")")),
};

/// No optional numbers: a negative one stands for none.
const C: Syntax = Syntax {
    word: "c",
    file: ("", ".h"),
    others: &[],
    root: ".",
    template: ("map.c.tera", include_str!("../../templates/map.c.tera")),
    is_double_only: false,
    nests_statements: false,
    real: ["double", "float"],
    suffix: ["", "f"],
    binding: [("const double ", ";"), ("const float ", ";")],
    times: "*",
    functions: Functions {
        multiply_add: Some("GRAZEMAP_FMA"),
        root: ("grazemap_root_of_positive_part", "(", ")"),
        half_reciprocal: "grazemap_half_reciprocal",
    },
    coefficient: ("coefficients[", "]"),
    index: (0, "[", "]"),
    string: c_string_literal,
    infinity: ["INFINITY", "INFINITY"],
    optional: ("-1.0", ("", "")),
};

const CUDA: Syntax = Syntax { word: "cuda", file: ("", ".cu"), ..C };

// NOTE: the languages below use the file name as an identifier, which must not be a keyword.
const JAVASCRIPT: Syntax = Syntax {
    word: "javascript",
    file: ("map_", ".js"),
    others: &[],
    root: ".",
    template: ("map.js.tera", include_str!("../../templates/map.js.tera")),
    is_double_only: true,
    nests_statements: false,
    real: ["double", "float"],
    suffix: ["", "f"],
    binding: [("const ", ";"); 2],
    times: "*",
    functions: Functions {
        multiply_add: None,
        root: ("rootOfPositivePart", "(", ")"),
        half_reciprocal: "halfReciprocal",
    },
    coefficient: ("c[", "]"),
    index: (0, "[", "]"),
    string: quoted,
    infinity: ["Infinity", "Infinity"],
    optional: ("null", ("", "")),
};

const WASM: Syntax = Syntax { word: "wasm", file: ("map_", ".wasm"), ..JAVASCRIPT };

const PYTHON: Syntax = Syntax {
    word: "python",
    file: ("map_", ".py"),
    template: ("map.py.tera", include_str!("../../templates/map.py.tera")),
    binding: [("", ""); 2],
    functions: Functions {
        multiply_add: None,
        root: ("root_of_positive_part", "(", ")"),
        half_reciprocal: "half_reciprocal",
    },
    infinity: ["np.inf", "np.inf"],
    optional: ("None", ("", "")),
    ..JAVASCRIPT
};

const JULIA: Syntax = Syntax {
    word: "julia",
    file: ("map_", ".jl"),
    template: ("map.jl.tera", include_str!("../../templates/map.jl.tera")),
    coefficient: ("c[", "]"),
    index: (1, "[", "]"),
    infinity: ["Inf", "Inf"],
    optional: ("nothing", ("", "")),
    ..PYTHON
};

/// A row of a matrix holds an element for each point.
const MATLAB: Syntax = Syntax {
    word: "matlab",
    file: ("map_", ".m"),
    template: ("map.m.tera", include_str!("../../templates/map.m.tera")),
    binding: [("", ";"); 2],
    times: ".*",
    index: (1, "(", ", :)"),
    coefficient: ("c(", ", :)"),
    string: |text| format!("'{}'", plain(text).replace('\'', "''")),
    optional: ("[]", ("", "")),
    ..JULIA
};

fn quoted(text: &str) -> String {
    format!("{:?}", plain(text))
}

/// Text with every character that a language could interpret replaced by `?`.
fn plain(text: &str) -> String {
    let is_plain = |c: char| c.is_ascii_graphic() && !matches!(c, '\\' | '"' | '$') || c == ' ';
    text.chars().map(|c| if is_plain(c) { c } else { '?' }).collect()
}
