//! Page of the gallery.

use super::{Agreement, Compared, Computed};
use grazemap::report::{Cell, Column, Page, Provenance, ReportError, Section, Table};

/// Page with a summary of the counts, then one section per entry.
pub(super) fn page(computed: &[Computed<'_>], small: bool) -> Result<Page, ReportError> {
    let seconds: f64 = computed.iter().map(|entry| entry.seconds).sum();
    let mut more = vec![("Time".to_owned(), format!("{seconds:.0} s"))];
    if small {
        more.push(("Points".to_owned(), "few: the small version".to_owned()));
    }
    let version = format!("grazemap {}", env!("CARGO_PKG_VERSION"));
    let provenance = Provenance { version, more, ..Provenance::default() };
    let summary = "Figures and tables of the literature, computed again by the map and by direct \
                   simulation, with the printed numbers beside the computed ones.";
    let mut page = Page::new("Gallery of published figures", provenance)
        .summary(summary)
        .section(Section::new("Overview").table(overview(computed)?, "All entries."));
    for entry in computed {
        page = page.section(section(entry)?);
    }
    Ok(page)
}

fn overview(computed: &[Computed<'_>]) -> Result<Table, ReportError> {
    let mut table = Table::new(vec![
        Column::text("entry"),
        Column::text("figure"),
        Column::text("result"),
        Column::number("time").with_unit("s"),
    ]);
    for entry in computed {
        let result = match (&entry.fault, &entry.entry.needs) {
            (Some(_), _) => "a command ended without its result".to_owned(),
            (None, Some(needs)) if entry.lines.is_empty() => format!("needs {needs}"),
            (None, _) if entry.numbers.is_empty() => "no number is printed".to_owned(),
            (None, _) => entry.counts(),
        };
        table.push(vec![
            Cell::text(entry.entry.name),
            Cell::text(format!("{}, {}", entry.entry.paper, entry.entry.figure)),
            Cell::text(result),
            Cell::number(entry.seconds, 2),
        ])?;
    }
    Ok(table)
}

fn section(computed: &Computed<'_>) -> Result<Section, ReportError> {
    let entry = computed.entry;
    let heading = format!("{}, {}: {}", entry.paper, entry.figure, entry.title);
    let mut section = Section::new(heading).prose(format!("Published: {}", entry.shows.trim()));
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
        section = section.table(numbers(&computed.numbers)?, caption);
    }
    for compared in &computed.numbers {
        let number = compared.number;
        let remarks = [number.differs.as_deref().unwrap_or(""), &number.remark];
        for remark in remarks.into_iter().filter(|remark| !remark.is_empty()) {
            section = section.prose(format!("{}: {remark}", number.what));
        }
    }
    if !computed.lines.is_empty() {
        section = section.prose(format!("Computed by\n{}", computed.lines.join("\n")));
    }
    Ok(section)
}

fn columns() -> Vec<Column> {
    let mut columns = vec![Column::text("quantity")];
    columns.extend(["printed", "reference", "computed"].map(Column::number));
    columns.push(Column::text("result"));
    columns
}

fn numbers(numbers: &[Compared<'_>]) -> Result<Table, ReportError> {
    let mut table = Table::new(columns());
    for compared in numbers {
        table.push(row(compared))?;
    }
    Ok(table)
}

/// Numbers of all entries in one table.
pub(super) fn all_numbers(computed: &[Computed<'_>]) -> Result<Table, ReportError> {
    let mut all = vec![Column::text("entry")];
    all.extend(columns());
    let mut table = Table::new(all);
    for entry in computed {
        for compared in &entry.numbers {
            let mut cells = vec![Cell::text(entry.entry.name)];
            cells.extend(row(compared));
            table.push(cells)?;
        }
    }
    Ok(table)
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
        Agreement::Printed => "agrees",
        Agreement::Reference => "agrees with the reference",
        Agreement::Misprint => "agrees with the reference; the print does not",
        Agreement::Explained => "differs, see below",
        Agreement::Unexplained => "differs",
    }
}
