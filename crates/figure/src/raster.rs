//! The bitmap painter.

use tiny_skia::{
    Color, FillRule, LineJoin, Paint, Path, Pixmap, Rect, Stroke, StrokeDash, Transform,
};

use super::drawing::{DotRuns, Drawing, Mosaic};
use super::painter::{self, Canvas, Pen};
use super::series::{PAPER, Rgb, mixed};
use super::{FigureError, MOST_PIXELS};

/// The drawing as a PNG with a number of pixels for every CSS pixel.
pub(super) fn paint(drawing: &Drawing, scale: f64) -> Result<Vec<u8>, FigureError> {
    let (width, height) = drawing.size;
    let side = |side: u32| (f64::from(side) * scale).round() as u32;
    let (width, height) = (side(width), side(height));
    let fits = width.max(height) <= MOST_PIXELS;
    let pixmap = if fits { Pixmap::new(width, height) } else { None };
    let mut pixmap = pixmap.ok_or(FigureError::Bitmap { width, height })?;
    pixmap.fill(ink(PAPER));
    let mut bitmap = Bitmap { pixmap, scale: scale as f32 };
    painter::paint(drawing, &mut bitmap)?;
    // Paper covers everything: no pixel is transparent.
    let pixels = bitmap.pixmap.pixels().iter();
    let pixels: Vec<u8> = pixels.flat_map(|p| [p.red(), p.green(), p.blue()]).collect();
    encode(&pixels, (width, height))
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

fn ink([r, g, b]: Rgb) -> Color {
    Color::from_rgba8(r, g, b, 0xff)
}

fn opaque(color: Rgb) -> Paint<'static> {
    let mut paint = Paint::default();
    paint.set_color(ink(color));
    paint
}

struct Bitmap {
    pixmap: Pixmap,
    scale: f32,
}

impl Bitmap {
    fn transform(&self) -> Transform {
        Transform::from_scale(self.scale, self.scale)
    }

    /// Rectangle with its edges moved to edges of pixels, of at least one pixel a side.
    fn snapped(&self, cell: Rect) -> Option<Rect> {
        let place = |value: f32| (value * self.scale).round();
        let (left, top) = (place(cell.left()), place(cell.top()));
        let right = place(cell.right()).max(left + 1.0);
        Rect::from_ltrb(left, top, right, place(cell.bottom()).max(top + 1.0))
    }
}

impl Canvas for Bitmap {
    fn fill(&mut self, path: &Path, color: Rgb) {
        let transform = self.transform();
        self.pixmap.fill_path(path, &opaque(color), FillRule::Winding, transform, None);
    }

    fn stroke(&mut self, path: &Path, pen: &Pen, color: Rgb) {
        let stroke = Stroke {
            width: pen.width,
            line_join: LineJoin::Round,
            dash: StrokeDash::new(pen.dashes.clone(), 0.0),
            ..Stroke::default()
        };
        let transform = self.transform();
        self.pixmap.stroke_path(path, &opaque(color), &stroke, transform, None);
    }

    fn cell(&mut self, cell: Rect, color: Rgb) {
        if let Some(cell) = self.snapped(cell) {
            self.pixmap.fill_rect(cell, &opaque(color), Transform::identity(), None);
        }
    }

    fn dots(&mut self, dots: &DotRuns) {
        // NOTE: runs overlap, so that they are painted in an opaque mixture.
        let color = mixed(PAPER, dots.color, dots.share);
        let half = dots.diameter / 2.0;
        for [(first, y), (last, _)] in dots.ends() {
            // Whole pixels: rows of dots then look alike, and the file is smaller.
            if let Some(run) = painter::rectangle((first - half, y - half), (last + half, y + half))
            {
                self.cell(run, color);
            }
        }
    }

    fn mosaic(&mut self, mosaic: &Mosaic) {
        for (cell, color) in mosaic.cells() {
            if let Some(cell) = painter::rectangle(cell.0, cell.1) {
                self.cell(cell, color);
            }
        }
    }
}
