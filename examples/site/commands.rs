//! Commands of the guide, run in the order of their page.

use std::collections::BTreeMap;
use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;
use std::time::SystemTime;

use pulldown_cmark::{CodeBlockKind, Event, Tag, TagEnd};

use super::documents::Document;

/// Pages whose `sh` blocks are run, each page in a folder of its own.
pub(crate) const RUN: [&str; 2] = ["docs/how-to/tour.md", "docs/reference/page.md"];

/// Code block of a page: language and text.
#[derive(Debug)]
pub(crate) struct Block {
    pub(crate) language: String,
    pub(crate) text: String,
}

/// Command that was run.
#[derive(Debug)]
pub(crate) struct Done {
    pub(crate) line: String,
    /// Text printed to standard output, then to standard error.
    pub(crate) said: String,
    /// Files that it wrote, relative to the folder of the page.
    pub(crate) files: Vec<PathBuf>,
}

/// Code blocks of a page that name a language.
pub(crate) fn blocks(page: &Document) -> Vec<Block> {
    let mut blocks: Vec<Block> = Vec::new();
    let mut is_open = false;
    for event in page.events() {
        match event {
            Event::Start(Tag::CodeBlock(CodeBlockKind::Fenced(language))) => {
                blocks.push(Block { language: language.to_string(), text: String::new() });
                is_open = true;
            }
            Event::Text(text) if is_open => {
                blocks.last_mut().expect("a block is open").text.push_str(&text);
            }
            Event::End(TagEnd::CodeBlock) => is_open = false,
            _ => {}
        }
    }
    blocks
}

/// Program and folder in which the commands of a page are run.
#[derive(Debug)]
pub(crate) struct Runner {
    program: PathBuf,
    folder: PathBuf,
}

impl Runner {
    /// Runner of this program in an empty folder.
    pub(crate) fn new(program: impl Into<PathBuf>, folder: impl Into<PathBuf>) -> Self {
        Self { program: program.into(), folder: folder.into() }
    }

    /// Runs the commands of a page, block by block. A CSV block is saved as `states.csv`, its name
    /// in the page; other blocks are only for reading.
    ///
    /// # Errors
    ///
    /// Page, line and message, if a line is not a command of the program or fails.
    pub(crate) fn page(&self, page: &Document) -> Result<Vec<Vec<Done>>, String> {
        let blocks = blocks(page).into_iter().map(|block| self.block(&block));
        blocks.collect::<Result<_, _>>().map_err(|fault| format!("{}: {fault}", page.path))
    }

    fn block(&self, block: &Block) -> Result<Vec<Done>, String> {
        match block.language.as_str() {
            "sh" => block.text.lines().map(|line| self.command(line)).collect(),
            "csv" => {
                let saved = fs::write(self.folder.join("states.csv"), &block.text);
                saved.map(|()| Vec::new()).map_err(|error| error.to_string())
            }
            _ => Ok(Vec::new()),
        }
    }

    fn command(&self, line: &str) -> Result<Done, String> {
        let mut words = line.split_whitespace();
        if words.next() != Some("grazemap") {
            return Err(format!("{line}: expected a command of grazemap"));
        }
        let in_line = |error: std::io::Error| format!("{line}: {error}");
        let before = files(&self.folder).map_err(in_line)?;
        let mut command = Command::new(&self.program);
        let output = command.args(words).current_dir(&self.folder).output().map_err(in_line)?;
        let said = [&output.stdout, &output.stderr].map(|said| String::from_utf8_lossy(said));
        let said = said.concat();
        if !output.status.success() {
            return Err(format!("{line}: {}\n{said}", output.status));
        }
        let mut after = files(&self.folder).map_err(in_line)?;
        after.retain(|path, time| before.get(path) != Some(time));
        Ok(Done { line: line.to_owned(), said, files: after.into_keys().collect() })
    }
}

/// Files below a folder, with their modification times.
fn files(folder: &Path) -> std::io::Result<BTreeMap<PathBuf, SystemTime>> {
    let mut found = BTreeMap::new();
    let mut folders = vec![folder.to_owned()];
    while let Some(own) = folders.pop() {
        for entry in fs::read_dir(own)? {
            let path = entry?.path();
            if path.is_dir() {
                folders.push(path);
            } else if let Ok(inside) = path.strip_prefix(folder) {
                found.insert(inside.to_owned(), fs::metadata(&path)?.modified()?);
            }
        }
    }
    Ok(found)
}
