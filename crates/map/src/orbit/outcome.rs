//! Errors of the search for a grazing orbit, and reasons why it ends without one.

use std::fmt;

use crate::flow::FlowError;
use crate::jet::JetError;
use crate::numeric::{NumericError, Shown};

/// Reason why no grazing orbit was found.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum NotLocated {
    /// Shooting found no periodic orbit of the free flow, or none with the hits that the scene
    /// names.
    #[error(
        "no periodic orbit {} found at {parameter} = {}: {}{}",
        motion(hits),
        Shown(*value),
        unsettled(*periods, *change),
        if hits.is_empty() { "" } else { "; a `guess` starts nearer to the orbit that is meant" }
    )]
    NoPeriodicOrbit {
        /// Names of the surfaces that the orbit is to hit.
        hits: Vec<String>,
        /// Name of the adjusted parameter.
        parameter: String,
        /// Value of the parameter.
        value: f64,
        /// Periods flown to settle.
        periods: usize,
        /// Change of the state over the last period; NaN if the flow left the finite numbers.
        change: f64,
    },
    /// None of the periodic orbits tried touches the surface.
    #[error(
        "{} over {tried} orbits, for {parameter} from {} to {}, its closest approach was h = \
         {clearance:.6e}, at {parameter} = {}; where several orbits coexist, another value of \
         {parameter} in the scene or a `guess` starts from another one",
        untouched(surface, *clearance),
        Shown(range[0]),
        Shown(range[1]),
        Shown(*value)
    )]
    NeverTouches {
        /// Name of the surface.
        surface: String,
        /// Name of the adjusted parameter.
        parameter: String,
        /// Value of the parameter at the closest approach.
        value: f64,
        /// Lowest value of the event function at the closest approach, signed.
        clearance: f64,
        /// Number of orbits tried.
        tried: usize,
        /// Least and largest value of the parameter.
        range: [f64; 2],
    },
    /// The adjusted parameter does not change the distance of the orbit from the surface.
    #[error(
        "`solve_for = \"{parameter}\"` moves neither the orbit nor `{surface}`: for {parameter} \
         from {} to {} its closest approach is h = {clearance:.6e}; name a parameter of the free \
         flow or of the surface's `event`",
        Shown(range[0]),
        Shown(range[1])
    )]
    Unmoved {
        /// Name of the surface.
        surface: String,
        /// Name of the adjusted parameter.
        parameter: String,
        /// Least and largest value of the parameter.
        range: [f64; 2],
        /// Lowest value of the event function, signed.
        clearance: f64,
    },
    /// The free flow is too slow to compute.
    #[error(
        "the search for the grazing orbit ended at the most work it may do: a period of the free \
         flow takes {} of {products} products of series each; where the steps are many, a rate or \
         a stiffness is out of proportion to the phase's rate: check their units; a `guess` nearer \
         to the grazing point shortens the search",
        TaylorSteps(*steps)
    )]
    TooSlow {
        /// Taylor steps of a period, estimated from the last flight.
        steps: u64,
        /// Products of series in a step.
        products: u64,
    },
    /// The whole orbit lies beyond a surface.
    #[error(
        "the event function of `{surface}` is positive nowhere along the orbit of the free flow at \
         {at}: its largest value is {largest:.6e}, and in free flight it is positive; if the \
         oscillator moves on this side of `{surface}`, change the sign: `event = \"-(...)\"`"
    )]
    WrongSide {
        /// Name of the surface.
        surface: String,
        /// The adjusted parameters.
        at: NamedValues,
        /// Largest value of the event function along the orbit.
        largest: f64,
    },
    /// The free flow or an event function has no Taylor series, because a function changes branch.
    #[error(
        "`{function}` in `{key}` is at its corner at {at}: there is no Taylor series there, and no \
         map; write the branch that holds along the orbit in its place, or a smooth function \
         (`sqrt(a^2 + e^2)` for `abs(a)`, `tanh(a/e)` for `sign(a)`)"
    )]
    Corner {
        /// `abs`, `sign`, `min` or `max`.
        function: &'static str,
        /// Key of the expression in the scene.
        key: String,
        /// Full state at the corner.
        at: NamedValues,
    },
    /// The free flow stops where the argument of a function is 0 that has no Taylor series there.
    #[error(
        "{} in `{key}` has the argument 0 at {at}: there is no Taylor series there, and the flow \
         stops; keep the argument away from 0, as in `sqrt(a^2 + e^2)` for `sqrt(a^2)`, or give a \
         whole exponent",
        function_words(function)
    )]
    NoSeries {
        /// `sqrt`, `log` or `^`.
        function: &'static str,
        /// Key of the expression in the scene.
        key: String,
        /// Full state there.
        at: NamedValues,
    },
    /// The orbit touches the surface without a simple minimum of the event function.
    #[error(
        "degenerate graze of `{surface}` at {at}: h'' = {normal_acceleration:.6e} (h'' T²/max h = \
         {relative:.3e}); a simple graze has h'' > 0"
    )]
    DegenerateGraze {
        /// Name of the surface.
        surface: String,
        /// The adjusted parameters.
        at: NamedValues,
        /// `h''` at the degenerate graze.
        normal_acceleration: f64,
        /// `h''` in units of the largest `h` over the squared period.
        relative: f64,
    },
    /// The orbit cannot be adjusted with these parameters at this point.
    #[error(
        "the equations of the grazing orbit are singular in {} at {at} (reciprocal condition \
         {condition:.3e}); the multiplier nearest 1 is {re:.12} {} {:.12}i",
        .at.names(),
        if *im < 0.0 { '-' } else { '+' },
        im.abs()
    )]
    Singular {
        /// The adjusted parameters.
        at: NamedValues,
        /// Reciprocal condition of the scaled Jacobian.
        condition: f64,
        /// Real part of the multiplier nearest 1.
        re: f64,
        /// Imaginary part of the multiplier nearest 1.
        im: f64,
    },
    /// Newton's method did not converge to a root.
    #[error(
        "Newton's method did not converge: residual {first:.3e} at the start, {last:.3e} after {} \
         iterations, at {at}",
        .history.len()
    )]
    NotConverged {
        /// The adjusted parameters, at the last iterate.
        at: NamedValues,
        /// First residual.
        first: f64,
        /// Last residual.
        last: f64,
        /// Residuals of all iterations.
        history: Vec<f64>,
    },
    /// The grazes found do not follow each other in the order that the scene names.
    #[error(
        "passage {passage} grazes `{surface}` {time:.6} after the first, where the order named \
         wants it between {after:.6} and {before:.6}"
    )]
    OutOfOrder {
        /// Number of the passage, from 1.
        passage: usize,
        /// Name of its surface.
        surface: String,
        /// Time of the passage since the first.
        time: f64,
        /// Time of the passage before.
        after: f64,
        /// End of the period, or of its half for a symmetric orbit.
        before: f64,
    },
    /// The orbit has no minimum of an event function at a passage that the scene names.
    #[error(
        "the orbit has no minimum of `{surface}`'s event function where passage {passage} is named"
    )]
    NoMinimum {
        /// Number of the passage, from 1.
        passage: usize,
        /// Name of its surface.
        surface: String,
    },
    /// A passage without an adjusted parameter does not touch its surface.
    #[error(
        "passage {passage} does not touch `{surface}`: h = {event:.6e} at its minimum, {time:.6} \
         after the first graze; {adjusted} of the grazes are adjusted for, this one needs a \
         further parameter in `solve_for` or a symmetry"
    )]
    DoesNotTouch {
        /// Number of the passage, from 1.
        passage: usize,
        /// Name of its surface.
        surface: String,
        /// Time of the minimum since the first graze.
        time: f64,
        /// Event function at the minimum.
        event: f64,
        /// Number of grazes with an adjusted parameter.
        adjusted: usize,
    },
    /// The orbit is a shorter orbit, traversed several times.
    #[error(
        "the orbit found repeats after {time:.6}: it is a shorter one, run {times} times, and \
         grazes `{surface}` every time; {}",
        shorter(*times, *periods)
    )]
    Repeats {
        /// Name of the first surface that the orbit grazes.
        surface: String,
        /// Time after which the orbit repeats.
        time: f64,
        /// Number of times that the shorter orbit is traversed.
        times: usize,
        /// Forcing periods requested; `None` without a forcing phase.
        periods: Option<usize>,
    },
    /// The orbit touches a surface at a passage that the scene does not name.
    #[error(
        "the orbit found touches `{surface}` once more, {time:.6} after the first graze; name \
         every passage of a period in its order, in the place of `surface`: `passages = {}`",
        listed(&passages.iter().map(|name| format!("{name:?}")).collect::<Vec<_>>())
    )]
    TouchesElsewhere {
        /// Name of the surface.
        surface: String,
        /// Time since the first graze.
        time: f64,
        /// Surfaces that the orbit touches in a period, in order.
        passages: Vec<String>,
    },
    /// The orbit of the free flow passes through a surface.
    #[error(
        "the orbit of the free flow that grazes {} at {at} passes through `{surface}` by \
         {depth:.6} at {place}: it is no orbit of the oscillator with its stops{}; if the orbit \
         meant hits `{surface}` there, name it in [grazing]: `hits = [{surface:?}]`",
        quoted(grazed),
        same_surface(surface, grazed)
    )]
    PassesThrough {
        /// Name of the surface.
        surface: String,
        /// Depth of the orbit beyond the surface, `-h`.
        depth: f64,
        /// Phase at the deepest point, or the time since the first graze in an autonomous system.
        place: NamedValues,
        /// Names of the surfaces grazed, in order.
        grazed: Vec<String>,
        /// The adjusted parameters.
        at: NamedValues,
    },
    /// The orbit hits other surfaces, or in another order, than the scene names.
    #[error(
        "the orbit found that grazes at {at} has the contacts {}, and the scene names {}; name \
         what the orbit does, `hits = [...]` for any number of hits, or a `guess` on another orbit",
        listed(found),
        listed(named)
    )]
    OtherHits {
        /// Contacts of a period in order, from the first graze, as in `passages`.
        found: Vec<String>,
        /// Contacts that the scene names.
        named: Vec<String>,
        /// The adjusted parameters.
        at: NamedValues,
    },
    /// The orbit rests against a stop at the section's phase.
    #[error(
        "the orbit rests against `{surface}` at the section's phase, and no neighbour of its \
         section point does: choose another `section.phase`"
    )]
    SectionInContact {
        /// Name of the surface.
        surface: String,
    },
    /// The mirror image of a graze is not a graze.
    #[error(
        "passage {passage} is to mirror passage {of}, and at the mirrored state `{surface}` has h \
         = {event:.6e}, h' = {velocity:.6e}"
    )]
    NotMirrored {
        /// Number of the passage, from 1.
        passage: usize,
        /// Name of its surface.
        surface: String,
        /// Number of the passage that it mirrors.
        of: usize,
        /// `h` at the mirrored state.
        event: f64,
        /// `h'` at the mirrored state.
        velocity: f64,
    },
}

/// Reason why a computation returns no value: an outcome, or an error.
#[derive(Clone, Debug, PartialEq)]
pub(super) enum Stop<E> {
    /// An outcome.
    Ended(E),
    /// An error.
    Failed(OrbitError),
}

impl<E, F: Into<OrbitError>> From<F> for Stop<E> {
    fn from(error: F) -> Self {
        Self::Failed(error.into())
    }
}

impl<E> Stop<E> {
    /// Converts the outcome.
    pub(super) fn map<T>(self, convert: impl FnOnce(E) -> T) -> Stop<T> {
        match self {
            Self::Ended(outcome) => Stop::Ended(convert(outcome)),
            Self::Failed(error) => Stop::Failed(error),
        }
    }
}

/// Separates the value of a computation, or its outcome, from an error.
pub(super) fn settled<T, E>(result: Result<T, Stop<E>>) -> Result<Result<T, E>, OrbitError> {
    match result {
        Ok(value) => Ok(Ok(value)),
        Err(Stop::Ended(outcome)) => Ok(Err(outcome)),
        Err(Stop::Failed(error)) => Err(error),
    }
}

/// Advice on finding an orbit that does not repeat.
fn shorter(times: usize, periods: Option<usize>) -> String {
    match periods {
        Some(periods) if periods.is_multiple_of(times) => format!(
            "`periods = {}` is that orbit; a `guess` leads to one that takes {periods} forcing \
             periods to return",
            periods / times
        ),
        _ => "a `guess` on the orbit leads to another one".to_owned(),
    }
}

/// Description of a closest approach, by its sign.
fn untouched(surface: &str, clearance: f64) -> String {
    match clearance < 0.0 {
        true => format!("the periodic orbit always goes beyond `{surface}`, and no graze was met:"),
        false => format!("the periodic orbit never touches `{surface}`:"),
    }
}

/// Largest number of contacts that a message lists.
const LISTED: usize = 20;

/// Contacts as a list of the scene; the first ones and their number, if they are many.
fn listed(contacts: &[String]) -> String {
    let (first, rest) = contacts.split_at(contacts.len().min(LISTED));
    let more = match rest {
        [] => String::new(),
        rest => format!(", ... ({} more)", rest.len()),
    };
    format!("[{}{more}]", first.join(", "))
}

/// Names in quotes, in order.
fn quoted(names: &[String]) -> String {
    let quoted: Vec<String> = names.iter().map(|name| format!("`{name}`")).collect();
    quoted.join(" and ")
}

/// Advice for an orbit that passes through a surface that it grazes elsewhere.
fn same_surface(surface: &str, grazed: &[String]) -> &'static str {
    match grazed.iter().any(|name| name == surface) {
        true => {
            " (it grazes at a minimum that is not the lowest; a `guess` at the lowest one leads to \
             the graze there)"
        }
        false => "",
    }
}

/// Description of a function without a Taylor series at 0.
fn function_words(function: &str) -> String {
    match function {
        "^" => "a power with an exponent that is not whole".to_owned(),
        named => format!("`{named}`"),
    }
}

/// Kind of periodic orbit that is looked for, by the surfaces that it hits.
fn motion(hits: &[String]) -> String {
    match hits {
        [] => "of the free flow".to_owned(),
        hits => format!("that hits `{}`", hits.join("`, `")),
    }
}

/// State of a motion that settled on no periodic orbit with a minimum of the gap.
fn unsettled(periods: usize, change: f64) -> String {
    if change == 0.0 {
        "the motion stays at rest there, and its gap has no minimum; a `guess` starts near \
         another orbit"
            .to_owned()
    } else if change.is_finite() {
        format!("after {periods} periods a period still moves the state by {change:.3e}")
    } else {
        format!("within {periods} periods the state leaves the finite numbers")
    }
}

/// Parameters or states with their values.
#[derive(Clone, Debug, PartialEq)]
pub struct NamedValues(pub Vec<(String, f64)>);

impl NamedValues {
    /// The names only.
    pub fn names(&self) -> String {
        let names: Vec<&str> = self.0.iter().map(|(name, _)| name.as_str()).collect();
        names.join(", ")
    }
}

impl fmt::Display for NamedValues {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        for (number, (name, value)) in self.0.iter().enumerate() {
            let comma = if number == 0 { "" } else { ", " };
            write!(formatter, "{comma}{name} = {}", Shown(*value))?;
        }
        Ok(())
    }
}

/// Wrong input to the search for a grazing orbit.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum OrbitError {
    /// The number of adjusted parameters does not fit the number of independent grazes.
    #[error(
        "one parameter is adjusted for every independent graze: `solve_for` names {named}, and \
         {most} at most are independent"
    )]
    AdjustedParameters {
        /// Number of parameters named.
        named: usize,
        /// Largest number of independent grazes: the passages, or the pairs of mirrored ones.
        most: usize,
    },
    /// A symmetric orbit has a passage without a mirror image.
    #[error(
        "with `symmetry = \"half-period\"` the second half of the passages mirrors the first; \
         {passages} cannot be halved"
    )]
    UnpairedPassages {
        /// Number of passages named.
        passages: usize,
    },
    /// A symmetric orbit has an even number of forcing periods.
    #[error(
        "no orbit of {periods} forcing periods is its own image under (x, theta) -> (-x, theta + \
         period/2): its half lasts whole periods"
    )]
    EvenPeriods {
        /// Forcing periods of the orbit.
        periods: usize,
    },
    /// The model lacks the requested symmetry.
    #[error(
        "the model lacks the half-period symmetry: at the phase {phase} the rate of `{component}` \
         is {rate:.6e}, at the mirrored state {mirrored:.6e} and not its negative"
    )]
    NotSymmetric {
        /// Name of the state component.
        component: String,
        /// Phase of the point.
        phase: f64,
        /// Rate of the component at the point.
        rate: f64,
        /// Rate of the component at the mirror image.
        mirrored: f64,
    },
    /// A stroboscopic section is requested of an autonomous system.
    #[error("a stroboscopic section needs a forcing phase; the model has none")]
    StroboscopicWithoutPhase,
    /// The phase of the section is so large that no digits are left modulo its period.
    #[error(
        "the phase of the section, {}, is too large to be taken modulo its period, {period}: give \
         one within a period",
        Shown(*phase)
    )]
    SectionPhase {
        /// Phase of the section.
        phase: f64,
        /// Period of the phase.
        period: f64,
    },
    /// No guess is given for the limit cycle of an autonomous system.
    #[error(
        "without a forcing phase the orbit is found from a `guess` of its grazing point; [grazing] \
         gives none"
    )]
    AutonomousWithoutGuess,
    /// The phase does not advance.
    #[error("the phase must advance: its rate is {}", Shown(*rate))]
    PhaseRate {
        /// The rate at the scene's parameters.
        rate: f64,
    },
    /// The guess has the wrong length.
    #[error("the guess has {found} components, the full state has {expected}")]
    GuessLength {
        /// Components expected.
        expected: usize,
        /// Number of components found.
        found: usize,
    },
    /// The second parameter of a curve is already adjusted, or does not exist.
    #[error("parameter {parameter} cannot be the second parameter of a grazing curve")]
    SecondParameter {
        /// Index of the parameter.
        parameter: usize,
    },
    /// A margin is requested in other than one or two different parameters of the model.
    #[error(
        "the smallest change that grazes is that of one or two different parameters of the scene; \
         found {found}"
    )]
    MarginParameters {
        /// Number of different parameters given.
        found: usize,
    },
    /// The scale of a parameter is not positive and finite.
    #[error("the scale of a change must be positive and finite; found {}", Shown(*scale))]
    MarginScale {
        /// Scale found.
        scale: f64,
    },
    /// A margin is requested of a scene with several independent grazes.
    #[error(
        "the smallest change that grazes is that of one independent graze; the scene adjusts \
         {found} parameters for as many"
    )]
    MarginGrazes {
        /// Number of independent grazes.
        found: usize,
    },
    /// The orbit hits without an end in sight.
    #[error(
        "surface number {surface} is hit more than {limit} times in a flight: the motion comes to \
         rest there, and such an orbit has no map"
    )]
    ManyHits {
        /// Index of the surface.
        surface: usize,
        /// Largest number of events of a flight.
        limit: usize,
    },
    /// The search exceeded its work limit.
    #[error("the search for the grazing orbit exceeded its work limit")]
    SearchTooLong,
    /// The flow could not be computed.
    #[error(transparent)]
    Flow(#[from] FlowError),
    /// First-order jets could not be set up.
    #[error(transparent)]
    Jet(#[from] JetError),
    /// The multipliers could not be computed.
    #[error(transparent)]
    Numeric(#[from] NumericError),
}

/// Estimated number of Taylor steps of a period, as text.
pub(super) struct TaylorSteps(pub(super) u64);

impl TaylorSteps {
    /// Largest estimate that is told: a flow is not followed for nearly as many steps.
    const MOST: u64 = 1_000_000_000;
}

impl std::fmt::Display for TaylorSteps {
    fn fmt(&self, formatter: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self.0 {
            steps @ ..=Self::MOST => write!(formatter, "about {steps} Taylor steps"),
            _ => write!(formatter, "more than {} Taylor steps", Self::MOST),
        }
    }
}
