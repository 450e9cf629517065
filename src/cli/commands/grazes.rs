//! `grazemap locate` and `grazemap curve`: the grazing orbit, and its curve in two parameters.

use super::sweeps::pictures;
use super::{map, open};
use crate::cli::arguments::{CurveArguments, LocateArguments};
use crate::cli::output::{CliError, Results, counted};
use grazemap::Error;
use grazemap::model::Scene;
use grazemap::numeric::Shown;
use grazemap::orbit::{self, CurveEnd, CurveOptions, CurveOutcome, GrazingCurve, MarginOutcome};
use grazemap::pipeline::parameter_number;
use grazemap::report::{
    CurveListing, Document, DocumentKind, GrazeStudy, MarginListing, Named, OrbitListing,
    ReportError, curve_figures, to_json, window_words,
};

/// What `locate` says of the window where it makes no map.
const NOT_MEASURED: &str = "window: not measured here; `expand` measures how far from this graze \
                            its map keeps its tolerance\n";

/// The grazing orbit.
pub(in crate::cli) fn locate(options: &LocateArguments) -> Result<(), CliError> {
    let outlets = &options.scene.common.outlets;
    let source = open(&options.scene)?;
    let graze = source.clone().graze()?;
    let theory = graze.theory()?;
    let (measured, window) = match options.measure {
        true => {
            let map = map(source, outlets.quiet)?;
            (map.measure_graze(&theory.parameter)?, window_words(map.window()))
        }
        false => (Vec::new(), NOT_MEASURED.to_owned()),
    };
    let study = GrazeStudy { theory, measured };
    let listing = OrbitListing::new(graze.scene(), graze.orbit());
    let text = orbit_text(graze.scene(), &listing)? + &study_text(&study)? + "\n" + &window;
    let results = Results::named("orbit", text, graze.to_json_with(&study)?, None);
    results.deliver("locate", outlets)
}

/// What happens at the graze, as a person reads it.
fn study_text(study: &GrazeStudy) -> Result<String, ReportError> {
    let mut text = "\nwhat happens at this graze\n".to_owned();
    for words in study.words() {
        text.push_str(&format!("{words}\n"));
    }
    if let Some(table) = study.orbits_table()? {
        text.push_str(&format!("\n{}", table.to_text()));
    }
    Ok(text)
}

/// The orbit as a person reads it.
fn orbit_text(scene: &Scene, document: &OrbitListing) -> Result<String, ReportError> {
    let table = document.point_table()?.to_text();
    let surfaces: Vec<String> =
        document.surfaces().iter().map(|surface| format!("`{surface}`")).collect();
    let mut text = format!(
        "grazing orbit of `{}` at {}\nsection: {}\n\n{table}",
        scene.identifier,
        surfaces.join(", then "),
        document.section.words()
    );
    if document.passages.len() > 1 {
        let passages = document.passages_table()?.to_text();
        let conditions = document.conditions_table()?.to_text();
        text.push_str(&format!(
            "\npassages of a period\n\n{passages}\nxi_n from passage to passage\n\n{conditions}"
        ));
    }
    let unstable = document.multipliers.iter().find(|[re, im]| re.hypot(*im) > 1.0);
    if let Some([re, im]) = unstable {
        text.push_str(&format!(
            "\nnote: the orbit is unstable even without contact: a multiplier has modulus {:.6}\n",
            re.hypot(*im)
        ));
    }
    if let Some(clearance) = document.clearance.filter(|clearance| *clearance < 0.0) {
        text.push_str(&format!(
            "\nwarning: the orbit penetrates a surface elsewhere: h = {clearance:.6e}\n"
        ));
    }
    Ok(text)
}

/// The grazing curve in two parameters, or its point nearest to the scene.
pub(in crate::cli) fn curve(options: &CurveArguments) -> Result<(), CliError> {
    match (&options.with, options.from, options.to) {
        (Some(with), Some(from), Some(to)) => trace(options, Stretch { with, from, to }),
        _ => nearest(options),
    }
}

/// What a curve is followed along.
struct Stretch<'a> {
    with: &'a str,
    from: f64,
    to: f64,
}

fn trace(options: &CurveArguments, stretch: Stretch<'_>) -> Result<(), CliError> {
    let source = open(&options.scene)?;
    let scene = source.scene();
    let with = parameter_number(scene, stretch.with)?;
    if scene.grazing.solve_for.contains(&with) {
        return Err(CliError::AlreadyAdjusted { name: stretch.with.to_owned() });
    }
    for (flag, value) in [("--from", stretch.from), ("--to", stretch.to)] {
        if !value.is_finite() {
            return Err(CliError::NotFinite { flag, value });
        }
    }
    let settings = CurveOptions { xi_count: options.xi as usize, ..CurveOptions::default() };
    let outcome = orbit::curve(scene, with, stretch.from, stretch.to, &settings);
    let (curve, reached) = match outcome.map_err(Error::from)? {
        CurveOutcome::Traced(curve) => (curve, true),
        CurveOutcome::StartNotReached(curve) => (curve, false),
        CurveOutcome::NotLocated(reason) => return Err(Error::from(reason).into()),
    };
    let listing = CurveListing::new(scene, &curve);
    let text = curve_text(&listing, &curve);
    let (csv, figures) = (listing.table()?.to_csv()?, curve_figures(&listing));
    let json = to_json(&Document::new(DocumentKind::Curve, scene, listing))?;
    let mut results = Results::named("curve", text, json, Some(csv));
    for (ending, figure) in &figures {
        results.files.extend(pictures(&format!("curve{ending}"), figure));
    }
    results.deliver("curve", &options.scene.common.outlets)?;
    judge(&curve, reached, &stretch, with)
}

/// How the curve went, as a person reads it, in the parameters that vary.
fn curve_text(document: &CurveListing, curve: &GrazingCurve) -> String {
    let mut text = format!("{}; {}\n", counted(curve.points.len(), "point"), document.end);
    let at = |parameters: &Named<f64>| varying(parameters, &document.free);
    let several = document.points.iter().any(|point| point.conditions.len() > 1);
    for point in &document.codim2 {
        let [from, to] = &point.surfaces;
        let ends = if several {
            let (first, second) = (point.from + 1, point.to + 1);
            format!(" from passage {first} ({from}) to passage {second} ({to})")
        } else {
            String::new()
        };
        text.push_str(&format!("xi_{}{ends} = 0 at {}\n", point.n, at(&point.parameters)));
    }
    for fold in &document.folds {
        text.push_str(&format!("fold in {} at {}\n", fold.parameter, at(&fold.parameters)));
    }
    for switch in &document.multiplier_switches {
        text.push_str(&format!(
            "multipliers switch between real and complex at {}\n",
            at(&switch.parameters)
        ));
    }
    for stretch in &document.unresolved {
        text.push_str(&format!(
            "warning: {} may vanish more often than listed between {} and {}: its zeros there \
             cannot be told apart\n",
            stretch.of,
            at(&stretch.from),
            at(&stretch.to)
        ));
    }
    text
}

fn varying(parameters: &Named<f64>, names: &[String]) -> String {
    let varying = parameters.0.iter().filter(|(name, _)| names.contains(name));
    let pairs: Vec<String> =
        varying.map(|(name, value)| format!("{name} = {:.12}", Shown(*value))).collect();
    pairs.join(", ")
}

/// A curve that did not come to its end is mathematics that ended otherwise.
fn judge(
    curve: &GrazingCurve,
    started: bool,
    stretch: &Stretch<'_>,
    with: usize,
) -> Result<(), CliError> {
    if started && curve.end == CurveEnd::Reached {
        return Ok(());
    }
    Err(CliError::CurveEnded {
        parameter: stretch.with.to_owned(),
        goal: if started { stretch.to } else { stretch.from },
        last: curve.points.last().map_or(f64::NAN, |point| point.parameters[with]),
        end: curve.end.clone(),
    })
}

/// The smallest change of parameters that grazes.
fn nearest(options: &CurveArguments) -> Result<(), CliError> {
    let source = open(&options.scene)?;
    let scene = source.scene();
    let number = |name: &String| Ok(parameter_number(scene, name)?);
    let parameters = options.nearest.iter().map(number).collect::<Result<Vec<_>, CliError>>()?;
    let own = |&parameter: &usize| match scene.model.parameters[parameter].value.to_f64().abs() {
        0.0 => 1.0,
        size => size,
    };
    let mut scales: Vec<f64> = parameters.iter().map(own).collect();
    for (name, scale) in options.scale.iter().flat_map(|named| &named.0) {
        let place = options.nearest.iter().position(|parameter| parameter == name);
        let place = place.ok_or_else(|| CliError::NotNearest { name: name.clone() })?;
        scales[place] = *scale;
    }
    let margin = match orbit::margin(scene, &parameters, &scales).map_err(Error::from)? {
        MarginOutcome::Found(margin) => margin,
        MarginOutcome::NotLocated(reason) => return Err(Error::from(reason).into()),
        MarginOutcome::NotPhysical => return Err(CliError::NoPhysicalGraze),
    };
    let listing = MarginListing::new(scene, &margin);
    let text = listing.text()?;
    let csv = listing.table()?.to_csv()?;
    let json = to_json(&Document::new(DocumentKind::Margin, scene, listing))?;
    let results = Results::named("margin", text, json, Some(csv));
    results.deliver("curve", &options.scene.common.outlets)
}
