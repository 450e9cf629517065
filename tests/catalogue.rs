//! The scenes of the catalogue are read and mean what their literature says.

use grazemap::model::{Scene, catalogue};

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
