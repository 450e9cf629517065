//! Numbers, counts and words out of the fields of a scene.

use super::document::{Entry, Field, shown};
use crate::model::error::{Checked, Fault};
use crate::model::expression::{self, ExpressionError, Resolved};
use crate::model::graph::ExpressionGraph;
use crate::model::names;
use crate::model::problem::SceneProblem;
use crate::numeric::Dd;

/// What a number may be written as.
const NUMBER: &str = "a number";

impl Entry<'_> {
    /// A finite number, to the digits of its text: a literal, or a text with an expression of
    /// numbers.
    pub(super) fn number(&self) -> Checked<Dd> {
        if let Some(text) = self.value.as_str() {
            return self.constant(text);
        }
        if let Some(integer) = self.value.as_integer()
            && !self
                .literal()
                .bytes()
                .all(|byte| byte.is_ascii_digit() || matches!(byte, b'+' | b'-' | b'_'))
        {
            return self.constant(&integer.to_string());
        }
        if !self.value.is_integer() && !self.value.is_float() {
            return Err(self.wrong_type(NUMBER));
        }
        let digits = self.literal().replace('_', "");
        let value = Dd::from_decimal(digits.trim_start_matches('+'))
            .ok()
            .filter(|value| value.is_finite());
        value.ok_or_else(|| {
            self.fault(SceneProblem::NotFinite {
                key: self.path.clone(),
                found: shown(self.literal()),
            })
        })
    }

    /// A finite number, rounded to double precision.
    pub(super) fn double(&self) -> Checked<f64> {
        Ok(self.number()?.hi)
    }

    /// The value of an expression of numbers.
    fn constant(&self, text: &str) -> Checked<Dd> {
        let mut graph = ExpressionGraph::new();
        let node = expression::parse(text, &mut graph, &|_| Resolved::Unknown(None));
        let node = node.map_err(|fault| {
            let problem = match fault.value {
                ExpressionError::UnknownVariable { name, .. } => SceneProblem::NotConstant {
                    name: shown(&name),
                    key: self.path.clone(),
                },
                other => SceneProblem::Expression(other),
            };
            Fault::at(self.inside(fault.span), problem)
        })?;
        graph.constant_value(node).ok_or_else(|| {
            self.fault(SceneProblem::NotFinite {
                key: self.path.clone(),
                found: shown(text),
            })
        })
    }
}

impl Field<'_> {
    /// A finite number.
    pub(super) fn number(&self) -> Checked<Dd> {
        self.entry(NUMBER)?.number()
    }

    /// A finite number, rounded to double precision.
    pub(super) fn double(&self) -> Checked<f64> {
        Ok(self.number()?.hi)
    }

    /// A positive number.
    pub(super) fn positive(&self) -> Checked<Dd> {
        let value = self.number()?;
        if value.hi > 0.0 {
            Ok(value)
        } else {
            let problem = SceneProblem::NotPositive {
                key: self.path.clone(),
                value: value.hi,
            };
            Err(Fault::at(self.span(), problem))
        }
    }

    /// A whole number from `least` to `most`.
    pub(super) fn count(&self, least: u64, most: u64) -> Checked<u64> {
        self.entry("a whole number")?.count(least, most)
    }

    /// Two offsets, the first smaller.
    pub(super) fn range(&self) -> Checked<[f64; 2]> {
        self.entry("a list of two offsets")?.range()
    }

    /// Text.
    pub(super) fn text(&self) -> Checked<String> {
        Ok(self.entry("text")?.text("text")?.to_owned())
    }

    /// The choice a word stands for; `choices` as a message lists them.
    pub(super) fn choice<T: Copy>(
        &self,
        options: &[(&str, T)],
        choices: &'static str,
    ) -> Checked<T> {
        self.entry("a word")?.choice(options, choices)
    }
}

impl<'a> Entry<'a> {
    /// The two values of a list.
    pub(super) fn pair(&self, expected: &'static str) -> Checked<[Entry<'a>; 2]> {
        let list = self.list(expected)?;
        let found = list.len();
        <[Entry<'a>; 2]>::try_from(list).map_err(|_| {
            self.fault(SceneProblem::Length {
                key: self.path.clone(),
                expected: 2,
                found,
            })
        })
    }

    /// Two offsets, the first smaller.
    pub(super) fn range(&self) -> Checked<[f64; 2]> {
        let [first, last] = self.pair("a list of two offsets")?;
        let (first, last) = (first.double()?, last.double()?);
        if first < last {
            Ok([first, last])
        } else {
            Err(self.fault(SceneProblem::Range {
                key: self.path.clone(),
                first,
                last,
            }))
        }
    }

    /// A whole number from `least` to `most`.
    pub(super) fn count(&self, least: u64, most: u64) -> Checked<u64> {
        if !self.value.is_integer() && !self.value.is_float() {
            return Err(self.wrong_type("a whole number"));
        }
        let found = self
            .value
            .as_integer()
            .and_then(|value| u64::try_from(value).ok());
        found
            .filter(|value| (least..=most).contains(value))
            .ok_or_else(|| {
                let problem = SceneProblem::Count {
                    key: self.path.clone(),
                    found: shown(self.literal()),
                    least,
                    most,
                };
                self.fault(problem)
            })
    }

    /// The choice a word stands for; `choices` as a message lists them.
    pub(super) fn choice<T: Copy>(
        &self,
        options: &[(&str, T)],
        choices: &'static str,
    ) -> Checked<T> {
        let word = self.text("a word")?;
        let found = options
            .iter()
            .find(|(name, _)| *name == word)
            .map(|&(_, choice)| choice);
        found.ok_or_else(|| {
            self.fault(SceneProblem::UnknownWord {
                key: self.path.clone(),
                found: shown(word),
                choices,
                nearest: names::nearest(word, options.iter().map(|&(name, _)| name)),
            })
        })
    }
}
