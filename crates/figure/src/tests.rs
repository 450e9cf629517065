use super::*;

fn small() -> Figure {
    let mut figure = Figure::new(Axis::linear("α − α*"), Axis::linear("h"));
    figure.size = (320, 220);
    let branch = |from: f64| vec![[0.0, from], [1e-3, from + 1.0], [2e-3, from + 1.5]];
    figure.series.push(Series::line("stable", Stroke::Solid, branch(0.0)));
    figure.series.push(Series::line("unstable", Stroke::Dashed, branch(0.5)).with_color(0));
    figure.annotations.push(Annotation::ring([0.0, 0.0], "G"));
    figure
}

#[test]
fn a_small_figure_is_as_recorded() {
    let svg = small().to_svg().expect("drawn");
    assert_eq!(svg, small().to_svg().expect("drawn again"));
    insta::assert_snapshot!(svg);
}

#[test]
fn a_bitmap_is_a_png_of_twice_the_size_and_the_same_every_time() {
    let png = small().to_png().expect("drawn");
    assert_eq!(png, small().to_png().expect("drawn again"));
    let reader = png::Decoder::new(std::io::Cursor::new(&png)).read_info().expect("a PNG");
    assert_eq!((reader.info().width, reader.info().height), (640, 440));
}

#[test]
fn four_hundred_thousand_dots_stay_below_two_megabytes() {
    let scattered = |k: u64| {
        let bits = k.wrapping_mul(0x9e37_79b9_7f4a_7c15);
        [(bits >> 40) as f64, (bits & 0xff_ffff) as f64]
    };
    let mut figure = Figure::new(Axis::linear("x"), Axis::linear("y"));
    figure.series.push(Series::dots("map", (0..200_000).map(scattered).collect()));
    figure.series.push(Series::dots("direct", (200_000..400_000).map(scattered).collect()));
    let svg = figure.to_svg().expect("drawn");
    assert!(svg.len() < 2_000_000, "{}", svg.len());
    let thinning = figure.thinning().expect("drawn").expect("thinned");
    assert_eq!(thinning.given, 400_000);
    assert!(thinning.drawn <= 400_000);
}

#[test]
fn values_without_a_place_never_reach_the_picture() {
    let wild = vec![
        [f64::NAN, 1.0],
        [1.0, f64::INFINITY],
        [-1.0, 1.0],
        [0.0, 0.0],
        [f64::MAX, f64::MIN_POSITIVE],
        [1.0, 1.0],
        [5e-324, 5e-324],
    ];
    for axes in [|label: &str| Axis::linear(label), |label: &str| Axis::log10(label)] {
        let mut figure = Figure::new(axes("x"), axes("y"));
        figure.guides.push(Guide::Slope {
            through: [-1.0, 0.0],
            exponent: 1.5,
            to: 2.0,
            label: "?".to_owned(),
        });
        for style in [SeriesStyle::Dots, SeriesStyle::Line(Stroke::Dashed)] {
            figure.series.push(Series { style, ..Series::dots("wild", wild.clone()) });
        }
        let svg = figure.to_svg().expect("drawn");
        assert!(!svg.contains("NaN") && !svg.contains("inf"));
        assert!(figure.to_png().is_ok());
    }
}

#[test]
fn figures_that_cannot_be_drawn_are_refused() {
    let mut figure = small();
    figure.size = (10, 10);
    assert!(matches!(figure.to_svg(), Err(FigureError::FigureSize { .. })));
    let mut figure = small();
    figure.horizontal = Axis::log10("x").with_range(-1.0, 1.0);
    assert!(matches!(figure.to_png(), Err(FigureError::AxisRange { .. })));
    let mut figure = small();
    figure.cells = Some(CellChart {
        horizontal: (0.0, 1.0),
        vertical: (0.0, 1.0),
        columns: 2,
        rows: 2,
        cells: vec![None; 3],
        categories: Vec::new(),
    });
    assert!(matches!(figure.to_svg(), Err(FigureError::ChartShape { found: 3, .. })));
}

#[test]
fn a_second_scale_has_ticks_at_round_values_of_its_own() {
    let mut figure = small();
    figure.above = Some(ShiftedScale { label: "α".to_owned(), shift: 2.2471 });
    let svg = figure.to_svg().expect("drawn");
    assert!(svg.contains(">2.248<"), "{svg}");
    // So short an axis that doubles near the shift cannot tell its ticks apart.
    figure.horizontal = Axis::linear("α − α*").with_range(0.0, 1e-15);
    assert!(!figure.to_svg().expect("drawn").contains(">2.24"));
    let mut logarithmic = small();
    logarithmic.horizontal = Axis::log10("α − α*").with_range(1e-4, 1e-3);
    logarithmic.above = Some(ShiftedScale { label: "α".to_owned(), shift: 2.2471 });
    assert!(!logarithmic.to_svg().expect("drawn").contains(">2.24"));
}

#[test]
fn dots_under_others_show_a_rim_and_fewer_dots_are_larger() {
    let radii = |count: usize| -> Vec<f64> {
        let points = || (0..count).map(|k| [k as f64, (k * k % 97) as f64]).collect();
        let mut figure = Figure::new(Axis::linear("x"), Axis::linear("y"));
        figure.series.push(Series::dots("", points()));
        figure.series.push(Series::dots("", points()));
        let svg = figure.to_svg().expect("drawn");
        let parts = svg.split(" r=\"").skip(1);
        parts.map(|part| part.split('"').next().unwrap_or("").parse().expect("a radius")).collect()
    };
    let few = radii(100);
    assert!(few[0] > 1.5 * few[199], "{few:?}");
    let many = radii(1000);
    assert!(few[0] > many[0] && many[0] > 1.5 * many[1999], "{} {}", few[0], many[0]);
}
