//! Equations of a model as MathML, which browsers render themselves.

use super::figure::{escape_html, symbol};
use crate::model::{Binary, ExpressionGraph, Model, Node, NodeId, Response, Unary};
use crate::numeric::Dd;

/// Limit of operations in an equation; a shared operation is printed at every use.
const LONGEST: usize = 400;
/// Largest denominator of a constant that is printed as a fraction.
const LARGEST_DENOMINATOR: u32 = 99;

/// Equations of the free flight, the phase, and every surface with its contact law, one `math`
/// element each. Equations that are too long to read are omitted, and a final sentence says so.
pub(super) fn equations(model: &Model) -> String {
    let names = [model.full_state_names(), model.parameter_names()].concat();
    let states = model.full_state_names();
    let printer = Printer { graph: &model.graph, names, states: states.len() };
    let rate = |(name, &node): (&&str, &NodeId)| {
        // NOTE: with `accent` browsers put the dot into the letter.
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
    /// Names of the inputs.
    names: Vec<&'a str>,
    /// Number of states among the inputs, phase included; parameters follow.
    states: usize,
}

/// Precedence of the outermost operation of an expression.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
enum Binding {
    Sum,
    Product,
    Power,
    Whole,
}

impl Printer<'_> {
    /// `left = right`; `None` if the right side is too long.
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
                let mut factors = self.factors([a, b]);
                // NOTE: products in the graph are unordered. Order: numbers, parameters, the rest.
                factors.sort_by_key(|&factor| self.rank(factor));
                let print = factors.into_iter().map(|one| self.within(one, Binding::Product, room));
                let factors: Vec<String> = print.collect::<Option<_>>()?;
                (format!("<mrow>{}</mrow>", factors.join("<mo>⋅</mo>")), Binding::Product)
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

    /// Factors of a nested product, in order; slightly more than can be printed if there are many.
    fn factors(&self, product: [NodeId; 2]) -> Vec<NodeId> {
        let (mut all, mut rest) = (Vec::new(), vec![product[1], product[0]]);
        while let Some(node) = rest.pop() {
            match self.graph.node(node) {
                Node::Binary(Binary::Mul, a, b) if all.len() + rest.len() < LONGEST => {
                    rest.extend([b, a]);
                }
                _ => all.push(node),
            }
        }
        all
    }

    fn rank(&self, node: NodeId) -> u8 {
        match self.graph.node(node) {
            Node::Constant(_) => 0,
            Node::Input(input) if input >= self.states => 1,
            _ => 2,
        }
    }

    /// Operand, in parentheses if it binds less tightly.
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

/// Name with its index as a subscript: the part after an underscore, or digits at its end.
fn identifier(name: &str) -> String {
    let base = name.trim_end_matches(|last: char| last.is_ascii_digit());
    let (base, index) = match name.split_once('_') {
        Some((base, index)) if !base.is_empty() && !index.is_empty() => (base, index),
        _ if base.is_empty() => (name, ""),
        _ => (base, &name[base.len()..]),
    };
    let letter = |name: &str| format!("<mi>{}</mi>", escape_html(&symbol(name)));
    match index {
        "" => letter(base),
        index => format!("<msub>{}{}</msub>", letter(base), letter(index)),
    }
}

/// Number: a decimal if that is short, else an exact fraction if there is one.
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

/// Fraction of small integers, or such a fraction of π, that equals this number to the last bit.
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
        let scene = Scene::of_catalogue("cantilever_3_5_soft").expect("a scene of the catalogue");
        let text = equations(&scene.model);
        for part in
            ["<mfrac><mrow><mn>36</mn></mrow><mn>35</mn></mfrac>", "<mi>cos</mi>", "ζ", "h &gt; 0"]
        {
            assert!(text.contains(part), "{part} is not in {text}");
        }
        assert_eq!(text.matches("<math").count(), 5);
    }

    #[test]
    fn factors_stand_in_order_and_names_have_indices() {
        let scene = Scene::of_catalogue("two_stops_t1").expect("a scene of the catalogue");
        let text = equations(&scene.model);
        let product =
            "<mn>2</mn></mrow><mo>⋅</mo><mi>ζ</mi><mo>⋅</mo><msub><mi>v</mi><mi>2</mi></msub>";
        assert!(text.contains(product), "{text}");
    }
}
