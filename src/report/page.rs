//! HTML page with the report of a run, in one file that opens without a network.
//!
//! The file contains style and figures (SVG, or PNG as a data URI if there are very many dots).
//! Words from scenes are escaped everywhere. A page is complete without a script; the page of a run
//! has one, which makes its diagrams interactive with a [`LiveMap`].

use base64::Engine as _;
use base64::prelude::BASE64_STANDARD as BASE64;
use grazemap_figure::escape_html;
use serde::Serialize;
use sha2::{Digest as _, Sha256};

use super::live::LiveMap;
use super::table::{significant, typeset};
use super::{Cell, Column, Figure, PictureForm, ReportError, Table};

const TEMPLATE: &str = include_str!("../../templates/report.html.tera");
/// Style of all pages.
const STYLE: &str = include_str!("../../templates/style.css");
/// Scripts that `.ci/page --write` bundles from `web/src`.
const SCRIPT: &str = include_str!("../../templates/page.js");
const WORKER: &str = include_str!("../../templates/map_worker.js");

/// Longest SVG that is shown as such; longer ones, which are slow in browsers, are shown as PNG.
const LONGEST_SVG: usize = 400_000;

/// Largest number of points of a figure that a page offers as CSV; larger figures have files beside
/// the page.
const MOST_POINTS: usize = 1500;
/// Significant digits of those points; the files beside the page have all.
const POINT_DIGITS: usize = 7;

/// Provenance of a report; every page shows all of it.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct Provenance {
    /// Name of the scene.
    pub scene: String,
    /// Source of the scene in the literature.
    pub source: String,
    /// Digest of the inputs.
    pub digest: String,
    /// Version of the program.
    pub version: String,
    /// Section and phase, in words.
    pub section: String,
    /// Truncation orders, in words.
    pub orders: String,
    /// Other entries: name and value.
    pub more: Vec<(String, String)>,
}

/// Figure on a page.
#[derive(Debug, Clone, PartialEq)]
pub struct PageFigure {
    /// Drawing.
    pub figure: Figure,
    /// Caption. A note about thinning is added to it.
    pub caption: String,
}

#[derive(Debug, Clone, PartialEq)]
enum Block {
    Prose(String),
    /// Heading of a part of the section.
    Heading(String),
    Table {
        table: Table,
        caption: String,
    },
    Figure(Box<PageFigure>),
    Drawn {
        picture: Picture,
        caption: String,
    },
    Command(String),
    /// Text to be copied.
    Quote(String),
    /// Lines of code to be copied.
    Code(String),
    /// Names of files beside the page.
    Files(Vec<String>),
    /// Markup written by the program, with every name escaped.
    Markup(String),
    Live {
        what: LivePane,
        number: usize,
    },
    /// Blocks of which a reader with a script sees one at a time, by their names.
    Views(Vec<(String, Block)>),
}

/// Kind of an interactive figure.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum LivePane {
    /// A bifurcation diagram.
    Diagram,
    /// A chart over two parameters.
    Chart,
}

/// Figure that was drawn before.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Picture {
    /// As SVG.
    pub svg: String,
    /// PNG of twice the size, shown if the SVG is long.
    pub png: Vec<u8>,
}

/// Pictures of one thing under names: with a script a reader chooses which one is seen, without
/// one all figures are.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Views(Vec<(String, Block)>);

impl Views {
    /// Adds a place for the interactive form of a diagram or chart, by its number in the run.
    #[must_use]
    pub fn live(mut self, name: impl Into<String>, what: LivePane, number: usize) -> Self {
        self.0.push((name.into(), Block::Live { what, number }));
        self
    }

    /// Adds a figure with a caption.
    #[must_use]
    pub fn figure(
        mut self,
        name: impl Into<String>,
        figure: Figure,
        caption: impl Into<String>,
    ) -> Self {
        let caption = caption.into();
        self.0.push((name.into(), Block::Figure(Box::new(PageFigure { figure, caption }))));
        self
    }
}

/// Section of a page: a heading, then prose, tables and figures in the order added.
#[derive(Debug, Clone, PartialEq)]
pub struct Section {
    title: String,
    blocks: Vec<Block>,
}

impl Section {
    /// An empty section.
    pub fn new(title: impl Into<String>) -> Self {
        Self { title: title.into(), blocks: Vec::new() }
    }

    /// Adds a paragraph of plain words.
    #[must_use]
    pub fn prose(mut self, text: impl Into<String>) -> Self {
        self.blocks.push(Block::Prose(text.into()));
        self
    }

    /// Adds the heading of a part of the section.
    #[must_use]
    pub fn heading(mut self, text: impl Into<String>) -> Self {
        self.blocks.push(Block::Heading(text.into()));
        self
    }

    /// Adds a table with a caption; the caption may be empty.
    #[must_use]
    pub fn table(mut self, table: Table, caption: impl Into<String>) -> Self {
        self.blocks.push(Block::Table { table, caption: caption.into() });
        self
    }

    /// Adds markup in which every name is escaped already.
    #[must_use]
    pub(super) fn markup(mut self, markup: String) -> Self {
        self.blocks.push(Block::Markup(markup));
        self
    }

    /// Adds the command that computes the content of the section.
    #[must_use]
    pub fn command(mut self, command: impl Into<String>) -> Self {
        self.blocks.push(Block::Command(command.into()));
        self
    }

    /// Adds text to be copied.
    #[must_use]
    pub fn quote(mut self, text: impl Into<String>) -> Self {
        self.blocks.push(Block::Quote(text.into()));
        self
    }

    /// Adds lines of code to be copied.
    #[must_use]
    pub fn code(mut self, text: impl Into<String>) -> Self {
        self.blocks.push(Block::Code(text.into()));
        self
    }

    /// Adds links to files beside the page with the content of the section.
    #[must_use]
    pub fn files<S: Into<String>>(mut self, names: impl IntoIterator<Item = S>) -> Self {
        self.blocks.push(Block::Files(names.into_iter().map(Into::into).collect()));
        self
    }

    /// Adds pictures of which a reader chooses one.
    #[must_use]
    pub fn views(mut self, views: Views) -> Self {
        self.blocks.push(Block::Views(views.0));
        self
    }

    /// Adds a figure that was drawn before.
    #[must_use]
    pub fn picture(mut self, picture: Picture, caption: impl Into<String>) -> Self {
        self.blocks.push(Block::Drawn { picture, caption: caption.into() });
        self
    }

    /// Adds a figure with a caption.
    #[must_use]
    pub fn figure(mut self, figure: Figure, caption: impl Into<String>) -> Self {
        let caption = caption.into();
        self.blocks.push(Block::Figure(Box::new(PageFigure { figure, caption })));
        self
    }
}

/// Report: title, summary, provenance, sections.
///
/// ```
/// use grazemap::report::{Page, Provenance, Section};
///
/// let provenance = Provenance { scene: "linear <rigid>".into(), ..Provenance::default() };
/// let html = Page::new("Local map", provenance)
///     .section(Section::new("Grazing orbit").prose("Found where it was expected."))
///     .to_html()?;
/// assert!(html.contains("linear &lt;rigid&gt;"));
/// # Ok::<(), grazemap::report::ReportError>(())
/// ```
#[derive(Debug, Clone, PartialEq)]
pub struct Page {
    title: String,
    summary: String,
    provenance: Provenance,
    sections: Vec<Section>,
    live: Option<LiveMap>,
}

impl Page {
    /// Page without sections.
    pub fn new(title: impl Into<String>, provenance: Provenance) -> Self {
        let (title, summary) = (title.into(), String::new());
        Self { title, summary, provenance, sections: Vec::new(), live: None }
    }

    /// Adds a summary under the title.
    #[must_use]
    pub fn summary(mut self, text: impl Into<String>) -> Self {
        self.summary = text.into();
        self
    }

    /// Adds a section at the end.
    #[must_use]
    pub fn section(mut self, section: Section) -> Self {
        self.sections.push(section);
        self
    }

    /// Adds a map that the page's script iterates.
    #[must_use]
    pub fn alive(mut self, map: LiveMap) -> Self {
        self.live = Some(map);
        self
    }

    /// HTML document of the page.
    ///
    /// # Errors
    ///
    /// Errors of [`Figure::to_svg`] and [`Figure::to_png`]; [`ReportError::Template`].
    pub fn to_html(&self) -> Result<String, ReportError> {
        let is_alive = self.live.is_some();
        let mut counts = Counts { is_alive, ..Counts::default() };
        let mut sections = Vec::new();
        for (index, section) in self.sections.iter().enumerate() {
            let blocks = section.blocks.iter().map(|block| block_html(block, &mut counts));
            sections.push(SectionView {
                id: format!("section-{}", index + 1),
                title: &section.title,
                blocks: blocks.collect::<Result<_, _>>()?,
            });
        }
        let mut tera = tera::Tera::new();
        tera.set_escape_fn(|text, output| output.write_all(escape_html(text).as_bytes()));
        tera.add_raw_templates([("style.css", STYLE), ("report.html", TEMPLATE)])?;
        let mut context = tera::Context::new();
        context.insert("title", &self.title);
        context.insert("heading", &typeset(&self.title));
        context.insert("summary", &typeset(&self.summary));
        context.insert("provenance", &self.provenance.rows());
        context.insert("sections", &sections);
        context.insert("live", &self.live);
        context.insert("digest", &BASE64.encode(Sha256::digest(SCRIPT)));
        context.insert("script", SCRIPT);
        context.insert("worker", WORKER);
        Ok(tera.render("report.html", &context)?)
    }
}

impl Provenance {
    /// Known names and values, in the order shown.
    fn rows(&self) -> Vec<(&str, String)> {
        let named = [
            ("Scene", &self.scene),
            ("Source", &self.source),
            ("Section and phase", &self.section),
            ("Orders", &self.orders),
            ("Digest", &self.digest),
            ("Program", &self.version),
        ];
        let more = self.more.iter().map(|(name, value)| (name.as_str(), value));
        let rows = named.into_iter().chain(more).filter(|(_, value)| !value.is_empty());
        rows.map(|(name, value)| (name, typeset(value))).collect()
    }
}

#[derive(Serialize)]
struct SectionView<'a> {
    id: String,
    title: &'a str,
    blocks: Vec<String>,
}

/// Counters of figures and tables, which are numbered through the page.
#[derive(Debug, Default)]
struct Counts {
    figures: usize,
    tables: usize,
    /// Whether the page has a script, which offers the points of figures.
    is_alive: bool,
}

fn block_html(block: &Block, counts: &mut Counts) -> Result<String, ReportError> {
    match block {
        Block::Prose(text) => Ok(format!("<p>{}</p>", typeset(text))),
        Block::Heading(text) => Ok(format!("<h3>{}</h3>", escape_html(text))),
        Block::Command(command) => {
            let code = escape_html(command);
            Ok(format!("<p class=\"command\"><code>{code}</code></p>"))
        }
        Block::Quote(text) => {
            Ok(format!("<blockquote class=\"quote\"><p>{}</p></blockquote>", typeset(text)))
        }
        Block::Code(text) => {
            let text = escape_html(text);
            Ok(format!("<div class=\"quote\"><pre><code>{text}</code></pre></div>"))
        }
        Block::Views(views) => {
            let view = |(name, block): &(String, Block)| {
                // NOTE: a live pane and a figure are one element each.
                let named = format!(" data-view=\"{}\"", escape_html(name));
                let html = block_html(block, counts)?;
                let place = html.find([' ', '>']).unwrap_or(html.len());
                Ok(format!("{}{named}{}", &html[..place], &html[place..]))
            };
            let views: Vec<String> = views.iter().map(view).collect::<Result<_, ReportError>>()?;
            Ok(format!("<div class=\"views\">{}</div>", views.join("\n")))
        }
        Block::Files(names) => {
            let link = |name: &String| {
                let name = escape_html(name);
                format!("<a href=\"{name}\">{name}</a>")
            };
            let links: Vec<String> = names.iter().map(link).collect();
            Ok(format!("<p class=\"files\">Data: {}</p>", links.join(", ")))
        }
        Block::Markup(markup) => Ok(markup.clone()),
        Block::Live { what, number } => {
            let what = match what {
                LivePane::Diagram => "diagram",
                LivePane::Chart => "chart",
            };
            Ok(format!("<div class=\"live\" data-{what}=\"{number}\" hidden></div>"))
        }
        Block::Table { table, caption } => {
            counts.tables += 1;
            let number = counts.tables;
            Ok(format!(
                "<figure class=\"table\"><figcaption><b>Table {number}.</b> \
                    {}</figcaption>\n<div class=\"scroll\" tabindex=\"0\" role=\"group\" \
                    aria-label=\"Table {number}\">{}</div></figure>",
                typeset(caption),
                table.to_html()
            ))
        }
        Block::Figure(shown) => {
            let thinned =
                shown.figure.thinning()?.map(|thinning| format!(" {}", thinning.sentence()));
            let caption = shown.caption.clone() + &thinned.unwrap_or_default();
            let svg = shown.figure.to_svg()?;
            let png = || Ok(shown.figure.to_png(PictureForm::default().dots_per_inch)?);
            let picture = picture_html(&svg, png, &shown.caption)?;
            let points = match counts.is_alive {
                true => points_html(&shown.figure)?,
                false => String::new(),
            };
            Ok(figure_html(&picture, &caption, &points, counts))
        }
        Block::Drawn { picture: Picture { svg, png }, caption } => {
            let picture = picture_html(svg, || Ok(png.clone()), caption)?;
            Ok(figure_html(&picture, caption, "", counts))
        }
    }
}

/// Points of a figure as CSV in JSON, offered by the page's script; empty if there are many.
fn points_html(figure: &Figure) -> Result<String, ReportError> {
    let count: usize = figure.series.iter().map(|series| series.points.len()).sum();
    if count == 0 || count > MOST_POINTS {
        return Ok(String::new());
    }
    let points = figure.series.iter();
    let points = points.flat_map(|series| series.points.iter().map(move |point| (series, point)));
    let table = Table::of(points)
        .text("series", |(series, _)| &series.name)
        .column(Column::number("x"), |(_, [x, _])| rounded(*x))
        .column(Column::number("y"), |(_, [_, y])| rounded(*y))
        .made();
    let text = serde_json::to_string(&table.to_csv()?)?.replace('<', "\\u003c");
    Ok(format!("<script type=\"application/json\" class=\"points\">{text}</script>"))
}

/// Cell of a coordinate in the digits that a page keeps.
fn rounded(value: f64) -> Cell {
    match value.is_finite() {
        true => Cell::text(significant(value, POINT_DIGITS)),
        false => Cell::number(value, POINT_DIGITS),
    }
}

fn figure_html(picture: &str, caption: &str, points: &str, counts: &mut Counts) -> String {
    counts.figures += 1;
    let (number, caption) = (counts.figures, typeset(caption));
    // NOTE: the caption is the accessible name of the figure.
    let named = format!("role=\"img\" aria-labelledby=\"figure-{number}\"");
    let picture = picture.replacen("role=\"img\"", &named, 1);
    format!(
        "<figure><div class=\"card\">{picture}</div>\n<figcaption id=\"figure-{number}\"><b>\
            Figure {number}.</b> {caption}</figcaption>{points}</figure>"
    )
}

fn picture_html(
    svg: &str,
    png: impl Fn() -> Result<Vec<u8>, ReportError>,
    caption: &str,
) -> Result<String, ReportError> {
    if svg.len() <= LONGEST_SVG {
        return Ok(svg.to_owned());
    }
    let png = png()?;
    let [width, height] = png_size(&png).map(|side| side / 2);
    Ok(format!(
        "<img width=\"{width}\" height=\"{height}\" alt=\"{}\" src=\"data:image/png;base64,{}\">",
        escape_html(caption),
        BASE64.encode(png)
    ))
}

/// Width and height of a PNG, from its header.
fn png_size(png: &[u8]) -> [u32; 2] {
    [16, 20].map(|at| {
        let side = png.get(at..at + 4).and_then(|bytes| bytes.try_into().ok());
        side.map_or(0, u32::from_be_bytes)
    })
}

#[cfg(test)]
mod tests {
    use super::super::figure::{Axis, Series};
    use super::super::{Cell, Column};
    use super::*;

    const HOSTILE: &str = "\"><script>alert('x')</script>&\u{1b}";

    fn hostile_page() -> String {
        let mut figure = Figure::new(Axis::linear(HOSTILE), Axis::linear(HOSTILE));
        figure.title = HOSTILE.to_owned();
        figure.series.push(Series::dots(HOSTILE, vec![[0.0, 0.0], [1.0, 1.0]]));
        let mut table = Table::new(vec![Column::text(HOSTILE).with_unit(HOSTILE)]);
        table.push(vec![Cell::text(HOSTILE)]);
        let provenance = Provenance {
            scene: HOSTILE.to_owned(),
            more: vec![(HOSTILE.to_owned(), HOSTILE.to_owned())],
            ..Provenance::default()
        };
        let section =
            Section::new(HOSTILE).prose(HOSTILE).table(table, HOSTILE).figure(figure, HOSTILE);
        let page = Page::new(HOSTILE, provenance).summary(HOSTILE).section(section);
        page.to_html().expect("a page of words")
    }

    #[test]
    fn nothing_from_a_scene_becomes_markup() {
        let html = hostile_page();
        assert!(!html.contains("<script"));
        assert!(!html.contains('\u{1b}'));
        assert!(html.contains("&lt;script&gt;"));
    }

    #[test]
    fn views_are_figures_with_names_and_all_there_without_a_script() {
        let figure = || {
            let mut figure = Figure::new(Axis::linear("x"), Axis::linear("y"));
            figure.series.push(Series::dots("", vec![[0.0, 0.0], [1.0, 1.0]]));
            figure
        };
        let views = Views::default()
            .live("live", LivePane::Diagram, 2)
            .figure("by <both>", figure(), "One.")
            .figure("alone", figure(), "Two.");
        let page = Page::new("Run", Provenance::default());
        let html = page.section(Section::new("Diagram").views(views)).to_html().expect("drawn");
        for part in [
            "<div class=\"views\"><div data-view=\"live\" class=\"live\" data-diagram=\"2\"",
            "<figure data-view=\"by &lt;both&gt;\"><div class=\"card\">",
            "<figure data-view=\"alone\">",
            "<b>Figure 2.</b> Two.",
        ] {
            assert!(html.contains(part), "{part}");
        }
    }

    #[test]
    fn the_page_asks_for_nothing_from_a_network() {
        let html = hostile_page();
        let names_a_namespace = html.replace("http://www.w3.org/2000/svg", "");
        for reference in ["http:", "https:", "src=\"/", "@import", "url("] {
            assert!(!names_a_namespace.contains(reference), "{reference}");
        }
    }

    #[test]
    fn many_dots_become_a_bitmap_and_the_caption_says_how() {
        let dot = |k: u64| {
            let bits = k.wrapping_mul(0x9e37_79b9_7f4a_7c15);
            [(bits >> 40) as f64, (bits & 0xff_ffff) as f64]
        };
        let mut figure = Figure::new(Axis::linear("x"), Axis::linear("y"));
        figure.series.push(Series::dots("", (0..200_000).map(dot).collect()));
        let section = Section::new("Diagram").figure(figure, "Attractors.");
        let html =
            Page::new("Run", Provenance::default()).section(section).to_html().expect("drawn");
        assert!(html.contains("data:image/png;base64,"));
        assert!(html.contains("200000 points, drawn as the"));
    }

    #[test]
    fn the_body_of_a_small_page_is_as_recorded() {
        let mut table =
            Table::new(vec![Column::text("quantity"), Column::number("value").with_unit("ns")]);
        table.push(vec![Cell::text("step"), Cell::number(17.25, 3)]);
        let provenance = Provenance {
            scene: "linear rigid oscillator".to_owned(),
            version: "0.1.0".to_owned(),
            ..Provenance::default()
        };
        let section = Section::new("Speed").prose("One step.").table(table, "Cost of a step.");
        let page = Page::new("Local map", provenance).summary("All is well.").section(section);
        let html = page.to_html().expect("a page of words");
        assert_eq!(html, page.to_html().expect("the same page again"));
        let body = html.split_once("<body>").expect("a page has a body").1;
        insta::assert_snapshot!(body);
    }
}
