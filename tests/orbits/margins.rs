//! The smallest change of parameters that grazes, against the closed form of the linear oscillator.
//!
//! The steady state of `x'' + 2 ζ x' + x = α cos ωt` has the amplitude `α/√((1 − ω²)² + (2ζω)²)`,
//! so that it grazes the stop at `δ` on the curve `α = δ √((1 − ω²)² + (2ζω)²)`.

use grazemap::model::Scene;
use grazemap::numeric::Dd;
use grazemap::orbit::{
    IntervalEnd, Location, Margin, MarginOutcome, OrbitError, clear_interval, locate, margin,
};

use crate::support::scenes::{NONE, index, parsed, scene_with};

/// `ζ, δ, α₀, ω₀` and the scales of `α` and `ω`.
#[derive(Clone, Copy)]
struct Linear {
    zeta: f64,
    delta: f64,
    from: [f64; 2],
    scales: [f64; 2],
}

impl Linear {
    fn alpha(&self, omega: f64) -> f64 {
        self.delta * (1.0 - omega * omega).hypot(2.0 * self.zeta * omega)
    }

    fn distance(&self, omega: f64) -> f64 {
        let [alpha, own] = [self.alpha(omega), omega];
        let change = |value: f64, number: usize| (value - self.from[number]) / self.scales[number];
        change(alpha, 0).hypot(change(own, 1))
    }

    /// Half the derivative of the squared distance.
    fn stationarity(&self, omega: f64) -> f64 {
        let d2 = self.delta * self.delta;
        let alpha = self.alpha(omega);
        let slope = d2
            * (-2.0 * omega * (1.0 - omega * omega) + 4.0 * self.zeta * self.zeta * omega)
            / alpha;
        (alpha - self.from[0]) * slope / self.scales[0].powi(2)
            + (omega - self.from[1]) / self.scales[1].powi(2)
    }

    /// The value of `ω` at the nearest point between two: from a scan, then by bisection.
    fn nearest(&self, low: f64, high: f64) -> f64 {
        const STEPS: u32 = 200_000;
        let step = (high - low) / f64::from(STEPS);
        let at = |number: u32| low + step * f64::from(number);
        let least = (1..STEPS)
            .min_by(|&a, &b| self.distance(at(a)).total_cmp(&self.distance(at(b))))
            .expect("steps");
        let (mut a, mut b) = (at(least - 1), at(least + 1));
        for _ in 0..80 {
            let middle = 0.5 * (a + b);
            if self.stationarity(middle) < 0.0 { a = middle } else { b = middle }
        }
        0.5 * (a + b)
    }

    fn scene(&self) -> Scene {
        let value = |value: f64| format!("{value:?}");
        let values = [self.from[0], self.from[1], self.zeta, self.delta].map(value);
        let names = ["alpha", "omega", "zeta", "delta"];
        let pairs: Vec<_> = names.into_iter().zip(values.iter().map(String::as_str)).collect();
        scene_with("linear", &pairs)
    }
}

const LINEAR: Linear = Linear { zeta: 0.05, delta: 1.0, from: [2.25, 1.8], scales: [2.25, 1.8] };

fn found(linear: &Linear, names: &[&str], scales: &[f64]) -> Margin {
    let scene = linear.scene();
    let parameters: Vec<usize> = names.iter().map(|name| index(&scene, name)).collect();
    match margin(&scene, &parameters, scales).expect("a scene with a margin") {
        MarginOutcome::Found(margin) => *margin,
        other => panic!("{other:?}"),
    }
}

/// The nearest point in both orders of the parameters, its distance and slopes.
#[test]
fn nearest_graze_of_the_linear_oscillator_is_that_of_the_closed_form() {
    let scales = [LINEAR.scales, [1.0, 0.01], [1e-3, 5.0]];
    for (scales, zeta) in scales.into_iter().zip([0.05, 0.3, 0.05]) {
        let linear = Linear { scales, zeta, ..LINEAR };
        let omega = linear.nearest(1.5, 2.1);
        for reversed in [false, true] {
            let (mut names, mut scales) = (["alpha", "omega"], scales);
            if reversed {
                names.reverse();
                scales.reverse();
            }
            let margin = found(&linear, &names, &scales);
            assert!(margin.stationary);
            let nearest = |name| margin.nearest[index(&linear.scene(), name)].to_f64();
            assert!((nearest("omega") - omega).abs() < 1e-12, "{:e}", nearest("omega") - omega);
            assert!((nearest("alpha") - linear.alpha(omega)).abs() < 1e-12);
            // The change is a difference of numbers of order one.
            assert!((margin.distance - linear.distance(omega)).abs() < 1e-15 / scales[0].min(1e-2));
            assert_eq!(margin.clears, linear.from[0] < linear.alpha(linear.from[1]));
        }
    }
}

/// Slopes of the margin, by differences of the closed form.
#[test]
fn sensitivities_are_the_slopes_of_the_closed_form() {
    let margin = found(&LINEAR, &["alpha", "omega"], &LINEAR.scales);
    let scene = LINEAR.scene();
    const STEP: f64 = 1e-5;
    let distance = |linear: Linear| linear.distance(linear.nearest(1.79, 1.81));
    let slope = |moved: &dyn Fn(f64) -> Linear| {
        (distance(moved(STEP)) - distance(moved(-STEP))) / (2.0 * STEP)
    };
    let [alpha, omega] = LINEAR.from;
    let expected = [
        ("alpha", slope(&|by| Linear { from: [alpha + by, omega], ..LINEAR })),
        ("omega", slope(&|by| Linear { from: [alpha, omega + by], ..LINEAR })),
        ("zeta", slope(&|by| Linear { zeta: LINEAR.zeta + by, ..LINEAR })),
        ("delta", slope(&|by| Linear { delta: LINEAR.delta + by, ..LINEAR })),
        ("r", 0.0),
    ];
    for (name, expected) in expected {
        let slope = margin.sensitivities[index(&scene, name)];
        // The scan's bisection rounds distances to 1e-16, differences over 2e-5 to 1e-11.
        assert!((slope - expected).abs() < 1e-8, "{name}: {slope} for {expected}");
    }
}

/// From beyond the resonance peak several points of the curve are stationary: the least is found.
#[test]
fn the_least_of_several_stationary_points_is_found_on_the_whole_stretch() {
    for from in [[1.2, 1.05], [0.9, 0.98], [1.2, 1.4], [0.6, 0.5]] {
        let linear = Linear { from, scales: from, ..LINEAR };
        let omega = linear.nearest(0.02, 3.0);
        let margin = found(&linear, &["alpha", "omega"], &from);
        let nearest = margin.nearest[index(&linear.scene(), "omega")].to_f64();
        assert!((nearest - omega).abs() < 1e-12, "{from:?}: {nearest} for {omega}");
    }
}

#[test]
fn one_parameter_has_the_graze_that_is_located() {
    let margin = found(&LINEAR, &["alpha"], &[2.0]);
    let change = LINEAR.alpha(1.8) - 2.25;
    assert!((margin.changes[0] - change).abs() < 1e-15);
    assert!((margin.distance - change.abs() / 2.0).abs() < 1e-15);
    let slope = margin.sensitivities[index(&LINEAR.scene(), "alpha")];
    assert!((slope - 0.5).abs() < 1e-12 && !margin.clears);
    let below = Linear { from: [2.2, 1.8], ..LINEAR };
    assert!(found(&below, &["alpha"], &[1.0]).clears);
}

#[test]
fn what_has_no_margin_is_refused() {
    let scene = LINEAR.scene();
    let numbers = ["alpha", "omega", "zeta"].map(|name| index(&scene, name));
    let refused = |parameters: &[usize], scales: &[f64]| margin(&scene, parameters, scales).err();
    for (parameters, scales) in
        [(&numbers[..], &[1.0; 3][..]), (&[], &[]), (&[numbers[0]; 2], &[1.0; 2])]
    {
        let error = refused(parameters, scales);
        assert!(matches!(error, Some(OrbitError::MarginParameters { .. })), "{error:?}");
    }
    for scale in [0.0, -1.0, f64::NAN, f64::INFINITY] {
        let error = refused(&numbers[..1], &[scale]);
        assert!(matches!(error, Some(OrbitError::MarginScale { .. })), "{error:?}");
    }
}

/// Oscillator `m x'' + c x' + k x = F cos(w t)` below a stop at `g`, in units of its own.
fn forced(parameters: &str) -> Scene {
    let text = format!(
        r#"
[model]
name = "forced"
states = ["x", "v"]
parameters = {{ {parameters}, r = 0.5 }}
[model.phase]
name = "th"
rate = "w"
period = "2*pi"
[model.flow]
x = "v"
v = "(F*cos(th) - c*v - k*x)/m"
[[model.surface]]
name = "stop"
event = "g - x"
impact = {{ v = "-r*v" }}
[grazing]
solve_for = "F"
"#
    );
    parsed(&text, "forced", &NONE)
}

/// The amplitude is `F/|k − m w² + i c w|`: its grazes in `w` are roots of a quadratic in `w²`, and
/// the nearest ones on both sides end the interval, in units of one and in micrometres and
/// microseconds.
#[test]
fn intervals_without_contact_end_at_the_grazes_of_the_closed_form() {
    let cases = [(0.7, 0.2), (0.3, 0.12), (1.2, 0.5), (0.95, 0.05), (0.8, 0.21), (0.5, 0.3)];
    for (w, force) in cases {
        for (time, length) in [(1.0, 1.0), (1e-6, 1e-6), (1e3, 1e-3), (1e-6, 1.0)] {
            let (damper, mass) = (0.1 * time, time * time);
            let values = [mass, damper, 1.0, force * length, w / time, length];
            let named = ["m", "c", "k", "F", "w", "g"].iter().zip(values);
            let named: Vec<String> = named.map(|(name, at)| format!("{name} = {at:e}")).collect();
            let scene = forced(&named.join(", "));
            let found = clear_interval(&scene, index(&scene, "w"), None).expect("followed");
            let found = found.expect("an orbit");
            // w⁴ − 2b w² + 1 − F² = 0
            let (b, force): (f64, f64) = (1.0 - 0.5 * 0.1 * 0.1, force);
            // No graze if the discriminant is negative.
            let root = (b * b - 1.0 + force * force).sqrt();
            let grazes = || [b - root, b + root].map(f64::sqrt).into_iter();
            let known = [
                grazes().filter(|at| *at < w).reduce(f64::max),
                grazes().filter(|at| *at > w).reduce(f64::min),
            ];
            let amplitude = force / (1.0 - w * w).hypot(0.1 * w);
            assert!((found.gap / length - (1.0 - amplitude)).abs() < 1e-9, "{w} {force} {time}");
            for (end, known) in found.ends.iter().zip(known) {
                let value = end.as_ref().map(|end| end.value() * time);
                match (value, known) {
                    (Some(value), Some(known)) => {
                        assert!((value / known - 1.0).abs() < 1e-10, "{w} {force} {time} {value}");
                    }
                    ends => assert_eq!(ends, (None, None), "{w} {force} {time} {length}"),
                }
            }
        }
    }
}

/// The electrostatic oscillator touches between two grazes 1.6e-4 apart; each side ends at its own.
#[test]
fn a_narrow_interval_of_contact_is_not_stepped_over() {
    let scene = scene_with("mems_codim2", &NONE);
    let omega = index(&scene, "omega");
    for (value, known) in [
        (0.4878, [Some(0.487_274_977_214_285), None]),
        (0.4873, [Some(0.487_274_977_214_285), None]),
        (0.4872, [Some(0.487_115_457_135_83), Some(0.487_274_977_214_285)]),
    ] {
        let mut scene = scene.clone();
        scene.model.parameters[omega].value = Dd::from(value);
        let found = clear_interval(&scene, omega, None).expect("followed").expect("an orbit");
        assert_eq!(found.gap > 0.0, known[1].is_none(), "{value}");
        for (end, known) in found.ends.iter().zip(known) {
            let end = end.as_ref().map(IntervalEnd::value);
            let apart = end.zip(known).map(|(end, known)| (end - known).abs());
            assert!(known.is_none() || apart.is_some_and(|apart| apart < 1e-12), "{value} {end:?}");
        }
    }
}

/// A Duffing oscillator has two orbits at these values, of the amplitudes 0.1290 and 1.5072 by
/// another simulator. The small one ends in a fold at A = 0.866 before it touches; the margin is
/// told for it, with its sign.
#[test]
fn the_orbit_that_the_free_flow_settles_on_is_followed_to_its_fold() {
    let text = r#"
[model]
name = "Duffing"
states = ["x", "v"]
parameters = { z = 0.03, A = 0.2, W = 1.6, al = 1.0, del = 1.0, r = 0.8 }
[model.phase]
name = "th"
rate = "W"
period = "2*pi"
[model.flow]
x = "v"
v = "-2*z*v - x - al*x^3 + A*cos(th)"
[[model.surface]]
name = "wall"
event = "del - x"
impact = { v = "-r*v" }
[grazing]
solve_for = "A"
"#;
    let scene = parsed(text, "duffing", &NONE);
    let interval = |name: &str| {
        let found = clear_interval(&scene, index(&scene, name), None).expect("followed");
        found.expect("an orbit")
    };
    let force = interval("A");
    assert!((force.gap - (1.0 - 0.1290)).abs() < 1e-4, "{}", force.gap);
    let Some(IntervalEnd::Fold { value }) = force.ends[1] else { panic!("{:?}", force.ends) };
    assert!((value - 0.866).abs() < 1e-3, "{value}");
    let Some(IntervalEnd::Graze { value, .. }) = interval("del").ends[0] else {
        panic!("no graze")
    };
    assert!((value - 0.1290).abs() < 1e-4, "{value}");
    let margin = margin(&scene, &[index(&scene, "del")], &[1.0]).expect("followed");
    let MarginOutcome::Found(margin) = margin else { panic!("no graze") };
    assert!(margin.clears && (margin.distance - (1.0 - 0.1290)).abs() < 1e-4, "{margin:?}");
}

/// `x'' = −ω² x + (μ − x² − x'²/ω²) x'` has the cycle `x = √μ cos ωt`, which touches `x = s` at
/// `μ = s²`; units of time and length change nothing.
#[test]
fn a_cycle_without_forcing_is_followed_to_its_graze_from_far_away() {
    for (time, length) in [(1.0, 1.0), (1e-3, 1.0), (1e3, 1e-6)] {
        let (speed, square) = (length / time, length * length);
        let text = format!(
            "[model]\nstates = [\"x\", \"v\"]\n\
             parameters = {{ mu = {:e}, w = {:e}, s = {length:e}, r = 0.8, c = {:e} }}\n\
             flow = {{ x = \"v\", v = \"-w^2*x + c*(mu - x^2 - v^2/w^2)*v\" }}\n\
             [[model.surface]]\nname = \"stop\"\nevent = \"s - x\"\nimpact = {{ v = \"-r*v\" }}\n\
             [grazing]\nsolve_for = \"s\"\nguess = {{ x = {length:e}, v = {:e} }}\n",
            0.3 * square,
            1.7 / time,
            1.0 / (square * time),
            1e-3 * speed,
        );
        let scene = parsed(&text, "cycle", &NONE);
        let ends = |name: &str| {
            let found = clear_interval(&scene, index(&scene, name), None).expect("followed");
            let found = found.expect("a cycle");
            assert!((found.gap / length - (1.0 - 0.3_f64.sqrt())).abs() < 1e-9, "{}", found.gap);
            found.ends.map(|end| end.map(|end| end.value()))
        };
        let [below, above] = ends("mu");
        assert_eq!(below, None);
        assert!((above.expect("a graze") / square - 1.0).abs() < 1e-10, "{above:?}");
        let [below, above] = ends("s");
        assert_eq!(above, None);
        assert!((below.expect("a graze") / length - 0.3_f64.sqrt()).abs() < 1e-10, "{below:?}");
        assert_eq!(ends("w"), [None, None]);
    }
}

/// The largest deflection of an asymmetric van der Pol cycle falls and grows with mu; it is 1.9 at
/// mu = 1.1762977453 by an integrator of order eight with a root finder.
#[test]
fn a_graze_at_twice_the_value_is_no_safe_parameter() {
    let text = r#"
[model]
states = ["x", "v"]
parameters = { mu = 0.6, q = 0.3, w0 = 1.7, s = 1.9, r = 0.8 }
flow = { x = "v", v = "mu*(1 - x^2)*v - w0^2*x - q*x^2" }
[[model.surface]]
name = "stop"
event = "s - x"
impact = { v = "-r*v" }
[grazing]
solve_for = "s"
guess = { x = 2.0, v = 0.0 }
"#;
    let scene = parsed(text, "asymmetric", &NONE);
    // An orbit that is followed from where it was found has its own period, not a multiple.
    let mut slow = scene.clone();
    for (name, value) in [("mu", 0.4), ("s", 1.95)] {
        let number = index(&slow, name);
        slow.model.parameters[number].value = Dd::from(value);
    }
    let first = clear_interval(&slow, index(&slow, "s"), None).expect("followed").expect("a cycle");
    let found = clear_interval(&slow, index(&slow, "w0"), Some(&first.start)).expect("followed");
    let ends = found.expect("a cycle").ends;
    let above = ends[1].as_ref().map(IntervalEnd::value);
    assert!((above.expect("a graze") - 2.834_194_425_3).abs() < 1e-9, "{ends:?}");
    for mu in [0.2, 0.6, 1.1] {
        let mut scene = scene.clone();
        let number = index(&scene, "mu");
        scene.model.parameters[number].value = Dd::from(mu);
        let found = clear_interval(&scene, number, None).expect("followed").expect("a cycle");
        let Some(IntervalEnd::Graze { value, .. }) = found.ends[1] else { panic!("{found:?}") };
        assert!(found.gap > 0.0 && (value - 1.176_297_745_3).abs() < 1e-9, "{mu}: {value}");
    }
}

/// The cycle `x = √μ cos t` of `x'' = −x + c (μ − x² − x'²) x'`, stable for `c > 0`.
fn cycle(event: &str, c: f64, guess: f64) -> Scene {
    let text = format!(
        r#"
[model]
states = ["x", "v"]
parameters = {{ mu = 0.3, s = 1.0, e = 0.1, r = 0.8, c = {c} }}
flow = {{ x = "v", v = "-x + c*(mu - x^2 - v^2)*v" }}
[[model.surface]]
name = "stop"
event = "{event}"
impact = {{ v = "-r*v" }}
[grazing]
solve_for = "s"
guess = {{ x = {guess:?}, v = 0.0 }}
"#
    );
    parsed(&text, "cycle", &NONE)
}

/// The gap has two minima in a period, of which one is a touch.
#[test]
fn a_cycle_with_two_minima_of_the_gap_is_located() {
    for guess in [0.5, 0.8, 2.0] {
        let scene = cycle("s - x^2 - e*x", 1.0, guess);
        let Ok(Location::Located(orbit)) = locate(&scene) else { panic!("no graze from {guess}") };
        let found = orbit.parameters()[index(&scene, "s")].to_f64();
        let known = 0.3 + 0.1 * 0.3_f64.sqrt();
        assert!((found - known).abs() < 1e-12, "{guess}: {found} {known}");
        assert!((orbit.period.to_f64() - std::f64::consts::TAU).abs() < 1e-12);
    }
}

#[test]
fn an_unstable_cycle_is_told_from_a_stable_one() {
    for (c, unstable) in [(1.0, false), (-1.0, true)] {
        let scene = cycle("s - x", c, 0.5);
        let found = clear_interval(&scene, index(&scene, "s"), None).expect("followed");
        assert_eq!(found.expect("a cycle").unstable, unstable, "{c}");
    }
}

/// The amplitude of this forced orbit is 0.4: beyond a second stop, if that stands nearer.
#[test]
fn an_orbit_through_another_stop_is_not_clear() {
    for (left, through) in [(0.3, Some(1)), (0.5, None)] {
        let text = format!(
            r#"
[model]
states = ["x", "v"]
parameters = {{ F = 0.4, s = 1.0, r = 0.8, w = 1e-2 }}
phase = {{ name = "th", rate = "w", period = "2*pi" }}
flow = {{ x = "v", v = "F*cos(th) - x - v" }}
[[model.surface]]
name = "stop"
event = "s - x"
impact = {{ v = "-r*v" }}
[[model.surface]]
name = "left"
event = "x + {left}"
impact = {{ v = "-r*v" }}
[grazing]
surface = "stop"
solve_for = "s"
"#
        );
        let scene = parsed(&text, "two", &NONE);
        let found = clear_interval(&scene, index(&scene, "s"), None).expect("followed");
        let found = found.expect("an orbit");
        assert_eq!((found.through, found.gap > 0.0), (through, true));
    }
}
