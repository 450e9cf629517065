//! Oscillator with stops, parsed from a scene.

use std::collections::HashMap;

use grazemap::numeric::Dd;
use toml_edit::{DocumentMut, Item, TableLike};

use super::formula::{Formula, Meaning};
use super::number::{Dual, Number};

/// Model. Its formulas take the states, the phase if there is one, then the parameters.
#[derive(Clone, Debug)]
pub struct Oscillator {
    /// Names of the states, then that of the phase.
    pub states: Vec<String>,
    /// Names and values of the parameters.
    pub parameters: Vec<(String, Dd)>,
    /// Period of the phase.
    pub period: Option<Dd>,
    /// Rates of the states and of the phase in free flight.
    pub flow: Formula,
    /// Stops.
    pub stops: Vec<Stop>,
}

/// A stop.
#[derive(Clone, Debug)]
pub struct Stop {
    /// Name of the surface.
    pub name: String,
    /// Gap, positive in free flight.
    pub gap: Formula,
    /// Response to a state that meets the stop.
    pub response: Response,
}

/// Response of a stop to a state that meets it.
#[derive(Clone, Debug)]
pub enum Response {
    /// Rigid: components that jump, with their formulas.
    Impact(Vec<(usize, Formula)>),
    /// Compliant: another flow until a function changes sign.
    Contact { flow: Formula, release: Formula },
}

impl Oscillator {
    /// Parses the model of a scene's text, with values of parameters.
    pub fn read(text: &str, set: &[(&str, f64)]) -> Result<Self, String> {
        let document: DocumentMut = text.parse().map_err(|error| format!("{error}"))?;
        let model = table(document.as_item(), "model").ok_or("no [model]")?;
        let mut states = Vec::new();
        let listed = model.get("states").and_then(Item::as_array).ok_or("no states")?;
        for name in listed {
            states.push(name.as_str().ok_or("a state without a name")?.to_owned());
        }
        let mut parameters = Vec::new();
        for (name, value) in
            model.get("parameters").and_then(Item::as_table_like).into_iter().flat_map(|t| t.iter())
        {
            let literal = value.to_string();
            let value =
                Dd::from_decimal(literal.trim()).map_err(|error| format!("{name}: {error}"))?;
            let own = set.iter().find(|(known, _)| *known == name);
            parameters.push((name.to_owned(), own.map_or(value, |&(_, value)| Dd::from(value))));
        }
        let phase = model.get("phase").and_then(Item::as_table_like);
        if let Some(phase) = phase {
            states.push(words(phase, "name")?.to_owned());
        }
        let inputs = states.iter().chain(parameters.iter().map(|(name, _)| name));
        let mut names: HashMap<String, Meaning> =
            inputs.enumerate().map(|(index, name)| (name.clone(), Meaning::Input(index))).collect();
        for (name, value) in
            model.get("let").and_then(Item::as_table_like).into_iter().flat_map(|t| t.iter())
        {
            let text = value.as_str().map_or_else(|| value.to_string(), str::to_owned);
            names.insert(name.to_owned(), Meaning::Text(text));
        }
        let written = model.get("flow").and_then(Item::as_table_like).ok_or("no flow")?;
        let mut free = Vec::new();
        for state in &states[..states.len() - usize::from(phase.is_some())] {
            free.push(words(written, state)?.to_owned());
        }
        let mut period = None;
        if let Some(phase) = phase {
            free.push(words(phase, "rate")?.to_owned());
            period = Some(Formula::read(words(phase, "period")?, &names)?.value(&[], &[]));
        }
        let flow = Formula::read_all(&free, &[], &names)?;
        let mut stops = Vec::new();
        let surfaces = model.get("surface").and_then(Item::as_array_of_tables);
        for surface in surfaces.into_iter().flat_map(|surfaces| surfaces.iter()) {
            stops.push(stop(surface, &states, &free, &names)?);
        }
        Ok(Self { states, parameters, period, flow, stops })
    }

    /// Values of the parameters.
    pub fn values<N: Number>(&self) -> Vec<N> {
        self.parameters.iter().map(|&(_, value)| N::exact(value)).collect()
    }
}

fn stop(
    surface: &dyn TableLike,
    states: &[String],
    free: &[String],
    names: &HashMap<String, Meaning>,
) -> Result<Stop, String> {
    let event = words(surface, "event")?;
    let gap = Formula::read(event, names)?;
    let position = |name: &str| {
        let place = states.iter().position(|state| state == name);
        place.ok_or_else(|| format!("no state `{name}`"))
    };
    let response = if let Some(impact) = surface.get("impact").and_then(Item::as_table_like) {
        let mut jumps = Vec::new();
        for (name, _) in impact.iter() {
            jumps.push((position(name)?, Formula::read(words(impact, name)?, names)?));
        }
        Response::Impact(jumps)
    } else {
        let contact = surface.get("contact").and_then(Item::as_table_like).ok_or("no response")?;
        let mut texts = free.to_vec();
        for (name, _) in contact.iter() {
            texts[position(name)?] = words(contact, name)?.to_owned();
        }
        let flow = Formula::read_all(&texts, free, names)?;
        let release = surface.get("release").and_then(Item::as_str).unwrap_or(event);
        Response::Contact { flow, release: Formula::read(release, names)? }
    };
    Ok(Stop { name: words(surface, "name")?.to_owned(), gap, response })
}

fn table<'a>(item: &'a Item, key: &str) -> Option<&'a dyn TableLike> {
    item.as_table_like()?.get(key)?.as_table_like()
}

fn words<'a>(table: &'a dyn TableLike, key: &str) -> Result<&'a str, String> {
    table.get(key).and_then(Item::as_str).ok_or_else(|| format!("no text for `{key}`"))
}

/// Rates of a flow at a state.
pub(super) fn rates<N: Number>(flow: &Formula, state: &[N], parameters: &[N]) -> Vec<N> {
    let mut rates = vec![N::zero(); flow.len()];
    flow.values(state, parameters, &mut rates);
    rates
}

/// State with derivatives along a flow, and parameters without.
fn moving<N: Number>(
    flow: &Formula,
    state: &[N],
    parameters: &[N],
) -> (Vec<Dual<N>>, Vec<Dual<N>>) {
    let rates = rates(flow, state, parameters);
    let moving = state.iter().zip(rates).map(|(&value, slope)| Dual { value, slope });
    let fixed = parameters.iter().map(|&value| Dual { value, slope: N::zero() });
    (moving.collect(), fixed.collect())
}

/// A function and its derivative along a flow.
pub(super) fn along<N: Number>(
    function: &Formula,
    flow: &Formula,
    state: &[N],
    parameters: &[N],
) -> (N, N) {
    let (moving, fixed) = moving(flow, state, parameters);
    let found = function.value(&moving, &fixed);
    (found.value, found.slope)
}

/// A function with its first two derivatives along a flow.
pub(super) fn along_twice<N: Number>(
    function: &Formula,
    flow: &Formula,
    state: &[N],
    parameters: &[N],
) -> [N; 3] {
    let (moving, fixed) = moving(flow, state, parameters);
    let (value, slope) = along(function, flow, &moving, &fixed);
    [value.value, value.slope, slope.slope]
}
