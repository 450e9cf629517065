//! Sketch of the masses, their stops and the gaps between them, derived from the surfaces of a
//! scene, with the forces on each mass in words, derived from its flow.

use std::fmt::Write as _;

use super::figure::{escape_html, symbol};
use super::time_series_listing::portrait_pairs;
use crate::model::{Model, Response};

const WIDTH: f64 = 600.0;
const ROW: f64 = 116.0;
/// Half-width and half-height of a mass.
const MASS: [f64; 2] = [38.0, 20.0];
const INK: &str = "var(--ink,#1f2328)";
const SOFT: &str = "var(--soft,#5c636b)";
const GRAZING: &str = "var(--accent,#0b63a5)";
/// Longest name of a stop that is printed in full.
const LONGEST: usize = 28;

/// Row of the sketch: a mass in the middle, surfaces to its left and right.
struct SketchRow {
    middle: usize,
    left: Vec<usize>,
    right: Vec<usize>,
    /// Second mass on the right, and the surface between the two.
    other: Option<(usize, usize)>,
}

/// Positions on which a surface depends, each with the sign of the gap's derivative by it.
fn bodies(model: &Model, surface: usize, point: &[f64]) -> Vec<(usize, f64)> {
    let mut graph = model.graph.clone();
    let event = model.surfaces[surface].event;
    let positions: Vec<usize> = portrait_pairs(model).iter().map(|&(own, _)| own).collect();
    let changes: Vec<_> = positions.iter().map(|&own| graph.derivative(event, own)).collect();
    let mut values = Vec::new();
    graph.evaluate(point, &mut values);
    let changes = changes.into_iter().map(|node| values[node.index()]);
    positions.into_iter().zip(changes).filter(|(_, change)| *change != 0.0).collect()
}

fn rows(model: &Model, point: &[f64]) -> Vec<SketchRow> {
    let between: Vec<_> =
        (0..model.surfaces.len()).map(|surface| bodies(model, surface, point)).collect();
    let mut rows = Vec::new();
    for (surface, bodies) in between.iter().enumerate() {
        // NOTE: the gap grows with the position of the mass on its right.
        let pair = match bodies.as_slice() {
            [(a, da), (b, db)] if *da > 0.0 && *db < 0.0 => Some((*b, *a)),
            [(a, da), (b, db)] if *da < 0.0 && *db > 0.0 => Some((*a, *b)),
            _ => None,
        };
        if let Some((middle, right)) = pair {
            let other = Some((right, surface));
            rows.push(SketchRow { middle, left: Vec::new(), right: Vec::new(), other });
        }
    }
    for (middle, _) in portrait_pairs(model) {
        let stops = |below: bool| {
            let surfaces = between.iter().enumerate();
            let own = surfaces.filter(|(_, bodies)| match bodies.as_slice() {
                [(body, change)] => *body == middle && (*change > 0.0) == below,
                _ => false,
            });
            own.map(|(surface, _)| surface).collect::<Vec<_>>()
        };
        let (left, right) = (stops(true), stops(false));
        let paired = between.iter().any(|own| own.len() == 2 && own.iter().any(|b| b.0 == middle));
        if !paired || !left.is_empty() || !right.is_empty() {
            rows.push(SketchRow { middle, left, right, other: None });
        }
    }
    rows
}

/// Forces on a mass in free flight, in words, from the derivatives of its acceleration at a point.
fn forces(model: &Model, mass: usize, point: &[f64]) -> String {
    let pairs = portrait_pairs(model);
    let Some(&(_, velocity)) = pairs.iter().find(|(position, _)| *position == mass) else {
        return String::new();
    };
    let acceleration = model.flow[velocity];
    let mut graph = model.graph.clone();
    let mut slope = |input: usize| {
        let node = graph.derivative(acceleration, input);
        let mut values = Vec::new();
        graph.evaluate(point, &mut values);
        values[node.index()]
    };
    let slopes: Vec<f64> = pairs.iter().map(|&(position, _)| slope(position)).collect();
    // NOTE: springs between masses do not change when all of them move together.
    let (net, size) = slopes
        .iter()
        .fold((0.0, 0.0), |(net, size): (f64, f64), slope| (net + slope, size + slope.abs()));
    let others = pairs
        .iter()
        .zip(&slopes)
        .filter(|&(&(position, _), &slope)| position != mass && slope != 0.0);
    let coupled: Vec<String> =
        others.map(|(&(position, _), _)| symbol(&model.states[position])).collect();
    let inputs = model.graph.dependencies(acceleration);
    let forced = model.phase.is_some() && inputs.contains(&model.states.len());
    let words = [
        (net.abs() > 1e-9 * size).then(|| "spring".to_owned()),
        (slope(velocity) != 0.0).then(|| "damper".to_owned()),
        (!coupled.is_empty()).then(|| format!("coupled to {}", coupled.join(", "))),
        forced.then(|| "forced".to_owned()),
    ];
    words.into_iter().flatten().collect::<Vec<_>>().join(" · ")
}

/// Sketch as SVG, with grazing surfaces in their own colour; `None` if no surface is a gap beside
/// or between masses. `point` holds the full state and the parameters.
pub(super) fn sketch(model: &Model, point: &[f64], grazing: &[usize]) -> Option<String> {
    let rows = rows(model, point);
    let has_gap =
        |row: &SketchRow| row.other.is_some() || !row.left.is_empty() || !row.right.is_empty();
    if !rows.iter().any(has_gap) {
        return None;
    }
    let height = ROW * rows.len() as f64;
    let mut svg = format!(
        "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 {WIDTH} {height}\" \
            width=\"{WIDTH}\" height=\"{height}\" role=\"img\" aria-label=\"The masses, their \
            stops and the gaps between them\" font-family=\"system-ui, sans-serif\" \
            font-size=\"13\"><rect width=\"100%\" height=\"100%\" fill=\"var(--sheet,#fff)\"/>"
    );
    let pen = Pen { model, point, grazing };
    for (number, row) in rows.iter().enumerate() {
        let y = ROW * (number as f64 + 0.5) + 10.0;
        match row.other {
            Some((right, surface)) => {
                svg += &pen.mass(row.middle, 180.0, y);
                svg += &pen.mass(right, 420.0, y);
                svg += &pen.gap(&[surface], [180.0 + MASS[0], 420.0 - MASS[0]], y);
            }
            None => {
                svg += &pen.mass(row.middle, WIDTH / 2.0, y);
                svg += &pen.stop(&row.left, -1.0, y);
                svg += &pen.stop(&row.right, 1.0, y);
            }
        }
    }
    Some(svg + "</svg>")
}

struct Pen<'a> {
    model: &'a Model,
    /// Full state and parameters.
    point: &'a [f64],
    grazing: &'a [usize],
}

impl Pen<'_> {
    fn mass(&self, position: usize, x: f64, y: f64) -> String {
        let name = escape_html(&symbol(&self.model.states[position]));
        let forces = escape_html(&forces(self.model, position, self.point));
        format!(
            "<rect x=\"{}\" y=\"{}\" width=\"{}\" height=\"{}\" rx=\"3\" \
                fill=\"var(--panel,#eef1f4)\" \
                stroke=\"{INK}\"/><text x=\"{x}\" y=\"{}\" text-anchor=\"middle\" \
                fill=\"{INK}\">{name}</text><text x=\"{x}\" y=\"{}\" text-anchor=\"middle\" \
                fill=\"{SOFT}\">{forces}</text>",
            x - MASS[0],
            y - MASS[1],
            2.0 * MASS[0],
            2.0 * MASS[1],
            y + 5.0,
            y + MASS[1] + 18.0
        )
    }

    /// Stops on one side of the middle mass: a wall, with a spring if they are compliant.
    fn stop(&self, surfaces: &[usize], side: f64, y: f64) -> String {
        if surfaces.is_empty() {
            return String::new();
        }
        let at = |distance: f64| WIDTH / 2.0 + side * distance;
        let wall = at(230.0);
        let (top, bottom) = (y - MASS[1] - 4.0, y + MASS[1]);
        let mut svg = format!("<path d=\"M{wall} {top}V{bottom}");
        for line in 0..5 {
            let end = top + 11.0 * f64::from(line);
            let _ = write!(svg, "M{wall} {end}l{} 8", 8.0 * side);
        }
        let mut face = wall;
        let yields = |&surface: &usize| {
            matches!(self.model.surfaces[surface].response, Response::Contact { .. })
        };
        if surfaces.iter().any(yields) {
            let _ = write!(svg, "M{wall} {y}");
            for (number, step) in [-6.0, 12.0, -12.0, 12.0, -12.0, 6.0].into_iter().enumerate() {
                let _ = write!(svg, "l{} {step}", -side * if number % 5 == 0 { 5.0 } else { 10.0 });
            }
            face = at(180.0);
            let _ = write!(svg, "M{face} {}V{}", y - 12.0, y + 12.0);
        }
        svg += &format!("\" stroke=\"{INK}\" fill=\"none\" stroke-width=\"1.4\"/>");
        let mut ends = [face, at(MASS[0])];
        ends.sort_by(f64::total_cmp);
        svg + &self.gap(surfaces, ends, y)
    }

    /// Gap with the names of its surfaces above.
    fn gap(&self, surfaces: &[usize], [from, to]: [f64; 2], y: f64) -> String {
        let grazes = surfaces.iter().any(|surface| self.grazing.contains(surface));
        let ink = if grazes { GRAZING } else { SOFT };
        let middle = 0.5 * (from + to);
        let words = surfaces.iter().map(|&surface| self.words(surface));
        let words = escape_html(&words.collect::<Vec<_>>().join("; "));
        let [left, right] = [from + 3.0, to - 3.0];
        format!(
            "<path d=\"M{left} {y}H{right}M{} {}l-6 4 6 4M{} {}l6 4 -6 4\" stroke=\"{ink}\" \
                fill=\"none\"/><text x=\"{middle}\" y=\"{}\" text-anchor=\"middle\" \
                fill=\"{ink}\">{words}</text>",
            left + 6.0,
            y - 4.0,
            right - 6.0,
            y - 4.0,
            y - MASS[1] - 12.0
        )
    }

    fn words(&self, surface: usize) -> String {
        let own = &self.model.surfaces[surface];
        let mut name: String = own.name.chars().take(LONGEST).collect();
        if name.len() < own.name.len() {
            name.push('…');
        }
        let inputs = self.model.graph.dependencies(own.event);
        let moves = self.model.phase.is_some() && inputs.contains(&self.model.states.len());
        let kind = match own.response {
            Response::Impact { .. } => "rigid",
            Response::Contact { .. } => "compliant",
        };
        format!("“{name}”: {kind}{}", if moves { ", moving" } else { "" })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::model::Scene;

    fn rows_of(name: &str) -> Vec<(String, usize, usize, bool)> {
        let scene = Scene::of_catalogue(name).expect("a scene of the catalogue");
        let model = &scene.model;
        let values = model.parameter_values();
        let mut point = vec![0.1; model.dimension()];
        point.extend(values.iter().map(|value| value.to_f64()));
        let count = |row: SketchRow| {
            let name = model.states[row.middle].clone();
            (name, row.left.len(), row.right.len(), row.other.is_some())
        };
        rows(model, &point).into_iter().map(count).collect()
    }

    fn forces_of(name: &str, mass: usize) -> String {
        let scene = Scene::of_catalogue(name).expect("a scene of the catalogue");
        let values = scene.model.parameter_values();
        let mut point = vec![0.1; scene.model.dimension()];
        point.extend(values.iter().map(|value| value.to_f64()));
        forces(&scene.model, mass, &point)
    }

    #[test]
    fn forces_are_those_of_the_flow() {
        assert_eq!(forces_of("linear", 0), "spring · damper · forced");
        let masses = forces_of("two_stops_t1", 0);
        assert!(masses.contains("coupled to x2"), "{masses}");
    }

    #[test]
    fn stops_stand_on_the_side_from_which_the_gap_grows() {
        let row = |name: &str, left, right, pair| (name.to_owned(), left, right, pair);
        assert_eq!(rows_of("cantilever_3_5_soft"), [row("q", 1, 0, false)]);
        assert_eq!(rows_of("linear"), [row("x", 0, 1, false)]);
        assert_eq!(rows_of("two_stops_t1"), [row("x1", 1, 1, false), row("x2", 0, 0, false)]);
        assert_eq!(rows_of("impact_pair"), [row("x1", 0, 0, true)]);
    }
}
