//! State after a trajectory with its derivatives: the fields of `derivatives --json`, and a table.

use serde::Serialize;
use serde_json::{Value, json};

use super::{Named, Table};
use crate::expansion::SidesOfGraze;
use crate::jet::Jet;
use crate::model::Scene;
use crate::numeric::Dd;
use crate::orbit::JetsAlong;

/// Answer of `derivatives`.
#[derive(Clone, Debug, Serialize)]
pub struct DerivativesListing {
    /// Names of the variables: the components of the full state at the start, then parameters.
    pub variables: Vec<String>,
    /// Highest order.
    pub order: usize,
    /// Duration of the trajectory.
    pub duration: f64,
    /// Full state at the end; the phase is not reduced.
    pub state: Named<f64>,
    /// Derivatives of each component: `gradient`, `hessian`, then `order_3` and so on, nested lists
    /// over the variables.
    pub derivatives: Named<Value>,
    /// Hits, and ends of contacts, in order of time.
    pub events: Vec<EventListing>,
    /// Graze of the trajectory; the other fields are then those without contact there.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub graze: Option<SidesListing>,
    /// One row per derivative: its variables, and its value for every component.
    #[serde(skip)]
    rows: Vec<(String, Vec<f64>)>,
}

/// Event of a trajectory.
#[derive(Clone, Debug, Serialize)]
pub struct EventListing {
    /// Name of the surface.
    pub surface: String,
    /// `hit`; `rest` where the motion comes to rest, at once or by rebounds that are not listed;
    /// `release` where a contact or a rest ends.
    pub event: &'static str,
    /// Time since the start.
    pub time: f64,
    /// Normal velocity `|h'|` at a hit.
    pub speed: f64,
    /// Derivatives of the time, as those of a component of the state.
    pub derivatives: Value,
}

/// Series beside a graze, in the depth `d` of the free flow: the state where `d` is positive is
/// `contact + √d root`.
#[derive(Clone, Debug, Serialize)]
pub struct SidesListing {
    /// Name of the surface.
    pub surface: String,
    /// Time since the start.
    pub time: f64,
    /// Gap at its minimum, at most 1e-12 of its range; `d` has its negative value.
    pub gap: f64,
    /// Derivatives of `d`, as those of a component of the state.
    pub depth: Value,
    /// Derivatives of the part of each component without the root; its value is that of the state.
    pub contact: Named<Value>,
    /// Value (`value`) and derivatives of the factor of the root, to one order less.
    pub root: Named<Value>,
    /// One row per derivative: its variables, and those of the depth, the parts and the factors.
    #[serde(skip)]
    rows: Vec<(String, Vec<Option<f64>>)>,
}

impl SidesListing {
    /// Listing of the sides of a graze.
    fn new(scene: &Scene, sides: &SidesOfGraze, variables: &[String], order: usize) -> Self {
        let names = scene.model.full_state_names();
        let contact = sides.regular.iter().map(|jet| tensors(jet, order));
        let root = sides.root.iter().map(|jet| {
            let mut all = tensors(jet, order - 1);
            all["value"] = json!(jet.head().to_f64());
            all
        });
        let all = || std::iter::once(&sides.depth).chain(&sides.regular).chain(&sides.root);
        let space = sides.depth.space();
        let row = |monomial: usize| {
            let powers = space.exponents(monomial);
            let value = |jet: &Jet<Dd>| {
                let own = jet.space().monomial(powers)?;
                Some(derivative(powers, jet.coefficients()[own]))
            };
            (row_name(powers, variables), all().map(value).collect())
        };
        Self {
            surface: scene.model.surfaces[sides.surface].name.clone(),
            time: sides.time,
            gap: sides.gap,
            depth: tensors(&sides.depth, order),
            contact: Named::new(names.iter().copied().zip(contact)),
            root: Named::new(names.iter().copied().zip(root)),
            rows: (0..space.len()).map(row).collect(),
        }
    }

    /// Graze and its series as text.
    fn text(&self) -> String {
        let mut table = Table::of(&self.rows).text("by", |row| row.0.clone());
        let names = self.contact.0.iter().map(|(name, _)| name);
        let roots = names.clone().map(|name| format!("{name}: root d"));
        let headings = std::iter::once("d".to_owned()).chain(names.cloned()).chain(roots);
        for (place, heading) in headings.enumerate() {
            table = table.number(&heading, 17, move |row: &(_, Vec<Option<f64>>)| row.1[place]);
        }
        format!(
            "\ngrazes `{}` at t = {}; above: without contact. With contact, where the depth d of \
             the free flow is positive: a part, and the factor of the root of d\n\n{}",
            self.surface,
            self.time,
            table.made().to_text()
        )
    }
}

impl DerivativesListing {
    /// Listing of a trajectory of a scene that grazes.
    pub fn beside_graze(scene: &Scene, sides: &SidesOfGraze, free: &[usize], order: usize) -> Self {
        let listing = Self::new(scene, &sides.clear, free, order);
        let graze = SidesListing::new(scene, sides, &listing.variables, order);
        Self { graze: Some(graze), ..listing }
    }

    /// Listing of a trajectory of a scene.
    pub fn new(scene: &Scene, jets: &JetsAlong, free: &[usize], order: usize) -> Self {
        let model = &scene.model;
        let names = model.full_state_names();
        let parameters = free.iter().map(|&at| model.parameters[at].name.as_str());
        let variables: Vec<String> =
            names.iter().copied().chain(parameters).map(str::to_owned).collect();
        let state = jets.state.iter().map(|jet| jet.head().to_f64());
        let by_component = jets.state.iter().map(|jet| tensors(jet, order));
        let events = jets.events.iter().map(|event| EventListing {
            surface: model.surfaces[event.surface].name.clone(),
            event: match (event.meets, event.rests) {
                (true, true) => "rest",
                (true, false) => "hit",
                (false, _) => "release",
            },
            time: event.time.head().to_f64(),
            speed: event.speed.to_f64(),
            derivatives: tensors(&event.time, order),
        });
        Self {
            order,
            duration: jets.duration.to_f64(),
            state: Named::new(names.iter().copied().zip(state)),
            derivatives: Named::new(names.iter().copied().zip(by_component)),
            events: events.collect(),
            graze: None,
            rows: rows(&jets.state, &variables),
            variables,
        }
    }

    /// Table with one row per derivative and one column per component of the state.
    pub fn table(&self) -> Table {
        let mut table = Table::of(&self.rows).text("by", |row| row.0.clone());
        for (place, (name, _)) in self.state.0.iter().enumerate() {
            table = table.number(name, 17, move |row| row.1[place]);
        }
        table.made()
    }

    /// Answer as text.
    pub fn text(&self, scene: &str) -> String {
        let mut text = format!(
            "`{scene}` after t = {}: state, and derivatives by its start and parameters to order \
             {}\n\n{}",
            self.duration,
            self.order,
            self.table().to_text()
        );
        let table = Table::of(&self.events)
            .text("surface", |event| event.surface.clone())
            .text("event", |event| event.event)
            .number("time", 12, |event| event.time)
            .number("speed", 12, |event| event.speed)
            .made();
        match self.events.is_empty() {
            true => text.push_str("\nno surface is met\n"),
            false => text.push_str(&format!("\n{}", table.to_text())),
        }
        text.extend(self.graze.as_ref().map(SidesListing::text));
        text
    }
}

/// Derivatives of a jet by order, as nested lists.
fn tensors(jet: &Jet<Dd>, order: usize) -> Value {
    let tensor = |degree: usize| {
        let name = match degree {
            1 => "gradient".to_owned(),
            2 => "hessian".to_owned(),
            _ => format!("order_{degree}"),
        };
        (name, nested(jet, &mut vec![0; jet.space().variables()], degree))
    };
    Value::Object((1..=order).map(tensor).collect())
}

/// Derivatives beyond `powers` of every variable: lists nested to a depth.
fn nested(jet: &Jet<Dd>, powers: &mut Vec<u8>, depth: usize) -> Value {
    if depth == 0 {
        let monomial = jet.space().monomial(powers);
        let value = monomial.map_or(Dd::ZERO, |monomial| jet.coefficients()[monomial]);
        return json!(derivative(powers, value));
    }
    let member = |variable: usize| {
        powers[variable] += 1;
        let inner = nested(jet, powers, depth - 1);
        powers[variable] -= 1;
        inner
    };
    Value::Array((0..jet.space().variables()).map(member).collect())
}

/// Derivative of a coefficient: times the factorial of every power.
fn derivative(powers: &[u8], coefficient: Dd) -> f64 {
    let factorial = |power: u8| (1..=power).map(f64::from).product::<f64>();
    (coefficient * Dd::from(powers.iter().copied().map(factorial).product::<f64>())).to_f64()
}

/// Rows of the table: the value, then every derivative.
fn rows(state: &[Jet<Dd>], variables: &[String]) -> Vec<(String, Vec<f64>)> {
    let Some(space) = state.first().map(Jet::space) else { return Vec::new() };
    let row = |monomial: usize| {
        let powers = space.exponents(monomial);
        let values = state.iter().map(|jet| derivative(powers, jet.coefficients()[monomial]));
        (row_name(powers, variables), values.collect())
    };
    (0..space.len()).map(row).collect()
}

/// Variables of a derivative, each as often as it is taken by it.
fn row_name(powers: &[u8], variables: &[String]) -> String {
    let named = powers
        .iter()
        .zip(variables)
        .flat_map(|(&power, name)| std::iter::repeat_n(name.as_str(), usize::from(power)));
    let name = named.collect::<Vec<_>>().join(", ");
    if name.is_empty() { "(value)".to_owned() } else { name }
}
