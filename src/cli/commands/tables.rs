//! Tables of a scene from options: the diagram or the chart that a call names.

use super::super::arguments::{ChartArguments, DiagramArguments, Iterates};
use super::super::output::CliError;
use grazemap::Map;
use grazemap::model::Method;
use grazemap::pipeline::{Ends, Origin, Position};
use grazemap::report::Named;

/// A table of a scene as text.
struct Table(String);

impl Table {
    fn new(kind: &str) -> Self {
        Self(format!("[[{kind}]]\n"))
    }

    fn line(&mut self, key: &str, value: Option<String>) {
        if let Some(value) = value {
            self.0.push_str(&format!("{key} = {value}\n"));
        }
    }

    /// Lines of what a diagram and a chart share.
    fn iterates(&mut self, iterates: &Iterates, origin: &Origin<'_>) {
        let method = |method: &Method| match method {
            Method::Map => "\"map\"".to_owned(),
            Method::Guarded => "\"guarded\"".to_owned(),
            Method::Direct => "\"direct\"".to_owned(),
            Method::Atlas => "\"atlas\"".to_owned(),
        };
        let start = |start: &Named<Position>| {
            let pairs = origin.offsets(start).0;
            let pairs = pairs.iter().map(|(name, offset)| format!("{name} = {offset:?}"));
            format!("{{ {} }}", pairs.collect::<Vec<_>>().join(", "))
        };
        self.line("with", list(iterates.method.iter().map(method)));
        self.line("transient", iterates.transient.map(|count| count.to_string()));
        self.line("keep", iterates.keep.map(|count| count.to_string()));
        self.line("observe", iterates.observe.as_deref().map(quoted));
        self.line("start", list(iterates.start.iter().map(start)));
        self.line("starts", iterates.starts.map(|count| count.to_string()));
    }
}

/// A list of TOML; none for no entries.
fn list(entries: impl Iterator<Item = String>) -> Option<String> {
    let entries: Vec<String> = entries.collect();
    (!entries.is_empty()).then(|| format!("[{}]", entries.join(", ")))
}

/// A string of TOML.
fn quoted(text: &str) -> String {
    let escaped = text.chars().map(|c| match c {
        '"' | '\\' => format!("\\{c}"),
        c if c.is_control() => format!("\\u{:04X}", u32::from(c)),
        c => c.to_string(),
    });
    format!("\"{}\"", escaped.collect::<String>())
}

/// Ends of a range of a parameter: those given, or those of the window.
fn range(map: &Map, name: &str, ends: [Option<f64>; 2]) -> Result<[f64; 2], CliError> {
    let local = map.local();
    let place = local.parameters.iter().position(|parameter| parameter.name == name);
    let width = place.map_or(f64::INFINITY, |place| local.window.parameter[place]);
    match [ends[0].unwrap_or(-width), ends[1].unwrap_or(width)] {
        [from, to] if from.is_finite() && to.is_finite() => Ok([from, to]),
        // A name that is none is refused with the names that are.
        _ if place.is_none() => Ok([0.0, 1.0]),
        _ => Err(CliError::NoRange { name: name.to_owned() }),
    }
}

/// Refuses options for what the scene's own tables state, unless `names`, an option, names another.
pub(super) fn check_iterates(
    iterates: &Iterates,
    is_named: bool,
    [table, names]: [&'static str; 2],
) -> Result<(), CliError> {
    match iterates.given() {
        Some(option) if !is_named => Err(CliError::OfAnotherTable { option, table, names }),
        _ => Ok(()),
    }
}

/// Table of a scene from options, and remarks on offsets in it that look like values.
pub(super) struct AskedTable {
    pub(super) table: String,
    pub(super) remarks: Vec<String>,
}

/// The table of the diagram that options name; none where they name no parameter.
pub(super) fn diagram(
    options: &DiagramArguments,
    map: &Map,
) -> Result<Option<AskedTable>, CliError> {
    let Some(along) = options.along.as_deref() else { return Ok(None) };
    let origin = Origin::new(map.settled().graze(), options.counting);
    let given = [options.from, options.to];
    let remarks = origin.range_remark("from, to", along, given).into_iter().collect();
    let ends = range(map, along, origin.range(along, given))?;
    let mut table = Table::new("diagram");
    table.line("parameter", Some(quoted(along)));
    table.line("range", Some(format!("{ends:?}")));
    table.line("points", options.points.map(|count| count.to_string()));
    table.line("scale", options.scale.as_deref().map(quoted));
    table.line("direction", options.direction.as_deref().map(quoted));
    table.iterates(&options.iterates, &origin);
    Ok(Some(AskedTable { table: table.0, remarks }))
}

/// The table of the chart that options name; none where they name no parameters.
pub(super) fn chart(options: &ChartArguments, map: &Map) -> Result<Option<AskedTable>, CliError> {
    if options.plane.is_empty() {
        return Ok(None);
    }
    let origin = Origin::new(map.settled().graze(), options.counting);
    let named = origin.ranges(options.range.as_ref());
    let given = options.range.iter().flat_map(|Named(ranges)| ranges);
    let remarks = given
        .filter_map(|(name, Ends(ends))| origin.range_remark("range", name, ends.map(Some)))
        .collect();
    let other = named.0.iter().find(|(name, _)| !options.plane.contains(name));
    if let Some((name, _)) = other {
        return Err(CliError::RangeOfNoAxis { name: name.clone() });
    }
    let ends = options.plane.iter().map(|name| {
        let given = named.get(name).map_or([None; 2], |ends| ends.map(Some));
        Ok(format!("{:?}", range(map, name, given)?))
    });
    let ends = ends.collect::<Result<Vec<_>, CliError>>()?;
    let points = match options.points[..] {
        [both] => Some(both.to_string()),
        _ => list(options.points.iter().map(ToString::to_string)),
    };
    let mut table = Table::new("chart");
    table.line("parameters", list(options.plane.iter().map(|name| quoted(name))));
    table.line("ranges", list(ends.into_iter()));
    table.line("points", points);
    table.line("cells", options.cells.as_deref().map(quoted));
    table.line("overlay", list(options.overlay.iter().map(|curve| quoted(curve))));
    table.iterates(&options.iterates, &origin);
    Ok(Some(AskedTable { table: table.0, remarks }))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn quotes_and_control_characters_are_escaped() {
        assert_eq!(quoted("a\"b\\c\n"), "\"a\\\"b\\\\c\\u000A\"");
    }
}
