//! Points of a tangency section: minima of a gap along the free flow, as an orbit makes them.

use super::number::Number;
use super::simulator::{Failure, Happening, Kind, Mode, Simulator};

/// One approach of an orbit to a stop.
#[derive(Clone, Debug)]
pub(crate) struct Approach<N> {
    /// When the gap has its minimum, and the state there, along the free flow where a contact
    /// begins before.
    pub(crate) time: N,
    pub(crate) state: Vec<N>,
    pub(crate) gap: N,
    /// Contacts of the orbit before it, with any stop, this one left out.
    pub(crate) contacts: usize,
    /// When the stop was met, for a contact.
    pub(crate) met: Option<N>,
    /// Whether nothing happens on the way from there to the minimum, and nothing holds the state.
    pub(crate) is_free: bool,
}

/// The approaches to a stop of an orbit that goes on for a time, with all that happens.
pub(crate) fn approaches<N: Number>(
    orbit: &mut Simulator<'_, N>,
    stop: usize,
    time: N,
    reach: N,
) -> Result<(Vec<Approach<N>>, Vec<Happening<N>>), Failure> {
    let until = orbit.time + time;
    let (mut found, mut happened) = (Vec::new(), Vec::new());
    let mut contacts = 0;
    loop {
        let before = orbit.mode;
        let Some(next) = orbit.next(until)? else { return Ok((found, happened)) };
        if next.stop == stop {
            match next.kind {
                Kind::Minimum { gap } => found.push(Approach {
                    time: next.time,
                    state: next.state.clone(),
                    gap,
                    contacts,
                    met: None,
                    is_free: orbit.mode == Mode::Free,
                }),
                Kind::Impact { .. } | Kind::Begin { .. } => {
                    let through = before == Mode::Free;
                    found.extend(ignoring(orbit, &next, stop, reach).map(|(minimum, is_free)| {
                        let Kind::Minimum { gap } = minimum.kind else {
                            unreachable!("a minimum was asked for")
                        };
                        Approach {
                            time: minimum.time,
                            state: minimum.state,
                            gap,
                            contacts,
                            met: Some(next.time),
                            is_free: is_free && through,
                        }
                    }));
                }
                _ => {}
            }
        }
        contacts += usize::from(next.kind.speed().is_some());
        happened.push(next);
    }
}

/// The minimum of the gap that an approach would have if the stop were not there, and whether it
/// is reached freely.
fn ignoring<N: Number>(
    orbit: &Simulator<'_, N>,
    met: &Happening<N>,
    stop: usize,
    reach: N,
) -> Option<(Happening<N>, bool)> {
    let mut beyond = orbit.clone();
    beyond.place(&met.state);
    beyond.time = met.time;
    beyond.ignored = Some(stop);
    let mut is_free = true;
    loop {
        let next = beyond.next(met.time + reach).ok()??;
        if next.stop == stop && matches!(next.kind, Kind::Minimum { .. }) {
            return Some((next, is_free));
        }
        is_free &= matches!(next.kind, Kind::Minimum { .. });
    }
}
