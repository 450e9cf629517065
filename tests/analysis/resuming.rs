//! Interrupted computations: a later run ends with the same bits, and computes only the pieces that
//! the first one had not finished.

use std::cmp::Reverse;
use std::collections::{HashMap, HashSet};
use std::sync::Mutex;

use grazemap::Scene;
use grazemap::analysis::Progress;
use grazemap::analysis::loci::LocusKind;
use grazemap::pipeline::{BranchKeys, LociKeys, OrbitsOf};
use grazemap::prelude::*;
use grazemap::report::to_json;
use serde::Serialize;

use crate::support::tiers;

/// Pieces kept by a killed run, and pieces kept by the next one.
#[derive(Default)]
struct Resumed {
    before: HashMap<Vec<u64>, Vec<u8>>,
    /// Pieces in the order of their computation.
    kept: Mutex<Vec<(Vec<u64>, Vec<u8>)>>,
}

impl Progress for Resumed {
    fn expect(&self, _: u64) {}
    fn advance(&self, _: u64) {}

    fn recall(&self, place: &[u64]) -> Option<Vec<u8>> {
        let kept = self.kept.lock().expect("whole");
        let own = kept.iter().find(|(kept, _)| kept == place).map(|(_, piece)| piece);
        self.before.get(place).or(own).cloned()
    }

    fn keep(&self, place: &[u64], piece: &[u8]) {
        self.kept.lock().expect("whole").push((place.to_vec(), piece.to_vec()));
    }
}

/// Runs a computation whole, then as if it had been killed at several moments.
fn resumes<T: Serialize>(run: impl Fn(&dyn Progress) -> T) {
    let text = |value: &T| to_json(value).expect("plain data");
    let whole = Resumed::default();
    let expected = text(&run(&whole));
    let pieces = whole.kept.into_inner().expect("whole");
    let count = pieces.len();
    assert!(count > 4, "{count}");
    let places: HashSet<_> = pieces.iter().map(|(place, _)| place).collect();
    assert_eq!(places.len(), count, "two pieces at one place");
    for tenths in [0, 1, 5, 9, 10] {
        let before = pieces[..count * tenths / 10].iter().cloned().collect();
        let resumed = Resumed { before, ..Resumed::default() };
        assert_eq!(text(&run(&resumed)), expected, "killed after {tenths} tenths");
        let left = count - resumed.before.len();
        let computed = resumed.kept.into_inner().expect("whole").len();
        assert_eq!(computed, left, "after {tenths} tenths");
    }
}

/// Runs a computation whole, then with forged pieces: empty lists.
fn forged_pieces_are_computed_anew<T: Serialize>(run: impl Fn(&dyn Progress) -> T) {
    let text = |value: &T| to_json(value).expect("plain data");
    let whole = Resumed::default();
    let expected = text(&run(&whole));
    let pieces = whole.kept.into_inner().expect("whole");
    let before = pieces.into_iter().map(|(place, _)| (place, vec![0])).collect();
    assert_eq!(text(&run(&Resumed { before, ..Resumed::default() })), expected);
}

/// Number as pieces hold it: seven bits a byte, the lowest first.
fn varint(mut number: u64) -> Vec<u8> {
    let mut bytes = Vec::new();
    while number >= 0x80 {
        bytes.push(number as u8 | 0x80);
        number >>= 7;
    }
    bytes.push(number as u8);
    bytes
}

/// Numbers in the place of periods, counts and indices.
const FORGED: [u64; 6] = [0, 1, 1_000_003, 1 << 31, 1 << 40, u64::MAX];

/// Runs a computation with one number of one piece forged: in its largest pieces, the last bytes,
/// where indices and counts are, and bytes that are spread over the piece. No such run panics.
fn forged_numbers_are_harmless<T: Serialize>(
    run: impl Fn(&dyn Progress) -> T,
    [pieces, changes]: [usize; 2],
) {
    let whole = Resumed::default();
    run(&whole);
    let mut all = whole.kept.into_inner().expect("whole");
    let before: HashMap<_, _> = all.iter().cloned().collect();
    all.sort_by_key(|(_, piece)| Reverse(piece.len()));
    for (place, piece) in all.iter().take(pieces) {
        let last = piece.len().saturating_sub(changes)..piece.len();
        let spread = (0..piece.len()).step_by(piece.len().div_ceil(changes));
        for (number, at) in last.chain(spread).enumerate() {
            let forged = varint(FORGED[number % FORGED.len()]);
            let mut changed = piece.clone();
            changed.splice(at..at + 1, forged);
            let mut before = before.clone();
            before.insert(place.clone(), changed);
            let found = run(&Resumed { before, ..Resumed::default() });
            assert!(to_json(&found).is_ok(), "{place:?}, byte {at}");
        }
    }
}

/// A scene with a chart beside its diagram, both small.
fn scene(with: &str, [cells, attractors, points]: [&str; 3]) -> Scene {
    let text = crate::support::scenes::text("cantilever_0_09").to_owned()
        + "\n[[chart]]\nparameters = [\"Q\", \"beta\"]\nranges = [[-4e-4, 8e-4], [-1e-4, 1e-4]]\n\
           transient = 50\nkeep = 8\nstarts = 2\n";
    let set = [
        ("diagram.0.points", "80"),
        ("diagram.0.transient", "60"),
        ("diagram.0.keep", "8"),
        ("diagram.0.with", with),
        ("chart.0.points", points),
        ("chart.0.cells", cells),
        ("chart.0.attractors", attractors),
    ];
    crate::support::scenes::parsed(&text, "cantilever_0_09", &set)
}

#[test]
fn an_interrupted_diagram_goes_on_where_it_was_and_ends_with_the_same_bits() {
    for with in ["[\"map\"]", "[\"direct\"]"] {
        let map = scene(with, ["all", "1", "[30, 20]"])
            .graze()
            .and_then(|graze| graze.map())
            .expect("a map");
        resumes(|progress| {
            let mut diagrams = map.diagrams(progress).expect("active parameters");
            diagrams.iter_mut().for_each(|diagram| diagram.take_timing());
            diagrams
        });
    }
}

#[test]
fn an_interrupted_chart_goes_on_where_it_was_and_ends_with_the_same_bits() {
    let [small, large] = match tiers::are_whole() {
        true => ["[30, 20]", "[44, 30]"],
        false => ["[12, 8]", "[20, 16]"],
    };
    for chart in [["all", "1", small], ["borders", "2", large]] {
        let scene = scene("[\"map\"]", chart);
        let map = scene.graze().and_then(|graze| graze.map()).expect("a map");
        let charts = |progress: &dyn Progress| {
            let charts = map.charts(progress).expect("active parameters");
            let untimed = charts.iter().map(|chart| chart.without_timing());
            untimed.collect::<Vec<_>>()
        };
        resumes(charts);
        forged_pieces_are_computed_anew(charts);
    }
}

#[test]
fn an_interrupted_basin_with_manifolds_goes_on_where_it_was_and_ends_with_the_same_bits() {
    let points = if tiers::are_whole() { "[48, 36]" } else { "[24, 18]" };
    let basin = format!(
        "\n[[basin]]\nranges = [[-1e-3, 3e-4], [-9e-4, 8e-4]]\npoints = {points}\n\
         at = {{ alpha = -5e-4 }}\nmanifolds = 1\nwith = \"map\"\n"
    );
    let text = crate::support::scenes::text("linear").to_owned() + &basin;
    let set = [("diagram.0.points", "4")];
    let scene = crate::support::scenes::parsed(&text, "linear", &set);
    let map = scene.graze().and_then(|graze| graze.map()).expect("a map");
    let requests = map.basin_requests().expect("a plane of the section");
    let basins = |progress: &dyn Progress| {
        let mut basins = map.basins(&requests, progress).expect("a plane of the section");
        basins.iter_mut().for_each(|basin| basin.take_timing());
        basins
    };
    resumes(basins);
    forged_pieces_are_computed_anew(basins);
}

/// The map of a scene whose diagram is short.
fn map_of(name: &str) -> Map {
    let set = [("diagram.0.points", "16"), ("diagram.0.transient", "60"), ("diagram.0.keep", "8")];
    let scene = crate::support::scenes::parsed(crate::support::scenes::text(name), name, &set);
    scene.graze().and_then(|graze| graze.map()).expect("a map")
}

#[test]
fn interrupted_branches_go_on_where_they_were_and_end_with_the_same_bits() {
    let map = map_of("cantilever_0_09");
    for (method, itinerary) in [(OrbitsOf::Map, "10"), (OrbitsOf::Direct, "1")] {
        let keys = BranchKeys {
            along: "beta".to_owned(),
            itineraries: vec![itinerary.to_owned()],
            method,
            iterates: method == OrbitsOf::Map,
            ..BranchKeys::default()
        };
        resumes(|progress| keys.answer(&map, progress).expect("branches").document);
    }
}

#[test]
fn interrupted_loci_go_on_where_they_were_and_end_with_the_same_bits() {
    let map = map_of("linear");
    let keys = LociKeys {
        plane: vec!["alpha".to_owned(), "omega".to_owned()],
        itineraries: vec!["1".to_owned()],
        kind: vec![LocusKind::Graze, LocusKind::Fold],
        ..LociKeys::default()
    };
    resumes(|progress| keys.answer(&map, progress).expect("loci").document);
}

#[test]
fn forged_numbers_in_pieces_of_diagrams_and_charts_are_harmless() {
    let map = scene("[\"map\"]", ["all", "2", "[6, 4]"]);
    let map = map.graze().and_then(|graze| graze.map()).expect("a map");
    let changes = tiers::count(20, 60);
    forged_numbers_are_harmless(|progress| map.charts(progress).expect("parameters"), [1, changes]);
    let diagrams = |progress: &dyn Progress| map.diagrams(progress).expect("parameters");
    forged_numbers_are_harmless(diagrams, [1, changes]);
}

#[test]
fn forged_numbers_in_pieces_of_branches_are_harmless() {
    let map = map_of("cantilever_0_09");
    let keys = BranchKeys {
        along: "beta".to_owned(),
        itineraries: vec!["10".to_owned()],
        ..BranchKeys::default()
    };
    let answer = |progress: &dyn Progress| keys.answer(&map, progress).expect("branches").document;
    forged_numbers_are_harmless(answer, [2, 12]);
}
