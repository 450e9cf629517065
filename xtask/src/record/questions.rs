//! Questions of the record: commands with their keys, on scenes of the catalogue.
//!
//! Ranges are small: every group takes seconds.

/// Command with its keys, or the keys of a basin or a fit, for a scene.
#[derive(Debug)]
pub(super) struct Question {
    pub(super) scene: &'static str,
    pub(super) variant: &'static str,
    pub(super) keys: &'static str,
}

/// Question about a scene.
const fn of(scene: &'static str, variant: &'static str, keys: &'static str) -> Question {
    Question { scene, variant, keys }
}

/// Branches of periodic orbits.
pub(super) const BRANCHES: &[Question] = &[
    of("linear", "map", r#"{"branch": {"along": "alpha"}}"#),
    of("linear", "direct", r#"{"branch": {"along": "alpha", "method": "direct"}}"#),
    of("mems", "map", r#"{"branch": {"along": "V"}}"#),
    of("mems", "direct", r#"{"branch": {"along": "V", "period": 1, "method": "direct"}}"#),
    of("cantilever_3_5_soft", "map", r#"{"branch": {"along": "Q", "period": 2}}"#),
    of(
        "cantilever_3_5_soft",
        "direct",
        r#"{"branch": {"along": "Q", "period": 2, "method": "direct"}}"#,
    ),
    of("two_stops_t1", "map", r#"{"branch": {"along": "d", "itineraries": ["11"]}}"#),
    of(
        "two_stops_t1",
        "direct",
        r#"{"branch": {"along": "d", "itineraries": ["11"], "method": "direct"}}"#,
    ),
    of("self_excited", "map", r#"{"branch": {"along": "delta", "period": 1}}"#),
    of(
        "self_excited",
        "direct",
        r#"{"branch": {"along": "delta", "period": 1, "method": "direct"}}"#,
    ),
    of("soft_b", "map", r#"{"branch": {"along": "A", "period": 2}}"#),
    of("soft_b", "direct", r#"{"branch": {"along": "A", "period": 1, "method": "direct"}}"#),
];

/// Loci of saddle-nodes, flips, Neimark–Sacker points and grazes.
pub(super) const LOCI: &[Question] = &[
    of("linear", "map", r#"{"loci": {"plane": ["alpha", "omega"]}}"#),
    of(
        "linear",
        "direct",
        r#"{"loci": {"plane": ["alpha", "omega"], "itineraries": ["10"], "method": "direct"}}"#,
    ),
    of("mems", "map", r#"{"loci": {"plane": ["V", "omega"]}}"#),
    of("cantilever_3_5_soft", "map", r#"{"loci": {"plane": ["Q", "beta"]}}"#),
    of("impact_pair", "map", r#"{"loci": {"plane": ["A", "omega"]}}"#),
    of("soft_b", "map", r#"{"loci": {"plane": ["A", "omega"]}}"#),
    of(
        "soft_b",
        "direct",
        r#"{"loci": {"plane": ["A", "omega"], "itineraries": ["1"], "kind": ["graze"],
            "method": "direct"}}"#,
    ),
];

/// Crises.
pub(super) const CRISES: &[Question] = &[
    of(
        "cantilever_3_5_soft",
        "map",
        r#"{"loci": {"plane": ["beta", "Q"], "kind": ["crisis"], "itineraries": ["1100000"],
            "from": -2e-7, "to": 2e-7}}"#,
    ),
    of(
        "cantilever_3_5_soft",
        "direct",
        r#"{"loci": {"plane": ["beta", "Q"], "kind": ["crisis"], "itineraries": ["1100000"],
            "from": -2e-7, "to": 2e-7, "method": "direct"}}"#,
    ),
];

/// Periodic orbits by itinerary, with folds and flips.
pub(super) const SEARCHES: &[Question] = &[
    of("linear", "map", r#"{"orbits": {"kind": ["fold", "flip"]}}"#),
    of("linear", "direct", r#"{"orbits": {"method": "direct", "period": 2}}"#),
    of("mems", "map", r#"{"orbits": {}}"#),
    of("mems", "direct", r#"{"orbits": {"method": "direct", "period": 2}}"#),
    of("cantilever_3_5_soft", "map", r#"{"orbits": {"kind": ["fold", "flip"]}}"#),
    of(
        "cantilever_3_5_soft",
        "direct",
        r#"{"orbits": {"kind": ["fold", "flip"], "itineraries": ["10"], "method": "direct"}}"#,
    ),
    of("two_stops_t1", "map", r#"{"orbits": {"period": 1}}"#),
    of("two_stops_t1", "direct", r#"{"orbits": {"period": 1, "method": "direct"}}"#),
    of("soft_b", "map", r#"{"orbits": {"kind": ["fold", "flip"], "period": 2}}"#),
    of("soft_b", "direct", r#"{"orbits": {"period": 1, "method": "direct"}}"#),
];

/// Grazing curves, smallest changes that graze, and margins of safety.
pub(super) const CURVES: &[Question] = &[
    of("linear", "along", r#"{"curve": {"along": "omega", "from": 1.8, "to": 1.9, "xi": 2}}"#),
    of("linear", "nearest", r#"{"nearest": {"nearest": ["alpha", "omega"]}}"#),
    of("linear", "safe", r#"{"safe": {"tolerance": {"omega": 0.01}, "points": 4}}"#),
    of("mems", "along", r#"{"curve": {"along": "omega", "from": 0.46, "to": 0.465}}"#),
    of("mems", "nearest", r#"{"nearest": {"nearest": ["V", "omega"]}}"#),
    of("cantilever_3_5_soft", "along", r#"{"curve": {"along": "beta", "from": 0.19, "to": 0.21}}"#),
    of("cantilever_3_5_soft", "nearest", r#"{"nearest": {"nearest": ["Q", "beta"]}}"#),
    of("two_stops_t1", "nearest", r#"{"nearest": {"nearest": ["d", "omega"]}}"#),
    of("self_excited", "nearest", r#"{"nearest": {"nearest": ["delta", "mu"]}}"#),
    of("soft_b", "along", r#"{"curve": {"along": "omega", "from": 0.83, "to": 0.86, "xi": 2}}"#),
    of("soft_b", "nearest", r#"{"nearest": {"nearest": ["A", "omega"]}}"#),
];

/// Basins of attraction.
pub(super) const BASINS: &[Question] = &[
    of("linear", "map", r#"{"points": [16], "with": "map"}"#),
    of("linear", "guarded", r#"{"points": [16], "at": {"alpha": 1e-5}}"#),
    of("linear", "direct", r#"{"points": [8], "with": "direct"}"#),
    of("mems", "map", r#"{"points": [16], "with": "map"}"#),
    of("mems", "guarded", r#"{"points": [8]}"#),
    of("mems", "direct", r#"{"points": [6], "with": "direct"}"#),
    of("cantilever_3_5_soft", "map", r#"{"points": [16], "with": "map"}"#),
    of("cantilever_3_5_soft", "guarded", r#"{"points": [8]}"#),
    of("cantilever_3_5_soft", "direct", r#"{"points": [6], "with": "direct"}"#),
    of("two_stops_t1", "map", r#"{"points": [12], "with": "map"}"#),
    of("two_stops_t1", "guarded", r#"{"points": [6]}"#),
    of("two_stops_t1", "direct", r#"{"points": [6], "with": "direct"}"#),
    of("soft_b", "map", r#"{"points": [12], "with": "map"}"#),
    of("soft_b", "guarded", r#"{"points": [6]}"#),
    of("soft_b", "direct", r#"{"points": [6], "with": "direct"}"#),
];

/// Manifolds of saddles.
pub(super) const MANIFOLDS: &[Question] = &[
    of("linear", "map", r#"{"points": [4], "with": "map", "manifolds": 1}"#),
    of("linear", "direct", r#"{"points": [4], "with": "direct", "manifolds": 1}"#),
    of("mems", "map", r#"{"points": [4], "with": "map", "manifolds": 1}"#),
    of("mems", "direct", r#"{"points": [4], "with": "direct", "manifolds": 1}"#),
    of("cantilever_3_5_soft", "map", r#"{"points": [4], "with": "map", "manifolds": 1}"#),
    of("foale", "map", r#"{"points": [4], "with": "map", "manifolds": 1}"#),
    of("foale", "direct", r#"{"points": [4], "with": "direct", "manifolds": 1}"#),
    of("soft_b", "map", r#"{"points": [4], "with": "map", "manifolds": 1}"#),
    of("soft_b", "direct", r#"{"points": [4], "with": "direct", "manifolds": 1}"#),
];

/// Fits to measured returns.
pub(super) const FITS: &[Question] = &[
    of("linear", "map", r#"{"parameters": ["alpha"], "piece": 0, "method": "map"}"#),
    of("linear", "direct", r#"{"parameters": ["alpha"], "piece": 0, "method": "direct"}"#),
    of("mems", "map", r#"{"parameters": ["V", "omega"], "piece": 0, "method": "map"}"#),
    of("mems", "direct", r#"{"parameters": ["V"], "piece": 2, "method": "direct"}"#),
    of("cantilever_3_5_soft", "map", r#"{"parameters": ["Q", "beta"], "method": "map"}"#),
    of("cantilever_3_5_soft", "direct", r#"{"parameters": ["Q"], "method": "direct"}"#),
    of("two_stops_t1", "map", r#"{"parameters": ["d"], "piece": 0, "method": "map"}"#),
    of("soft_b", "map", r#"{"parameters": ["A"], "withheld": 1, "method": "map"}"#),
    of("soft_b", "guarded", r#"{"parameters": ["A", "omega"], "method": "guarded"}"#),
];

/// Orbits under noise.
pub(super) const NOISE: &[Question] = &[
    of(
        "linear",
        "map",
        r#"{"noise": {"deviations": {"alpha": 1e-5}, "orbits": 20, "transient": 10, "keep": 40,
            "cells": 8, "method": "map"}}"#,
    ),
    of(
        "linear",
        "direct",
        r#"{"noise": {"deviations": {"alpha": 1e-5}, "orbits": 6, "transient": 5, "keep": 20,
            "cells": 8, "method": "direct"}}"#,
    ),
    of(
        "mems",
        "map",
        r#"{"noise": {"deviations": {"V": 1e-6}, "orbits": 20, "transient": 10, "keep": 40,
            "cells": 8, "method": "map", "law": "uniform"}}"#,
    ),
    of(
        "mems",
        "direct",
        r#"{"noise": {"deviations": {"V": 1e-6}, "orbits": 6, "transient": 5, "keep": 20,
            "cells": 8, "method": "direct"}}"#,
    ),
    of(
        "cantilever_3_5_soft",
        "map",
        r#"{"noise": {"deviations": {"Q": 1e-7}, "orbits": 20, "transient": 10, "keep": 40,
            "cells": 8, "method": "map"}}"#,
    ),
    of(
        "cantilever_3_5_soft",
        "direct",
        r#"{"noise": {"deviations": {"Q": 1e-7}, "orbits": 6, "transient": 5, "keep": 20,
            "cells": 8, "method": "direct"}}"#,
    ),
    of(
        "two_stops_t1",
        "guarded",
        r#"{"noise": {"deviations": {"d": 1e-6}, "orbits": 6, "transient": 5, "keep": 20,
            "cells": 4}}"#,
    ),
    of(
        "soft_b",
        "guarded",
        r#"{"noise": {"deviations": {"A": 1e-5}, "orbits": 6, "transient": 5, "keep": 20,
            "cells": 8}}"#,
    ),
];

/// Scenes whose windows are measured, without the bounds that they name.
pub(super) const OPEN_WINDOWS: [&str; 5] =
    ["linear", "mems", "cantilever_0_12", "soft_b", "impact_pair"];

/// Scenes with the tolerances for which orders are chosen.
pub(super) const TOLERANCES: &[(&str, &str)] = &[
    ("linear", "1e-6"),
    ("linear", "1e-8"),
    ("mems", "1e-6"),
    ("cantilever_0_12", "1e-6"),
    ("soft_b", "1e-6"),
    ("impact_pair", "1e-6"),
];
