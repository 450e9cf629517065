//! Loci in two parameters against the closed form of one-impact orbits of the linear oscillator.

use grazemap::Map;
use grazemap::analysis::NoProgress;
use grazemap::analysis::loci::{CodimensionTwo, Loci, LociRequest, Locus, LocusKind};
use grazemap::analysis::periodic::ContactItinerary;
use grazemap::model::catalogue;
use grazemap::numeric::Dd;
use grazemap::prelude::{FindGraze, Scene};

use crate::support::foale::Foale;
use crate::support::scenes::{self, parsed};
use crate::support::tiers;

/// `x'' + 0.04 x' + x = A cos(w t) − 1` below a stop at 0, `r = 0.9`, where `ξ_2 = 0`.
const VIVID: &str = include_str!("../data/loci/vivid.toml");

fn map_of(scene: Scene) -> Map {
    scene.graze().and_then(|graze| graze.map()).expect("a map")
}

/// The loci in frequency and amplitude, both active, the amplitude first.
fn found(map: &Map, itineraries: &[&str], kinds: &[LocusKind], reach: f64, direct: bool) -> Loci {
    let itineraries = itineraries.iter();
    let parse = |digits: &&str| ContactItinerary::parse(digits, 1).expect("digits");
    let request = LociRequest {
        plane: [1, 0],
        range: [-reach, reach],
        at: vec![0.0, 0.0],
        kinds: kinds.to_vec(),
        itineraries: itineraries.map(parse).collect(),
        direct,
    };
    map.loci(&request, &NoProgress).expect("loci")
}

/// Largest error of the amplitude on a locus, and how many points it has.
fn error(map: &Map, locus: &Locus, form: [f64; 2], all: bool) -> (f64, usize) {
    let [zeta, r] = form.map(Dd::from);
    let parameters = &map.local().parameters;
    let [amplitude, frequency] = [0, 1].map(|place| parameters[place].value);
    let points = locus.points.iter().filter(|point| point.physical && (all || point.inside));
    let errors = points.clone().map(|point| {
        let omega = frequency + Dd::from(point.parameters[1]);
        let closed = Foale::new(omega, zeta, r, locus.itinerary.period());
        let exact = match locus.kind {
            LocusKind::Fold => closed.fold(),
            LocusKind::Flip => closed.flip(),
            _ => closed.gain(),
        };
        (amplitude + Dd::from(point.parameters[0]) - exact).to_f64().abs()
    });
    (errors.fold(0.0, f64::max), points.count())
}

fn of_kind(loci: &Loci, kind: LocusKind, digits: &str) -> Locus {
    let mut loci = loci.loci.iter();
    let locus = loci.find(|locus| locus.kind == kind && locus.itinerary.to_string() == digits);
    locus.unwrap_or_else(|| panic!("no {} of {digits}", kind.word())).clone()
}

#[test]
fn folds_and_flips_of_period_two_are_those_of_the_closed_form() {
    let map = map_of(parsed(VIVID, "vivid", &[("", ""); 0]));
    let loci = found(&map, &["10"], &LocusKind::ALL, 1e-4, false);
    let kinds = [(LocusKind::Graze, "0"), (LocusKind::Fold, "10"), (LocusKind::Flip, "10")];
    for (kind, digits) in kinds {
        let locus = of_kind(&loci, kind, digits);
        let (error, points) = error(&map, &locus, [0.02, 0.9], false);
        assert!(error < 1e-16 && points > 20, "{}: {error:e}, {points} points", kind.word());
        let labels: Vec<_> = locus.points.iter().filter_map(|point| point.label).collect();
        let expected = match kind {
            LocusKind::Graze => CodimensionTwo::Xi(2),
            LocusKind::Fold => CodimensionTwo::FoldGraze,
            _ => CodimensionTwo::FlipGraze,
        };
        assert_eq!(labels, [expected]);
        let there = locus.points.iter().find(|point| point.label.is_some()).expect("labelled");
        // The scene stands at the point.
        assert!(there.parameters.iter().all(|offset| offset.abs() < 1e-14), "{there:?}");
    }
}

/// Whether the tangencies of one-impact orbits agree with the closed form at their point, to eight
/// digits; which they are.
fn checked_tangencies(map: &Map, loci: &Loci, [zeta, r]: [f64; 2]) -> Vec<(LocusKind, String)> {
    let frequency = map.local().parameters[1].value;
    let mut kinds = Vec::new();
    for found in &loci.tangencies {
        let period = found.itinerary.period();
        let leaving = |t: f64| {
            let omega = frequency + Dd::from(t);
            let closed = Foale::new(omega, Dd::from(zeta), Dd::from(r), period);
            let fold = found.kind == LocusKind::Fold;
            let locus = if fold { closed.fold() } else { closed.flip() };
            (locus - closed.gain()) / Dd::from(t * t)
        };
        // The even part of the quotient, its square taken away.
        let even = |t: f64| (leaving(t) + leaving(-t)).to_f64() / 2.0;
        let [wide, near] = [2e-5, 1e-5].map(even);
        let exact = (4.0 * near - wide) / 3.0;
        let apart = |value: f64| ((value - exact) / exact).abs();
        assert!(apart(found.coefficient) < 1e-8, "{found:?} {exact}");
        assert!(apart(found.fitted.expect("a fit")) < 1e-8, "{found:?} {exact}");
        kinds.push((found.kind, found.itinerary.to_string()));
    }
    kinds
}

#[test]
fn tangencies_from_jets_are_those_of_the_closed_form() {
    let map = map_of(parsed(VIVID, "vivid", &[("", ""); 0]));
    let loci = found(&map, &["10"], &[LocusKind::Fold, LocusKind::Flip], 1e-5, false);
    let kinds = checked_tangencies(&map, &loci, [0.02, 0.9]);
    assert_eq!(kinds, [LocusKind::Fold, LocusKind::Flip].map(|kind| (kind, "10".to_owned())));
}

#[test]
fn a_locus_along_which_the_first_parameter_is_constant_is_found() {
    // `s` moves the oscillator and its stop: it changes no amplitude.
    let mut text = catalogue::text("linear_codim2").expect("a scene").to_owned();
    for (old, new) in [
        ("zeta*v - x", "zeta*v - (x - s)"),
        ("delta - x", "delta + s - x"),
        ("delta = 1.0,", "delta = 1.0, s = 0.0,"),
        (r#"active = ["alpha", "omega"]"#, r#"active = ["alpha", "s"]"#),
        ("omega = 1e-3 }", "s = 1e-3 }"),
        ("1.9974984355438178915780382328058", "1.9995"),
    ] {
        assert!(text.contains(old), "{old}");
        text = text.replace(old, new);
    }
    let map = map_of(parsed(&text, "moved", &[("", ""); 0]));
    let [omega, zeta, r] = ["1.9995", "0.05", "0.8"].map(|value| value.parse().expect("a number"));
    let flip = (Foale::new(omega, zeta, r, 1).flip() - map.local().parameters[0].value).to_f64();
    // Direct simulation takes 16 s.
    for direct in [false, true].into_iter().take(tiers::count(1, 2)) {
        let request = LociRequest {
            plane: [0, 1],
            range: [-1e-3, 1e-3],
            at: vec![0.0, 0.0],
            kinds: vec![LocusKind::Flip],
            itineraries: vec![ContactItinerary::parse("1", 1).expect("digits")],
            direct,
        };
        let loci = map.loci(&request, &NoProgress).expect("loci");
        let locus = of_kind(&loci, LocusKind::Flip, "1");
        let inside = locus.points.iter().filter(|point| point.inside);
        let errors = inside.clone().map(|point| (point.parameters[0] - flip).abs());
        let error = errors.fold(0.0, f64::max);
        assert!(inside.count() > 20 && error < 1e-13, "{direct}: {error:e}, {flip:e}");
    }
}

#[test]
fn a_tangency_settles_where_the_point_is_exact() {
    let map = map_of(Scene::of_catalogue("linear_codim2").expect("a scene"));
    let loci = found(&map, &["1"], &[LocusKind::Fold, LocusKind::Flip], 1e-5, false);
    let kinds = checked_tangencies(&map, &loci, [0.05, 0.8]);
    assert_eq!(kinds, [LocusKind::Fold, LocusKind::Flip].map(|kind| (kind, "1".to_owned())));
}

#[test]
#[ignore = "long: .ci/full runs it"]
fn direct_simulation_has_the_locus_to_thirteen_digits() {
    let map = map_of(parsed(VIVID, "vivid", &[("", ""); 0]));
    let loci = found(&map, &["10"], &[LocusKind::Flip, LocusKind::Graze], 2e-5, true);
    let flips = of_kind(&loci, LocusKind::Flip, "10");
    let (worst, points) = error(&map, &flips, [0.02, 0.9], true);
    assert!(worst < 1e-15 && points > 20, "{worst:e}, {points} points");
    // Simulation is where the orbit is: on one side of the graze, which it reaches.
    assert!(flips.points.iter().all(|point| point.parameters[1] >= -1e-16));
    let ends = flips.points.iter().filter(|p| p.label == Some(CodimensionTwo::FlipGraze));
    let ends: Vec<f64> = ends.map(|point| point.parameters[1].abs()).collect();
    assert!(ends.len() == 1 && ends[0] < 1e-16, "{ends:?}");
    let (worst, points) = error(&map, &of_kind(&loci, LocusKind::Graze, "0"), [0.02, 0.9], true);
    assert!(worst < 1e-13 && points > 4, "{worst:e}, {points} points");
}

#[test]
fn loci_of_periods_one_to_four_meet_where_the_sine_vanishes() {
    let map = map_of(Scene::of_catalogue("linear_codim2").expect("a scene"));
    let kinds = [LocusKind::Fold, LocusKind::Flip];
    let itineraries = ["1", "10", "100", "1000"];
    let loci = found(&map, &itineraries, &kinds, 1e-4, false);
    for digits in itineraries {
        for kind in kinds {
            let locus = of_kind(&loci, kind, digits);
            let (error, points) = error(&map, &locus, [0.05, 0.8], false);
            // The map's own error, 3.5e-7 at the edge of its window, falls with its depth.
            assert!(error < 2e-10, "{} of {digits}: {error:e}, {points}", kind.word());
        }
    }
}

#[test]
fn direct_simulation_alone_finds_a_fold_where_no_map_reaches() {
    let map = map_of(Scene::of_catalogue("foale").expect("a scene"));
    let loci = found(&map, &["1"], &[LocusKind::Fold], 0.3, true);
    let fold = of_kind(&loci, LocusKind::Fold, "1");
    let (worst, points) = error(&map, &fold, [0.05, 0.7], true);
    assert!(worst < 1e-12 && points > 20, "{worst:e}, {points} points");
    // From speeds of 3 down to the graze at omega = 2 sqrt(1 - zeta^2), where it ends.
    let speeds = fold.points.iter().map(|point| point.depth_variables[0]);
    assert!(speeds.fold(0.0, f64::max) > 3.0);
    let last = fold.points.iter().find(|p| p.label == Some(CodimensionTwo::FoldGraze));
    let at = 2.0 * (1.0_f64 - 0.05 * 0.05).sqrt() - 1.8;
    assert!((last.expect("an end").parameters[1] - at).abs() < 1e-14, "{last:?}");
}

/// The largest displacement of the orbit with one impact of this speed in `returns` periods,
/// a tenth of a period and more away from the impact: the linear oscillator's closed form.
fn highest_between(omega: f64, [zeta, r]: [f64; 2], returns: usize, speed: f64) -> f64 {
    let damped = (1.0 - zeta * zeta).sqrt();
    let free = |t: f64| {
        let (sin, cos) = (damped * t).sin_cos();
        let decay = (-zeta * t).exp();
        let m11 = decay * (cos + zeta * sin / damped);
        let m22 = decay * (cos - zeta * sin / damped);
        let m12 = decay * sin / damped;
        [[m11, m12], [-m12, m22]]
    };
    let period = 2.0 * std::f64::consts::PI * returns as f64 / omega;
    // (M - 1)(a, b) = (0, (1 + r) v): what of the orbit is not forced, after the impact.
    let [[m11, m12], [m21, m22]] = free(period);
    let (p, q) = (m11 - 1.0, m22 - 1.0);
    let b = (1.0 + r) * speed * p / (p * q - m12 * m21);
    let a = -m12 * b / p;
    let forced = [1.0 - a, (-r * speed - b) / omega];
    let at = |t: f64| {
        let [[m11, m12], _] = free(t);
        let (sin, cos) = (omega * t).sin_cos();
        m11 * a + m12 * b + forced[0] * cos + forced[1] * sin
    };
    let (from, to) = (0.1 * period / returns as f64, period * (1.0 - 0.1 / returns as f64));
    let place = |number: usize| from + (to - from) * number as f64 / 2000.0;
    let best = (1..2000).max_by(|&a, &b| at(place(a)).total_cmp(&at(place(b))));
    // The parabola through three samples, twice.
    let (mut middle, mut step) = (place(best.expect("samples")), place(1) - place(0));
    for _ in 0..3 {
        let [low, here, high] = [-step, 0.0, step].map(|by| at(middle + by));
        middle += 0.5 * step * (low - high) / (low - 2.0 * here + high);
        step *= 0.1;
    }
    at(middle)
}

#[test]
fn grazes_of_orbits_with_impacts_are_those_of_the_closed_form() {
    let map = map_of(Scene::of_catalogue("linear_codim2").expect("a scene"));
    for &direct in tiers::part(&[false, true], 1) {
        let loci = found(&map, &["10"], &[LocusKind::Graze], 1e-3, direct);
        let graze = of_kind(&loci, LocusKind::Graze, "01");
        let begun_later = found(&map, &["01"], &[LocusKind::Graze], 1e-3, direct);
        assert_eq!(begun_later.loci, loci.loci);
        let parameters = &map.local().parameters;
        let points = graze.points.iter().filter(|point| point.physical && point.inside);
        let points: Vec<_> = points.filter(|point| point.depth_variables[1] > 1e-9).collect();
        assert!(points.len() > 10, "{}", points.len());
        for point in points {
            let [alpha, omega] =
                [0, 1].map(|place| parameters[place].value + Dd::from(point.parameters[place]));
            let closed = Foale::new(omega, Dd::from(0.05), Dd::from(0.8), 2);
            // By the map `h = -y²` is given, and `h'' = omega²`.
            let y = point.depth_variables[1];
            let near = if direct { y } else { y * 2.0_f64.sqrt() * omega.to_f64() };
            let speeds = closed.speeds(alpha).map(|speed| speed.to_f64());
            let [a, b] = speeds.map(|speed| (speed - near).abs());
            let speed = if a < b { speeds[0] } else { speeds[1] };
            let highest = highest_between(omega.to_f64(), [0.05, 0.8], 2, speed);
            // The map's error falls with its depth.
            let most = if direct { 1e-12 } else { 1e-9 };
            assert!((highest - 1.0).abs() < most, "{direct} {highest} {point:?}");
        }
    }
}

#[test]
fn a_compliant_stop_has_its_loci_and_no_tangency() {
    let cases = [("soft_b", vec!["0"]), ("soft_b_stiff", vec!["0", "1", "01"])];
    for (name, kinds) in tiers::part(&cases, 1) {
        let map = map_of(Scene::of_catalogue(name).expect("a scene"));
        let loci = found(&map, &["1", "11"], &[LocusKind::Graze, LocusKind::Flip], 2e-5, false);
        assert!(loci.tangencies.is_empty() && loci.without_kick == [0], "{name}");
        let physical = loci.loci.iter().filter(|locus| locus.points.iter().any(|p| p.physical));
        let found: Vec<String> = physical.map(|locus| locus.itinerary.to_string()).collect();
        for digits in kinds {
            assert!(found.iter().any(|other| other == digits), "{name} {digits}: {found:?}");
        }
        // The amplitude of the graze is a closed form.
        let graze = of_kind(&loci, LocusKind::Graze, "0");
        let parameters = &map.local().parameters;
        for point in graze.points.iter().filter(|point| point.inside) {
            let [a, omega] =
                [0, 1].map(|place| parameters[place].value + Dd::from(point.parameters[place]));
            let stiff = Dd::ONE - omega * omega;
            let damped = Dd::from(0.03) * omega;
            let gain = (stiff * stiff + damped * damped).sqrt();
            assert!((a - gain).to_f64().abs() < 1e-15, "{name} {point:?}");
        }
        let labels = loci.loci.iter().flat_map(|locus| locus.points.iter().map(|p| p.label));
        assert!(labels.flatten().next().is_none(), "{name}");
    }
}

/// A doubled orbit of two alike contacts is one orbit, whichever of them it is begun at.
#[test]
fn a_flip_of_two_alike_contacts_is_followed_once() {
    let map = map_of(Scene::of_catalogue("mems_codim2").expect("a scene"));
    let width = map.local().window.parameter[1];
    let found = found(&map, &["1", "11"], &[LocusKind::Flip], width, false);
    let doubled = found.loci.iter().filter(|locus| locus.itinerary.to_string() == "11");
    assert_eq!(doubled.count(), 1);
}

#[test]
fn a_torus_locus_of_direct_simulation_is_where_the_map_keeps_areas() {
    // Negative damping and a restitution below 1: areas change by `r^2 exp(-4 pi zeta / omega)`.
    let active = ("expansion.active", r#"["omega", "zeta"]"#);
    let window = ("window.parameter", "{ omega = 1e-3, zeta = 1e-3 }");
    let set = [("zeta", "-0.05"), ("r", "0.84"), active, window];
    let scene = parsed(scenes::text("linear"), "linear", &set);
    let map = map_of(scene);
    let request = LociRequest {
        plane: [0, 1],
        range: [-0.02, 0.02],
        at: vec![0.0, 0.0],
        kinds: vec![LocusKind::Torus],
        itineraries: vec![ContactItinerary::parse("1", 1).expect("digits")],
        direct: true,
    };
    let loci = map.loci(&request, &NoProgress).expect("loci");
    let torus = of_kind(&loci, LocusKind::Torus, "1");
    let parameters = &map.local().parameters;
    for point in &torus.points {
        let [omega, zeta] =
            [0, 1].map(|place| parameters[place].value.to_f64() + point.parameters[place]);
        let exact = omega * 0.84_f64.ln() / (2.0 * std::f64::consts::PI);
        assert!((zeta - exact).abs() < 1e-15, "{point:?}");
        // The trace tells the angle; the product of both multipliers is 1.
        let [re, im] = point.multipliers[0];
        assert!((re * re + im * im - 1.0).abs() < 1e-13 && im != 0.0, "{point:?}");
    }
    let ends = [torus.points.first(), torus.points.last()];
    let mut ends = ends.map(|point| point.expect("a point").parameters[0]);
    ends.sort_by(f64::total_cmp);
    assert!((ends[0] + 0.02).abs() < 1e-12 && (ends[1] - 0.02).abs() < 1e-12, "{ends:?}");
}
