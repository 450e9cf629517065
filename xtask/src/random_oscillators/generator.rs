//! Random oscillators determined by a seed, as texts of scenes.

use std::f64::consts::TAU;

use crate::random::Random;

/// Oscillator with its settings.
#[derive(Clone, Debug)]
pub(crate) struct Generated {
    /// Text of the scene.
    pub(crate) scene: String,
    /// Parts of the oscillator, in words.
    pub(crate) kind: String,
    /// Rate of the forcing.
    pub(crate) rate: f64,
    /// Longest time between two samples of the independent simulator, in periods.
    pub(crate) look: f64,
    /// Phase of the stroboscopic section.
    pub(crate) phase: f64,
}

/// Extent of a campaign.
#[derive(Clone, Copy, Debug)]
pub struct Choice {
    /// Whether pulses may be as narrow as a hundredth of a period, or narrower.
    pub narrow: bool,
    /// Number of parameter values per oscillator.
    pub places: usize,
    /// Number of periods followed at each value.
    pub periods: usize,
    /// Whether diagrams are checked too.
    pub diagrams: bool,
}

impl Default for Choice {
    fn default() -> Self {
        Self { narrow: false, places: 3, periods: 10, diagrams: true }
    }
}

/// Free flight: its states, its equations without the forcing, and the states that meet a stop.
struct Flight {
    kind: &'static str,
    /// Equations of the states, with `FORCE` for the forcing.
    equations: Vec<(&'static str, String)>,
    parameters: Vec<(&'static str, f64)>,
    /// Position and velocity that meet the stops.
    meets: (&'static str, &'static str),
}

/// Stop: distance, side and contact law.
struct Stop {
    kind: String,
    text: String,
    parameters: Vec<(String, f64)>,
}

impl Random {
    /// Random number in a range, with three digits.
    pub(super) fn between(&mut self, from: f64, to: f64) -> f64 {
        let share = self.below(1 << 53) as f64 / (1u64 << 53) as f64;
        let digits = format!("{:.2e}", from + (to - from) * share);
        digits.parse().expect("digits of a number")
    }

    /// Random number in a range, uniform in the logarithm, with three digits.
    pub(super) fn octaves(&mut self, from: f64, to: f64) -> f64 {
        let number = self.between(from.ln(), to.ln()).exp();
        format!("{number:.2e}").parse().expect("digits of a number")
    }
}

/// Random oscillator.
pub(crate) fn oscillator(random: &mut Random, choice: Choice) -> Generated {
    let rate = random.octaves(0.35, 3.5);
    let flight = flight(random);
    let (forcing, mut parameters, width) = forcing(random, choice);
    parameters.extend(flight.parameters.iter().map(|&(name, value)| (name.to_owned(), value)));
    parameters.push(("w".to_owned(), rate));
    parameters.push(("wall".to_owned(), random.between(0.5, 2.0)));
    let mut stops = vec![stop(random, &flight, "right", false)];
    if random.one_in(3) {
        stops.push(stop(random, &flight, "left", true));
    }
    let kinds: Vec<&str> = stops.iter().map(|stop| &stop.kind[..]).collect();
    let kind = format!("{}, {}, {}", flight.kind, forcing.0, kinds.join(" and "));
    for stop in &stops {
        parameters.extend(stop.parameters.iter().cloned());
    }
    let solve_for = if random.one_in(3) { "A" } else { "wall" };
    let listed: Vec<String> =
        parameters.iter().map(|(name, value)| format!("{name} = {}", shown(*value))).collect();
    let states: Vec<String> =
        flight.equations.iter().map(|(state, _)| format!("\"{state}\"")).collect();
    let mut scene = format!(
        "[model]\nstates = [{}]\nparameters = {{ {} }}\nlet = {{ F = \"{}\" }}\n",
        states.join(", "),
        listed.join(", "),
        forcing.1
    );
    scene += "[model.phase]\nname = \"theta\"\nrate = \"w\"\nperiod = \"2*pi\"\n[model.flow]\n";
    for (state, equation) in &flight.equations {
        scene += &format!("{state} = \"{equation}\"\n");
    }
    for stop in &stops {
        scene += &stop.text;
    }
    scene += &format!("[grazing]\nsurface = \"right\"\nsolve_for = \"{solve_for}\"\n");
    scene += &format!("[expansion]\nactive = [\"{solve_for}\"]\nsmooth_order = 1\n");
    scene += "contact_weight = 2\n";
    let phase = random.between(0.0, TAU);
    Generated { scene, kind, rate, look: width, phase }
}

/// Number as written in a scene.
fn shown(value: f64) -> String {
    let text = format!("{value}");
    if text.contains(['.', 'e']) { text } else { format!("{text}.0") }
}

fn flight(random: &mut Random) -> Flight {
    let zeta = random.octaves(0.01, 0.3);
    let one = |kind, force: &str, mut parameters: Vec<(&'static str, f64)>| {
        parameters.push(("zeta", zeta));
        Flight {
            kind,
            equations: vec![("x", "v".to_owned()), ("v", format!("F {force}"))],
            parameters,
            meets: ("x", "v"),
        }
    };
    match random.below(6) {
        0 | 1 => one("linear", "- 2*zeta*v - x", vec![]),
        2 => {
            let cubic = random.between(-0.05, 0.5);
            one("cubic", "- 2*zeta*v - x - c*x^3", vec![("c", cubic)])
        }
        3 => one("pendulum", "- 2*zeta*v - sin(x)", vec![]),
        4 => {
            let mu = random.between(0.02, 0.5);
            one("van der Pol", "+ mu*(1 - x^2)*v - x - 0*zeta", vec![("mu", mu)])
        }
        _ => {
            let parameters = vec![
                ("zeta", zeta),
                ("m", random.between(0.3, 3.0)),
                ("k1", random.between(0.5, 2.0)),
                ("k2", random.between(0.2, 3.0)),
            ];
            let hits_other = random.one_in(3);
            Flight {
                kind: "two masses",
                equations: vec![
                    ("x", "v".to_owned()),
                    ("v", "F - 2*zeta*v - k1*x - k2*(x - y)".to_owned()),
                    ("y", "u".to_owned()),
                    ("u", "(-2*zeta*u - y - k2*(y - x))/m".to_owned()),
                ],
                parameters,
                meets: if hits_other { ("y", "u") } else { ("x", "v") },
            }
        }
    }
}

/// Forcing in words and as a formula, its parameters, and the width of its narrowest feature.
fn forcing(random: &mut Random, choice: Choice) -> ((String, String), Vec<(String, f64)>, f64) {
    let mut parameters = vec![("A".to_owned(), random.between(0.3, 2.0))];
    let mut formula = "A*cos(theta)".to_owned();
    let mut kind = "one harmonic".to_owned();
    let mut look = 1.0 / 60.0;
    if random.one_in(3) {
        kind += " and another";
        let number = random.of(&[2, 3]);
        parameters.push(("B".to_owned(), random.between(0.05, 0.6)));
        formula += &format!(" + B*cos({number}*theta + {})", random.between(0.0, TAU));
    }
    if random.one_in(3) {
        kind += ", an offset";
        parameters.push(("o".to_owned(), random.between(-0.5, 0.5)));
        formula += " + o";
    }
    if random.one_in(4) {
        kind += ", a pulse";
        // NOTE: the pulse covers about 1/sqrt(K) of the phase.
        let sharp =
            if choice.narrow { random.octaves(2e2, 1e5) } else { random.octaves(1.0, 30.0) };
        look = (0.3 / sharp.sqrt() / TAU).min(look);
        parameters.push(("P".to_owned(), random.between(0.2, 3.0)));
        parameters.push(("K".to_owned(), sharp));
        formula += &format!(" + P*exp(K*(cos(theta - {}) - 1))", random.between(0.0, TAU));
    }
    ((kind, formula), parameters, look)
}

/// Random stop on one side; its parameters have the side's letter.
fn stop(random: &mut Random, flight: &Flight, name: &str, is_left: bool) -> Stop {
    let letter = &name[..1];
    let (x, v) = flight.meets;
    let mut parameters = Vec::new();
    let mut named = |stem: &str, value: f64| {
        let name = format!("{stem}_{letter}");
        parameters.push((name.clone(), value));
        name
    };
    // Position along the way to the stop, and speed towards it.
    let (s, t) =
        if is_left { (format!("(-{x})"), format!("(-{v})")) } else { (x.into(), v.into()) };
    let place = if is_left {
        let farther = named("far", random.between(1.02, 1.6));
        format!("{farther}*wall")
    } else {
        "wall".to_owned()
    };
    let moves = random.one_in(4);
    let (wall, speed) = if moves {
        let size = named("b", random.between(0.01, 0.15));
        let at = random.between(0.0, TAU);
        (format!("{place} + {size}*cos(theta + {at})"), format!("(-{size}*w*sin(theta + {at}))"))
    } else {
        (place, "0".to_owned())
    };
    let event = format!("{wall} - {s}");
    let depth = format!("({s} - ({wall}))");
    let closing = if moves { format!("({t} - {speed})") } else { t.clone() };
    let back = if is_left { "+" } else { "-" };
    let outwards = |force: &str| format!("free {back} ({force})");
    let mut kind = if moves { "a moving ".to_owned() } else { "a ".to_owned() };
    let mut release = None;
    let response = if random.one_in(2) {
        let r = named("r", random.between(0.05, 0.98));
        let ratio = match random.below(4) {
            0 => {
                let c = named("c", random.between(0.05, 2.0));
                kind += "rigid stop with a restitution that falls with the speed";
                format!("{r}/(1 + {c}*{closing}^2)")
            }
            1 => {
                let c = named("c", random.between(0.05, 2.0));
                kind += "rigid stop, elastic at low speed";
                format!("({r} + (1 - {r})*exp(-{c}*{closing}^2))")
            }
            _ => {
                kind += "rigid stop";
                r
            }
        };
        // NOTE: after the impact the speed towards the stop is `speed − ratio·closing`.
        let after = format!("{speed} - {ratio}*{closing}");
        let after = if is_left { format!("-({after})") } else { after };
        format!("impact = {{ {v} = \"{after}\" }}\n")
    } else {
        let k = named("k", random.octaves(3.0, 300.0));
        let mut force = match random.below(4) {
            0 => {
                let c = named("c", random.octaves(1.0, 1e3));
                kind += "hardening buffer";
                format!("{k}*{depth} + {c}*{depth}^3")
            }
            1 => {
                let c = named("c", random.octaves(1.0, 20.0));
                kind += "softening buffer";
                format!("{k}*tanh({c}*{depth})/{c}")
            }
            2 => {
                let c = named("c", random.octaves(1.0, 10.0));
                kind += "exponential buffer";
                format!("{k}*(exp({c}*{depth}) - 1)/{c}")
            }
            _ => {
                kind += "linear buffer";
                format!("{k}*{depth}")
            }
        };
        let mut pulls = false;
        match random.below(4) {
            0 => {
                let p = named("p", random.octaves(0.02, 1.0));
                kind += ", prestressed";
                force += &format!(" + {p}");
            }
            1 => {
                let p = named("p", random.octaves(0.02, 1.0));
                kind += ", adhesive";
                pulls = true;
                force += &format!(" - {p}");
            }
            _ => {}
        }
        let mut damped = false;
        match random.below(4) {
            0 => {
                let rate = named("R", random.octaves(0.05, 3.0));
                kind += ", damped";
                damped = true;
                force += &format!(" + {rate}*{closing}");
            }
            1 => {
                let rate = named("R", random.octaves(0.05, 3.0));
                kind += ", damped with its depth";
                force += &format!(" + {rate}*{depth}*{closing}");
            }
            _ => {}
        }
        if damped && !pulls && random.one_in(2) {
            kind += ", let go without force";
            release = Some(force.clone());
        }
        format!("contact = {{ {v} = \"{}\" }}\n", outwards(&force))
    };
    let mut text = format!("[[model.surface]]\nname = \"{name}\"\nevent = \"{event}\"\n{response}");
    if let Some(release) = release {
        text += &format!("release = \"{release}\"\n");
    }
    Stop { kind, text, parameters }
}
