//! Flights through impacts against the general way, stop by stop.

use crate::hybrid::simulator::{Approach, Simulator, Stop};
use crate::hybrid::system::HybridSystem;
use crate::hybrid::trajectory::{Event, Outcome};
use crate::model::{Scene, catalogue};
use crate::numeric::{Dd, Real};

/// Flies to a time from stop to stop.
fn advance_by_stops<S: Real>(
    simulator: &mut Simulator<'_, S>,
    horizon: S,
    record: &mut dyn FnMut(Event<S>),
) -> Result<(), Outcome<S>> {
    simulator.check_penetration(None)?;
    loop {
        match simulator.next_stop(horizon, Approach::default(), record)? {
            Stop::Horizon => return Ok(()),
            Stop::Contact { surface } => simulator.respond(surface, record)?,
            Stop::Minimum { .. } | Stop::Release => {}
        }
    }
}

/// Flights of a scene both ways, and in how many of them no leap was left to the general way.
fn agree<S: Real>(name: &str, periods: usize) -> (usize, usize) {
    let text = catalogue::text(name).expect("in the catalogue");
    let scene = Scene::parse(text, name).expect("a good scene");
    let system = HybridSystem::new(&scene.model);
    let parameters = scene.model.parameter_values().into_iter().map(S::from_dd);
    let parameters: Vec<S> = parameters.collect();
    let mut one = Simulator::new(&system, &parameters).expect("finite parameters");
    one.set_near_miss_limit(S::zero());
    let period = one.forcing_period().expect("a phase");
    let (mut flights, mut whole) = (0, 0);
    for start in 0..8 {
        let state: Vec<S> = (0..system.dimension())
            .map(|place| ((start * 7 + place * 3) as f64 * 0.618).fract())
            .map(|share| S::from_f64(0.4 * (share - 0.8)))
            .collect();
        one.set_state(&state).expect("a finite state");
        let mut other = one.clone();
        for _ in 0..periods {
            let horizon = one.motion.time + period;
            let (mut events, mut expected) = (Vec::new(), Vec::new());
            let way = one.fly_through_impacts(horizon, &mut |event| events.push(event));
            let rest = one.advance_to(horizon, &mut |event| events.push(event));
            let record = &mut |event| expected.push(event);
            let all = advance_by_stops(&mut other, horizon, record);
            assert_eq!(rest, all, "{name} {state:?}");
            assert_eq!(events, expected, "{name} {state:?}");
            assert_eq!(one.motion.state, other.motion.state, "{name} {state:?}");
            assert_eq!(one.motion.time, other.motion.time);
            assert_eq!(one.motion.turns, other.motion.turns);
            assert_eq!(one.motion.leaving, other.motion.leaving);
            if rest.is_err() {
                break;
            }
            flights += 1;
            whole += usize::from(way == Some(Stop::Horizon));
        }
    }
    (flights, whole)
}

#[test]
fn flights_through_impacts_are_those_from_stop_to_stop_to_the_last_bit() {
    for (name, least) in [
        ("linear", 0.9),
        ("linear_codim2", 0.7),
        ("foale", 0.9),
        ("impact_pair", 0.0),
        ("moving_stop", 0.0),
    ] {
        let (flights, whole) = agree::<f64>(name, 60);
        println!("{name}: {whole} of {flights} periods in one kernel");
        let is_most = whole as f64 >= least * flights as f64;
        assert!(flights > 300 && is_most, "{name}: {whole} of {flights}");
        agree::<Dd>(name, 4);
    }
}
