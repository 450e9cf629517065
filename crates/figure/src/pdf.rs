//! The PDF painter: one page of the figure's size, letters as outlines.

use miniz_oxide::deflate::compress_to_vec_zlib;
use pdf_writer::types::{LineCapStyle, LineJoinStyle};
use pdf_writer::{Content, Filter, Finish as _, Name, Pdf, Ref, TextStr};
use tiny_skia::{Path, PathSegment, Point, Rect};

use super::FigureError;
use super::drawing::{DotRuns, Drawing, Mosaic};
use super::painter::{self, Canvas, Pen};
use super::series::{PAPER, Rgb};
use super::svg::plain;

/// Points of a PDF for a CSS pixel: 72 and 96 to the inch.
const POINTS: f32 = 0.75;
/// Level of compression, of 10.
const LEVEL: u8 = 6;

/// The drawing as a PDF document.
pub(super) fn paint(drawing: &Drawing) -> Result<Vec<u8>, FigureError> {
    let [width, height] = [drawing.size.0, drawing.size.1].map(|side| side as f32 * POINTS);
    let mut page = PdfPage { content: Content::new(), images: Vec::new(), shares: Vec::new() };
    page.content.transform([POINTS, 0.0, 0.0, -POINTS, 0.0, height]);
    if let Some(paper) = Rect::from_xywh(0.0, 0.0, width / POINTS, height / POINTS) {
        page.cell(paper, PAPER);
    }
    painter::paint(drawing, &mut page)?;
    Ok(page.document([width, height], &plain(&drawing.title)))
}

/// Content of the page, with its images and opacities by name.
struct PdfPage {
    content: Content,
    images: Vec<(String, Image)>,
    shares: Vec<(String, f32)>,
}

/// Colours of a grid, three bytes a cell, rows from the top.
struct Image {
    columns: usize,
    bytes: Vec<u8>,
}

impl PdfPage {
    fn document(self, [width, height]: [f32; 2], title: &str) -> Vec<u8> {
        let mut numbers = (1..).map(Ref::new);
        let mut next = || numbers.next().expect("numbers do not end");
        let (catalog, pages, page, content, info) = (next(), next(), next(), next(), next());
        let images: Vec<_> = self.images.iter().map(|named| (named, next())).collect();
        let shares: Vec<_> = self.shares.iter().map(|named| (named, next())).collect();
        let mut pdf = Pdf::new();
        pdf.catalog(catalog).pages(pages);
        pdf.document_info(info).title(TextStr(title)).creator(TextStr("Grazemap"));
        pdf.pages(pages).kids([page]).count(1);
        let mut leaf = pdf.page(page);
        leaf.parent(pages).contents(content);
        leaf.media_box(pdf_writer::Rect::new(0.0, 0.0, width, height));
        let mut resources = leaf.resources();
        let mut objects = resources.x_objects();
        for ((name, _), at) in &images {
            objects.pair(Name(name.as_bytes()), *at);
        }
        objects.finish();
        let mut states = resources.ext_g_states();
        for ((name, _), at) in &shares {
            states.pair(Name(name.as_bytes()), *at);
        }
        states.finish();
        resources.finish();
        leaf.finish();
        let bytes = compress_to_vec_zlib(&self.content.finish(), LEVEL);
        pdf.stream(content, &bytes).filter(Filter::FlateDecode);
        for ((_, image), at) in &images {
            let bytes = compress_to_vec_zlib(&image.bytes, LEVEL);
            let mut object = pdf.image_xobject(*at, &bytes);
            object.filter(Filter::FlateDecode);
            object
                .width(image.columns as i32)
                .height((image.bytes.len() / 3 / image.columns) as i32);
            object.color_space().device_rgb();
            object.bits_per_component(8);
        }
        for ((_, share), at) in &shares {
            pdf.ext_graphics(*at).stroking_alpha(*share);
        }
        pdf.finish()
    }

    fn trace(&mut self, path: &Path) {
        let mut last = Point::zero();
        for segment in path.segments() {
            match segment {
                PathSegment::MoveTo(to) => {
                    self.content.move_to(to.x, to.y);
                    last = to;
                }
                PathSegment::LineTo(to) => {
                    self.content.line_to(to.x, to.y);
                    last = to;
                }
                PathSegment::QuadTo(by, to) => {
                    // The same parabola as a cubic curve.
                    let between = |end: f32, by: f32| end + (by - end) * 2.0 / 3.0;
                    let [a, b] = [last, to].map(|end| (between(end.x, by.x), between(end.y, by.y)));
                    self.content.cubic_to(a.0, a.1, b.0, b.1, to.x, to.y);
                    last = to;
                }
                PathSegment::CubicTo(a, b, to) => {
                    self.content.cubic_to(a.x, a.y, b.x, b.y, to.x, to.y);
                    last = to;
                }
                PathSegment::Close => {
                    self.content.close_path();
                }
            }
        }
    }

    fn take(&mut self, pen: &Pen, color: Rgb) {
        let [r, g, b] = shades(color);
        let content = self.content.set_stroke_rgb(r, g, b).set_line_width(pen.width);
        content.set_line_join(LineJoinStyle::RoundJoin);
        content.set_dash_pattern(pen.dashes.iter().copied(), 0.0);
    }
}

fn shades(color: Rgb) -> [f32; 3] {
    color.map(|shade| f32::from(shade) / 255.0)
}

impl Canvas for PdfPage {
    fn fill(&mut self, path: &Path, color: Rgb) {
        let [r, g, b] = shades(color);
        self.content.set_fill_rgb(r, g, b);
        self.trace(path);
        self.content.fill_nonzero();
    }

    fn stroke(&mut self, path: &Path, pen: &Pen, color: Rgb) {
        self.take(pen, color);
        self.trace(path);
        self.content.stroke();
    }

    fn cell(&mut self, cell: Rect, color: Rgb) {
        let [r, g, b] = shades(color);
        self.content.set_fill_rgb(r, g, b);
        self.content.rect(cell.x(), cell.y(), cell.width(), cell.height()).fill_nonzero();
    }

    fn dots(&mut self, dots: &DotRuns) {
        let name = format!("S{}", self.shares.len());
        self.content.save_state();
        self.content.set_parameters(Name(name.as_bytes()));
        self.shares.push((name, dots.share as f32));
        self.take(&Pen::of_width(dots.diameter), dots.color);
        self.content.set_line_cap(LineCapStyle::RoundCap);
        for [first, last] in dots.ends() {
            self.content.move_to(first.0 as f32, first.1 as f32);
            self.content.line_to(last.0 as f32, last.1 as f32);
        }
        self.content.stroke();
        self.content.restore_state();
    }

    fn mosaic(&mut self, mosaic: &Mosaic) {
        let name = format!("I{}", self.images.len());
        let bytes = mosaic.colors.iter().flatten().copied().collect();
        let (from, to) = (mosaic.from, mosaic.to);
        let [width, height] = [(to.0 - from.0) as f32, (to.1 - from.1) as f32];
        self.content.save_state();
        // An image fills the unit square, `y` upwards.
        self.content.transform([width, 0.0, 0.0, -height, from.0 as f32, to.1 as f32]);
        self.content.x_object(Name(name.as_bytes()));
        self.content.restore_state();
        self.images.push((name, Image { columns: mosaic.columns, bytes }));
    }
}
