//! Shapes of a drawing as paths that are filled and stroked, for painters that know neither text
//! nor marks: bitmaps and PDF.

use tiny_skia::{Path, PathBuilder, Rect, Transform};

use super::FigureError;
use super::drawing::{Anchor, Direction, DotRuns, Drawing, Mosaic, Point, Shape, dashes, outline};
use super::series::{Marker, PAPER, Rgb};
use super::text::{Face, faces, outlined, runs};

/// Stroke along a path, with round joints.
pub(super) struct Pen {
    pub(super) width: f32,
    /// Lengths of strokes and gaps in turn; empty for a whole line.
    pub(super) dashes: Vec<f32>,
}

impl Pen {
    pub(super) fn of_width(width: f64) -> Self {
        Self { width: width as f32, dashes: Vec::new() }
    }
}

/// Picture under work, on which paths are put. Coordinates are CSS pixels, `y` downwards.
pub(super) trait Canvas {
    /// Fills a path, by its winding number.
    fn fill(&mut self, path: &Path, color: Rgb);
    /// Draws along a path.
    fn stroke(&mut self, path: &Path, pen: &Pen, color: Rgb);
    /// Fills a rectangle whose edges meet those of others.
    fn cell(&mut self, cell: Rect, color: Rgb);
    /// Fills runs of dots.
    fn dots(&mut self, dots: &DotRuns);
    /// Fills a grid of coloured cells.
    fn mosaic(&mut self, mosaic: &Mosaic);
}

/// Puts the shapes of a drawing on a canvas, bottom to top.
pub(super) fn paint(drawing: &Drawing, canvas: &mut impl Canvas) -> Result<(), FigureError> {
    drawing.shapes.iter().try_for_each(|shape| paint_shape(shape, canvas))
}

fn paint_shape(shape: &Shape, canvas: &mut impl Canvas) -> Result<(), FigureError> {
    match shape {
        Shape::Line { points, width, stroke, color } => {
            if let Some(path) = polyline(points, false) {
                let dashes = dashes(*stroke, *width).into_iter().map(|length| length as f32);
                let pen = Pen { dashes: dashes.collect(), ..Pen::of_width(*width) };
                canvas.stroke(&path, &pen, *color);
            }
        }
        Shape::Rectangle { from, to, fill } => {
            if let Some(cell) = rectangle(*from, *to) {
                canvas.cell(cell, *fill);
            }
        }
        Shape::Mark { at, radius, marker, color } => mark(*at, *radius, *marker, *color, canvas),
        Shape::Dots(dots) => canvas.dots(dots),
        Shape::Mosaic(mosaic) => canvas.mosaic(mosaic),
        Shape::Text { at, anchor, direction, size, color, text, halo } => {
            let letters = lettering(*at, *anchor, *direction, *size, text)?;
            if *halo {
                letters
                    .iter()
                    .for_each(|(_, path)| canvas.stroke(path, &Pen::of_width(3.0), PAPER));
            }
            for (face, path) in &letters {
                canvas.fill(path, *color);
                let weight = face.weight() * size;
                if weight > 0.0 {
                    canvas.stroke(path, &Pen::of_width(weight), *color);
                }
            }
        }
    }
    Ok(())
}

/// Rectangle between two corners, of no less than a hundredth of a pixel a side.
pub(super) fn rectangle(from: Point, to: Point) -> Option<Rect> {
    let least = |from: f64, to: f64| (to - from).max(0.01) as f32;
    Rect::from_xywh(from.0 as f32, from.1 as f32, least(from.0, to.0), least(from.1, to.1))
}

/// Path along points; none if they have no length.
fn polyline(points: &[Point], closed: bool) -> Option<Path> {
    let mut path = PathBuilder::new();
    for (place, &(x, y)) in points.iter().enumerate() {
        let add = if place == 0 { PathBuilder::move_to } else { PathBuilder::line_to };
        add(&mut path, x as f32, y as f32);
    }
    if closed {
        path.close();
    }
    path.finish()
}

fn mark(at: Point, radius: f64, marker: Marker, color: Rgb, canvas: &mut impl Canvas) {
    let circle = || PathBuilder::from_circle(at.0 as f32, at.1 as f32, radius as f32);
    match marker {
        Marker::Circle => circle().iter().for_each(|path| canvas.fill(path, color)),
        Marker::Ring => circle().iter().for_each(|path| {
            canvas.fill(path, PAPER);
            canvas.stroke(path, &Pen::of_width(1.4), color);
        }),
        Marker::Cross => {
            let s = 0.85 * radius;
            for down in [-s, s] {
                let ends = [(at.0 - s, at.1 - down), (at.0 + s, at.1 + down)];
                polyline(&ends, false)
                    .iter()
                    .for_each(|path| canvas.stroke(path, &Pen::of_width(1.5), color));
            }
        }
        Marker::Square | Marker::Diamond | Marker::Triangle => {
            polyline(&outline(marker, at, radius), true)
                .iter()
                .for_each(|path| canvas.fill(path, color));
        }
    }
}

/// Outlines of a text with markup, by typeface.
fn lettering(
    at: Point,
    anchor: Anchor,
    direction: Direction,
    size: f64,
    text: &str,
) -> Result<Vec<(Face, Path)>, FigureError> {
    let (mut letters, mut along) = (Vec::new(), 0.0);
    for (level, run) in runs(text) {
        for (face, run) in faces(&run) {
            let place = (at.0 + along, at.1 + level.shift() * size);
            let (path, width) = outlined(face, &run, size * level.scale(), place)?;
            letters.extend(path.map(|path| (face, path)));
            along += width;
        }
    }
    let back = match anchor {
        Anchor::Start => 0.0,
        Anchor::Middle => -along / 2.0,
        Anchor::End => -along,
    };
    let turn = match direction {
        Direction::Across => 0.0,
        Direction::Upwards => -90.0,
    };
    let placed =
        Transform::from_rotate_at(turn, at.0 as f32, at.1 as f32).pre_translate(back as f32, 0.0);
    let put = |(face, path): (Face, Path)| Some((face, path.transform(placed)?));
    Ok(letters.into_iter().filter_map(put).collect())
}
