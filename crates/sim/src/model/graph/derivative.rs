//! Symbolic derivatives: one pass over the operations under a node, cached by node and input.

use super::{Binary, ExpressionGraph, Node, NodeId, Unary};
use crate::numeric::{Dd, Scalar};

impl ExpressionGraph {
    /// Derivative `∂node/∂input`.
    ///
    /// The corners of `abs`, `sign`, `min` and `max` are ignored: `abs' = sign`, `sign' = 0`, and
    /// `min` and `max` have the derivative of the selected argument (the mean of both if the
    /// arguments are equal).
    pub fn derivative(&mut self, node: NodeId, input: usize) -> NodeId {
        if let Some(&known) = self.derivatives.get(&(node, input)) {
            return known;
        }
        let needed = self.needed_by(&[node]);
        let zero = self.number(0.0);
        let mut slopes = vec![zero; needed.len()];
        for index in (0..needed.len()).filter(|&index| needed[index]) {
            let id = NodeId(u32::try_from(index).expect("an index of the graph fits"));
            let known = self.derivatives.get(&(id, input)).copied();
            let slope = known.unwrap_or_else(|| self.chain_rule(id, input, &slopes));
            self.derivatives.insert((id, input), slope);
            slopes[index] = slope;
        }
        slopes[node.index()]
    }

    /// Lie derivative `L_f node = Σ_i ∂node/∂x_i f_i` over the full state; `field` has one node per
    /// component.
    pub fn lie_derivative(&mut self, node: NodeId, field: &[NodeId]) -> NodeId {
        let mut sum = self.number(0.0);
        for (component, &velocity) in field.iter().enumerate() {
            let slope = self.derivative(node, component);
            let term = self.mul(slope, velocity);
            sum = self.add(sum, term);
        }
        sum
    }

    /// Derivative of one operation, from the derivatives `slopes` of its operands.
    fn chain_rule(&mut self, id: NodeId, input: usize, slopes: &[NodeId]) -> NodeId {
        match self.node(id) {
            Node::Constant(_) => self.number(0.0),
            Node::Input(number) => self.number(if number == input { 1.0 } else { 0.0 }),
            Node::Neg(a) => self.neg(slopes[a.index()]),
            Node::PowerInteger(a, exponent) => {
                let factor = self.number(f64::from(exponent));
                let lower = self.power_integer(a, exponent.saturating_sub(1));
                self.product_of_three(factor, lower, slopes[a.index()])
            }
            Node::PowerReal(a, exponent) => {
                let factor = self.constant(exponent);
                let lower = self.power_real(a, exponent - Dd::from_f64(1.0));
                self.product_of_three(factor, lower, slopes[a.index()])
            }
            Node::Unary(function, a) => self.unary_derivative(function, id, a, slopes[a.index()]),
            Node::Binary(function, a, b) => {
                self.binary_derivative(function, id, [a, b], [slopes[a.index()], slopes[b.index()]])
            }
        }
    }

    fn product_of_three(&mut self, a: NodeId, b: NodeId, c: NodeId) -> NodeId {
        let product = self.mul(a, b);
        self.mul(product, c)
    }

    /// Derivative of `function(a)`, whose node is `id`.
    fn unary_derivative(
        &mut self,
        function: Unary,
        id: NodeId,
        a: NodeId,
        slope: NodeId,
    ) -> NodeId {
        let one = self.number(1.0);
        match function {
            Unary::Sqrt => {
                let two = self.number(2.0);
                let divisor = self.mul(two, id);
                self.div(slope, divisor)
            }
            Unary::Exp => self.mul(slope, id),
            Unary::Log => self.div(slope, a),
            Unary::Sin => self.mul_function(slope, Unary::Cos, a),
            Unary::Cos => {
                let product = self.mul_function(slope, Unary::Sin, a);
                self.neg(product)
            }
            Unary::Sinh => self.mul_function(slope, Unary::Cosh, a),
            Unary::Cosh => self.mul_function(slope, Unary::Sinh, a),
            Unary::Abs => self.mul_function(slope, Unary::Sign, a),
            Unary::Sign => self.number(0.0),
            Unary::Tan => {
                let square = self.mul(id, id);
                let factor = self.add(one, square);
                self.mul(slope, factor)
            }
            Unary::Tanh => {
                let square = self.mul(id, id);
                let factor = self.sub(one, square);
                self.mul(slope, factor)
            }
            Unary::Sech => {
                let tanh = self.unary(Unary::Tanh, a);
                let factor = self.mul(id, tanh);
                let product = self.mul(slope, factor);
                self.neg(product)
            }
            Unary::Logistic => {
                let opposite = self.neg(a);
                let rest = self.unary(Unary::Logistic, opposite);
                let factor = self.mul(id, rest);
                self.mul(slope, factor)
            }
            Unary::Softplus => self.mul_function(slope, Unary::Logistic, a),
            Unary::LogCosh => self.mul_function(slope, Unary::Tanh, a),
            Unary::Asin => self.arc_derivative(a, slope),
            Unary::Acos => {
                let arc = self.arc_derivative(a, slope);
                self.neg(arc)
            }
            Unary::Atan => {
                let square = self.mul(a, a);
                let divisor = self.add(one, square);
                self.div(slope, divisor)
            }
        }
    }

    fn mul_function(&mut self, slope: NodeId, function: Unary, a: NodeId) -> NodeId {
        let value = self.unary(function, a);
        self.mul(slope, value)
    }

    /// `a' / √((1 − a)(1 + a))`, which does not cancel near `|a| = 1`.
    fn arc_derivative(&mut self, a: NodeId, slope: NodeId) -> NodeId {
        let one = self.number(1.0);
        let (below, above) = (self.sub(one, a), self.add(one, a));
        let inner = self.mul(below, above);
        let root = self.unary(Unary::Sqrt, inner);
        self.div(slope, root)
    }

    /// Derivative of `function(a, b)`, whose node is `id`.
    fn binary_derivative(
        &mut self,
        function: Binary,
        id: NodeId,
        [a, b]: [NodeId; 2],
        [slope_a, slope_b]: [NodeId; 2],
    ) -> NodeId {
        match function {
            Binary::Add => self.add(slope_a, slope_b),
            Binary::Sub => self.sub(slope_a, slope_b),
            Binary::Mul => {
                let left = self.mul(slope_a, b);
                let right = self.mul(a, slope_b);
                self.add(left, right)
            }
            Binary::Div => {
                let correction = self.mul(id, slope_b);
                let numerator = self.sub(slope_a, correction);
                self.div(numerator, b)
            }
            Binary::Atan2 => {
                let left = self.mul(slope_a, b);
                let right = self.mul(a, slope_b);
                let numerator = self.sub(left, right);
                let (square_a, square_b) = (self.mul(a, a), self.mul(b, b));
                let divisor = self.add(square_a, square_b);
                self.div(numerator, divisor)
            }
            Binary::Min | Binary::Max => {
                let difference = self.sub(a, b);
                let side = self.unary(Unary::Sign, difference);
                let (sum, gap) = (self.add(slope_a, slope_b), self.sub(slope_a, slope_b));
                let jump = self.mul(side, gap);
                let total = match function {
                    Binary::Min => self.sub(sum, jump),
                    _ => self.add(sum, jump),
                };
                let half = self.number(0.5);
                self.mul(half, total)
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::model::expression::{Resolved, parse};

    /// Graph and node of the expression `text`, with `x` = input 0 and `y` = input 1.
    fn read(text: &str) -> (ExpressionGraph, NodeId) {
        let mut graph = ExpressionGraph::new();
        let inputs = [graph.input(0), graph.input(1)];
        let resolve = |name: &str| match name {
            "x" => Resolved::Node(inputs[0]),
            "y" => Resolved::Node(inputs[1]),
            _ => Resolved::Unknown(None),
        };
        let node = parse(text, &mut graph, &resolve).expect("a correct expression");
        (graph, node)
    }

    fn value(graph: &ExpressionGraph, node: NodeId, at: [Dd; 2]) -> Dd {
        let mut values = Vec::new();
        graph.evaluate(&at, &mut values);
        values[node.index()]
    }

    /// The oracle is a central difference in double-double: with `h = 1e-12` its error is about
    /// `f'''/6 h² < 1e-20` from truncation and `1e-32 f/h < 1e-18` from rounding.
    #[test]
    fn derivatives_agree_with_central_differences_in_double_double() {
        let at = [Dd::from_f64(0.375), Dd::from_f64(0.8125)];
        let step = Dd::from_f64(1e-12);
        for text in [
            "x^3 - 2*x*y + 7",
            "x/(y + x^2)",
            "sqrt(x)*exp(-y)",
            "log(x + y)",
            "sin(x*y) + cos(x)*y",
            "tan(x - y)",
            "asin(x*y)",
            "acos(x/2)",
            "atan(3*x)",
            "atan2(x, y)",
            "sinh(x) + cosh(y)*x",
            "tanh(x + y)",
            "abs(x - y)*x",
            "sign(x - y)*x",
            "min(x^2, y)",
            "max(x^2, y*x)",
            "x^2.5",
            "x^y",
            "2^(x*y)",
            "x^-3",
            "1/(1 + exp(-x))",
        ] {
            let (mut graph, node) = read(text);
            for input in 0..2 {
                let slope = graph.derivative(node, input);
                let shifted = |sign: f64| {
                    let mut moved = at;
                    moved[input] += step * Dd::from_f64(sign);
                    value(&graph, node, moved)
                };
                let difference = (shifted(1.0) - shifted(-1.0)) / (step * Dd::from_f64(2.0));
                let error = (value(&graph, slope, at) - difference).hi.abs();
                assert!(error < 1e-17, "d/d{input} of {text}: {error:e}");
            }
        }
    }

    #[test]
    fn second_lie_derivative_of_position_is_acceleration() {
        let (mut graph, acceleration) = read("-x - y/10");
        let (position, velocity) = (graph.input(0), graph.input(1));
        let field = [velocity, acceleration];
        let first = graph.lie_derivative(position, &field);
        assert_eq!(first, velocity);
        assert_eq!(graph.lie_derivative(first, &field), acceleration);
    }

    #[test]
    fn a_long_sum_has_its_derivative_without_a_deep_stack() {
        let text = vec!["x*x*y"; 8_000].join(" + ");
        let (mut graph, node) = read(&text);
        let slope = graph.derivative(node, 1);
        let two = Dd::from_f64(2.0);
        assert_eq!(value(&graph, slope, [two, two]).hi, 32_000.0);
    }
}
