//! The scenes of the catalogue are read and mean what their literature says.

use grazemap::model::{Scene, catalogue};

use crate::support::reference::{number, read};
use crate::support::scenes::scene;

#[test]
fn every_scene_of_the_catalogue_is_read_without_fault() {
    for name in catalogue::names() {
        let text = catalogue::text(name).expect("a name of the catalogue has a text");
        let scene =
            Scene::parse(text, &format!("{name}.toml")).unwrap_or_else(|error| panic!("{error}"));
        assert_eq!(scene.identifier, name);
        assert!(catalogue::summary(name).is_some_and(|summary| !summary.is_empty()));
    }
}

/// A grazing point of the reference numbers: a scene, its parameters, its state and `h''` there.
#[derive(Clone)]
struct Reference {
    scene: String,
    parameters: Vec<(&'static str, f64)>,
    state: Vec<f64>,
    normal_acceleration: f64,
}

/// The grazing points of `beam_tables.json` that have a scene; of two branches the larger is the
/// scene's.
fn cantilevers() -> Vec<Reference> {
    let table = read("rigid/beam_tables.json");
    let rows =
        table.as_array().expect("a list of rows").iter().filter(|row| row["zeta"] != "1.257");
    let large = rows.filter(|row| {
        let two_branches = ["0.12", "0.123", "0.1257"].iter().any(|zeta| row["zeta"] == *zeta);
        !two_branches || number(&row["Q_G_qmin"]) < -0.6
    });
    let reference = |row: &serde_json::Value| {
        let zeta = row["zeta"].as_str().expect("text").replace('.', "_");
        let soft = if row["alpha"] == "0.2" { "_soft" } else { "" };
        let event = number(&row["Q_G_qmin"]);
        Reference {
            scene: format!("cantilever_{zeta}{soft}"),
            parameters: vec![("Q", event)],
            state: vec![event, 0.0, number(&row["t_G"])],
            normal_acceleration: number(&row["a_G"]),
        }
    };
    large.map(reference).collect()
}

/// The base points of the public truth files: `h'' = −a*` by the equations printed in them.
fn oscillators() -> Vec<Reference> {
    let electrostatic = |file: &str, scene: &str| {
        let base = &read(&format!("rigid/{file}"))["base"];
        let (voltage, theta) = (number(&base["V_star"]), number(&base["theta_star"]));
        Reference {
            scene: scene.to_owned(),
            parameters: vec![("V", voltage), ("omega", number(&base["omega_star"]))],
            state: vec![0.5, 0.0, theta],
            normal_acceleration: 0.5 - (voltage * theta.sin() / 0.5).powi(2),
        }
    };
    let linear = |file: &str, scene: &str| {
        let base = &read(&format!("rigid/{file}"))["base"];
        let omega = number(&base["omega_star"]);
        Reference {
            scene: scene.to_owned(),
            parameters: vec![("alpha", number(&base["alpha_star"])), ("omega", omega)],
            state: vec![1.0, 0.0, number(&base["theta_star"])],
            normal_acceleration: omega * omega,
        }
    };
    vec![
        electrostatic("public_mems_w0.46.json", "mems"),
        electrostatic("public_mems_w0.4878_codim2.json", "mems_codim2"),
        electrostatic("public_mems_scenario3_codim2.json", "mems_scenario3"),
        linear("public_linear_w1.8.json", "linear"),
        linear("public_linear_codim2.json", "linear_codim2"),
    ]
}

/// The soft impacts: the sets of `taylor_2var.json` that have a scene, `h'' = sigma omega^2`.
fn soft_impacts() -> Vec<Reference> {
    let sets = read("soft/taylor_2var.json");
    let reference = |(scene, set): (&str, &str)| {
        let (set, omega) = (&sets[set], number(&sets[set]["w"]));
        Reference {
            scene: scene.to_owned(),
            parameters: vec![("A", number(&set["A_g"])), ("omega", omega)],
            state: vec![1.0, 0.0, number(&set["phase_g"])],
            normal_acceleration: omega * omega,
        }
    };
    let sets_of_scenes = [
        ("soft_a", "A1"),
        ("soft_b", "B1"),
        ("soft_b_surface", "B1"),
        ("soft_a_stiff", "A1"),
        ("soft_b_stiff", "B1"),
        ("soft_c", "C1"),
        ("soft_d", "D1"),
    ];
    sets_of_scenes.map(reference).to_vec()
}

/// At the reference's grazing point `h = h' = 0` and `h''` is the reference's: the scene's
/// equations are the literature's. The tolerance is the rounding of about ten operations on numbers
/// of order one. The guess must lie near that point, or the orbit found would be another branch's.
#[test]
fn scenes_graze_where_the_reference_numbers_say() {
    let references: Vec<Reference> =
        cantilevers().into_iter().chain(oscillators()).chain(soft_impacts()).collect();
    assert_eq!(references.len(), 24);
    for Reference { scene: name, parameters, state, normal_acceleration } in references {
        let scene = scene(&name);
        let model = &scene.model;
        let value = |parameter: &grazemap::model::Parameter| {
            let given = parameters.iter().find(|(name, _)| *name == parameter.name);
            given.map_or(parameter.value.hi, |&(_, value)| value)
        };
        let inputs: Vec<f64> =
            state.iter().copied().chain(model.parameters.iter().map(value)).collect();
        let mut values = Vec::new();
        model.graph.evaluate(&inputs, &mut values);
        let stop = &model.surfaces[0];
        assert!(values[stop.event.index()].abs() < 1e-14, "{name}");
        assert!(values[stop.normal_velocity.index()].abs() < 1e-14, "{name}");
        let error = values[stop.normal_acceleration.index()] - normal_acceleration;
        assert!(error.abs() < 1e-14, "{name}: h'' is off by {error:e}");
        let guess = scene.grazing.guess.as_ref().expect("every scene of the catalogue has a guess");
        let distance = guess
            .iter()
            .zip(&state)
            .map(|(guess, exact)| (guess - exact).abs())
            .fold(0.0, f64::max);
        assert!(distance < 2e-3, "{name}: the guess is off by {distance}");
    }
}
