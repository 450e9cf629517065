//! `grazemap curve`: the grazing curve in two parameters.

use super::arguments::CurveArguments;
use super::error::CliError;
use super::output::{Results, counted};
use super::prepare::prepare;
use grazemap::model::{Model, nearest};
use grazemap::numeric::Shown;
use grazemap::orbit::{CurveEnd, CurveOptions, CurveOutcome, GrazingCurve, curve};
use grazemap::report::{CurveDocument, to_dense_json};

pub(super) fn run(options: &CurveArguments) -> Result<(), CliError> {
    let scene = prepare(&options.scene)?.scene;
    let with = parameter(&scene.model, &options.with)?;
    if scene.grazing.solve_for.contains(&with) {
        return Err(CliError::AlreadyAdjusted {
            name: options.with.clone(),
        });
    }
    for (flag, value) in [("--from", options.from), ("--to", options.to)] {
        if !value.is_finite() {
            return Err(CliError::NotFinite { flag, value });
        }
    }
    let range = (options.to - options.from).abs();
    let settings = CurveOptions {
        xi_count: options.xi as usize,
        ..step_options(range)
    };
    let (curve, reached) = match curve(&scene, with, options.from, options.to, &settings)? {
        CurveOutcome::Traced(curve) => (curve, true),
        CurveOutcome::StartNotReached(curve) => (curve, false),
        CurveOutcome::NotLocated(reason) => return Err(reason.into()),
    };
    let document = CurveDocument::new(&scene, &curve);
    let csv = document.table()?.to_csv()?;
    let results = Results::named(
        "curve",
        text(&document, &curve),
        to_dense_json(&document)?,
        Some(csv),
    );
    results.deliver("curve", &options.scene.common)?;
    judge(&curve, reached, options, with)
}

/// Steps in the scale of the range, no larger than the defaults.
fn step_options(range: f64) -> CurveOptions {
    let defaults = CurveOptions::default();
    if range > 0.0 {
        CurveOptions {
            ds: defaults.ds.min(range / 20.0),
            ds_max: defaults.ds_max.min(range / 10.0),
            ..defaults
        }
    } else {
        defaults
    }
}

/// The index of a parameter.
fn parameter(model: &Model, name: &str) -> Result<usize, CliError> {
    let names = || {
        model
            .parameters
            .iter()
            .map(|parameter| parameter.name.as_str())
    };
    names()
        .position(|known| known == name)
        .ok_or_else(|| CliError::NoSuchParameter {
            name: name.to_owned(),
            nearest: nearest(name, names()),
        })
}

/// How the curve went, as a person reads it.
fn text(document: &CurveDocument, curve: &GrazingCurve) -> String {
    let mut text = format!(
        "{}; {}\n",
        counted(curve.points.len(), "point"),
        document.end
    );
    let several = document
        .points
        .iter()
        .any(|point| point.conditions.len() > 1);
    for point in &document.codim2 {
        let [from, to] = &point.surfaces;
        let ends = if several {
            let (first, second) = (point.from + 1, point.to + 1);
            format!(" from passage {first} ({from}) to passage {second} ({to})")
        } else {
            String::new()
        };
        text.push_str(&format!(
            "xi_{}{ends} = 0 at {}\n",
            point.n,
            pairs(&point.parameters.0)
        ));
    }
    for fold in &document.folds {
        text.push_str(&format!(
            "fold in {} at {}\n",
            fold.parameter,
            pairs(&fold.parameters.0)
        ));
    }
    for switch in &document.multiplier_switches {
        text.push_str(&format!(
            "multipliers switch between real and complex at {}\n",
            pairs(&switch.parameters.0)
        ));
    }
    text
}

fn pairs(parameters: &[(String, f64)]) -> String {
    let pairs: Vec<String> = parameters
        .iter()
        .map(|(name, value)| format!("{name} = {:.12}", Shown(*value)))
        .collect();
    pairs.join(", ")
}

/// A curve that did not come to its end is mathematics that ended otherwise.
fn judge(
    curve: &GrazingCurve,
    started: bool,
    options: &CurveArguments,
    with: usize,
) -> Result<(), CliError> {
    if started && curve.end == CurveEnd::Reached {
        return Ok(());
    }
    Err(CliError::CurveEnded {
        parameter: options.with.clone(),
        goal: if started { options.to } else { options.from },
        last: curve
            .points
            .last()
            .map_or(f64::NAN, |point| point.parameters[with]),
        end: curve.end.clone(),
    })
}
