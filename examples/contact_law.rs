//! A contact law of one's own, a hardening stop with damping, by map and by direct simulation:
//! `cargo run --example contact_law`.

use grazemap::prelude::*;

const SCENE: &str = r#"
[model]
states = ["x", "v"]
parameters = { zeta = 0.05, k = 30.0, c = 0.4, alpha = 2.2, omega = 1.8 }
phase = { name = "theta", rate = "omega", period = "2*pi" }

[model.flow]
x = "v"
v = "alpha*cos(theta) - 2*zeta*v - x"

[[model.surface]]
name = "stop"
event = "1 - x"
contact = { v = "free - k*(x - 1)*(1 + (x - 1)^2) - c*v" }

[grazing]
solve_for = "alpha"

[expansion]
active = ["alpha"]
smooth_order = 4
contact_weight = 7
"#;

fn main() -> Result<(), Error> {
    let map = Scene::parse(SCENE, "hardening.toml")?.graze()?.map()?;
    for depth in [1e-6, 1e-5, 1e-4] {
        let (state, parameters) = ([depth, 0.0], [0.0]);
        let by_map = map.step(&state, &parameters)?.offsets;
        let by_simulation = map.simulate(&state, &parameters)?.offsets;
        println!("{depth:e} beyond the stop: {by_map:?} by map, {by_simulation:?} by simulation");
    }
    Ok(())
}
