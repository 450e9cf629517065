//! Periodic orbits as tables: in words for people, a column for each number for programs.

use super::{Cell, Column, OrbitRecord, OrbitsListing, ReportError, Table};
use crate::analysis::periodic::BifurcationKind;

/// What a table lists.
#[derive(Clone, Copy)]
enum List {
    /// The physical orbits; all where there is none.
    Physical,
    /// All orbits.
    Orbits,
    /// The points of all loci.
    Loci,
}

/// An orbit of the list, or one of a locus.
type Row<'a> = (Option<BifurcationKind>, &'a OrbitRecord);

impl OrbitsListing {
    /// The orbits as a person reads them: one row each, physical ones alone where there are any.
    ///
    /// # Errors
    ///
    /// Never in practice: every row has a cell per column.
    pub fn table(&self) -> Result<Table, ReportError> {
        self.words(List::Physical)
    }

    /// The points of all loci as a person reads them: one row each.
    ///
    /// # Errors
    ///
    /// Never in practice: every row has a cell per column.
    pub fn loci_table(&self) -> Result<Table, ReportError> {
        self.words(List::Loci)
    }

    /// The orbits with all digits, a column for each number.
    ///
    /// # Errors
    ///
    /// Never in practice: every row has a cell per column.
    pub fn data_table(&self) -> Result<Table, ReportError> {
        self.numbers(List::Orbits)
    }

    /// The points of all loci with all digits.
    ///
    /// # Errors
    ///
    /// Never in practice: every row has a cell per column.
    pub fn loci_data_table(&self) -> Result<Table, ReportError> {
        self.numbers(List::Loci)
    }

    /// Whether an orbit is physical.
    pub fn any_physical(&self) -> bool {
        self.orbits.iter().any(|orbit| orbit.physical)
    }

    fn rows(&self, list: List) -> Vec<Row<'_>> {
        let loci = self.loci.iter().flatten();
        let points =
            loci.flat_map(|locus| locus.points.iter().map(|point| (Some(locus.kind), point)));
        match list {
            List::Physical => {
                let shown = self.orbits.iter();
                let shown = shown.filter(|orbit| orbit.physical || !self.any_physical());
                shown.map(|orbit| (None, orbit)).collect()
            }
            List::Orbits => self.orbits.iter().map(|orbit| (None, orbit)).collect(),
            List::Loci => points.collect(),
        }
    }

    fn parameter_names(&self) -> impl Iterator<Item = String> {
        self.grazing_parameters
            .0
            .iter()
            .map(|(name, _)| name.clone())
    }

    fn words(&self, list: List) -> Result<Table, ReportError> {
        let located = self
            .parameter_names()
            .chain(self.section.coordinates.clone());
        let mut columns = heading(list);
        columns.extend(located.map(Column::number));
        columns.extend(["multipliers", "orbit", "impact speeds", "window"].map(Column::text));
        let mut table = Table::new(columns);
        for (kind, orbit) in self.rows(list) {
            let located = orbit.parameters.0.iter().chain(&orbit.state.0);
            let speeds = orbit.contacts.iter();
            let speeds: Vec<String> = speeds
                .map(|contact| format!("{:.4e}", contact.speed))
                .collect();
            let mut row = named(kind, orbit);
            row.extend(located.map(|(_, value)| Cell::number(*value, 5)));
            row.extend([
                Cell::text(multipliers(&orbit.multipliers)),
                Cell::text(orbit.kind_words(kind)),
                Cell::text(speeds.join(", ")),
                Cell::text(if orbit.inside { "inside" } else { "outside" }),
            ]);
            table.push(row)?;
        }
        Ok(table)
    }

    fn numbers(&self, list: List) -> Result<Table, ReportError> {
        let located = self
            .parameter_names()
            .chain(self.section.coordinates.clone());
        let parts = (1..=self.section.coordinates.len())
            .flat_map(|n| [format!("multiplier_{n}_re"), format!("multiplier_{n}_im")]);
        let mut columns = heading(list);
        columns.extend(located.chain(parts).map(Column::number));
        columns.extend(["stable", "physical", "inside", "extra_contacts"].map(Column::number));
        columns.push(Column::text("speeds"));
        let mut table = Table::new(columns);
        for (kind, orbit) in self.rows(list) {
            let located = orbit.parameters.0.iter().chain(&orbit.state.0);
            let located = located.map(|(_, value)| value);
            let numbers = located.chain(orbit.multipliers.iter().flatten());
            let speeds = orbit.contacts.iter();
            let speeds: Vec<String> = speeds
                .map(|contact| format!("{:.16e}", contact.speed))
                .collect();
            let flags = [orbit.stable, orbit.physical, orbit.inside];
            let mut row = named(kind, orbit);
            row.extend(numbers.map(|&value| Cell::number(value, 12)));
            row.extend(flags.map(|flag| Cell::Integer(flag.into())));
            let extra = orbit.extra_contacts;
            row.push(extra.map_or(Cell::Missing, |extra| Cell::Integer(extra as i64)));
            row.push(Cell::text(speeds.join(" ")));
            table.push(row)?;
        }
        Ok(table)
    }
}

impl OrbitRecord {
    /// Stability, and whether it is one of map or simulation at all.
    fn kind_words(&self, kind: Option<BifurcationKind>) -> String {
        let stable = if self.stable { "stable" } else { "unstable" };
        match (self.physical, self.extra_contacts, kind) {
            (true, _, None) => stable.to_owned(),
            (true, _, Some(_)) => "physical".to_owned(),
            (false, Some(extra), _) => format!("{stable}, {extra} more contacts"),
            (false, None, _) => "virtual".to_owned(),
        }
    }
}

fn heading(list: List) -> Vec<Column> {
    let kind = match list {
        List::Physical | List::Orbits => None,
        List::Loci => Some("kind"),
    };
    let names = kind.into_iter().chain(["itinerary", "name"]);
    names.map(Column::text).collect()
}

fn named(kind: Option<BifurcationKind>, orbit: &OrbitRecord) -> Vec<Cell> {
    let kind = kind.map(|kind| Cell::text(kind.word()));
    let names = [&orbit.itinerary, &orbit.name];
    kind.into_iter().chain(names.map(Cell::text)).collect()
}

/// `-2.31, 0.02`, `0.3 ± 0.2i`.
fn multipliers(values: &[[f64; 2]]) -> String {
    let shown = |value: f64| Cell::number(value, 4).for_people();
    let pair = |[re, im]: &[f64; 2]| match *im {
        0.0 => Some(shown(*re)),
        im if im > 0.0 => Some(format!("{} ± {}i", shown(*re), shown(im))),
        _ => None,
    };
    values
        .iter()
        .filter_map(pair)
        .collect::<Vec<_>>()
        .join(", ")
}
