//! Citation of the program, from the file `CITATION.cff` of the repository.

use super::{Cell, Column, Table};

/// Citation of this version.
const TEXT: &str = include_str!("../../CITATION.cff");

/// Fields of a citation.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) struct Citation {
    authors: Vec<String>,
    title: String,
    version: String,
    /// Year of the release, if it is stated.
    year: Option<String>,
    doi: Option<String>,
    address: Option<String>,
}

impl Citation {
    /// Citation of the running program.
    pub(super) fn of_program() -> Self {
        let version = env!("CARGO_PKG_VERSION").to_owned();
        Self { version, ..Self::parse(TEXT) }
    }

    /// Reads the fields that stand on one line each, and the names of authors.
    fn parse(text: &str) -> Self {
        let unquoted = |value: &str| value.trim().trim_matches(['"', '\'']).to_owned();
        let field = |name: &str| {
            let value = |line: &str| line.strip_prefix(name)?.strip_prefix(':').map(unquoted);
            text.lines().find_map(value).filter(|value| !value.is_empty())
        };
        let listed = text.lines().skip_while(|line| !line.starts_with("authors:")).skip(1);
        let listed = listed.take_while(|line| line.starts_with(' '));
        let mut authors: Vec<String> = Vec::new();
        for line in listed {
            let Some((key, value)) = line.trim_start_matches([' ', '-']).split_once(':') else {
                continue;
            };
            match (key, authors.last_mut()) {
                ("name" | "family-names", _) => authors.push(unquoted(value)),
                ("given-names", Some(author)) => *author += &format!(", {}", unquoted(value)),
                _ => {}
            }
        }
        Self {
            authors,
            title: field("title").unwrap_or_default(),
            version: field("version").unwrap_or_default(),
            year: field("date-released").map(|date| date.chars().take(4).collect()),
            doi: field("doi"),
            address: field("repository-code").or_else(|| field("url")),
        }
    }

    /// Table of the fields, those that are not known yet marked as such.
    pub(super) fn table(&self) -> Table {
        let doi = self.doi.clone().unwrap_or_else(|| "none assigned yet".to_owned());
        let known = [("title", &self.title), ("version", &self.version), ("DOI", &doi)];
        let authors = [("authors", self.authors.join("; "))].into_iter();
        let rows = authors.chain(known.into_iter().map(|(name, value)| (name, value.clone())));
        let more = [("year", &self.year), ("address", &self.address)].into_iter();
        let more = more.filter_map(|(name, value)| Some((name, value.clone()?)));
        let rows: Vec<(&str, String)> = rows.chain(more).collect();
        Table::of(&rows)
            .text("field", |(name, _)| *name)
            .column(Column::text("value"), |(_, value)| Cell::text(value.clone()))
            .made()
    }

    /// Entry for BibTeX.
    pub(super) fn bibtex(&self) -> String {
        // NOTE: braces keep the name of a group from being taken apart.
        let authors: Vec<String> = self
            .authors
            .iter()
            .map(|author| match author.contains(',') {
                true => author.clone(),
                false => format!("{{{author}}}"),
            })
            .collect();
        let fields = [
            ("author", Some(authors.join(" and "))),
            ("title", Some(format!("{{{}}}", self.title))),
            ("version", Some(self.version.clone())),
            ("year", self.year.clone()),
            ("doi", self.doi.clone()),
            ("url", self.address.clone()),
        ];
        let fields = fields.into_iter().filter_map(|(name, value)| Some((name, value?)));
        let lines: Vec<String> =
            fields.map(|(name, value)| format!("  {name:<7} = {{{value}}}")).collect();
        format!("@software{{grazemap,\n{}\n}}", lines.join(",\n"))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_citation_has_the_fields_that_are_known() {
        let own = Citation::of_program();
        let entry = own.bibtex();
        for part in ["@software{grazemap,", "The Grazemap developers", env!("CARGO_PKG_VERSION")] {
            assert!(entry.contains(part), "{part} is not in {entry}");
        }
        assert!(!entry.contains("doi"), "{entry}");
        assert!(own.table().to_text().contains("none assigned yet"));
        let text = "title: \"T\"\nversion: 2\ndoi: 10.1/x\ndate-released: 2030-01-02\nauthors:\n  \
            - family-names: B\n    given-names: A.\n  - name: The D\nkeywords:\n  - name: no\n";
        let other = Citation::parse(text);
        assert_eq!(other.authors, ["B, A.", "The D"]);
        let entry = other.bibtex();
        for part in ["{B, A. and {The D}}", "doi     = {10.1/x}", "year    = {2030}"] {
            assert!(entry.contains(part), "{part} is not in {entry}");
        }
    }
}
