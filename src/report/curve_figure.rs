//! Pictures of a grazing curve: the plane of its parameters, `xi_n` along it, its codimension-two
//! points by `n`.

use super::figure::{Annotation, Axis, Figure, Guide, Marker, Series, Stroke, symbol};
use super::{CurveListing, CurvePointListing, Named};

/// The pictures of a curve, each with the ending of its file's name: the curve in the plane of its
/// last two parameters, solid where the orbit is stable without the stop and dashed where it is
/// not, with rings where a `xi_n` vanishes; every `xi_n` along it; the zeros of `xi_n` over `n`
/// where there are several `n`.
pub fn curve_figures(curve: &CurveListing) -> Vec<(&'static str, Figure)> {
    let [.., vertical, horizontal] = curve.free.as_slice() else { return Vec::new() };
    let mut figures = vec![
        ("", plane_figure(curve, horizontal, vertical)),
        ("-xi", condition_figure(curve, horizontal)),
    ];
    let largest = curve.codim2.iter().map(|point| point.n).max().unwrap_or(0);
    if largest > 1 {
        figures.push(("-zeros", zero_figure(curve, horizontal)));
    }
    figures
}

fn plane_figure(curve: &CurveListing, horizontal: &str, vertical: &str) -> Figure {
    let mut figure = Figure::new(axis(horizontal), axis(vertical));
    let at = |parameters: &Named<f64>| [value(parameters, horizontal), value(parameters, vertical)];
    let strokes = [("stable without the stop", true), ("unstable without the stop", false)];
    for (name, stable) in strokes {
        let stroke = if stable { Stroke::Solid } else { Stroke::Dashed };
        let mut line: Vec<[f64; 2]> = Vec::new();
        for pair in curve.points.windows(2) {
            if is_stable(&pair[0]) == stable {
                let [from, to] = [0, 1].map(|end| at(&pair[end].parameters));
                if line.last() != Some(&from) {
                    line.extend([[f64::NAN; 2], from]);
                }
                line.push(to);
            }
        }
        if !line.is_empty() {
            figure.series.push(Series::line(name, stroke, line).with_color(0));
        }
    }
    let rings: Vec<_> = curve.codim2.iter().map(|point| at(&point.parameters)).collect();
    if !rings.is_empty() {
        let largest = curve.codim2.iter().map(|point| point.n).max().unwrap_or(0);
        let name = if largest > 1 { "ξ_{n} = 0" } else { "ξ_{1} = 0" };
        figure.series.push(Series::markers(name, Marker::Ring, rings).with_color(1));
    }
    for fold in curve.folds.iter().filter(|fold| fold.parameter == horizontal) {
        figure.annotations.push(Annotation {
            at: at(&fold.parameters),
            text: String::new(),
            marker: Some(Marker::Cross),
        });
    }
    figure
}

fn condition_figure(curve: &CurveListing, horizontal: &str) -> Figure {
    let mut figure = Figure::new(axis(horizontal), Axis::linear("ξ_{n}"));
    let count = curve.points.first().map_or(0, |point| point.xi.len());
    for n in 0..count {
        let at = |point: &CurvePointListing| [value(&point.parameters, horizontal), point.xi[n]];
        let line = curve.points.iter().map(at).collect();
        figure.series.push(Series::line(format!("ξ_{{{}}}", n + 1), Stroke::Solid, line));
    }
    figure.guides.push(Guide::Horizontal { at: 0.0, label: String::new() });
    figure
}

fn zero_figure(curve: &CurveListing, horizontal: &str) -> Figure {
    let mut figure = Figure::new(Axis::linear("n"), axis(horizontal));
    let at = |point: &super::Codimension2| [point.n as f64, value(&point.parameters, horizontal)];
    let dots = curve.codim2.iter().map(at).collect();
    figure.series.push(Series::markers("ξ_{n} = 0", Marker::Circle, dots));
    for switch in &curve.multiplier_switches {
        figure.guides.push(Guide::Horizontal {
            at: value(&switch.parameters, horizontal),
            label: "multipliers real or complex".to_owned(),
        });
    }
    figure
}

fn axis(parameter: &str) -> Axis {
    Axis::linear(symbol(parameter))
}

fn value(parameters: &Named<f64>, name: &str) -> f64 {
    parameters.get(name).copied().unwrap_or(f64::NAN)
}

fn is_stable(point: &CurvePointListing) -> bool {
    point.multipliers.iter().all(|[re, im]| re.hypot(*im) < 1.0)
}
