//! Check that a model repeats after the period of its phase.
//!
//! Flow, events, resets, contacts and releases are compared at phases one period apart. A pass over
//! the graph proves most of them equal ([`Shift`]); the others are sampled. The check is repeated
//! with each varying parameter changed, one at a time.

use std::collections::BTreeSet;
use std::f64::consts::TAU;

use super::document::{Field, Table};
use crate::model::error::{Checked, Repeats, SceneProblem};
use crate::model::fraction::Fraction;
use crate::model::graph::{Binary, Node, NodeId, Unary};
use crate::model::oscillator::{Model, Parameter, Phase, Response};
use crate::numeric::Dd;

/// Largest distance from a whole number of turns that counts as whole, in turns.
const WHOLE: f64 = 1e-8;
/// Largest change of a sample over one period that counts as zero, relative to the variation of the
/// expression with the phase: the change of a sine that [`WHOLE`] allows.
const DEPARTURE: f64 = 1e-7;
/// Rounding of a sample in double-double, relative to the value.
const ROUNDING: f64 = 1e-20;
/// States sampled.
const STATES: usize = 9;
/// Phases sampled at each state.
const PHASES: usize = 24;
/// Relative change of a parameter that varies.
const VARIED: f64 = 0.7e-3;

/// Refuses a model that does not repeat after the period of its phase, at the scene's parameters
/// and at nearby values of each parameter in `varied`; states are sampled near `guess`.
pub(super) fn check(
    table: &Table<'_>,
    model: &Model,
    varied: &BTreeSet<usize>,
    guess: Option<&[f64]>,
) -> Checked<()> {
    let Some(phase) = &model.phase else {
        return Ok(());
    };
    let roots = roots(table, model)?;
    let check = Check { model, phase, guess };
    let own = model.parameter_values();
    if let Some((field, departure)) = check.first_departure(&roots, &own) {
        return Err(field.fault(SceneProblem::Period {
            key: field.path.clone(),
            phase: phase.name.clone(),
            period: phase.period.to_f64(),
            from: departure.from,
            change: departure.change,
            repeats: check.repeats(&roots, &own),
        }));
    }
    for &parameter in varied {
        let mut beside = own.clone();
        beside[parameter] = moved(own[parameter]);
        if let Some((field, _)) = check.first_departure(&roots, &beside) {
            return Err(field.fault(SceneProblem::PeriodOfParameter {
                key: field.path.clone(),
                phase: phase.name.clone(),
                period: phase.period.to_f64(),
                parameter: model.parameters[parameter].name.clone(),
                value: own[parameter].to_f64(),
            }));
        }
    }
    Ok(())
}

/// A nearby value of a parameter.
fn moved(value: Dd) -> Dd {
    let size = if value.to_f64() == 0.0 { 1.0 } else { value.to_f64() };
    value + Dd::from(size * VARIED)
}

/// Expressions that may contain the phase, with their fields in the text.
fn roots<'a>(table: &Table<'a>, model: &Model) -> Checked<Vec<(NodeId, Field<'a>)>> {
    let mut roots = laws(&table.require("flow")?.table()?, model, &model.flow);
    for (surface, table) in model.surfaces.iter().zip(table.require("surface")?.tables()?) {
        roots.push((surface.event, table.require("event")?));
        match &surface.response {
            Response::Impact { reset } => {
                roots.extend(laws(&table.require("impact")?.table()?, model, reset));
            }
            Response::Contact { field, release } => {
                roots.extend(laws(&table.require("contact")?.table()?, model, field));
                roots.extend(table.field("release").map(|field| (*release, field)));
            }
        }
    }
    Ok(roots)
}

/// Expressions of a table whose keys are states.
fn laws<'a>(table: &Table<'a>, model: &Model, nodes: &[NodeId]) -> Vec<(NodeId, Field<'a>)> {
    let pairs = model.states.iter().zip(nodes);
    pairs.filter_map(|(state, &node)| Some((node, table.field(state)?))).collect()
}

/// Change of a node when the phase advances by one period.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Shift {
    /// The node grows by a number for all states and phases; it repeats if the number is 0.
    By(Dd),
    /// The node changes its sign.
    Opposite,
    /// Nothing is proved.
    Unknown,
}

impl Shift {
    /// Shift of a node that repeats.
    const NONE: Self = Self::By(Dd { hi: 0.0, lo: 0.0 });

    fn plus(self, other: Self) -> Self {
        match (self, other) {
            (Self::By(a), Self::By(b)) => Self::By(a + b),
            (Self::Opposite, Self::Opposite) => Self::Opposite,
            _ => Self::Unknown,
        }
    }

    fn negated(self) -> Self {
        match self {
            Self::By(a) => Self::By(-a),
            other => other,
        }
    }

    /// Shift of a product or a quotient.
    fn times(self, other: Self) -> Self {
        match (self, other) {
            (Self::NONE, Self::NONE) | (Self::Opposite, Self::Opposite) => Self::NONE,
            (Self::NONE, Self::Opposite) | (Self::Opposite, Self::NONE) => Self::Opposite,
            _ => Self::Unknown,
        }
    }

    /// Shift of a function of the node, by the parity of the function.
    fn through(self, parity: Parity) -> Self {
        match (self, parity) {
            (Self::NONE, _) | (Self::Opposite, Parity::Even) => Self::NONE,
            (Self::Opposite, Parity::Odd) => Self::Opposite,
            _ => Self::Unknown,
        }
    }
}

/// Parity of a function.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Parity {
    Even,
    Odd,
    Neither,
}

impl Parity {
    fn of(function: Unary) -> Self {
        match function {
            Unary::Cos | Unary::Cosh | Unary::Sech | Unary::LogCosh | Unary::Abs => Self::Even,
            Unary::Sqrt
            | Unary::Exp
            | Unary::Log
            | Unary::Acos
            | Unary::Logistic
            | Unary::Softplus => Self::Neither,
            Unary::Sin
            | Unary::Tan
            | Unary::Asin
            | Unary::Atan
            | Unary::Sinh
            | Unary::Tanh
            | Unary::Sign => Self::Odd,
        }
    }
}

/// Whether an angle is a whole number of turns, with `turn` the angle of one.
fn is_whole(angle: Dd, turn: Dd) -> bool {
    let turns = (angle / turn).to_f64();
    (turns - turns.round()).abs() <= WHOLE
}

/// A change of an expression over one period.
struct Departure {
    /// Phase at which the change was found.
    from: f64,
    /// Value one period later minus the value at that phase.
    change: f64,
}

/// An oscillation that an expression contains: a sine, cosine or tangent of the phase.
struct Oscillation {
    /// Angular frequency in the phase, positive.
    frequency: f64,
    /// Argument of the oscillation.
    argument: NodeId,
}

struct Check<'a> {
    model: &'a Model,
    phase: &'a Phase,
    guess: Option<&'a [f64]>,
}

impl Check<'_> {
    /// First expression that does not repeat, with its change.
    fn first_departure<'r, 'a>(
        &self,
        roots: &'r [(NodeId, Field<'a>)],
        parameters: &[Dd],
    ) -> Option<(&'r Field<'a>, Departure)> {
        let shifts = self.shifts(parameters);
        let open: Vec<_> =
            roots.iter().filter(|(node, _)| shifts[node.index()] != Shift::NONE).collect();
        let nodes: Vec<NodeId> = open.iter().map(|(node, _)| *node).collect();
        let (number, departure) = self.sampled_departure(&nodes, parameters)?;
        Some((&open[number].1, departure))
    }

    /// Shift of every node of the graph.
    fn shifts(&self, parameters: &[Dd]) -> Vec<Shift> {
        let graph = &self.model.graph;
        let phase = self.model.states.len();
        let mut values = Vec::new();
        graph.evaluate(&inputs(&vec![0.0; phase], Dd::ZERO, parameters), &mut values);
        let mut shifts: Vec<Shift> = Vec::with_capacity(values.len());
        // For every node: whether it depends on parameters only.
        let mut fixed: Vec<bool> = Vec::with_capacity(values.len());
        for node in graph.nodes() {
            let shift = |a: NodeId| shifts[a.index()];
            let scaled = |a: NodeId, factor: Dd| match shift(a) {
                Shift::By(angle) => Shift::By(angle * factor),
                other => other,
            };
            let value = |a: NodeId| values[a.index()];
            let next = match *node {
                Node::Input(input) if input == phase => Shift::By(self.phase.period),
                Node::Constant(_) | Node::Input(_) => Shift::NONE,
                Node::Neg(a) => shift(a).negated(),
                Node::Binary(Binary::Add, a, b) => shift(a).plus(shift(b)),
                Node::Binary(Binary::Sub, a, b) => shift(a).plus(shift(b).negated()),
                Node::Binary(Binary::Mul, a, b) if fixed[b.index()] => scaled(a, value(b)),
                Node::Binary(Binary::Mul, a, b) if fixed[a.index()] => scaled(b, value(a)),
                Node::Binary(Binary::Div, a, b) if fixed[b.index()] => {
                    scaled(a, Dd::from(1.0) / value(b))
                }
                Node::Binary(Binary::Mul | Binary::Div, a, b) => shift(a).times(shift(b)),
                Node::Binary(Binary::Atan2 | Binary::Min | Binary::Max, a, b) => {
                    let both = [shift(a), shift(b)];
                    if both == [Shift::NONE; 2] { Shift::NONE } else { Shift::Unknown }
                }
                Node::PowerInteger(a, exponent) => {
                    let even = exponent % 2 == 0;
                    shift(a).through(if even { Parity::Even } else { Parity::Odd })
                }
                Node::PowerReal(a, _) => shift(a).through(Parity::Neither),
                Node::Unary(function, a) => unary_shift(function, shift(a)),
            };
            shifts.push(match next {
                Shift::By(growth) if !growth.is_finite() => Shift::Unknown,
                other => other,
            });
            fixed.push(match node {
                Node::Input(input) => *input > phase,
                _ => node.operands().all(|a| fixed[a.index()]),
            });
        }
        shifts
    }

    /// First of some nodes that changes over one period at a sample; samples at which the node is
    /// not finite are skipped.
    fn sampled_departure(&self, nodes: &[NodeId], parameters: &[Dd]) -> Option<(usize, Departure)> {
        if nodes.is_empty() {
            return None;
        }
        let period = self.phase.period;
        let mut values = Vec::new();
        let mut at = |state: &[f64], phase: Dd| -> Vec<Dd> {
            self.model.graph.evaluate(&inputs(state, phase, parameters), &mut values);
            nodes.iter().map(|node| values[node.index()]).collect()
        };
        let mut found: Option<(usize, Departure)> = None;
        for state in (0..STATES).map(|sample| self.state(sample)) {
            let phases = (0..PHASES).map(|place| {
                let share = (place as f64 + 0.5) / PHASES as f64 + 0.01 * (place as f64).sin();
                period * Dd::from(share)
            });
            let rows: Vec<_> = phases
                .map(|phase| (phase.to_f64(), at(&state, phase), at(&state, phase + period)))
                .collect();
            for number in 0..found.as_ref().map_or(nodes.len(), |(number, _)| *number) {
                let pairs = rows.iter().map(|(phase, here, later)| {
                    (*phase, here[number], later[number] - here[number])
                });
                let pairs: Vec<_> = pairs.filter(|(_, _, change)| change.is_finite()).collect();
                let here = || pairs.iter().map(|(_, here, _)| here.to_f64());
                let (low, high) = here()
                    .fold((f64::INFINITY, f64::NEG_INFINITY), |range, value| {
                        (range.0.min(value), range.1.max(value))
                    });
                let size = low.abs().max(high.abs());
                let farthest = pairs
                    .iter()
                    .map(|(phase, _, change)| (*phase, change.to_f64()))
                    .max_by(|a, b| a.1.abs().total_cmp(&b.1.abs()));
                let Some((from, change)) = farthest else { continue };
                let allowed = DEPARTURE * (high - low) + ROUNDING * size;
                if change.abs() > allowed {
                    found = Some((number, Departure { from, change }));
                    break;
                }
            }
        }
        found
    }

    /// A sampled state: the guess of the scene, or rest, or a state near it at one of three
    /// distances.
    fn state(&self, sample: usize) -> Vec<f64> {
        let distance = [1.0, 0.1, 10.0][sample % 3];
        let wave = |component: usize| (1.3 * sample as f64 + 2.1 * component as f64 + 0.4).sin();
        let place = |component: usize| {
            let middle = self.guess.map_or(0.0, |guess| guess[component]);
            middle + distance * wave(component) * middle.abs().max(1.0)
        };
        (0..self.model.states.len()).map(place).collect()
    }

    /// Common period of the oscillations in the model.
    fn repeats(&self, roots: &[(NodeId, Field<'_>)], parameters: &[Dd]) -> Repeats {
        let oscillations = self.oscillations(roots, parameters);
        let Some(first) = oscillations.first() else {
            return Repeats::Unknown;
        };
        let mut least = Fraction::ONE;
        for other in &oscillations[1..] {
            let ratio = other.frequency / first.frequency;
            let fraction = Fraction::near(ratio, 1e-11, Fraction::LARGEST);
            let Some(common) = fraction.and_then(|fraction| least.common(fraction)) else {
                let rough = Fraction::near(ratio, 1e-2, 100);
                return rough.map_or(Repeats::Unknown, |rough| Repeats::Never {
                    ratio,
                    near: (rough.over, rough.under),
                    period: TAU / first.frequency * rough.under as f64,
                });
            };
            least = common;
        }
        let frequency = first.frequency * least.value();
        Repeats::After { period: TAU / frequency, rate: self.rate(&oscillations) }
    }

    /// Parameter that multiplies the phase in every oscillation, if the phase is time.
    fn rate(&self, oscillations: &[Oscillation]) -> Option<String> {
        let graph = &self.model.graph;
        if graph.constant_value(self.phase.rate)?.to_f64() != 1.0 {
            return None;
        }
        let inputs = |oscillation: &Oscillation| graph.dependencies(oscillation.argument);
        let first = oscillations.first()?;
        let names = inputs(first).into_iter().filter_map(|input| {
            let parameter = input.checked_sub(self.model.dimension())?;
            let Parameter { name, value } = &self.model.parameters[parameter];
            let multiple = |other: &Oscillation| {
                let ratio = other.frequency / value.to_f64().abs();
                ratio.is_finite() && is_whole(Dd::from(ratio), Dd::from(1.0))
            };
            let all = |other: &Oscillation| inputs(other).contains(&input) && multiple(other);
            oscillations.iter().all(all).then(|| name.clone())
        });
        names.into_iter().next()
    }

    /// Oscillations in some expressions, one of each frequency.
    fn oscillations(&self, roots: &[(NodeId, Field<'_>)], parameters: &[Dd]) -> Vec<Oscillation> {
        let graph = &self.model.graph;
        let shifts = self.shifts(parameters);
        let nodes: Vec<NodeId> = roots.iter().map(|(node, _)| *node).collect();
        let mut found: Vec<Oscillation> = Vec::new();
        for (operation, _) in graph.nodes().iter().zip(graph.needed_by(&nodes)).filter(|n| n.1) {
            let (argument, turn) = match *operation {
                Node::Unary(Unary::Sin | Unary::Cos, a) => (a, 1.0),
                Node::Unary(Unary::Tan, a) => (a, 2.0),
                _ => continue,
            };
            let Shift::By(angle) = shifts[argument.index()] else { continue };
            let frequency = turn * (angle / self.phase.period).to_f64().abs();
            let same =
                |other: &Oscillation| (other.frequency - frequency).abs() <= 1e-14 * frequency;
            if frequency > 0.0 && !found.iter().any(same) {
                found.push(Oscillation { frequency, argument });
            }
        }
        found
    }
}

/// Shift of a function of one argument.
fn unary_shift(function: Unary, argument: Shift) -> Shift {
    let turns = |turn: Dd| match argument {
        Shift::By(angle) => is_whole(angle, turn),
        _ => false,
    };
    match function {
        Unary::Sin | Unary::Cos if turns(Dd::PI + Dd::PI) => Shift::NONE,
        Unary::Sin | Unary::Cos if turns(Dd::PI) => Shift::Opposite,
        Unary::Tan if turns(Dd::PI) => Shift::NONE,
        _ => argument.through(Parity::of(function)),
    }
}

/// Inputs of the graph for a state, a phase and parameters.
fn inputs(state: &[f64], phase: Dd, parameters: &[Dd]) -> Vec<Dd> {
    let state = state.iter().map(|&value| Dd::from(value));
    state.chain([phase]).chain(parameters.iter().copied()).collect()
}

#[cfg(test)]
mod tests {
    use super::super::Scene;
    use crate::model::error::{Repeats, SceneProblem};

    /// Result of reading a scene whose state `v` has this rate and whose phase `t` is time.
    fn read(rate: &str, period: &str) -> Result<Scene, SceneProblem> {
        let text = format!(
            "[model]\nstates = [\"x\", \"v\"]\nparameters = {{ A = 0.3, w = 0.8, two = 2.0 }}\n\
             [model.phase]\nname = \"t\"\nrate = \"1\"\nperiod = \"{period}\"\n\
             [model.flow]\nx = \"v\"\nv = \"A*0 + {rate}\"\n[[model.surface]]\nname = \"stop\"\n\
             event = \"A - x\"\nimpact = {{ v = \"-0.5*v\" }}\n[grazing]\nsolve_for = \"A\"\n"
        );
        Scene::parse(&text, "forced.toml").map_err(|error| error.problem().clone())
    }

    #[test]
    fn models_with_the_period_that_they_state_are_read() {
        for (rate, period) in [
            ("cos(t)", "2*pi"),
            ("cos(t)", "4*pi"),
            ("cos(t)", "6.283185307179586"),
            ("cos(w*t)", "2.5*pi"),
            ("cos(two*t + x)*x + sin(t)", "2*pi"),
            ("sin(t)^2 + tan(t) + abs(cos(t))", "pi"),
            ("cos(t/2)^2 + sin(t/2)*cos(3*t/2)", "2*pi"),
            ("tanh(1000*sin(t - x)) + exp(-500*(1 - cos(t)))", "2*pi"),
            ("max(sin(t), 0) + atan2(sin(t), cos(t)) + sign(sin(t))", "2*pi"),
            ("(1 - cos(2*pi*t))/(2 + sin(2*pi*t)) + 1e9*x", "1"),
            // No rule proves these: the cosine has the argument 2 t.
            ("cos(t)*cos(t) - cos(t)^2 + log(2 + sin(t/2)*sin(t/2))", "2*pi"),
            ("sqrt(sin(t/2)*sin(t/2)*sin(t/2)^2) - abs(sin(t/2))^2.5", "2*pi"),
            // Not finite anywhere, so that nothing is known.
            ("sqrt(-1 - x^2)*cos(0.3*t)", "2*pi"),
        ] {
            assert!(read(rate, period).is_ok(), "{rate}: {:?}", read(rate, period).err());
        }
    }

    #[test]
    fn models_without_the_period_that_they_state_are_refused_with_the_one_they_have() {
        let turn = std::f64::consts::TAU;
        for (rate, period, expected) in [
            ("cos(w*t)", "2*pi", Some(turn / 0.8)),
            ("cos(t)", "pi", Some(turn)),
            ("cos(t)", "6.28", Some(turn)),
            ("x*cos(2*t/3) + sin(t/2)", "2*pi", Some(6.0 * turn)),
            ("tan(t/2)*x^2 + 1e9*x", "pi", Some(turn)),
            ("exp(-500*(1 - cos(t/2)))", "2*pi", Some(2.0 * turn)),
            ("t - pi", "2*pi", None),
            ("cos(t*x)", "2*pi", None),
        ] {
            let problem = read(rate, period).expect_err("another period");
            let SceneProblem::Period { repeats, .. } = problem else {
                panic!("{rate}: {problem:?}");
            };
            let found = match repeats {
                Repeats::After { period, .. } => Some(period),
                _ => None,
            };
            let near = |(found, expected): (f64, f64)| (found - expected).abs() < 1e-12 * expected;
            assert!(
                found.zip(expected).map_or(found == expected, near),
                "{rate}: {found:?} for {expected:?}"
            );
        }
    }

    #[test]
    fn two_frequencies_in_an_irrational_ratio_have_no_period() {
        let problem = read("cos(t) + cos(sqrt(2)*t)", "2*pi").expect_err("quasi-periodic");
        let SceneProblem::Period { repeats: Repeats::Never { ratio, near, .. }, .. } = problem
        else {
            panic!("{problem:?}");
        };
        assert!((ratio - 2.0_f64.sqrt()).abs() < 1e-15 && near == (17, 12), "{ratio} {near:?}");
    }
}
