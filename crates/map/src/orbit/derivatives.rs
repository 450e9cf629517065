//! Derivatives of a trajectory with any hits, by the start and the parameters, of any order.
//!
//! The jets are those of a grazing orbit's legs; see docs/mathematics/hits.md. Everything is
//! computed in double-double, so that a shallow contact, whose derivatives are large, costs digits
//! that are not missed.

use std::sync::Arc;

use super::free_flow::Corners;
use super::outcome::{NotLocated, OrbitError};
use super::piecewise::{FlightPart, FlowEvent, JetsThrough, PiecewiseFlow, gap_along};
use super::section::{Geometry, rigid_stops_beyond};
use crate::flow::{
    Field, FlowError, InputKind, Program, bound_but, evaluate, local_series, products_of_jet_step,
    watched_jet_transport_taylor,
};
use crate::jet::{Jet, JetError, JetSpace};
use crate::model::{Hits, Response, Scene};
use crate::numeric::polynomial::{ExtremumKind, evaluate as evaluate_at, extrema};
use crate::numeric::{Dd, converted};

/// State of a trajectory, with its derivatives by the start and by parameters.
///
/// Variables are the components of the full state at the start, then the parameters.
#[derive(Clone, Debug)]
pub struct JetsAlong {
    /// Full state at the end; the phase is not reduced.
    pub state: Vec<Jet<Dd>>,
    /// Hits, and ends of contacts, in order of time.
    pub events: Vec<EventDerivatives>,
    /// Duration of the trajectory.
    pub duration: Dd,
}

/// An event of a trajectory with the derivatives of its time.
#[derive(Clone, Debug)]
pub struct EventDerivatives {
    /// Surface that acts (index).
    pub surface: usize,
    /// Whether the surface is met; otherwise its contact ends.
    pub meets: bool,
    /// Normal velocity `|h'|` at which it is met; 0 where its contact ends.
    pub speed: Dd,
    /// Whether the motion comes to rest against the surface from here, at once or by ever smaller
    /// rebounds, which are not listed.
    pub rests: bool,
    /// Time since the start.
    pub time: Jet<Dd>,
}

/// Reason why a trajectory has no derivatives.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum DerivativesError {
    /// The trajectory grazes.
    #[error(
        "the trajectory grazes `{surface}` at t = {time}: the gap's minimum there is {gap:e}, and \
         a derivative does not exist; near a graze it grows as the reciprocal of the depth's root"
    )]
    Grazes {
        /// Name of the surface.
        surface: String,
        /// Time since the start.
        time: f64,
        /// Gap at its minimum; negative at a contact: its depth.
        gap: f64,
    },
    /// Two surfaces act at the same instant.
    #[error(
        "`{first}` and `{second}` act at the same instant, t = {time}: which of them is first \
         depends on the start, and a derivative does not exist"
    )]
    Together {
        /// Name of a surface.
        first: String,
        /// Name of the other.
        second: String,
        /// Time since the start.
        time: f64,
    },
    /// A surface is met while a contact with another one lasts.
    #[error(
        "`{second}` is met at t = {time} while the contact with `{first}` lasts, and the model has \
         no field for both"
    )]
    HeldTwice {
        /// Name of the surface in contact.
        first: String,
        /// Name of the surface that is met.
        second: String,
        /// Time since the start.
        time: f64,
    },
    /// A contact is met whose law is no series where it begins.
    #[error(
        "`{surface}` is met at t = {time}, and its law is no power series of the state there (a \
         root, a logarithm or a real power of the penetration): derivatives are not computed \
         through such a contact; ask for a time before it"
    )]
    RoughContact {
        /// Name of the surface.
        surface: String,
        /// Time since the start.
        time: f64,
    },
    /// The motion comes to rest against a surface, or is about to at the end, by rebounds that it
    /// does not forget.
    #[error(
        "`{surface}` is hit more than {hits} times: the motion comes to rest there by ever smaller \
         rebounds, and its state remembers them"
    )]
    ComesToRest {
        /// Name of the surface.
        surface: String,
        /// Number of hits.
        hits: usize,
    },
    /// The start is beyond a rigid surface.
    #[error("the start is beyond the rigid surface `{surface}`: its gap is {gap:e}")]
    StartsBeyond {
        /// Name of the surface.
        surface: String,
        /// Gap at the start.
        gap: f64,
    },
    /// The start is at rest against a rigid surface.
    #[error(
        "the start is at rest against `{surface}`: starts beside it fall on the surface or are \
         beyond it, and a derivative does not exist; start before the hit that ends in the rest"
    )]
    StartsAtRest {
        /// Name of the surface.
        surface: String,
    },
    /// The derivatives cost more than the work limit allows.
    #[error(
        "the derivatives exceed their work limit of {limit} Taylor steps of jets of order {order} \
         in {variables} variables: the time takes {needed} steps or more; ask for a shorter time, \
         a lower order or fewer parameters"
    )]
    TooLong {
        /// Largest number of steps of jets.
        limit: usize,
        /// Number of steps, estimated from the part that was flown.
        needed: usize,
        /// Order of the jets.
        order: usize,
        /// Number of variables of the jets.
        variables: usize,
    },
    /// The field has a corner on the way.
    #[error(transparent)]
    Corner(#[from] Box<NotLocated>),
    /// The flow failed, or hits without an end.
    #[error(transparent)]
    Orbit(#[from] OrbitError),
    /// The jets do not fit in memory.
    #[error(transparent)]
    Jet(#[from] JetError),
}

impl DerivativesError {
    /// Whether the input was right, but no derivative exists.
    pub fn ended_otherwise(&self) -> bool {
        match self {
            Self::Grazes { .. } | Self::Together { .. } | Self::HeldTwice { .. } => true,
            Self::RoughContact { .. } | Self::StartsAtRest { .. } => true,
            Self::ComesToRest { .. } | Self::Corner(_) | Self::TooLong { .. } => true,
            Self::Orbit(OrbitError::Flow(_)) => true,
            Self::StartsBeyond { .. } | Self::Orbit(_) | Self::Jet(_) => false,
        }
    }
}

/// Depth, relative to the range of the gap, below which a contact or a near miss is a graze.
const GRAZING: f64 = 1e-16;
/// Depth, relative as above, that counts as a graze where series beside it are asked for: numbers
/// with 15 digits reach it.
const NEAR_GRAZING: f64 = 1e-12;
/// Longest stay beyond a surface that is passed in such a graze, as a share of the duration.
const BRIEF_GRAZE: f64 = 1e-5;
/// Events closer than this share of the duration happen together.
const TOGETHER: f64 = 1e-13;

/// Work limit, in products of coefficients in double-double: at most 2 to 3 minutes; measured.
const MOST_PRODUCTS: f64 = 2e10;
/// Steps from which the number of all is estimated, and the multiple of the limit above which the
/// estimate refuses them.
const FORETOLD: u32 = 100;
const SURELY: usize = 2;
/// Share of the work that finds the events, for progress.
const EVENTS_SHARE: f64 = 0.1;

/// State after a trajectory from a full state, with derivatives to an order by the full state at
/// the start and by the parameters `free`.
///
/// Every stop acts; the scene's grazing orbit plays no part. A duration of `None` is that of
/// `periods` forcing periods, which depends on the parameters in the phase's rate; the derivatives
/// are then those of the return.
///
/// # Errors
///
/// [`DerivativesError`] if a derivative does not exist or cannot be computed. A motion of several
/// degrees of freedom that comes to rest against a stop by rebounds is
/// [`DerivativesError::ComesToRest`]. [`DerivativesError::TooLong`] if the jets would cost more
/// than some minutes.
pub fn jets_along(
    scene: &Scene,
    start: &[Dd],
    free: &[usize],
    span: (Option<Dd>, usize),
    order: u32,
) -> Result<JetsAlong, DerivativesError> {
    watched_jets_along(scene, start, free, span, order, &|_| {})
}

/// Computes [`jets_along`], and tells the share that is done, from 0 to 1, on the way.
///
/// # Errors
///
/// As [`jets_along`].
pub fn watched_jets_along(
    scene: &Scene,
    start: &[Dd],
    free: &[usize],
    span: (Option<Dd>, usize),
    order: u32,
    watch: &dyn Fn(f64),
) -> Result<JetsAlong, DerivativesError> {
    let found = |share| watch(EVENTS_SHARE * share);
    let space = JetSpace::uniform(start.len() + free.len(), order as usize)?;
    let trajectory = Trajectory::new(scene, (start, free), span, &space, &found)?;
    let flown = |share| watch(EVENTS_SHARE + (1.0 - EVENTS_SHARE) * share);
    trajectory.jets_along(&flown)
}

/// A trajectory whose events are known.
pub(crate) struct Trajectory {
    scene: Scene,
    flow: PiecewiseFlow,
    start: Vec<Dd>,
    parameters: Vec<Dd>,
    /// Parameters that are variables of jets.
    free: Vec<usize>,
    /// Space of the jets in the start and the free parameters.
    space: Arc<JetSpace>,
    duration: Dd,
    /// Forcing periods that the duration stands for.
    periods: Option<usize>,
    events: Vec<FlowEvent<Dd>>,
    /// Number of steps flown to find the events.
    steps: usize,
    /// Graze that does not act.
    graze: Option<Turn>,
}

/// Minimum of a gap along a trajectory.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Turn {
    /// Surface (index).
    pub(crate) surface: usize,
    /// Time since the start.
    pub(crate) time: Dd,
    /// Gap; negative at a contact: its depth.
    pub(crate) gap: Dd,
    /// Surface in contact meanwhile (index).
    held: Option<usize>,
}

impl Trajectory {
    /// Finds the events of a trajectory that does not graze; `watch` is told the share that is
    /// done.
    pub(crate) fn new(
        scene: &Scene,
        of: (&[Dd], &[usize]),
        span: (Option<Dd>, usize),
        space: &Arc<JetSpace>,
        watch: &dyn Fn(f64),
    ) -> Result<Self, DerivativesError> {
        let (trajectory, grazes) = Self::flown(scene, of, span, space, (None, GRAZING), watch)?;
        match grazes.first() {
            None => Ok(trajectory),
            Some(graze) => Err(Names(scene).grazes(graze)),
        }
    }

    /// Finds the events of a trajectory that grazes once, where the surface does not act; `None` if
    /// it does not graze.
    pub(crate) fn through_graze(
        scene: &Scene,
        of: (&[Dd], &[usize]),
        span: (Option<Dd>, usize),
        space: &Arc<JetSpace>,
        watch: &dyn Fn(f64),
    ) -> Result<Option<Self>, DerivativesError> {
        let (_, grazes) = Self::flown(scene, of, span, space, (None, NEAR_GRAZING), watch)?;
        let Some(first) = grazes.first() else { return Ok(None) };
        let through = (Some(first.surface), NEAR_GRAZING);
        let (trajectory, grazes) = Self::flown(scene, of, span, space, through, watch)?;
        match grazes[..] {
            [graze] => match graze.held {
                None => Ok(Some(Self { graze: Some(graze), ..trajectory })),
                Some(held) => {
                    Err(Names(scene).held_twice(held, graze.surface, graze.time.to_f64()))
                }
            },
            [_, ref second, ..] => Err(Names(scene).grazes(second)),
            [] => Err(Names(scene).grazes(first)),
        }
    }

    /// Finds the events of a trajectory, and its grazes: minima of a gap within a share of its
    /// range. A graze of the surface `grazed` does not act.
    fn flown(
        scene: &Scene,
        (start, free): (&[Dd], &[usize]),
        span: (Option<Dd>, usize),
        space: &Arc<JetSpace>,
        (grazed, share): (Option<usize>, f64),
        watch: &dyn Fn(f64),
    ) -> Result<(Self, Vec<Turn>), DerivativesError> {
        let model = &scene.model;
        let mut scene = scene.clone();
        scene.grazing.hits = Hits { surfaces: (0..model.surfaces.len()).collect(), order: None };
        scene.grazing.passages.clear();
        let parameters = model.parameter_values();
        let nominal = |periods: usize| {
            let geometry = Geometry::new(model, 0);
            let phase = model.phase.as_ref()?;
            let (rate, _) = geometry.at(start, &parameters).clock()?;
            Some(phase.period * Dd::from(periods as f64) / rate)
        };
        let (duration, periods) = match span {
            (Some(time), _) => (Some(time), None),
            (None, periods) => (nominal(periods), Some(periods)),
        };
        let duration = duration.ok_or(OrbitError::StroboscopicWithoutPhase)?;
        let names = Names(&scene);
        names.check_start(start, &parameters)?;
        let rounded: (Vec<f64>, Vec<f64>) = (converted(start), converted(&parameters));
        if let Some(corners) = Corners::of(&scene, free)
            && let Some(corner) = corners.along(&rounded.0, &rounded.1, duration.to_f64())?
        {
            return Err(DerivativesError::Corner(Box::new(corner)));
        }
        let watched: Vec<_> = model.surfaces.iter().map(|surface| surface.event).collect();
        let mut flow = PiecewiseFlow::new(&scene, &watched, &bound_but(free, &parameters));
        if let Some(surface) = flow.rests_at(start, &parameters) {
            return Err(DerivativesError::StartsAtRest { surface: names.surface(surface) });
        }
        if let Some(surface) = grazed {
            flow.graze(surface, BRIEF_GRAZE * duration.to_f64());
        }
        let done = |time: Dd| watch((time / duration).to_f64());
        let flight = (start, &parameters[..], duration);
        let limit = WorkLimit::of(&flow, space);
        let way = names.way(&flow, flight, (grazed, share), (limit, &done))?;
        let Way { events, steps, grazes } = way;
        let trajectory = Self {
            flow,
            start: start.to_vec(),
            parameters,
            free: free.to_vec(),
            space: Arc::clone(space),
            duration,
            periods,
            events,
            steps,
            graze: None,
            scene,
        };
        Ok((trajectory, grazes))
    }

    /// Graze that does not act; `None` if the trajectory does not graze.
    pub(crate) fn graze(&self) -> Option<Turn> {
        self.graze
    }

    /// State at the start as jets.
    pub(crate) fn start_jets(&self) -> Vec<Jet<Dd>> {
        let start = self.start.iter().enumerate();
        start.map(|(at, &value)| Jet::variable(&self.space, at, value)).collect()
    }

    /// Duration of the trajectory.
    pub(crate) fn duration(&self) -> Dd {
        self.duration
    }

    /// Values of all parameters.
    pub(crate) fn parameters(&self) -> &[Dd] {
        &self.parameters
    }

    /// State at the end with its derivatives; `watch` is told the share that is done.
    pub(crate) fn jets_along(&self, watch: &dyn Fn(f64)) -> Result<JetsAlong, DerivativesError> {
        let through = self.fly(&self.start_jets(), 0, [Dd::ZERO, self.duration], watch)?;
        let events = self.events.iter().zip(through.times);
        let events = events.map(|(event, time)| EventDerivatives {
            surface: event.surface,
            meets: event.meets,
            speed: event.speed,
            rests: event.rests,
            time,
        });
        let events = events.collect();
        Ok(JetsAlong { state: through.state, events, duration: self.duration })
    }

    /// Jets of the state at a time from those at an earlier one, through the events between them;
    /// the last time may be the end. The jets' own variables begin with number `first`: the start,
    /// then the free parameters. `watch` is told the share of the time flown.
    pub(crate) fn fly(
        &self,
        jets: &[Jet<Dd>],
        first: usize,
        [from, to]: [Dd; 2],
        watch: &dyn Fn(f64),
    ) -> Result<JetsThrough<'_, Dd>, DerivativesError> {
        let space = jets[0].space();
        let parameters = self.parameter_jets(space, first);
        let limit = WorkLimit::of(&self.flow, space);
        let time = to - from;
        let share = |flown: Dd| (flown / time).to_f64();
        let steps = (self.steps as f64 * (time / self.duration).to_f64()) as usize;
        limit.check(steps)?;
        let (mut steps_left, mut flown) = (limit.steps, Dd::ZERO);
        let fly = |field: &Field, jets: &[Jet<Dd>], time| -> Result<_, OrbitError> {
            let until = flown + time;
            let watch = &mut |remaining| {
                flown = until - remaining;
                watch(share(flown));
            };
            let steps = &mut steps_left;
            Ok(watched_jet_transport_taylor(field, jets, &parameters, time, steps, watch)?)
        };
        let ends = |time| time < to || to == self.duration;
        let between = self.events.iter().filter(|event| from <= event.time && ends(event.time));
        let events: Vec<_> = between.map(|event| event.since(from)).collect();
        let through = self.flow.jets(jets, &parameters, time, &events, fly);
        let mut through = through.map_err(|error| match error {
            OrbitError::Flow(FlowError::TooManySteps { .. }) => {
                limit.exceeded((limit.steps as f64 / share(flown)).ceil() as usize)
            }
            error => error.into(),
        })?;
        if to == self.duration {
            self.reach_phase(&mut through, &parameters);
        }
        Ok(through)
    }

    /// All parameters as jets; the variables of the start and of the free parameters begin with
    /// number `first`.
    fn parameter_jets(&self, space: &Arc<JetSpace>, first: usize) -> Vec<Jet<Dd>> {
        let parameter = |(at, &value): (usize, &Dd)| match self.free.iter().position(|&of| of == at)
        {
            Some(number) => Jet::variable(space, first + self.start.len() + number, value),
            None => Jet::constant(space, value),
        };
        self.parameters.iter().enumerate().map(parameter).collect()
    }

    /// Flies on to the phase at which a number of forcing periods ends, which depends on the
    /// parameters in the phase's rate.
    fn reach_phase(&self, through: &mut JetsThrough<'_, Dd>, parameters: &[Jet<Dd>]) {
        let (Some(periods), Some(phase)) = (self.periods, &self.scene.model.phase) else { return };
        let end = &through.state;
        let space = end[0].space();
        let states = end.iter().map(|_| InputKind::Variable);
        let kinds = bound_but(&self.free, &self.parameters);
        let inputs: Vec<InputKind> = states.chain(kinds).collect();
        let rate = Program::new(&self.scene.model.graph, &[phase.rate], &inputs);
        let values: Vec<_> = end.iter().chain(parameters).cloned().collect();
        let rate = &evaluate(&rate, space, &values)[0];
        let advance = Jet::constant(space, phase.period * Dd::from(periods as f64));
        let longer = &advance / rate;
        let longer = longer.add_constant(-longer.head());
        let powers = (space.order() + 1).max(2);
        through.state = local_series(through.field, end, parameters, powers).state_at(&longer);
    }
}

/// Work limit of a trajectory, in Taylor steps of jets.
#[derive(Clone, Copy)]
struct WorkLimit {
    steps: usize,
    order: usize,
    variables: usize,
}

impl WorkLimit {
    fn of(flow: &PiecewiseFlow, space: &JetSpace) -> Self {
        let products = flow.fields().map(|field| products_of_jet_step::<Dd>(field, space));
        let steps = (MOST_PRODUCTS / products.fold(1.0, f64::max)).ceil() as usize;
        Self { steps, order: space.order(), variables: space.variables() }
    }

    fn check(&self, steps: usize) -> Result<(), DerivativesError> {
        if steps > self.steps { Err(self.exceeded(steps)) } else { Ok(()) }
    }

    fn exceeded(&self, needed: usize) -> DerivativesError {
        let Self { steps: limit, order, variables } = *self;
        DerivativesError::TooLong { limit, needed, order, variables }
    }
}

/// Events and grazes of a trajectory, and the number of steps flown.
struct Way {
    events: Vec<FlowEvent<Dd>>,
    grazes: Vec<Turn>,
    steps: usize,
}

/// Checks of a trajectory, with the names of a scene.
struct Names<'a>(&'a Scene);

impl Names<'_> {
    fn surface(&self, surface: usize) -> String {
        self.0.model.surfaces[surface].name.clone()
    }

    /// Whether an event begins a contact whose field has roots, logarithms or real powers.
    fn is_rough(&self, event: &FlowEvent<Dd>) -> bool {
        let model = &self.0.model;
        let Response::Contact { field, .. } = &model.surfaces[event.surface].response else {
            return false;
        };
        event.meets && field.iter().any(|&node| !model.graph.singular_operations(node).is_empty())
    }

    /// Refuses a start beyond a rigid surface.
    fn check_start(&self, start: &[Dd], parameters: &[Dd]) -> Result<(), DerivativesError> {
        match rigid_stops_beyond(&self.0.model, start, parameters).next() {
            None => Ok(()),
            Some((number, gap)) => Err(DerivativesError::StartsBeyond {
                surface: self.surface(number),
                gap: gap.to_f64(),
            }),
        }
    }

    /// Way of a trajectory, if no two events happen together; a graze of `grazed` does not act, and
    /// grazes lie within a share of the range of the gap. `watch` is told the time flown.
    fn way(
        &self,
        flow: &PiecewiseFlow,
        (start, parameters, duration): (&[Dd], &[Dd], Dd),
        (grazed, share): (Option<usize>, f64),
        (limit, watch): (WorkLimit, &dyn Fn(Dd)),
    ) -> Result<Way, DerivativesError> {
        let surfaces = self.0.model.surfaces.len();
        let mut largest = vec![0.0_f64; surfaces];
        let mut turns: Vec<Turn> = Vec::new();
        let mut events: Vec<FlowEvent<Dd>> = Vec::new();
        // A surface in contact, one that is met meanwhile, and the time.
        let mut both: Option<(usize, usize, f64)> = None;
        let mut steps = 0;
        let look = |passed: FlightPart<'_, '_, Dd>| -> Option<DerivativesError> {
            match passed {
                FlightPart::Step { elapsed, length, step, contact, released, .. } => {
                    watch(elapsed);
                    steps += 1;
                    // From some of the steps on, those of the whole time are known well enough.
                    if steps >= FORETOLD {
                        let all = f64::from(steps) * (duration / (elapsed + length)).to_f64();
                        let needed = all as usize;
                        if needed > SURELY * limit.steps {
                            return Some(limit.exceeded(needed));
                        }
                    }
                    for surface in (0..surfaces).filter(|&at| contact != Some(at)) {
                        let event = &gap_along(step, surface, released);
                        largest[surface] = largest[surface].max(event[0].to_f64().abs());
                        let rounding = share * largest[surface];
                        if let Some(held) = contact
                            && evaluate_at(event, length).0.to_f64() < -rounding
                        {
                            both = both.or(Some((held, surface, (elapsed + length).to_f64())));
                        }
                        let minima = extrema(event, length).into_iter();
                        let minima = minima.filter(|turn| turn.kind == ExtremumKind::Minimum);
                        turns.extend(minima.map(|turn| Turn {
                            surface,
                            time: elapsed + turn.time,
                            gap: turn.value,
                            held: contact,
                        }));
                    }
                }
                FlightPart::Event(event) => events.push(event.clone()),
                FlightPart::Again => {
                    turns.clear();
                    events.clear();
                    both = None;
                }
            }
            None
        };
        let most = flow.most_steps();
        let mut steps_left = most;
        let flown = flow.each(start, parameters, duration, &mut steps_left, look);
        let refused = flown.map_err(|error| match error {
            OrbitError::ManyHits { surface, limit } => {
                DerivativesError::ComesToRest { surface: self.surface(surface), hits: limit }
            }
            OrbitError::Flow(error) => match events.last().filter(|last| self.is_rough(last)) {
                Some(FlowEvent { surface, time, .. }) => DerivativesError::RoughContact {
                    surface: self.surface(*surface),
                    time: time.to_f64(),
                },
                None => OrbitError::Flow(error).into(),
            },
            error => error.into(),
        })?;
        if let Some(refused) = refused {
            return Err(refused);
        }
        limit.check(most - steps_left)?;
        if let Some((first, second, time)) = both {
            return Err(self.held_twice(first, second, time));
        }
        // The surface that does not act is passed no deeper than in a graze.
        let is_graze = |turn: &Turn| {
            let within = share * largest[turn.surface];
            turn.gap.to_f64().abs() <= within
                || grazed == Some(turn.surface) && turn.gap < Dd::ZERO && turn.held.is_none()
        };
        let mut grazes: Vec<Turn> = turns.into_iter().filter(is_graze).collect();
        // A contact is as deep as the free flow would go beyond the surface.
        for event in events.iter().filter(|event| event.meets) {
            let FlowEvent { surface, time, speed, .. } = *event;
            let geometry = Geometry::new(&self.0.model, surface);
            let acceleration = geometry.at(&event.state, parameters).acceleration();
            if acceleration > Dd::ZERO {
                let depth = speed * speed / (acceleration + acceleration);
                let graze = Turn { surface, time, gap: -depth, held: None };
                grazes.extend(Some(graze).filter(|_| depth.to_f64() <= share * largest[surface]));
            }
        }
        let apart = duration * Dd::from(TOGETHER);
        let together = events.windows(2).find(|pair| {
            pair[0].surface != pair[1].surface && pair[1].time - pair[0].time <= apart
        });
        match together {
            None => Ok(Way { events, grazes, steps: most - steps_left }),
            Some(pair) => Err(DerivativesError::Together {
                first: self.surface(pair[0].surface),
                second: self.surface(pair[1].surface),
                time: pair[0].time.to_f64(),
            }),
        }
    }

    fn grazes(&self, graze: &Turn) -> DerivativesError {
        let (time, gap) = (graze.time.to_f64(), graze.gap.to_f64());
        DerivativesError::Grazes { surface: self.surface(graze.surface), time, gap }
    }

    fn held_twice(&self, first: usize, second: usize, time: f64) -> DerivativesError {
        let [first, second] = [first, second].map(|surface| self.surface(surface));
        DerivativesError::HeldTwice { first, second, time }
    }
}
