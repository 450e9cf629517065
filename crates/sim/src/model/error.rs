//! Faults of a scene, and their places in its file.

use std::fmt;
use std::ops::Range;

use miette::{Diagnostic, LabeledSpan, SourceCode};
use thiserror::Error;

use super::expression::ExpressionError;
use super::fraction::in_pi;
use super::snippet::Snippet;

/// A fault of a scene, pointing into its file where it has a place there.
///
/// Its `Display` is one line, `file:line:column: message (label)`. As a [`miette::Diagnostic`] it
/// carries the lines of the file about the fault, cut to a screen, and the labelled bytes;
/// [`headline`](SceneError::headline) is the same diagnostic under a plain message, for graphical
/// rendering.
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

/// A fault with its bytes in the text, the file not yet named.
#[derive(Clone, Debug)]
pub(super) struct Fault {
    pub(super) problem: Box<SceneProblem>,
    pub(super) span: Option<Range<usize>>,
}

/// The outcome of reading a part of a scene.
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

    /// The error once the file is known.
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
    /// What is wrong.
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

    /// The same diagnostic under the message alone, the place being drawn below it.
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

/// What is wrong with a scene.
#[derive(Clone, Debug, PartialEq, Error)]
#[non_exhaustive]
pub enum SceneProblem {
    /// The file could not be read.
    #[error("cannot read the scene: {reason}")]
    Unreadable {
        /// As the system says it.
        reason: String,
    },
    /// The text is longer than any scene.
    #[error("scene of more than {limit} bytes, the most that are read")]
    TooLong {
        /// Longest accepted.
        limit: usize,
    },
    /// The text is not TOML.
    #[error("{reason}")]
    Toml {
        /// As the TOML reader says it.
        reason: String,
    },
    /// An override that names no place of the scene.
    #[error("cannot set `{key}`: `{part}` {reason}{}", in_brackets(.nearest))]
    Override {
        /// The whole key.
        key: String,
        /// The part that failed.
        part: String,
        /// Why.
        reason: OverrideReason,
        /// The nearest parameter, where none has the name.
        nearest: Option<String>,
    },
    /// A fault inside an expression.
    #[error(transparent)]
    Expression(#[from] ExpressionError),
    /// A name where only numbers may stand.
    #[error("`{name}` cannot stand here: `{key}` is an expression of numbers alone")]
    NotConstant {
        /// The name.
        name: String,
        /// The key it stands under.
        key: String,
    },
    /// A key the table does not have.
    #[error("unknown key `{key}` in {table}")]
    UnknownKey {
        /// As written.
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
    /// No surface that grazes is named, and the model has several.
    #[error(
        "missing key `surface` in [grazing]: the surface that is grazed, one of {surfaces}; or \
         `passages`, a list of surfaces in the order in which one period grazes them"
    )]
    NoGrazedSurface {
        /// The surfaces of the model, in quotes.
        surfaces: String,
    },
    /// A value of the wrong kind.
    #[error("`{key}` must be {expected}, found {found}")]
    WrongType {
        /// The key.
        key: String,
        /// What belongs there.
        expected: &'static str,
        /// The kind found.
        found: &'static str,
    },
    /// A word that is none of the choices.
    #[error("`{key}` cannot be \"{found}\"")]
    UnknownWord {
        /// The key.
        key: String,
        /// As written.
        found: String,
        /// What may stand there.
        choices: &'static str,
        /// The nearest choice.
        nearest: Option<String>,
    },
    /// Text that is no name.
    #[error("`{name}` is not a name")]
    NotAName {
        /// As written, escaped.
        name: String,
    },
    /// A name of the language.
    #[error("`{name}` is a word of the expression language and cannot name a {kind}")]
    Reserved {
        /// The name.
        name: String,
        /// What it was to name.
        kind: &'static str,
    },
    /// A word of Rust, where the emitted code could not use it.
    #[error("`{name}` is a word of Rust and cannot name a {kind}: names stand in emitted code")]
    RustWord {
        /// The name.
        name: String,
        /// What it was to name.
        kind: &'static str,
    },
    /// One name for two things of a kind.
    #[error("two of the {kind}s are named `{name}`")]
    SameName {
        /// The name.
        name: String,
        /// What both are.
        kind: &'static str,
    },
    /// One name for two things.
    #[error("`{name}` names both a {first} and a {second}")]
    DuplicateName {
        /// The name.
        name: String,
        /// What it named first.
        first: &'static str,
        /// What it names again.
        second: &'static str,
    },
    /// The same entry twice in a list.
    #[error("`{name}` stands twice in `{key}`")]
    Repeated {
        /// The entry.
        name: String,
        /// The list.
        key: String,
    },
    /// A name that should be known.
    #[error("unknown {kind} `{name}`")]
    UnknownName {
        /// As written.
        name: String,
        /// What it should be.
        kind: &'static str,
        /// The nearest known one.
        nearest: Option<String>,
    },
    /// The phase where only a state can stand.
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
        /// A phase at which the expression departs from it.
        from: f64,
        /// Change of the expression from there to one period later.
        change: f64,
        /// Period of its oscillations.
        repeats: Repeats,
    },
    /// A model that repeats after the period of its phase at one value of a parameter that varies.
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
        /// Its value in the scene.
        value: f64,
    },
    /// A state without its equation.
    #[error("no equation for state `{state}` in [model.flow]")]
    MissingFlow {
        /// The state.
        state: String,
    },
    /// Named expressions that need each other.
    #[error("`let` goes round in a circle: {}", .names.join(" -> "))]
    Circular {
        /// The circle, its first name repeated at the end.
        names: Vec<String>,
    },
    /// An expression that depends on what it must not.
    #[error("`{key}` must not depend on `{name}`")]
    Dependence {
        /// The key.
        key: String,
        /// The name.
        name: String,
    },
    /// A list that must not be empty.
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
        /// Longest accepted.
        most: usize,
        /// Entries found.
        found: usize,
    },
    /// A number that is not finite.
    #[error("`{key}` must be a finite number, found {found}")]
    NotFinite {
        /// The key.
        key: String,
        /// As written.
        found: String,
    },
    /// A number that must be positive.
    #[error("`{key}` must be positive, found {value}")]
    NotPositive {
        /// The key.
        key: String,
        /// As found.
        value: f64,
    },
    /// A whole number out of its range.
    #[error("`{key}` must be a whole number from {least} to {most}, found {found}")]
    Count {
        /// The key.
        key: String,
        /// As written.
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
        /// First.
        first: f64,
        /// Last.
        last: f64,
    },
    /// Logarithmic values on both sides of 0, or at it.
    #[error(
        "a logarithmic scale needs both ends of `{key}` on one side of 0, found {first:e} to \
         {last:e}"
    )]
    LogarithmicRange {
        /// The key.
        key: String,
        /// First.
        first: f64,
        /// Last.
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
        /// Cells asked for.
        found: u64,
        /// Most accepted.
        most: u64,
    },
    /// A diagram that keeps more values than fit into memory.
    #[error("`{key}` asks for {found} iterates at all points together, at most {most} are kept")]
    DiagramValues {
        /// The key.
        key: String,
        /// Values asked for.
        found: u64,
        /// Most accepted.
        most: u64,
    },
    /// A restitution that gains energy or passes through.
    #[error("restitution {value} of surface `{surface}` is outside [0, 1]")]
    Restitution {
        /// The surface.
        surface: String,
        /// Normal velocity after over that before, the sign changed.
        value: f64,
    },
    /// Neither of the two responses.
    #[error("surface `{surface}` must have either `impact` or `contact`")]
    Response {
        /// The surface.
        surface: String,
    },
    /// Both of the two responses.
    #[error(
        "surface `{surface}` has both `impact` and `contact`: a stop is rigid or compliant; \
         leave one of them out"
    )]
    TwoResponses {
        /// The surface.
        surface: String,
    },
    /// A reset that is not the identity where a state only touches.
    #[error(
        "the impact with surface `{surface}` moves `{component}` by {displacement:.3e} where a \
         state touches with zero normal velocity: an orbit that grazes would jump; expected an \
         `impact` that leaves such a state as it is"
    )]
    MovesTangentState {
        /// The surface.
        surface: String,
        /// The component of the state that is moved farthest.
        component: String,
        /// How far, at the first state tried.
        displacement: f64,
    },
    /// A parameter that the map does not keep, where one of its variables is expected.
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
    /// A release without a contact.
    #[error("`release` of surface `{surface}` has a meaning only beside `contact`")]
    ReleaseWithoutContact {
        /// The surface.
        surface: String,
    },
    /// An event that the flow does not change.
    #[error("the event of surface `{surface}` does not depend on any state")]
    ConstantEvent {
        /// The surface.
        surface: String,
    },
    /// Two keys that exclude each other.
    #[error("`{first}` and `{second}` exclude each other")]
    Exclusive {
        /// One.
        first: &'static str,
        /// The other.
        second: &'static str,
    },
    /// A precision that is chosen by a tolerance, and none named.
    #[error(
        "`emit.precision` can be \"any\" only where `expansion.tolerance` decides between \"f32\" \
         and \"f64\""
    )]
    NeedsTolerance,
    /// A guess that leaves a component out.
    #[error("`guess` has no value for `{component}`")]
    IncompleteGuess {
        /// The component.
        component: String,
    },
    /// More conditions than grazes.
    #[error("`solve_for` names {parameters} parameters for {passages} grazing passage(s)")]
    TooManyUnknowns {
        /// Parameters named.
        parameters: usize,
        /// Passages named.
        passages: usize,
    },
    /// A parameter to be solved for that changes nothing.
    #[error("`solve_for` names `{name}`, and nothing in the model depends on it")]
    IdleUnknown {
        /// The parameter.
        name: String,
    },
    /// The cheapest section of no tolerance.
    #[error(
        "`kind = \"any\"` is the section with the cheapest map for a tolerance: expected \
         `tolerance` in [expansion], found orders"
    )]
    AnySectionWithoutTolerance,
    /// Something that needs a forcing phase.
    #[error("{what} needs a forcing phase, and the model has no [model.phase]")]
    NeedsPhase {
        /// What needs it.
        what: &'static str,
    },
}

/// Period of the oscillations in a model.
#[derive(Clone, Debug, PartialEq)]
pub enum Repeats {
    /// All of them repeat after this.
    After {
        /// The period.
        period: f64,
        /// The parameter that multiplies the phase in each of them, where the phase is time.
        rate: Option<String>,
    },
    /// Two of them have frequencies in an irrational ratio.
    Never {
        /// The ratio.
        ratio: f64,
        /// Numerator and denominator of a fraction near it.
        near: (u64, u64),
        /// Period of two oscillations in that ratio.
        period: f64,
    },
    /// No oscillation repeats: the phase stands outside of sines, cosines and tangents.
    Unknown,
}

impl Repeats {
    /// A remedy, in a few words.
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

/// The nearest known name, in brackets.
fn in_brackets(nearest: &Option<String>) -> String {
    let meant = nearest.as_ref();
    meant.map_or(String::new(), |name| format!(" (did you mean `{name}`?)"))
}

/// Why an override cannot be applied.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Error)]
pub enum OverrideReason {
    /// No parameter has this name.
    #[error("is not a parameter of the scene")]
    UnknownParameter,
    /// The part before it is a value, not a table or a list.
    #[error("is not inside a table")]
    NotATable,
    /// A list is asked for an entry it does not have.
    #[error("is not an entry of the list")]
    NotAnEntry,
    /// An empty part.
    #[error("is empty")]
    Empty,
}

impl SceneProblem {
    /// A few words for the place in the text, where there is something to add.
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
