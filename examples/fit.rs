//! A parameter fitted to section points that were measured: `cargo run --example fit`.

use grazemap::analysis::NoProgress;
use grazemap::analysis::fit::MeasuredSeries;
use grazemap::pipeline::FitKeys;
use grazemap::prelude::*;

fn main() -> Result<(), Error> {
    let map = Scene::of_catalogue("linear")?.graze()?.map()?;
    // Four orbits of five returns at an offset of 3e-7 of alpha, as if they had been measured.
    let truth = [3e-7, 0.0];
    let series = (1..=4).map(|number| {
        let start = [-2e-6 * f64::from(number), 0.0];
        let returns = map.iterate(&start, &truth, 5)?;
        let points = returns.into_iter().map(|image| image.offsets);
        Ok(MeasuredSeries {
            controls: vec![0.0; 2],
            points: std::iter::once(start.to_vec()).chain(points).collect(),
        })
    });
    let keys = FitKeys { parameters: vec!["alpha".to_owned()], ..FitKeys::default() };
    let request = keys.request(&map, series.collect::<Result<_, Error>>()?)?;
    let fit = map.fit(&request, &NoProgress)?;
    println!("alpha is {:e} from its graze (truth {:e})", fit.parameters[0].offset, truth[0]);
    Ok(())
}
