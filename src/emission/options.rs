//! Options of an emission: language, shape, precision, lanes.

use crate::numeric::FloatFormat;

/// Language of an emitted map.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Target {
    /// Rust crate without dependencies.
    #[default]
    Rust,
    /// Header for C99, C++ and CUDA.
    C,
    /// The C header with CUDA kernels, one thread per point.
    Cuda,
    /// JavaScript module.
    JavaScript,
    /// Python module for numbers and NumPy arrays.
    Python,
    /// Julia module.
    Julia,
    /// MATLAB and Octave function that returns the functions of the map.
    Matlab,
    /// WebAssembly module, as bytes.
    Wasm,
}

impl Target {
    /// All targets.
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

    /// Word for the target in commands and templates.
    pub fn word(self) -> &'static str {
        self.syntax().word
    }

    /// Whether the language has only double precision.
    pub fn is_double_only(self) -> bool {
        self.syntax().is_double_only
    }

    /// Path to the folder of the emission from the folder of the module.
    pub fn root_from_module(self) -> &'static str {
        self.syntax().root
    }

    /// File names of a single map (see [`EmittedCrate::standalone`]), the module first.
    ///
    /// [`EmittedCrate::standalone`]: super::EmittedCrate::standalone
    pub fn files(self, identifier: &str) -> Vec<String> {
        let (before, after) = self.syntax().file;
        let others = self.syntax().others.iter();
        let others = others.map(|&name| name.to_owned());
        [format!("{before}{identifier}{after}")].into_iter().chain(others).collect()
    }
}

/// Format number of emitted modules. It changes with the templates and with the printing.
pub const FORMAT: u32 = 3;

/// Shape of an emitted step.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum EmittedShape {
    /// Stage by stage: `P_smooth ∘ D`; for a map with flown contacts, the flown shape.
    Factored,
    /// One polynomial.
    Composed,
}

/// Options of an emission.
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
    /// Requested error, absolute and per coordinate, stated in the header.
    pub tolerance: Option<f64>,
    /// Error, absolute and per coordinate, of which dropped monomials may use a tenth; `None` keeps
    /// every monomial.
    pub drop_within: Option<f64>,
    /// Measured error on the window, stated in the header.
    pub measured_error: Option<f64>,
    /// Command that reproduces the module, run in the folder of its file; stated in the header.
    /// `None` if the scene has neither a file nor a name.
    pub command: Option<String>,
    /// Whether the code also computes derivatives by the parameters; this doubles its length.
    pub derivatives: bool,
}

impl EmitOptions {
    /// Command of the header. It names the scene `SCENE` if no command is known.
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
