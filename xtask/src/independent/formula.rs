//! Formulas as users type them: an independent parser, and their values.

use std::collections::HashMap;

use grazemap::numeric::Dd;

use super::number::{Function, Number};

/// Meaning of a name.
#[derive(Clone, Debug)]
pub enum Meaning {
    /// Input by index: the states, the phase, then the parameters.
    Input(usize),
    /// Another formula.
    Text(String),
}

/// One or several formulas: steps, some of which are values.
#[derive(Clone, Debug)]
pub struct Formula {
    steps: Vec<Step>,
    values: Vec<usize>,
}

#[derive(Clone, Copy, Debug)]
enum Step {
    Constant(Dd),
    Input(usize),
    Of(Function, usize),
    Both(Operator, usize, usize),
    WholePower(usize, i32),
}

#[derive(Clone, Copy, Debug)]
enum Operator {
    Plus,
    Minus,
    Times,
    Over,
    Power,
    ArcTangent,
    Least,
    Greatest,
}

/// Largest number of steps evaluated without allocated memory.
const FEW: usize = 40;

impl Formula {
    /// Reads a formula.
    pub fn read(text: &str, names: &HashMap<String, Meaning>) -> Result<Self, String> {
        Self::read_all(&[text.to_owned()], &[], names)
    }

    /// Reads several formulas. In each, `free` stands for a formula of its own.
    pub fn read_all(
        texts: &[String],
        free: &[String],
        names: &HashMap<String, Meaning>,
    ) -> Result<Self, String> {
        let mut reader = Reader { names, free: None, steps: Vec::new(), known: HashMap::new() };
        let mut values = Vec::new();
        for (place, text) in texts.iter().enumerate() {
            reader.known.remove("free");
            reader.free = free.get(place).cloned();
            values.push(reader.whole(text)?);
        }
        Ok(Self { steps: reader.steps, values })
    }

    /// Number of formulas.
    pub fn len(&self) -> usize {
        self.values.len()
    }

    /// Value of the first formula at a state and parameters.
    pub fn value<N: Number>(&self, state: &[N], parameters: &[N]) -> N {
        let mut value = [N::zero()];
        self.values(state, parameters, &mut value);
        value[0]
    }

    /// Values of the formulas, as many as `out` holds.
    pub fn values<N: Number>(&self, state: &[N], parameters: &[N], out: &mut [N]) {
        if self.steps.len() <= FEW {
            self.run(state, parameters, &mut [N::zero(); FEW], out);
        } else {
            self.run(state, parameters, &mut vec![N::zero(); self.steps.len()], out);
        }
    }

    fn run<N: Number>(&self, state: &[N], parameters: &[N], work: &mut [N], out: &mut [N]) {
        for (place, step) in self.steps.iter().enumerate() {
            work[place] = match *step {
                Step::Constant(value) => N::exact(value),
                Step::Input(index) if index < state.len() => state[index],
                Step::Input(index) => parameters[index - state.len()],
                Step::Of(function, of) => work[of].apply(function),
                Step::WholePower(of, power) => work[of].whole_power(power),
                Step::Both(operator, a, b) => operator.apply(work[a], work[b]),
            };
        }
        for (out, &value) in out.iter_mut().zip(&self.values) {
            *out = work[value];
        }
    }
}

impl Operator {
    fn apply<N: Number>(self, a: N, b: N) -> N {
        match self {
            Self::Plus => a + b,
            Self::Minus => a - b,
            Self::Times => a * b,
            Self::Over => a / b,
            Self::Power => (b * a.apply(Function::Log)).apply(Function::Exp),
            Self::ArcTangent => {
                // The half angle: exact but on the negative axis, which no scene here crosses.
                let radius = (a * a + b * b).apply(Function::Sqrt);
                let half = (a / (radius + b)).apply(Function::Atan);
                half + half
            }
            Self::Least => {
                if (b - a).is_negative() {
                    b
                } else {
                    a
                }
            }
            Self::Greatest => {
                if (b - a).is_negative() {
                    a
                } else {
                    b
                }
            }
        }
    }
}

struct Reader<'a> {
    names: &'a HashMap<String, Meaning>,
    /// Formula for `free`.
    free: Option<String>,
    steps: Vec<Step>,
    /// Steps of named formulas.
    known: HashMap<String, usize>,
}

/// Text left to read.
struct Rest<'t> {
    text: &'t str,
}

impl<'t> Rest<'t> {
    fn next(&mut self) -> Option<char> {
        self.text = self.text.trim_start();
        self.text.chars().next()
    }

    fn takes(&mut self, sign: char) -> bool {
        let found = self.next() == Some(sign);
        if found {
            self.text = &self.text[sign.len_utf8()..];
        }
        found
    }

    /// Longest run of characters that belong together.
    fn run(&mut self, belongs: impl Fn(usize, &str) -> bool) -> &'t str {
        let mut end = 0;
        while end < self.text.len() && belongs(end, self.text) {
            end += 1;
        }
        let (run, rest) = self.text.split_at(end);
        self.text = rest;
        run
    }
}

impl Reader<'_> {
    fn push(&mut self, step: Step) -> usize {
        self.steps.push(step);
        self.steps.len() - 1
    }

    fn whole(&mut self, text: &str) -> Result<usize, String> {
        let mut rest = Rest { text };
        let value = self.sum(&mut rest)?;
        match rest.next() {
            None => Ok(value),
            Some(_) => Err(format!("`{}` is not understood in `{text}`", rest.text)),
        }
    }

    fn sum(&mut self, rest: &mut Rest<'_>) -> Result<usize, String> {
        let mut value = self.product(rest)?;
        loop {
            let operator = match () {
                () if rest.takes('+') => Operator::Plus,
                () if rest.takes('-') => Operator::Minus,
                () => return Ok(value),
            };
            let other = self.product(rest)?;
            value = self.push(Step::Both(operator, value, other));
        }
    }

    fn product(&mut self, rest: &mut Rest<'_>) -> Result<usize, String> {
        let mut value = self.signed(rest)?;
        loop {
            let operator = match () {
                () if rest.takes('*') => Operator::Times,
                () if rest.takes('/') => Operator::Over,
                () => return Ok(value),
            };
            let other = self.signed(rest)?;
            value = self.push(Step::Both(operator, value, other));
        }
    }

    fn signed(&mut self, rest: &mut Rest<'_>) -> Result<usize, String> {
        if rest.takes('-') {
            let value = self.signed(rest)?;
            return Ok(self.push(Step::Of(Function::Negative, value)));
        }
        let _ = rest.takes('+');
        self.power(rest)
    }

    fn power(&mut self, rest: &mut Rest<'_>) -> Result<usize, String> {
        let base = self.atom(rest)?;
        if !rest.takes('^') {
            return Ok(base);
        }
        let exponent = self.signed(rest)?;
        if let Some(power) = self.whole_number(exponent) {
            return Ok(self.push(Step::WholePower(base, power)));
        }
        Ok(self.push(Step::Both(Operator::Power, base, exponent)))
    }

    fn whole_number(&self, step: usize) -> Option<i32> {
        match self.steps[step] {
            Step::Constant(value) => {
                let nearest = value.to_f64();
                let whole = nearest.fract() == 0.0 && Dd::from(nearest) == value;
                (whole && nearest.abs() < 1e3).then_some(nearest as i32)
            }
            Step::Of(Function::Negative, of) => self.whole_number(of).map(|power| -power),
            _ => None,
        }
    }

    fn atom(&mut self, rest: &mut Rest<'_>) -> Result<usize, String> {
        match rest.next() {
            Some('(') => {
                rest.takes('(');
                let value = self.sum(rest)?;
                self.close(rest)?;
                Ok(value)
            }
            Some(first) if first.is_ascii_digit() || first == '.' => {
                let digits = rest.run(|at, text| {
                    let bytes = text.as_bytes();
                    let after_e = at > 0 && matches!(bytes[at - 1], b'e' | b'E');
                    bytes[at].is_ascii_digit()
                        || matches!(bytes[at], b'.' | b'e' | b'E')
                        || (after_e && matches!(bytes[at], b'+' | b'-'))
                });
                let value = Dd::from_decimal(digits).map_err(|error| format!("{error}"))?;
                Ok(self.push(Step::Constant(value)))
            }
            Some(first) if first.is_alphabetic() || first == '_' => {
                let name = rest.run(|at, text| {
                    let byte = text.as_bytes()[at];
                    byte.is_ascii_alphanumeric() || byte == b'_' || !byte.is_ascii()
                });
                if rest.takes('(') { self.call(name, rest) } else { self.name(name) }
            }
            _ => Err(format!("a number or a name is missing before `{}`", rest.text)),
        }
    }

    fn close(&mut self, rest: &mut Rest<'_>) -> Result<(), String> {
        if rest.takes(')') { Ok(()) } else { Err(format!("no `)` before `{}`", rest.text)) }
    }

    fn call(&mut self, name: &str, rest: &mut Rest<'_>) -> Result<usize, String> {
        let first = self.sum(rest)?;
        if let Some(function) = Function::named(name) {
            self.close(rest)?;
            return Ok(self.push(Step::Of(function, first)));
        }
        let operator = match name {
            "atan2" => Operator::ArcTangent,
            "min" => Operator::Least,
            "max" => Operator::Greatest,
            _ => return Err(format!("no function `{name}`")),
        };
        if !rest.takes(',') {
            return Err(format!("`{name}` takes two numbers"));
        }
        let second = self.sum(rest)?;
        self.close(rest)?;
        Ok(self.push(Step::Both(operator, first, second)))
    }

    fn name(&mut self, name: &str) -> Result<usize, String> {
        if let Some(&step) = self.known.get(name) {
            return Ok(step);
        }
        let free = self.free.clone().filter(|_| name == "free").map(Meaning::Text);
        let names = self.names;
        let step = match free.as_ref().or(names.get(name)) {
            Some(&Meaning::Input(index)) => self.push(Step::Input(index)),
            Some(Meaning::Text(text)) => self.whole(text)?,
            None if name == "pi" => self.push(Step::Constant(Dd::PI)),
            None => return Err(format!("no name `{name}`")),
        };
        self.known.insert(name.to_owned(), step);
        Ok(step)
    }
}
