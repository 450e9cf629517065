//! The files of an emission, and whether a folder holds them.

use std::collections::BTreeMap;
use std::io;
use std::path::Path;

use super::comparison::first_difference;
use super::layout::{catalogue_root, manifest, standalone_root};
use super::{EmissionError, EmittedModule, Target};
use crate::numeric::FloatFormat;

/// The files of an emission: relative path (with `/`) to text.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct EmittedCrate {
    /// The files, sorted by path.
    pub files: BTreeMap<String, String>,
}

/// How a folder differs from an emission.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Difference {
    /// A file is not there.
    Missing {
        /// Its path in the crate.
        path: String,
    },
    /// A file cannot be read.
    Unreadable {
        /// Its path in the crate.
        path: String,
    },
    /// A file has another text, beyond the rounding of coefficients.
    Changed {
        /// Its path in the crate.
        path: String,
        /// The first line that differs by more than rounding, counted from 1.
        line: usize,
    },
}

impl std::fmt::Display for Difference {
    fn fmt(&self, formatter: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Self::Missing { path } => write!(formatter, "{path} is missing"),
            Self::Unreadable { path } => write!(formatter, "{path} cannot be read"),
            Self::Changed { path, line } => write!(formatter, "{path} differs from line {line} on"),
        }
    }
}

impl EmittedCrate {
    /// A map that stands alone: in Rust a crate of manifest, root and one module, package
    /// `IDENTIFIER_map`; in C a header `IDENTIFIER.h`; in CUDA `IDENTIFIER.cu`.
    ///
    /// # Errors
    ///
    /// [`EmissionError::Layout`] if a template fails.
    pub fn standalone(module: &EmittedModule) -> Result<Self, EmissionError> {
        let name = &module.identifier;
        let text = module.text.clone();
        let files = match module.target {
            Target::Rust => BTreeMap::from([
                ("Cargo.toml".to_owned(), manifest(&format!("{name}_map"))?),
                ("src/lib.rs".to_owned(), standalone_root(name)?),
                (format!("src/{name}.rs"), text),
            ]),
            Target::C => BTreeMap::from([(format!("{name}.h"), text)]),
            Target::Cuda => BTreeMap::from([(format!("{name}.cu"), text)]),
        };
        Ok(Self { files })
    }

    /// The sources of the catalogue's crate: one module per map, sorted by name, and a registry of
    /// them.
    ///
    /// # Errors
    ///
    /// [`EmissionError::DuplicateModule`] for two maps of one name;
    /// [`EmissionError::SingleInCatalogue`] for one that is not in double precision;
    /// [`EmissionError::Layout`] if a template fails.
    pub fn catalogue(modules: &[EmittedModule]) -> Result<Self, EmissionError> {
        let mut files = BTreeMap::new();
        for module in modules {
            if module.precision != FloatFormat::F64 {
                return Err(EmissionError::SingleInCatalogue {
                    name: module.identifier.clone(),
                });
            }
            let path = format!("src/{}.rs", module.identifier);
            if files.insert(path, module.text.clone()).is_some() {
                return Err(EmissionError::DuplicateModule {
                    name: module.identifier.clone(),
                });
            }
        }
        let mut names: Vec<&str> = modules
            .iter()
            .map(|module| module.identifier.as_str())
            .collect();
        names.sort_unstable();
        files.insert("src/lib.rs".to_owned(), catalogue_root(&names)?);
        Ok(Self { files })
    }

    /// How a folder differs from this emission by more than the rounding of coefficients; other
    /// files in the folder do not count.
    pub fn check(&self, folder: &Path) -> Vec<Difference> {
        self.files
            .iter()
            .filter_map(|(path, text)| difference(path, text, &folder.join(path)))
            .collect()
    }
}

fn difference(path: &str, text: &str, file: &Path) -> Option<Difference> {
    let path = path.to_owned();
    match std::fs::read_to_string(file) {
        Err(failure) if failure.kind() == io::ErrorKind::NotFound => {
            Some(Difference::Missing { path })
        }
        Err(_) => Some(Difference::Unreadable { path }),
        Ok(found) => first_difference(&found, text).map(|line| Difference::Changed { path, line }),
    }
}
