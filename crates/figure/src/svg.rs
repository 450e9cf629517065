//! The SVG painter: text in the reader's own sans-serif font, all dots of a colour as one path, and
//! colours for readers who prefer dark pages. Charts of cells keep their colours on either.

use std::collections::BTreeSet;
use std::fmt::Write as _;

use base64::Engine as _;
use base64::prelude::BASE64_STANDARD as BASE64;

use super::FigureError;
use super::drawing::{Anchor, Direction, DotRuns, Drawing, Mosaic, Point, Shape, dashes, outline};
use super::raster::encode;
use super::series::{Marker, PAPER, Rgb, on_dark};
use super::text::{Level, escape_html, runs};

const FONTS: &str = "system-ui, -apple-system, 'Segoe UI', Helvetica, Arial, sans-serif";

/// Class of the pictures, to which their rules for dark pages are limited.
const CLASS: &str = "grazemap-figure";

/// The drawing as an SVG document.
pub(super) fn paint(drawing: &Drawing) -> Result<String, FigureError> {
    let (width, height) = drawing.size;
    let title = escape_html(&plain(&drawing.title));
    let mut svg = format!(
        "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"{width}\" height=\"{height}\" \
         viewBox=\"0 0 {width} {height}\" role=\"img\" class=\"{CLASS}\" \
         font-family=\"{FONTS}\">\n\
         <title>{title}</title>\n\
         {}\n\
         <rect width=\"{width}\" height=\"{height}\" fill=\"{}\"/>\n",
        dark_style(drawing),
        hex(PAPER)
    );
    for shape in &drawing.shapes {
        svg.push_str(&element(shape)?);
        svg.push('\n');
    }
    svg.push_str("</svg>\n");
    Ok(svg)
}

/// Rules that exchange the colours of a drawing on dark pages.
fn dark_style(drawing: &Drawing) -> String {
    let drawn = drawing.shapes.iter().filter_map(|shape| match shape {
        Shape::Line { color, .. } | Shape::Mark { color, .. } | Shape::Text { color, .. } => {
            Some(*color)
        }
        Shape::Dots(dots) => Some(dots.color),
        Shape::Rectangle { .. } | Shape::Mosaic(_) => None,
    });
    let colors: BTreeSet<Rgb> = drawn.chain([PAPER]).collect();
    let exchanged = colors.into_iter().filter(|&color| on_dark(color) != color);
    let rules: String = exchanged
        .flat_map(|color| {
            let (light, dark) = (hex(color), hex(on_dark(color)));
            ["fill", "stroke"].map(|of| format!(".{CLASS} [{of}=\"{light}\"]{{{of}:{dark}}}"))
        })
        .collect();
    format!("<style>@media (prefers-color-scheme:dark){{{rules}}}</style>")
}

fn element(shape: &Shape) -> Result<String, FigureError> {
    Ok(match shape {
        Shape::Line { points, width, stroke, color } => {
            let dashes: Vec<String> = dashes(*stroke, *width).into_iter().map(short).collect();
            let dashed = if dashes.is_empty() {
                String::new()
            } else {
                format!(" stroke-dasharray=\"{}\"", dashes.join(" "))
            };
            format!(
                "<path d=\"{}\" fill=\"none\" stroke=\"{}\" stroke-width=\"{}\" \
                    stroke-linejoin=\"round\"{dashed}/>",
                path(points),
                hex(*color),
                short(*width)
            )
        }
        Shape::Rectangle { from, to, fill } => format!(
            "<rect x=\"{}\" y=\"{}\" width=\"{}\" height=\"{}\" style=\"fill:{}\"/>",
            short(from.0),
            short(from.1),
            short(to.0 - from.0),
            short(to.1 - from.1),
            hex(*fill)
        ),
        Shape::Mark { at, radius, marker, color } => mark(*at, *radius, *marker, *color),
        Shape::Dots(dots) => dot_path(dots),
        Shape::Mosaic(mosaic) => image(mosaic)?,
        Shape::Text { at, anchor, direction, size, color, text, halo } => {
            let turned = match direction {
                Direction::Across => String::new(),
                Direction::Upwards => {
                    format!(" transform=\"rotate(-90 {} {})\"", short(at.0), short(at.1))
                }
            };
            let anchor = match anchor {
                Anchor::Start => "",
                Anchor::Middle => " text-anchor=\"middle\"",
                Anchor::End => " text-anchor=\"end\"",
            };
            let halo = if *halo {
                format!(
                    " paint-order=\"stroke\" stroke=\"{}\" stroke-width=\"3\" \
                        stroke-linejoin=\"round\"",
                    hex(PAPER)
                )
            } else {
                String::new()
            };
            format!(
                "<text x=\"{}\" y=\"{}\" font-size=\"{}\" \
                    fill=\"{}\"{anchor}{turned}{halo}>{}</text>",
                short(at.0),
                short(at.1),
                short(*size),
                hex(*color),
                spans(text, *size)
            )
        }
    })
}

fn mark((x, y): Point, radius: f64, marker: Marker, color: Rgb) -> String {
    let color = hex(color);
    let (cx, cy, r) = (short(x), short(y), short(radius));
    match marker {
        Marker::Circle => format!("<circle cx=\"{cx}\" cy=\"{cy}\" r=\"{r}\" fill=\"{color}\"/>"),
        Marker::Ring => format!(
            "<circle cx=\"{cx}\" cy=\"{cy}\" r=\"{r}\" fill=\"{}\" stroke=\"{color}\" \
                stroke-width=\"1.4\"/>",
            hex(PAPER)
        ),
        Marker::Cross => {
            let s = 0.85 * radius;
            let stroke = format!("fill=\"none\" stroke=\"{color}\" stroke-width=\"1.5\"");
            let (a, b) =
                (path(&[(x - s, y - s), (x + s, y + s)]), path(&[(x - s, y + s), (x + s, y - s)]));
            format!("<path d=\"{a}{b}\" {stroke}/>")
        }
        Marker::Square | Marker::Diamond | Marker::Triangle => {
            format!("<path d=\"{}z\" fill=\"{color}\"/>", path(&outline(marker, (x, y), radius)))
        }
    }
}

/// One path in units of cells: a stroke with round caps for every run of neighbours.
fn dot_path(dots: &DotRuns) -> String {
    let mut d = String::new();
    let mut pen: Option<(u32, u32)> = None;
    for &(row, column, count) in &dots.runs {
        match pen {
            Some((r, c)) if r == row => write!(d, "m{} 0", column - c),
            _ => write!(d, "M{column} {row}"),
        }
        .expect("a String takes all");
        write!(d, "h{}", count - 1).expect("a String takes all");
        pen = Some((row, column + count - 1));
    }
    let share = if dots.share < 1.0 {
        format!(" stroke-opacity=\"{}\"", short(dots.share))
    } else {
        String::new()
    };
    format!(
        "<path transform=\"translate({} {}) scale({} {})\" d=\"{d}\" fill=\"none\" stroke=\"{}\" \
         stroke-width=\"{}\" stroke-linecap=\"round\" \
         vector-effect=\"non-scaling-stroke\"{share}/>",
        short(dots.origin.0),
        short(dots.origin.1),
        long(dots.pitch.0),
        long(dots.pitch.1),
        hex(dots.color),
        short(dots.diameter)
    )
}

fn image(mosaic: &Mosaic) -> Result<String, FigureError> {
    let rows = mosaic.colors.len() / mosaic.columns;
    let pixels: Vec<u8> = mosaic.colors.iter().flatten().copied().collect();
    let png = encode(&pixels, (mosaic.columns as u32, rows as u32))?;
    Ok(format!(
        "<image x=\"{}\" y=\"{}\" width=\"{}\" height=\"{}\" preserveAspectRatio=\"none\" \
         style=\"image-rendering:pixelated\" href=\"data:image/png;base64,{}\"/>",
        short(mosaic.from.0),
        short(mosaic.from.1),
        short(mosaic.to.0 - mosaic.from.0),
        short(mosaic.to.1 - mosaic.from.1),
        BASE64.encode(&png)
    ))
}

fn path(points: &[Point]) -> String {
    let mut d = String::new();
    for (index, &(x, y)) in points.iter().enumerate() {
        d.push(if index == 0 { 'M' } else { 'L' });
        d.push_str(&short(x));
        d.push(' ');
        d.push_str(&short(y));
    }
    d
}

/// SVG spans of a text, raised and lowered by relative shifts that the next span cancels.
fn spans(text: &str, size: f64) -> String {
    let mut spans = String::new();
    let mut shift = 0.0;
    for (level, run) in runs(text) {
        let run = escape_html(&run);
        let dy = level.shift() - shift;
        shift = level.shift();
        if level == Level::Line && dy == 0.0 {
            spans.push_str(&run);
        } else {
            let (dy, size) = (short(dy * size), short(level.scale() * size));
            write!(spans, "<tspan dy=\"{dy}\" font-size=\"{size}\">{run}</tspan>")
                .expect("a String takes all");
        }
    }
    spans
}

/// Text without its markup.
pub(super) fn plain(text: &str) -> String {
    runs(text).into_iter().map(|(_, run)| run).collect()
}

fn hex([r, g, b]: Rgb) -> String {
    format!("#{r:02x}{g:02x}{b:02x}")
}

/// A coordinate to a hundredth of a pixel, without trailing zeros.
fn short(value: f64) -> String {
    trimmed(format!("{value:.2}"))
}

fn long(value: f64) -> String {
    trimmed(format!("{value:.6}"))
}

fn trimmed(text: String) -> String {
    let text = text.trim_end_matches('0').trim_end_matches('.');
    if text == "-0" { "0".to_owned() } else { text.to_owned() }
}
