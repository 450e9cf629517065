//! Basins of attraction as figures, tables and arrays.

use super::chart_figure::edges;
use super::diagram_figure::{
    OUTSIDE, method_word, offset_axis, orbit_header, period_cell, share_cell,
};
use super::figure::{
    Annotation, Axis, CellCategory, CellChart, CellColor, Figure, Marker, Series, Stroke,
};
use super::table::significant;
use super::window_words::{escape_words, filled_words};
use super::{Cell, Column, ReportError, Rows, Table, npy_bytes};
use crate::analysis::basin::{
    Attractor, Basin, BasinAttractor, BasinAxis, BasinClass, BasinShare, ManifoldBranch,
    ManifoldKind, Manifolds,
};
use crate::iteration::Period;
use crate::model::Method;
use crate::numeric::Shown;

/// Words for the classes that are not attractors.
const ESCAPED: &str = "escaped";
const UNDECIDED: &str = "undecided";
const NO_IMAGE: &str = "no image";

/// Largest number of points for which a periodic attractor is drawn with markers instead of dots.
const MARKED: usize = 64;

/// Figure of a basin. Each attractor has a colour and marked points, the first with its number;
/// cells are grey where the map alone leaves its window, pale where there is no image, and white
/// where orbits escape.
pub fn basin_figure(basin: &Basin) -> Figure {
    let [horizontal, vertical] = &basin.axes;
    let mut figure = Figure::new(axis(horizontal), axis(vertical));
    let attractors = basin.attractors.len();
    let named = basin.attractors.iter().enumerate().map(name).enumerate();
    let mut categories: Vec<CellCategory> =
        named.map(|(number, name)| CellCategory::numbered(name, number, attractors)).collect();
    let mut others = |share: &BasinShare, words: &str, color| {
        (share.count > 0).then(|| {
            categories.push(CellCategory::new(words, color));
            categories.len() - 1
        })
    };
    let grey = others(&basin.outside, "outside the window", CellColor::Grey);
    let pale = others(&basin.no_image, NO_IMAGE, CellColor::Pale);
    let category = |class: &BasinClass| match class {
        BasinClass::Attractor(number) => Some(*number),
        BasinClass::Outside => grey,
        BasinClass::NoImage => pale,
        BasinClass::Escaped | BasinClass::Undecided => None,
    };
    figure.cells = Some(CellChart {
        horizontal: edges(&horizontal.offsets),
        vertical: edges(&vertical.offsets),
        columns: horizontal.offsets.len(),
        rows: vertical.offsets.len(),
        cells: basin.cells.iter().map(category).collect(),
        categories,
        bar: None,
    });
    let places = basin.axes.each_ref().map(|axis| place(basin, axis));
    for number in 0..attractors {
        let states = &basin.attractors[number].attractor.states;
        let points: Vec<[f64; 2]> =
            states.iter().map(|state| places.map(|place| state[place])).collect();
        let label =
            |&at: &[f64; 2]| Annotation { at, text: (number + 1).to_string(), marker: None };
        figure.annotations.extend(points.first().map(label));
        // NOTE: ink is the colour of no attractor.
        let series = match states.len() {
            0..=MARKED => Series::markers("", Marker::Ring, points),
            _ => Series::dots("", points),
        };
        figure.series.push(series.in_ink());
    }
    if let Some(manifolds) = &basin.manifolds {
        let curves = |kind| manifold_series(manifolds, kind, places);
        let points = manifolds.saddles.iter().flat_map(|saddle| &saddle.states);
        let points = points.map(|state| places.map(|place| state[place])).collect();
        // NOTE: the colour of unstable manifolds belongs to no attractor.
        let all = [
            curves(ManifoldKind::Stable).in_ink(),
            curves(ManifoldKind::Unstable).with_color(attractors),
            Series::markers("saddles", Marker::Cross, points).in_ink(),
        ];
        // The legend holds what the plane shows.
        figure.series.extend(all.into_iter().filter(|series| is_seen(&basin.axes, series)));
    }
    figure
}

/// Whether a point of a series lies in the plane.
fn is_seen(axes: &[BasinAxis; 2], series: &Series) -> bool {
    let ranges = axes.each_ref().map(|axis| edges(&axis.offsets));
    let within = |point: &[f64; 2]| {
        let mut values = point.iter().zip(ranges);
        values.all(|(value, (low, high))| (low..=high).contains(value))
    };
    series.points.iter().any(within)
}

/// Curves of one kind of manifold, as one series.
fn manifold_series(manifolds: &Manifolds, kind: ManifoldKind, places: [usize; 2]) -> Series {
    let of_kind = manifolds.branches.iter().filter(|branch| branch.kind == kind);
    let pieces = of_kind.flat_map(|branch| &branch.pieces);
    // NOTE: a point that is not finite interrupts the line.
    let points = pieces.flat_map(|piece| {
        let points = piece.iter().map(|point| places.map(|place| point[place]));
        points.chain([[f64::NAN; 2]])
    });
    let name = format!("{} manifolds", kind.word());
    Series::line(name, Stroke::Solid, points.collect())
}

/// Table of the manifolds of a basin, one row per half of a curve.
pub fn manifold_table(basin: &Basin, manifolds: &Manifolds) -> Table {
    let scales = manifold_scales(basin);
    let saddle = |branch: &ManifoldBranch| &manifolds.saddles[branch.saddle];
    let multipliers = |branch: &ManifoldBranch| {
        saddle(branch).multipliers.map(|value| significant(value, 4)).join(", ")
    };
    let table = Table::of(&manifolds.branches)
        .text("manifold", |branch| branch.kind.word())
        .text("saddle", |branch| saddle(branch).itinerary.to_string())
        .column(Column::number("multipliers"), |branch| Cell::text(multipliers(branch)))
        .count("point", |branch| branch.point + 1)
        .text("side", |branch| branch.side.sign())
        .count("pieces", |branch| branch.pieces.len())
        .count("points", |branch| branch.pieces.iter().map(Vec::len).sum::<usize>())
        .number("length", 4, |branch| branch.length(scales))
        .text("the curve", |branch| branch.end.words());
    table.made()
}

/// Widths of the plane, by section coordinate.
fn manifold_scales(basin: &Basin) -> [f64; 2] {
    let mut scales = [1.0; 2];
    for axis in &basin.axes {
        let (low, high) = edges(&axis.offsets);
        scales[place(basin, axis)] = high - low;
    }
    scales
}

/// One row per point of the manifolds: its curve, its distance along the curve from the saddle in
/// widths of the plane, and its offsets.
pub fn manifold_rows<'a>(basin: &'a Basin, manifolds: &'a Manifolds) -> Rows<'a> {
    let words = [Column::text("manifold"), Column::text("itinerary")];
    let numbers = [Column::number("saddle"), Column::number("point")];
    let places = [Column::text("branch"), Column::number("piece"), Column::number("s")];
    let coordinates = basin.coordinates.iter().map(|name| Column::number(name.clone()));
    let columns = words.into_iter().chain(numbers).chain(places).chain(coordinates);
    let scales = manifold_scales(basin);
    let rows = manifolds.branches.iter().flat_map(move |branch| {
        let mut s = 0.0;
        let pieces = branch.pieces.iter().enumerate();
        pieces.flat_map(move |(number, piece)| {
            let mut last = None;
            let points = piece.iter().map(|&[x, y]| {
                let [u, v] = last.replace([x, y]).unwrap_or([x, y]);
                s += ((x - u) / scales[0]).hypot((y - v) / scales[1]);
                vec![
                    Cell::text(branch.kind.word()),
                    Cell::text(manifolds.saddles[branch.saddle].itinerary.to_string()),
                    Cell::Integer(branch.saddle as i64 + 1),
                    Cell::Integer(branch.point as i64 + 1),
                    Cell::text(branch.side.sign()),
                    Cell::Integer(number as i64 + 1),
                    Cell::number(s, 6),
                    Cell::number(x, 6),
                    Cell::number(y, 6),
                ]
            });
            points.collect::<Vec<_>>()
        })
    });
    Rows::new(columns.collect(), rows)
}

/// Name of an attractor: number, period and itinerary.
fn name((number, found): (usize, &BasinAttractor)) -> String {
    format!("{}: {}", number + 1, attractor_words(found))
}

/// Period and itinerary of an attractor, as text.
fn attractor_words(found: &BasinAttractor) -> String {
    let attractor = &found.attractor;
    match (attractor.period, &attractor.itinerary) {
        (Period::Periodic(period), Some(itinerary)) if itinerary.period() != period => {
            // NOTE: returns of the itinerary are counted differently from those of the period.
            let name = attractor.orbit.as_ref().map(ToString::to_string);
            format!("period {period}, orbit {}", name.unwrap_or_default())
        }
        (Period::Periodic(period), Some(itinerary)) if period <= 8 => {
            format!("period {period}, itinerary {itinerary}")
        }
        (Period::Periodic(period), _) => format!("period {period}"),
        (Period::NotFound, _) => match attractor.lyapunov {
            Some(exponent) if exponent > 1e-3 => "chaotic".to_owned(),
            _ => "no period".to_owned(),
        },
    }
}

/// Class of a cell, as in tables.
fn class_cell(class: BasinClass) -> Cell {
    match class {
        BasinClass::Attractor(number) => Cell::Integer(number as i64 + 1),
        BasinClass::Escaped => Cell::text(ESCAPED),
        BasinClass::NoImage => Cell::text(NO_IMAGE),
        BasinClass::Outside => Cell::text(OUTSIDE),
        BasinClass::Undecided => Cell::text(UNDECIDED),
    }
}

/// One row per cell: offsets on both axes, and the number of its attractor.
pub fn basin_rows(basin: &Basin) -> Rows<'_> {
    let axes = basin.axes.iter().map(|axis| Column::number(axis.coordinate.clone()));
    let columns = axes.chain([Column::text("attractor")]).collect();
    let rows = basin.located().map(|([first, second], class)| {
        vec![Cell::number(first, 6), Cell::number(second, 6), class_cell(class)]
    });
    Rows::new(columns, rows)
}

/// Array of attractors, of shape (rows, columns): second axis by first axis. Values are the number
/// of the attractor from 1, 0 if undecided, −1 where the map alone leaves its window, −2 where
/// there is no image, NaN where orbits escape.
///
/// # Errors
///
/// [`ReportError::ArrayShape`] if there are not as many cells as the axes have offsets.
pub fn basin_array(basin: &Basin) -> Result<Vec<u8>, ReportError> {
    let number = |class: &BasinClass| match class {
        BasinClass::Attractor(number) => *number as f64 + 1.0,
        BasinClass::Undecided => 0.0,
        BasinClass::Outside => -1.0,
        BasinClass::NoImage => -2.0,
        BasinClass::Escaped => f64::NAN,
    };
    let values: Vec<f64> = basin.cells.iter().map(number).collect();
    let [columns, rows] = [&basin.axes[0], &basin.axes[1]].map(|axis| axis.offsets.len());
    npy_bytes(&[rows, columns], &values)
}

/// Table of the attractors of a basin and the shares of all classes.
pub fn basin_table(basin: &Basin) -> Table {
    let attractors =
        basin.attractors.iter().enumerate().map(|(number, found)| {
            ((number + 1).to_string(), Some(&found.attractor), &found.share)
        });
    let others = [
        (ESCAPED, &basin.escaped),
        (NO_IMAGE, &basin.no_image),
        (OUTSIDE, &basin.outside),
        (UNDECIDED, &basin.undecided),
    ];
    let others = others.into_iter().filter(|(_, share)| share.count > 0);
    let others = others.map(|(word, share)| (word.to_owned(), None, share));
    let rows: Vec<(String, Option<&Attractor>, &BasinShare)> = attractors.chain(others).collect();
    let words = |text: Option<String>| text.map_or(Cell::Missing, Cell::text);
    let largest =
        |attractor: &Attractor| attractor.multipliers.first().map(|[re, im]| re.hypot(*im));
    Table::of(&rows)
        .text("attractor", |(name, ..)| name)
        .column(Column::text("itinerary"), |(_, of, _)| {
            words(of.and_then(|of| of.itinerary.as_ref()).map(ToString::to_string))
        })
        .column(Column::number("period"), |(_, of, _)| {
            of.map_or(Cell::Missing, |of| period_cell(of.period))
        })
        .column(Column::text(orbit_header(&basin.surfaces)), |(_, of, _)| {
            words(of.and_then(|of| of.orbit.as_ref()).map(ToString::to_string))
        })
        .number("largest multiplier", 6, |(_, of, _)| of.and_then(largest))
        .number("exponent", 6, |(_, of, _)| of.and_then(|of| of.lyapunov))
        .column(Column::number("fraction"), |(.., share)| share_cell(share.fraction))
        .number("± border", 2, |(.., share)| share.boundary)
        .number("± sampling", 2, |(.., share)| share.statistical)
        .made()
}

/// Basin as text: words, table, manifolds, remarks and time.
pub fn basin_text(basin: &Basin) -> String {
    let mut text = format!("{}\n{}\n", basin_words(basin), basin_table(basin).to_text());
    if let Some(manifolds) = &basin.manifolds {
        text.push_str(&format!("{}\n", manifold_table(basin, manifolds).to_text()));
    }
    for remark in basin_remarks(basin) {
        text.push_str(&format!("{remark}\n"));
    }
    let timing = &basin.timing;
    text.push_str(&format!(
        "{} iterates in {:.2} s on {} threads\n",
        timing.iterates, timing.seconds, timing.threads
    ));
    text
}

/// Parameters, plane and method of a basin, as text.
pub fn basin_words(basin: &Basin) -> String {
    let at: Vec<String> = basin
        .parameters
        .iter()
        .map(|p| format!("{} = {} (offset {})", p.name, Shown(p.value), Shown(p.offset)))
        .collect();
    let [first, second] = &basin.axes;
    let mut text = format!(
        "basins of `{}` over {} and {} at {}, {} by {} cells by {}\n",
        basin.scene,
        first.coordinate,
        second.coordinate,
        at.join(", "),
        first.offsets.len(),
        second.offsets.len(),
        method_word(basin.method)
    );
    let others = basin.coordinates.iter().zip(&basin.origin);
    let others: Vec<String> = others
        .filter(|(name, _)| basin.axes.iter().all(|axis| axis.coordinate != **name))
        .map(|(name, offset)| format!("{name} = {}", Shown(*offset)))
        .collect();
    if !others.is_empty() {
        text.push_str(&format!("other offsets: {}\n", others.join(", ")));
    }
    text
}

/// Explanations of the classes and numbers of a basin, as text.
pub fn basin_remarks(basin: &Basin) -> Vec<String> {
    let all = basin.cells.len();
    let mut remarks = vec![format!(
        "{:.4} of the cells touch another class; {} of {all} were followed",
        basin.border, basin.computed
    )];
    if basin.computed < all {
        remarks.push(format!(
            "{} cells were filled from computed cells of one class around them. {}",
            all - basin.computed,
            filled_words(&basin.probes)
        ));
    }
    if let Some(uncertainty) = &basin.uncertainty {
        let last = uncertainty.distances.last().copied().unwrap_or(1);
        remarks.push(format!(
            "uncertainty exponent {:.3} (1 for a smooth border), the border's dimension {:.3}: \
             from pairs of cells 1 to {last} apart",
            uncertainty.exponent,
            2.0 - uncertainty.exponent
        ));
    }
    if basin.method == Method::Guarded {
        remarks.push(format!(
            "the map made {:.4} % of the iterates; the others are direct simulation",
            100.0 * basin.by_map
        ));
    }
    if basin.escaped.count > 0 {
        remarks.push(format!("escaped: {}", escape_words(&basin.escape)));
    }
    if basin.attractors.iter().any(|found| found.attractor.period == Period::NotFound) {
        remarks.push(format!(
            "without a period: none up to {} after {} iterates, and none after eight times as many",
            basin.longest_period, basin.transient
        ));
    }
    remarks
}

/// Warning with the number of cells in which the map alone leaves its window, if any.
pub(super) fn basin_outside_words(basin: &Basin) -> Option<String> {
    (basin.outside.count > 0).then(|| {
        let filled = match basin.cells.len() - basin.computed {
            0 => String::new(),
            filled => format!(", {filled} of them filled between others,"),
        };
        format!(
            "from {} of {} states{filled} the map alone leaves its window (in grey: its error was \
             not measured there, and the method `guarded` simulates what lies outside)",
            basin.outside.count,
            basin.cells.len()
        )
    })
}

/// Index of an axis among the coordinates.
fn place(basin: &Basin, axis: &BasinAxis) -> usize {
    basin.coordinates.iter().position(|name| *name == axis.coordinate).unwrap_or(0)
}

fn axis(axis: &BasinAxis) -> Axis {
    let (low, high) = edges(&axis.offsets);
    offset_axis(&axis.coordinate).with_range(low, high)
}
