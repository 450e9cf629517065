//! HTML pages from Markdown pages. They open from a file: all pictures are embedded, and commands
//! of the guide are shown with their output and figures.

use std::collections::BTreeMap;
use std::error::Error;
use std::fs;
use std::path::{Path, PathBuf};

use base64::Engine as _;
use base64::prelude::BASE64_STANDARD as BASE64;
use grazemap_figure::escape_html;
use pulldown_cmark::{CodeBlockKind, CowStr, Event, Tag, TagEnd, html};
use serde::Serialize;

use super::commands::Done;
use super::documents::{Document, Documents, is_address};

const TEMPLATE: &str = include_str!("../../templates/site.html.tera");
const STYLE: &str = include_str!("../../templates/style.css");

/// Pages that come first in their group; the others follow by title.
const FIRST: [&str; 8] = [
    "README.md",
    "docs/how-to/tour.md",
    "docs/reference/scene.md",
    "docs/reference/page.md",
    "docs/reference/json.md",
    "docs/reference/emitted-code.md",
    "docs/reference/python.md",
    "docs/reference/c.md",
];

/// Groups of the navigation, by folder of their pages; the last one takes the rest.
const GROUPS: [(&str, &str); 8] = [
    ("docs/tutorials/", "Tutorials"),
    ("docs/how-to/", "How-to"),
    ("docs/reference/", "Reference"),
    ("docs/explanation/", "Explanation"),
    ("docs/mathematics/", "Mathematics"),
    ("docs/development/", "Development"),
    ("docs/studies/", "Studies"),
    ("", "More"),
];

/// Size of a picture, in bytes, above which it is shown as PNG: browsers are slow with long SVGs.
const LONGEST_SVG: u64 = 400_000;

/// Group of pages in the navigation.
#[derive(Debug, Serialize)]
struct Group<'a> {
    title: &'a str,
    pages: Vec<Entry>,
}

/// Page in the navigation.
#[derive(Debug, Serialize)]
struct Entry {
    title: String,
    /// Link, relative to the page that is shown.
    href: String,
    current: bool,
    /// Headings, if this is the page that is shown.
    parts: Vec<(String, String)>,
}

/// Site: its pages, and the output of their code blocks.
#[derive(Debug)]
pub(crate) struct Site<'a> {
    pub(crate) root: &'a Path,
    pub(crate) documents: &'a Documents,
    /// Commands that were run, by page and block, and the folder with the files of each page.
    pub(crate) done: BTreeMap<String, (Vec<Vec<Done>>, PathBuf)>,
    /// Whether the site has a page of the gallery.
    pub(crate) gallery: bool,
}

impl Site<'_> {
    /// HTML of a page, for the path given by [`place`].
    pub(crate) fn page(&self, document: &Document) -> Result<String, Box<dyn Error>> {
        let mut tera = tera::Tera::new();
        tera.set_escape_fn(|text, output| output.write_all(escape_html(text).as_bytes()));
        tera.add_raw_templates([("style.css", STYLE), ("site.html", TEMPLATE)])?;
        let mut context = tera::Context::new();
        context.insert("title", &document.title());
        context.insert("version", env!("CARGO_PKG_VERSION"));
        context.insert("home", &up(document, "index.html"));
        context.insert("gallery", &self.gallery.then(|| up(document, "gallery/index.html")));
        context.insert("groups", &self.groups(document));
        context.insert("is_titled", &document.headings().iter().any(|heading| heading.level == 1));
        context.insert("body", &self.body(document)?);
        Ok(tera.render("site.html", &context)?)
    }

    fn groups(&self, current: &Document) -> Vec<Group<'static>> {
        let group_of = |path: &str| {
            let home = if path == "README.md" { "docs/tutorials/" } else { path };
            GROUPS.iter().position(|(folder, _)| home.starts_with(folder)).unwrap_or_default()
        };
        let mut groups = GROUPS.map(|(_, title)| Group { title, pages: Vec::new() });
        let rank = |path: &str| FIRST.iter().position(|own| *own == path).unwrap_or(FIRST.len());
        let mut pages: Vec<&Document> = self.documents.0.values().collect();
        pages.sort_by_cached_key(|page| (rank(&page.path), page.title()));
        for page in pages {
            let is_current = page.path == current.path;
            let parts = page.headings().into_iter().filter(|own| is_current && own.level == 2);
            groups[group_of(&page.path)].pages.push(Entry {
                title: page.title(),
                href: up(current, &place(&page.path)),
                current: is_current,
                parts: parts.map(|own| (own.text, own.anchor)).collect(),
            });
        }
        groups.into()
    }

    fn body(&self, document: &Document) -> Result<String, Box<dyn Error>> {
        let mut anchors = document.headings().into_iter().map(|heading| heading.anchor);
        let ran = self.done.get(&document.path);
        let mut ran_blocks = ran.iter().flat_map(|(blocks, _)| blocks);
        let mut commands: Option<&Vec<Done>> = None;
        let mut events = Vec::new();
        for event in document.events() {
            match event {
                Event::Start(Tag::Heading { level, classes, attrs, .. }) => {
                    let id = anchors.next().map(CowStr::from);
                    events.push(Event::Start(Tag::Heading { level, id, classes, attrs }));
                }
                Event::Start(Tag::Link { link_type, dest_url, title, id }) => {
                    let dest_url = self.target(document, &dest_url).into();
                    events.push(Event::Start(Tag::Link { link_type, dest_url, title, id }));
                }
                Event::Start(Tag::Image { link_type, dest_url, title, id }) => {
                    let place =
                        document.place_of(&dest_url).ok_or("a picture of the repository")?;
                    let dest_url = data_address(&self.root.join(place))?.into();
                    events.push(Event::Start(Tag::Image { link_type, dest_url, title, id }));
                }
                Event::Start(Tag::Table(columns)) => {
                    events.push(Event::Html("<div class=\"scroll\" tabindex=\"0\">".into()));
                    events.push(Event::Start(Tag::Table(columns)));
                }
                Event::End(TagEnd::Table) => {
                    events.push(Event::End(TagEnd::Table));
                    events.push(Event::Html("</div>\n".into()));
                }
                Event::Start(Tag::CodeBlock(CodeBlockKind::Fenced(language))) => {
                    commands = ran_blocks.next().filter(|done| !done.is_empty());
                    if commands.is_none() {
                        let language = CodeBlockKind::Fenced(language);
                        events.push(Event::Start(Tag::CodeBlock(language)));
                    }
                }
                Event::End(TagEnd::CodeBlock) if commands.is_some() => {
                    let folder = ran.map(|(_, folder)| folder.as_path()).unwrap_or(self.root);
                    let stem = stem(&document.path);
                    for done in commands.take().into_iter().flatten() {
                        events.push(Event::Html(shown(done, folder, stem)?.into()));
                    }
                }
                Event::Text(_) if commands.is_some() => {}
                Event::Html(text) => {
                    events.push(Event::Html(self.embedded(document, &text)?.into()));
                }
                other => events.push(other),
            }
        }
        let mut text = String::new();
        html::push_html(&mut text, events.into_iter());
        Ok(text)
    }

    /// HTML of a page with its pictures embedded.
    fn embedded(&self, document: &Document, html: &str) -> Result<String, Box<dyn Error>> {
        let mut html = html.to_owned();
        for attribute in [" src=\"", " srcset=\""] {
            let mut parts = html.split(attribute);
            let mut text = parts.next().unwrap_or_default().to_owned();
            for part in parts {
                let (path, rest) = part.split_once('"').ok_or("a path in quotes")?;
                let place = document.place_of(path).ok_or("a picture of the repository")?;
                let address = data_address(&self.root.join(place))?;
                text += &format!("{attribute}{address}\"{rest}");
            }
            html = text;
        }
        Ok(html)
    }

    /// Target of a link in the site: HTML for pages, the same path for other files.
    fn target(&self, document: &Document, link: &str) -> String {
        let (path, anchor) = link.split_once('#').unwrap_or((link, ""));
        let is_page =
            document.place_of(path).is_some_and(|own| self.documents.0.contains_key(&own));
        match is_page && !is_address(path) && !path.is_empty() {
            true if anchor.is_empty() => place(path),
            true => format!("{}#{anchor}", place(path)),
            false => link.to_owned(),
        }
    }
}

/// Path in the site of a Markdown page.
pub(crate) fn place(path: &str) -> String {
    match path.strip_suffix("README.md") {
        Some(folder) => format!("{folder}index.html"),
        None => format!("{}.html", stem(path)),
    }
}

/// Path without the extension of Markdown.
fn stem(path: &str) -> &str {
    path.strip_suffix(".md").unwrap_or(path)
}

/// Path in the site, relative to the page of a document.
fn up(document: &Document, place: &str) -> String {
    format!("{}{place}", "../".repeat(document.path.matches('/').count()))
}

/// HTML of a command with its output, its pictures, and links to its files, which are in a folder
/// beside the page; for a command that wrote a page with its pictures, only a link to the page.
fn shown(done: &Done, folder: &Path, stem: &str) -> Result<String, Box<dyn Error>> {
    let line = escape_html(&done.line);
    let mut text = format!("<div class=\"run\">\n<pre><code>{line}</code></pre>\n");
    if !done.said.is_empty() {
        let said = escape_html(done.said.trim_end());
        let lines = done.said.trim_end().lines().count();
        let lines = if lines == 1 { "1 line".to_owned() } else { format!("{lines} lines") };
        text += &format!("<details><summary>prints {lines}</summary><pre>{said}</pre></details>\n");
    }
    let of = |ending: &str| {
        let is_of = |path: &&PathBuf| path.extension().is_some_and(|own| own == ending);
        done.files.iter().filter(is_of).collect::<Vec<_>>()
    };
    let name = |path: &Path| escape_html(&path.to_string_lossy().replace('\\', "/"));
    if of("html").is_empty() {
        for svg in of("svg") {
            let png = svg.with_extension("png");
            let is_long = fs::metadata(folder.join(svg))?.len() > LONGEST_SVG;
            let picture = if is_long && folder.join(&png).is_file() { &png } else { svg };
            let (address, name) = (data_address(&folder.join(picture))?, name(picture));
            text += &format!(
                "<figure><div class=\"card\"><img src=\"{address}\" alt=\"{name}, as the command \
                 above draws it\"></div><figcaption>{name}</figcaption></figure>\n"
            );
        }
    }
    let base = stem.rsplit('/').next().unwrap_or(stem);
    let link = |path: &PathBuf| {
        let name = name(path);
        format!("<a href=\"{base}/{name}\">{name}</a>")
    };
    if !done.files.is_empty() {
        let pages: Vec<String> = of("html").into_iter().map(link).collect();
        let all: Vec<String> = done.files.iter().map(link).collect();
        let (count, all) = (all.len(), all.join(", "));
        let with = if pages.is_empty() { "" } else { ", with the page " };
        text += &match count {
            ..=6 => format!("<p class=\"files\">writes {all}</p>\n"),
            _ => format!(
                "<details class=\"files\"><summary>writes {count} files{with}{}</summary>\
                 <p>{all}</p></details>\n",
                pages.join(", ")
            ),
        };
    }
    Ok(text + "</div>\n")
}

/// Picture as a data URI.
fn data_address(path: &Path) -> Result<String, Box<dyn Error>> {
    let kind = match path.extension().and_then(|ending| ending.to_str()) {
        Some("svg") => "svg+xml",
        Some("png") => "png",
        Some("webp") => "webp",
        _ => return Err(format!("{}: expected SVG, PNG or WebP", path.display()).into()),
    };
    let bytes = fs::read(path).map_err(|error| format!("{}: {error}", path.display()))?;
    Ok(format!("data:image/{kind};base64,{}", BASE64.encode(bytes)))
}
