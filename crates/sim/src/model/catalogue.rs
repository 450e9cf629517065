//! The catalogue of scenes: one for each system of the literature, built into the program.

/// A scene of the catalogue.
struct CatalogueEntry {
    name: &'static str,
    summary: &'static str,
    text: &'static str,
}

/// An entry whose text is the file `scenes/NAME.toml` of this package.
macro_rules! entry {
    ($name:literal, $summary:literal) => {
        CatalogueEntry {
            name: $name,
            summary: $summary,
            text: include_str!(concat!("../../scenes/", $name, ".toml")),
        }
    };
}

/// Every scene of the catalogue; the program runs the first if no scene is named.
const ENTRIES: &[CatalogueEntry] = &[
    entry!("linear", "linear oscillator, omega = 1.8 (Thota, Zhao, Dankowicz 2006)"),
    entry!("linear_codim2", "linear oscillator where xi_1 = 0 (Thota, Zhao, Dankowicz 2006)"),
    entry!("foale", "linear oscillator, omega = 1.8 (Foale 1994)"),
    entry!("foale_omega_2_2", "linear oscillator, omega = 2.2 (Foale 1994)"),
    entry!("mems", "electrostatic oscillator, omega = 0.46"),
    entry!("mems_codim2", "electrostatic oscillator where xi_1 = 0, omega = 0.4878"),
    entry!("mems_scenario3", "electrostatic oscillator where xi_1 = 0, scenario 3"),
    entry!("cantilever_1_7", "cantilever beam, zeta = 1.7: real multipliers"),
    entry!("cantilever_2_0", "cantilever beam, zeta = 2.0: real multipliers"),
    entry!("cantilever_2_5", "cantilever beam, zeta = 2.5: real multipliers"),
    entry!("cantilever_3_5", "cantilever beam, zeta = 3.5: real multipliers"),
    entry!("cantilever_4_5", "cantilever beam, zeta = 4.5: real multipliers"),
    entry!("cantilever_3_5_soft", "cantilever beam, zeta = 3.5, alpha = beta = 0.2"),
    entry!("cantilever_0_1257", "cantilever beam, zeta = 0.1257: orbit 1/9"),
    entry!("cantilever_0_123", "cantilever beam, zeta = 0.123: orbit 1/8"),
    entry!("cantilever_0_12", "cantilever beam, zeta = 0.12: orbit 1/7"),
    entry!("cantilever_0_107", "cantilever beam, zeta = 0.107: orbit 1/6"),
    entry!("cantilever_0_09", "cantilever beam, zeta = 0.09: orbit 1/5"),
    entry!("cantilever_0_068", "cantilever beam, zeta = 0.068: orbit 1/4"),
    entry!(
        "soft_a",
        "soft impacts A: spring (Kundu, Banerjee, Ing, Pavlovskaia, Wiercigroch 2012)"
    ),
    entry!("soft_b", "soft impacts B: spring and damper, released at zero force"),
    entry!("soft_b_surface", "soft impacts B: spring and damper, released at the surface"),
    entry!("soft_a_stiff", "soft impacts A: stiff spring, contacts flown exactly"),
    entry!("soft_b_stiff", "soft impacts B: spring and light damper, contacts flown exactly"),
    entry!("soft_c", "soft impacts C: prestressed spring"),
    entry!("soft_d", "soft impacts D: prestressed spring and damper"),
    entry!("hunt_crossley", "soft stop of Hunt and Crossley: force d^1.25 (1 + c d')"),
    entry!("two_stops_t1", "two masses between two elastic stops, T1"),
    entry!("two_stops_t1_prestressed", "two masses between two prestressed stops, T1"),
    entry!("two_stops_t1_rigid", "two masses between two rigid stops, T1"),
    entry!("two_stops_t2", "two masses between two elastic stops, T2"),
    entry!("two_stops_t2_prestressed", "two masses between two prestressed stops, T2"),
    entry!("two_stops_t2_rigid", "two masses between two rigid stops, T2"),
    entry!("moving_stop", "linear oscillator with a moving stop"),
    entry!("impact_pair", "two masses that hit each other: four states, both velocities reset"),
    entry!("three_masses", "chain of three masses with a prestressed stop: six states"),
    entry!("two_sided", "oscillator between two rigid stops: one hit, one grazed (Peterka)"),
    entry!("gear_rattle", "rattling gear pair with backlash: drive flank hit, coast flank grazed"),
    entry!("ball_in_capsule", "ball in a shaken capsule: both ends hit, one grazed as well"),
    entry!("two_sided_absorber", "absorber that hits one wall of its housing and grazes the other"),
    entry!("self_excited", "van der Pol oscillator carrying a mass that hits a stop: no forcing"),
];

/// Names of the scenes, in the order of the catalogue.
pub fn names() -> impl Iterator<Item = &'static str> {
    ENTRIES.iter().map(|entry| entry.name)
}

/// Text of a scene; `None` if the catalogue has no scene of this name.
pub fn text(name: &str) -> Option<&'static str> {
    find(name).map(|entry| entry.text)
}

/// One-line summary of a scene.
pub fn summary(name: &str) -> Option<&'static str> {
    find(name).map(|entry| entry.summary)
}

fn find(name: &str) -> Option<&'static CatalogueEntry> {
    ENTRIES.iter().find(|entry| entry.name == name)
}
