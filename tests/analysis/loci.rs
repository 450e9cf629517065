//! Loci in two parameters against the closed form of one-impact orbits of the linear oscillator.

use grazemap::Map;
use grazemap::analysis::loci::{CodimensionTwo, Loci, LociRequest, Locus, LocusKind};
use grazemap::analysis::periodic::ContactItinerary;
use grazemap::numeric::Dd;
use grazemap::prelude::{FindGraze, Scene};

use crate::support::foale::Foale;
use crate::support::scenes::parsed;

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
    map.loci(&request).expect("loci")
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

#[test]
fn tangencies_from_jets_are_those_of_the_closed_form() {
    let map = map_of(parsed(VIVID, "vivid", &[("", ""); 0]));
    let loci = found(&map, &["10"], &[LocusKind::Fold, LocusKind::Flip], 1e-5, false);
    let frequency = map.local().parameters[1].value;
    let leaving = |kind: LocusKind, t: f64| {
        let closed = Foale::new(frequency + Dd::from(t), Dd::from(0.02), Dd::from(0.9), 2);
        let locus = if kind == LocusKind::Fold { closed.fold() } else { closed.flip() };
        (locus - closed.gain()) / Dd::from(t * t)
    };
    // The even part of the quotient, its square taken away.
    let even = |kind, t| (leaving(kind, t) + leaving(kind, -t)).to_f64() / 2.0;
    let mut kinds = Vec::new();
    for found in &loci.tangencies {
        let [wide, near] = [2e-5, 1e-5].map(|t| even(found.kind, t));
        let exact = (4.0 * near - wide) / 3.0;
        let apart = |value: f64| ((value - exact) / exact).abs();
        assert!(apart(found.coefficient) < 1e-8, "{found:?} {exact}");
        assert!(apart(found.fitted.expect("a fit")) < 1e-8, "{found:?} {exact}");
        kinds.push(found.kind);
    }
    assert_eq!(kinds, [LocusKind::Fold, LocusKind::Flip]);
}

#[test]
fn direct_simulation_has_the_locus_to_thirteen_digits() {
    let map = map_of(parsed(VIVID, "vivid", &[("", ""); 0]));
    let loci = found(&map, &["10"], &[LocusKind::Flip, LocusKind::Graze], 2e-5, true);
    let flips = of_kind(&loci, LocusKind::Flip, "10");
    let (worst, points) = error(&map, &flips, [0.02, 0.9], true);
    assert!(worst < 1e-15 && points > 20, "{worst:e}, {points} points");
    // Simulation is where the orbit is: on one side of the graze.
    assert!(flips.points.iter().all(|point| point.parameters[1] > 0.0));
    let (worst, points) = error(&map, &of_kind(&loci, LocusKind::Graze, "0"), [0.02, 0.9], true);
    assert!(worst < 1e-13 && points > 4, "{worst:e}, {points} points");
}

#[test]
fn loci_of_periods_one_to_four_meet_where_the_sine_vanishes() {
    let map = map_of(Scene::load("scenes/linear_codim2.toml").expect("a scene"));
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
