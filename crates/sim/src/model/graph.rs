//! The expression graph: every expression of a scene as one directed acyclic graph.
//!
//! Nodes are stored in evaluation order (an operand has a smaller index than its user) and are
//! hash-consed, so that a common subexpression is stored once.

mod derivative;

use std::collections::HashMap;

use num_traits::{One, Zero};

use crate::numeric::{Dd, Scalar};

/// Index of a node in an [`ExpressionGraph`].
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct NodeId(pub(crate) u32);

impl NodeId {
    /// Position of the node in [`ExpressionGraph::nodes`].
    pub fn index(self) -> usize {
        self.0 as usize
    }
}

/// Function of one argument.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Unary {
    /// Square root.
    Sqrt,
    /// Natural exponential.
    Exp,
    /// Natural logarithm.
    Log,
    /// Sine.
    Sin,
    /// Cosine.
    Cos,
    /// Tangent.
    Tan,
    /// Arc sine.
    Asin,
    /// Arc cosine.
    Acos,
    /// Arc tangent.
    Atan,
    /// Hyperbolic sine.
    Sinh,
    /// Hyperbolic cosine.
    Cosh,
    /// Hyperbolic tangent.
    Tanh,
    /// Reciprocal of the hyperbolic cosine.
    Sech,
    /// Logistic function `1/(1 + e^{−a})`.
    Logistic,
    /// Integral of the logistic function, `log(1 + e^a)`.
    Softplus,
    /// Integral of the hyperbolic tangent, `log cosh a`.
    LogCosh,
    /// Absolute value; not analytic at 0.
    Abs,
    /// Sign; not analytic at 0.
    Sign,
}

/// Function of two arguments.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Binary {
    /// Sum.
    Add,
    /// Difference.
    Sub,
    /// Product.
    Mul,
    /// Quotient.
    Div,
    /// `atan2(y, x)`: angle of the point `(x, y)`.
    Atan2,
    /// Smaller of two; not analytic where they are equal.
    Min,
    /// Larger of two; not analytic where they are equal.
    Max,
}

/// One operation of the graph.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Node {
    /// A number, exact to 32 digits (decimal literals are read in double-double).
    Constant(Dd),
    /// An input: the full state first (states, then the phase if there is one), then the
    /// parameters.
    Input(usize),
    /// Negation.
    Neg(NodeId),
    /// Integer power, any sign.
    PowerInteger(NodeId, i32),
    /// Real constant power of a positive base.
    PowerReal(NodeId, Dd),
    /// Function of one argument.
    Unary(Unary, NodeId),
    /// Function of two arguments.
    Binary(Binary, NodeId, NodeId),
}

impl Node {
    /// Operands of the operation, in order.
    pub fn operands(&self) -> impl Iterator<Item = NodeId> + use<> {
        let pair = match *self {
            Node::Constant(_) | Node::Input(_) => [None, None],
            Node::Neg(a) | Node::PowerInteger(a, _) | Node::PowerReal(a, _) | Node::Unary(_, a) => {
                [Some(a), None]
            }
            Node::Binary(_, a, b) => [Some(a), Some(b)],
        };
        pair.into_iter().flatten()
    }
}

/// Every expression of a model, as operations in evaluation order.
///
/// An operand has a smaller index than its user, and equal operations are stored once. Constructors
/// ([`add`](ExpressionGraph::add), [`unary`](ExpressionGraph::unary), ...) make exact
/// simplifications: `0 + x`, `1 x`, `0 x`, `x - x`, `--x`, `x^1`, and operations on constants,
/// which are done in [`Dd`]. Reciprocals of exponential functions, such as `1/(1 + exp(x))` or
/// `1/cosh(x)`, and logarithms of them become functions of their own, which stay finite where the
/// exponential function overflows.
///
/// ```
/// use grazemap_sim::model::ExpressionGraph;
///
/// let mut graph = ExpressionGraph::new();
/// let x = graph.input(0);
/// let square = graph.mul(x, x);
/// let slope = graph.derivative(square, 0);
/// let mut values = Vec::new();
/// graph.evaluate(&[3.0_f64], &mut values);
/// assert_eq!(values[slope.index()], 6.0);
/// ```
#[derive(Clone, Debug, Default)]
pub struct ExpressionGraph {
    nodes: Vec<Node>,
    known: HashMap<[u64; 3], NodeId>,
    derivatives: HashMap<(NodeId, usize), NodeId>,
}

impl ExpressionGraph {
    /// An empty graph.
    pub fn new() -> Self {
        Self::default()
    }

    /// All operations, operands before their users.
    pub fn nodes(&self) -> &[Node] {
        &self.nodes
    }

    /// The operation of a node of this graph.
    pub fn node(&self, id: NodeId) -> Node {
        self.nodes[id.index()]
    }

    /// Value of a node if it is a constant.
    pub fn constant_value(&self, id: NodeId) -> Option<Dd> {
        match self.node(id) {
            Node::Constant(value) => Some(value),
            _ => None,
        }
    }

    /// Whether a node is the constant 0.
    pub fn is_zero(&self, id: NodeId) -> bool {
        self.constant_value(id) == Some(Dd::ZERO)
    }

    /// Numbers of the inputs that a node depends on, in increasing order.
    pub fn dependencies(&self, node: NodeId) -> Vec<usize> {
        let needed = self.needed_by(&[node]);
        let mut inputs: Vec<usize> = (self.nodes.iter().zip(&needed))
            .filter_map(|(operation, needed)| match operation {
                Node::Input(input) if *needed => Some(*input),
                _ => None,
            })
            .collect();
        inputs.sort_unstable();
        inputs
    }

    /// The outputs and the nodes on which they depend, operands before their users.
    pub fn under(&self, outputs: &[NodeId]) -> Vec<NodeId> {
        let needed = self.needed_by(outputs).into_iter();
        (0..).zip(needed).filter_map(|(index, needed)| needed.then_some(NodeId(index))).collect()
    }

    /// For each node up to the last output: whether the outputs depend on it (or are it).
    pub fn needed_by(&self, outputs: &[NodeId]) -> Vec<bool> {
        let last = outputs.iter().map(|output| output.index() + 1).max();
        let mut needed = vec![false; last.unwrap_or(0)];
        for output in outputs {
            needed[output.index()] = true;
        }
        for index in (0..needed.len()).rev() {
            if needed[index] {
                for operand in self.nodes[index].operands() {
                    needed[operand.index()] = true;
                }
            }
        }
        needed
    }
}

/// An operation that is not analytic where its argument is 0.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct CornerOperation {
    /// `abs`, `sign`, `min` or `max`; or `sqrt`, `log` or `^`.
    pub function: &'static str,
    /// Argument of `abs` or `sign`; for `min` and `max` the difference of both arguments.
    pub argument: NodeId,
}

impl ExpressionGraph {
    /// Operations with a corner on which a node depends, operands first.
    ///
    /// ```
    /// use grazemap_sim::model::{ExpressionGraph, Unary};
    ///
    /// let mut graph = ExpressionGraph::new();
    /// let x = graph.input(0);
    /// let size = graph.unary(Unary::Abs, x);
    /// let friction = graph.mul(size, x);
    /// let corners = graph.corner_operations(friction);
    /// assert_eq!(corners.len(), 1);
    /// assert_eq!((corners[0].function, corners[0].argument), ("abs", x));
    /// ```
    pub fn corner_operations(&mut self, node: NodeId) -> Vec<CornerOperation> {
        let corners = self.operations(node).into_iter();
        corners.filter_map(|operation| self.corner_operation(operation)).collect()
    }

    /// Square roots, logarithms and powers with a real exponent on which a node depends, operands
    /// first. They have no Taylor series where their argument is 0.
    ///
    /// ```
    /// use grazemap_sim::model::{ExpressionGraph, Unary};
    ///
    /// let mut graph = ExpressionGraph::new();
    /// let x = graph.input(0);
    /// let root = graph.unary(Unary::Sqrt, x);
    /// let singular = graph.singular_operations(root);
    /// assert_eq!((singular[0].function, singular[0].argument), ("sqrt", x));
    /// ```
    pub fn singular_operations(&self, node: NodeId) -> Vec<CornerOperation> {
        let singular = |operation| {
            let (function, argument) = match operation {
                Node::Unary(Unary::Sqrt, a) => ("sqrt", a),
                Node::Unary(Unary::Log, a) if self.is_base(operation) => ("^", a),
                Node::Unary(Unary::Log, a) => ("log", a),
                Node::PowerReal(a, _) => ("^", a),
                _ => return None,
            };
            Some(CornerOperation { function, argument })
        };
        self.operations(node).into_iter().filter_map(singular).collect()
    }

    /// Whether a logarithm is that of a power with an exponent that varies, `exp(b log a)`.
    fn is_base(&self, logarithm: Node) -> bool {
        self.nodes.iter().any(|node| {
            let Node::Unary(Unary::Exp, exponent) = *node else { return false };
            let Node::Binary(Binary::Mul, a, b) = self.node(exponent) else { return false };
            self.node(a) == logarithm || self.node(b) == logarithm
        })
    }

    /// Operations on which a node depends, operands first.
    fn operations(&self, node: NodeId) -> Vec<Node> {
        let needed = self.needed_by(&[node]);
        let operations = self.nodes.iter().zip(needed);
        operations.filter_map(|(&operation, needed)| needed.then_some(operation)).collect()
    }

    fn corner_operation(&mut self, operation: Node) -> Option<CornerOperation> {
        let (function, argument) = match operation {
            Node::Unary(Unary::Abs, a) => ("abs", a),
            Node::Unary(Unary::Sign, a) => ("sign", a),
            Node::Binary(Binary::Min, a, b) => ("min", self.sub(a, b)),
            Node::Binary(Binary::Max, a, b) => ("max", self.sub(a, b)),
            _ => return None,
        };
        Some(CornerOperation { function, argument })
    }
}

impl ExpressionGraph {
    /// Fills `values` with the value of every node at `inputs` (full state, then parameters).
    ///
    /// Functions outside their domain give NaN, as in [`Scalar`].
    ///
    /// # Panics
    ///
    /// If `inputs` is shorter than the largest input number of the graph.
    pub fn evaluate<S: Scalar>(&self, inputs: &[S], values: &mut Vec<S>) {
        values.clear();
        values.reserve(self.nodes.len());
        for node in &self.nodes {
            let value = match *node {
                Node::Constant(value) => S::from_dd(value),
                Node::Input(input) => inputs[input],
                Node::Neg(a) => -values[a.index()],
                Node::PowerInteger(a, exponent) => power(values[a.index()], exponent),
                Node::PowerReal(a, exponent) => values[a.index()].powf(S::from_dd(exponent)),
                Node::Unary(function, a) => unary(function, values[a.index()]),
                Node::Binary(function, a, b) => {
                    binary(function, values[a.index()], values[b.index()])
                }
            };
            values.push(value);
        }
    }
}

impl ExpressionGraph {
    /// Expressions in which other nodes stand for some of the nodes below them.
    ///
    /// `replacement` gives the node that stands for a node, or `None` to keep it. What is replaced
    /// is not looked into.
    ///
    /// ```
    /// use grazemap_sim::model::ExpressionGraph;
    ///
    /// let mut graph = ExpressionGraph::new();
    /// let (x, y) = (graph.input(0), graph.input(1));
    /// let square = graph.mul(x, x);
    /// let sum = graph.add(square, y);
    /// let product = graph.mul(y, y);
    /// let replaced = graph.substituted(&[sum], |node| (node == square).then_some(product));
    /// assert_eq!(replaced, [graph.add(product, y)]);
    /// ```
    pub fn substituted(
        &mut self,
        outputs: &[NodeId],
        replacement: impl Fn(NodeId) -> Option<NodeId>,
    ) -> Vec<NodeId> {
        let needed = self.needed_by(outputs);
        let mut stands: Vec<NodeId> = Vec::with_capacity(needed.len());
        for (index, &needed) in needed.iter().enumerate() {
            let id = NodeId(u32::try_from(index).expect("an index of the graph fits"));
            let node = match replacement(id) {
                Some(node) => node,
                None if needed => self.rebuilt(id, &stands),
                None => id,
            };
            stands.push(node);
        }
        outputs.iter().map(|output| stands[output.index()]).collect()
    }

    /// The operation of a node on other operands: `stands` holds what stands for each node before.
    fn rebuilt(&mut self, id: NodeId, stands: &[NodeId]) -> NodeId {
        let of = |operand: NodeId| stands[operand.index()];
        match self.node(id) {
            Node::Constant(_) | Node::Input(_) => id,
            Node::Neg(a) => self.neg(of(a)),
            Node::PowerInteger(a, exponent) => self.power_integer(of(a), exponent),
            Node::PowerReal(a, exponent) => self.power_real(of(a), exponent),
            Node::Unary(function, a) => self.unary(function, of(a)),
            Node::Binary(function, a, b) => self.binary(function, of(a), of(b)),
        }
    }
}

/// `aⁿ` by repeated squaring; for a negative exponent the reciprocal of the positive power.
fn power<S: Scalar>(base: S, exponent: i32) -> S {
    let mut result = S::one();
    let mut square = base;
    let mut remaining = exponent.unsigned_abs();
    while remaining > 0 {
        if remaining & 1 == 1 {
            result *= square;
        }
        remaining >>= 1;
        if remaining > 0 {
            square = square * square;
        }
    }
    if exponent < 0 { S::one() / result } else { result }
}

/// Value of a function of one argument.
fn unary<S: Scalar>(function: Unary, a: S) -> S {
    match function {
        Unary::Sqrt => a.sqrt(),
        Unary::Exp => a.exp(),
        Unary::Log => a.ln(),
        Unary::Sin => a.sin_cos().0,
        Unary::Cos => a.sin_cos().1,
        Unary::Tan => {
            let (sine, cosine) = a.sin_cos();
            sine / cosine
        }
        Unary::Asin => a.asin(),
        Unary::Acos => a.acos(),
        Unary::Atan => a.atan(),
        Unary::Sinh => a.sinh_cosh().0,
        Unary::Cosh => a.sinh_cosh().1,
        Unary::Tanh => a.tanh(),
        Unary::Sech => a.sech(),
        Unary::Logistic => a.logistic(),
        Unary::Softplus => a.softplus(),
        Unary::LogCosh => a.ln_cosh(),
        Unary::Abs => a.abs(),
        Unary::Sign => a.signum(),
    }
}

/// Value of a function of two arguments.
fn binary<S: Scalar>(function: Binary, a: S, b: S) -> S {
    match function {
        Binary::Add => a + b,
        Binary::Sub => a - b,
        Binary::Mul => a * b,
        Binary::Div => a / b,
        Binary::Atan2 => a.atan2(b),
        Binary::Min => a.min(b),
        Binary::Max => a.max(b),
    }
}

impl ExpressionGraph {
    /// A number.
    pub fn constant(&mut self, value: Dd) -> NodeId {
        let value = if value == Dd::zero() { Dd::zero() } else { value };
        self.insert(Node::Constant(value))
    }

    /// A number given as an `f64`.
    pub fn number(&mut self, value: f64) -> NodeId {
        self.constant(Dd::from_f64(value))
    }

    /// Input number `input`: the full state first, then the parameters.
    pub fn input(&mut self, input: usize) -> NodeId {
        self.insert(Node::Input(input))
    }

    /// `-a`.
    pub fn neg(&mut self, a: NodeId) -> NodeId {
        match self.node(a) {
            Node::Constant(value) => self.constant(-value),
            Node::Neg(inner) => inner,
            Node::Binary(Binary::Sub, left, right) => self.sub(right, left),
            _ => self.insert(Node::Neg(a)),
        }
    }

    /// `a + b`.
    pub fn add(&mut self, a: NodeId, b: NodeId) -> NodeId {
        match (self.node(a), self.node(b)) {
            (Node::Constant(value), _) if value == Dd::zero() => b,
            (_, Node::Constant(value)) if value == Dd::zero() => a,
            (_, Node::Neg(inner)) => self.sub(a, inner),
            (Node::Neg(inner), _) => self.sub(b, inner),
            _ => self.fold_or_insert(Node::Binary(Binary::Add, a.min(b), a.max(b))),
        }
    }

    /// `a - b`.
    pub fn sub(&mut self, a: NodeId, b: NodeId) -> NodeId {
        if a == b {
            return self.number(0.0);
        }
        match (self.node(a), self.node(b)) {
            (_, Node::Constant(value)) if value == Dd::zero() => a,
            (Node::Constant(value), _) if value == Dd::zero() => self.neg(b),
            (_, Node::Neg(inner)) => self.add(a, inner),
            _ => self.fold_or_insert(Node::Binary(Binary::Sub, a, b)),
        }
    }

    /// `a b`.
    pub fn mul(&mut self, a: NodeId, b: NodeId) -> NodeId {
        if a == b {
            return self.power_integer(a, 2);
        }
        match (self.node(a), self.node(b)) {
            (Node::Constant(_), Node::Constant(_)) => {
                self.fold_or_insert(Node::Binary(Binary::Mul, a.min(b), a.max(b)))
            }
            (Node::Constant(value), _) if value == Dd::zero() => a,
            (_, Node::Constant(value)) if value == Dd::zero() => b,
            (Node::Constant(value), _) if value == Dd::one() => b,
            (_, Node::Constant(value)) if value == Dd::one() => a,
            (Node::Constant(value), _) if value == -Dd::one() => self.neg(b),
            (_, Node::Constant(value)) if value == -Dd::one() => self.neg(a),
            (Node::Neg(inner), _) => {
                let product = self.mul(inner, b);
                self.neg(product)
            }
            (_, Node::Neg(inner)) => {
                let product = self.mul(a, inner);
                self.neg(product)
            }
            _ => self.insert(Node::Binary(Binary::Mul, a.min(b), a.max(b))),
        }
    }

    /// `a / b`.
    pub fn div(&mut self, a: NodeId, b: NodeId) -> NodeId {
        match (self.node(a), self.node(b)) {
            (_, Node::Constant(value)) if value == Dd::one() => a,
            (_, Node::Constant(value)) if value == -Dd::one() => self.neg(a),
            (Node::Constant(value), divisor) if value == Dd::zero() && !is_zero(divisor) => a,
            (numerator, _) => {
                if let Some(quotient) = self.logistic_of(numerator, b) {
                    return quotient;
                }
                match self.reciprocal(b) {
                    Some(reciprocal) => self.mul(a, reciprocal),
                    None => self.fold_or_insert(Node::Binary(Binary::Div, a, b)),
                }
            }
        }
    }

    /// `aⁿ` for an integer `n` of any sign.
    pub fn power_integer(&mut self, a: NodeId, exponent: i32) -> NodeId {
        match (exponent, self.node(a)) {
            (0, _) => self.number(1.0),
            (1, _) => a,
            (_, Node::Neg(inner)) => {
                let power = self.power_integer(inner, exponent);
                if exponent % 2 == 0 { power } else { self.neg(power) }
            }
            (_, Node::PowerInteger(inner, first)) if first.checked_mul(exponent).is_some() => {
                self.power_integer(inner, first * exponent)
            }
            (..=-1, _) => match self.reciprocal(a) {
                Some(reciprocal) => self.power_integer(reciprocal, exponent.saturating_neg()),
                None => self.fold_or_insert(Node::PowerInteger(a, exponent)),
            },
            _ => self.fold_or_insert(Node::PowerInteger(a, exponent)),
        }
    }

    /// `a^c` for a real constant `c`: [`power_integer`](Self::power_integer) if `c` is an integer,
    /// a square root if `c` is one half.
    pub fn power_real(&mut self, a: NodeId, exponent: Dd) -> NodeId {
        if let Some(integer) = as_integer(exponent) {
            self.power_integer(a, integer)
        } else if exponent == Dd::from_f64(0.5) {
            self.unary(Unary::Sqrt, a)
        } else {
            self.fold_or_insert(Node::PowerReal(a, exponent))
        }
    }

    /// `a^b`: an integer power, a real constant power, or `exp(b log a)`.
    pub fn power(&mut self, a: NodeId, b: NodeId) -> NodeId {
        if let Some(exponent) = self.constant_value(b) {
            return self.power_real(a, exponent);
        }
        let logarithm = self.unary(Unary::Log, a);
        let product = self.mul(b, logarithm);
        self.unary(Unary::Exp, product)
    }

    /// A function of one argument.
    pub fn unary(&mut self, function: Unary, a: NodeId) -> NodeId {
        match (function, self.node(a)) {
            (Unary::Log, Node::Unary(Unary::Exp, exponent)) => exponent,
            (Unary::Log, Node::Unary(Unary::Cosh, b)) => self.unary(Unary::LogCosh, b),
            (Unary::Log, sum) => match self.shifted_exponential(sum) {
                Some((shift, exponent)) => {
                    let logarithm = self.constant(shift.ln());
                    let above = self.sub(exponent, logarithm);
                    let softplus = self.unary(Unary::Softplus, above);
                    self.add(logarithm, softplus)
                }
                None => self.fold_or_insert(Node::Unary(function, a)),
            },
            (Unary::Sqrt, Node::PowerInteger(base, 2)) => self.unary(Unary::Abs, base),
            _ => self.fold_or_insert(Node::Unary(function, a)),
        }
    }

    /// `c` and `a` of a sum `c + e^a` with a positive number `c`.
    fn shifted_exponential(&self, sum: Node) -> Option<(Dd, NodeId)> {
        let Node::Binary(Binary::Add, a, b) = sum else { return None };
        [(a, b), (b, a)].into_iter().find_map(|(shift, exponential)| {
            let shift = self.constant_value(shift).filter(|&shift| shift > Dd::zero())?;
            match self.node(exponential) {
                Node::Unary(Unary::Exp, exponent) => Some((shift, exponent)),
                _ => None,
            }
        })
    }

    /// Reciprocal of an exponential function, in a form that stays finite where that function
    /// overflows; `None` for other expressions.
    fn reciprocal(&mut self, a: NodeId) -> Option<NodeId> {
        match self.node(a) {
            Node::Unary(Unary::Exp, exponent) => {
                let opposite = self.neg(exponent);
                Some(self.unary(Unary::Exp, opposite))
            }
            Node::Unary(Unary::Cosh, b) => Some(self.unary(Unary::Sech, b)),
            Node::PowerInteger(base, exponent) if exponent > 0 => {
                let reciprocal = self.reciprocal(base)?;
                Some(self.power_integer(reciprocal, exponent))
            }
            sum => {
                // 1/(c + e^a) = 1/c · 1/(1 + e^{a − ln c}).
                let (shift, exponent) = self.shifted_exponential(sum)?;
                let logarithm = self.constant(shift.ln());
                let below = self.sub(logarithm, exponent);
                let logistic = self.unary(Unary::Logistic, below);
                let factor = self.constant(Dd::one() / shift);
                Some(self.mul(factor, logistic))
            }
        }
    }

    /// `e^a/(1 + e^a)^n`, in a form that is finite for every `a`; `None` for other quotients.
    fn logistic_of(&mut self, numerator: Node, divisor: NodeId) -> Option<NodeId> {
        let Node::Unary(Unary::Exp, exponent) = numerator else { return None };
        let (base, power) = match self.node(divisor) {
            Node::PowerInteger(base, power) => (base, power),
            _ => (divisor, 1),
        };
        let (shift, of_base) = self.shifted_exponential(self.node(base))?;
        if shift != Dd::one() || of_base != exponent {
            return None;
        }
        let (logistic, reciprocal) =
            (self.unary(Unary::Logistic, exponent), self.reciprocal(base)?);
        let rest = self.power_integer(reciprocal, power - 1);
        Some(self.mul(logistic, rest))
    }

    /// A function of two arguments.
    pub fn binary(&mut self, function: Binary, a: NodeId, b: NodeId) -> NodeId {
        match function {
            Binary::Add => self.add(a, b),
            Binary::Sub => self.sub(a, b),
            Binary::Mul => self.mul(a, b),
            Binary::Div => self.div(a, b),
            Binary::Min | Binary::Max if a == b => a,
            Binary::Atan2 | Binary::Min | Binary::Max => {
                self.fold_or_insert(Node::Binary(function, a, b))
            }
        }
    }

    /// Node of an operation: a constant if its operands are constants and its value is finite.
    fn fold_or_insert(&mut self, node: Node) -> NodeId {
        match self.folded(&node) {
            Some(value) => self.constant(value),
            None => self.insert(node),
        }
    }

    /// Finite value of an operation on constants; `None` otherwise.
    fn folded(&self, node: &Node) -> Option<Dd> {
        let mut operands = [Dd::zero(); 2];
        for (slot, operand) in operands.iter_mut().zip(node.operands()) {
            *slot = self.constant_value(operand)?;
        }
        let value = match *node {
            Node::Neg(_) => -operands[0],
            Node::PowerInteger(_, exponent) => power(operands[0], exponent),
            Node::PowerReal(_, exponent) => operands[0].powf(exponent),
            Node::Unary(function, _) => unary(function, operands[0]),
            Node::Binary(function, _, _) => binary(function, operands[0], operands[1]),
            Node::Constant(_) | Node::Input(_) => return None,
        };
        value.is_finite().then_some(value)
    }

    /// Node of an operation; an equal operation that is there already is reused.
    fn insert(&mut self, node: Node) -> NodeId {
        let nodes = &mut self.nodes;
        *self.known.entry(key(&node)).or_insert_with(|| {
            let id = NodeId(
                u32::try_from(nodes.len()).expect("fewer than 2^32 operations fit in memory"),
            );
            nodes.push(node);
            id
        })
    }
}

/// Whether an operation is the constant zero.
fn is_zero(node: Node) -> bool {
    matches!(node, Node::Constant(value) if value == Dd::zero())
}

/// Integer value of a constant, if it is an `i32`.
fn as_integer(value: Dd) -> Option<i32> {
    let limit = f64::from(i32::MAX);
    let integer = value.lo == 0.0 && value.hi.fract() == 0.0 && value.hi.abs() <= limit;
    integer.then_some(value.hi as i32)
}

/// Key of an operation: three words that are equal for equal operations only.
fn key(node: &Node) -> [u64; 3] {
    let pair = |tag: u64, a: NodeId, b: u64| [tag, u64::from(a.0), b];
    match *node {
        Node::Constant(value) => [0, value.hi.to_bits(), value.lo.to_bits()],
        Node::Input(input) => [1, input as u64, 0],
        Node::Neg(a) => pair(2, a, 0),
        Node::PowerInteger(a, exponent) => pair(3, a, i64::from(exponent) as u64),
        Node::PowerReal(a, exponent) => {
            [4 | (u64::from(a.0) << 8), exponent.hi.to_bits(), exponent.lo.to_bits()]
        }
        Node::Unary(function, a) => pair(5, a, function as u64),
        Node::Binary(function, a, b) => pair(6 | ((function as u64) << 8), a, u64::from(b.0)),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn equal_operations_stand_once() {
        let mut graph = ExpressionGraph::new();
        let (x, y) = (graph.input(0), graph.input(1));
        assert_eq!(graph.add(x, y), graph.add(y, x));
        assert_eq!(graph.mul(x, x), graph.power_integer(x, 2));
        assert_ne!(graph.sub(x, y), graph.sub(y, x));
        assert_ne!(graph.unary(Unary::Sin, x), graph.unary(Unary::Cos, x));
        assert_ne!(graph.binary(Binary::Min, x, y), graph.binary(Binary::Max, x, y));
    }

    #[test]
    fn exact_simplifications_leave_no_operation() {
        let mut graph = ExpressionGraph::new();
        let (x, zero, one) = (graph.input(0), graph.number(0.0), graph.number(1.0));
        assert_eq!(
            [graph.add(zero, x), graph.mul(one, x), graph.sub(x, zero), graph.div(x, one)],
            [x; 4]
        );
        assert_eq!([graph.mul(x, zero), graph.sub(x, x), graph.div(zero, x)], [zero; 3]);
        let negative = graph.neg(x);
        assert_eq!([graph.neg(negative), graph.power_integer(x, 1)], [x; 2]);
        assert_eq!(graph.power_integer(x, 0), one);
        assert_eq!(graph.nodes().len(), 4);
    }

    #[test]
    fn constants_are_folded_only_where_the_value_is_finite() {
        let mut graph = ExpressionGraph::new();
        let (three, zero) = (graph.number(3.0), graph.number(0.0));
        let root = graph.unary(Unary::Sqrt, three);
        let square = graph.mul(root, root);
        let value = graph.constant_value(square).expect("a constant");
        assert!((value - Dd::from_f64(3.0)).hi.abs() < 1e-31);
        let quotient = graph.div(three, zero);
        assert_eq!(graph.constant_value(quotient), None);
    }

    #[test]
    fn dependencies_are_the_inputs_that_remain() {
        let mut graph = ExpressionGraph::new();
        let (x, y, z) = (graph.input(4), graph.input(1), graph.input(2));
        let (product, difference) = (graph.mul(x, y), graph.sub(z, z));
        let sum = graph.add(product, difference);
        assert_eq!(graph.dependencies(sum), [1, 4]);
    }
}
