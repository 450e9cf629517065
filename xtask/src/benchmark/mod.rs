//! Benchmark for programs that compute grazing bifurcations: reference numbers as plain tables,
//! with definitions in `gallery/benchmark/README.md`.
//!
//! ```text
//! cargo run --release -p xtask -- benchmark           # writes the tables, from tests/data
//! cargo run --release -p xtask -- benchmark FOLDER    # writes this program's answers
//! ```
//!
//! Answers are images of section points by direct simulation in double-double, for
//! `gallery/benchmark/check.py`.

mod answers;
pub mod files;

use std::fs;
use std::path::PathBuf;

use crate::{Outcome, Verdict, root};

/// Arguments of the command.
#[derive(Debug, clap::Args)]
pub struct Benchmark {
    /// Folder of this program's answers; without it, the tables of the benchmark are written
    folder: Option<PathBuf>,
}

impl Benchmark {
    /// Writes the tables.
    ///
    /// # Errors
    ///
    /// Reference numbers that cannot be read, or a folder that cannot be written.
    pub fn run(&self) -> Outcome {
        let (folder, tables) = match &self.folder {
            None => (root().join("gallery/benchmark"), files::tables()?),
            Some(folder) => (folder.clone(), answers::tables()?),
        };
        for table in &tables {
            let path = folder.join(&table.path);
            fs::create_dir_all(path.parent().ok_or("a file in a folder")?)?;
            fs::write(&path, table.csv())?;
        }
        println!("{} tables in {}", tables.len(), folder.display());
        Ok(Verdict::Good)
    }
}
