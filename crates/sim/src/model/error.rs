//! Faults of a scene, and their places in its file.

use std::fmt;
use std::ops::Range;

use miette::{Diagnostic, LabeledSpan, SourceCode};
use thiserror::Error;

use super::expression::ExpressionError;
use super::fraction::in_pi;
use super::snippet::Snippet;

/// A fault of a scene, with its place in the file if there is one.
///
/// Its `Display` is one line, `file:line:column: message (label)`. As a [`miette::Diagnostic`] it
/// contains the lines of the file around the fault, cut to the width of a screen, and the labelled
/// bytes; [`headline`](SceneError::headline) is the same diagnostic under a plain message, for
/// graphical rendering.
#[derive(Clone, Debug)]
pub struct SceneError(Box<Located>);

#[derive(Clone, Debug)]
struct Located {
    problem: SceneProblem,
    file_name: String,
    place: Option<Snippet>,
}

/// A [`SceneError`] whose `Display` is the message alone.
#[derive(Clone, Debug, Error)]
#[error("{}", .0.problem())]
pub struct SceneHeadline(SceneError);

/// A fault with its bytes in the text, before the name of the file is known.
#[derive(Clone, Debug)]
pub(super) struct Fault {
    pub(super) problem: Box<SceneProblem>,
    pub(super) span: Option<Range<usize>>,
}

/// Result of reading a part of a scene.
pub(super) type Checked<T> = Result<T, Fault>;

impl Fault {
    /// A fault at `span`.
    pub(super) fn at(span: Range<usize>, problem: SceneProblem) -> Self {
        Self { problem: Box::new(problem), span: Some(span) }
    }

    /// A fault that has no place in the text.
    pub(super) fn nowhere(problem: SceneProblem) -> Self {
        Self { problem: Box::new(problem), span: None }
    }

    /// The fault with its place counted from an offset; `None` if it does not lie behind it.
    pub(super) fn behind(self, offset: usize) -> Option<Self> {
        let span = self.span.filter(|span| span.start >= offset)?;
        Some(Self { span: Some(span.start - offset..span.end - offset), ..self })
    }

    /// Error in a file of this name with this text.
    pub(super) fn in_file(self, file_name: &str, text: &str) -> SceneError {
        let place = self.span.map(|span| Snippet::new(file_name, text, span));
        SceneError(Box::new(Located {
            problem: *self.problem,
            file_name: file_name.to_owned(),
            place,
        }))
    }
}

impl SceneError {
    /// The problem, with its numbers.
    pub fn problem(&self) -> &SceneProblem {
        &self.0.problem
    }

    /// Name of the file, as it was given.
    pub fn file_name(&self) -> &str {
        &self.0.file_name
    }

    /// Line and column of the fault, both from 1, columns in characters.
    pub fn position(&self) -> Option<(usize, usize)> {
        self.0.place.as_ref().map(Snippet::position)
    }

    /// The diagnostic with the message alone as `Display`; the place is drawn below it.
    pub fn headline(self) -> SceneHeadline {
        SceneHeadline(self)
    }
}

impl fmt::Display for SceneError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}:", self.file_name())?;
        if let Some((line, column)) = self.position() {
            write!(f, "{line}:{column}:")?;
        }
        write!(f, " {}", self.0.problem)?;
        match self.0.problem.label() {
            Some(label) => write!(f, " ({label})"),
            None => Ok(()),
        }
    }
}

impl std::error::Error for SceneError {}

impl Diagnostic for SceneError {
    fn source_code(&self) -> Option<&dyn SourceCode> {
        self.0.place.as_ref().map(|place| place as &dyn SourceCode)
    }

    fn labels(&self) -> Option<Box<dyn Iterator<Item = LabeledSpan> + '_>> {
        let span = self.0.place.as_ref()?.span();
        let label = self.0.problem.label().unwrap_or_else(|| "here".to_owned());
        Some(Box::new(std::iter::once(LabeledSpan::new_with_span(Some(label), span))))
    }
}

impl Diagnostic for SceneHeadline {
    fn source_code(&self) -> Option<&dyn SourceCode> {
        self.0.source_code()
    }

    fn labels(&self) -> Option<Box<dyn Iterator<Item = LabeledSpan> + '_>> {
        self.0.labels()
    }
}

/// Problem of a scene.
#[derive(Clone, Debug, PartialEq, Error)]
#[non_exhaustive]
pub enum SceneProblem {
    /// The file could not be read.
    #[error("cannot read the scene: {reason}")]
    Unreadable {
        /// Message of the operating system.
        reason: String,
    },
    /// The catalogue has no scene of this name.
    #[error("no scene `{name}` in the catalogue{}", in_brackets(.nearest))]
    NotInCatalogue {
        /// Name asked for.
        name: String,
        /// Name of a scene that was probably meant.
        nearest: Option<String>,
    },
    /// The text is longer than any scene.
    #[error("scene of more than {limit} bytes, the most that are read")]
    TooLong {
        /// Largest number of bytes accepted.
        limit: usize,
    },
    /// The text is not TOML.
    #[error("{reason}")]
    Toml {
        /// Message of the TOML reader.
        reason: String,
    },
    /// An override whose key is not a place of the scene.
    #[error("cannot set `{key}`: `{part}` {reason}{}", in_brackets(.nearest))]
    Override {
        /// The whole key.
        key: String,
        /// The part of the key that failed.
        part: String,
        /// Reason of the failure.
        reason: OverrideReason,
        /// The nearest parameter name, if no parameter has this name.
        nearest: Option<String>,
    },
    /// A fault inside an expression.
    #[error(transparent)]
    Expression(#[from] ExpressionError),
    /// A name in an expression that must be constant.
    #[error("`{name}` cannot stand here: `{key}` is an expression of numbers alone")]
    NotConstant {
        /// The name.
        name: String,
        /// The key of the expression.
        key: String,
    },
    /// A key that the table does not have.
    #[error("unknown key `{key}` in {table}")]
    UnknownKey {
        /// The key as written.
        key: String,
        /// The table.
        table: String,
        /// The nearest known key.
        nearest: Option<String>,
    },
    /// A key that must be there.
    #[error("missing key `{key}` in {table}")]
    MissingKey {
        /// The key.
        key: String,
        /// The table.
        table: String,
    },
    /// Several surfaces in the model, and no choice of the one that grazes.
    #[error(
        "missing key `surface` in [grazing]: the surface that is grazed, one of {surfaces}; or \
         `passages`, a list of surfaces in the order in which one period grazes them"
    )]
    NoGrazedSurface {
        /// The surfaces of the model, in quotes.
        surfaces: String,
    },
    /// An orbit with hits and no graze.
    #[error(
        "`passages` names hits alone: at least one surface is grazed; its name stands alone, as in \
         `passages = [{{ hit = \"left\" }}, \"right\"]`"
    )]
    NoGrazeAmongHits,
    /// The half-period symmetry requested of an orbit that hits.
    #[error(
        "the half-period symmetry is not used for orbits with hits: leave `symmetry` out and name \
         every graze and hit of a period in `passages`"
    )]
    SymmetryWithHits,
    /// A value of the wrong kind.
    #[error("`{key}` must be {expected}, found {found}")]
    WrongType {
        /// The key.
        key: String,
        /// Kind of value expected.
        expected: &'static str,
        /// Kind of value found.
        found: &'static str,
    },
    /// A word that is not among the choices.
    #[error("`{key}` cannot be \"{found}\"")]
    UnknownWord {
        /// The key.
        key: String,
        /// The word as written.
        found: String,
        /// The accepted choices.
        choices: &'static str,
        /// The nearest choice.
        nearest: Option<String>,
    },
    /// A text that is not a name.
    #[error("`{name}` is not a name")]
    NotAName {
        /// The text as written, escaped.
        name: String,
    },
    /// A name that belongs to the expression language.
    #[error("`{name}` is a word of the expression language and cannot name a {kind}")]
    Reserved {
        /// The name.
        name: String,
        /// Kind of thing to be named.
        kind: &'static str,
    },
    /// A keyword of Rust, which emitted code cannot use as a name.
    #[error("`{name}` is a word of Rust and cannot name a {kind}: names stand in emitted code")]
    RustWord {
        /// The name.
        name: String,
        /// Kind of thing to be named.
        kind: &'static str,
    },
    /// One name for two things of the same kind.
    #[error("two of the {kind}s are named `{name}`")]
    SameName {
        /// The name.
        name: String,
        /// Kind of both things.
        kind: &'static str,
    },
    /// One name for two things.
    #[error("`{name}` names both a {first} and a {second}")]
    DuplicateName {
        /// The name.
        name: String,
        /// Kind of the first thing of this name.
        first: &'static str,
        /// Kind of the second thing of this name.
        second: &'static str,
    },
    /// A repeated entry of a list.
    #[error("`{name}` stands twice in `{key}`")]
    Repeated {
        /// The entry.
        name: String,
        /// The list.
        key: String,
    },
    /// A name that is not known.
    #[error("unknown {kind} `{name}`")]
    UnknownName {
        /// The name as written.
        name: String,
        /// Kind of thing expected.
        kind: &'static str,
        /// The nearest known name.
        nearest: Option<String>,
    },
    /// The phase in a place for states only.
    #[error("the phase `{name}` cannot stand in {table}: its rate is `model.phase.rate`")]
    PhaseInLaw {
        /// The phase.
        name: String,
        /// The table.
        table: String,
    },
    /// A period that depends on a parameter.
    #[error("`model.phase.period` must be a number, and `{name}` is a parameter")]
    PeriodOfParameters {
        /// The parameter.
        name: String,
        /// The phase.
        phase: String,
    },
    /// A model that does not repeat after the period of its phase.
    #[error(
        "`{key}` does not repeat after the period {} of the phase: from `{phase}` = {from:.6} to \
         one period later it changes by {change:.3e}",
        in_pi(*.period)
    )]
    Period {
        /// The key of the expression.
        key: String,
        /// The phase.
        phase: String,
        /// The period that the scene states.
        period: f64,
        /// Phase at which the values differ.
        from: f64,
        /// Change of the expression from that phase to one period later.
        change: f64,
        /// Period of the oscillations in the expressions.
        repeats: Repeats,
    },
    /// A model that repeats after the period of its phase only for one value of a parameter that
    /// varies.
    #[error(
        "`{key}` repeats after the period {} of the phase `{phase}` only where `{parameter}` is \
         {value}, and `{parameter}` varies",
        in_pi(*.period)
    )]
    PeriodOfParameter {
        /// The key of the expression.
        key: String,
        /// The phase.
        phase: String,
        /// The period that the scene states.
        period: f64,
        /// The parameter.
        parameter: String,
        /// Value of the parameter in the scene.
        value: f64,
    },
    /// A state without an equation.
    #[error("no equation for state `{state}` in [model.flow]")]
    MissingFlow {
        /// The state.
        state: String,
    },
    /// Named expressions that depend on each other.
    #[error("`let` goes round in a circle: {}", .names.join(" -> "))]
    Circular {
        /// Names of the cycle; the first name is repeated at the end.
        names: Vec<String>,
    },
    /// An expression that depends on a forbidden name.
    #[error("`{key}` must not depend on `{name}`")]
    Dependence {
        /// The key.
        key: String,
        /// The name.
        name: String,
    },
    /// A list that is empty but must not be.
    #[error("`{key}` is empty")]
    Empty {
        /// The list.
        key: String,
    },
    /// A list longer than any model needs.
    #[error("`{key}` has {found} entries, at most {most} are read")]
    TooMany {
        /// The list.
        key: String,
        /// Largest number of entries accepted.
        most: usize,
        /// Entries found.
        found: usize,
    },
    /// A number that is not finite.
    #[error("`{key}` must be a finite number, found {found}")]
    NotFinite {
        /// The key.
        key: String,
        /// The number as written.
        found: String,
    },
    /// A number that is not positive but must be.
    #[error("`{key}` must be positive, found {value}")]
    NotPositive {
        /// The key.
        key: String,
        /// The number found.
        value: f64,
    },
    /// A whole number out of its range.
    #[error("`{key}` must be a whole number from {least} to {most}, found {found}")]
    Count {
        /// The key.
        key: String,
        /// The number as written.
        found: String,
        /// Smallest accepted.
        least: u64,
        /// Largest accepted.
        most: u64,
    },
    /// A range that is reversed or empty.
    #[error("`{key}` must run from a smaller to a larger offset, found {first} to {last}")]
    Range {
        /// The key.
        key: String,
        /// First value.
        first: f64,
        /// Last value.
        last: f64,
    },
    /// A logarithmic range that contains 0 or has ends of different signs.
    #[error(
        "a logarithmic scale needs both ends of `{key}` on one side of 0, found {first:e} to \
         {last:e}"
    )]
    LogarithmicRange {
        /// The key.
        key: String,
        /// First value.
        first: f64,
        /// Last value.
        last: f64,
    },
    /// A list of the wrong length.
    #[error("`{key}` must have {expected} entries, found {found}")]
    Length {
        /// The key.
        key: String,
        /// Entries it must have.
        expected: usize,
        /// Entries found.
        found: usize,
    },
    /// A chart of more cells than fit into memory.
    #[error("`{key}` asks for {found} cells, at most {most} are computed")]
    ChartCells {
        /// The key.
        key: String,
        /// Number of cells requested.
        found: u64,
        /// Largest number of cells accepted.
        most: u64,
    },
    /// A diagram with more values than fit into memory.
    #[error("`{key}` asks for {found} iterates at all points together, at most {most} are kept")]
    DiagramValues {
        /// The key.
        key: String,
        /// Number of values requested.
        found: u64,
        /// Largest number of values accepted.
        most: u64,
    },
    /// A coefficient of restitution outside `[0, 1]`.
    #[error("restitution {value} of surface `{surface}` is outside [0, 1]")]
    Restitution {
        /// The surface.
        surface: String,
        /// Coefficient of restitution: minus the normal velocity after the impact over that before.
        value: f64,
    },
    /// A surface without a response.
    #[error("surface `{surface}` must have either `impact` or `contact`")]
    Response {
        /// The surface.
        surface: String,
    },
    /// A surface with both responses.
    #[error(
        "surface `{surface}` has both `impact` and `contact`: a stop is rigid or compliant; \
         leave one of them out"
    )]
    TwoResponses {
        /// The surface.
        surface: String,
    },
    /// A reset that moves states that touch the surface with zero normal velocity.
    #[error(
        "the impact with surface `{surface}` moves `{component}` by {displacement:.3e} where a \
         state touches with zero normal velocity: an orbit that grazes would jump; expected an \
         `impact` that leaves such a state as it is"
    )]
    MovesTangentState {
        /// The surface.
        surface: String,
        /// The component that moves farthest.
        component: String,
        /// Displacement at the first state tried.
        displacement: f64,
    },
    /// A parameter that is not a variable of the map, where a variable is expected.
    #[error(
        "`{key}` names `{name}`, which the map has no variable for: add it to \
         `expansion.active`, or leave it out here"
    )]
    NotActive {
        /// The key.
        key: String,
        /// The parameter.
        name: String,
    },
    /// A release function without a contact field.
    #[error("`release` of surface `{surface}` has a meaning only beside `contact`")]
    ReleaseWithoutContact {
        /// The surface.
        surface: String,
    },
    /// An event function that is constant along the flow.
    #[error("the event of surface `{surface}` does not depend on any state")]
    ConstantEvent {
        /// The surface.
        surface: String,
    },
    /// Two keys that exclude each other.
    #[error("`{first}` and `{second}` exclude each other")]
    Exclusive {
        /// One of the keys.
        first: &'static str,
        /// The other key.
        second: &'static str,
    },
    /// A precision to be chosen by a tolerance, without a tolerance.
    #[error(
        "`emit.precision` can be \"any\" only where `expansion.tolerance` decides between \"f32\" \
         and \"f64\""
    )]
    NeedsTolerance,
    /// A guess that lacks a component.
    #[error("`guess` has no value for `{component}`")]
    IncompleteGuess {
        /// The component.
        component: String,
    },
    /// More parameters to solve for than grazing passages.
    #[error("`solve_for` names {parameters} parameters for {passages} grazing passage(s)")]
    TooManyUnknowns {
        /// Number of parameters.
        parameters: usize,
        /// Number of passages.
        passages: usize,
    },
    /// A parameter to be solved for on which nothing depends.
    #[error("`solve_for` names `{name}`, and nothing in the model depends on it")]
    IdleUnknown {
        /// The parameter.
        name: String,
    },
    /// A choice of the cheapest section without a tolerance.
    #[error(
        "`kind = \"any\"` is the section with the cheapest map for a tolerance: expected \
         `tolerance` in [expansion], found orders"
    )]
    AnySectionWithoutTolerance,
    /// A feature that needs a forcing phase, in a model without one.
    #[error("{what} needs a forcing phase, and the model has no [model.phase]")]
    NeedsPhase {
        /// The feature.
        what: &'static str,
    },
}

/// Period of the oscillations in a model.
#[derive(Clone, Debug, PartialEq)]
pub enum Repeats {
    /// Common period of all oscillations.
    After {
        /// The period.
        period: f64,
        /// The parameter that multiplies the phase in each of them, if the phase is time.
        rate: Option<String>,
    },
    /// Two oscillations with frequencies in an irrational ratio.
    Never {
        /// The ratio.
        ratio: f64,
        /// Numerator and denominator of a nearby fraction.
        near: (u64, u64),
        /// Common period of two oscillations with the ratio of that fraction.
        period: f64,
    },
    /// No oscillation: the phase occurs outside of sines, cosines and tangents.
    Unknown,
}

impl Repeats {
    /// A remedy, in a few words; `phase` is the name of the phase.
    fn remedy(&self, phase: &str) -> String {
        match self {
            Self::After { period, rate: None } => {
                format!("it repeats after `period = \"{}\"`", in_pi(*period))
            }
            Self::After { period, rate: Some(rate) } => format!(
                "write `rate = \"{rate}\"` and `{phase}` in the place of `{rate}*{phase}`, or \
                 `period = \"{}\"`",
                in_pi(*period)
            ),
            Self::Never { ratio, near: (over, under), period } => format!(
                "frequencies in the ratio {ratio:.6} have no common period (quasi-periodic \
                 forcing); take a ratio of whole numbers, {over}/{under} with `period = \"{}\"` \
                 for example",
                in_pi(*period)
            ),
            Self::Unknown => {
                format!("`{phase}` repeats inside of sin, cos and tan, and not outside of them")
            }
        }
    }
}

/// The nearest known name, in parentheses.
fn in_brackets(nearest: &Option<String>) -> String {
    let meant = nearest.as_ref();
    meant.map_or(String::new(), |name| format!(" (did you mean `{name}`?)"))
}

/// Reason why an override cannot be applied.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Error)]
pub enum OverrideReason {
    /// No parameter has this name.
    #[error("is not a parameter of the scene")]
    UnknownParameter,
    /// The preceding part is a value, not a table or a list.
    #[error("is not inside a table")]
    NotATable,
    /// The list has no entry of this number.
    #[error("is not an entry of the list")]
    NotAnEntry,
    /// The part is empty.
    #[error("is empty")]
    Empty,
}

impl SceneProblem {
    /// A few words at the place in the text; `None` if there is nothing to add.
    pub(super) fn label(&self) -> Option<String> {
        let meant = |nearest: &Option<String>| {
            nearest.as_ref().map(|name| format!("did you mean `{name}`?"))
        };
        match self {
            Self::Expression(error) => error.label(),
            Self::UnknownKey { nearest, .. } | Self::UnknownName { nearest, .. } => meant(nearest),
            Self::UnknownWord { nearest, choices, .. } => {
                meant(nearest).or_else(|| Some(format!("one of {choices}")))
            }
            Self::PeriodOfParameters { name, phase } => Some(format!(
                "write `rate = \"{name}\"`, `period = \"2*pi\"`, and `cos({phase})` in the place \
                 of `cos({name}*{phase})`"
            )),
            Self::Period { phase, repeats, .. } => Some(repeats.remedy(phase)),
            Self::PeriodOfParameter { phase, parameter, .. } => Some(format!(
                "write `rate = \"{parameter}\"` and `{phase}` in the place of \
                 `{parameter}*{phase}`, or leave `{parameter}` as it is"
            )),
            Self::NotAName { .. } => {
                Some("letters, digits and `_`, not first a digit, at most 64".to_owned())
            }
            _ => None,
        }
    }
}
