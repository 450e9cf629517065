//! Requests that are answered by direct simulation without a map: contacts without an expansion.

use grazemap::analysis::branches::BranchRequest;
use grazemap::analysis::diagram::Diagram;
use grazemap::analysis::periodic::ContactItinerary;
use grazemap::analysis::{AnalysisError, ImageRequest, ImageRow, NoProgress, Precision, Using};
use grazemap::iteration::Period;
use grazemap::numeric::Dd;
use grazemap::pipeline::Source;
use grazemap::report::diagram_warnings;
use grazemap::{Error, FindGraze, Map, Scene};

use crate::support::foale::Foale;
use crate::support::scenes::parsed;

/// An oscillator whose restitution falls with a power of the speed.
fn viscoelastic() -> Scene {
    Scene::load("tests/data/outside/f10_restitution_power.toml").expect("a scene")
}

fn free_flight(scene: Scene) -> Map {
    Source::Scene(Box::new(scene)).free_flight().expect("the free flight is analytic")
}

/// Amplitude at which an orbit with one impact of this speed a period exists.
fn amplitude(scene: &Scene, speed: f64) -> f64 {
    let value = |name: &str| {
        let mut parameters = scene.model.parameters.iter();
        parameters.find(|parameter| parameter.name == name).expect("a parameter").value
    };
    let restitution = value("r") / (Dd::ONE + Dd::from(speed.powf(0.25)));
    Foale::new(value("w"), value("zeta"), restitution, 1).alpha(Dd::from(speed)).to_f64()
}

#[test]
fn a_restitution_without_an_expansion_is_refused_with_surface_and_power() {
    let error = viscoelastic().graze().and_then(|graze| graze.map()).expect_err("a power");
    let words = error.to_string();
    assert!(
        words.contains("the impact of surface `stop` is not analytic") && words.contains("0.25"),
        "{words}"
    );
}

#[test]
fn a_diagram_of_direct_simulation_has_the_orbits_of_the_closed_form_without_a_map() {
    let map = free_flight(viscoelastic());
    let tables = "[[diagram]]\nparameter = \"A\"\nrange = [0.14, 0.3]\npoints = 4\n\
                  transient = 300\nkeep = 8\nobserve = \"impact_speed\"\nwith = [\"direct\"]\n";
    let map = map.asking(tables).expect("a diagram");
    let diagram = map.diagram(&map.scene().diagrams[0]).expect("no map is needed");
    let grazing = diagram.grazing_value;
    let mut checked = 0;
    for point in diagram.sweeps.iter().flat_map(|sweep| &sweep.points) {
        let speed = point.kept_values().next().unwrap_or(f64::NAN);
        if point.period == Period::Periodic(1) && point.kept_contacts as usize == point.kept {
            let expected = amplitude(map.scene(), speed);
            // Orbits have settled to 1e-8 of the units of the section.
            assert!((grazing + point.offset - expected).abs() < 1e-6, "{} {speed}", point.offset);
            checked += 1;
        }
    }
    assert!(checked > 0, "no orbit with one impact a period");
}

/// The warnings and the diagram of a tapping cantilever on a section.
fn tapped(section: &[(&str, &str)]) -> (Vec<String>, Diagram) {
    let text = include_str!("../data/outside/tapping_cantilever.toml");
    let map = free_flight(parsed(text, "tapping_cantilever", section));
    let diagram = map.diagram(&map.scene().diagrams[0]).expect("no map is needed");
    (diagram_warnings(std::slice::from_ref(&diagram)), diagram)
}

#[test]
fn a_contact_behind_which_free_flight_does_not_turn_has_its_orbits_on_a_stroboscopic_section() {
    let (warnings, diagram) = tapped(&[]);
    assert_eq!(diagram.sweeps[0].points[1].kept, 0);
    let [warning] = &warnings[..] else { panic!("{warnings:?}") };
    assert!(
        warning.contains("1 of 2 values of A end at a point without an image")
            && warning.contains("`kind = \"stroboscopic\"`"),
        "{warning}"
    );
    let (warnings, diagram) = tapped(&[("section.kind", "stroboscopic"), ("section.phase", "3.0")]);
    assert_eq!(warnings, [""; 0]);
    let first = &diagram.sweeps[0].points[0];
    assert_eq!((first.period, first.kept_contacts), (Period::Periodic(1), 4));
    // The head of the file has the point of an independent integration.
    assert!((first.values[0] - -0.92564689).abs() < 1e-7, "{}", first.values[0]);
    assert_eq!(diagram.sweeps[0].points[1].period, Period::Periodic(1));
}

#[test]
fn branches_of_direct_simulation_have_the_orbits_of_the_closed_form_without_a_map() {
    let map = Source::Scene(Box::new(viscoelastic())).map_or_free_flight().expect("no map");
    assert!(!map.local().has_contacts());
    assert!(map.remarks().any(|remark| remark.contains("power")), "the reason is said");
    let request = BranchRequest {
        itineraries: vec![ContactItinerary::parse("1", 1).expect("an itinerary")],
        longest: 1,
        along: 0,
        range: [-0.002, 0.02],
        at: vec![0.0, 0.0],
        direct: true,
        starts: Vec::new(),
    };
    let found = map.branches(&request, &NoProgress).expect("branches");
    let graze = map.parameter("A").expect("a parameter");
    let points = found.branches.iter().flat_map(|branch| &branch.points);
    let hits: Vec<_> = points.filter(|point| point.orbit.contacts.len() == 1).collect();
    // Near the graze a fourth root of the speed is steeper than the model used there for contacts
    // that double precision does not resolve.
    let resolved: Vec<_> =
        hits.into_iter().filter(|point| point.orbit.contacts[0].speed > 1e-3).collect();
    assert!(resolved.len() > 20, "{} points with an impact", resolved.len());
    for point in resolved {
        let expected = amplitude(map.scene(), point.orbit.contacts[0].speed);
        let found = graze + point.orbit.parameters[0];
        // Orbits are solved for to double precision, and multipliers reach 1e3.
        assert!((found - expected).abs() < 1e-12, "{found} {expected}");
    }
}

#[test]
fn images_of_direct_simulation_do_not_depend_on_the_expansion() {
    let scene = || Scene::of_catalogue("linear").expect("a scene");
    let request = ImageRequest {
        rows: [1e-4, -1e-4].map(|x| row([x, 1e-3])).into(),
        iterations: 3,
        using: Using::Direct,
        precision: Precision::F64,
    };
    let map = scene().graze().and_then(|graze| graze.map()).expect("a map");
    let [with, without] = [map, free_flight(scene())].map(|map| {
        let records = map.images(&request).expect("images");
        records.into_iter().map(|record| (record.offsets, record.contacts)).collect::<Vec<_>>()
    });
    assert_eq!(with, without);
    assert!(with.iter().any(|(_, contacts)| *contacts > 0));
}

fn row(state: [f64; 2]) -> ImageRow {
    ImageRow { state: state.map(Dd::from).into(), parameters: vec![Dd::ZERO; 2] }
}

#[test]
fn what_iterates_contacts_is_refused_where_none_are_expanded() {
    let map = free_flight(Scene::of_catalogue("linear").expect("a scene"));
    for using in [Using::Map, Using::Guarded, Using::Discontinuity] {
        let request = ImageRequest {
            rows: vec![row([1e-4, 0.0])],
            iterations: 1,
            using,
            precision: Precision::F64,
        };
        let refused = map.images(&request);
        assert!(matches!(refused, Err(Error::Analysis(AnalysisError::NoContacts))), "{refused:?}");
    }
    let refused = map.diagrams(&NoProgress);
    assert!(matches!(refused, Err(Error::Analysis(AnalysisError::NoContacts))));
    assert!(map.iterate(&[1e-4, 0.0], &[0.0, 0.0], 1).is_ok_and(|images| !images[0].step.valid));
}
