//! Soft stops of a wanted restitution: the fields of `contact --json`, the lines that a scene
//! needs, and a table of the errors of a rigid stop.

use serde::Serialize;

use super::table::significant;
use super::{Named, Table};
use crate::analysis::soft_stop::{SoftStop, StopInScene, StopLaw};
use crate::model::Scene;
use crate::numeric::Shown;

/// Digits of numbers in words.
const DIGITS: usize = 6;

/// Answer of `contact`.
#[derive(Clone, Debug, Serialize)]
pub struct ContactListing {
    /// Name of the stop of the scene; `None` without a scene.
    pub surface: Option<String>,
    /// Restitution wanted.
    pub restitution: f64,
    /// Speed at which the stops have it.
    pub speed: f64,
    /// Effective mass.
    pub mass: f64,
    /// Exponent of the spring of laws that are not linear.
    pub exponent: f64,
    /// One stop per contact law.
    pub laws: Vec<SoftStopListing>,
}

/// Soft stop of one contact law.
#[derive(Clone, Debug, Serialize)]
pub struct SoftStopListing {
    /// Contact law.
    pub law: StopLaw,
    /// Exponent of the spring.
    pub exponent: f64,
    /// Stiffness.
    pub stiffness: f64,
    /// Damper.
    pub damper: f64,
    /// `contact` of a surface: an expression per state.
    pub contact: Named<String>,
    /// `release` of a surface; `None` where it is the event, the default.
    pub release: Option<String>,
    /// Impacts over a range of speeds.
    pub impacts: Vec<SoftImpactListing>,
}

/// Impact at one speed.
#[derive(Clone, Copy, Debug, Serialize)]
pub struct SoftImpactListing {
    /// Speed before.
    pub speed: f64,
    /// Restitution of the soft stop.
    pub restitution: Option<f64>,
    /// Restitution of the soft stop minus the wanted one.
    pub difference: Option<f64>,
    /// Contact time.
    pub time: Option<f64>,
    /// Largest penetration.
    pub depth: Option<f64>,
    /// Error of the rigid stop over one return of the scene, relative to the effect of the impact.
    pub error_of_return: Option<f64>,
}

/// Names that the lines of a scene use.
#[derive(Clone, Debug, PartialEq)]
pub struct StopNames {
    /// Name of the penetration.
    depth: &'static str,
    /// Terms of the rate of the penetration: coefficients and names.
    rate: Vec<(f64, String)>,
    /// States that the stop pushes, each with its acceleration by a unit force on a unit mass.
    pushes: Vec<(String, f64)>,
}

/// Name of the penetration in a scene, and the name in its place where the scene has another
/// variable of that name.
const DEPTH: [&str; 2] = ["d", "depth"];

/// Name of the rate of the penetration where it is no linear combination of states.
const RATE: &str = "rate";

/// Name of the velocity without a scene.
const VELOCITY: &str = "v";

impl StopNames {
    /// Names without a scene: the stop is met at positive velocity.
    pub fn standard() -> Self {
        let velocity = VELOCITY.to_owned();
        Self {
            depth: DEPTH[0],
            rate: vec![(1.0, velocity.clone())],
            pushes: vec![(velocity, -1.0)],
        }
    }

    /// Names of a scene.
    pub fn of_scene(scene: &Scene, stop: &StopInScene<'_>) -> Self {
        let model = &scene.model;
        let mut known = model.full_state_names().into_iter().chain(model.parameter_names());
        let rate = match stop.rate() {
            Some(terms) => terms.map(|(name, factor)| (factor, name.to_owned())).collect(),
            None => vec![(1.0, RATE.to_owned())],
        };
        Self {
            depth: DEPTH[usize::from(known.any(|name| name == DEPTH[0]))],
            rate,
            pushes: stop.pushes().map(|(name, push)| (name.to_owned(), push)).collect(),
        }
    }

    /// Words on names that the scene has to define.
    fn to_define(&self) -> String {
        let mut text = String::new();
        if self.depth == DEPTH[1] {
            text.push_str(
                "`depth` stands for minus the event of the stop: add it to [model.let]\n",
            );
        }
        if self.rate.iter().any(|(_, name)| name == RATE) {
            text.push_str(
                "`rate` stands for minus the time derivative of the event: add it to [model.let]\n",
            );
        }
        text
    }

    /// Expression of a stop's force in the penetration and its rate, as a scene has it, and
    /// whether it is a sum, which needs parentheses as a factor.
    fn force(&self, stop: &SoftStop) -> (String, bool) {
        let power = match stop.exponent == 1.0 {
            true => self.depth.to_owned(),
            false => format!("{}^{}", self.depth, Shown(stop.exponent)),
        };
        let spring = format!("{}*{power}", Shown(stop.stiffness));
        if stop.damper == 0.0 {
            return (spring, false);
        }
        let damping = self.damping(stop.damper);
        match stop.law {
            StopLaw::HuntCrossley => (format!("{spring}*(1{damping})"), false),
            _ => (format!("{spring}{damping}"), true),
        }
    }

    /// A damper's term of a sum, with its sign.
    fn damping(&self, damper: f64) -> String {
        if let [(factor, name)] = &self.rate[..] {
            let value = damper * factor;
            let sign = if value < 0.0 { '-' } else { '+' };
            return format!(" {sign} {}*{name}", Shown(value.abs()));
        }
        let mut rate = String::new();
        for (place, (factor, name)) in self.rate.iter().enumerate() {
            let sign = match (place == 0, *factor < 0.0) {
                (true, false) => "",
                (true, true) => "-",
                (false, false) => " + ",
                (false, true) => " - ",
            };
            let times = match factor.abs() == 1.0 {
                true => String::new(),
                false => format!("{}*", Shown(factor.abs())),
            };
            rate.push_str(&format!("{sign}{times}{name}"));
        }
        format!(" + {}*({rate})", Shown(damper))
    }

    /// `contact` and `release` of a stop.
    fn lines(&self, stop: &SoftStop) -> (Named<String>, Option<String>) {
        let (force, is_sum) = self.force(stop);
        let contact = |(name, push): &(String, f64)| {
            let push = push / stop.mass;
            let sign = if push < 0.0 { '-' } else { '+' };
            let expression = match (push.abs() == 1.0, is_sum) {
                (true, false) => format!("free {sign} {force}"),
                (true, true) => format!("free {sign} ({force})"),
                (false, false) => format!("free {sign} {}*{force}", Shown(push.abs())),
                (false, true) => format!("free {sign} {}*({force})", Shown(push.abs())),
            };
            (name.clone(), expression)
        };
        let contact = Named::new(self.pushes.iter().map(contact));
        (contact, stop.law.lets_go().then_some(force))
    }
}

impl SoftStopListing {
    /// Listing of a stop with its impacts.
    pub fn new(stop: &SoftStop, names: &StopNames, impacts: Vec<SoftImpactListing>) -> Self {
        let (contact, release) = names.lines(stop);
        let &SoftStop { law, exponent, stiffness, damper, .. } = stop;
        Self { law, exponent, stiffness, damper, contact, release, impacts }
    }

    /// Lines of a surface in a scene file.
    fn lines(&self) -> String {
        let pair = |(name, text): &(String, String)| format!("{name} = \"{text}\"");
        let contact: Vec<String> = self.contact.0.iter().map(pair).collect();
        let release = self.release.as_ref().map(|text| format!("release = \"{text}\"\n"));
        format!("contact = {{ {} }}\n{}", contact.join(", "), release.unwrap_or_default())
    }
}

/// Words for a contact law.
pub fn stop_law_words(law: StopLaw) -> &'static str {
    match law {
        StopLaw::LinearToSurface => "linear spring and damper, released at the surface",
        StopLaw::LinearToForce => "linear spring and damper, released at zero force",
        StopLaw::HuntCrossley => "Hunt-Crossley",
        StopLaw::HertzToForce => "Hertz's spring, linear damper, released at zero force",
        StopLaw::HertzToSurface => "Hertz's spring, linear damper, released at the surface",
    }
}

impl ContactListing {
    /// Table with one row per law and speed.
    pub fn table(&self) -> Table {
        let rows: Vec<(&SoftStopListing, &SoftImpactListing)> = self
            .laws
            .iter()
            .flat_map(|stop| stop.impacts.iter().map(move |impact| (stop, impact)))
            .collect();
        let table = Table::of(rows)
            .text("law", |(stop, _)| stop.law.name())
            .number("speed", DIGITS, |(_, impact)| impact.speed)
            .number("restitution", DIGITS, |(_, impact)| impact.restitution)
            .number("difference", 3, |(_, impact)| impact.difference)
            .number("time", DIGITS, |(_, impact)| impact.time)
            .number("depth", DIGITS, |(_, impact)| impact.depth);
        match self.surface {
            Some(_) => table.number("error_of_return", 3, |(_, impact)| impact.error_of_return),
            None => table,
        }
        .made()
    }

    /// Answer as text, with the names that the lines use.
    pub fn text(&self, scene: Option<&str>, names: &StopNames) -> String {
        let [restitution, speed, mass] =
            [self.restitution, self.speed, self.mass].map(|value| significant(value, DIGITS));
        let place = match (scene, &self.surface) {
            (Some(scene), Some(surface)) => format!(" at `{surface}` of `{scene}`"),
            _ => String::new(),
        };
        let mut text = format!(
            "soft stops{place} with restitution {restitution} at speed {speed}, effective mass \
             {mass}\n"
        );
        for stop in &self.laws {
            text.push_str(&format!(
                "\n{}: stiffness {}, damper {}\n{}",
                stop_law_words(stop.law),
                significant(stop.stiffness, DIGITS),
                significant(stop.damper, DIGITS),
                stop.lines()
            ));
        }
        let to_define = names.to_define();
        if !to_define.is_empty() {
            text.push_str(&format!("\n{to_define}"));
        }
        text.push_str(&format!(
            "\na rigid stop with restitution {restitution} in the place of each; it takes no time \
             and no depth:\n\n{}",
            self.table().to_text()
        ));
        if self.surface.is_some() {
            text.push_str(
                "error_of_return: of the state one period after an impact at the grazing point, \
                 relative to the effect of the impact\n",
            );
        }
        text
    }
}
