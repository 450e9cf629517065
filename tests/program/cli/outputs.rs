//! Destinations of results, and input that is refused before anything is computed.

use std::fs;

use super::{grazemap, json, scratch, text};

/// Diagram of a scene without a grazing orbit: it ends with exit code 1 if anything is computed.
const NO_GRAZE: [&str; 5] = ["diagram", "scene.toml", "-q", "--set", "delta=-1"];

/// Folder with that scene, with obstacles to results, and with links.
fn obstacles() -> tempfile::TempDir {
    let folder = scratch();
    assert!(grazemap(folder.path(), &["new", "linear", "-o", "scene.toml"]).status.success());
    fs::create_dir(folder.path().join("folder")).expect("writable");
    fs::write(folder.path().join("file"), "mine").expect("writable");
    #[cfg(unix)]
    {
        std::os::unix::fs::symlink("scene.toml", folder.path().join("link")).expect("writable");
        std::os::unix::fs::symlink("new.json", folder.path().join("ahead")).expect("writable");
    }
    folder
}

#[test]
fn destinations_are_looked_at_before_anything_is_computed() {
    let folder = obstacles();
    let call = |more: &[&str]| {
        let output = grazemap(folder.path(), &[&NO_GRAZE, more].concat());
        (output.status.code(), text(&output.stderr))
    };
    assert_eq!(call(&["--json", "new.json", "--csv", "new.csv", "-o", "new/folder"]).0, Some(1));
    for (more, words) in [
        (["--json", "folder"], "cannot write folder: "),
        (["--csv", "nowhere/diagram.csv"], "cannot write nowhere/diagram.csv: "),
        (["-o", "file"], "cannot create folder file: "),
        (["-o", "file/inside"], "cannot create folder file/inside: "),
    ] {
        let (code, said) = call(&more);
        assert_eq!(code, Some(2), "{more:?}: {said}");
        assert!(said.contains(words), "{said}");
    }
    assert!(!folder.path().join("new").exists() && !folder.path().join("nowhere").exists());
}

#[test]
fn no_result_replaces_an_input_or_another_result() {
    let folder = obstacles();
    let scene = fs::read(folder.path().join("scene.toml")).expect("readable");
    let absolute = folder.path().join("new.json").display().to_string();
    let mut calls = vec![
        (vec!["--json", "scene.toml"], "scene.toml is read by this command"),
        (vec!["--csv", "./folder/../scene.toml"], "scene.toml is read by this command"),
        (vec!["--json", "new.json", "--csv", "./new.json"], "both write to new.json"),
        (vec!["--json", "new.json", "--csv", &absolute], "both write to new.json"),
    ];
    #[cfg(unix)]
    calls.extend([
        (vec!["--json", "link"], "scene.toml is read by this command"),
        (vec!["--json", "new.json", "--csv", "ahead"], "both write to new.json"),
    ]);
    for (more, words) in calls {
        let output = grazemap(folder.path(), &[&NO_GRAZE, &more[..]].concat());
        let said = text(&output.stderr);
        assert_eq!(output.status.code(), Some(2), "{more:?}: {said}");
        assert!(said.contains(words), "{said}");
    }
    assert_eq!(fs::read(folder.path().join("scene.toml")).expect("readable"), scene);
}

#[test]
fn neither_a_saved_atlas_nor_a_folder_of_results_replaces_an_input() {
    let folder = obstacles();
    let place = |name: &str| folder.path().join(name);
    fs::create_dir(place("out")).expect("writable");
    let scene = fs::read(place("scene.toml")).expect("readable");
    let inputs = ["scene.toml", "out/scene.toml", "out/images.csv", "out/fit.csv"];
    for input in inputs {
        fs::write(place(input), &scene).expect("writable");
    }
    let lost = ["--set", "delta=-1"];
    for (call, words) in [
        (&["atlas", "scene.toml", "--save", "scene.toml"][..], "scene.toml is read by"),
        (&["atlas", "scene.toml", "--save", "new", "--json", "./new"], "both write to"),
        (&["atlas", "scene.toml", "--save", "out/atlas.json", "-o", "out"], "both write to"),
        (&["atlas", "scene.toml", "--load", "out/atlas.csv", "-o", "out"], "cannot read"),
        (&["run", "out/scene.toml", "-o", "out"], "out/scene.toml is read by"),
        (&["image", "scene.toml", "--states", "out/images.csv", "-o", "out"], "is read by"),
        (
            &["fit", "scene.toml", "--data", "out/fit.csv", "--parameters", "alpha", "-o", "out"],
            "is read by",
        ),
    ] {
        let output = grazemap(folder.path(), &[call, &lost[..]].concat());
        let said = text(&output.stderr);
        assert_eq!(output.status.code(), Some(2), "{call:?}: {said}");
        assert!(said.contains(words), "{call:?}: {said}");
    }
    for input in inputs {
        assert_eq!(fs::read(place(input)).expect("readable"), scene, "{input}");
    }
    // An atlas may take the place of the one that it goes on from.
    let points = ["atlas", "linear", "-q", "--points", "5"];
    let save = |more: &[&str]| grazemap(folder.path(), &[&points, more].concat()).status.success();
    assert!(save(&["--save", "atlas"]) && save(&["--load", "atlas", "--save", "atlas"]));
}

#[cfg(unix)]
#[test]
fn a_file_that_does_not_fit_is_named_without_its_temporary_name() {
    let folder = scratch();
    // As on a full disk: no file may have more than one block.
    let script = "trap '' XFSZ; ulimit -f 1; exec \"$0\" expand linear -q \"$@\"";
    for to in [["--json", "map.json"], ["--csv", "map.csv"], ["-o", "out"]] {
        let mut shell = std::process::Command::new("sh");
        shell.args(["-c", script, env!("CARGO_BIN_EXE_grazemap")]).args(to);
        let output = shell.current_dir(folder.path()).output().expect("a shell");
        let said = text(&output.stderr);
        assert_eq!(output.status.code(), Some(2), "{to:?}: {said}");
        assert!(said.starts_with("error: cannot write ") && said.contains(&to[1][..3]), "{said}");
        assert!(!said.contains(".unfinished"), "{said}");
    }
}

#[cfg(unix)]
#[test]
fn a_scene_without_an_end_is_refused() {
    let output = grazemap(scratch().path(), &["check", "/dev/zero"]);
    assert_eq!(output.status.code(), Some(2));
    assert!(text(&output.stderr).contains("more than 1048576 bytes"));
}

#[cfg(unix)]
#[test]
fn a_link_stays_one_and_a_device_is_written_to() {
    use std::os::unix::fs::symlink;

    let folder = scratch();
    let place = |name: &str| folder.path().join(name);
    fs::write(place("orbit.json"), "old").expect("writable");
    symlink("orbit.json", place("link.json")).expect("writable");
    // NOTE: reached by links, so that a program that replaces its output replaces the links alone.
    symlink("/dev/null", place("nowhere.json")).expect("writable");
    symlink("/dev/full", place("full.json")).expect("writable");
    let locate = |name: &str| grazemap(folder.path(), &["locate", "linear", "-q", "--json", name]);

    assert!(locate("link.json").status.success());
    let written = fs::read_to_string(place("orbit.json")).expect("there");
    assert!(written.starts_with('{') && written.ends_with("}\n"), "{written}");
    assert!(locate("nowhere.json").status.success());
    let full = locate("full.json");
    assert_eq!(full.status.code(), Some(2));
    assert!(text(&full.stderr).starts_with("error: cannot write full.json: "));
    for link in ["link.json", "nowhere.json", "full.json"] {
        let entry = fs::symlink_metadata(place(link)).expect("there");
        assert!(entry.is_symlink(), "{link}");
    }
}

#[test]
fn an_observable_that_is_not_finite_is_said() {
    let folder = scratch();
    let diagram = |observe: &str| {
        let observe = format!("diagram.0.observe={observe}");
        let inside = "diagram.0.range=[-9e-4, -1e-4]";
        let set = ["--set", "diagram.0.points=3", "--set", inside, "--set", &observe];
        let output = grazemap(folder.path(), &[&["diagram", "linear"], &set[..]].concat());
        assert!(output.status.success(), "{}", text(&output.stderr));
        text(&output.stderr)
    };
    assert!(!diagram("sqrt(x)").contains("finite"));
    let said = diagram("log(-x)");
    assert!(
        said.contains("warning: `log(-x)` over alpha is not finite at 600 of 600 iterates"),
        "{said}"
    );
}

/// The scene `linear`, whose diagram names no method, with a chart beside it.
#[test]
fn diagrams_and_charts_are_guarded_unless_a_scene_says_otherwise() {
    let folder = scratch();
    let scene = grazemap::model::catalogue::text("linear").expect("in the catalogue");
    let chart = "[[chart]]\nparameters = [\"omega\", \"alpha\"]\n\
                 ranges = [[-1e-3, 1e-3], [-2e-3, 2e-3]]\npoints = 4\ntransient = 20\nkeep = 4\n";
    fs::write(folder.path().join("open.toml"), format!("{scene}\n{chart}")).expect("writable");
    let few = ["range=[-2e-3, 3e-3]", "points=6", "transient=40", "keep=8"];
    let few = few.map(|key| format!("diagram.0.{key}"));
    let few: Vec<&str> = few.iter().flat_map(|key| ["--set", key]).collect();
    let run = |command: &str, more: &[&str]| {
        let call = [&[command, "open.toml", "--csv", "-"], &few[..], more].concat();
        let output = grazemap(folder.path(), &call);
        assert!(output.status.success(), "{}", text(&output.stderr));
        (text(&output.stdout), text(&output.stderr))
    };
    for command in ["diagram", "chart"] {
        let (table, said) = run(command, &[]);
        assert!(!said.contains("leaves its window"), "{said}");
        let (header, rows) = table.split_once('\n').expect("a header");
        assert!(header.contains(",end,by_map,outside,"), "{header}");
        assert!(rows.lines().all(|row| row.contains(",guarded,")), "{rows}");
        assert!(rows.contains(",completed,1,0,") && rows.contains(",completed,0,1,"), "{rows}");
        let with = format!("{command}.0.with=[\"map\"]");
        let (table, said) = run(command, &["--set", &with]);
        assert!(table.contains(",outside,1,"), "{table}");
        let said: Vec<&str> =
            said.lines().filter(|line| line.contains("the map alone leaves its window")).collect();
        assert_eq!(said.len(), 1, "{said:?}");
        assert!(said[0].starts_with("warning: "), "{said:?}");
        assert!(said[0].contains("in grey") && said[0].contains("`with = [\"guarded\"]`"));
    }
}

/// A basin per method; options ask for one basin of their own.
#[test]
fn basins_that_a_scene_asks_for_are_made_without_options() {
    let folder = scratch();
    let scene = grazemap::model::catalogue::text("linear").expect("in the catalogue");
    let basin = "[[basin]]\nranges = [[-2e-4, 2e-4], [5e-4, 8e-4]]\npoints = [24, 20]\n\
                 at = { alpha = -5e-4 }\nmanifolds = 1\nwith = [\"map\", \"direct\"]\n";
    fs::write(folder.path().join("two.toml"), format!("{scene}\n{basin}")).expect("writable");
    let call =
        |more: &[&str]| grazemap(folder.path(), &[&["basin", "two.toml", "-q"], more].concat());
    let output = call(&["-o", "out"]);
    assert!(output.status.success(), "{}", text(&output.stderr));
    let file = |name: &str| fs::read_to_string(folder.path().join("out").join(name));
    for (number, method) in [(1, "map"), (2, "direct")] {
        let basin = file(&format!("basin-{number}.json")).expect("there");
        let basin: serde_json::Value = serde_json::from_str(&basin).expect("JSON");
        assert_eq!(basin["method"], method);
        assert_eq!(basin["parameters"][0]["offset"], -5e-4);
        assert_eq!(basin["manifolds"]["saddles"][0]["itinerary"], "1");
        let curves = file(&format!("manifolds-{number}.csv")).expect("there");
        let header = "manifold,itinerary,saddle,point,branch,piece,s,x,theta\nstable,1,1,1,+,1,0";
        assert!(curves.starts_with(header), "{}", &curves[..100]);
        assert!(folder.path().join(format!("out/basin-{number}.svg")).exists());
    }
    let several = call(&["--json", "-"]);
    assert_eq!(several.status.code(), Some(2));
    assert!(text(&several.stderr).contains("asks for 2 basins"), "{}", text(&several.stderr));
    let one = json(folder.path(), &["basin", "two.toml", "-q", "--points", "4", "--json", "-"]);
    assert_eq!(one["axes"][0]["offsets"].as_array().map(Vec::len), Some(4));
    assert_eq!(one["manifolds"], serde_json::Value::Null);
    // Equal for equal requests: the text alone holds the measured time.
    assert_eq!(one["timing"], serde_json::json!({"iterates": 0, "seconds": 0.0, "threads": 0}));
}

#[test]
fn an_observable_that_is_constant_up_to_rounding_costs_no_data() {
    let folder = scratch();
    let observe = "diagram.0.observe=1 + 3e-16*sin(100000*x)";
    let few = ["--set", "diagram.0.points=30", "--set", "diagram.0.transient=50", "-o", "out"];
    let call = [&["diagram", "linear", "--set", observe], &few[..]].concat();
    let output = grazemap(folder.path(), &call);
    assert!(output.status.success(), "{}", text(&output.stderr));
    for file in ["diagram.csv", "diagram.json", "diagram.npy", "diagram.svg", "diagram.png"] {
        assert!(folder.path().join("out").join(file).exists(), "{file}");
    }
}

#[test]
fn no_more_threads_work_than_there_are_cores() {
    let folder = scratch();
    let few = ["--set", "diagram.0.points=30", "--threads", "1000", "--json", "-"];
    let diagram = json(folder.path(), &[&["diagram", "linear"], &few[..]].concat());
    let threads = diagram[0]["sweeps"][0]["timing"]["threads"].as_u64().expect("a count");
    let cores = std::thread::available_parallelism().expect("a count of cores");
    assert!(threads as usize <= cores.get(), "{threads}");
}

#[test]
fn a_factor_that_was_not_measured_has_no_picture() {
    let folder = scratch();
    let away = [
        "--set",
        "expansion.smooth_order=2",
        "--set",
        "expansion.contact_weight=3",
        "--set",
        "section.kind=stroboscopic",
        "--set",
        "section.phase=0",
    ];
    let converge = ["converge", "linear", "-q", "--fresh", "1", "-o", "out"];
    let output = grazemap(folder.path(), &[&converge[..], &away[..]].concat());
    assert!(output.status.success(), "{}", text(&output.stderr));
    let study = fs::read_to_string(folder.path().join("out/convergence.json")).expect("there");
    let study: serde_json::Value = serde_json::from_str(&study).expect("JSON");
    for (name, factor) in [("contact", "discontinuity_rates"), ("smooth", "smooth_rates")] {
        let errors = &study[factor][0]["errors"];
        let measured = errors.as_array().is_some_and(|errors| !errors.is_empty());
        let picture = folder.path().join(format!("out/convergence-{name}.svg"));
        assert_eq!(picture.exists(), measured, "{name}");
    }
}

#[test]
fn a_page_speaks_of_the_graze_where_it_is_drawn_and_in_whole_sentences() {
    let folder = scratch();
    let run = ["run", "linear", "-q", "-o", "out"];
    let output = grazemap(folder.path(), &[&run[..], &super::QUICK[..]].concat());
    assert!(output.status.success(), "{}", text(&output.stderr));
    let page = fs::read_to_string(folder.path().join("out/report.html")).expect("there");
    let captions = page.split("<figcaption").skip(1);
    let captions: Vec<&str> =
        captions.filter_map(|rest| rest.split("</figcaption>").next()).collect();
    let of = |word: &str| captions.iter().find(|caption| caption.contains(word));
    let diagram = of("Bifurcation diagram").expect("a diagram was drawn");
    let lyapunov = of("Lyapunov").expect("exponents were drawn");
    assert!(diagram.contains("GR is the graze."), "{diagram}");
    assert!(lyapunov.contains("GR is the graze."), "{lyapunov}");
    assert!(page.contains("<p>At the edge of the window"));
    assert!(!page.contains("e0 times the scene"));
}

#[test]
fn one_thing_is_not_counted_as_several() {
    let folder = scratch();
    let said = |arguments: &[&str]| {
        let output = grazemap(folder.path(), arguments);
        assert!(output.status.success(), "{}", text(&output.stderr));
        text(&output.stdout)
    };
    let curve = "curve linear --with omega --from 1.8 --to 1.8";
    let curve: Vec<&str> = curve.split(' ').collect();
    assert!(said(&curve).starts_with("1 point; "));
    let emit = ["emit", "linear", "--target", "c", "-o", "out"];
    assert!(said(&emit).starts_with("wrote 1 file to out\n"));
    let check = said(&[&emit[..], &["--check"]].concat());
    assert_eq!(check, "out: 1 file as it would be emitted now\n");
}

#[test]
fn values_of_small_units_keep_their_digits() {
    let folder = scratch();
    let curve = "curve linear --with omega --from 1.9 --to 2.1 --set delta=1e-6 --set alpha=2.2e-6 --set grazing.guess.x=1e-6";
    let output = grazemap(folder.path(), &curve.split(' ').collect::<Vec<_>>());
    assert!(output.status.success(), "{}", text(&output.stderr));
    let said = text(&output.stdout);
    // The closed form of alpha at that graze: delta times |1 - omega^2 + 2 i zeta omega|. The
    // parameters that do not vary are left out.
    let zero = "xi_1 = 0 at alpha = 2.996664812754e-6, omega = 1.997498435544\n";
    assert!(said.contains(zero), "{said}");
}

#[test]
fn a_check_counts_diagrams_and_charts() {
    let folder = scratch();
    let check = super::json(folder.path(), &["check", "cantilever_3_5_soft", "--json", "-"]);
    assert_eq!((&check["diagrams"], &check["charts"]), (&2.into(), &1.into()));
}

#[test]
fn figures_have_the_size_resolution_and_kinds_that_are_asked_for() {
    let folder = scratch();
    let diagram = ["diagram", "linear", "--along", "alpha", "--points", "6", "--keep", "4", "-q"];
    let call = |more: &[&str]| grazemap(folder.path(), &[&diagram, more].concat());
    let form = ["--size", "84x60", "--dpi", "300", "--pdf", "-o", "out"];
    let output = call(&form);
    assert!(output.status.success(), "{}", text(&output.stderr));
    let read = |name: &str| fs::read(folder.path().join("out").join(name)).expect("written");
    // 84 mm are 317 CSS pixels, 991 of 300 and 238 of 72 to the inch.
    assert!(text(&read("diagram.svg")).contains("width=\"317\" height=\"227\""));
    assert_eq!(read("diagram.png")[16..24], [0, 0, 3, 0xdf, 0, 0, 2, 0xc5]);
    assert!(text(&read("diagram.pdf")).contains("/MediaBox [0 0 237.75 170.25]"));
    for (more, words) in [
        (&["--size", "84", "-o", "out"][..], "such as 84x60"),
        (&["--size", "84x2000", "-o", "out"], "from 42 to 1058 millimetres"),
        (&["--dpi", "5", "-o", "out"], "24..=1200"),
        (&["--pdf"], "--output <DIR>"),
    ] {
        let output = call(more);
        let said = text(&output.stderr);
        assert!(output.status.code() == Some(2) && said.contains(words), "{more:?}: {said}");
    }
}
