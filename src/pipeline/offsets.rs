//! Remarks on offsets that look like parameter values.
//!
//! Offsets are relative to the grazing value. If that value lies between the ends of a range, or an
//! offset exceeds half of it, the numbers may have been meant as values.

use super::{Graze, Map};
use crate::analysis::basin::BasinRequest;
use crate::numeric::Shown;

/// Significant digits of offsets and values in remarks.
const DIGITS: i32 = 6;

impl Graze {
    /// Remark on offsets of one parameter (one offset, or the ends of a range) that look like
    /// values.
    pub(super) fn offset_remark(&self, key: &str, name: &str, offsets: &[f64]) -> Option<String> {
        let grazing = self.parameter(name).ok()?;
        let end = |nearest: fn(f64, f64) -> f64| offsets.iter().copied().reduce(nearest);
        let (low, high) = (end(f64::min)?, end(f64::max)?);
        let is_between = low < grazing && grazing < high;
        let is_large = low.abs().max(high.abs()) > 0.5 * grazing.abs();
        if grazing == 0.0 || !(is_between || is_large) {
            return None;
        }
        let words = |shift: f64| match low == high {
            true => shown(low + shift),
            false => format!("{} to {}", shown(low + shift), shown(high + shift)),
        };
        let (given, values, meant) = (words(0.0), words(grazing), words(-grazing));
        Some(format!(
            "note: `{key}` takes offsets from the grazing value {} of {name}: with {given} it is \
             {values}; for {name} = {given} give {meant}",
            shown(grazing)
        ))
    }
}

/// A value in a few digits.
fn shown(value: f64) -> String {
    let rounded = match value {
        0.0 => 0.0,
        _ => {
            let scale = 10f64.powi(DIGITS - 1 - value.abs().log10().floor() as i32);
            (value * scale).round() / scale
        }
    };
    Shown(rounded).to_string()
}

/// Difference of the scene's value of the adjusted parameter from its grazing value, relative to
/// that, above which it is no guess of it.
const ELSEWHERE: f64 = 0.02;

impl Map {
    /// Remarks on the adjusted parameter where the scene's diagrams vary others.
    pub fn diagram_held_remarks(&self) -> Vec<String> {
        let requests = self.scene().diagrams.iter();
        requests.filter_map(|request| self.held_remark(&[request.parameter])).collect()
    }

    /// Remarks on the adjusted parameter where the scene's charts vary others.
    pub fn chart_held_remarks(&self) -> Vec<String> {
        let requests = self.scene().charts.iter();
        requests.filter_map(|request| self.held_remark(&request.parameters)).collect()
    }

    /// Remark on the adjusted parameter where a request varies others: it stays at its grazing
    /// value, though the scene has another one.
    fn held_remark(&self, varied: &[usize]) -> Option<String> {
        let [adjusted] = self.scene().grazing.solve_for[..] else { return None };
        let own = self.scene().model.parameters[adjusted].value.to_f64();
        let grazing = self.orbit().parameters()[adjusted].to_f64();
        if varied.contains(&adjusted) || (own - grazing).abs() <= ELSEWHERE * grazing.abs() {
            return None;
        }
        let (name, own, grazing) = (self.parameter_name(adjusted), shown(own), shown(grazing));
        let other = self.parameter_name(*varied.first()?);
        Some(format!(
            "note: {name} stays at its grazing value {grazing}, and not at the scene's {own}; for \
             {name} = {own} let `grazing.solve_for` be \"{other}\""
        ))
    }

    fn parameter_name(&self, number: usize) -> &str {
        &self.scene().model.parameters[number].name
    }

    /// Remarks on ranges of the scene's diagrams that look like parameter values.
    pub fn diagram_offset_remarks(&self) -> Vec<String> {
        let diagrams = self.scene().diagrams.iter().enumerate();
        let remarks = diagrams.filter_map(|(number, request)| {
            let name = self.parameter_name(request.parameter);
            let key = format!("diagram.{number}.range");
            self.settled().graze().offset_remark(&key, name, &request.offsets())
        });
        remarks.chain(self.diagram_held_remarks()).collect()
    }

    /// Remarks on ranges of the scene's charts that look like parameter values.
    pub fn chart_offset_remarks(&self) -> Vec<String> {
        let charts = self.scene().charts.iter().enumerate();
        let ranges = charts.flat_map(|(number, request)| {
            let axes = request.parameters.into_iter().zip(request.ranges);
            axes.map(move |(parameter, range)| (number, parameter, range))
        });
        let remarks = ranges.filter_map(|(number, parameter, range)| {
            let (key, name) = (format!("chart.{number}.ranges"), self.parameter_name(parameter));
            self.settled().graze().offset_remark(&key, name, &range)
        });
        remarks.chain(self.chart_held_remarks()).collect()
    }

    /// Remarks on parameters of basins that look like values.
    pub fn basin_offset_remarks(&self, requests: &[BasinRequest]) -> Vec<String> {
        let active = &self.local().parameters;
        let offsets = requests.iter().flat_map(|request| active.iter().zip(&request.parameters));
        let remarks = offsets.filter_map(|(parameter, &offset)| {
            self.settled().graze().offset_remark("at", &parameter.name, &[offset])
        });
        remarks.collect()
    }
}
