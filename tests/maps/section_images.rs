//! Images of section points, by direct simulation and by the map, against images computed elsewhere
//! to at least 30 digits (tests/data/rigid/README.md).

use grazemap::analysis::{
    ImageRecord, ImageRequest, ImageRow, Precision, Using, direct_image, images,
};
use grazemap::expansion::{Expander, LocalMap, MapOrders};
use grazemap::iteration::{DiscreteMap, InterpretedMap};
use grazemap::model::Scene;
use grazemap::numeric::Dd;
use grazemap::orbit::GrazingOrbit;
use serde_json::Value;

use crate::support::reference::{exact, read};
use crate::support::scenes::{grazing, orbit, scene_with};

struct Case {
    scene: Scene,
    orbit: GrazingOrbit,
    file: Value,
}

fn case(scene: &str, file: &str) -> Case {
    let (scene, orbit) = grazing(scene);
    Case { scene, orbit, file: read(&format!("rigid/public_{file}.json")) }
}

impl Case {
    fn rows(&self) -> &[Value] {
        self.file["rows"].as_array().expect("rows")
    }

    fn request(&self, using: Using, precision: Precision) -> ImageRequest {
        let row = |row: &Value| ImageRow {
            state: vec![exact(&row["x_minus_delta"]), exact(&row["dtheta"])],
            parameters: row["param_offsets"]
                .as_array()
                .expect("offsets")
                .iter()
                .map(exact)
                .collect(),
        };
        ImageRequest {
            rows: self.rows().iter().map(row).collect(),
            iterations: 1,
            using,
            precision,
        }
    }

    fn map(&self, smooth_order: u32, contact_weight: u32) -> LocalMap {
        let orders = MapOrders { smooth_order, contact_weight };
        Expander::new(&self.scene, &self.orbit)
            .expect("rigid")
            .expand(orders)
            .expect("a simple graze")
    }

    /// Largest error of the offsets of one image over the rows whose depth is at most this.
    fn worst(&self, records: &[ImageRecord], deepest: f64) -> f64 {
        let error = |record: &ImageRecord| {
            let image = &self.rows()[record.row]["images"][record.iteration - 1];
            let truth = [exact(&image["x_minus_delta"]), exact(&image["dtheta"])];
            let difference = |(&ours, truth): (&Dd, Dd)| (ours - truth).to_f64().abs();
            record.offsets.iter().zip(truth).map(difference).fold(0.0, f64::max)
        };
        let shallow = |record: &&ImageRecord| {
            exact(&self.rows()[record.row]["x_minus_delta"]).to_f64() <= deepest
        };
        let errors: Vec<f64> = records.iter().filter(shallow).map(error).collect();
        assert!(errors.len() >= 5, "only {} rows", errors.len());
        errors.into_iter().fold(0.0, f64::max)
    }
}

#[test]
fn direct_images_in_double_double_agree_to_twenty_digits() {
    for (scene, file) in [("linear", "linear_w1.8"), ("mems", "mems_w0.46")] {
        let case = case(scene, file);
        let request = case.request(Using::Direct, Precision::Dd);
        let records =
            images(&case.scene, &case.orbit, &case.map(1, 1), &request).expect("good rows");
        let worst = case.worst(&records, f64::INFINITY);
        assert!(worst < 1e-20, "{scene}: {worst:e}");
    }
}

#[test]
fn map_of_order_eight_and_weight_ten_is_good_to_eleven_digits_for_shallow_contacts() {
    let case = case("linear", "linear_w1.8");
    let request = case.request(Using::Map, Precision::F64);
    let records = images(&case.scene, &case.orbit, &case.map(8, 10), &request).expect("good rows");
    let worst = case.worst(&records, 1e-5);
    assert!(worst < 1e-11, "{worst:e}");
}

/// A stroboscopic section point with the velocity of the graze itself stands at the minimum of its
/// gap but for rounding: map and simulation agree there as elsewhere.
#[test]
fn a_section_point_at_its_own_minimum_has_the_image_of_the_map() {
    let scene = scene_with("linear", &[("section.kind", "stroboscopic")]);
    let orbit = orbit(&scene);
    let orders = MapOrders { smooth_order: 10, contact_weight: 14 };
    let expander = Expander::new(&scene, &orbit).expect("rigid");
    let map = InterpretedMap::new(&expander.expand(orders).expect("an expansion"));
    let none = [0.0; 2];
    for velocity in [0.0, 1e-40, -1e-40, 1e-20, -1e-20, 1e-9, -1e-9] {
        let state = [1e-6, velocity];
        let mut image = [0.0; 2];
        assert_eq!(map.step(&state, &none, &mut image).contacts(), 1);
        let exact = direct_image::<Dd>(&scene, &orbit, &state.map(Dd::from), &none.map(Dd::from))
            .expect("an image");
        assert_eq!((exact.contacts, exact.extra_contacts), (1, 0), "{velocity}");
        for (ours, truth) in image.iter().zip(&exact.offsets) {
            assert!((ours - truth.to_f64()).abs() < 1e-16, "{velocity}: {ours}");
        }
    }
}
