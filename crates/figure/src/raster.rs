//! The bitmap painter: plotters draws at four times the size, then every two by two pixels are
//! averaged. Plotters draws whole lines only; dashed lines are cut into strokes here.

use plotters::backend::{BitMapBackend, DrawingBackend};
use plotters::style::{FontTransform, RGBColor, TextStyle};

use super::FigureError;
use super::drawing::{Anchor, Direction, DotRuns, Drawing, Mosaic, Point, Shape, dashes, outline};
use super::series::{Marker, PAPER, Rgb, mixed};
use super::text::{Face, Level, face_width, faces, runs};

/// Pixels drawn for every CSS pixel, before averaging.
const FINE: f64 = 4.0;
/// Pixels averaged into one, along each side.
const AVERAGED: usize = 2;

/// The drawing as a PNG of twice its size.
pub(super) fn paint(drawing: &Drawing) -> Result<Vec<u8>, FigureError> {
    let scale = FINE as u32;
    let size = (drawing.size.0 * scale, drawing.size.1 * scale);
    let mut pixels = vec![0xff; size.0 as usize * size.1 as usize * 3];
    {
        let mut canvas = Canvas { backend: BitMapBackend::with_buffer(&mut pixels, size) };
        for shape in &drawing.shapes {
            canvas.draw(shape)?;
        }
        canvas.backend.present().map_err(refused)?;
    }
    let (pixels, size) = averaged(&pixels, size);
    encode(&pixels, size)
}

/// Pixels, three bytes each, as a PNG: the shorter of two, since scattered dots and areas ask for
/// different filters.
pub(super) fn encode(pixels: &[u8], size: (u32, u32)) -> Result<Vec<u8>, FigureError> {
    let by_rows = encode_by(png::Filter::Up, pixels, size)?;
    let as_is = encode_by(png::Filter::NoFilter, pixels, size)?;
    Ok(if as_is.len() < by_rows.len() { as_is } else { by_rows })
}

fn encode_by(
    filter: png::Filter,
    pixels: &[u8],
    (width, height): (u32, u32),
) -> Result<Vec<u8>, FigureError> {
    let mut bytes = Vec::new();
    let mut encoder = png::Encoder::new(&mut bytes, width, height);
    encoder.set_color(png::ColorType::Rgb);
    encoder.set_depth(png::BitDepth::Eight);
    encoder.set_compression(png::Compression::Balanced);
    encoder.set_filter(filter);
    let mut writer = encoder.write_header()?;
    writer.write_image_data(pixels)?;
    writer.finish()?;
    Ok(bytes)
}

fn averaged(pixels: &[u8], (width, height): (u32, u32)) -> (Vec<u8>, (u32, u32)) {
    let (wide, tall) = (width as usize / AVERAGED, height as usize / AVERAGED);
    let mut out = Vec::with_capacity(wide * tall * 3);
    for y in 0..tall {
        for x in 0..wide {
            for channel in 0..3 {
                let at = |i: usize, j: usize| {
                    let pixel = (y * AVERAGED + j) * width as usize + x * AVERAGED + i;
                    u32::from(pixels[pixel * 3 + channel])
                };
                let sum = at(0, 0) + at(1, 0) + at(0, 1) + at(1, 1);
                out.push(((sum + 2) / 4) as u8);
            }
        }
    }
    (out, (wide as u32, tall as u32))
}

fn refused<E: std::error::Error>(error: E) -> FigureError {
    FigureError::Bitmap(error.to_string())
}

fn paint_of([r, g, b]: Rgb) -> RGBColor {
    RGBColor(r, g, b)
}

fn fine((x, y): Point) -> (i32, i32) {
    ((x * FINE).round() as i32, (y * FINE).round() as i32)
}

struct Canvas<'a> {
    backend: BitMapBackend<'a>,
}

impl Canvas<'_> {
    fn draw(&mut self, shape: &Shape) -> Result<(), FigureError> {
        match shape {
            Shape::Line { points, width, stroke, color } => {
                let pattern = dashes(*stroke, *width);
                if pattern.is_empty() {
                    return self.line(points, *width, *color);
                }
                dashed(points, &pattern).iter().try_for_each(|dash| self.line(dash, *width, *color))
            }
            Shape::Rectangle { from, to, fill } => self.rectangle(*from, *to, *fill),
            Shape::Mark { at, radius, marker, color } => self.mark(*at, *radius, *marker, *color),
            Shape::Dots(dots) => self.dots(dots),
            Shape::Mosaic(mosaic) => self.mosaic(mosaic),
            Shape::Text { at, anchor, direction, size, color, text, halo } => {
                if *halo {
                    for k in 0..12 {
                        let (dy, dx) = (f64::from(k) * std::f64::consts::TAU / 12.0).sin_cos();
                        let around = (at.0 + 1.5 * dx, at.1 + 1.5 * dy);
                        self.text(around, *anchor, *direction, *size, PAPER, text)?;
                    }
                }
                self.text(*at, *anchor, *direction, *size, *color, text)
            }
        }
    }

    /// Every segment as a filled bar, rounded where segments meet.
    fn line(&mut self, points: &[Point], width: f64, color: Rgb) -> Result<(), FigureError> {
        for pair in points.windows(2) {
            let (a, b) = (pair[0], pair[1]);
            let length = (b.0 - a.0).hypot(b.1 - a.1);
            if length > 0.0 {
                let across =
                    ((b.1 - a.1) / length * width / 2.0, (a.0 - b.0) / length * width / 2.0);
                self.bar(a, b, across, color)?;
            }
        }
        let inner = points.get(1..points.len().saturating_sub(1)).unwrap_or(&[]);
        inner.iter().try_for_each(|&joint| self.disc(joint, width / 2.0, color))
    }

    fn bar(&mut self, a: Point, b: Point, across: Point, color: Rgb) -> Result<(), FigureError> {
        if across.0.abs() < 1e-9 || across.1.abs() < 1e-9 {
            let half = (across.0.abs(), across.1.abs());
            let low = (a.0.min(b.0) - half.0, a.1.min(b.1) - half.1);
            let high = (a.0.max(b.0) + half.0, a.1.max(b.1) + half.1);
            return self.rectangle(low, high, color);
        }
        self.polygon(
            &[
                (a.0 + across.0, a.1 + across.1),
                (b.0 + across.0, b.1 + across.1),
                (b.0 - across.0, b.1 - across.1),
                (a.0 - across.0, a.1 - across.1),
            ],
            color,
        )
    }

    fn polygon(&mut self, points: &[Point], color: Rgb) -> Result<(), FigureError> {
        let corners: Vec<(i32, i32)> = points.iter().copied().map(fine).collect();
        self.backend.fill_polygon(corners, &paint_of(color)).map_err(refused)
    }

    fn disc(&mut self, center: Point, radius: f64, color: Rgb) -> Result<(), FigureError> {
        let radius = ((radius * FINE).round() as u32).max(1);
        self.backend.draw_circle(fine(center), radius, &paint_of(color), true).map_err(refused)
    }

    /// A filled rectangle of at least one fine pixel.
    fn rectangle(&mut self, from: Point, to: Point, color: Rgb) -> Result<(), FigureError> {
        let (low, high) = (fine(from), fine(to));
        // NOTE: plotters fills up to the second corner, which is excluded.
        let last = (high.0.max(low.0 + 1), high.1.max(low.1 + 1));
        self.backend.draw_rect(low, last, &paint_of(color), true).map_err(refused)
    }

    fn mark(
        &mut self,
        at: Point,
        radius: f64,
        marker: Marker,
        color: Rgb,
    ) -> Result<(), FigureError> {
        match marker {
            Marker::Circle => self.disc(at, radius, color),
            Marker::Ring => {
                self.disc(at, radius + 0.7, color)?;
                self.disc(at, radius - 0.7, PAPER)
            }
            Marker::Cross => {
                let s = 0.85 * radius;
                self.line(&[(at.0 - s, at.1 - s), (at.0 + s, at.1 + s)], 1.5, color)?;
                self.line(&[(at.0 - s, at.1 + s), (at.0 + s, at.1 - s)], 1.5, color)
            }
            Marker::Square | Marker::Diamond | Marker::Triangle => {
                self.polygon(&outline(marker, at, radius), color)
            }
        }
    }

    fn dots(&mut self, dots: &DotRuns) -> Result<(), FigureError> {
        let half = dots.diameter / 2.0;
        // NOTE: runs overlap, so that they are painted in an opaque mixture.
        let color = mixed(PAPER, dots.color, dots.share);
        for &(row, first, count) in &dots.runs {
            let y = dots.origin.1 + f64::from(row) * dots.pitch.1;
            let from = dots.origin.0 + f64::from(first) * dots.pitch.0;
            let to = from + f64::from(count - 1) * dots.pitch.0;
            self.rectangle((from - half, y - half), (to + half, y + half), color)?;
        }
        Ok(())
    }

    fn mosaic(&mut self, mosaic: &Mosaic) -> Result<(), FigureError> {
        let rows = mosaic.colors.len() / mosaic.columns;
        let pitch = (
            (mosaic.to.0 - mosaic.from.0) / mosaic.columns as f64,
            (mosaic.to.1 - mosaic.from.1) / rows as f64,
        );
        for (index, color) in mosaic.colors.iter().enumerate() {
            let (row, column) = (index / mosaic.columns, index % mosaic.columns);
            let from =
                (mosaic.from.0 + column as f64 * pitch.0, mosaic.from.1 + row as f64 * pitch.1);
            self.rectangle(from, (from.0 + pitch.0, from.1 + pitch.1), *color)?;
        }
        Ok(())
    }

    fn text(
        &mut self,
        at: Point,
        anchor: Anchor,
        direction: Direction,
        size: f64,
        color: Rgb,
        text: &str,
    ) -> Result<(), FigureError> {
        let mut parts: Vec<(Face, Level, String, f64)> = Vec::new();
        for (level, run) in runs(text) {
            for (face, run) in faces(&run) {
                let wide = face_width(face, &run, size * level.scale())?;
                parts.push((face, level, run, wide));
            }
        }
        let total: f64 = parts.iter().map(|(.., wide)| wide).sum();
        let mut along = match anchor {
            Anchor::Start => 0.0,
            Anchor::Middle => -total / 2.0,
            Anchor::End => -total,
        };
        for (face, level, run, wide) in parts {
            // NOTE: plotters puts the baseline half the font's height below the point it is given.
            let font = face.font(size * level.scale() * FINE)?;
            let above = font.get_size() / 2.0 / FINE;
            let below = level.shift() * size - above;
            let (place, turn) = match direction {
                Direction::Across => ((at.0 + along, at.1 + below), FontTransform::None),
                Direction::Upwards => ((at.0 + below, at.1 - along), FontTransform::Rotate270),
            };
            let ink = paint_of(color);
            let style = TextStyle::from(font.transform(turn)).color(&ink);
            // NOTE: the sans-serif font is a light one; drawn twice, a fine pixel apart, it looks
            // regular.
            let times = if face == Face::Sans { 2 } else { 1 };
            for shift in 0..times {
                let (x, y) = fine(place);
                self.backend.draw_text(&run, &style, (x + shift, y)).map_err(refused)?;
            }
            along += wide;
        }
        Ok(())
    }
}

/// Drawn parts of a dashed line, by lengths of strokes and gaps in turn.
pub(super) fn dashed(points: &[Point], pattern: &[f64]) -> Vec<Vec<Point>> {
    let mut drawn = Vec::new();
    let mut dash: Vec<Point> = points.first().copied().into_iter().collect();
    let (mut index, mut left) = (0, pattern[0]);
    for pair in points.windows(2) {
        let (mut a, b) = (pair[0], pair[1]);
        let mut length = (b.0 - a.0).hypot(b.1 - a.1);
        while length > left {
            let t = left / length;
            a = (a.0 + t * (b.0 - a.0), a.1 + t * (b.1 - a.1));
            length -= left;
            if index % 2 == 0 {
                dash.push(a);
                drawn.push(std::mem::take(&mut dash));
            } else {
                dash = vec![a];
            }
            index += 1;
            left = pattern[index % pattern.len()];
        }
        left -= length;
        if index % 2 == 0 {
            dash.push(b);
        }
    }
    if dash.len() > 1 {
        drawn.push(dash);
    }
    drawn
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn dashes_keep_their_lengths_around_corners() {
        let found = dashed(&[(0.0, 0.0), (3.0, 0.0), (3.0, 5.0)], &[2.0, 2.0]);
        assert_eq!(found, [vec![(0.0, 0.0), (2.0, 0.0)], vec![(3.0, 1.0), (3.0, 3.0)],]);
    }
}
