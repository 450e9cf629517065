//! From a scene to a bifurcation diagram through the graze: `cargo run --example quickstart`.

use grazemap::prelude::*;

fn main() -> Result<(), Error> {
    let graze = Scene::of_catalogue("linear")?.graze()?;
    println!("grazes at alpha = {}", graze.parameter("alpha")?);

    let map = graze.map()?.asking(
        "[[diagram]]\nparameter = \"alpha\"\nrange = [-1e-4, 3e-4]\npoints = 5\nkeep = 4\n\
         direction = \"up\"\nmethod = \"guarded\"\n",
    )?;
    let diagram = map.diagram(&map.scene().diagrams[0])?;
    for point in diagram.sweeps.iter().flat_map(|sweep| &sweep.points) {
        println!("{:9.1e}: gap at the section {:?}", point.offset, point.values);
    }
    Ok(())
}
