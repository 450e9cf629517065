//! The equations of a model as MathML, which browsers draw by themselves.

use super::figure::{escape_html, symbol};
use crate::model::{Binary, ExpressionGraph, Model, Node, NodeId, Response, Unary};
use crate::numeric::Dd;

/// Most operations that an equation may have: a shared operation is printed wherever it is used.
const LONGEST: usize = 400;
/// Largest denominator of a constant that is shown as a fraction.
const LARGEST_DENOMINATOR: u32 = 99;

/// The equations of free flight, of the phase, of every surface and of what happens there, one
/// `math` element each; those that are too long to read are left out, which the last word says.
pub(super) fn equations(model: &Model) -> String {
    let names = [model.full_state_names(), model.parameter_names()].concat();
    let states = model.full_state_names();
    let printer = Printer { graph: &model.graph, names, states: states.len() };
    let rate = |(name, &node): (&&str, &NodeId)| {
        printer.equation(&format!("<mover>{}<mo>˙</mo></mover>", identifier(name)), node)
    };
    let flow = states.iter().zip(&model.flow).map(rate).collect();
    let mut parts = vec![("In free flight".to_owned(), flow)];
    for surface in &model.surfaces {
        let name = escape_html(&surface.name);
        let event = printer.equation("<mi>h</mi>", surface.event);
        parts.push((format!("The surface “{name}”, free where h &gt; 0"), vec![event]));
        match &surface.response {
            Response::Impact { reset } => {
                let jumps =
                    states.iter().zip(reset).enumerate().filter(|(place, (_, node))| {
                        model.graph.node(**node) != Node::Input(*place)
                    });
                let jumps = jumps.map(|(_, (name, &node))| {
                    printer.equation(&format!("<msup>{}<mo>+</mo></msup>", identifier(name)), node)
                });
                parts.push(("At an impact there".to_owned(), jumps.collect()));
            }
            Response::Contact { field, .. } => {
                let pairs = states.iter().zip(field).zip(&model.flow);
                let other =
                    pairs.filter(|((_, own), free)| own != free).map(|(pair, _)| rate(pair));
                parts.push(("In contact there".to_owned(), other.collect()));
            }
        }
    }
    let line = |line: Option<String>| match line {
        Some(markup) => format!("<math display=\"block\">{markup}</math>"),
        None => "<p>an expression too long to print; it stands in scene.toml</p>".to_owned(),
    };
    let part = |(words, lines): (String, Vec<Option<String>>)| {
        let lines: String = lines.into_iter().map(line).collect();
        format!("<p>{words}:</p>{lines}")
    };
    let parts: String = parts.into_iter().map(part).collect();
    format!("<div class=\"equations\">{parts}</div>")
}

struct Printer<'a> {
    graph: &'a ExpressionGraph,
    /// Of the inputs.
    names: Vec<&'a str>,
    /// How many of them are states, the phase among them; the others are parameters.
    states: usize,
}

/// How tightly the outermost operation of an expression binds.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
enum Binding {
    Sum,
    Product,
    Power,
    Whole,
}

impl Printer<'_> {
    /// `left = right`; `None` where the right side is too long.
    fn equation(&self, left: &str, right: NodeId) -> Option<String> {
        let mut room = LONGEST;
        let (markup, _) = self.print(right, &mut room)?;
        Some(format!("<mrow>{left}<mo>=</mo>{markup}</mrow>"))
    }

    fn print(&self, node: NodeId, room: &mut usize) -> Option<(String, Binding)> {
        *room = room.checked_sub(1)?;
        Some(match self.graph.node(node) {
            Node::Constant(value) => constant(value),
            Node::Input(input) => (identifier(self.names.get(input)?), Binding::Whole),
            Node::Neg(a) => {
                let a = self.within(a, Binding::Product, room)?;
                (format!("<mrow><mo>−</mo>{a}</mrow>"), Binding::Sum)
            }
            Node::PowerInteger(a, power) => {
                let base = self.within(a, Binding::Whole, room)?;
                (format!("<msup>{base}<mn>{power}</mn></msup>"), Binding::Power)
            }
            Node::PowerReal(a, power) => {
                let base = self.within(a, Binding::Whole, room)?;
                (format!("<msup>{base}{}</msup>", constant(power).0), Binding::Power)
            }
            Node::Unary(Unary::Sqrt, a) => {
                (format!("<msqrt>{}</msqrt>", self.print(a, room)?.0), Binding::Whole)
            }
            Node::Unary(Unary::Abs, a) => {
                let a = self.print(a, room)?.0;
                (format!("<mrow><mo>|</mo>{a}<mo>|</mo></mrow>"), Binding::Whole)
            }
            Node::Unary(function, a) => {
                let name = format!("{function:?}").to_lowercase();
                (call(&name, &[self.print(a, room)?.0]), Binding::Product)
            }
            Node::Binary(operation, a, b) => self.binary(operation, [a, b], room)?,
        })
    }

    fn binary(
        &self,
        operation: Binary,
        [a, b]: [NodeId; 2],
        room: &mut usize,
    ) -> Option<(String, Binding)> {
        let sum = |a: String, sign: &str, b: String| {
            (format!("<mrow>{a}<mo>{sign}</mo>{b}</mrow>"), Binding::Sum)
        };
        Some(match operation {
            Binary::Add => match self.graph.node(b) {
                Node::Neg(b) => {
                    let a = self.print(a, room)?.0;
                    sum(a, "−", self.within(b, Binding::Product, room)?)
                }
                _ => sum(self.print(a, room)?.0, "+", self.print(b, room)?.0),
            },
            Binary::Sub => {
                let a = self.print(a, room)?.0;
                sum(a, "−", self.within(b, Binding::Product, room)?)
            }
            Binary::Mul => {
                // The graph has no order of factors: numbers first, parameters, then states.
                let (a, b) = if self.rank(b) < self.rank(a) { (b, a) } else { (a, b) };
                let a = self.within(a, Binding::Product, room)?;
                let b = self.within(b, Binding::Product, room)?;
                (format!("<mrow>{a}<mo>&#x2062;</mo>{b}</mrow>"), Binding::Product)
            }
            Binary::Div => {
                let (a, b) = (self.print(a, room)?.0, self.print(b, room)?.0);
                (format!("<mfrac>{a}{b}</mfrac>"), Binding::Whole)
            }
            Binary::Atan2 | Binary::Min | Binary::Max => {
                let name = format!("{operation:?}").to_lowercase();
                let operands = [self.print(a, room)?.0, self.print(b, room)?.0];
                (call(&name, &operands), Binding::Product)
            }
        })
    }

    fn rank(&self, node: NodeId) -> u8 {
        match self.graph.node(node) {
            Node::Constant(_) => 0,
            Node::Input(input) if input >= self.states => 1,
            _ => 2,
        }
    }

    /// An operand, in parentheses where it binds less tightly.
    fn within(&self, node: NodeId, least: Binding, room: &mut usize) -> Option<String> {
        let (markup, binding) = self.print(node, room)?;
        Some(if binding < least {
            format!("<mrow><mo>(</mo>{markup}<mo>)</mo></mrow>")
        } else {
            markup
        })
    }
}

fn call(name: &str, operands: &[String]) -> String {
    let operands = operands.join("<mo>,</mo>");
    format!("<mrow><mi>{name}</mi><mo>&#x2061;</mo><mo>(</mo>{operands}<mo>)</mo></mrow>")
}

/// A name, its index lowered.
fn identifier(name: &str) -> String {
    let symbol = symbol(name);
    match symbol.strip_suffix('}').and_then(|rest| rest.split_once("_{")) {
        Some((base, index)) => {
            let (base, index) = (escape_html(base), escape_html(index));
            format!("<msub><mi>{base}</mi><mi>{index}</mi></msub>")
        }
        None => format!("<mi>{}</mi>", escape_html(&symbol)),
    }
}

/// A number: as a decimal where that is short, else as a fraction where it is one.
fn constant(value: Dd) -> (String, Binding) {
    let number = value.to_f64();
    let sign = if number < 0.0 { "<mo>−</mo>" } else { "" };
    let size = number.abs();
    let decimal = format!("{size}");
    let short = if decimal.len() <= 8 { Some(decimal) } else { None };
    let body = short.map(|decimal| format!("<mn>{decimal}</mn>")).or_else(|| fraction(size));
    let body = body.unwrap_or_else(|| match format!("{size:.6e}").split_once('e') {
        Some((digits, "0")) => format!("<mn>{digits}</mn>"),
        Some((digits, power)) => format!(
            "<mrow><mn>{digits}</mn><mo>·</mo><msup><mn>10</mn><mn>{power}</mn></msup></mrow>"
        ),
        None => format!("<mn>{size}</mn>"),
    });
    let binding = if number < 0.0 { Binding::Sum } else { Binding::Whole };
    (format!("<mrow>{sign}{body}</mrow>"), binding)
}

/// A fraction of small numbers, of π too, that is this number to the last bit.
fn fraction(size: f64) -> Option<String> {
    let units = [(1.0, ""), (std::f64::consts::PI, "<mi>π</mi>")];
    units.into_iter().find_map(|(unit, letter)| {
        (1..=LARGEST_DENOMINATOR).find_map(|below| {
            let above = (size / unit * f64::from(below)).round();
            let is_it = above > 0.0 && above < 1e4 && above * unit / f64::from(below) == size;
            let above = match (above, letter.is_empty()) {
                (1.0, false) => letter.to_owned(),
                _ => format!("<mrow><mn>{above}</mn>{letter}</mrow>"),
            };
            let whole =
                if below == 1 { above } else { format!("<mfrac>{above}<mn>{below}</mn></mfrac>") };
            is_it.then_some(whole)
        })
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::model::Scene;

    #[test]
    fn equations_are_those_of_the_scene() {
        let scene = Scene::load("cantilever_3_5_soft").expect("a scene of the catalogue");
        let text = equations(&scene.model);
        for part in
            ["<mfrac><mrow><mn>36</mn></mrow><mn>35</mn></mfrac>", "<mi>cos</mi>", "ζ", "h &gt; 0"]
        {
            assert!(text.contains(part), "{part} is not in {text}");
        }
        assert_eq!(text.matches("<math").count(), 5);
    }
}
