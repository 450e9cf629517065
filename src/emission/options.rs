//! What is asked of an emission: language, shape, precision, lanes.

use crate::numeric::FloatFormat;

/// Language of an emitted map.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Target {
    /// A crate of Rust without dependencies.
    #[default]
    Rust,
    /// A header that is C99, C++ and CUDA alike.
    C,
    /// The same functions with kernels for one thread a point.
    Cuda,
    /// A module of JavaScript.
    JavaScript,
    /// A module of Python, on numbers or arrays of NumPy.
    Python,
    /// A module of Julia.
    Julia,
    /// A function of MATLAB and Octave that gives the map's functions.
    Matlab,
    /// A module of WebAssembly, in bytes.
    Wasm,
}

impl Target {
    /// All of them.
    pub const ALL: [Self; 8] = [
        Self::Rust,
        Self::C,
        Self::Cuda,
        Self::JavaScript,
        Self::Python,
        Self::Julia,
        Self::Matlab,
        Self::Wasm,
    ];

    /// The word for it in commands and templates.
    pub fn word(self) -> &'static str {
        match self {
            Self::Rust => "rust",
            Self::C => "c",
            Self::Cuda => "cuda",
            Self::JavaScript => "javascript",
            Self::Python => "python",
            Self::Julia => "julia",
            Self::Matlab => "matlab",
            Self::Wasm => "wasm",
        }
    }

    /// Whether the language has numbers in double precision alone.
    pub fn is_double_only(self) -> bool {
        matches!(self, Self::JavaScript | Self::Python | Self::Julia | Self::Matlab | Self::Wasm)
    }

    /// The folder of an emission, from the folder that its module lies in.
    pub fn root_from_module(self) -> &'static str {
        match self {
            Self::Rust => "..",
            _ => ".",
        }
    }

    /// The files of a map that stands alone (see [`EmittedCrate::standalone`]), that of the module
    /// first.
    ///
    /// [`EmittedCrate::standalone`]: super::EmittedCrate::standalone
    pub fn files(self, identifier: &str) -> Vec<String> {
        match self {
            Self::Rust => {
                let module = format!("src/{identifier}.rs");
                vec![module, "Cargo.toml".to_owned(), "src/lib.rs".to_owned()]
            }
            Self::C => vec![format!("{identifier}.h")],
            Self::Cuda => vec![format!("{identifier}.cu")],
            // NOTE: the name of the file is one in the language, which no keyword may be.
            Self::JavaScript => vec![format!("map_{identifier}.js")],
            Self::Python => vec![format!("map_{identifier}.py")],
            Self::Julia => vec![format!("map_{identifier}.jl")],
            Self::Matlab => vec![format!("map_{identifier}.m")],
            Self::Wasm => vec![format!("map_{identifier}.wasm")],
        }
    }
}

/// Number of the format of emitted modules; it changes with the templates and with the printing.
pub const FORMAT: u32 = 3;

/// Shape of an emitted step.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum EmittedShape {
    /// Stage after stage: `P_smooth ∘ D`; of a map with flown contacts, the flown shape.
    Factored,
    /// One polynomial pass.
    Composed,
}

/// What is asked of an emission.
#[derive(Clone, Debug, PartialEq)]
pub struct EmitOptions {
    /// Language of the module.
    pub target: Target,
    /// Shape of the step.
    pub shape: EmittedShape,
    /// Type of states, parameters and coefficients.
    pub precision: FloatFormat,
    /// Points per call of the lane kernels, 1 to 64.
    pub lanes: usize,
    /// Error that is asked for, absolute and per coordinate, for the header.
    pub tolerance: Option<f64>,
    /// Error of which dropped monomials may use a tenth, absolute and per coordinate; `None` keeps
    /// every monomial.
    pub drop_within: Option<f64>,
    /// Error that was measured on the window, for the header.
    pub measured_error: Option<f64>,
    /// The command that emits the module again from the folder that its file lies in, for the
    /// header; `None` where no file or name of a scene is known.
    pub command: Option<String>,
    /// Whether there is a step with derivatives by the parameters too: as long again as the rest.
    pub derivatives: bool,
}

impl EmitOptions {
    /// The command of the header; of `SCENE`, the scene of the digest, where none is known.
    pub(super) fn command(&self) -> String {
        self.command.clone().unwrap_or_else(|| {
            let (word, root) = (self.target.word(), self.target.root_from_module());
            format!("grazemap emit SCENE --target {word} -o {root}")
        })
    }
}

impl Default for EmitOptions {
    fn default() -> Self {
        Self {
            target: Target::Rust,
            derivatives: true,
            shape: EmittedShape::Factored,
            precision: FloatFormat::F64,
            lanes: 8,
            tolerance: None,
            drop_within: None,
            measured_error: None,
            command: None,
        }
    }
}
