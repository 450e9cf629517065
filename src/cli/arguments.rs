//! Command line arguments: commands, options and the parsers of their values.

use std::mem;
use std::path::{Path, PathBuf};
use std::sync::{Arc, Mutex, PoisonError};

use clap::{Args, Parser, Subcommand};

use super::output::{CliError, Outlets};
use super::pieces;
use grazemap::Map;
use grazemap::analysis::{Pieces, Precision, Share, Using};
use grazemap::emission::Target;
use grazemap::model::Method;
use grazemap::pipeline::options::{METHODS, Words, one_of, positions, ranges, sizes};
use grazemap::pipeline::{
    AtlasKeys, BasinKeys, BranchKeys, BranchPlace, ContactKeys, ConvergenceKeys, Counting,
    DerivativesKeys, Device, Ends, FitKeys, LociKeys, NoiseKeys, OrbitsKeys, Position, SafeKeys,
    TrajectoryKeys,
};
use grazemap::report::Named;

/// Bifurcation analysis of oscillators that hit a stop
#[derive(Debug, Parser)]
#[command(name = "grazemap", version, args_conflicts_with_subcommands = true, max_term_width = 100)]
pub(super) struct Arguments {
    #[command(subcommand)]
    pub(super) command: Option<Command>,
    #[command(flatten)]
    pub(super) common: Common,
}

/// Commands. Each is carried out by a file of `commands`; a few of a kind share one.
#[derive(Debug, Subcommand)]
pub(super) enum Command {
    /// Run the built-in scene, a cantilever that hits a stop, from start to finish, into ./out
    Demo(Common),
    /// Do everything that the scene asks for and write a report page, into ./out by default
    Run(SceneOptions),
    /// Do the same as `run`, then open the report page in a browser
    View(SceneOptions),
    /// Copy a scene of the catalogue to a file, as a starting point
    New(NewOptions),
    /// Parse and check a scene without computing anything
    Check(SceneOptions),
    /// Find the grazing orbit and predict its bifurcation
    Locate(LocateArguments),
    /// Compute the state after hits, with its derivatives by the start and the parameters
    Derivatives(Asked<DerivativesKeys>),
    /// Find springs and dampers with a restitution, and the error of a rigid stop in their place
    Contact(ContactArguments),
    /// Tell whether the orbit is clear of every stop, and how far parameters may go
    Safe(Asked<SafeKeys>),
    /// Follow the grazing curve in two parameters, with its codimension-two points
    Curve(CurveArguments),
    /// Expand P_smooth, D and their composition, and print the coefficients
    Expand(SceneOptions),
    /// Write the map as source code: Rust, C, CUDA, JavaScript, Python, Julia, MATLAB or
    /// WebAssembly
    Emit(EmitArguments),
    /// Compute images of section points by the map, its parts or direct simulation
    Image(ImageOptions),
    /// Compare truncation orders with direct simulation: errors, speed and the cheapest map
    Converge(Asked<ConvergenceKeys>),
    /// Compute bifurcation diagrams
    Diagram(DiagramArguments),
    /// Compute two-parameter charts
    Chart(ChartArguments),
    /// Find periodic orbits by itinerary, with their stability, folds and flips
    Orbits(Asked<OrbitsKeys>),
    /// Follow branches of periodic orbits in one parameter, through folds, flips and grazes
    Branch(BranchArguments),
    /// Follow saddle-nodes, flips, Neimark-Sacker points and grazes in two parameters
    Loci(Asked<LociKeys>),
    /// Simulate the grazing orbit, a periodic orbit or any start: time series and phase portrait
    Trajectory(Asked<TrajectoryKeys>),
    /// Compute basins of attraction in a plane of the section
    Basin(BasinArguments),
    /// Make a map of a whole region about the grazing orbit, and measure it
    Atlas(AtlasArguments),
    /// Iterate with parameters drawn at random at every return, and count densities
    Noise(Asked<NoiseKeys>),
    /// Fit parameters to measured section points
    Fit(FitArguments),
    /// Recompute published figures and tables, and compare the numbers
    Gallery(GalleryOptions),
    /// Join the files of all shards of a command into its results
    Merge(MergeArguments),
    /// Print shell completions to standard output
    Completions(CompletionsOptions),
    /// Write the manual pages into a folder
    Man(ManOptions),
}

impl Arguments {
    /// Name of the command, its scene, its common options, and whether it has a table; `None` for
    /// commands without common options.
    fn outputs(&self) -> Option<(&'static str, Option<&Path>, &Common, bool)> {
        let (name, options, has_table) = match self.command.as_ref() {
            None => return Some(("demo", None, &self.common, false)),
            Some(Command::Demo(common)) => return Some(("demo", None, common, false)),
            Some(
                Command::New(_)
                | Command::Gallery(_)
                | Command::Merge(_)
                | Command::Completions(_)
                | Command::Man(_),
            ) => return None,
            Some(Command::Emit(options)) => {
                return Some(("emit", options.scene.as_deref(), &options.common, false));
            }
            Some(Command::Contact(options)) => {
                return Some(("contact", options.scene.as_deref(), &options.common, true));
            }
            Some(Command::Run(options)) => ("run", options, false),
            Some(Command::View(options)) => ("view", options, false),
            Some(Command::Check(options)) => ("check", options, false),
            Some(Command::Locate(options)) => ("locate", &options.scene, false),
            Some(Command::Safe(options)) => ("safe", &options.scene, true),
            Some(Command::Derivatives(options)) => ("derivatives", &options.scene, false),
            Some(Command::Curve(options)) => ("curve", &options.scene, true),
            Some(Command::Expand(options)) => ("expand", options, true),
            Some(Command::Image(options)) => ("image", &options.scene, true),
            Some(Command::Converge(options)) => ("converge", &options.scene, true),
            Some(Command::Diagram(options)) => ("diagram", &options.sweep.scene, true),
            Some(Command::Chart(options)) => ("chart", &options.sweep.scene, true),
            Some(Command::Orbits(options)) => ("orbits", &options.scene, true),
            Some(Command::Branch(options)) => ("branch", &options.scene, true),
            Some(Command::Loci(options)) => ("loci", &options.scene, true),
            Some(Command::Trajectory(options)) => ("trajectory", &options.scene, true),
            Some(Command::Basin(options)) => ("basin", &options.scene, true),
            Some(Command::Atlas(options)) => ("atlas", &options.scene, true),
            Some(Command::Noise(options)) => ("noise", &options.scene, true),
            Some(Command::Fit(options)) => ("fit", &options.scene, true),
        };
        Some((name, Some(&options.scene), &options.common, has_table))
    }

    /// Turns the arguments of a shard into those of the run that joins all shards. Returns whether
    /// they were the arguments of a shard.
    pub(super) fn join(&mut self, options: &MergeArguments, joined: Arc<Joined>) -> bool {
        let (scene, sharding) = match &mut self.command {
            Some(Command::Diagram(DiagramArguments { sweep, .. })) => {
                (&mut sweep.scene, &mut sweep.sharding)
            }
            Some(Command::Chart(ChartArguments { sweep, device, .. })) => {
                // Any machine will do: little is left to compute.
                Device::NAMES[0].clone_into(device);
                (&mut sweep.scene, &mut sweep.sharding)
            }
            Some(Command::Basin(basin)) => (&mut basin.scene, &mut basin.sharding),
            Some(Command::Branch(branch)) => (&mut branch.scene, &mut branch.sharding),
            Some(Command::Gallery(gallery)) => {
                gallery.output.clone_from(&options.outlets.output);
                (gallery.quiet, gallery.joined) = (options.outlets.quiet, Some(joined));
                return gallery.sharding.share.take().is_some();
            }
            _ => return false,
        };
        let (outlets, threads) = (options.outlets.clone(), options.threads);
        // The joined map already includes the overrides of `--set`.
        scene.common = Common { set: Vec::new(), outlets, threads, joined: Some(joined) };
        sharding.share.take().is_some()
    }

    /// Refuses, before any computing, a table for a command without one, and whatever
    /// [`Outlets::check`] refuses.
    pub(super) fn refuse_lost_output(&self) -> Result<(), CliError> {
        let Some((command, scene, common, has_table)) = self.outputs() else {
            return Ok(());
        };
        if common.outlets.csv.is_some() && !has_table {
            return Err(CliError::NoTable { command });
        }
        let mut saved = None;
        // Another input than the scene, and files of results in the folder of `-o` that would
        // replace an input. A saved orbit or map is written anew with its own content.
        let (states, results): (_, &[&str]) = match &self.command {
            Some(Command::Image(options)) => {
                (Some(options.states.as_path()), &["images.csv", "images.json"])
            }
            Some(Command::Fit(options)) => (Some(options.data.as_path()), &["fit.csv", "fit.json"]),
            Some(Command::Locate(options)) => match &options.from {
                Some(place) => (Some(&*place.path), &["orbit.json"]),
                None => (None, &[]),
            },
            Some(Command::Atlas(options)) => {
                saved = options.save.as_deref();
                // An atlas may take the place of the one that it goes on from.
                let load = options.load.as_deref().filter(|&load| saved != Some(load));
                (load, &["atlas.csv", "atlas.json"])
            }
            // The scene in the folder has the values of `--set`.
            Some(Command::Run(_) | Command::View(_)) if !common.set.is_empty() => {
                (None, &["scene.toml"])
            }
            // `--check` writes nothing into the folder.
            Some(Command::Emit(options)) if options.check => return Ok(()),
            _ => (None, &[]),
        };
        common.outlets.check(scene.into_iter().chain(states), saved, results)
    }
}

/// Options of every command that reads a scene.
#[derive(Clone, Debug, Default, Args)]
pub(super) struct Common {
    /// Override a parameter (`omega=1.9`) or a key (`expansion.smooth_order=7`); may be repeated
    #[arg(long = "set", value_name = "NAME=VALUE", value_parser = assignment)]
    pub(super) set: Vec<(String, String)>,
    #[command(flatten)]
    pub(super) outlets: Outlets,
    /// Number of threads, at most the number of cores. Default: all cores
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u16).range(1..=1024))]
    pub(super) threads: Option<u16>,
    /// Results of shards, where the command joins them.
    #[arg(skip)]
    pub(super) joined: Option<Arc<Joined>>,
}

impl Common {
    /// Whether no option is given.
    pub(super) fn asks_for_nothing(&self) -> bool {
        self.set.is_empty() && self.threads.is_none() && self.outlets.are_default()
    }

    /// Pieces that shards computed. Each is handed out once.
    pub(super) fn pieces(&self) -> Pieces {
        self.joined.as_deref().map(Joined::take).unwrap_or_default()
    }
}

/// Results of shards, and the map that they belong to.
#[derive(Debug)]
pub(super) struct Joined {
    pub(super) map: Option<Map>,
    pub(super) pieces: Mutex<Pieces>,
}

impl Joined {
    /// Pieces that shards computed. Each is handed out once.
    pub(super) fn take(&self) -> Pieces {
        mem::take(&mut self.pieces.lock().unwrap_or_else(PoisonError::into_inner))
    }
}

/// Share of a command's work.
#[derive(Clone, Debug, Default, Args)]
pub(super) struct Sharding {
    /// Compute only shard I of N and write its pieces into -o DIR (default: here) for `grazemap
    /// merge`; without I/N, the shard is this task of a Slurm job array
    #[arg(
        long = "shard",
        value_name = "I/N",
        num_args = 0..=1,
        default_missing_value = pieces::ARRAY,
        value_parser = pieces::share
    )]
    pub(super) share: Option<Share>,
}

/// Options of `diagram`, shared by `chart`.
#[derive(Clone, Debug, Args)]
pub(super) struct SweepArguments {
    #[command(flatten)]
    pub(super) scene: SceneOptions,
    #[command(flatten)]
    pub(super) sharding: Sharding,
}

/// Options of `diagram`.
#[derive(Clone, Debug, Args)]
pub(super) struct DiagramArguments {
    #[command(flatten)]
    pub(super) sweep: SweepArguments,
    /// Active parameter to sweep, in the place of the scene's diagrams
    #[arg(long, value_name = "P")]
    pub(super) along: Option<String>,
    /// First offset of the parameter from the graze, or with `@` its first value. Default: the
    /// window's
    #[arg(long, value_name = "A", requires = "along")]
    pub(super) from: Option<Position>,
    /// Last offset of the parameter, or with `@` its last value. Default: the window's
    #[arg(long, value_name = "B", requires = "along")]
    pub(super) to: Option<Position>,
    #[command(flatten)]
    pub(super) counting: Counting,
    /// Number of values of the parameter. Default: 1000
    #[arg(
        long,
        value_name = "N",
        requires = "along",
        value_parser = clap::value_parser!(u32).range(1..=10_000_000)
    )]
    pub(super) points: Option<u32>,
    /// Spacing of the values. Default: linear
    #[arg(long, requires = "along", value_parser = ["linear", "log"])]
    pub(super) scale: Option<String>,
    /// Direction of the sweep; the last state is carried on. Default: both
    #[arg(long, requires = "along", value_parser = ["up", "down", "both"])]
    pub(super) direction: Option<String>,
    #[command(flatten)]
    pub(super) iterates: Iterates,
}

/// Options of `chart`.
#[derive(Clone, Debug, Args)]
pub(super) struct ChartArguments {
    #[command(flatten)]
    pub(super) sweep: SweepArguments,
    /// The two active parameters, the horizontal one first, in the place of the scene's charts
    #[arg(long, value_name = "P,Q", value_delimiter = ',')]
    pub(super) plane: Vec<String>,
    /// First and last offset of each parameter from the graze, or with `@` its values. Default: the
    /// window's
    #[arg(long, value_name = "P=FROM:TO,...", value_parser = ranges, requires = "plane")]
    pub(super) range: Option<Named<Ends>>,
    #[command(flatten)]
    pub(super) counting: Counting,
    /// Number of cells along both parameters, or along each. Default: 200
    #[arg(
        long,
        value_name = "N[,M]",
        value_delimiter = ',',
        requires = "plane",
        value_parser = clap::value_parser!(u32).range(1..=10_000)
    )]
    pub(super) points: Vec<u32>,
    /// Cells that are computed: `all`, or `borders` (those along borders and probes of the blocks
    /// between; the others are filled). Default: all up to 10 000
    #[arg(long, requires = "plane", value_parser = ["all", "borders"])]
    pub(super) cells: Option<String>,
    /// Curves drawn over the chart
    #[arg(long, value_delimiter = ',', requires = "plane", value_parser = ["graze", "loci"])]
    pub(super) overlay: Vec<String>,
    #[command(flatten)]
    pub(super) iterates: Iterates,
    /// Device that iterates the map: `cpu`, or `cuda` for an NVIDIA GPU (identical results)
    #[arg(long, default_value = "cpu", value_parser = Device::NAMES)]
    pub(super) device: String,
}

/// Iterates of a diagram or chart that is asked for by options.
#[derive(Clone, Debug, Args)]
pub(super) struct Iterates {
    /// Methods that iterate states, each on its own. Default: guarded
    #[arg(long, value_parser = one_of(METHODS), value_delimiter = ',')]
    pub(super) method: Vec<Method>,
    /// Number of iterates left out before any is kept. Default: 1000
    #[arg(long, value_name = "N")]
    pub(super) transient: Option<u32>,
    /// Number of iterates kept. Default: 200 in a diagram, 32 in a chart
    #[arg(long, value_name = "N")]
    pub(super) keep: Option<u32>,
    /// Observable: of a diagram `h`, `impact_speed` or an expression of the states; of a chart
    /// period, itinerary, lyapunov or attractors
    #[arg(long, value_name = "WHAT")]
    pub(super) observe: Option<String>,
    /// Offsets of section coordinates at which the orbits start (0 if not named); may be repeated
    #[arg(long, value_name = "NAME=OFFSET,...", value_parser = positions)]
    pub(super) start: Vec<Named<Position>>,
    /// Number of starts spread over the window, in the place of --start
    #[arg(long, value_name = "N", conflicts_with = "start")]
    pub(super) starts: Option<u32>,
}

impl Iterates {
    /// The first option that is given.
    pub(super) fn given(&self) -> Option<&'static str> {
        let Self { method, transient, keep, observe, start, starts } = self;
        let given = [
            ("method", !method.is_empty()),
            ("transient", transient.is_some()),
            ("keep", keep.is_some()),
            ("observe", observe.is_some()),
            ("start", !start.is_empty()),
            ("starts", starts.is_some()),
        ];
        given.into_iter().find(|(_, is_given)| *is_given).map(|(name, _)| name)
    }
}

/// Options of `merge`.
#[derive(Clone, Debug, Args)]
pub(super) struct MergeArguments {
    /// Files that the shards wrote; all of them are needed
    #[arg(value_name = "PIECES", required = true)]
    pub(super) pieces: Vec<PathBuf>,
    #[command(flatten)]
    pub(super) outlets: Outlets,
    /// Number of threads for work that the shards left
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u16).range(1..=1024))]
    pub(super) threads: Option<u16>,
}

/// Scene and common options.
#[derive(Clone, Debug, Args)]
pub(super) struct SceneOptions {
    /// Scene file, name of a scene of the catalogue, saved orbit.json or map.json, or `-` to read a
    /// scene from standard input
    #[arg(value_name = "SCENE")]
    pub(super) scene: PathBuf,
    #[command(flatten)]
    pub(super) common: Common,
}

/// Options of a command on a scene: the keys of the library's function.
#[derive(Clone, Debug, Args)]
pub(super) struct Asked<K: Args> {
    #[command(flatten)]
    pub(super) scene: SceneOptions,
    #[command(flatten)]
    pub(super) keys: K,
}

/// Options of `locate`.
#[derive(Clone, Debug, Args)]
pub(super) struct LocateArguments {
    #[command(flatten)]
    pub(super) scene: SceneOptions,
    /// Locate the graze at a special point of a saved branch of the scene, such as `branch.json#3`
    #[arg(long, value_name = "FILE#N")]
    pub(super) from: Option<BranchPlace>,
    /// Also settle orbits on both sides of the graze, at 1/10 and 1/100 of the window, by guarded
    /// iteration, and compare them with the prediction; computes the map
    #[arg(long)]
    pub(super) measure: bool,
    /// Print all parameters with all digits, all xi_n and the one-contact orbits of the theory
    #[arg(long)]
    pub(super) all: bool,
}

/// Options of `contact`.
#[derive(Clone, Debug, Args)]
pub(super) struct ContactArguments {
    /// Scene file, name of a scene of the catalogue, saved orbit.json or map.json, or `-` to read a
    /// scene from standard input; without one, the impact of a mass alone
    #[arg(value_name = "SCENE")]
    pub(super) scene: Option<PathBuf>,
    #[command(flatten)]
    pub(super) keys: ContactKeys,
    #[command(flatten)]
    pub(super) common: Common,
}

/// Options of `curve`.
#[derive(Clone, Debug, Args)]
pub(super) struct CurveArguments {
    #[command(flatten)]
    pub(super) scene: SceneOptions,
    /// Second parameter of the curve
    #[arg(long, value_name = "P", required_unless_present_any = ["nearest", "with"])]
    pub(super) along: Option<String>,
    /// Second parameter of the curve, with values in `--from` and `--to`
    #[arg(long, value_name = "P", hide = true, conflicts_with = "along")]
    pub(super) with: Option<String>,
    /// First offset of the second parameter from the scene's value, or with `@` its first value
    #[arg(long, value_name = "A", required_unless_present = "nearest")]
    pub(super) from: Option<Position>,
    /// Last offset of the second parameter, or with `@` its last value
    #[arg(long, value_name = "B", required_unless_present = "nearest")]
    pub(super) to: Option<Position>,
    #[command(flatten)]
    pub(super) counting: Counting,
    /// Instead of a curve, find the smallest change of one or two parameters, from the scene's
    /// values, at which the orbit grazes
    #[arg(
        long,
        value_name = "P[,Q]",
        value_delimiter = ',',
        conflicts_with_all = ["along", "with", "from", "to", "xi"]
    )]
    pub(super) nearest: Vec<String>,
    /// Unit in which a change of each parameter is measured. Default: the parameter's value, or 1
    /// if that is 0
    #[arg(long, value_name = "P=SIZE,...", value_parser = sizes, requires = "nearest")]
    pub(super) scale: Option<Named<f64>>,
    /// Compute xi_1 to xi_N along the curve and find their zeros
    #[arg(
        long,
        value_name = "N",
        default_value_t = 1,
        value_parser = clap::value_parser!(u16).range(1..=64)
    )]
    pub(super) xi: u16,
}

/// Options of `emit`.
#[derive(Clone, Debug, Args)]
pub(super) struct EmitArguments {
    /// Scene file, name of a scene of the catalogue, saved orbit.json or map.json, or `-` to read a
    /// scene from standard input
    #[arg(value_name = "SCENE", required_unless_present = "catalogue")]
    pub(super) scene: Option<PathBuf>,
    /// Emit the crate with the maps of the whole catalogue
    #[arg(long, conflicts_with = "scene")]
    pub(super) catalogue: bool,
    /// Language of the emitted map
    #[arg(
        long,
        default_value = "rust",
        value_parser = one_of(TARGETS),
        conflicts_with = "catalogue"
    )]
    pub(super) target: Target,
    /// Check that the folder is up to date; write nothing
    #[arg(long)]
    pub(super) check: bool,
    /// Do not measure the map's error on the window against direct simulation
    #[arg(long)]
    pub(super) no_measure: bool,
    /// Measure the map's error on the window (the default)
    #[arg(long, hide = true, conflicts_with = "no_measure")]
    pub(super) measure: bool,
    #[command(flatten)]
    pub(super) common: Common,
}

/// Languages of an emitted map.
const TARGETS: Words<Target> = &[
    ("rust", Target::Rust, "A crate of Rust without dependencies"),
    ("c", Target::C, "A header for C99, C++ and shared libraries"),
    ("cuda", Target::Cuda, "The header's functions with CUDA kernels, one thread a point"),
    ("javascript", Target::JavaScript, "A module of JavaScript"),
    (
        "python",
        Target::Python,
        "A module of Python for numbers and NumPy arrays, which numba compiles",
    ),
    ("julia", Target::Julia, "A module of Julia"),
    ("matlab", Target::Matlab, "A function file of MATLAB and Octave"),
    ("wasm", Target::Wasm, "A module of WebAssembly"),
];

/// Options of `image`.
#[derive(Clone, Debug, Args)]
pub(super) struct ImageOptions {
    #[command(flatten)]
    pub(super) scene: SceneOptions,
    /// CSV file of starting points, or `-` for standard input. The header names section coordinates
    /// and active parameters; values are offsets from the graze
    #[arg(long, value_name = "CSV")]
    pub(super) states: PathBuf,
    /// Method that computes the images
    #[arg(long, alias = "using", default_value = "map", value_parser = one_of(USING))]
    pub(super) method: Using,
    /// Number of successive images per starting point
    #[arg(
        long,
        value_name = "K",
        default_value_t = 1,
        value_parser = clap::value_parser!(u32).range(1..=10_000_000)
    )]
    pub(super) iterations: u32,
    /// Number format of the computation
    #[arg(long, default_value = "f64", value_parser = one_of(PRECISIONS))]
    pub(super) precision: Precision,
}

/// Methods that compute an image.
const USING: Words<Using> = &[
    ("map", Using::Map, "The local map"),
    ("guarded", Using::Guarded, "The local map inside its window, direct simulation outside"),
    ("direct", Using::Direct, "Direct simulation"),
    ("smooth", Using::Smooth, "P_smooth alone"),
    ("discontinuity", Using::Discontinuity, "D alone"),
];

/// Number formats that an image is computed in.
const PRECISIONS: Words<Precision> = &[
    ("f32", Precision::F32, "Single precision, of the map or its parts"),
    ("f64", Precision::F64, "Double precision"),
    ("dd", Precision::Dd, "Double-double, about 32 digits"),
];

/// Options of `new`.
#[derive(Clone, Debug, Args)]
pub(super) struct NewOptions {
    /// Name of a scene of the catalogue
    #[arg(value_name = "NAME", required_unless_present = "list")]
    pub(super) name: Option<String>,
    /// List the scenes of the catalogue
    #[arg(long)]
    pub(super) list: bool,
    /// File to write. Default: NAME.toml
    #[arg(short = 'o', long = "output", value_name = "FILE", conflicts_with = "list")]
    pub(super) output: Option<PathBuf>,
    /// Print errors only
    #[arg(short = 'q', long = "quiet")]
    pub(super) quiet: bool,
}

/// Options of `gallery`.
#[derive(Clone, Debug, Args)]
pub(super) struct GalleryOptions {
    /// Entries, or papers (all their entries). Default: all
    #[arg(value_name = "NAME", conflicts_with = "list")]
    pub(super) names: Vec<String>,
    /// List the entries of the gallery
    #[arg(long)]
    pub(super) list: bool,
    /// Compute only the entries that take seconds
    #[arg(long)]
    pub(super) small: bool,
    /// Compare the numbers of the entries with few points; no pictures and no page
    #[arg(long, conflicts_with_all = ["small", "list"])]
    pub(super) numbers: bool,
    /// Folder for the page and all results. Default: out/gallery
    #[arg(short = 'o', long = "output", value_name = "DIR")]
    pub(super) output: Option<PathBuf>,
    /// Print errors only
    #[arg(short = 'q', long = "quiet")]
    pub(super) quiet: bool,
    #[command(flatten)]
    pub(super) sharding: Sharding,
    /// Results of shards, where the command joins them.
    #[arg(skip)]
    pub(super) joined: Option<Arc<Joined>>,
}

/// Options of `completions`.
#[derive(Clone, Debug, Args)]
pub(super) struct CompletionsOptions {
    /// Shell to complete in
    #[arg(value_enum, value_name = "SHELL")]
    pub(super) shell: clap_complete::Shell,
}

/// Options of `man`.
#[derive(Clone, Debug, Args)]
pub(super) struct ManOptions {
    /// Folder for the pages, such as ~/.local/share/man/man1
    #[arg(short = 'o', long = "output", value_name = "DIR")]
    pub(super) output: PathBuf,
}

/// Options of `branch`.
#[derive(Clone, Debug, Args)]
pub(super) struct BranchArguments {
    #[command(flatten)]
    pub(super) scene: SceneOptions,
    #[command(flatten)]
    pub(super) keys: BranchKeys,
    #[command(flatten)]
    pub(super) sharding: Sharding,
}

/// Options of `basin`.
#[derive(Clone, Debug, Args)]
pub(super) struct BasinArguments {
    #[command(flatten)]
    pub(super) scene: SceneOptions,
    #[command(flatten)]
    pub(super) keys: BasinKeys,
    #[command(flatten)]
    pub(super) sharding: Sharding,
}

/// Options of `atlas`.
#[derive(Clone, Debug, Args)]
pub(super) struct AtlasArguments {
    #[command(flatten)]
    pub(super) scene: SceneOptions,
    #[command(flatten)]
    pub(super) keys: AtlasKeys,
    /// Write the atlas to a file, from which --load goes on; it may be the file of --load
    #[arg(long, value_name = "FILE")]
    pub(super) save: Option<PathBuf>,
    /// Go on with the atlas in a file that --save wrote for this scene, in its region and with its
    /// settings
    #[arg(long, value_name = "FILE")]
    pub(super) load: Option<PathBuf>,
}

/// Options of `fit`.
#[derive(Clone, Debug, Args)]
pub(super) struct FitArguments {
    #[command(flatten)]
    pub(super) scene: SceneOptions,
    /// CSV file of measured section points, or `-` for standard input. The header names section
    /// coordinates; a cell is an offset from the graze, and empty where nothing was measured. A
    /// column `series` tells series apart; a column of an active parameter holds what is known to
    /// be added to it
    #[arg(long, value_name = "CSV")]
    pub(super) data: PathBuf,
    #[command(flatten)]
    pub(super) keys: FitKeys,
}

/// Parses `name=value`, split at the first `=`.
fn assignment(text: &str) -> Result<(String, String), String> {
    match text.split_once('=') {
        Some((name, value)) if !name.trim().is_empty() => {
            Ok((name.trim().to_owned(), value.trim().to_owned()))
        }
        _ => Err("expected NAME=VALUE".to_owned()),
    }
}
