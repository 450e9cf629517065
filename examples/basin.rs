//! Basins of attraction before a graze: `cargo run --example basin`.

use grazemap::analysis::NoProgress;
use grazemap::analysis::basin::BasinRequest;
use grazemap::model::Method;
use grazemap::prelude::*;

fn main() -> Result<(), Error> {
    let map = Scene::of_catalogue("linear")?.graze()?.map()?;
    let request = BasinRequest {
        parameters: vec![-5e-4, 0.0],
        ranges: [[-1e-3, 3e-4], [-6e-4, 6e-4]],
        points: [60, 60],
        method: Method::Guarded,
        ..BasinRequest::over_the_window(map.local())
    };
    for found in map.basin(&request, &NoProgress)?.attractors {
        let attractor = found.attractor;
        let name = attractor.itinerary.map_or("no period".to_owned(), |digits| digits.to_string());
        println!("{name}: {:.4} of the plane", found.share.fraction);
    }
    Ok(())
}
