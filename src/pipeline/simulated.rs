//! Remarks that a request will take long, before it does: how many returns are simulated, because
//! they lie outside the window of the map or because direct simulation is asked for, and about how
//! long that takes.
//!
//! One idea: the first returns at one of the request's points are timed, in lanes where the sweeps
//! use lanes, and the time of the whole request follows from their number and that of the threads.

use super::Map;
use crate::analysis::basin::BasinRequest;
use crate::analysis::{ImageRequest, Precision, Using, seconds_per_return};
use crate::iteration::parallel;
use crate::model::{ChartRequest, DiagramRequest, Method, SweepDirection, even_offsets};

/// Shortest time that is announced, in seconds.
const ANNOUNCED: f64 = 5.0;
/// Fewest returns that are timed for a remark; fewer take no such time.
const FEWEST: f64 = 1e4;

/// Returns of direct simulation that a request leads to.
#[derive(Clone, Debug, Default, PartialEq)]
struct SimulatedReturns {
    /// Number of returns outside the window that guarded iteration simulates.
    outside: f64,
    /// Number of returns by direct simulation.
    direct: f64,
    /// Whether the number is a bound.
    at_most: bool,
    /// Offsets of all active parameters at one of the points.
    parameters: Vec<f64>,
}

impl SimulatedReturns {
    /// Adds the returns of points, `each` from every point, by a method. A point is given by its
    /// parameters and by whether it lies in the window.
    fn add(&mut self, method: Method, points: &[(Vec<f64>, bool)], each: f64) {
        let is_simulated = |(_, inside): &&(Vec<f64>, bool)| match method {
            Method::Map | Method::Atlas => false,
            Method::Guarded => !inside,
            Method::Direct => true,
        };
        let simulated: Vec<_> = points.iter().filter(is_simulated).collect();
        let Some((parameters, _)) = simulated.get(simulated.len() / 2) else { return };
        self.parameters.clone_from(parameters);
        let returns = each * simulated.len() as f64;
        match method {
            Method::Direct => self.direct += returns,
            _ => self.outside += returns,
        }
    }

    /// Remark for a time in seconds, if it is long.
    fn remark(&self, seconds: f64) -> Option<String> {
        if seconds < ANNOUNCED {
            return None;
        }
        let bound = if self.at_most { "at most " } else { "" };
        let outside = match self.direct {
            0.0 => "outside the window of the map ",
            _ => "",
        };
        let returns = self.outside + self.direct;
        let time = time_words(seconds);
        Some(format!(
            "note: {outside}{bound}{returns} returns are simulated, which takes {bound}about {time}"
        ))
    }
}

/// Time with two digits, in the unit that suits it.
fn time_words(seconds: f64) -> String {
    let (value, unit) = match seconds {
        seconds if seconds < 120.0 => (seconds, "s"),
        seconds if seconds < 7200.0 => (seconds / 60.0, "min"),
        seconds => (seconds / 3600.0, "h"),
    };
    let step = 10f64.powf(value.log10().floor() - 1.0).max(1.0);
    format!("{} {unit}", (value / step).round() * step)
}

impl Map {
    /// Remark on the time of the scene's diagrams, if they take long by direct simulation.
    pub fn diagram_time_remark(&self) -> Option<String> {
        let mut returns = SimulatedReturns::default();
        for request in &self.scene().diagrams {
            self.add_diagram(&mut returns, request);
        }
        self.time_remark(&returns, true)
    }

    /// Remark on the time of the scene's charts, if they take long by direct simulation.
    pub fn chart_time_remark(&self) -> Option<String> {
        let mut returns = SimulatedReturns::default();
        for request in &self.scene().charts {
            self.add_chart(&mut returns, request);
        }
        self.time_remark(&returns, true)
    }

    /// Remark on the time of basins, if they take long by direct simulation.
    pub fn basin_time_remark(&self, requests: &[BasinRequest]) -> Option<String> {
        let mut returns = SimulatedReturns { at_most: true, ..SimulatedReturns::default() };
        let widths = &self.local().window.state;
        for request in requests {
            // Axes that are no two coordinates are refused where the basin is computed.
            let [Some(first), Some(second)] = request.axes.map(|axis| widths.get(axis)) else {
                return None;
            };
            let holds = |axis: usize, width: f64| {
                let offsets = even_offsets(request.ranges[axis], request.points[axis]);
                let inside = offsets.iter().filter(|offset| offset.abs() <= width).count();
                (inside as f64, offsets.len() as f64)
            };
            let [(inside_across, across), (inside_up, up)] = [holds(0, *first), holds(1, *second)];
            let inside = match self.local().window.holds(&[], &request.parameters, &[]) {
                true => inside_across * inside_up,
                false => 0.0,
            };
            let cells = match request.method {
                Method::Guarded => across * up - inside,
                _ => across * up,
            };
            let point = (request.parameters.clone(), false);
            returns.add(request.method, &[point], cells * request.transient as f64);
        }
        self.time_remark(&returns, true)
    }

    /// Remark on the time of images in double precision, if they take long by direct simulation.
    pub fn image_time_remark(&self, request: &ImageRequest) -> Option<String> {
        let method = match request.using {
            Using::Direct => Method::Direct,
            Using::Guarded => Method::Guarded,
            _ => return None,
        };
        if request.precision != Precision::F64 {
            return None;
        }
        let point = |parameters: Vec<f64>| {
            let inside = self.local().window.holds(&[], &parameters, &[]);
            (parameters, inside)
        };
        let rows = request.rows.iter();
        let offsets = rows.map(|row| row.parameters.iter().map(|value| value.to_f64()).collect());
        let points: Vec<_> = offsets.map(point).collect();
        let mut returns = SimulatedReturns::default();
        returns.add(method, &points, request.iterations as f64);
        self.time_remark(&returns, false)
    }

    fn add_diagram(&self, returns: &mut SimulatedReturns, request: &DiagramRequest) {
        let Some(place) = self.place_of_active(request.parameter) else { return };
        let ways = if request.direction == SweepDirection::Both { 2 } else { 1 };
        let sweeps = ways * request.starts.count();
        let points: Vec<_> =
            request.offsets().into_iter().map(|offset| self.at(&[(place, offset)])).collect();
        for &method in &request.with {
            returns.add(method, &points, (sweeps * (request.transient + request.keep)) as f64);
        }
    }

    fn add_chart(&self, returns: &mut SimulatedReturns, request: &ChartRequest) {
        let [across, up] = [0, 1].map(|axis: usize| {
            let place = self.place_of_active(request.parameters[axis]);
            place.map(|place| (place, even_offsets(request.ranges[axis], request.points[axis])))
        });
        let (Some((first, across)), Some((second, up))) = (across, up) else { return };
        let cells = across.iter().flat_map(|&a| up.iter().map(move |&b| (a, b)));
        let points: Vec<_> = cells.map(|(a, b)| self.at(&[(first, a), (second, b)])).collect();
        // Blocks of cells with one attractor are not computed.
        returns.at_most |= !request.every_cell;
        let each = request.starts.count() * (request.transient + 2 * request.keep);
        for &method in &request.with {
            returns.add(method, &points, each as f64);
        }
    }

    /// Index of a parameter of the scene among the active ones.
    fn place_of_active(&self, parameter: usize) -> Option<usize> {
        self.scene().expansion.active.iter().position(|&active| active == parameter)
    }

    /// Offsets of all active parameters for some of them, and whether the window holds them.
    fn at(&self, offsets: &[(usize, f64)]) -> (Vec<f64>, bool) {
        let mut parameters = vec![0.0; self.local().parameters.len()];
        offsets.iter().for_each(|&(place, offset)| parameters[place] = offset);
        let inside = self.local().window.holds(&[], &parameters, &[]);
        (parameters, inside)
    }

    fn time_remark(&self, returns: &SimulatedReturns, in_lanes: bool) -> Option<String> {
        let count = returns.outside + returns.direct;
        if count < FEWEST {
            return None;
        }
        let (scene, orbit) = (self.settled().scene(), self.orbit());
        let seconds = seconds_per_return(scene, orbit, &returns.parameters, in_lanes)?;
        returns.remark(count * seconds / parallel::threads() as f64)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{FindGraze, Scene};

    fn map(tables: &str) -> Map {
        let scene = Scene::of_catalogue("linear").expect("a scene");
        let map = scene.graze().and_then(|graze| graze.map()).expect("a map");
        map.asking(tables).expect("a request")
    }

    fn diagram(method: &str) -> String {
        format!(
            "[[diagram]]\nparameter = \"alpha\"\nrange = [-0.1, 0.1]\npoints = 1000\n\
             transient = 490000\nkeep = 10000\ndirection = \"both\"\nwith = [\"{method}\"]\n"
        )
    }

    /// 1000 values with 500 000 returns each, up and down; few values are inside the window.
    #[test]
    fn a_request_far_outside_the_window_is_announced_with_its_returns() {
        let [direct, guarded, by_map] =
            ["direct", "guarded", "map"].map(|method| map(&diagram(method)).diagram_time_remark());
        let direct = direct.expect("it takes long");
        let begins = "note: 1000000000 returns are simulated, which takes about ";
        assert!(direct.starts_with(begins), "{direct}");
        let guarded = guarded.expect("it takes long");
        let begins = "note: outside the window of the map 9";
        assert!(guarded.starts_with(begins) && guarded.contains(" returns are "), "{guarded}");
        assert_eq!(by_map, None);
    }

    #[test]
    fn a_short_request_is_not_announced() {
        let map = map("[[diagram]]\nparameter = \"alpha\"\nrange = [-0.1, 0.1]\npoints = 20\n\
                       transient = 10\nkeep = 10\nwith = [\"direct\"]\n");
        assert_eq!(map.diagram_time_remark(), None);
        let long = SimulatedReturns { direct: 2e5, at_most: true, ..SimulatedReturns::default() };
        assert_eq!(long.remark(4.9), None);
        let words = "note: at most 200000 returns are simulated, which takes at most about 15 min";
        assert_eq!(long.remark(910.0).as_deref(), Some(words));
    }

    #[test]
    fn times_have_two_digits() {
        let words = [5.4, 38.2, 119.0, 121.0, 3599.0, 7300.0, 1e6].map(time_words);
        assert_eq!(words, ["5 s", "38 s", "120 s", "2 min", "60 min", "2 h", "280 h"]);
    }
}
