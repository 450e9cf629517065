//! Records of direct simulation: returns and forcing periods, of one orbit and in lanes.

use grazemap::hybrid::{
    DirectReturn, Event, FlowMethod, HybridSystem, LaneReturns, NominalPassage, Outcome, Return,
    ReturnOutcome, ReturnSection, Simulator,
};
use grazemap::model::Model;
use grazemap::numeric::{Dd, Lanes, Real};

use super::hash::{Hash, Scatter};
use super::recorder::Page;
use super::subject::{On, SECTIONS, Subject, Subjects};

/// Number of orbits in lanes.
const LANES: usize = 8;
/// Numbers of states per section, and of those flown by Taylor's method in double-double.
const STATES: usize = 1000;
const DOUBLE_DOUBLE_TAYLOR_STATES: usize = 300;
/// Numbers of forcing periods of each of [`LANES`] orbits, and of those in double-double.
const PERIODS: usize = 200;
const DOUBLE_DOUBLE_PERIODS: usize = 20;

/// Flow methods of a model: the exact flow if it is affine, and Taylor's method.
fn ways(model: &Model) -> Vec<(&'static str, HybridSystem)> {
    let taylor = ("taylor", HybridSystem::without_exact_flow(model));
    let system = HybridSystem::new(model);
    match system.method() {
        FlowMethod::ExactAffine => vec![("exact", system), taylor],
        FlowMethod::Taylor => vec![taylor],
    }
}

/// Return map and starting point.
type Started<'a, S> = Option<(DirectReturn<'a, S>, Vec<S>)>;

/// Records returns to all sections in double precision and in double-double.
pub(super) fn returns(subjects: &Subjects, page: &mut Page) {
    for section in SECTIONS {
        let Some(subject) = subjects.on(section) else {
            page.refuse(section.name(), "no-section");
            continue;
        };
        for (way, system) in &ways(&subject.scene.model) {
            let variant = format!("{} {way}", section.name());
            let states = match system.method() {
                FlowMethod::ExactAffine => STATES,
                FlowMethod::Taylor => DOUBLE_DOUBLE_TAYLOR_STATES,
            };
            let hash = flown(about_the_graze::<f64>(subject, system, STATES));
            page.put(&format!("{variant} f64"), hash);
            let hash = flown(about_the_graze::<Dd>(subject, system, states));
            page.put(&format!("{variant} dd"), hash);
        }
    }
    for (way, model) in sticking(subjects.name) {
        for (system_way, system) in &ways(&model) {
            let variant = format!("{way} {system_way}");
            let hash = flown(about_the_stop::<f64>(&model, system, STATES));
            page.put(&format!("{variant} f64"), hash);
            let states = DOUBLE_DOUBLE_TAYLOR_STATES;
            let hash = flown(about_the_stop::<Dd>(&model, system, states));
            page.put(&format!("{variant} dd"), hash);
        }
    }
}

/// Hash of consecutive returns.
fn flown<S: Real>(started: Vec<Started<'_, S>>) -> Hash {
    let mut hash = Hash::new();
    for one in started {
        match one.map(|(mut map, start)| map.image(&start)) {
            Some(Ok(image)) => add_return(&mut hash, &image),
            Some(Err(_)) | None => hash.text("refused"),
        }
    }
    hash
}

/// Returns from states near the graze and away from it.
fn about_the_graze<'a, S: Real>(
    subject: &Subject,
    system: &'a HybridSystem,
    states: usize,
) -> Vec<Started<'a, S>> {
    let offsets = subject.offsets::<S>(&subject.scene.identifier, states);
    let offsets = offsets.iter();
    offsets.map(|[offsets, own]| return_map(subject, system, [offsets, own])).collect()
}

/// Linear oscillators with a stop that absorbs most of the speed, so that orbits chatter, stick and
/// detach; empty for other scenes.
fn sticking(name: &str) -> Vec<(&'static str, Model)> {
    let all: [(_, &[(&str, &str)]); 2] = [
        ("slow", &[("r", "0.2"), ("omega", "0.6"), ("alpha", "0.9")]),
        ("pressed", &[("r", "0.3"), ("delta", "-1")]),
    ];
    let all = all.into_iter().filter(|_| name == "linear");
    all.filter_map(|(way, overrides)| Some((way, Subject::model(name, overrides)?))).collect()
}

/// Returns from states near the stop of the linear oscillator, to all sections in turn.
fn about_the_stop<'a, S: Real>(
    model: &Model,
    system: &'a HybridSystem,
    states: usize,
) -> Vec<Started<'a, S>> {
    let surface = 0;
    let sections = [
        ReturnSection::Tangency { surface },
        ReturnSection::GrazingPhase { surface },
        ReturnSection::OtherPhase,
    ];
    let values = |values: Vec<Dd>| values.into_iter().map(S::from_dd).collect();
    let parameters: Vec<S> = values(model.parameter_values());
    let stop = model.parameters.iter().find(|one| one.name == "delta");
    let stop = stop.map_or(1.0, |delta| delta.value.to_f64());
    let mut scatter = Scatter::of(&model.name);
    let mut start = |number: usize| {
        let section = sections[number / LANES % sections.len()];
        let map = DirectReturn::over_periods(system, &parameters, section, 1).ok()?;
        let passages =
            [0.0, 4.0].map(|time| NominalPassage { surface, time, hit: false, rests: false });
        let map = map.with_passages(&passages).ok()?;
        let [off, rate, phase] = [0.3, 0.1, 3.0].map(|size| size * scatter.next());
        // NOTE: every eighth state is on the surface.
        let off = if number.is_multiple_of(LANES) { 0.0 } else { off };
        Some((map, [stop + off, rate, phase].map(S::from_f64).to_vec()))
    };
    (0..states).map(&mut start).collect()
}

/// Return map at offsets, with their state.
fn return_map<'a, S: Real>(
    subject: &Subject,
    system: &'a HybridSystem,
    [offsets, parameters]: [&[S]; 2],
) -> Started<'a, S> {
    let mut frame = subject.frame::<S>();
    frame.place(offsets, parameters).ok()?;
    let (section, duration) = (frame.return_section(), frame.duration());
    let own = frame.parameters();
    let map = DirectReturn::new(system, own, section, duration, frame.periods()).ok()?;
    let map = map.with_passages(&frame.nominal_passages(duration)).ok()?;
    Some((map, frame.state().to_vec()))
}

fn add_return<S: Real>(hash: &mut Hash, image: &Return<S>) {
    hash.numbers(&image.state);
    hash.number(image.elapsed);
    add_speeds(hash, &image.passages);
    hash.count(image.contacts);
    hash.count(image.extra_contacts);
    image.hits.iter().for_each(|&hits| hash.count(hits));
    hash.numbers(&image.impact_speeds);
    hash.numbers(&image.near_misses);
    match &image.outcome {
        ReturnOutcome::Returned => hash.text("returned"),
        ReturnOutcome::NoReturn { time } => {
            hash.text("no return");
            hash.number(*time);
        }
        ReturnOutcome::Ambiguous { surface } => {
            hash.text("ambiguous");
            hash.count(*surface);
        }
        ReturnOutcome::Ended(outcome) => add_outcome(hash, outcome),
    }
}

fn add_speeds<S: Real>(hash: &mut Hash, speeds: &[Option<S>]) {
    for speed in speeds {
        hash.count(usize::from(speed.is_some()));
        speed.iter().for_each(|&speed| hash.number(speed));
    }
}

fn add_outcome<S: Real>(hash: &mut Hash, outcome: &Outcome<S>) {
    hash.text(&format!("{outcome:?}"));
}

fn add_event<S: Real>(hash: &mut Hash, event: &Event<S>) {
    hash.number(event.time);
    hash.count(event.surface);
    hash.text(&format!("{:?}", event.kind));
}

/// Records returns in lanes, with different parameters in each lane; on machines without wide
/// registers one by one, with the same bits.
pub(super) fn lanes(subjects: &Subjects, page: &mut Page) {
    for section in SECTIONS {
        let Some(subject) = subjects.on(section).filter(|one| one.is_for_lanes()) else {
            continue;
        };
        for (way, system) in &ways(&subject.scene.model) {
            let started = about_the_graze(subject, system, STATES);
            let variant = format!("{} {way}", section.name());
            page.put(&variant, flown_in_lanes(&started));
        }
    }
    for (way, model) in sticking(subjects.name) {
        for (system_way, system) in &ways(&model) {
            let started = about_the_stop(&model, system, STATES);
            page.put(&format!("{way} {system_way}"), flown_in_lanes(&started));
        }
    }
}

fn flown_in_lanes(started: &[Started<'_, f64>]) -> Hash {
    let mut hash = Hash::new();
    for block in started.chunks(LANES) {
        let (mut alone, starts): (Vec<_>, Vec<_>) = block.iter().flatten().cloned().unzip();
        hash.count(alone.len());
        if alone.is_empty() {
            continue;
        }
        let Some(mut lanes) = LaneReturns::<LANES>::new(alone.clone()) else {
            for (map, start) in alone.iter_mut().zip(&starts) {
                let image = map.image(start).ok();
                let image = image.filter(|image| image.outcome == ReturnOutcome::Returned);
                hash.count(usize::from(image.is_some()));
                if let Some(image) = image {
                    hash.numbers(&image.state);
                    add_speeds(&mut hash, &image.passages);
                }
            }
            continue;
        };
        let own = |lane: usize| starts.get(lane).unwrap_or(&starts[0]);
        let component = |place: usize| Lanes::from_fn(|lane| own(lane)[place]);
        let states: Vec<Lanes<LANES>> = (0..starts[0].len()).map(component).collect();
        let found = lanes.images(&states, std::array::from_fn(|lane| lane < starts.len()));
        for lane in 0..starts.len() {
            hash.count(usize::from(found.returned[lane]));
            if found.returned[lane] {
                let state: Vec<f64> = found.state.iter().map(|values| values[lane]).collect();
                let speeds: Vec<_> = found.speeds.iter().map(|speeds| speeds[lane]).collect();
                hash.numbers(&state);
                add_speeds(&mut hash, &speeds);
            }
        }
    }
    hash
}

/// Records forcing periods with all events.
pub(super) fn periods(subjects: &Subjects, page: &mut Page) {
    let Some(subject) = subjects.on(On::Tangency) else {
        return page.refuse("tangency", "no-section");
    };
    if subject.scene.model.phase.is_none() {
        return page.refuse("periods", "no-phase");
    }
    for (way, system) in &ways(&subject.scene.model) {
        let hash = alone::<f64>(orbits(subject, system), PERIODS);
        page.put(&format!("{way} f64"), hash);
        let hash = alone::<Dd>(orbits(subject, system), DOUBLE_DOUBLE_PERIODS);
        page.put(&format!("{way} dd"), hash);
    }
    for (way, model) in sticking(subjects.name) {
        for (system_way, system) in &ways(&model) {
            let variant = format!("{way} {system_way}");
            let hash = alone::<f64>(sticking_orbits(&model, system), PERIODS);
            page.put(&format!("{variant} f64"), hash);
            let hash = alone::<Dd>(sticking_orbits(&model, system), DOUBLE_DOUBLE_PERIODS);
            page.put(&format!("{variant} dd"), hash);
        }
    }
}

/// Orbits that start before the stop, with increasing force.
fn sticking_orbits<'a, S: Real>(model: &Model, system: &'a HybridSystem) -> Vec<Simulator<'a, S>> {
    let values = model.parameter_values().into_iter().map(S::from_dd);
    let mut parameters: Vec<S> = values.collect();
    let force = model.parameters.iter().position(|one| one.name == "alpha");
    let mut scatter = Scatter::of(&model.name);
    let mut orbits = Vec::new();
    for _ in 0..LANES {
        if let Some(force) = force {
            parameters[force] *= S::from_f64(1.1);
        }
        let state = [-1.5, 0.0, 0.0].map(|middle| S::from_f64(middle + 0.4 * scatter.next()));
        let Ok(mut orbit) = Simulator::new(system, &parameters) else {
            continue;
        };
        orbit.set_near_miss_limit(S::zero());
        if orbit.set_state(&state).is_ok() {
            orbits.push(orbit);
        }
    }
    orbits
}

/// Orbits near the graze, with increasing first parameter.
fn orbits<'a, S: Real>(subject: &Subject, system: &'a HybridSystem) -> Vec<Simulator<'a, S>> {
    let offsets = subject.offsets::<S>(&subject.scene.identifier, 16 * LANES);
    let mut orbits = Vec::new();
    // Every scale of offsets is used in turn, from the middle ones on.
    for (number, [offsets, own]) in offsets.iter().skip(8).step_by(17).take(LANES).enumerate() {
        let mut frame = subject.frame::<S>();
        if frame.place(offsets, own).is_err() {
            continue;
        }
        let mut parameters = frame.parameters().to_vec();
        let scaled = subject.scene.expansion.active.first().copied().unwrap_or(0);
        parameters[scaled] *= S::from_f64(1.0 + 1e-3 * number as f64);
        let Ok(mut orbit) = Simulator::new(system, &parameters) else {
            continue;
        };
        orbit.set_near_miss_limit(S::zero());
        if orbit.set_state(frame.state()).is_ok() {
            orbits.push(orbit);
        }
    }
    orbits
}

/// Periods of each orbit alone, in the order in which lanes would return them.
fn alone<S: Real>(mut orbits: Vec<Simulator<'_, S>>, periods: usize) -> Hash {
    let mut hash = Hash::new();
    for _ in 0..periods {
        for orbit in &mut orbits {
            let Ok(period) = orbit.forcing_period() else {
                hash.text("refused");
                continue;
            };
            let mut events = Vec::new();
            let outcome = orbit.advance_period(period, &mut |event| events.push(event));
            add_period(&mut hash, &events, outcome.ok().as_ref(), orbit.state());
        }
    }
    hash
}

fn add_period<S: Real>(
    hash: &mut Hash,
    events: &[Event<S>],
    outcome: Option<&Outcome<S>>,
    state: &[S],
) {
    hash.count(events.len());
    events.iter().for_each(|event| add_event(hash, event));
    match outcome {
        Some(outcome) => add_outcome(hash, outcome),
        None => hash.text("refused"),
    }
    hash.numbers(state);
}
