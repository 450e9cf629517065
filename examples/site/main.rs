//! Documentation as a static site: README, changelog and `docs/` as HTML pages that open from a
//! file without a network, the commands of the guide with their output and figures, and the page of
//! the gallery.
//!
//! ```text
//! cargo build --release
//! cargo run --release --example site -- -o site
//! target/release/grazemap gallery -o gallery-page
//! cargo run --release --example site -- -o site --gallery gallery-page
//! ```
//!
//! The commands are run by the program built last. The exit code is 1 if a link is broken.

mod commands;
mod documents;
mod pages;
#[path = "../support/program.rs"]
mod program;

use std::collections::BTreeMap;
use std::error::Error;
use std::fs;
use std::path::{Path, PathBuf};
use std::process::ExitCode;

use commands::{Done, RUN, Runner};
use documents::{Document, Documents};
use pages::{Site, place};
use program::program;

/// Request on the command line.
struct Request {
    folder: PathBuf,
    gallery: Option<PathBuf>,
}

impl Request {
    fn of(mut arguments: impl Iterator<Item = String>) -> Result<Self, Box<dyn Error>> {
        let mut request = Self { folder: "out/site".into(), gallery: None };
        while let Some(option) = arguments.next() {
            let mut value = || arguments.next().ok_or(format!("`{option}` needs a folder"));
            match option.as_str() {
                "-o" => request.folder = value()?.into(),
                "--gallery" => request.gallery = Some(value()?.into()),
                _ => return Err(format!("`{option}` is no option: -o, --gallery").into()),
            }
        }
        Ok(request)
    }
}

fn main() -> ExitCode {
    match run() {
        Ok(faults) if faults.is_empty() => ExitCode::SUCCESS,
        Ok(faults) => {
            eprintln!("{}", faults.join("\n"));
            ExitCode::FAILURE
        }
        Err(error) => {
            eprintln!("error: {error}");
            ExitCode::from(2)
        }
    }
}

/// Writes the site and returns the faults of its links.
fn run() -> Result<Vec<String>, Box<dyn Error>> {
    let request = Request::of(std::env::args().skip(1))?;
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let documents = Documents::read(root)?;
    let mut done = BTreeMap::new();
    for path in RUN {
        let page = documents.0.get(path).ok_or_else(|| format!("{path} is not there"))?;
        let folder = request.folder.join(path.trim_end_matches(".md"));
        done.insert(path.to_owned(), (commands_of(page, &folder)?, folder));
    }
    let site = Site { root, documents: &documents, done, gallery: request.gallery.is_some() };
    for document in documents.0.values() {
        write(&request.folder.join(place(&document.path)), site.page(document)?.as_bytes())?;
    }
    for path in documents.files() {
        // NOTE: a missing file is reported with the faults.
        if let Ok(bytes) = fs::read(root.join(&path)) {
            write(&request.folder.join(path), &bytes)?;
        }
    }
    if let Some(gallery) = &request.gallery {
        for name in ["index.html", "numbers.csv"] {
            let from = gallery.join(name);
            let bytes = fs::read(&from).map_err(|error| {
                format!("{}: {error}; write it with `grazemap gallery -o`", from.display())
            })?;
            write(&request.folder.join("gallery").join(name), &bytes)?;
        }
    }
    println!("{} pages; open {}", documents.0.len(), request.folder.join("index.html").display());
    Ok(documents.faults(root))
}

/// Runs the commands of a page. Their files go to this folder.
fn commands_of(page: &Document, folder: &Path) -> Result<Vec<Vec<Done>>, Box<dyn Error>> {
    let empty = tempfile::tempdir()?;
    let done = Runner::new(program()?, empty.path()).page(page)?;
    for file in done.iter().flatten().flat_map(|done| &done.files) {
        write(&folder.join(file), &fs::read(empty.path().join(file))?)?;
    }
    Ok(done)
}

fn write(path: &Path, bytes: &[u8]) -> Result<(), Box<dyn Error>> {
    let folder = path.parent().ok_or("a file in a folder")?;
    let made = fs::create_dir_all(folder).and_then(|()| fs::write(path, bytes));
    Ok(made.map_err(|error| format!("{}: {error}", path.display()))?)
}
