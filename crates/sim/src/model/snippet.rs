//! The lines of a text about a fault, cut to what a screen shows.

use std::ops::Range;

use miette::{MietteError, MietteSpanContents, SourceCode, SourceSpan, SpanContents};

/// Characters of a line that are kept.
const WIDTH: usize = 100;
/// Characters kept before a fault that is farther to the right than a line is wide.
const BEFORE: usize = 40;
/// Where a line is cut.
const CUT: char = '…';

/// The line before a fault, the lines of the fault, and the line after it.
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
    /// Characters of the fault's column that are not in `text`.
    columns_before: usize,
}

impl Snippet {
    /// About these bytes of a text; of a fault over several lines its first line is shown.
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
            columns_before: skipped - mark,
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

/// The character boundary at or before a byte.
fn boundary(text: &str, byte: usize) -> usize {
    let mut byte = byte.min(text.len());
    while !text.is_char_boundary(byte) {
        byte -= 1;
    }
    byte
}

/// A line from a character on, as wide as a screen; what is left out at either end is marked.
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
        let column = inner.column() + if begins_at_fault { self.columns_before } else { 0 };
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
