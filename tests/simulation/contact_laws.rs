//! Random contact laws in the simulator, compared with the independent one of
//! `xtask`.
//!
//! Elastic forces that harden, soften or saturate, rate terms, adhesion and prestress, each
//! released at the surface or at zero force. Pieces of an orbit start from the same state, so that
//! differences do not grow. The whole campaign is of `.ci/full`.

use grazemap::hybrid::{Event, EventKind, HybridSystem, Outcome, Regime, Simulator};
use grazemap::numeric::{Dd, Scalar};
use xtask::independent::{Failure, Kind, Mode, Oscillator, Simulator as Independent};

use crate::support::scenes::{NONE, parsed};
use crate::support::tiers;

/// Number of contacts compared for each law, and largest number of periods for them.
const CONTACTS: usize = 50;
const PERIODS: usize = 150;

/// Factor of contacts and periods in a whole campaign.
fn campaign() -> usize {
    tiers::count(1, 2)
}

/// Speed below which a contact is a graze to rounding, which may be met or missed.
const GRAZES: f64 = 1e-5;

/// Random numbers from 0 to 1 (SplitMix64).
struct Numbers(u64);

impl Numbers {
    fn next(&mut self) -> f64 {
        self.0 = self.0.wrapping_add(0x9E37_79B9_7F4A_7C15);
        let mut mixed = self.0;
        mixed = (mixed ^ (mixed >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
        mixed = (mixed ^ (mixed >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
        ((mixed ^ (mixed >> 31)) >> 11) as f64 / (1u64 << 53) as f64
    }

    fn between(&mut self, least: f64, most: f64) -> f64 {
        least + (most - least) * self.next()
    }

    fn one_of<'t>(&mut self, choices: &[&'t str]) -> &'t str {
        choices[(self.next() * choices.len() as f64) as usize]
    }
}

/// A scene with a random contact law.
fn scene(numbers: &mut Numbers) -> String {
    let elastic = numbers.one_of(&[
        "k*d",
        "k*d + b*k*d^3",
        "k*d/(1 + b*d)",
        "k*tanh(4*b*d)/(4*b)",
        "k*(exp(b*d) - 1)/b",
    ]);
    let rate = numbers.one_of(&["0", "0", "c*v", "c*v", "0.2*k*d*v", "c*v^3"]);
    let (offset, force) = match (numbers.next() * 4.0) as usize {
        // A pull, constant or fading, that is let go where it is overcome.
        0 => ("- p", format!("{elastic} + {rate} + p")),
        1 => ("- p*exp(-9*d)", format!("{elastic} + {rate} + p")),
        2 => ("+ p", format!("{elastic} + {rate} + p")),
        _ => ("", format!("{elastic} + {rate}")),
    };
    let release = match (numbers.next() * 4.0) as usize {
        0 => format!("release = \"{force}\"\n"),
        1 => format!("release = \"-({force})\"\n"),
        _ => String::new(),
    };
    let spring = numbers.one_of(&["x", "x + 0.1*x^3", "sin(x)"]);
    let (k, b) = (10f64.powf(numbers.between(0.5, 2.6)), numbers.between(0.1, 2.0));
    let (c, p) = (10f64.powf(numbers.between(-2.0, 0.7)), 10f64.powf(numbers.between(-2.0, -0.3)));
    let (zeta, amplitude) = (numbers.between(0.01, 0.1), numbers.between(0.5, 2.0));
    let omega = numbers.between(0.5, 2.5);
    format!(
        "[model]\nstates = [\"x\", \"v\"]\n\
         parameters = {{ k = {k}, b = {b}, c = {c}, p = {p}, zeta = {zeta}, A = {amplitude}, \
         omega = {omega} }}\n\
         let = {{ d = \"x - 0.2\" }}\n\
         [model.phase]\nname = \"theta\"\nrate = \"omega\"\nperiod = \"2*pi\"\n\
         [model.flow]\nx = \"v\"\nv = \"A*cos(theta) - 2*zeta*v - {spring}\"\n\
         [[model.surface]]\nname = \"stop\"\nevent = \"0.2 - x\"\n\
         contact = {{ v = \"free - ({elastic} + {rate} {offset})\" }}\n{release}\
         [grazing]\nsurface = \"stop\"\nsolve_for = \"A\"\n"
    )
}

/// Counts over all laws.
#[derive(Debug, Default)]
struct Tally {
    contacts: usize,
    /// Number of pieces that were not compared because of a graze to rounding.
    grazes: usize,
    /// Laws whose bounces do not end, or that end early in both simulators.
    ended: Vec<String>,
    /// Differences, as text.
    wrong: Vec<String>,
}

/// Beginning (`true`) or end of a contact: time, and speed of the gap.
type Change = (bool, f64, f64);

fn change_of(event: &Event<f64>) -> Option<Change> {
    match event.kind {
        EventKind::ContactBegin { speed } | EventKind::Impact { speed, .. } => {
            Some((true, event.time, speed))
        }
        EventKind::ContactEnd { speed } => Some((false, event.time, speed)),
        _ => None,
    }
}

/// Simulates one law in pieces.
fn compare(text: &str, start: [f64; 2], tally: &mut Tally) {
    let model = parsed(text, "law", &NONE).model;
    let system = HybridSystem::new(&model);
    let parameters: Vec<f64> = model.parameter_values().iter().map(|p| p.to_f64()).collect();
    let mut simulator = Simulator::new(&system, &parameters).expect("finite parameters");
    simulator.set_step_limit(20_000);
    let oscillator = Oscillator::read(text, &[]).expect("a scene");
    let mut other = Independent::new(&oscillator, &oscillator.values(), 0.02);
    let period = simulator.forcing_period().expect("a phase");
    let mut state = vec![start[0], start[1], 0.0];
    let mut contacts = 0;
    for _ in 0..PERIODS * campaign() {
        if contacts >= CONTACTS * campaign() {
            break;
        }
        simulator.set_state(&state).expect("a finite state");
        other.place(&state);
        let (mut mine, mut theirs) = (Vec::new(), Vec::new());
        // Each piece runs until nothing is in contact, so that the next one starts in free flight.
        for piece in 0..60 {
            let length = if piece == 0 { period } else { 0.13 * period };
            let end = simulator
                .advance(length, &mut |event| mine.extend(change_of(&event)))
                .expect("a finite time");
            let happened = other.advance(length);
            if end != Outcome::Completed || happened.is_err() {
                // Bounces on a prestressed stop that the forcing presses on have no end.
                let bounces = matches!(end, Outcome::StepLimit { .. })
                    || happened.as_ref().err() == Some(&Failure::TooManyEvents);
                if bounces || (end != Outcome::Completed && happened.is_err()) {
                    tally.ended.push(format!("{end:?} {:?}", happened.err()));
                } else {
                    let theirs = happened.err();
                    tally.wrong.push(format!("{end:?} for {theirs:?}: {state:?}\n{text}"));
                }
                return;
            }
            let happened = happened.unwrap_or_default();
            theirs.extend(happened.iter().filter_map(|event| match event.kind {
                Kind::Begin { speed } | Kind::Impact { speed, .. } => {
                    Some((true, event.time, speed))
                }
                Kind::End { speed } => Some((false, event.time, speed)),
                _ => None,
            }));
            let free = simulator.regime() == Regime::Free && other.mode == Mode::Free;
            if free && simulator.state()[0] < 0.199 {
                break;
            }
        }
        let speeds = mine.iter().chain(&theirs).filter(|change| change.0).map(|change| change.2);
        let least = speeds.fold(f64::INFINITY, f64::min);
        contacts += mine.iter().filter(|change| change.0).count();
        if least < GRAZES {
            tally.grazes += 1;
        } else if let Some(difference) =
            difference(&mine, &theirs, simulator.state(), &other.state, 1e-10 + 1e-13 / least)
        {
            tally.wrong.push(format!("{difference} from {state:?}\n{text}"));
            return;
        }
        if simulator.regime() != Regime::Free {
            break;
        }
        state = simulator.state().to_vec();
    }
    tally.contacts += contacts;
}

fn difference(
    mine: &[Change],
    theirs: &[Change],
    state: &[f64],
    other: &[f64],
    most: f64,
) -> Option<String> {
    let kinds = |changes: &[Change]| changes.iter().map(|change| change.0).collect::<Vec<_>>();
    if kinds(mine) != kinds(theirs) {
        return Some(format!("{mine:?} for {theirs:?}"));
    }
    let changes = mine.iter().zip(theirs).flat_map(|(a, b)| [(a.1, b.1), (a.2, b.2)]);
    let states = state.iter().zip(other).take(2).map(|(&a, &b)| (a, b));
    // Difference relative to the size if that is above 1: a softening spring lets states escape.
    let difference = |(a, b): (f64, f64)| (a - b).abs() / a.abs().max(1.0);
    let worst = changes.chain(states).map(difference).fold(0.0, f64::max);
    (worst > most).then(|| format!("{worst:e}, more than {most:e}"))
}

#[test]
fn random_contact_laws_act_as_an_independent_integration_says() {
    let laws = tiers::count(8, 200) as u64;
    let mut tally = Tally::default();
    for law in 0..laws {
        let mut numbers = Numbers(law * 1_000_003 + 39);
        let text = scene(&mut numbers);
        let start = [numbers.between(-0.9, 0.1), numbers.between(-1.0, 1.0)];
        compare(&text, start, &mut tally);
    }
    println!("{laws} laws: {} contacts, {} grazes", tally.contacts, tally.grazes);
    println!("{} ended in both, {} wrong", tally.ended.len(), tally.wrong.len());
    assert!(tally.wrong.is_empty(), "{} wrong, the first: {}", tally.wrong.len(), tally.wrong[0]);
    assert!(tally.contacts as u64 > 25 * laws, "{tally:?}");
}

#[test]
fn a_restitution_that_is_a_power_of_the_speed_acts_as_an_independent_integration_says() {
    let text = "[model]\nstates = [\"x\", \"v\"]\n\
                parameters = { zeta = 0.05, A = 0.5, w = 0.8, r = 0.8 }\n\
                [model.phase]\nname = \"theta\"\nrate = \"w\"\nperiod = \"2*pi\"\n\
                [model.flow]\nx = \"v\"\nv = \"A*cos(theta) - 2*zeta*v - x\"\n\
                [[model.surface]]\nname = \"stop\"\nevent = \"1 - x\"\n\
                impact = { v = \"-r*v/(1 + v^0.25)\" }\n\
                [grazing]\nsurface = \"stop\"\nsolve_for = \"A\"\n";
    let mut tally = Tally::default();
    compare(text, [0.1, 0.4], &mut tally);
    assert!(tally.wrong.is_empty() && tally.contacts >= CONTACTS, "{tally:?}");
}

/// Time in a contact without losses that pushes back with `k d^n`, met at the speed `u`: the
/// greatest depth is `D = ((n + 1) u²/2k)^(1/(n + 1))`, and `T = 2 D/u · B(1/(n+1), 1/2)/(n+1)`.
fn time_in_contact(power: f64, stiffness: f64, speed: f64, beta: f64) -> f64 {
    let n = power + 1.0;
    let depth = (n * speed * speed / (2.0 * stiffness)).powf(1.0 / n);
    2.0 * depth / speed * beta / n
}

/// Values of the beta function `B(1/(n + 1), 1/2)` at `n` = 1.5, 0.5, 2.5.
const BETAS: [f64; 3] = [3.679093980405881, 2.5871095592297905, 4.727535857201496];

/// Powers of the depth that are not whole: Hertz's, a softer and a harder one, by closed forms.
#[test]
fn contacts_with_powers_of_the_depth_last_as_closed_forms_say() {
    // B(1/(n + 1), 1/2): B(2/5, 1/2), B(2/3, 1/2), B(2/7, 1/2).
    for (power, beta) in [("1.5", BETAS[0]), ("0.5", BETAS[1]), ("2.5", BETAS[2])] {
        for speed in [1.0_f64, 0.1, 1e-3] {
            let text = format!(
                "[model]\nstates = [\"x\", \"v\"]\nparameters = {{ k = 100.0 }}\n\
                 [model.flow]\nx = \"v\"\nv = \"0\"\n\
                 [[model.surface]]\nname = \"stop\"\nevent = \"1 - x\"\n\
                 contact = {{ v = \"free - k*(x - 1)^{power}\" }}\n\
                 [grazing]\nsurface = \"stop\"\nsolve_for = \"k\"\n"
            );
            let model = parsed(&text, "power", &NONE).model;
            let system = HybridSystem::new(&model);
            let mut simulator = Simulator::new(&system, &[100.0]).expect("finite parameters");
            simulator.set_state(&[1.0 - 0.5 * speed, speed]).expect("a finite state");
            let found = simulator.run(20.0 / speed.sqrt()).expect("a finite time");
            let changes: Vec<Change> = found.events.iter().filter_map(change_of).collect();
            let context = format!("{power} {speed}: {changes:?} {:?}", found.outcome);
            let [(true, begin, met), (false, end, left)] = changes[..] else { panic!("{context}") };
            let exponent: f64 = power.parse().expect("a number");
            let expected = time_in_contact(exponent, 100.0, speed, beta);
            // Rounding of the position, over the speed.
            assert!((end - begin - expected).abs() < 1e-14 + 1e-14 / speed, "{context} {expected}");
            assert!((met - speed).abs() < 1e-15 && (left - speed).abs() < 1e-13, "{context}");
        }
    }
}

/// Values of `B(1/(n + 1), 1/2)` at `n` = 1.5, 0.5, 2.5, 1.1.
const BETAS_TO_ALL_DIGITS: [(&str, &str); 4] = [
    ("1.5", "3.679093980405880821727234125103653"),
    ("0.5", "2.587109559229790534953515025131212"),
    ("2.5", "4.72753585720149572896467927069233"),
    ("1.1", "3.250156383474161037867668404138991"),
];

#[test]
fn contacts_with_powers_of_the_depth_last_as_closed_forms_say_in_double_double() {
    for (power, beta) in BETAS_TO_ALL_DIGITS {
        for speed in [1.0_f64, 0.125, 1.0 / 1024.0] {
            let text = format!(
                "[model]\nstates = [\"x\", \"v\"]\nparameters = {{ k = 100.0 }}\n\
                 [model.flow]\nx = \"v\"\nv = \"0\"\n\
                 [[model.surface]]\nname = \"stop\"\nevent = \"1 - x\"\n\
                 contact = {{ v = \"free - k*d^{power}\" }}\n\
                 [grazing]\nsurface = \"stop\"\nsolve_for = \"k\"\n"
            );
            let model = parsed(&text, "power", &NONE).model;
            let system = HybridSystem::new(&model);
            let of = Dd::from_f64;
            let mut simulator =
                Simulator::<Dd>::new(&system, &[of(100.0)]).expect("finite parameters");
            simulator.set_state(&[of(1.0 - 0.5 * speed), of(speed)]).expect("a finite state");
            let found = simulator.run(of(20.0 / speed.sqrt())).expect("a finite time");
            let changes = found.events.iter().filter_map(|event| match event.kind {
                EventKind::ContactBegin { .. } | EventKind::ContactEnd { .. } => Some(event.time),
                _ => None,
            });
            let changes: Vec<Dd> = changes.collect();
            let context = format!("{power} {speed}: {:?}", found.outcome);
            let [begin, end] = changes[..] else { panic!("{context}") };
            let n = power.parse::<Dd>().expect("a number") + of(1.0);
            let beta = beta.parse::<Dd>().expect("a number");
            let energy = n * of(speed) * of(speed) / of(200.0);
            let expected = of(2.0) * energy.powf(of(1.0) / n) / of(speed) * beta / n;
            let error = (end - begin - expected).magnitude();
            println!("{context}: {error:.1e}");
            // Rounding of the position, over the speed.
            assert!(error < 1e-30 + 1e-30 / speed, "{context}: {error:e}");
            let left = found.state[1];
            assert!((left + of(speed)).magnitude() < 1e-27, "{context}: {left}");
        }
    }
}

/// Stiffness, damper and speed of Hertz's spring with a linear damper that leave with 0.8 of the
/// speed, released at zero force: those of a contact of length 0.01, at other units of time and
/// length. With `t = s τ` and `x = l ξ` the stiffness is `k s^-2 l^-1/2`, the damper `b/s`.
#[test]
fn stiff_hertz_stops_with_a_damper_are_left_at_zero_force() {
    let (stiffness, damper) = (1_584_731.349_891_674_2, 40.450_939_232_771_056);
    for [time, length] in [[1.0, 1.0], [1e-2, 1e-2], [1e-2, 1e-3], [1e-3, 1e-3], [1e-3, 1e-4]] {
        let (k, b) = (stiffness / (time * time * f64::sqrt(length)), damper / time);
        let force = format!("{k:e}*d^1.5 + {b:e}*v");
        let text = format!(
            "[model]\nstates = [\"x\", \"v\"]\nparameters = {{ g = 0.0 }}\n\
             [model.flow]\nx = \"v\"\nv = \"g\"\n\
             [[model.surface]]\nname = \"stop\"\nevent = \"1 - x\"\n\
             contact = {{ v = \"free - ({force})\" }}\nrelease = \"{force}\"\n\
             [grazing]\nsurface = \"stop\"\nsolve_for = \"g\"\n"
        );
        let model = parsed(&text, "hertz", &NONE).model;
        let system = HybridSystem::new(&model);
        let mut simulator = Simulator::<f64>::new(&system, &[0.0]).expect("finite parameters");
        let speed = length / time;
        simulator.set_state(&[1.0 - 0.5 * speed, speed]).expect("a finite state");
        let found = simulator.run(1.0).expect("a finite time");
        let left = -found.state[1] / speed;
        println!("{time} {length}: {left} {:?} {:?}", found.outcome, found.events);
        // Rounding of the position, over the depth of 3e-3 lengths.
        assert!((left - 0.8).abs() < 1e-12 + 1e-12 / length, "{time} {length}: {left}");
    }
}
