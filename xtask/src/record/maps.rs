//! Records of grazing orbits, expansions, images by map, diagrams, charts and emitted text.

use grazemap::analysis::chart::{Chart, chart};
use grazemap::analysis::diagram::{Diagram, diagram};
use grazemap::analysis::{MapEvaluation, NoProgress};
use grazemap::emission::{EmitOptions, EmittedCrate, EmittedShape, Target, emitted_module};
use grazemap::expansion::{
    ComposedMap, Contact, DepthPolynomial, Expander, Leg, Legs, LocalMap, MapOrders, Stage,
};
use grazemap::iteration::{
    DiscreteMap, HornerMap, InterpretedMap, MapOrbit, OrbitRequest, StepInfo,
};
use grazemap::jet::Jet;
use grazemap::model::{
    ChartRequest, DiagramRequest, Method, Observable, Spacing, Starts, SweepDirection,
};
use grazemap::numeric::{Dd, FloatFormat, Real};

use super::hash::Hash;
use super::recorder::Page;
use super::subject::{On, SECTIONS, Subject, Subjects};

/// Orders of maps whose images are computed and whose source code is emitted.
const ORDERS: MapOrders = MapOrders { smooth_order: 3, contact_weight: 4 };
/// Orders of maps in few variables, whose coefficients are recorded as well.
const HIGH_ORDERS: MapOrders = MapOrders { smooth_order: 6, contact_weight: 9 };
/// Largest number of variables that counts as few.
const FEW: usize = 5;
/// Number of points mapped in double precision, and in double-double.
const POINTS: usize = 600;
const DOUBLE_DOUBLE_POINTS: usize = 60;
/// Number of orbits in lanes.
const LANES: usize = 16;

/// Records the orbit and its linear part.
pub(super) fn orbits(subjects: &Subjects, page: &mut Page) {
    for section in [On::Own].into_iter().chain(SECTIONS) {
        let Some(Subject { orbit, .. }) = subjects.on(section) else {
            page.refuse(section.name(), "no-section");
            continue;
        };
        let mut hash = Hash::new();
        for passage in &orbit.passages {
            hash.count(passage.surface);
            hash.numbers(&passage.state);
            hash.numbers(&passage.parameters);
            hash.numbers(&[passage.normal_acceleration, passage.time]);
        }
        hash.number(orbit.period);
        hash.numbers(&orbit.section_point);
        orbit.monodromy.iter().for_each(|row| hash.numbers(row));
        orbit.multipliers.iter().for_each(|one| hash.numbers(one));
        hash.numbers(&orbit.xi);
        for conditions in &orbit.conditions {
            hash.numbers(&conditions.values);
        }
        hash.numbers(&Vec::from_iter(orbit.clearance));
        page.put(section.name(), hash);
    }
}

fn add_jet<S: Real>(hash: &mut Hash, jet: &Jet<S>) {
    hash.numbers(jet.coefficients());
}

fn of_leg<S: Real>(hash: &mut Hash, leg: &Leg<S>) {
    leg.image.iter().for_each(|jet| add_jet(hash, jet));
}

fn of_legs<S: Real>(legs: &Legs<S>) -> Hash {
    let mut hash = Hash::new();
    let all = legs.before.iter().chain(&legs.after);
    all.for_each(|leg| of_leg(&mut hash, leg));
    hash
}

fn of_contact<S: Real>(hash: &mut Hash, contact: &Contact<S>) {
    let corrections = contact.linear.iter().chain(&contact.quadratic);
    let all = corrections.chain([&contact.depth]).chain(contact.powers.polynomials());
    all.for_each(|jet| add_jet(hash, jet));
    if let Some(form) = &contact.depth_form {
        hash.count(form.replaced);
        form.corrections.iter().for_each(|jet| add_jet(hash, jet));
    }
}

fn of_map(map: &LocalMap) -> Hash {
    let mut hash = Hash::new();
    for stage in &map.stages {
        match stage {
            Stage::Leg(leg) => of_leg(&mut hash, leg),
            Stage::Contact(contact) => of_contact(&mut hash, contact),
            Stage::Flown(flown) => flown.polynomials().for_each(|jet| add_jet(&mut hash, jet)),
        }
    }
    hash
}

fn of_composed(map: &ComposedMap) -> Hash {
    let mut hash = Hash::new();
    let mut add = |polynomial: &DepthPolynomial| {
        for term in &polynomial.terms {
            term.powers.iter().for_each(|&power| hash.count(power.into()));
            add_jet(&mut hash, &term.coefficient);
        }
    };
    map.depths.iter().chain(&map.image).for_each(&mut add);
    hash
}

/// Records the coefficients of the legs, of the contacts and of their composition.
pub(super) fn jets(subjects: &Subjects, page: &mut Page) {
    for section in SECTIONS {
        let Some(subject) = subjects.on(section) else {
            page.refuse(section.name(), "no-section");
            continue;
        };
        let name = section.name();
        let expander = match Expander::new(&subject.scene, &subject.orbit) {
            Ok(expander) => expander,
            Err(_) => {
                page.refuse(name, "no-contact-law");
                continue;
            }
        };
        let [coordinates, parameters] = subject.widths().map(|widths| widths.len());
        let orders = match coordinates + parameters {
            0..=FEW => vec![ORDERS, HIGH_ORDERS],
            _ => vec![ORDERS],
        };
        for orders in orders {
            let (smooth, weight) = (orders.smooth_order, orders.contact_weight);
            let name = format!("{name} {smooth},{weight}");
            let map = expander.expand(orders);
            page.put_or(&format!("{name} map"), map.as_ref().ok().map(of_map));
            let composed = map.ok().and_then(|map| expander.compose(&map).ok());
            page.put_or(&format!("{name} composed"), composed.as_ref().map(of_composed));
            let flown = expander.flown(orders);
            page.put_or(&format!("{name} flown"), flown.ok().as_ref().map(of_map));
            let whole = expander.smooth(smooth).ok().map(|leg| {
                let mut hash = Hash::new();
                of_leg(&mut hash, &leg);
                hash
            });
            page.put_or(&format!("{name} smooth"), whole);
        }
        let taylor = expander.legs_by_taylor::<f64>(2).ok();
        page.put_or(&format!("{name} taylor f64"), taylor.as_ref().map(of_legs));
        let taylor = expander.legs_by_taylor::<Dd>(1).ok();
        page.put_or(&format!("{name} taylor dd"), taylor.as_ref().map(of_legs));
        let contacts = (0..expander.passages())
            .map(|passage| expander.contact_in::<Dd>(passage, ORDERS.contact_weight));
        let contacts: Option<Vec<Contact<Dd>>> = contacts.collect::<Result<_, _>>().ok();
        let contacts = contacts.map(|contacts| {
            let mut hash = Hash::new();
            contacts.iter().for_each(|contact| of_contact(&mut hash, contact));
            hash
        });
        page.put_or(&format!("{name} contacts dd"), contacts);
    }
}

/// Maps of a scene on a section, by name, in every available shape.
fn maps(subject: &Subject) -> Vec<(&'static str, LocalMap, Option<ComposedMap>)> {
    let Ok(expander) = Expander::new(&subject.scene, &subject.orbit) else {
        return Vec::new();
    };
    let mut maps = Vec::new();
    if let Ok(map) = expander.expand(ORDERS) {
        let composed = expander.compose(&map).ok();
        maps.push(("series", map, composed));
    }
    if let Ok(map) = expander.flown(ORDERS) {
        maps.push(("flown", map, None));
    }
    maps
}

/// Records images by map, by every interpreter.
pub(super) fn images(subjects: &Subjects, page: &mut Page) {
    for section in SECTIONS {
        let Some(subject) = subjects.on(section) else {
            page.refuse(section.name(), "no-section");
            continue;
        };
        for (shape, map, composed) in maps(subject) {
            let name = format!("{} {shape}", section.name());
            let put = |page: &mut Page, way: &str, hash| page.put(&format!("{name} {way}"), hash);
            let horner = HornerMap::new(&map);
            put(page, "interpreted", steps(subject, &InterpretedMap::new(&map)));
            put(page, "horner", steps(subject, &horner));
            put(page, "single", steps(subject, &horner.in_single()));
            if let Some(composed) = &composed {
                let horner = HornerMap::composed(&map, composed);
                put(page, "composed", steps(subject, &horner));
            }
            put(page, "frozen", frozen_steps(subject, &horner));
            put(page, "lanes", orbits_in_lanes(subject, &horner, &map));
            put(page, "dd", evaluations(subject, &map));
        }
    }
}

fn add_info(hash: &mut Hash, info: &StepInfo) {
    info.passages.iter().for_each(|passage| hash.count(passage));
    hash.number(info.depth);
    hash.count(usize::from(info.valid));
}

/// Adds a step, a step with Jacobian, and a step with tangent vector.
fn add_steps(hash: &mut Hash, map: &dyn DiscreteMap, state: &[f64], parameters: &[f64]) {
    let dimension = state.len();
    let (mut image, mut carried) = (vec![0.0; dimension], vec![0.0; dimension]);
    let mut jacobian = vec![0.0; dimension * dimension];
    let info = map.step(state, parameters, &mut image);
    hash.numbers(&image);
    add_info(hash, &info);
    let info = map.step_jacobian(state, parameters, &mut image, &mut jacobian);
    hash.numbers(&image);
    hash.numbers(&jacobian);
    add_info(hash, &info);
    let tangent = vec![1.0; dimension];
    let ends = [&mut image[..], &mut carried[..]];
    map.step_tangent([state, &tangent], parameters, ends);
    hash.numbers(&carried);
}

fn steps(subject: &Subject, map: &dyn DiscreteMap) -> Hash {
    let mut hash = Hash::new();
    for [state, parameters] in subject.offsets::<f64>(&subject.scene.identifier, POINTS) {
        add_steps(&mut hash, map, &state, &parameters);
    }
    hash
}

/// Hash of steps of the map at fixed parameters, and of depths.
fn frozen_steps(subject: &Subject, map: &HornerMap) -> Hash {
    let mut hash = Hash::new();
    for [state, parameters] in subject.offsets::<f64>(&subject.scene.identifier, POINTS / 4) {
        add_steps(&mut hash, &map.freeze(&parameters), &state, &[]);
        hash.numbers(&map.first_depths([&state[..]], &parameters));
    }
    hash
}

fn add_orbit(hash: &mut Hash, orbit: &MapOrbit) {
    hash.count(orbit.states().len());
    orbit.states().for_each(|state| hash.numbers(state));
    orbit.steps.iter().for_each(|info| add_info(hash, info));
    hash.numbers(&orbit.last);
    hash.text(&format!("{:?} {:?}", orbit.end, orbit.period));
}

/// Hash of orbits and Lyapunov exponents in lanes, with different parameters in each.
fn orbits_in_lanes(subject: &Subject, horner: &HornerMap, map: &LocalMap) -> Hash {
    let mut hash = Hash::new();
    let offsets = subject.offsets::<f64>(&subject.scene.identifier, 10 * LANES);
    let request = OrbitRequest::new(10, 20, &map.window.state);
    for block in offsets.chunks(LANES) {
        let states: Vec<&[f64]> = block.iter().map(|[state, _]| &state[..]).collect();
        let parameters: Vec<&[f64]> = block.iter().map(|[_, own]| &own[..]).collect();
        let mut lanes = horner.freeze_lanes::<LANES>(&parameters);
        let orbits = lanes.orbits(&states, &request);
        orbits.iter().for_each(|orbit| add_orbit(&mut hash, orbit));
        for exponent in lanes.largest_lyapunov_exponents(&states, 5, 20) {
            hash.numbers(&Vec::from_iter(exponent.map(|exponent| exponent.value)));
        }
    }
    hash
}

/// Hash of images of the whole map and of its parts in double-double.
fn evaluations(subject: &Subject, map: &LocalMap) -> Hash {
    let mut hash = Hash::new();
    let ways = [
        MapEvaluation::<Dd>::new(map),
        MapEvaluation::smooth(map),
        MapEvaluation::discontinuity(map),
    ];
    let points = subject.offsets::<Dd>(&subject.scene.identifier, DOUBLE_DOUBLE_POINTS);
    for [state, parameters] in points {
        for way in &ways {
            let image = way.image(&state, &parameters);
            hash.numbers(&image.offsets);
            hash.numbers(&image.depths);
        }
    }
    hash
}

/// Records a diagram by map, a diagram by direct simulation, and a chart.
pub(super) fn sweeps(subjects: &Subjects, page: &mut Page) {
    for section in [On::Own, On::OtherPhase] {
        let Some(subject) = subjects.on(section) else {
            page.refuse(section.name(), "no-section");
            continue;
        };
        let Some((_, map, _)) = maps(subject).into_iter().next() else {
            page.refuse(section.name(), "no-map");
            continue;
        };
        let Subject { scene, orbit } = subject;
        for (way, method, points, transient) in
            [("map", Method::Map, 40, 200), ("direct", Method::Direct, 20, 20)]
        {
            let request = diagram_request(subject, method, points, transient);
            let diagram = request.map(|one| diagram(scene, orbit, &map, &one, &NoProgress));
            let diagram = diagram.and_then(Result::ok);
            let variant = format!("{} diagram {way}", section.name());
            page.put_or(&variant, diagram.as_ref().map(of_diagram));
        }
        let request = chart_request(subject);
        let chart = request.and_then(|one| chart(scene, orbit, &map, None, &one, &NoProgress).ok());
        let variant = format!("{} chart", section.name());
        page.put_or(&variant, chart.as_ref().and_then(|charts| charts.first()).map(of_chart));
    }
}

/// First diagram of the scene with fewer points, or a diagram in its first parameter.
fn diagram_request(
    subject: &Subject,
    method: Method,
    points: usize,
    transient: usize,
) -> Option<DiagramRequest> {
    let parameter = *subject.scene.expansion.active.first()?;
    let width = *subject.widths()[1].first()?;
    let own = subject.scene.diagrams.first().cloned();
    let request = own.unwrap_or(DiagramRequest {
        parameter,
        range: [-width, width],
        points,
        spacing: Spacing::Even,
        starts: Starts::Smooth,
        transient,
        keep: 8,
        observe: Observable::EventFunction,
        direction: SweepDirection::Up,
        with: Vec::new(),
    });
    Some(DiagramRequest { points, transient, keep: 8, with: vec![method], ..request })
}

fn of_diagram(diagram: &Diagram) -> Hash {
    let mut hash = Hash::new();
    hash.number(diagram.grazing_value);
    for sweep in &diagram.sweeps {
        for point in &sweep.points {
            hash.number(point.offset);
            hash.numbers(&Vec::from_iter(point.kept_values()));
            hash.numbers(&Vec::from_iter(point.lyapunov));
            hash.text(&format!("{:?} {:?}", point.period, point.end));
            add_name(&mut hash, point.orbit.as_ref());
            hash.count(point.kept_contacts as usize);
            hash.numbers(&[point.by_map, point.outside]);
        }
    }
    hash
}

fn add_name(hash: &mut Hash, name: Option<&grazemap::iteration::OrbitName>) {
    if let Some(name) = name {
        name.hits.iter().for_each(|&hits| hash.count(hits as usize));
        hash.count(name.periods);
    }
}

/// Chart of the first two parameters over the window.
fn chart_request(subject: &Subject) -> Option<ChartRequest> {
    let (active, [_, widths]) = (&subject.scene.expansion.active, subject.widths());
    let ([first, second, ..], [wide, high, ..]) = (&active[..], &widths[..]) else {
        return None;
    };
    Some(ChartRequest {
        points: [8, 6],
        every_cell: true,
        transient: 50,
        keep: 8,
        with: vec![Method::Map],
        ..ChartRequest::new([*first, *second], [[-wide, *wide], [-high, *high]])
    })
}

fn of_chart(chart: &Chart) -> Hash {
    let mut hash = Hash::new();
    for axis in &chart.axes {
        hash.number(axis.grazing_value);
        hash.numbers(&axis.offsets);
    }
    for cell in chart.cells.iter().map(|cell| &cell.attractor) {
        hash.numbers(&Vec::from_iter(cell.lyapunov));
        hash.text(&format!("{:?} {:?}", cell.period, cell.end));
        add_name(&mut hash, cell.orbit.as_ref());
        hash.count(cell.kept_contacts as usize);
        hash.numbers(&[cell.by_map, cell.outside]);
    }
    hash
}

/// Records all files of every emission.
pub(super) fn emitted(subjects: &Subjects, page: &mut Page) {
    let Some(subject) = subjects.on(On::Own) else {
        return page.refuse("own", "no-section");
    };
    let targets = [
        ("rust", Target::Rust, FloatFormat::F64),
        ("rust-single", Target::Rust, FloatFormat::F32),
        ("c", Target::C, FloatFormat::F64),
        ("c-single", Target::C, FloatFormat::F32),
        ("cuda", Target::Cuda, FloatFormat::F64),
    ];
    for (name, map, composed) in maps(subject) {
        let mut shapes = vec![(name, EmittedShape::Factored)];
        if composed.is_some() {
            shapes.push(("composed", EmittedShape::Composed));
        }
        for (shape, emitted_shape) in shapes {
            for (language, target, precision) in targets {
                let options = EmitOptions {
                    target,
                    shape: emitted_shape,
                    precision,
                    ..EmitOptions::default()
                };
                let variant = format!("{shape} {language}");
                let module = emitted_module(&map, composed.as_ref(), &options);
                let files = module.and_then(|module| EmittedCrate::standalone(&module));
                match files {
                    Ok(emitted) => {
                        for (path, content) in &emitted.files {
                            let text = String::from_utf8_lossy(content);
                            page.put(&format!("{variant} {path}"), Hash::of(&text));
                        }
                    }
                    Err(_) => page.refuse(&variant, "refused"),
                }
            }
        }
    }
}
