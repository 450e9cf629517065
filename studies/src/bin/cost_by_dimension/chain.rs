//! Chains of masses whose first mass meets a stop.

use grazemap::model::Scene;
use nalgebra::{Complex, DMatrix, DVector};

/// Frequency of the force on the first mass.
const FREQUENCY: f64 = 1.1;
/// Ratio of damping to stiffness of every spring; the stiffness is 1.
const DAMPING: f64 = 0.05;

/// Contact law of the stop.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Law {
    /// `v ↦ −0.8 v`.
    Rigid,
    /// Spring of stiffness 20, pressed against its seat.
    Prestressed,
}

impl Law {
    pub(crate) const ALL: [Self; 2] = [Self::Rigid, Self::Prestressed];

    pub(crate) fn name(self) -> &'static str {
        match self {
            Self::Rigid => "rigid",
            Self::Prestressed => "prestressed",
        }
    }

    fn line(self) -> &'static str {
        match self {
            Self::Rigid => "impact = { v1 = \"-0.8*v1\" }",
            Self::Prestressed => "contact = { v1 = \"free - 20*(x1 - d + 0.1)\" }",
        }
    }
}

/// Chain of equal masses hung from a wall, forced at its free end, where the stop is. Parameters:
/// the stop's place `d` and, if two are active, the frequency `w`.
pub(crate) fn scene(masses: usize, law: Law, active: usize) -> Scene {
    let response = response(masses);
    let (distance, phase) = response[0].to_polar();
    let theta = -phase;
    // NOTE: at the graze the first mass is at its maximum; the others have their own phases.
    let states: Vec<String> = (1..=masses).map(|i| format!("\"x{i}\", \"v{i}\"")).collect();
    let guess: Vec<String> = (1..=masses)
        .map(|i| {
            let turned = response[i - 1] * Complex::from_polar(1.0, theta);
            format!("x{i} = {:?}, v{i} = {:?}", turned.re, -FREQUENCY * turned.im)
        })
        .collect();
    let motion: Vec<String> = (1..=masses).map(|i| equation(i, masses)).collect();
    let parameters = ["\"d\"", "\"w\""][..active].join(", ");
    let text = format!(
        r#"
[model]
name = "a chain of masses and a stop"
states = [{states}]
parameters = {{ d = {distance:?}, w = {FREQUENCY} }}

[model.phase]
name = "theta"
rate = "w"
period = "2*pi"

[model.flow]
{motion}

[[model.surface]]
name = "stop"
event = "d - x1"
{law}

[grazing]
surface = "stop"
solve_for = "d"
guess = {{ {guess}, theta = {theta:?} }}

[section]
kind = "tangency"

[expansion]
active = [{parameters}]
smooth_order = 2
contact_weight = 3
"#,
        states = states.join(", "),
        motion = motion.join("\n"),
        guess = guess.join(", "),
        law = law.line(),
    );
    Scene::parse(&text, "chain.toml").unwrap_or_else(|error| panic!("{error}"))
}

/// Equations of mass `i` of `n`: a spring to each neighbour, the wall behind the last mass.
fn equation(i: usize, n: usize) -> String {
    let spring = |name: &str| {
        let ahead = (i > 1).then(|| format!(" - ({name}{i} - {name}{})", i - 1));
        let behind = if i < n {
            format!(" - ({name}{i} - {name}{})", i + 1)
        } else {
            format!(" - {name}{i}")
        };
        format!("{behind}{}", ahead.unwrap_or_default())
    };
    let force = if i == 1 { "cos(theta)" } else { "0" };
    format!("x{i} = \"v{i}\"\nv{i} = \"{force}{} + {DAMPING}*(0{})\"", spring("x"), spring("v"))
}

/// Complex amplitudes `X` of the forced motion, `x = Re X e^{iθ}`: `(K (1 + iωc) − ω²) X = F`.
fn response(masses: usize) -> DVector<Complex<f64>> {
    let stiffness = DMatrix::from_fn(masses, masses, |i, j| match i.abs_diff(j) {
        0 if i == 0 && masses > 1 => 1.0,
        0 if masses > 1 => 2.0,
        0 => 1.0,
        1 => -1.0,
        _ => 0.0,
    });
    let complex = Complex::new(1.0, FREQUENCY * DAMPING);
    let dynamic = stiffness.map(|k| complex * k)
        - DMatrix::identity(masses, masses) * Complex::from(FREQUENCY * FREQUENCY);
    let mut force = DVector::from_element(masses, Complex::from(0.0));
    force[0] = Complex::from(1.0);
    dynamic.lu().solve(&force).expect("a damped chain")
}
