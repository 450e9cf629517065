//! Grazing orbits that hit stops on their way, against the closed form of linear free flight.

use grazemap::model::catalogue;
use grazemap::numeric::Dd;
use grazemap::orbit::{GrazingOrbit, Location, NotLocated, OrbitHit, locate};

use crate::support::scenes::{NONE, index, orbit, parsed, scene};

/// A decimal number.
fn dd(text: &str) -> Dd {
    text.parse().expect("a number")
}

/// An oscillator `x'' + 2 zeta x' + x = a cos(theta)` between stops at `-dl` and `dr`.
fn two_sided(hits: &str) -> String {
    let text = catalogue::text("two_sided").expect("the catalogue holds it");
    text.replace("surface = \"right\"\nhits = \"left\"", hits)
}

/// Closed form of the free flight, in double-double.
struct Linear {
    zeta: Dd,
    a: Dd,
    w: Dd,
}

impl Linear {
    /// Position and velocity of the periodic part at a phase.
    fn forced(&self, theta: Dd) -> [Dd; 2] {
        let (one, two) = (Dd::ONE, Dd::from(2.0));
        let (c, d) = (one - self.w * self.w, two * self.zeta * self.w);
        let size = self.a / (c * c + d * d);
        let (sin, cos) = theta.sin_cos();
        [size * (c * cos + d * sin), size * self.w * (d * cos - c * sin)]
    }

    /// State `[x, v, theta]` after a time.
    fn fly(&self, state: [Dd; 3], time: Dd) -> [Dd; 3] {
        let [x, v, theta] = state;
        let [px, pv] = self.forced(theta);
        let (x, v) = (x - px, v - pv);
        let rate = (Dd::ONE - self.zeta * self.zeta).sqrt();
        let (sin, cos) = (rate * time).sin_cos();
        let decay = (-(self.zeta * time)).exp();
        let b = (v + self.zeta * x) / rate;
        let along = decay * (x * cos + b * sin);
        let across = decay * rate * (b * cos - x * sin);
        let theta = theta + self.w * time;
        let [px, pv] = self.forced(theta);
        [along + px, across - self.zeta * along + pv, theta]
    }

    /// Time of the first hit of `x = wall` from the free side before `limit`, by samples and
    /// bisection.
    fn hit(&self, state: [Dd; 3], wall: f64, side: f64, limit: Dd) -> Option<Dd> {
        const SAMPLES: usize = 4000;
        let gap = |time: Dd| (self.fly(state, time)[0] - Dd::from(wall)) * Dd::from(side);
        let at = |number: usize| limit * Dd::from(number as f64 / SAMPLES as f64);
        let place = (1..SAMPLES).find(|&n| gap(at(n)) > Dd::ZERO && gap(at(n + 1)) <= Dd::ZERO)?;
        let (mut low, mut high) = (at(place), at(place + 1));
        for _ in 0..110 {
            let middle = (low + high) * Dd::from(0.5);
            if gap(middle) > Dd::ZERO { low = middle } else { high = middle }
        }
        Some((low + high) * Dd::from(0.5))
    }
}

const FLIGHT: fn() -> Linear = || Linear { zeta: dd("0.05"), a: Dd::ONE, w: dd("0.8") };

fn three(state: &[Dd]) -> [Dd; 3] {
    [state[0], state[1], state[2]]
}

/// Compares the hits and the closure of an orbit that hits `left` with the closed form.
fn assert_closed(orbit: &GrazingOrbit) {
    let (flight, restitution) = (FLIGHT(), dd("0.7"));
    let mut state = three(&orbit.grazing_point().state);
    let mut elapsed = Dd::ZERO;
    for OrbitHit { time, speed, .. } in &orbit.hits {
        let wait = flight.hit(state, -0.5, 1.0, orbit.period - elapsed).expect("a hit");
        state = flight.fly(state, wait);
        elapsed += wait;
        assert!((elapsed - *time).to_f64().abs() < 1e-26, "{:e}", (elapsed - *time).to_f64());
        assert!((state[1] + *speed).to_f64().abs() < 1e-26);
        state[1] = -(restitution * state[1]);
    }
    assert!(flight.hit(state, -0.5, 1.0, orbit.period - elapsed).is_none(), "one hit more");
    let end = flight.fly(state, orbit.period - elapsed);
    for (end, start) in end.iter().zip(&orbit.grazing_point().state).take(2) {
        assert!((*end - *start).to_f64().abs() < 1e-26, "{:e}", (*end - *start).to_f64());
    }
}

#[test]
fn an_orbit_hits_one_stop_twice_and_grazes_the_other() {
    for hits in [
        "surface = \"right\"\nhits = \"left\"",
        "passages = [{ hit = \"left\" }, \"right\", { hit = \"left\" }]",
    ] {
        let scene = parsed(&two_sided(hits), "two_sided", &NONE);
        let orbit = orbit(&scene);
        let gap = orbit.parameters()[index(&scene, "dr")].to_f64();
        // The largest x of the attractor, by an exact-flow simulation of others.
        assert!((gap - 1.805_712_936_6).abs() < 1e-10, "{gap}");
        let speeds: Vec<f64> = orbit.hits.iter().map(|hit| hit.speed.to_f64()).collect();
        assert_eq!(speeds.len(), 2, "{speeds:?}");
        let mut sorted = speeds.clone();
        sorted.sort_by(f64::total_cmp);
        assert!((sorted[0] - 0.91502).abs() < 1e-5 && (sorted[1] - 1.88427).abs() < 1e-5);
        assert!(orbit.is_physical() && orbit.residual < 1e-28);
        assert_closed(&orbit);
    }
}

/// Text of a scene of `tests/data/hits`.
fn text_of(name: &str) -> String {
    let path = format!("{}/tests/data/hits/{name}.toml", env!("CARGO_MANIFEST_DIR"));
    std::fs::read_to_string(path).expect("the scene is part of the repository")
}

#[test]
fn an_orbit_that_rests_grazes_where_its_flight_from_the_release_turns() {
    for (name, w, hits) in [("rests", "0.8", 1), ("chatters", "0.4", 2)] {
        let scene = parsed(&text_of(name), name, &NONE);
        let found = orbit(&scene);
        // The stop is left where the force no longer presses: cos(theta) = -dl.
        let (mut theta, half) = (dd("4.2"), dd("0.5"));
        for _ in 0..10 {
            let (sin, cos) = theta.sin_cos();
            theta += (cos + half) / sin;
        }
        let flight = Linear { zeta: dd("0.1"), a: Dd::ONE, w: dd(w) };
        let released = [-half, Dd::ZERO, theta];
        // The first maximum of x, where the velocity comes down to zero.
        let velocity = |time: Dd| flight.fly(released, time)[1];
        let at = |number: usize| Dd::from(number as f64 * 0.01);
        let place = (1..2000).find(|&number| velocity(at(number)) < Dd::ZERO).expect("a maximum");
        let (mut low, mut high) = (at(place - 1), at(place));
        for _ in 0..110 {
            let middle = (low + high) * half;
            if velocity(middle) > Dd::ZERO { low = middle } else { high = middle }
        }
        let top = flight.fly(released, low)[0];
        let gap = found.parameters()[index(&scene, "dr")];
        assert!((gap - top).to_f64().abs() < 1e-28, "{name}: {:e}", (gap - top).to_f64());
        assert_eq!(found.hits.len(), hits, "{name}");
        assert!(found.hits.last().is_some_and(|last| last.rests), "{name}");
        assert!(found.forgets() && found.multipliers.len() == 2, "{name}");
    }
}

#[test]
fn a_section_in_a_rest_is_refused() {
    let section = "[section]\nkind = \"stroboscopic\"\nphase = 3.4\n";
    let scene = parsed(&(text_of("rests") + section), "rests", &NONE);
    let Ok(Location::NotLocated(reason)) = locate(&scene) else { panic!("it is found") };
    assert!(matches!(reason, NotLocated::SectionInContact { .. }), "{reason}");
}

#[test]
fn the_monodromy_is_that_of_the_closed_form() {
    let scene = parsed(&two_sided("surface = \"right\"\nhits = \"left\""), "two_sided", &NONE);
    let orbit = orbit(&scene);
    let (flight, restitution) = (FLIGHT(), dd("0.7"));
    // Image of a change of the graze's state over one period, in the full state.
    let image = |change: [f64; 3]| -> [Dd; 3] {
        let mut state = three(&orbit.grazing_point().state);
        state.iter_mut().zip(change).for_each(|(value, change)| *value += Dd::from(change));
        let mut elapsed = Dd::ZERO;
        for _ in 0..orbit.hits.len() {
            let wait = flight.hit(state, -0.5, 1.0, orbit.period - elapsed).expect("a hit");
            state = flight.fly(state, wait);
            elapsed += wait;
            state[1] = -(restitution * state[1]);
        }
        flight.fly(state, orbit.period - elapsed)
    };
    let step = 1e-8;
    // Determinant of the states' block: contraction of the free flow times r squared at each hit.
    let columns = [[step, 0.0, 0.0], [0.0, step, 0.0]].map(|change| {
        let (up, down) = (image(change), image(change.map(|value| -value)));
        [0, 1].map(|row| ((up[row] - down[row]).to_f64()) / (2.0 * step))
    });
    let determinant = columns[0][0] * columns[1][1] - columns[0][1] * columns[1][0];
    let known = (-0.1 * orbit.period.to_f64()).exp() * 0.7_f64.powi(4);
    assert!((determinant / known - 1.0).abs() < 1e-10, "{determinant} for {known}");
    let product =
        orbit.multipliers.iter().fold([1.0, 0.0], |[a, b], [c, d]| [a * c - b * d, a * d + b * c]);
    assert!((product[0] / known - 1.0).abs() < 1e-12, "{} for {known}", product[0]);
    let trace: f64 = orbit.multipliers.iter().map(|[re, _]| re).sum();
    let differences = columns[0][0] + columns[1][1];
    assert!((trace - differences).abs() < 1e-10, "{trace} for {differences}");
}

#[test]
fn a_stop_is_hit_and_grazed_in_one_period() {
    // Ball between the ends of a capsule: bottom, top, and a third impact at the bottom with zero
    // speed (Serdukova, Kuske, Yurchenko, arXiv 2003.02167). Its flight is a closed form, without
    // damping: z = z0 + (u0 - sin(th)/pi) t + gb t^2/2 + (cos(th) - cos(th + pi t))/pi^2.
    let scene = scene("ball_in_capsule");
    let orbit = orbit(&scene);
    let names: Vec<&str> =
        orbit.hits.iter().map(|hit| scene.model.surfaces[hit.surface].name.as_str()).collect();
    assert_eq!(names, ["top", "bottom"]);
    let (pi, gravity, restitution, half) = (Dd::PI, dd("0.05"), dd("0.3"), Dd::from(0.5));
    let fly = |[z, u, th]: [Dd; 3], t: Dd| {
        let (sin, cos) = th.sin_cos();
        let (sin_end, cos_end) = (th + pi * t).sin_cos();
        let z = z + (u - sin / pi) * t + half * gravity * t * t + (cos - cos_end) / (pi * pi);
        [z, u + gravity * t + (sin_end - sin) / pi, th + pi * t]
    };
    let mut state = three(&orbit.grazing_point().state);
    let d = orbit.parameters()[index(&scene, "d")];
    assert!((state[0] - half * d).to_f64().abs() < 1e-28 && state[1].to_f64().abs() < 1e-28);
    let mut elapsed = Dd::ZERO;
    for (hit, side) in orbit.hits.iter().zip([-1.0, 1.0]) {
        state = fly(state, hit.time - elapsed);
        elapsed = hit.time;
        assert!((state[0] - Dd::from(side) * half * d).to_f64().abs() < 1e-26);
        state[1] = -(restitution * state[1]);
    }
    let end = fly(state, orbit.period - elapsed);
    for (end, start) in end.iter().zip(&orbit.grazing_point().state).take(2) {
        assert!((*end - *start).to_f64().abs() < 1e-26, "{:e}", (*end - *start).to_f64());
    }
}

#[test]
fn hits_that_the_scene_does_not_name_are_told() {
    let hit = "{ hit = \"left\" }";
    let thrice = two_sided(&format!("passages = [{hit}, {hit}, {hit}, \"right\"]"));
    let scene = parsed(&thrice, "two_sided", &NONE);
    let Ok(Location::NotLocated(reason @ NotLocated::OtherHits { .. })) = locate(&scene) else {
        panic!("three hits are named, two happen");
    };
    let text = reason.to_string();
    assert!(text.contains("[\"right\", { hit = \"left\" }, { hit = \"left\" }]"), "{text}");
    let scene = parsed(&two_sided("surface = \"right\""), "two_sided", &NONE);
    let Ok(Location::Located(orbit)) = locate(&scene) else { panic!("an orbit of the free flow") };
    let reason = orbit.physical(&scene).unwrap_err().to_string();
    assert!(reason.contains("hits = [\"left\"]"), "{reason}");
}

#[test]
fn a_hit_by_a_power_that_is_not_whole_is_refused_by_its_key() {
    let text = two_sided("surface = \"right\"\nhits = \"left\"");
    let hertz = "event = \"x + dl\"\ncontact = { v = \"free + 20*d^1.5\" }";
    let text = text.replace("event = \"x + dl\"\nimpact = { v = \"-r*v\" }", hertz);
    let located = locate(&parsed(&text, "two_sided", &NONE));
    let Ok(Location::NotLocated(reason @ NotLocated::NoSeries { .. })) = &located else {
        panic!("{located:?}")
    };
    let words = reason.to_string();
    assert!(words.contains("`model.surface.0.contact.v` has the argument 0"), "{words}");
}

#[test]
fn scenes_of_the_catalogue_graze_beside_their_hits() {
    // Scene, grazing value, its relative uncertainty, hits of a period. Gear pair and ball: roots of
    // their closed forms to 30 digits, by Newton's method in multiple precision. Absorber: graze of a
    // branch of direct simulation, which shares no search with `locate`; ten digits are printed.
    let cases: [(&str, &str, f64, &[&str]); 3] = [
        ("gear_rattle", "4.82259205094515719532111802922", 1e-26, &["drive"]),
        ("ball_in_capsule", "0.203449029453488390660808835063", 1e-26, &["top", "bottom"]),
        ("two_sided_absorber", "0.9583002321", 1e-10, &["up"]),
    ];
    for (name, value, most, hits) in cases {
        let scene = scene(name);
        let orbit = orbit(&scene);
        let found = orbit.parameters()[scene.grazing.solve_for[0]];
        let error = ((found - dd(value)) / dd(value)).to_f64().abs();
        assert!(error < most, "{name}: {error:e}");
        let names: Vec<&str> =
            orbit.hits.iter().map(|hit| scene.model.surfaces[hit.surface].name.as_str()).collect();
        assert_eq!(names, hits, "{name}");
        assert!(orbit.is_physical(), "{name}");
    }
}
