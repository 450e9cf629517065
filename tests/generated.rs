//! The checked-in crate of emitted maps is what would be emitted today.
//!
//! `UPDATE_GENERATED=1 cargo test --test generated` writes it anew.

use std::path::Path;

use grazemap::emission::{EmitOptions, EmittedCrate, EmittedModule, emitted_module};
use grazemap::expansion::{Expander, MapOrders};
use grazemap::model::{Orders, Scene, catalogue};
use grazemap::orbit::locate;

/// Emits a scene's map at the scene's orders.
fn emit(name: &str) -> EmittedModule {
    let text = catalogue::text(name).expect("a scene of the catalogue");
    let scene = Scene::parse_with(text, name, &[]).expect("a good scene");
    let orbit = locate(&scene)
        .expect("no wrong input")
        .into_result()
        .expect("the orbit grazes");
    let orders = match scene.expansion.orders {
        Orders::Fixed {
            smooth_order,
            contact_weight,
        } => MapOrders {
            smooth_order,
            contact_weight,
        },
        Orders::Tolerance(_) => MapOrders {
            smooth_order: 5,
            contact_weight: 6,
        },
    };
    let expander = Expander::new(&scene, &orbit).expect("a rigid stop");
    let map = expander.expand(orders).expect("an expansion");
    let options = EmitOptions {
        lanes: scene.emit.lanes,
        ..EmitOptions::default()
    };
    emitted_module(&map, None, &options).expect("an emission")
}

#[test]
fn the_generated_crate_is_current() {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("generated");
    let modules: Vec<EmittedModule> = catalogue::names().map(emit).collect();
    let emitted = EmittedCrate::catalogue(&modules).expect("maps of different names");
    if std::env::var_os("UPDATE_GENERATED").is_some() {
        emitted.write(&folder).expect("the folder can be written");
    }
    assert_eq!(emitted.check(&folder), []);
}
