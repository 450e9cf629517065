//! Derivatives of a trajectory with any hits, by the start and the parameters, of any order.
//!
//! The jets are those of a grazing orbit's legs; see docs/mathematics/hits.md. Everything is
//! computed in double-double, so that a shallow contact, whose derivatives are large, costs digits
//! that are not missed.

use std::sync::Arc;

use super::free_flow::Corners;
use super::outcome::{NotLocated, OrbitError};
use super::piecewise::{FlightPart, FlowEvent, MOST_STEPS, PiecewiseFlow, gap_along};
use super::section::Geometry;
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
            Self::RoughContact { .. } => true,
            Self::ComesToRest { .. } | Self::Corner(_) | Self::TooLong { .. } => true,
            Self::Orbit(OrbitError::Flow(_)) => true,
            Self::StartsBeyond { .. } | Self::Orbit(_) | Self::Jet(_) => false,
        }
    }
}

/// Depth, relative to the range of the gap, below which a contact or a near miss is a graze.
const GRAZING: f64 = 1e-16;
/// Events closer than this share of the duration happen together.
const TOGETHER: f64 = 1e-13;

/// Work limit, in products of coefficients in double-double: at most 2 to 3 minutes; measured.
const MOST_PRODUCTS: f64 = 2e10;
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
    let duration = match span {
        (Some(time), _) => time,
        (None, periods) => nominal(periods).ok_or(OrbitError::StroboscopicWithoutPhase)?,
    };
    let names = Names(&scene);
    names.check_start(start, &parameters)?;
    let rounded: (Vec<f64>, Vec<f64>) = (converted(start), converted(&parameters));
    if let Some(corners) = Corners::of(&scene, free)
        && let Some(corner) = corners.along(&rounded.0, &rounded.1, duration.to_f64())?
    {
        return Err(DerivativesError::Corner(Box::new(corner)));
    }
    let watched: Vec<_> = model.surfaces.iter().map(|surface| surface.event).collect();
    let kinds = bound_but(free, &parameters);
    let flow = PiecewiseFlow::new(&scene, &watched, &kinds);
    let space = JetSpace::uniform(start.len() + free.len(), order as usize)?;
    let products = flow.fields().map(|field| products_of_jet_step::<Dd>(field, &space));
    let limit = (MOST_PRODUCTS / products.fold(1.0, f64::max)).ceil() as usize;
    let too_long = |needed| DerivativesError::TooLong {
        limit,
        needed,
        order: space.order(),
        variables: space.variables(),
    };
    let share = |time: Dd| (time / duration).to_f64();
    let found = |time| watch(EVENTS_SHARE * share(time));
    let (events, steps) = names.events(&flow, start, &parameters, duration, &found)?;
    if steps > limit {
        return Err(too_long(steps));
    }
    let (state, parameters) = variables(&space, start, &parameters, free);
    let (mut steps_left, mut flown) = (limit, Dd::ZERO);
    let fly = |field: &Field, jets: &[Jet<Dd>], time| -> Result<_, OrbitError> {
        let until = flown + time;
        let watch = &mut |remaining| {
            flown = until - remaining;
            watch(EVENTS_SHARE + (1.0 - EVENTS_SHARE) * share(flown));
        };
        let steps = &mut steps_left;
        Ok(watched_jet_transport_taylor(field, jets, &parameters, time, steps, watch)?)
    };
    let through = flow.jets(&state, &parameters, duration, &events, fly);
    let through = through.map_err(|error| match error {
        OrbitError::Flow(FlowError::TooManySteps { .. }) => {
            too_long((limit as f64 / share(flown)).ceil() as usize)
        }
        error => error.into(),
    })?;
    let mut end = through.state;
    if let ((None, periods), Some(phase)) = (span, &model.phase) {
        let states = end.iter().map(|_| InputKind::Variable);
        let inputs: Vec<InputKind> = states.chain(kinds).collect();
        let rate = Program::new(&model.graph, &[phase.rate], &inputs);
        let values: Vec<_> = end.iter().chain(&parameters).cloned().collect();
        let rate = &evaluate(&rate, &space, &values)[0];
        let advance = Jet::constant(&space, phase.period * Dd::from(periods as f64));
        let longer = &advance / rate;
        let longer = longer.add_constant(-longer.head());
        let powers = (space.order() + 1).max(2);
        end = local_series(through.field, &end, &parameters, powers).state_at(&longer);
    }
    let events = events.into_iter().zip(through.times);
    let events = events.map(|(event, time)| EventDerivatives {
        surface: event.surface,
        meets: event.meets,
        speed: event.speed,
        rests: event.rests,
        time,
    });
    Ok(JetsAlong { state: end, events: events.collect(), duration })
}

/// The full state and all parameters as jets; the state's components and the parameters `free` are
/// the variables.
fn variables(
    space: &Arc<JetSpace>,
    start: &[Dd],
    parameters: &[Dd],
    free: &[usize],
) -> (Vec<Jet<Dd>>, Vec<Jet<Dd>>) {
    let state = start.iter().enumerate().map(|(at, &value)| Jet::variable(space, at, value));
    let parameter = |(at, &value): (usize, &Dd)| match free.iter().position(|&of| of == at) {
        Some(number) => Jet::variable(space, start.len() + number, value),
        None => Jet::constant(space, value),
    };
    (state.collect(), parameters.iter().enumerate().map(parameter).collect())
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
        let model = &self.0.model;
        let inputs: Vec<Dd> = start.iter().chain(parameters).copied().collect();
        let mut values = Vec::new();
        model.graph.evaluate(&inputs, &mut values);
        let beyond = model.surfaces.iter().enumerate().find(|(_, surface)| {
            let rigid = matches!(surface.response, Response::Impact { .. });
            rigid && values[surface.event.index()] < Dd::ZERO
        });
        match beyond {
            None => Ok(()),
            Some((number, surface)) => Err(DerivativesError::StartsBeyond {
                surface: self.surface(number),
                gap: values[surface.event.index()].to_f64(),
            }),
        }
    }

    /// Events of a trajectory, if none is a graze and no two happen together, and the number of
    /// steps; `watch` is told the time flown.
    fn events(
        &self,
        flow: &PiecewiseFlow,
        start: &[Dd],
        parameters: &[Dd],
        duration: Dd,
        watch: &dyn Fn(Dd),
    ) -> Result<(Vec<FlowEvent<Dd>>, usize), DerivativesError> {
        let surfaces = self.0.model.surfaces.len();
        let mut largest = vec![0.0_f64; surfaces];
        // Minima of the gaps: surface, time, value.
        let mut minima: Vec<(usize, f64, f64)> = Vec::new();
        let mut events: Vec<FlowEvent<Dd>> = Vec::new();
        // A surface in contact, one that is met meanwhile, and the time.
        let mut both: Option<(usize, usize, f64)> = None;
        let look = |passed: FlightPart<'_, '_, Dd>| -> Option<()> {
            match passed {
                FlightPart::Step { elapsed, length, step, contact, released, .. } => {
                    watch(elapsed);
                    for surface in (0..surfaces).filter(|&at| contact != Some(at)) {
                        let event = &gap_along(step, surface, released);
                        largest[surface] = largest[surface].max(event[0].to_f64().abs());
                        if let Some(held) = contact
                            && evaluate_at(event, length).0 < Dd::ZERO
                        {
                            both = both.or(Some((held, surface, (elapsed + length).to_f64())));
                        }
                        let turns = extrema(event, length).into_iter();
                        let turns = turns.filter(|turn| turn.kind == ExtremumKind::Minimum);
                        minima.extend(turns.map(|turn| {
                            (surface, (elapsed + turn.time).to_f64(), turn.value.to_f64())
                        }));
                    }
                }
                FlightPart::Event(event) => events.push(event.clone()),
                FlightPart::Again => {
                    minima.clear();
                    events.clear();
                    both = None;
                }
            }
            None
        };
        let mut steps_left = MOST_STEPS;
        let flown = flow.each(start, parameters, duration, &mut steps_left, look);
        flown.map_err(|error| match error {
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
        if let Some((first, second, time)) = both {
            let [first, second] = [first, second].map(|surface| self.surface(surface));
            return Err(DerivativesError::HeldTwice { first, second, time });
        }
        // A contact is as deep as the free flow would go beyond the surface.
        for event in events.iter().filter(|event| event.meets) {
            let geometry = Geometry::new(&self.0.model, event.surface);
            let acceleration = geometry.at(&event.state, parameters).acceleration();
            if acceleration > Dd::ZERO {
                let depth = event.speed * event.speed / (acceleration + acceleration);
                minima.push((event.surface, event.time.to_f64(), -depth.to_f64()));
            }
        }
        let grazes =
            minima.iter().find(|&&(surface, _, gap)| gap.abs() <= GRAZING * largest[surface]);
        if let Some(&(surface, time, gap)) = grazes {
            return Err(DerivativesError::Grazes { surface: self.surface(surface), time, gap });
        }
        let apart = duration * Dd::from(TOGETHER);
        let together = events.windows(2).find(|pair| {
            pair[0].surface != pair[1].surface && pair[1].time - pair[0].time <= apart
        });
        match together {
            None => Ok((events, MOST_STEPS - steps_left)),
            Some(pair) => Err(DerivativesError::Together {
                first: self.surface(pair[0].surface),
                second: self.surface(pair[1].surface),
                time: pair[0].time.to_f64(),
            }),
        }
    }
}
