//! Return map of a tangency section: minima of a gap along the free flow, and the choice of the
//! next section point among them.

use super::number::Number;
use super::simulator::{Failure, Happening, Kind, MOST_EVENTS, Mode, Simulator};

/// Approach of an orbit to a stop.
#[derive(Clone, Debug)]
pub struct Approach<N> {
    /// Time of the minimum of the gap; if a contact begins before it, along the free flow without
    /// the stop.
    pub time: N,
    /// State at that minimum.
    pub state: Vec<N>,
    /// Time at which the stop was met, for a contact.
    pub met: Option<N>,
    /// Whether no other stop acts on the way to the minimum, or holds the state.
    pub is_free: bool,
}

/// Next approach of an orbit to a stop before a time, with all events on the way. A contact is the
/// last event; the orbit is then just after its beginning.
///
/// `None` if the time comes first.
pub fn next_approach<N: Number>(
    orbit: &mut Simulator<'_, N>,
    stop: usize,
    until: N,
    happened: &mut Vec<Happening<N>>,
) -> Result<Option<Approach<N>>, Failure> {
    loop {
        let before = orbit.mode;
        let Some(next) = orbit.next(until)? else { return Ok(None) };
        let approach = match next.kind {
            Kind::Minimum { .. } if next.stop == stop => Some(Approach {
                time: next.time,
                state: next.state.clone(),
                met: None,
                is_free: orbit.mode == Mode::Free,
            }),
            Kind::Impact { .. } | Kind::Begin { .. } if next.stop == stop => {
                ignoring(orbit, &next, stop, until).map(|(minimum, is_free)| Approach {
                    time: minimum.time,
                    state: minimum.state,
                    met: Some(next.time),
                    is_free: is_free && before == Mode::Free,
                })
            }
            _ => None,
        };
        happened.push(next);
        if approach.is_some() {
            return Ok(approach);
        }
        if happened.len() > MOST_EVENTS {
            return Err(Failure::TooManyEvents);
        }
    }
}

/// Minimum of the gap that an approach would have without the stop, and whether it is reached
/// freely.
fn ignoring<N: Number>(
    orbit: &Simulator<'_, N>,
    met: &Happening<N>,
    stop: usize,
    until: N,
) -> Option<(Happening<N>, bool)> {
    let mut beyond = orbit.clone();
    beyond.place(&met.state);
    beyond.time = met.time;
    beyond.ignored = Some(stop);
    let mut is_free = true;
    for _ in 0..MOST_EVENTS {
        let next = beyond.next(until).ok()??;
        if next.stop == stop && matches!(next.kind, Kind::Minimum { .. }) {
            return Some((next, is_free));
        }
        is_free &= matches!(next.kind, Kind::Minimum { .. });
    }
    None
}

/// Image of a section point.
#[derive(Clone, Debug)]
pub struct SectionReturn<N> {
    /// Next section point.
    pub state: Vec<N>,
    /// Time to that point.
    pub elapsed: N,
    /// Speeds of the contacts, in order, with their stops.
    pub speeds: Vec<(usize, N)>,
    /// Speed of the contact behind which that point lies.
    pub ahead: Option<N>,
    /// Whether that point is one of free flight.
    pub is_free: bool,
}

/// Time limit of a return: forward for an approach, and backward from a section point beyond the
/// stop.
const LONGEST: f64 = 16.5;

/// Return from a point of the tangency section of a stop: to the approach nearest in time to
/// `duration`; `None` if there is none.
pub fn tangency_return<N: Number>(
    orbit: &Simulator<'_, N>,
    stop: usize,
    state: &[N],
    duration: N,
) -> Result<Option<SectionReturn<N>>, Failure> {
    let mut orbit = orbit.clone();
    orbit.place_at_minimum(state, stop);
    let mut happened = Vec::new();
    let until = duration * N::of(LONGEST);
    if orbit.gap(stop).0.is_negative() {
        orbit.back_to_surface(stop, until)?;
        happened.push(orbit.respond(stop)?);
    }
    loop {
        let found = next_approach(&mut orbit, stop, until, &mut happened)?;
        let Some(approach) = found else { return Ok(None) };
        if !is_final(&orbit, stop, &approach, duration) {
            continue;
        }
        let met = approach.met.and_then(|_| happened.pop());
        return Ok(Some(SectionReturn {
            state: approach.state,
            elapsed: approach.time,
            speeds: speeds(&happened),
            ahead: met.and_then(|met| met.kind.speed()),
            is_free: approach.is_free,
        }));
    }
}

/// Whether no later minimum is nearer to the return's nominal time, with the stop ignored; other
/// stops act on.
fn is_final<N: Number>(
    orbit: &Simulator<'_, N>,
    stop: usize,
    approach: &Approach<N>,
    duration: N,
) -> bool {
    let early = duration - approach.time;
    if !(N::zero() - early).is_negative() {
        return true;
    }
    let mut beyond = orbit.clone();
    // NOTE: without a contact the orbit is at the minimum, and another stop may hold it.
    if approach.met.is_some() {
        beyond.place_at_minimum(&approach.state, stop);
        beyond.time = approach.time;
    }
    beyond.ignored = Some(stop);
    for _ in 0..MOST_EVENTS {
        match beyond.next(duration + early) {
            Ok(Some(next)) if next.stop == stop && matches!(next.kind, Kind::Minimum { .. }) => {
                return false;
            }
            Ok(Some(_)) => {}
            Ok(None) | Err(_) => break,
        }
    }
    true
}

/// Speeds of contacts, with their stops.
pub fn speeds<N: Number>(happened: &[Happening<N>]) -> Vec<(usize, N)> {
    happened.iter().filter_map(|event| Some((event.stop, event.kind.speed()?))).collect()
}
