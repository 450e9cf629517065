//! Scenes with keys set, and the orbits on which they graze.

use grazemap::model::{Scene, catalogue};
use grazemap::numeric::Dd;
use grazemap::orbit::{GrazingOrbit, locate};

/// No key set.
pub(crate) const NONE: [(&str, &str); 0] = [];

/// A scene of the catalogue.
pub(crate) fn scene(name: &str) -> Scene {
    scene_with(name, &NONE)
}

/// A scene of the catalogue, with keys set.
pub(crate) fn scene_with<K: AsRef<str>, V: AsRef<str>>(name: &str, set: &[(K, V)]) -> Scene {
    parsed(text(name), name, set)
}

/// The text of a scene of the catalogue.
pub(crate) fn text(name: &str) -> &'static str {
    catalogue::text(name).unwrap_or_else(|| panic!("no scene `{name}`"))
}

/// The text of a scene that came from outside: a system that others published, or one of a fault.
pub(crate) fn outside_text(name: &str) -> String {
    let read = |folder: &str| {
        let path = format!("{}/{folder}/{name}.toml", env!("CARGO_MANIFEST_DIR"));
        std::fs::read_to_string(path).ok()
    };
    let found = ["gallery/outside/scenes", "tests/data/outside"].into_iter().find_map(read);
    found.unwrap_or_else(|| panic!("no scene `{name}` from outside"))
}

/// A scene by its text, with keys set.
pub(crate) fn parsed<K: AsRef<str>, V: AsRef<str>>(
    text: &str,
    name: &str,
    set: &[(K, V)],
) -> Scene {
    let owned = |(key, value): &(K, V)| (key.as_ref().to_owned(), value.as_ref().to_owned());
    let set: Vec<_> = set.iter().map(owned).collect();
    Scene::parse_with(text, name, &set).unwrap_or_else(|error| panic!("{error}"))
}

/// The grazing orbit of a scene.
pub(crate) fn orbit(scene: &Scene) -> GrazingOrbit {
    let location = locate(scene).expect("no wrong input").into_result();
    location.unwrap_or_else(|reason| panic!("{}: {reason}", scene.identifier))
}

/// A scene of the catalogue and its grazing orbit.
pub(crate) fn grazing(name: &str) -> (Scene, GrazingOrbit) {
    grazing_by(text(name), name, &NONE)
}

/// A scene by its text, with keys set, and its grazing orbit.
pub(crate) fn grazing_by(text: &str, name: &str, set: &[(&str, &str)]) -> (Scene, GrazingOrbit) {
    let scene = parsed(text, name, set);
    let orbit = orbit(&scene);
    (scene, orbit)
}

/// The number of a parameter of the model.
pub(crate) fn index(scene: &Scene, name: &str) -> usize {
    let mut parameters = scene.model.parameters.iter();
    let index = parameters.position(|parameter| parameter.name == name);
    index.unwrap_or_else(|| panic!("{} has no parameter `{name}`", scene.identifier))
}

/// A parameter of the model where the orbit grazes.
pub(crate) fn parameter(scene: &Scene, orbit: &GrazingOrbit, name: &str) -> Dd {
    orbit.parameters()[index(scene, name)]
}
