//! A benchmark for programs that compute grazing bifurcations: reference numbers as plain tables,
//! with definitions in `gallery/benchmark/README.md`.
//!
//! `cargo run --release --example benchmark` writes the tables from `tests/data`;
//! `cargo run --release --example benchmark -- FOLDER` writes this program's answers to the images
//! of section points, by direct simulation in double-double, into a folder, for
//! `gallery/benchmark/check.py`.

mod answers;
mod files;

use std::error::Error;
use std::fs;
use std::path::{Path, PathBuf};

use files::Table;

fn main() -> Result<(), Box<dyn Error>> {
    match std::env::args().nth(1) {
        None => {
            let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("gallery/benchmark");
            write(&folder, &files::tables()?)
        }
        Some(folder) => write(&PathBuf::from(folder), &answers::tables()?),
    }
}

fn write(folder: &Path, tables: &[Table]) -> Result<(), Box<dyn Error>> {
    for table in tables {
        let path = folder.join(&table.path);
        fs::create_dir_all(path.parent().ok_or("a file in a folder")?)?;
        fs::write(&path, table.csv())?;
    }
    println!("{} tables in {}", tables.len(), folder.display());
    Ok(())
}
