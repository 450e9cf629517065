//! Images of section points, by direct simulation and by the map, against images computed elsewhere to at
//! least 30 digits (tests/data/rigid/README.md).

use grazemap::analysis::{ImageRecord, ImageRequest, ImageRow, Precision, Using, images};
use grazemap::expansion::{Expander, LocalMap, MapOrders};
use grazemap::model::{Scene, catalogue};
use grazemap::numeric::Dd;
use grazemap::orbit::{GrazingOrbit, locate};
use serde_json::Value;

struct Case {
    scene: Scene,
    orbit: GrazingOrbit,
    file: Value,
}

fn case(scene: &str, file: &str) -> Case {
    let path = format!(
        "{}/tests/data/rigid/public_{file}.json",
        env!("CARGO_MANIFEST_DIR")
    );
    let text = std::fs::read_to_string(path).expect("the reference file");
    let scene = Scene::parse(catalogue::text(scene).expect("in the catalogue"), scene)
        .expect("a good scene");
    let orbit = locate(&scene)
        .expect("no wrong input")
        .into_result()
        .expect("it grazes");
    Case {
        scene,
        orbit,
        file: serde_json::from_str(&text).expect("JSON"),
    }
}

fn number(value: &Value) -> Dd {
    Dd::from_decimal(value.as_str().expect("a decimal string")).expect("a decimal number")
}

impl Case {
    fn rows(&self) -> &[Value] {
        self.file["rows"].as_array().expect("rows")
    }

    fn request(&self, using: Using, precision: Precision) -> ImageRequest {
        let row = |row: &Value| ImageRow {
            state: vec![number(&row["x_minus_delta"]), number(&row["dtheta"])],
            parameters: row["param_offsets"]
                .as_array()
                .expect("offsets")
                .iter()
                .map(number)
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
        let orders = MapOrders {
            smooth_order,
            contact_weight,
        };
        Expander::new(&self.scene, &self.orbit)
            .expect("rigid")
            .expand(orders)
            .expect("a simple graze")
    }

    /// Largest error of the offsets of one image over the rows whose depth is at most this.
    fn worst(&self, records: &[ImageRecord], deepest: f64) -> f64 {
        let error = |record: &ImageRecord| {
            let image = &self.rows()[record.row]["images"][record.iteration - 1];
            let truth = [number(&image["x_minus_delta"]), number(&image["dtheta"])];
            let difference = |(&ours, truth): (&Dd, Dd)| (ours - truth).to_f64().abs();
            record
                .offsets
                .iter()
                .zip(truth)
                .map(difference)
                .fold(0.0, f64::max)
        };
        let shallow = |record: &&ImageRecord| {
            number(&self.rows()[record.row]["x_minus_delta"]).to_f64() <= deepest
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
