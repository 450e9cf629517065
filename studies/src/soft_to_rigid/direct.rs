//! Discontinuity mapping at zero net time by direct simulation in double-double, without expansion.

use grazemap::flow::{Field, Integrator};
use grazemap::hybrid::{Event, EventKind, HybridSystem, Simulator};
use grazemap::model::Scene;
use grazemap::numeric::Dd;
use grazemap::orbit::GrazingOrbit;

/// Time by which the simulation begins before the lowest point of the free flight, in units of the
/// time from the stop to that point.
const HEAD_START: f64 = 3.0;
/// Time by which the simulation continues after a rigid impact, in the same units.
const AFTERMATH: f64 = 0.1;

/// Stop of a linear oscillator with states `(w, v)` and its grazing orbit, lowered for simulation.
#[derive(Debug)]
pub struct DirectJump {
    system: HybridSystem,
    free: Field,
    parameters: Vec<Dd>,
    graze: Vec<Dd>,
    acceleration: Dd,
}

/// Effect of a contact on a free motion with the minimum `h = −y²`.
#[derive(Clone, Debug)]
pub struct Jump {
    /// Change `D(x) − x`, of `w` and of `v`.
    pub change: [Dd; 2],
    /// Time of the entry relative to the minimum of the free motion: negative.
    pub entry: Dd,
    /// Full state at the entry, on the free flow.
    pub entry_state: Vec<Dd>,
    /// Contact time; 0 for an impact.
    pub contact_time: Dd,
}

impl DirectJump {
    /// Lowers the scene of a grazing orbit.
    pub fn new(scene: &Scene, orbit: &GrazingOrbit) -> Self {
        Self {
            system: HybridSystem::new(&scene.model),
            free: Field::free(&scene.model, &[]),
            parameters: orbit.parameters().to_vec(),
            graze: orbit.grazing_point().state.clone(),
            acceleration: orbit.grazing_point().normal_acceleration,
        }
    }

    /// Jump from `w = y²`, `v = 0` at the grazing phase, after zero net time; only the first
    /// contact counts.
    pub fn at(&self, y: Dd) -> Jump {
        let mut state = self.graze.clone();
        (state[0], state[1]) = (y * y, Dd::ZERO);
        let fall = (Dd::from(2.0) / self.acceleration).sqrt() * y;
        let head_start = fall * Dd::from(HEAD_START);
        let start = self.flown(&state, -head_start);
        let (met, left) = self.contact(&start, head_start * Dd::from(2.0));
        let impact = met == left;
        let end = if impact { left + fall * Dd::from(AFTERMATH) } else { left };
        let mut simulator = self.simulator(&start);
        simulator.run(end).expect("a finite duration");
        let image = self.flown(simulator.state(), head_start - end);
        Jump {
            change: [image[0] - state[0], image[1] - state[1]],
            entry: met - head_start,
            entry_state: self.flown(&state, met - head_start),
            contact_time: left - met,
        }
    }

    /// Times of the start and end of the first contact.
    fn contact(&self, start: &[Dd], duration: Dd) -> (Dd, Dd) {
        let events = self.simulator(start).run(duration);
        let events = events.expect("a finite duration").events;
        let first = |kind: fn(&EventKind<Dd>) -> bool| {
            let of = |event: &&Event<Dd>| kind(&event.kind);
            events.iter().find(of).map(|event| event.time)
        };
        let impact = first(|kind| matches!(kind, EventKind::Impact { .. }));
        let begin = first(|kind| matches!(kind, EventKind::ContactBegin { .. }));
        // NOTE: a stiff contact that begins within rounding of the surface may end at once, still
        // moving inward, and begin again.
        let outward = |kind: &EventKind<Dd>| matches!(kind, EventKind::ContactEnd { speed } if *speed > Dd::ZERO);
        let end = first(outward);
        match (impact, begin, end) {
            (Some(time), _, _) => (time, time),
            (None, Some(begin), Some(end)) => (begin, end),
            _ => panic!("the stop is met and left: {events:?}"),
        }
    }

    fn simulator(&self, start: &[Dd]) -> Simulator<'_, Dd> {
        let mut simulator = Simulator::new(&self.system, &self.parameters).expect("parameters");
        simulator.set_near_miss_limit(Dd::ZERO);
        simulator.set_state(start).expect("a finite state");
        simulator
    }

    fn flown(&self, state: &[Dd], time: Dd) -> Vec<Dd> {
        Integrator::new(&self.free).flow(state, &self.parameters, time).expect("a linear field")
    }
}
