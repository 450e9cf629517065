//! Values of options as they are typed: words of lists, numbers by name.

use std::str::FromStr;

use clap::builder::{PossibleValue, PossibleValuesParser, TypedValueParser};

use super::keys::OrbitsOf;
use super::positions::{Ends, Position, finite};
use crate::analysis::branches::BranchObservable;
use crate::analysis::loci::LocusKind;
use crate::analysis::noise::NoiseLaw;
use crate::model::Method;
use crate::report::Named;

/// Words of an option, each with its value and its help text. Older spellings follow a word after
/// `|`.
pub type Words<T> = &'static [(&'static str, T, &'static str)];

/// Methods that iterate states.
pub const METHODS: Words<Method> = &[
    ("map", Method::Map, "The local map"),
    ("guarded", Method::Guarded, "The local map inside its window, direct simulation outside"),
    ("direct", Method::Direct, "Direct simulation"),
    ("atlas", Method::Atlas, "Polynomials on boxes wherever orbits come, made from direct returns"),
];

/// Methods that iterate states whose parameters vary from return to return.
pub const RETURN_METHODS: Words<Method> = METHODS.split_at(3).0;

/// Cells of a basin that are computed: whether every one is.
pub(super) const CELLS: Words<bool> = &[
    ("all", true, "Every cell"),
    ("borders", false, "Cells along borders, and probes of the blocks between"),
];

/// Methods that compute periodic orbits.
pub(super) const ORBITS_OF: Words<OrbitsOf> =
    &[("map", OrbitsOf::Map, "The local map"), ("direct", OrbitsOf::Direct, "Direct simulation")];

/// Quantities observed on the orbits of a branch.
pub(super) const OBSERVABLES: Words<BranchObservable> = &[
    ("h", BranchObservable::Gap, "The event function at the first section point"),
    ("impact_speed", BranchObservable::ImpactSpeed, "The largest impact speed"),
    ("contact_time", BranchObservable::ContactTime, "Time in contact per period of the orbit"),
    (
        "amplitude",
        BranchObservable::Amplitude,
        "Half of the range of the event function along the orbit",
    ),
];

/// Kinds of loci.
pub(super) const LOCI: Words<LocusKind> = &[
    ("GR|graze", LocusKind::Graze, "The orbit grazes"),
    ("SN|fold", LocusKind::Fold, "Saddle-nodes (folds)"),
    ("PD|flip", LocusKind::Flip, "Period-doublings (flips)"),
    ("NS|torus", LocusKind::Torus, "Neimark-Sacker points (tori)"),
    ("crisis", LocusKind::Crisis, "An attractor touches the stable manifold of a saddle"),
];

/// Distributions of parameters under noise.
pub(super) const LAWS: Words<NoiseLaw> = &[
    ("normal", NoiseLaw::Normal, "Normal distribution"),
    ("uniform", NoiseLaw::Uniform, "Uniform distribution of the same standard deviation"),
];

/// Parser that accepts these words, in any case, and returns the value of the word given.
pub fn one_of<T: Copy + Send + Sync>(words: Words<T>) -> impl TypedValueParser<Value = T> {
    let known = words.iter().map(|&(spellings, _, help)| {
        let mut spellings = spellings.split('|');
        let word = spellings.next().unwrap_or_default();
        PossibleValue::new(word).aliases(spellings).help(help)
    });
    PossibleValuesParser::new(known).map(|word| {
        let is_word = |(spellings, ..): &&(&str, T, &str)| {
            spellings.split('|').any(|spelling| spelling.eq_ignore_ascii_case(&word))
        };
        words.iter().find(is_word).expect("the parser takes no other word").1
    })
}

/// Reads positions by name, `name=number,name=number`.
///
/// # Errors
///
/// Words about the text.
pub fn positions(text: &str) -> Result<Named<Position>, String> {
    named(text, "NAME=NUMBER")
}

/// Reads ranges by name, `name=from:to,name=from:to`.
///
/// # Errors
///
/// Words about the text.
pub fn ranges(text: &str) -> Result<Named<Ends>, String> {
    named(text, "NAME=FROM:TO")
}

/// Reads values by name.
fn named<T: FromStr<Err = String>>(text: &str, form: &str) -> Result<Named<T>, String> {
    let pair = |pair: &str| {
        let (name, value) = pair.split_once('=').ok_or_else(|| format!("expected {form}"))?;
        Ok((name.trim().to_owned(), value.parse()?))
    };
    text.split(',').map(pair).collect::<Result<_, String>>().map(Named)
}

/// Reads finite numbers by name.
pub(super) fn values(text: &str) -> Result<Named<f64>, String> {
    let pair = |(name, position)| match position {
        Position::Offset(value) => Ok((name, value)),
        Position::Value(value) => Err(format!("`@{value}` is no finite number")),
    };
    positions(text)?.0.into_iter().map(pair).collect::<Result<_, _>>().map(Named)
}

/// Reads sizes by name.
///
/// # Errors
///
/// Words about the text.
pub fn sizes(text: &str) -> Result<Named<f64>, String> {
    let sizes = values(text)?;
    match sizes.0.iter().find(|(_, size)| *size < 0.0) {
        Some((name, size)) => Err(format!("a size is not negative, found {name} = {size}")),
        None => Ok(sizes),
    }
}

/// Reads shares by name: `name=5%` or `name=0.05`.
pub(super) fn shares(text: &str) -> Result<Named<f64>, String> {
    let share = |pair: &str| {
        let (name, share) = pair.split_once('=').ok_or("expected NAME=SHARE, as omega=1%")?;
        let value = finite(share.trim().trim_end_matches('%'))?;
        let value = if share.trim().ends_with('%') { value / 100.0 } else { value };
        Ok((name.trim().to_owned(), value))
    };
    text.split(',').map(share).collect::<Result<_, String>>().map(Named)
}

/// Reads a finite number above 0.
pub(super) fn positive(text: &str) -> Result<f64, String> {
    match finite(text)? {
        number if number > 0.0 => Ok(number),
        number => Err(format!("expected a number above 0, found {number}")),
    }
}
