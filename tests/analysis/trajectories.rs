//! Time series, compared with the closed form of free flight, with images by direct simulation, and
//! with each other at different sampling.

use grazemap::analysis::{
    DirectEnd, NoProgress, SeriesPoint, TimeSeries, TimeSeriesRequest, direct_image, time_series,
};
use grazemap::hybrid::MomentEvent;
use grazemap::model::Scene;
use grazemap::orbit::GrazingOrbit;
use grazemap::report::time_series_figures;

use crate::support::scenes::{grazing, grazing_by, index, text};

fn request(start: &[f64], parameters: usize, returns: usize, samples: usize) -> TimeSeriesRequest {
    let (start, parameters) = (start.to_vec(), vec![0.0; parameters]);
    TimeSeriesRequest { start, parameters, settle: 0, returns, samples }
}

fn series(scene: &Scene, orbit: &GrazingOrbit, request: &TimeSeriesRequest) -> TimeSeries {
    let series = time_series(scene, orbit, request, &NoProgress).expect("the scene is simulated");
    assert_eq!(series.early_end, None);
    series
}

fn events(series: &TimeSeries) -> Vec<(usize, &SeriesPoint, MomentEvent)> {
    let rows = series.points.iter().enumerate();
    rows.filter_map(|(row, point)| point.event.map(|(event, _)| (row, point, event))).collect()
}

/// `x'' + 2 zeta x' + x = alpha cos(omega t)` settles on `x = delta cos(theta - theta*)` at the
/// graze, where `delta` is the amplitude.
#[test]
fn the_grazing_orbit_of_the_linear_oscillator_is_its_closed_form() {
    let (scene, orbit) = grazing("linear");
    let series = series(&scene, &orbit, &request(&[0.0; 2], 2, 1, 64));
    let value = |name| series.parameters[index(&scene, name)];
    let (delta, omega) = (value("delta"), value("omega"));
    let period = std::f64::consts::TAU / omega;
    assert!((series.points.last().expect("rows").time - period).abs() < 1e-13);
    let grazes: Vec<_> = events(&series).iter().map(|(row, _, event)| (*row, *event)).collect();
    assert_eq!(grazes, [(0, MomentEvent::Minimum), (64, MomentEvent::Minimum)]);
    for point in &series.points {
        let exact =
            [delta * (omega * point.time).cos(), -delta * omega * (omega * point.time).sin()];
        for (value, exact) in point.state.iter().zip(exact) {
            assert!((value - exact).abs() < 1e-13, "{point:?}: {exact}");
        }
        assert!((point.gaps[0] - (delta - point.state[0])).abs() < 1e-15);
        assert!((0.0..std::f64::consts::TAU).contains(&point.state[2]));
    }
}

/// The state behind an impact is the reset of the one before it, at the same time.
#[test]
fn an_impact_has_a_row_before_and_a_row_behind_it() {
    let (scene, orbit) = grazing("linear");
    let series = series(&scene, &orbit, &request(&[3e-3, 0.02], 2, 8, 50));
    let restitution = series.parameters[index(&scene, "r")];
    let impacts: Vec<_> =
        events(&series).into_iter().filter(|(.., event)| *event == MomentEvent::Impact).collect();
    assert!(impacts.len() >= 2, "{impacts:?}");
    for (row, before, _) in impacts {
        let behind = &series.points[row + 1];
        assert_eq!((behind.time, behind.event), (before.time, None));
        assert_eq!(behind.state[0], before.state[0]);
        assert!(before.state[1] > 0.0);
        assert_eq!(behind.state[1], -restitution * before.state[1]);
    }
    // A section point beyond the stop starts where the stop is met, before the section.
    assert!(series.points[0].time < 0.0 && series.points[0].event.is_some());
}

/// After one return of a stroboscopic section the series is at the direct image.
#[test]
fn a_return_ends_at_the_direct_image() {
    let set =
        [("section.kind", "\"stroboscopic\""), ("section.phase", "0.5"), ("window.state", "{}")];
    for name in ["linear", "soft_a"] {
        let (scene, orbit) = grazing_by(text(name), name, &set);
        for start in [[0.0, 2e-3], [4e-2, -3e-2], [-2e-2, 0.1]] {
            let active = scene.expansion.active.len();
            let image = direct_image(&scene, &orbit, &start, &vec![0.0; active]).expect("an image");
            assert_eq!(image.end, DirectEnd::Returned);
            let series = series(&scene, &orbit, &request(&start, active, 1, 10));
            let last = &series.points.last().expect("rows").state;
            let contacts = events(&series)
                .into_iter()
                .filter(|(.., event)| matches!(event, MomentEvent::Impact | MomentEvent::Contact));
            assert_eq!(contacts.count(), image.hits.iter().sum::<usize>(), "{name} {start:?}");
            let origin = orbit.section_coordinates(&scene);
            for ((state, offset), (_, origin)) in last.iter().zip(&image.offsets).zip(origin) {
                let difference = (state - (origin.to_f64() + offset)).abs();
                assert!(difference < 1e-11, "{name} {start:?}: {difference}");
            }
        }
    }
}

/// The number of samples does not move events, and a compliant contact begins before it ends.
#[test]
fn events_do_not_depend_on_the_samples() {
    let (scene, orbit) = grazing("soft_a");
    let active = scene.expansion.active.len();
    let [few, many] = [3, 400].map(|samples| {
        let start: Vec<f64> = vec![2e-3; orbit.section.coordinates.len()];
        series(&scene, &orbit, &request(&start, active, 6, samples))
    });
    let (few, many) = (events(&few), events(&many));
    assert!(few.len() > 6, "{few:?}");
    assert_eq!(few.len(), many.len());
    for ((_, a, event), (_, b, same)) in few.iter().zip(&many) {
        assert_eq!(event, same);
        assert!((a.time - b.time).abs() < 1e-9, "{} {}", a.time, b.time);
    }
    let contacts: Vec<_> = few.iter().map(|(.., event)| *event).collect();
    let contacts: Vec<_> =
        contacts.into_iter().filter(|event| *event != MomentEvent::Minimum).collect();
    let pairs = contacts.chunks_exact(2);
    assert!(pairs.clone().count() > 2);
    assert!(pairs.clone().all(|pair| pair == [MomentEvent::Contact, MomentEvent::Release]));
}

/// A portrait marks the section points: one at the start and one after every return.
#[test]
fn a_portrait_marks_the_points_of_a_stroboscopic_section() {
    let marked = |section: &[(&str, &str)]| {
        let (scene, orbit) = grazing_by(text("soft_b"), "soft_b", section);
        let series = series(&scene, &orbit, &request(&[1e-3, 0.0], 2, 3, 20));
        let figures = time_series_figures(&scene, &orbit, &series);
        let mut drawn = figures[0].1.series.iter().filter(|drawn| drawn.name == "section");
        drawn.next().map(|drawn| drawn.points.clone())
    };
    assert_eq!(marked(&[]), None);
    let stroboscopic = [("section.kind", "\"stroboscopic\""), ("section.phase", "1.0")];
    let points = marked(&stroboscopic).expect("drawn");
    assert_eq!(points.len(), 4, "{points:?}");
}

/// Only the settled part of an orbit is written: its rows equal the later rows of a series that is
/// written from the start.
#[test]
fn a_series_begins_where_the_orbit_has_settled() {
    let (scene, orbit) = grazing("linear");
    let whole = series(&scene, &orbit, &request(&[1e-3, 0.01], 2, 12, 20));
    let settled = TimeSeriesRequest { settle: 9, ..request(&[1e-3, 0.01], 2, 3, 20) };
    let settled = series(&scene, &orbit, &settled);
    let before = 9.0 * whole.duration;
    let later: Vec<_> = whole.points.iter().filter(|point| point.time >= before).collect();
    assert_eq!(settled.points.len(), later.len());
    for (point, later) in settled.points.iter().zip(later) {
        assert_eq!((point.time, &point.state), (later.time - before, &later.state));
        assert_eq!(point.event, later.event);
    }
}
