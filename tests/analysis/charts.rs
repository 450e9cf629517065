//! Two-parameter charts: onset of contact against the closed form, periods against the literature
//! and against direct simulation, and reproducibility for any number of cores.

use grazemap::analysis::chart::{Chart, ChartCell, ChartClass, Overlay, chart};
use grazemap::analysis::diagram::diagram;
use grazemap::analysis::{AnalysisError, NoProgress};
use grazemap::iteration::{OrbitEnd, Period};
use grazemap::model::{
    ChartObservable, ChartOverlay, ChartRequest, DiagramRequest, Method, Scene, Starts,
};
use grazemap::report::figure::Stroke;
use grazemap::report::{chart_array, chart_figure, chart_rows};

use crate::Case;
use crate::support::scenes;

impl Case {
    fn number(&self, parameter: &str) -> usize {
        let mut parameters = self.scene.model.parameters.iter();
        let found = parameters.position(|known| known.name == parameter);
        found.expect("a parameter of the scene")
    }

    fn request(
        &self,
        parameters: [&str; 2],
        ranges: [[f64; 2]; 2],
        points: [usize; 2],
    ) -> ChartRequest {
        ChartRequest {
            points,
            every_cell: true,
            transient: 300,
            keep: 12,
            with: vec![Method::Map],
            ..ChartRequest::new(parameters.map(|name| self.number(name)), ranges)
        }
    }

    fn chart(&self, request: &ChartRequest) -> Result<Chart, AnalysisError> {
        let charts = chart(&self.scene, &self.orbit, &self.map, None, request, &NoProgress);
        Ok(charts?.remove(0))
    }
}

/// The steady state of `x'' + 2 ζ x' + x = α cos ωt` without a stop has the amplitude `α/√((1 −
/// ω²)² + (2ζω)²)`, so that it reaches the stop at `δ = 1` from `α = √((1 − ω²)² + (2ζω)²)` on.
#[test]
fn contact_begins_where_the_amplitude_of_the_linear_oscillator_reaches_the_stop() {
    let case = Case::new("linear");
    let ranges = [[-1e-3, 1e-3], [-2e-3, 2e-3]];
    let request = case.request(["omega", "alpha"], ranges, [21, 41]);
    let chart = case.chart(&request).expect("both are active");
    let (mut below, mut above) = (0, 0);
    for ([omega, alpha], cell) in chart.located() {
        let (omega, alpha) = (1.8 + omega, chart.axes[1].grazing_value + alpha);
        let grazes_at = (1.0 - omega * omega).hypot(2.0 * 0.05 * omega);
        // The map is within 1e-11 of the flow on this window; no cell is that near to the curve but
        // that of the graze itself.
        if (alpha - grazes_at).abs() < 1e-9 {
            continue;
        }
        let cell = &cell.attractor;
        let without_contact = cell.kept_contacts == 0 && cell.period == Period::Periodic(1);
        assert_eq!(without_contact, alpha < grazes_at, "omega {omega}, alpha {alpha}: {cell:?}");
        if without_contact {
            below += 1;
        } else {
            above += 1;
        }
    }
    assert!(below > 200 && above > 200, "{below}, {above}");
}

/// The cantilever beam (docs/explanation/where-papers-err.md): with `zeta = 0.09` the orbit beyond
/// grazing has one impact in five periods.
#[test]
fn the_orbit_beyond_grazing_is_that_of_the_literature_and_of_direct_simulation() {
    let case = Case::new("cantilever_0_09");
    let [low, high] = [-4e-4, 8e-4];
    let request = case.request(["Q", "beta"], [[low, high], [-1e-5, 1e-5]], [5, 3]);
    let chart = case.chart(&request).expect("both are active");
    let name = |cell: &ChartCell| cell.attractor.orbit.as_ref().map(ToString::to_string);
    let names: Vec<_> = chart.cells[5..10].iter().map(name).collect();
    let expected = ["(0,1)", "(0,1)", "(1,5)", "(1,5)", "(1,5)"];
    assert_eq!(names, expected.map(|name| Some(name.to_owned())));
    let request = DiagramRequest {
        range: [low, high],
        points: 5,
        transient: 300,
        keep: 24,
        with: vec![Method::Direct],
        ..case.scene.diagrams[0].clone()
    };
    let direct = diagram(&case.scene, &case.orbit, &case.map, &request, &NoProgress);
    let direct = direct.expect("active");
    for (cell, point) in chart.cells[5..10].iter().zip(&direct.sweeps[0].points) {
        assert_eq!(cell.attractor.orbit, point.orbit, "at {}", point.offset);
    }
}

#[test]
fn a_chart_does_not_depend_on_the_number_of_threads() {
    let case = Case::new("cantilever_0_09");
    let ranges = [[-4e-4, 8e-4], [-1e-4, 1e-4]];
    let request = case.request(["Q", "beta"], ranges, [13, 11]);
    let on = |threads: usize| {
        let builder = rayon::ThreadPoolBuilder::new().num_threads(threads);
        let pool = builder.build().expect("a pool");
        let chart = pool.install(|| case.chart(&request)).expect("active");
        chart.without_timing()
    };
    assert_eq!(on(1), on(3));
}

#[test]
fn a_cell_is_the_same_whatever_its_neighbours_and_axes_can_change_places() {
    let case = Case::new("cantilever_0_09");
    let ranges = [[-4e-4, 8e-4], [-1e-4, 1e-4]];
    let wide = case.request(["Q", "beta"], ranges, [7, 5]);
    let turned = case.request(["beta", "Q"], [ranges[1], ranges[0]], [5, 7]);
    let (wide, turned) = (case.chart(&wide), case.chart(&turned));
    let (wide, turned) = (wide.expect("active"), turned.expect("active"));
    for row in 0..5 {
        for column in 0..7 {
            assert_eq!(
                wide.cells[row * 7 + column],
                turned.cells[column * 5 + row],
                "{column}, {row}"
            );
        }
    }
}

#[test]
fn a_parameter_that_is_no_variable_of_the_map_is_refused_by_name() {
    let case = Case::new("linear");
    let request = case.request(["alpha", "zeta"], [[-1e-3, 1e-3]; 2], [3, 3]);
    match case.chart(&request) {
        Err(AnalysisError::NotActive { parameter }) => assert_eq!(parameter, "zeta"),
        other => panic!("{other:?}"),
    }
}

#[test]
fn table_array_and_picture_hold_every_cell() {
    let case = Case::new("linear");
    let request = case.request(["omega", "alpha"], [[-1e-3, 1e-3], [-2e-3, 4e-1]], [4, 3]);
    let chart = case.chart(&request).expect("active");
    let ends: Vec<_> = chart.cells.iter().map(|cell| cell.attractor.end).collect();
    assert!(ends.contains(&OrbitEnd::Completed), "{ends:?}");
    assert!(ends.iter().any(|end| *end != OrbitEnd::Completed), "{ends:?}");
    let table = chart_rows(std::slice::from_ref(&chart)).into_table();
    let csv = table.to_csv().expect("a table");
    assert_eq!(csv.lines().count(), 1 + 12);
    assert!(csv.contains(",\"orbit (stop,periods)\""), "{csv}");
    let array = chart_array(&chart).expect("a full grid");
    let numbers: Vec<f64> = array[array.len() - 12 * 8..]
        .chunks_exact(8)
        .map(|bytes| f64::from_le_bytes(bytes.try_into().expect("eight bytes")))
        .collect();
    for (number, cell) in numbers.iter().zip(&chart.cells) {
        match cell.attractor.period {
            _ if chart.class(&cell.attractor) == ChartClass::Outside => assert_eq!(*number, -1.0),
            Period::Periodic(period) => assert_eq!(*number, period as f64),
            Period::NotFound if cell.attractor.converging => assert_eq!(*number, -3.0),
            Period::NotFound => assert_eq!(*number, 0.0),
        }
    }
    let figure = chart_figure(&chart);
    let cells = figure.cells.as_ref().expect("a chart of cells");
    assert_eq!((cells.columns, cells.rows), (4, 3));
    assert!(figure.to_svg().is_ok() && figure.to_png(192).is_ok());
}

#[test]
fn cells_along_borders_are_those_of_the_uniform_grid() {
    let case = Case::new("cantilever_0_09");
    let every = case.request(["Q", "beta"], [[-4e-4, 8e-4], [-1e-3, 1e-3]], [49, 33]);
    let borders = ChartRequest { every_cell: false, ..every.clone() };
    let on = |threads: usize, request: &ChartRequest| {
        let builder = rayon::ThreadPoolBuilder::new().num_threads(threads);
        let pool = builder.build().expect("a pool");
        pool.install(|| case.chart(request)).expect("active").without_timing()
    };
    let (every, borders, again) = (on(2, &every), on(1, &borders), on(3, &borders));
    assert_eq!(borders, again);
    assert_eq!(every.computed, 49 * 33);
    let computed = borders.cells.iter().filter(|cell| cell.computed).count();
    assert_eq!(borders.computed, computed);
    assert!(computed < 49 * 33 / 3, "{computed}");
    for (uniform, cell) in every.cells.iter().zip(&borders.cells) {
        assert_eq!(every.class(&uniform.attractor), borders.class(&cell.attractor));
        if cell.computed {
            assert_eq!(uniform, cell);
        } else {
            assert_eq!(cell.attractor.lyapunov, None);
        }
    }
    let classes: std::collections::BTreeSet<_> =
        every.cells.iter().map(|cell| every.class(&cell.attractor)).collect();
    assert!(classes.len() > 1, "{classes:?}");
}

/// The forced oscillator returns to its orbit without contact as `exp(−ζt)` turned by an angle, and
/// an impact multiplies the phase volume by `r²` besides: with complex multipliers the exponents
/// per return are `−ζ T` and `−ζ T + ln r`, the saltation included.
#[test]
fn exponents_by_direct_simulation_are_those_of_closed_form_and_of_the_map() {
    let case = Case::new("linear");
    let (zeta, r): (f64, f64) = (0.05, 0.8);
    let request = ChartRequest {
        observe: ChartObservable::Lyapunov,
        keep: 200,
        with: vec![Method::Guarded, Method::Direct],
        ..case.request(["omega", "alpha"], [[-2e-4, 2e-4], [-6e-4, 6e-4]], [2, 4])
    };
    let charts = chart(&case.scene, &case.orbit, &case.map, None, &request, &NoProgress);
    let [guarded, direct]: [_; 2] = charts.expect("active").try_into().expect("by each method");
    assert_eq!((guarded.computed, direct.computed), (8, 8));
    let (mut closed, mut mapped) = ([0; 2], 0);
    for (([omega, alpha], cell), by_map) in direct.located().zip(&guarded.cells) {
        let exponent = cell.attractor.lyapunov.expect("an orbit that stays");
        let period = 2.0 * std::f64::consts::PI / (1.8 + omega);
        let contacts = cell.attractor.orbit.as_ref().map_or(0, |name| name.hits[0]);
        // Multipliers by differences have ten digits and more.
        if cell.attractor.period == Period::Periodic(1) {
            let exact = -zeta * period + f64::from(contacts) * r.ln();
            assert!((exponent - exact).abs() < 1e-8, "{omega} {alpha}: {exponent} {exact}");
            closed[contacts as usize] += 1;
        }
        if by_map.attractor.by_map == 1.0 {
            let by_map = by_map.attractor.lyapunov.expect("an orbit that stays");
            assert!((exponent - by_map).abs() < 1e-6, "{omega} {alpha}: {exponent} {by_map}");
            mapped += 1;
        }
    }
    assert!(closed[0] > 0 && closed[1] > 0 && mapped > 0, "{closed:?} {mapped}");
}

/// Below its graze the linear oscillator has an orbit with one impact beside the one without
/// contact (`basin`, whose cells are followed one by one, finds them both).
#[test]
fn starts_that_are_taken_together_show_both_attractors() {
    let case = Case::new("linear");
    let start = |x: f64, theta: f64| vec![Some(x), None, Some(theta)];
    // Beside the orbit without contact at alpha = -5e-4 (x moves by 1/2.247 of it), and far off.
    let starts = [start(-2.2e-4, 0.0), start(1e-3, 0.0), start(1e-3, 0.02), start(-2.3e-4, 0.0)];
    let request = ChartRequest {
        starts: Starts::Given(starts.to_vec()),
        attractors: 3,
        observe: ChartObservable::Attractors,
        with: vec![Method::Guarded],
        ..case.request(["omega", "alpha"], [[-1e-5, 1e-5], [-6e-4, -4e-4]], [2, 3])
    };
    let found = case.chart(&request).expect("active");
    assert_eq!((found.starts.len(), &found.start), (4, &None));
    let parts = ChartRequest { attractors: 1, ..request };
    let parts =
        chart(&case.scene, &case.orbit, &case.map, None, &parts, &NoProgress).expect("active");
    assert_eq!(parts.len(), 4);
    let mut several = 0;
    for (number, cell) in found.cells.iter().enumerate() {
        let stays = cell.attractors().filter(|one| one.end == OrbitEnd::Completed);
        let mut names: Vec<_> = stays.map(|one| one.orbit.clone()).collect();
        names.sort();
        let mut expected: Vec<_> =
            parts.iter().map(|part| part.cells[number].attractor.clone()).collect();
        expected.retain(|one| one.end == OrbitEnd::Completed);
        let mut expected: Vec<_> = expected.into_iter().map(|one| one.orbit).collect();
        expected.sort();
        expected.dedup();
        assert_eq!(names, expected, "cell {number}");
        several += usize::from(names.len() > 1);
    }
    assert!(several > 0);
    let array = chart_array(&found).expect("a full grid");
    assert!(String::from_utf8_lossy(&array).contains("(3, 3, 2)"));
}

#[test]
fn itineraries_are_shown_by_their_digits() {
    let case = Case::new("cantilever_0_09");
    let request = ChartRequest {
        observe: ChartObservable::Itinerary,
        with: vec![Method::Guarded],
        ..case.request(["Q", "beta"], [[-4e-4, 8e-4], [-1e-5, 1e-5]], [5, 3])
    };
    let chart = case.chart(&request).expect("active");
    let itinerary = |cell: &ChartCell| {
        cell.attractor.itinerary.as_ref().map(ToString::to_string).unwrap_or_default()
    };
    let row: Vec<String> = chart.cells[5..10].iter().map(itinerary).collect();
    assert_eq!(row, ["0", "0", "10000", "10000", "10000"]);
    let figure = chart_figure(&chart);
    let cells = figure.cells.expect("a chart of cells");
    let names: Vec<&str> = cells.categories.iter().map(|one| one.name.as_str()).collect();
    assert_eq!(names, ["no contact", "itinerary 10000"]);
}

/// Without contact the oscillator is linear and settles on its forcing, however slowly: no cell
/// without contact is without a period. Far from the window's scale 300 returns of it leave more
/// than a hundred-millionth of a half-width.
#[test]
fn an_orbit_without_contact_that_still_settles_has_period_one() {
    let set = [
        ("omega", "0.8"),
        ("A", "0.360799"),
        ("grazing.guess", "{u=1.0,v=0.0,theta=0.066568}"),
        ("section.kind", "\"stroboscopic\""),
    ];
    let case = Case::of(scenes::parsed(scenes::text("soft_a"), "soft_a", &set));
    let request = ChartRequest {
        with: vec![Method::Direct],
        ..case.request(["omega", "A"], [[0.3, 0.4], [-0.34, -0.2]], [4, 3])
    };
    let chart = case.chart(&request).expect("active");
    let without = chart.cells.iter().filter(|cell| cell.attractor.kept_contacts == 0);
    let without: Vec<_> = without.map(|cell| chart.class(&cell.attractor)).collect();
    assert!(without.len() >= 4, "{without:?}");
    assert!(without.iter().all(|&class| class == ChartClass::WithoutContact), "{without:?}");
}

/// The amplitude of the orbit without contact is that of the stop where `α = √((1 − ω²)² +
/// (2ζω)²)`.
#[test]
fn the_grazing_curve_over_a_chart_is_that_of_the_closed_form() {
    let case = Case::new("linear");
    for (parameters, points) in [(["omega", "alpha"], [3, 2]), (["alpha", "omega"], [2, 3])] {
        let request = ChartRequest {
            overlay: vec![ChartOverlay::Graze],
            ..case.request(parameters, [[-0.3, 0.4], [-0.2, 0.3]], points)
        };
        let chart = case.chart(&request).expect("active");
        let [Overlay { what: ChartOverlay::Graze, curves }] = &chart.overlay[..] else {
            panic!("{:?}", chart.overlay)
        };
        let [curve] = &curves[..] else { panic!("{curves:?}") };
        let turned = usize::from(parameters[0] == "alpha");
        for point in &curve.points {
            let value = |axis: usize| chart.axes[axis].grazing_value + point.at[axis];
            let (omega, alpha) = (value(turned), value(1 - turned));
            let closed = (1.0 - omega * omega).hypot(2.0 * 0.05 * omega);
            assert!((alpha - closed).abs() < 1e-9, "{omega}: {alpha} {closed}");
        }
        let ends = [curve.points.first(), curve.points.last()];
        let ends = ends.map(|end| end.expect("a point").at[turned]);
        let expected = request.ranges[turned];
        assert!(curve.whole && ends.iter().zip(expected).all(|(a, b)| (a - b).abs() < 1e-9));
        let figure = chart_figure(&chart);
        assert!(figure.series.iter().any(|series| series.name == "GR"));
        assert_eq!(figure.strokes, [(Stroke::Solid, "stable".to_owned())]);
    }
    let wrong = ChartRequest {
        overlay: vec![ChartOverlay::Loci],
        itineraries: vec!["12".to_owned()],
        ..case.request(["omega", "alpha"], [[-1e-3, 1e-3]; 2], [2, 2])
    };
    assert!(matches!(case.chart(&wrong), Err(AnalysisError::Itinerary(_))));
}

#[test]
fn a_scene_says_how_its_charts_are_made() {
    let read = |keys: &str| {
        let text = format!(
            "{}\n[[chart]]\nparameters = [\"omega\", \"alpha\"]\n\
             ranges = [[-1e-3, 1e-3], [-1e-3, 1e-3]]\n{keys}",
            scenes::text("linear")
        );
        Scene::parse(&text, "linear").map(|scene| scene.charts[0].clone())
    };
    let chart = read("").expect("a chart");
    assert_eq!((chart.points, chart.every_cell), ([200; 2], false));
    assert!(read("points = 100").expect("a chart").every_cell);
    assert!(!read("points = 100\ncells = \"borders\"").expect("a chart").every_cell);
    let keys = "observe = \"attractors\"\noverlay = [\"loci\", \"graze\"]\nitineraries = [\"10\"]";
    let chart = read(keys).expect("a chart");
    assert_eq!((chart.observe, chart.attractors), (ChartObservable::Attractors, 4));
    assert_eq!((chart.starts.count(), chart.count()), (16, 1));
    assert_eq!(chart.overlay, [ChartOverlay::Loci, ChartOverlay::Graze]);
    for wrong in ["cells = \"none\"", "observe = \"h\"", "overlay = [\"xi\"]", "attractors = 0"] {
        let error = read(wrong).expect_err("wrong").to_string();
        assert!(error.contains(wrong.split(' ').next().expect("a key")), "{error}");
    }
}
