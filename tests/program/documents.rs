//! Pages of documentation in the repository: headings with their link anchors, and broken links.

use std::collections::BTreeMap;
use std::error::Error;
use std::fs;
use std::path::Path;

use pulldown_cmark::{CodeBlockKind, Event, Options, Parser, Tag, TagEnd};

/// Pages outside `docs/`.
const BESIDE: [&str; 4] =
    ["README.md", "CHANGELOG.md", "CONTRIBUTING.md", "gallery/benchmark/README.md"];

/// Markdown page.
#[derive(Debug)]
pub(super) struct Document {
    /// Path in the repository, with slashes.
    pub(super) path: String,
    pub(super) text: String,
}

/// Heading of a page.
#[derive(Debug)]
pub(super) struct Heading {
    pub(super) text: String,
    /// Anchor: the part after `#` in a link to the heading.
    pub(super) anchor: String,
}

/// Code block of a page.
#[derive(Debug)]
pub(super) struct Block {
    pub(super) language: String,
    pub(super) text: String,
}

/// Pages, by path.
#[derive(Debug)]
pub(super) struct Documents(pub(super) BTreeMap<String, Document>);

impl Documents {
    /// Reads the pages of a checkout.
    pub(super) fn read(root: &Path) -> Result<Self, Box<dyn Error>> {
        let mut paths = BESIDE.map(str::to_owned).to_vec();
        let mut folders = vec!["docs".to_owned()];
        while let Some(folder) = folders.pop() {
            for entry in fs::read_dir(root.join(&folder))? {
                let entry = entry?;
                let path = format!("{folder}/{}", entry.file_name().to_string_lossy());
                match entry.file_type()?.is_dir() {
                    true => folders.push(path),
                    false if path.ends_with(".md") => paths.push(path),
                    false => {}
                }
            }
        }
        let read = |path: String| -> Result<_, Box<dyn Error>> {
            let text = fs::read_to_string(root.join(&path)).map_err(|e| format!("{path}: {e}"))?;
            Ok((path.clone(), Document { path, text }))
        };
        Ok(Self(paths.into_iter().map(read).collect::<Result<_, _>>()?))
    }

    /// Faults of the links of all pages, each with page and target.
    pub(super) fn faults(&self, root: &Path) -> Vec<String> {
        let of = |page: &Document| -> Vec<String> {
            let links = page.links().into_iter();
            let fault = |link: String| {
                let fault = self.fault(root, page, &link)?;
                Some(format!("{}: `{link}` {fault}", page.path))
            };
            links.filter_map(fault).collect()
        };
        self.0.values().flat_map(of).collect()
    }

    /// Fault of a link; `None` if its target exists or is outside the pages.
    fn fault(&self, root: &Path, page: &Document, link: &str) -> Option<String> {
        let (path, anchor) = match link.split_once('#') {
            Some((path, anchor)) => (path, Some(anchor)),
            None => (link, None),
        };
        if is_address(path) {
            return None;
        }
        let Some(target) = page.place_of(path) else {
            return Some("leads out of the repository".to_owned());
        };
        let Some(target_page) = self.0.get(&target) else {
            let is_there = anchor.is_none() && root.join(&target).is_file();
            return (!is_there)
                .then(|| format!("leads to `{target}`, which is no page and no file"));
        };
        let is_named = |anchor| target_page.headings().iter().any(|own| own.anchor == anchor);
        match anchor {
            Some(anchor) if !is_named(anchor) => Some(format!("names no heading of `{target}`")),
            _ => None,
        }
    }
}

impl Document {
    /// Markdown events of the text, with tables as on GitHub.
    pub(super) fn events(&self) -> impl Iterator<Item = Event<'_>> {
        let options = Options::ENABLE_TABLES | Options::ENABLE_YAML_STYLE_METADATA_BLOCKS;
        Parser::new_ext(&self.text, options)
    }

    /// Code blocks that name a language.
    pub(super) fn blocks(&self) -> Vec<Block> {
        let mut blocks: Vec<Block> = Vec::new();
        let mut is_open = false;
        for event in self.events() {
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

    /// Headings, in order.
    pub(super) fn headings(&self) -> Vec<Heading> {
        let mut headings: Vec<Heading> = Vec::new();
        let mut open: Option<Heading> = None;
        for event in self.events() {
            match (event, &mut open) {
                (Event::Start(Tag::Heading { .. }), _) => {
                    open = Some(Heading { text: String::new(), anchor: String::new() });
                }
                (Event::Text(words) | Event::Code(words), Some(heading)) => heading.text += &words,
                (Event::End(TagEnd::Heading(_)), Some(_)) => {
                    headings.extend(open.take().map(|heading| heading.named(&headings)));
                }
                _ => {}
            }
        }
        headings
    }

    /// Targets of links and pictures, as written.
    fn links(&self) -> Vec<String> {
        let target = |event| match event {
            Event::Start(Tag::Link { dest_url, .. } | Tag::Image { dest_url, .. }) => {
                Some(dest_url.to_string())
            }
            _ => None,
        };
        self.events().filter_map(target).collect()
    }

    /// Path in the repository of a target on this page (the page's own if empty); `None` outside
    /// the repository.
    pub(super) fn place_of(&self, target: &str) -> Option<String> {
        if target.is_empty() {
            return Some(self.path.clone());
        }
        let mut parts: Vec<&str> = self.path.split('/').collect();
        parts.pop();
        for part in target.split('/') {
            match part {
                "." => {}
                ".." => {
                    parts.pop()?;
                }
                name => parts.push(name),
            }
        }
        Some(parts.join("/"))
    }
}

impl Heading {
    /// Adds the anchor that GitHub generates: lower case letters, hyphens for blanks, and a number
    /// if earlier headings have the same anchor.
    fn named(mut self, before: &[Self]) -> Self {
        let is_kept = |letter: &char| letter.is_alphanumeric() || " -_".contains(*letter);
        let letters = self.text.to_lowercase();
        let name: String = letters.chars().filter(is_kept).collect();
        let name = name.replace(' ', "-");
        let is_free = |anchor: &String| before.iter().all(|heading| heading.anchor != *anchor);
        let mut names = (0..).map(|n| if n == 0 { name.clone() } else { format!("{name}-{n}") });
        self.anchor = names.find(is_free).expect("there is a number for every heading");
        self
    }
}

/// Whether a target is an external address, not a file of the repository.
pub(super) fn is_address(target: &str) -> bool {
    target.contains("://") || target.starts_with("mailto:")
}
