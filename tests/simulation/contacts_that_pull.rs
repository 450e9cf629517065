//! Contacts that push back less than the free flight does, or pull: they begin, and last.

use grazemap::analysis::{NoProgress, SeriesPoint, TimeSeriesRequest, direct_image, time_series};
use grazemap::hybrid::MomentEvent;

use crate::support::scenes::{NONE, grazing_by, text};

/// By DOP853 at 3e-14 (head of the scene).
#[test]
fn a_contact_that_pulls_in_lasts_as_long_as_its_field_holds() {
    let text = include_str!("../data/outside/f11_contact_that_pulls_in.toml");
    let (scene, orbit) = grazing_by(text, "f11", &NONE);
    let request = TimeSeriesRequest {
        start: vec![-0.001, 0.0],
        parameters: vec![0.02],
        settle: 0,
        returns: 2,
        samples: 2000,
    };
    let series = time_series(&scene, &orbit, &request, &NoProgress).expect("finite offsets");
    let first = |wanted: MomentEvent| {
        let happened = |point: &&_| event_of(point) == Some(wanted);
        let point = series.points.iter().find(happened).expect("a contact");
        (point.time, point.state[1])
    };
    for ((time, speed), (expected_time, expected_speed)) in [
        (first(MomentEvent::Contact), (7.511306801, 0.263977424)),
        (first(MomentEvent::Release), (8.152866390, -0.261074860)),
    ] {
        // The digits given.
        assert!((time - expected_time).abs() < 1e-9, "{time}");
        assert!((speed - expected_speed).abs() < 1e-9, "{speed}");
    }
    let highest = series.points.iter().map(|point| point.state[0]).fold(0.0, f64::max);
    // Between samples the height is off by their spacing's square.
    assert!((highest - 1.0516464).abs() < 1e-5, "{highest}");
}

fn event_of(point: &SeriesPoint) -> Option<MomentEvent> {
    point.event.map(|(event, _)| event)
}

/// The map and DOP853 give 3.00893e-2 (scene `soft_c` with an offset of the spring's rest that
/// pulls).
#[test]
fn a_spring_set_back_behind_the_surface_has_the_image_of_its_map() {
    let set = [("d", "-0.1")];
    let (scene, orbit) = grazing_by(text("soft_c"), "soft_c", &set);
    let image = direct_image::<f64>(&scene, &orbit, &[1e-4, 0.0], &[0.0, 0.0]);
    let image = image.expect("finite offsets");
    assert!((image.offsets[0] - 3.00893453e-2).abs() < 1e-10, "{:?}", image.offsets);
}
