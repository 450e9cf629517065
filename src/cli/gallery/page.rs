//! Page of the gallery.

use std::collections::BTreeMap;

use super::entry::Paper;
use super::{Agreement, Compared, Computed, Counts};
use grazemap::report::{Cell, Column, Page, Provenance, ReportError, Rows, Section, Table};

/// Page with a summary of the counts, then one section per paper. `left_out` entries take longer
/// than the version that was computed.
pub(super) fn page(
    papers: &BTreeMap<String, Paper>,
    computed: &[Computed<'_>],
    left_out: usize,
) -> Result<Page, ReportError> {
    let seconds: f64 = computed.iter().map(|entry| entry.seconds).sum();
    let mut more = vec![("Time".to_owned(), format!("{seconds:.0} s"))];
    if left_out > 0 {
        let words = format!("{left_out} entries of the whole gallery, which take minutes");
        more.push(("Left out".to_owned(), words));
    }
    let version = format!("grazemap {}", env!("CARGO_PKG_VERSION"));
    let provenance = Provenance { version, more, ..Provenance::default() };
    let summary = "Figures and tables of the literature, computed again by the map and by direct \
                   simulation, with the printed numbers beside the computed ones.";
    let all = computed.iter().map(Computed::counts).fold(Counts::default(), Counts::plus);
    let overview = Section::new("Overview")
        .prose(format!("{}.", all.words()))
        .table(overview(computed), OVERVIEW);
    let mut page =
        Page::new("Gallery of published figures", provenance).summary(summary).section(overview);
    for own in computed.chunk_by(|a, b| a.entry.folder() == b.entry.folder()) {
        let paper = papers.get(own[0].entry.folder());
        let title = paper.map_or(own[0].entry.paper.as_str(), |paper| paper.title.as_str());
        let citation = paper.and_then(Paper::citation);
        let section = citation.into_iter().fold(Section::new(title), Section::prose);
        page = page.section(own.iter().fold(section, with_entry));
    }
    Ok(page)
}

/// Caption of the overview.
const OVERVIEW: &str = "Entries and their numbers: those that agree with the print; those where \
    the print differs and a closed form, another program or another method agrees with ours; \
    those that differ; and, apart, numbers that no paper prints and that such another way \
    confirms.";

fn overview(computed: &[Computed<'_>]) -> Table {
    let mut columns = vec![Column::text("entry"), Column::text("figure")];
    columns.extend(["agree", "print differs", "differ", "not printed"].map(Column::number));
    columns.extend([Column::text("remark"), Column::number("time").with_unit("s")]);
    let rows = computed.iter().map(|entry| {
        let remark = match (&entry.fault, &entry.entry.needs) {
            (Some(_), _) => "a command ended without its result".to_owned(),
            (None, Some(needs)) if entry.lines.is_empty() => format!("needs {needs}"),
            _ => String::new(),
        };
        let counts = entry.counts();
        let counts = [counts.printed, counts.misprinted, counts.different, counts.unprinted];
        let mut row = vec![
            Cell::text(entry.entry.name),
            Cell::text(format!("{}, {}", entry.entry.paper, entry.entry.figure)),
        ];
        row.extend(counts.map(|count| Cell::Integer(count as i64)));
        row.extend([Cell::text(remark), Cell::number(entry.seconds, 2)]);
        row
    });
    Rows::new(columns, rows).into_table()
}

/// Adds an entry to the section of its paper.
fn with_entry(section: Section, computed: &Computed<'_>) -> Section {
    let entry = computed.entry;
    let heading = format!("{}, {}: {}", entry.paper, entry.figure, entry.title);
    let mut section = section.heading(heading).prose(format!("Published: {}", entry.shows.trim()));
    if !entry.verdict.is_empty() {
        section = section.prose(format!("Found: {}", entry.verdict.trim()));
    }
    if let Some(needs) = &entry.needs {
        section = section.prose(format!("Not reproduced in full: it needs {needs}."));
    }
    if let Some(fault) = &computed.fault {
        section = section.prose(format!("A command ended without its result: {fault}"));
    }
    for (picture, caption) in &computed.pictures {
        section = section.picture(picture.clone(), *caption);
    }
    if !computed.numbers.is_empty() {
        let caption = "Printed and computed numbers. They agree where they differ by no more than \
                       a unit of the last digit given, or by what ± says.";
        section = section.table(numbers(&computed.numbers), caption);
    }
    for compared in &computed.numbers {
        let number = compared.number;
        let remarks = [number.differs.as_deref().unwrap_or(""), &number.remark];
        for remark in remarks.into_iter().filter(|remark| !remark.is_empty()) {
            section = section.prose(format!("{}: {remark}", number.what));
        }
    }
    computed.lines.iter().fold(section, |section, line| section.command(line))
}

fn columns() -> Vec<Column> {
    let mut columns = vec![Column::text("quantity")];
    columns.extend(["printed", "reference", "computed"].map(Column::number));
    columns.push(Column::text("result"));
    columns
}

fn numbers(numbers: &[Compared<'_>]) -> Table {
    Rows::new(columns(), numbers.iter().map(row)).into_table()
}

/// Numbers of all entries in one table.
pub(super) fn all_numbers(computed: &[Computed<'_>]) -> Table {
    let columns = [Column::text("entry")].into_iter().chain(columns()).collect();
    let rows = computed.iter().flat_map(|entry| {
        let name = || Cell::text(entry.entry.name);
        entry.numbers.iter().map(move |compared| [vec![name()], row(compared)].concat())
    });
    Rows::new(columns, rows).into_table()
}

fn row(compared: &Compared<'_>) -> Vec<Cell> {
    let number = compared.number;
    let within = number.tolerance.map(|tolerance| format!(" ± {tolerance:e}"));
    let within = within.unwrap_or_default();
    let given = |text: &Option<String>| {
        text.as_ref().map_or(Cell::Missing, |text| Cell::text(format!("{text}{within}")))
    };
    let computed = match &compared.ours {
        Some(serde_json::Value::Number(value)) if !value.is_u64() => {
            Cell::number(value.as_f64().unwrap_or(f64::NAN), 12)
        }
        _ => Cell::text(compared.ours()),
    };
    vec![
        Cell::text(&number.what),
        given(&number.printed),
        given(&number.reference),
        computed,
        Cell::text(words(compared.agreement())),
    ]
}

fn words(agreement: Agreement) -> &'static str {
    match agreement {
        Agreement::Printed => "agrees with the print",
        Agreement::Reference => "not printed; another way agrees",
        Agreement::Misprint => "the print differs; another way agrees",
        Agreement::Explained => "differs, see below",
        Agreement::Unexplained => "differs",
    }
}
