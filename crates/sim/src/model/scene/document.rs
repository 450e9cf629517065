//! The TOML of a scene as tables and fields with their places in the text; and the numbers, counts
//! and words in them.
//!
//! The scope holds the names of a model and their expressions. Those of `model.let` may come in any
//! order, but must not depend on themselves.

use std::ops::Range;

use toml_edit::{Item, TableLike, Value};

use crate::model::error::{Checked, Fault, SceneProblem};
use crate::model::expression::{ExpressionError, Resolved};
use crate::model::graph::{ExpressionGraph, NodeId};
use crate::model::{expression, names};
use crate::numeric::Dd;

/// A table of the scene.
#[derive(Clone)]
pub(super) struct Table<'a> {
    source: &'a str,
    table: &'a dyn TableLike,
    /// Dotted name; empty for the root.
    path: String,
    /// Bytes to report for a missing key.
    span: Range<usize>,
}

/// A key with its value.
#[derive(Clone)]
pub(super) struct Field<'a> {
    source: &'a str,
    item: &'a Item,
    /// Key without its table.
    pub(super) key: &'a str,
    /// Dotted name.
    pub(super) path: String,
    /// Bytes of the key.
    pub(super) key_span: Range<usize>,
}

/// One value, alone or in a list.
#[derive(Clone)]
pub(super) struct Entry<'a> {
    pub(super) source: &'a str,
    pub(super) value: &'a Value,
    /// Dotted name of its key.
    pub(super) path: String,
    /// Bytes of the value.
    pub(super) span: Range<usize>,
}

impl<'a> Table<'a> {
    /// The root of a document.
    pub(super) fn root(source: &'a str, table: &'a dyn TableLike) -> Self {
        Self { source, table, path: String::new(), span: 0..0 }
    }

    /// Title of the table, in words.
    pub(super) fn title(&self) -> String {
        if self.path.is_empty() { "the scene".to_owned() } else { format!("[{}]", self.path) }
    }

    /// A fault of the table as a whole.
    pub(super) fn fault(&self, problem: SceneProblem) -> Fault {
        Fault::at(self.span.clone(), problem)
    }

    /// Refuses keys that are not among `known`.
    pub(super) fn only(&self, known: &[&str]) -> Checked<()> {
        for field in self.fields() {
            if !known.contains(&field.key) {
                let problem = SceneProblem::UnknownKey {
                    key: shown(field.key),
                    table: self.title(),
                    nearest: names::nearest(field.key, known.iter().copied()),
                };
                return Err(Fault::at(field.key_span, problem));
            }
        }
        Ok(())
    }

    /// All keys with their values, in the order of the text.
    pub(super) fn fields(&self) -> Vec<Field<'a>> {
        let entries = self.table.iter().filter(|(_, item)| !item.is_none());
        entries.filter_map(|(key, _)| self.field(key)).collect()
    }

    /// A key with its value, if present.
    pub(super) fn field(&self, key: &str) -> Option<Field<'a>> {
        let (key, item) = self.table.get_key_value(key)?;
        let key_span = key.span().or_else(|| item.span()).unwrap_or_else(|| self.span.clone());
        let path = if self.path.is_empty() {
            shown(key.get())
        } else {
            format!("{}.{}", self.path, shown(key.get()))
        };
        Some(Field { source: self.source, item, key: key.get(), path, key_span })
    }

    /// A key with its value; an error if it is missing.
    pub(super) fn require(&self, key: &str) -> Checked<Field<'a>> {
        self.field(key).ok_or_else(|| {
            Fault::at(
                self.span.clone(),
                SceneProblem::MissingKey { key: key.to_owned(), table: self.title() },
            )
        })
    }
}

impl<'a> Field<'a> {
    /// Bytes of the value, or of the key if the value has none of its own.
    pub(super) fn span(&self) -> Range<usize> {
        self.item.span().unwrap_or_else(|| self.key_span.clone())
    }

    /// A fault at the value.
    pub(super) fn fault(&self, problem: SceneProblem) -> Fault {
        Fault::at(self.span(), problem)
    }

    /// A fault at the key.
    pub(super) fn key_fault(&self, problem: SceneProblem) -> Fault {
        Fault::at(self.key_span.clone(), problem)
    }

    /// Refuses a list or table that is empty or has more than `most` entries.
    pub(super) fn check_length(&self, found: usize, most: usize) -> Checked<()> {
        let key = self.path.clone();
        match found {
            0 => Err(self.fault(SceneProblem::Empty { key })),
            _ if found > most => Err(self.fault(SceneProblem::TooMany { key, most, found })),
            _ => Ok(()),
        }
    }

    /// The value as a table.
    pub(super) fn table(&self) -> Checked<Table<'a>> {
        let Some(table) = self.item.as_table_like() else {
            return Err(self.wrong_type("a table"));
        };
        Ok(Table { source: self.source, table, path: self.path.clone(), span: self.span() })
    }

    /// The value as a list of tables: `[[name]]` or `name = [{ ... }]`.
    pub(super) fn tables(&self) -> Checked<Vec<Table<'a>>> {
        let table = |index: usize, table: &'a dyn TableLike, span: Option<Range<usize>>| Table {
            source: self.source,
            table,
            path: format!("{}.{index}", self.path),
            span: span.unwrap_or_else(|| self.span()),
        };
        if let Some(list) = self.item.as_array_of_tables() {
            return Ok(list
                .iter()
                .enumerate()
                .map(|(index, entry)| table(index, entry, entry.span()))
                .collect());
        }
        let expected = "a list of tables";
        let list = self.item.as_array().ok_or_else(|| self.wrong_type(expected))?;
        let entries = list.iter().enumerate().map(|(index, entry)| match entry.as_inline_table() {
            Some(inline) => Ok(table(index, inline, inline.span())),
            None => Err(self.entry_of(entry).wrong_type(expected)),
        });
        entries.collect()
    }

    /// The value as a single value.
    pub(super) fn entry(&self, expected: &'static str) -> Checked<Entry<'a>> {
        match self.item.as_value() {
            Some(value) if !value.is_inline_table() => Ok(self.entry_of(value)),
            _ => Err(self.wrong_type(expected)),
        }
    }

    /// The values of a list.
    pub(super) fn list(&self, expected: &'static str) -> Checked<Vec<Entry<'a>>> {
        self.entry(expected)?.list(expected)
    }

    /// The values of a list, or the one value.
    pub(super) fn one_or_list(&self, expected: &'static str) -> Checked<Vec<Entry<'a>>> {
        if self.item.is_array() { self.list(expected) } else { Ok(vec![self.entry(expected)?]) }
    }

    /// Error for a value of another kind.
    fn wrong_type(&self, expected: &'static str) -> Fault {
        let found = match self.item {
            Item::None => "nothing",
            Item::Value(value) => kind(value),
            Item::Table(_) => "a table",
            Item::ArrayOfTables(_) => "a list of tables",
        };
        Fault::at(self.span(), SceneProblem::WrongType { key: self.path.clone(), expected, found })
    }

    fn entry_of(&self, value: &'a Value) -> Entry<'a> {
        let span = value.span().unwrap_or_else(|| self.span());
        Entry { source: self.source, value, path: self.path.clone(), span }
    }
}

impl<'a> Entry<'a> {
    /// The value as text.
    pub(super) fn text(&self, expected: &'static str) -> Checked<&'a str> {
        self.value.as_str().ok_or_else(|| self.wrong_type(expected))
    }

    /// The value as a table, if it is one.
    pub(super) fn table(&self) -> Option<Table<'a>> {
        let table = self.value.as_inline_table()?;
        let (path, span) = (self.path.clone(), self.span.clone());
        Some(Table { source: self.source, table, path, span })
    }

    /// The values of a list.
    pub(super) fn list(&self, expected: &'static str) -> Checked<Vec<Entry<'a>>> {
        let list = self.value.as_array().ok_or_else(|| self.wrong_type(expected))?;
        let entry = |value: &'a Value| Entry {
            source: self.source,
            value,
            path: self.path.clone(),
            span: value.span().unwrap_or_else(|| self.span.clone()),
        };
        Ok(list.iter().map(entry).collect())
    }

    /// The value as written in the file.
    pub(super) fn literal(&self) -> &'a str {
        self.source.get(self.span.clone()).unwrap_or_default()
    }

    /// Error for a value of another kind.
    fn wrong_type(&self, expected: &'static str) -> Fault {
        self.fault(SceneProblem::WrongType {
            key: self.path.clone(),
            expected,
            found: kind(self.value),
        })
    }

    /// A fault at the value.
    pub(super) fn fault(&self, problem: SceneProblem) -> Fault {
        Fault::at(self.span.clone(), problem)
    }

    /// Bytes of the file for the bytes `inner` of the text; all bytes of the value if escapes moved
    /// them.
    pub(super) fn inside(&self, inner: Range<usize>) -> Range<usize> {
        let Some(text) = self.value.as_str() else {
            return self.span.clone();
        };
        let Some(offset) = self.literal().find(text) else {
            return self.span.clone();
        };
        let start = self.span.start + offset;
        start + inner.start..start + inner.end
    }
}

/// Kind of a value, in words.
fn kind(value: &Value) -> &'static str {
    match value {
        Value::String(_) => "text",
        Value::Integer(_) => "a whole number",
        Value::Float(_) => "a number",
        Value::Boolean(_) => "a truth value",
        Value::Datetime(_) => "a date",
        Value::Array(_) => "a list",
        Value::InlineTable(_) => "a table",
    }
}

/// Text of a user for a message: escaped and shortened.
pub(super) fn shown(text: &str) -> String {
    let mut short: String = text.chars().take(names::LONGEST_NAME).collect();
    if short.len() < text.len() {
        short.push('…');
    }
    short.escape_debug().to_string()
}

/// Expected value, for messages.
const NUMBER: &str = "a number";

impl Entry<'_> {
    /// A finite number, to the digits of its text: a literal, or a text with a constant expression.
    pub(super) fn number(&self) -> Checked<Dd> {
        if let Some(text) = self.value.as_str() {
            return self.constant(text);
        }
        if let Some(integer) = self.value.as_integer()
            && !self
                .literal()
                .bytes()
                .all(|byte| byte.is_ascii_digit() || matches!(byte, b'+' | b'-' | b'_'))
        {
            return self.constant(&integer.to_string());
        }
        if !self.value.is_integer() && !self.value.is_float() {
            return Err(self.wrong_type(NUMBER));
        }
        let digits = self.literal().replace('_', "");
        expression::decimal(digits.trim_start_matches('+')).ok_or_else(|| {
            self.fault(SceneProblem::NotFinite {
                key: self.path.clone(),
                found: shown(self.literal()),
            })
        })
    }

    /// A finite number, rounded to double precision.
    pub(super) fn double(&self) -> Checked<f64> {
        Ok(self.number()?.hi)
    }

    /// Value of a constant expression.
    fn constant(&self, text: &str) -> Checked<Dd> {
        let mut graph = ExpressionGraph::new();
        let node = expression::parse(text, &mut graph, &|_| Resolved::Unknown(None));
        let node = node.map_err(|fault| {
            let problem = match fault.value {
                ExpressionError::UnknownVariable { name, .. } => {
                    SceneProblem::NotConstant { name: shown(&name), key: self.path.clone() }
                }
                other => SceneProblem::Expression(other),
            };
            Fault::at(self.inside(fault.span), problem)
        })?;
        graph.constant_value(node).ok_or_else(|| {
            self.fault(SceneProblem::NotFinite { key: self.path.clone(), found: shown(text) })
        })
    }
}

impl Field<'_> {
    /// A finite number.
    pub(super) fn number(&self) -> Checked<Dd> {
        self.entry(NUMBER)?.number()
    }

    /// A finite number, rounded to double precision.
    pub(super) fn double(&self) -> Checked<f64> {
        Ok(self.number()?.hi)
    }

    /// A positive number.
    pub(super) fn positive(&self) -> Checked<Dd> {
        let value = self.number()?;
        if value.hi > 0.0 {
            Ok(value)
        } else {
            let problem = SceneProblem::NotPositive { key: self.path.clone(), value: value.hi };
            Err(self.fault(problem))
        }
    }

    /// A whole number from `least` to `most`.
    pub(super) fn count(&self, least: u64, most: u64) -> Checked<u64> {
        self.entry("a whole number")?.count(least, most)
    }

    /// Two offsets, the smaller one first.
    pub(super) fn range(&self) -> Checked<[f64; 2]> {
        self.entry("a list of two offsets")?.range()
    }

    /// Text.
    pub(super) fn text(&self) -> Checked<String> {
        Ok(self.entry("text")?.text("text")?.to_owned())
    }

    /// The choice for a word; messages list `choices`.
    pub(super) fn choice<T: Clone>(
        &self,
        options: &[(&str, T)],
        choices: &'static str,
    ) -> Checked<T> {
        self.entry("a word")?.choice(options, choices)
    }
}

impl<'a> Entry<'a> {
    /// The two values of a list.
    pub(super) fn pair(&self, expected: &'static str) -> Checked<[Entry<'a>; 2]> {
        let list = self.list(expected)?;
        let found = list.len();
        <[Entry<'a>; 2]>::try_from(list).map_err(|_| {
            self.fault(SceneProblem::Length { key: self.path.clone(), expected: 2, found })
        })
    }

    /// Two offsets, the smaller one first.
    pub(super) fn range(&self) -> Checked<[f64; 2]> {
        let [first, last] = self.pair("a list of two offsets")?;
        let (first, last) = (first.double()?, last.double()?);
        if first < last {
            Ok([first, last])
        } else {
            Err(self.fault(SceneProblem::Range { key: self.path.clone(), first, last }))
        }
    }

    /// A whole number from `least` to `most`.
    pub(super) fn count(&self, least: u64, most: u64) -> Checked<u64> {
        if !self.value.is_integer() && !self.value.is_float() {
            return Err(self.wrong_type("a whole number"));
        }
        let found = self.value.as_integer().and_then(|value| u64::try_from(value).ok());
        found.filter(|value| (least..=most).contains(value)).ok_or_else(|| {
            let problem = SceneProblem::Count {
                key: self.path.clone(),
                found: shown(self.literal()),
                least,
                most,
            };
            self.fault(problem)
        })
    }

    /// The choice for a word; messages list `choices`.
    pub(super) fn choice<T: Clone>(
        &self,
        options: &[(&str, T)],
        choices: &'static str,
    ) -> Checked<T> {
        let word = self.text("a word")?;
        let found =
            options.iter().find(|(name, _)| *name == word).map(|(_, choice)| choice.clone());
        found.ok_or_else(|| {
            self.fault(SceneProblem::UnknownWord {
                key: self.path.clone(),
                found: shown(word),
                choices,
                nearest: names::nearest(word, options.iter().map(|(name, _)| *name)),
            })
        })
    }
}

/// Kind of a name.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum NameKind {
    /// A state.
    State,
    /// The forcing phase.
    Phase,
    /// A parameter.
    Parameter,
    /// A named expression.
    Let,
}

impl NameKind {
    /// Kind of a name, in words.
    pub(super) fn word(self) -> &'static str {
        match self {
            NameKind::State => "state",
            NameKind::Phase => "phase",
            NameKind::Parameter => "parameter",
            NameKind::Let => "named expression",
        }
    }
}

/// Names of a model, in the order of declaration.
#[derive(Default)]
pub(super) struct Scope {
    entries: Vec<(String, NameKind)>,
    nodes: Vec<Option<NodeId>>,
}

impl Scope {
    /// Declares a name. The name must be valid, unused, and not a word of the language.
    pub(super) fn declare(
        &mut self,
        name: &str,
        kind: NameKind,
        span: Range<usize>,
    ) -> Checked<()> {
        if !names::is_name(name) {
            return Err(Fault::at(span, SceneProblem::NotAName { name: shown(name) }));
        }
        if names::is_reserved(name) {
            let problem = SceneProblem::Reserved { name: name.to_owned(), kind: kind.word() };
            return Err(Fault::at(span, problem));
        }
        if names::is_rust_word(name) {
            let problem = SceneProblem::RustWord { name: name.to_owned(), kind: kind.word() };
            return Err(Fault::at(span, problem));
        }
        if let Some((_, first)) = self.entries.iter().find(|(known, _)| known == name) {
            if *first == kind {
                let problem = SceneProblem::SameName { name: name.to_owned(), kind: kind.word() };
                return Err(Fault::at(span, problem));
            }
            let (first, second) = (first.word(), kind.word());
            let problem = SceneProblem::DuplicateName { name: name.to_owned(), first, second };
            return Err(Fault::at(span, problem));
        }
        self.entries.push((name.to_owned(), kind));
        self.nodes.push(None);
        Ok(())
    }

    /// Sets the node of a declared name.
    pub(super) fn define(&mut self, name: &str, node: NodeId) {
        if let Some(index) = self.entries.iter().position(|(known, _)| known == name) {
            self.nodes[index] = Some(node);
        }
    }

    /// Node of a name, or the nearest known name.
    fn resolve(&self, name: &str) -> Resolved {
        let index = self.entries.iter().position(|(known, _)| known == name);
        match index.and_then(|index| self.nodes[index]) {
            Some(node) => Resolved::Node(node),
            None => {
                let known = self.entries.iter().map(|(known, _)| known.as_str());
                Resolved::Unknown(names::nearest(name, known.filter(|known| *known != name)))
            }
        }
    }

    /// Reads the expression of an entry: a text, or a number.
    pub(super) fn expression(
        &self,
        entry: &Entry<'_>,
        graph: &mut ExpressionGraph,
    ) -> Checked<NodeId> {
        self.expression_with(entry, graph, &[])
    }

    /// Reads an expression in which each of some names stands for a node, unless the scene declares
    /// the name itself.
    pub(super) fn expression_with(
        &self,
        entry: &Entry<'_>,
        graph: &mut ExpressionGraph,
        local: &[(&str, NodeId)],
    ) -> Checked<NodeId> {
        let Some(text) = entry.value.as_str() else {
            if !entry.value.is_integer() && !entry.value.is_float() {
                return Err(entry.wrong_type("an expression"));
            }
            let value = entry.number()?;
            return Ok(graph.constant(value));
        };
        let resolve = |name: &str| match (self.resolve(name), local) {
            (Resolved::Unknown(nearest), local) => {
                let found = local.iter().find(|(known, _)| *known == name);
                found.map_or(Resolved::Unknown(nearest), |&(_, node)| Resolved::Node(node))
            }
            (known, _) => known,
        };
        expression::parse(text, graph, &resolve).map_err(|fault| {
            Fault::at(entry.inside(fault.span), SceneProblem::Expression(fault.value))
        })
    }

    /// Names of the full state and the parameters, by input number.
    pub(super) fn inputs(&self) -> impl Iterator<Item = &str> {
        self.entries
            .iter()
            .filter(|(_, kind)| *kind != NameKind::Let)
            .map(|(name, _)| name.as_str())
    }
}

/// State of a named expression in the depth-first search for cycles.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Mark {
    Untouched,
    Open,
    Done,
}

/// Reads the named expressions and defines their names.
pub(super) fn define(
    fields: &[Field<'_>],
    scope: &mut Scope,
    graph: &mut ExpressionGraph,
) -> Checked<()> {
    for index in in_order_of_need(fields)? {
        let field = &fields[index];
        let node = scope.expression(&field.entry("an expression")?, graph)?;
        scope.define(field.key, node);
    }
    Ok(())
}

/// Order of the named expressions in which each comes after those that it needs.
fn in_order_of_need(fields: &[Field<'_>]) -> Checked<Vec<usize>> {
    let needs: Vec<Vec<usize>> = fields.iter().map(|field| needs(field, fields)).collect();
    let mut marks = vec![Mark::Untouched; fields.len()];
    let mut order = Vec::new();
    for start in 0..fields.len() {
        let mut path: Vec<(usize, usize)> = vec![(start, 0)];
        while let Some(&(index, next)) = path.last() {
            if next == 0 && marks[index] == Mark::Done {
                path.pop();
                continue;
            }
            marks[index] = Mark::Open;
            let Some(&needed) = needs[index].get(next) else {
                marks[index] = Mark::Done;
                order.push(index);
                path.pop();
                continue;
            };
            if let Some(last) = path.last_mut() {
                last.1 += 1;
            }
            match marks[needed] {
                Mark::Open => return Err(circle(fields, &path, needed)),
                Mark::Untouched => path.push((needed, 0)),
                Mark::Done => {}
            }
        }
    }
    Ok(order)
}

/// Named expressions that the text of a field uses.
fn needs(field: &Field<'_>, fields: &[Field<'_>]) -> Vec<usize> {
    let text = field.entry("an expression").ok().and_then(|entry| entry.value.as_str());
    let names = expression::names_in(text.unwrap_or_default());
    names.iter().filter_map(|name| fields.iter().position(|other| other.key == *name)).collect()
}

/// Error for the cycle that closes at `needed`.
fn circle(fields: &[Field<'_>], path: &[(usize, usize)], needed: usize) -> Fault {
    let circle = path.iter().map(|&(index, _)| index).skip_while(|&index| index != needed);
    let mut names: Vec<String> = circle.map(|index| fields[index].key.to_owned()).collect();
    names.push(fields[needed].key.to_owned());
    Fault::at(fields[needed].span(), SceneProblem::Circular { names })
}
