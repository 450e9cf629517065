//! Lines of a text around a fault, cut to the width of a screen.

use std::ops::Range;

use miette::{MietteError, MietteSpanContents, SourceCode, SourceSpan, SpanContents};

/// Largest number of characters kept of a line.
const WIDTH: usize = 100;
/// Characters kept before a fault that lies beyond the width of a line.
const BEFORE: usize = 40;
/// Mark at a cut end of a line.
const CUT: char = '…';

/// The line before a fault, the first line of the fault, and the line after it.
#[derive(Clone, Debug)]
pub(super) struct Snippet {
    file_name: String,
    text: String,
    /// Bytes of the fault in `text`.
    span: Range<usize>,
    /// Line of the fault in the file and its column in characters, from 1.
    position: (usize, usize),
    /// Lines of the file before `text`.
    lines_before: usize,
}

impl Snippet {
    /// Snippet for these bytes of a text; for a fault over several lines its first line is shown.
    pub(super) fn new(file_name: &str, text: &str, span: Range<usize>) -> Self {
        let start = boundary(text, span.start);
        let line_start = text[..start].rfind('\n').map_or(0, |newline| newline + 1);
        let (line, after) =
            text[line_start..].split_once('\n').unwrap_or((&text[line_start..], ""));
        let end = boundary(text, span.end).clamp(start, line_start + line.len());
        let column = text[line_start..start].chars().count();
        let length = text[start..end].chars().count();
        let skipped =
            if column + length.min(BEFORE) < WIDTH { 0 } else { column.saturating_sub(BEFORE) };
        let mark = usize::from(skipped > 0);

        let before = text[..line_start].strip_suffix('\n');
        let before = before.map(|before| cut(before.rsplit('\n').next().unwrap_or_default(), 0));
        let mut kept = before.map_or_else(String::new, |line| line + "\n");
        let shown = cut(line, skipped);
        let place = |column: usize| {
            let bytes = shown.char_indices().map(|(byte, _)| byte);
            kept.len() + bytes.chain([shown.len()]).nth(column + mark).unwrap_or(shown.len())
        };
        let span = place(column - skipped)..place(column - skipped + length);
        kept.push_str(&shown);
        kept.push('\n');
        kept.push_str(&cut(after.split('\n').next().unwrap_or_default(), 0));
        let lines = text[..line_start].matches('\n').count();
        Self {
            file_name: file_name.to_owned(),
            text: kept,
            span,
            position: (lines + 1, column + 1),
            lines_before: lines.saturating_sub(1),
        }
    }

    /// Line and column of the fault, both from 1, columns in characters.
    pub(super) fn position(&self) -> (usize, usize) {
        self.position
    }

    /// Bytes of the fault in the snippet.
    pub(super) fn span(&self) -> Range<usize> {
        self.span.clone()
    }
}

/// Last character boundary at or before a byte.
fn boundary(text: &str, byte: usize) -> usize {
    let mut byte = byte.min(text.len());
    while !text.is_char_boundary(byte) {
        byte -= 1;
    }
    byte
}

/// A line from a character on, cut to the width of a screen; a mark replaces what is cut at either
/// end.
fn cut(line: &str, from: usize) -> String {
    let line = line.strip_suffix('\r').unwrap_or(line);
    let mut characters = line.chars().skip(from);
    let mut kept = String::new();
    if from > 0 {
        kept.push(CUT);
    }
    kept.extend(characters.by_ref().take(WIDTH));
    if characters.next().is_some() {
        kept.push(CUT);
    }
    kept
}

impl SourceCode for Snippet {
    fn read_span<'a>(
        &'a self,
        span: &SourceSpan,
        lines_before: usize,
        lines_after: usize,
    ) -> Result<Box<dyn SpanContents<'a> + 'a>, MietteError> {
        let inner = self.text.read_span(span, lines_before, lines_after)?;
        let begins_at_fault = inner.span().offset() == self.span.start;
        let column = if begins_at_fault { self.position.1 - 1 } else { inner.column() };
        Ok(Box::new(MietteSpanContents::new_named(
            self.file_name.clone(),
            inner.data(),
            *inner.span(),
            inner.line() + self.lines_before,
            column,
            inner.line_count(),
        )))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn shown(text: &str, span: Range<usize>) -> (Snippet, String) {
        let snippet = Snippet::new("a.toml", text, span);
        let shown = snippet.text[snippet.span()].to_owned();
        (snippet, shown)
    }

    #[test]
    fn the_lines_about_a_fault_are_kept_and_its_bytes_are_the_same() {
        let text = "first\nsecond = 1\nthird = \u{e4}x\nfourth\nfifth\n";
        let start = text.find('\u{e4}').expect("there");
        let (snippet, fault) = shown(text, start..start + 3);
        assert_eq!((fault.as_str(), snippet.position()), ("\u{e4}x", (3, 9)));
        assert_eq!(snippet.text, "second = 1\nthird = \u{e4}x\nfourth");
        let contents = snippet.read_span(&snippet.span().into(), 0, 0).expect("in the text");
        assert_eq!((contents.line(), contents.column()), (2, 8));
    }

    #[test]
    fn a_fault_far_to_the_right_is_shown_with_what_stands_about_it() {
        let text = format!("x = [{}]{}", "\u{e4}, ".repeat(50_000), "z".repeat(500));
        let start = text.find(']').expect("there");
        let (snippet, fault) = shown(&text, start..start + 1);
        assert_eq!((fault.as_str(), snippet.position()), ("]", (1, 150_006)));
        assert!(snippet.text.lines().all(|line| line.chars().count() <= WIDTH + 2));
        let contents = snippet.read_span(&snippet.span().into(), 0, 0).expect("in the text");
        assert_eq!((contents.line(), contents.column()), (0, 150_005));
    }

    #[test]
    fn any_span_of_any_text_has_a_snippet() {
        for text in ["", "\n", "a", "a\r\nb\r\n", "\u{10ffff}\n\u{e4}", &"ab\n".repeat(100)] {
            for start in 0..=text.len() + 2 {
                for length in [0, 1, 5, 1000] {
                    let (snippet, fault) = shown(text, start..start + length);
                    assert!(!fault.contains('\n') && snippet.text.lines().count() <= 3);
                }
            }
        }
    }
}
