//! The languages in which a map is emitted.

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
}

impl Target {
    /// The word for it in commands and templates.
    pub fn word(self) -> &'static str {
        match self {
            Self::Rust => "rust",
            Self::C => "c",
            Self::Cuda => "cuda",
        }
    }
}
