//! Command line arguments: commands, options and the parsers of their values.

use std::mem;
use std::path::{Path, PathBuf};
use std::str::FromStr;
use std::sync::{Arc, Mutex, PoisonError};

use clap::builder::{PossibleValue, PossibleValuesParser, TypedValueParser};
use clap::{ArgGroup, Args, Parser, Subcommand};

use super::output::{CliError, Outlets};
use super::pieces;
use super::positions::{Counting, Finite, Origin, Position, Positive};
use grazemap::Map;
use grazemap::analysis::branches::BranchObservable;
use grazemap::analysis::fit::FitRequest;
use grazemap::analysis::loci::LocusKind;
use grazemap::analysis::noise::NoiseLaw;
use grazemap::analysis::{Pieces, Precision, Share, Using};
use grazemap::emission::Target;
use grazemap::model::Method;
use grazemap::pipeline::{AtlasKeys, BranchPlace, Device, OrbitsOf, TrajectoryKeys};
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
    Derivatives(DerivativesArguments),
    /// Find springs and dampers with a restitution, and the error of a rigid stop in their place
    Contact(ContactArguments),
    /// Tell whether the orbit is clear of the stop, and how far parameters may go
    Safe(SafeArguments),
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
    Converge(ConvergeOptions),
    /// Compute bifurcation diagrams
    Diagram(DiagramArguments),
    /// Compute two-parameter charts
    Chart(ChartArguments),
    /// Find periodic orbits by itinerary, with their stability, folds and flips
    Orbits(OrbitsArguments),
    /// Follow branches of periodic orbits in one parameter, through folds, flips and grazes
    Branch(BranchArguments),
    /// Follow saddle-nodes, flips, Neimark-Sacker points and grazes in two parameters
    Loci(LociArguments),
    /// Simulate the grazing orbit, a periodic orbit or any start: time series and phase portrait
    Trajectory(TrajectoryArguments),
    /// Compute basins of attraction in a plane of the section
    Basin(BasinArguments),
    /// Make a map of a whole region about the grazing orbit, and measure it
    Atlas(AtlasArguments),
    /// Iterate with parameters drawn at random at every return, and count densities
    Noise(NoiseArguments),
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
    #[arg(long, value_name = "P=FROM:TO,...", value_parser = Ranges::parse, requires = "plane")]
    pub(super) range: Option<Ranges>,
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

/// Options of `converge`.
#[derive(Clone, Debug, Args)]
pub(super) struct ConvergeOptions {
    #[command(flatten)]
    pub(super) scene: SceneOptions,
    /// Number of new points at which the chosen map is compared with direct simulation
    #[arg(
        long,
        value_name = "N",
        default_value_t = 1000,
        value_parser = clap::value_parser!(u32).range(1..=1_000_000)
    )]
    pub(super) fresh: u32,
}

/// Options of `derivatives`.
#[derive(Clone, Debug, Args)]
pub(super) struct DerivativesArguments {
    #[command(flatten)]
    pub(super) scene: SceneOptions,
    /// States and phase at the start (0 if not named)
    #[arg(long, value_name = "NAME=VALUE,...", value_parser = values)]
    pub(super) start: Option<Named<f64>>,
    /// Time after which the derivatives are taken
    #[arg(long, value_name = "T", conflicts_with = "returns")]
    pub(super) time: Option<Positive>,
    /// Forcing periods after which the derivatives are taken, those of the return by the phase
    #[arg(
        long,
        value_name = "K",
        default_value_t = 1,
        value_parser = clap::value_parser!(u32).range(1..=1_000_000)
    )]
    pub(super) returns: u32,
    /// Parameters by which derivatives are taken. Default: the active ones of the scene
    #[arg(long, value_name = "P,...", value_delimiter = ',')]
    pub(super) parameters: Vec<String>,
    /// Highest order of the derivatives, from 1 to 8
    #[arg(
        long,
        value_name = "N",
        default_value_t = 1,
        value_parser = clap::value_parser!(u32).range(1..=8)
    )]
    pub(super) order: u32,
}

/// Options of `contact`.
#[derive(Clone, Debug, Args)]
pub(super) struct ContactArguments {
    /// Scene file, name of a scene of the catalogue, saved orbit.json or map.json, or `-` to read a
    /// scene from standard input; without one, the impact of a mass alone
    #[arg(value_name = "SCENE")]
    pub(super) scene: Option<PathBuf>,
    /// Restitution that the stops have at the speed, from 0.01 to 1
    #[arg(long, value_name = "R")]
    pub(super) restitution: Finite,
    /// Contact time at the speed. Default: a hundredth of the period of the grazing orbit; 1
    /// without a scene
    #[arg(long, value_name = "T", conflicts_with = "stiffness")]
    pub(super) time: Option<Finite>,
    /// Stiffness of the spring, in the place of the contact time
    #[arg(long, value_name = "K")]
    pub(super) stiffness: Option<Finite>,
    /// Speed at which the stops have the restitution. Default: a tenth of the largest normal speed
    /// along the grazing orbit; 1 without a scene
    #[arg(long, value_name = "V")]
    pub(super) speed: Option<Finite>,
    /// Exponent of the spring of laws that are not linear, from 0.1 to 20
    #[arg(long, value_name = "P", default_value = "1.5")]
    pub(super) exponent: Finite,
    /// Effective mass; with 1, stiffness and damper are those of an acceleration
    #[arg(long, value_name = "M", default_value = "1")]
    pub(super) mass: Finite,
    #[command(flatten)]
    pub(super) common: Common,
}

/// Options of `safe`.
#[derive(Clone, Debug, Args)]
pub(super) struct SafeArguments {
    #[command(flatten)]
    pub(super) scene: SceneOptions,
    /// Tolerances of parameters, relative to their values; a box that is looked at as a whole
    #[arg(long, value_name = "P=5%,...", value_parser = shares)]
    pub(super) tolerance: Option<Named<f64>>,
    /// Number of starts along each axis from which direct simulation looks for other attractors; 0:
    /// none
    #[arg(
        long,
        value_name = "N",
        default_value_t = 16,
        value_parser = clap::value_parser!(u32).range(0..=31)
    )]
    pub(super) points: u32,
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

/// Options of `orbits`.
#[derive(Clone, Debug, Args)]
#[command(group = ArgGroup::new("kinds").args(["fold", "flip"]).multiple(true))]
pub(super) struct OrbitsArguments {
    #[command(flatten)]
    pub(super) scene: SceneOptions,
    /// Offsets of active parameters from the graze (0 if not named); may be repeated. Default: a
    /// tenth of the window, on both sides of the graze
    #[arg(long, value_name = "NAME=OFFSET,...", value_parser = positions)]
    pub(super) at: Vec<Named<Position>>,
    #[command(flatten)]
    pub(super) counting: Counting,
    /// Search all itineraries of up to N returns. Default: 4 returns, or 4 passages where a return
    /// has several
    #[arg(
        long,
        value_name = "N",
        conflicts_with = "itinerary",
        value_parser = clap::value_parser!(u8).range(1..=12)
    )]
    pub(super) period: Option<u8>,
    #[command(flatten)]
    pub(super) which: WhichOrbits,
    /// Also find folds (saddle-nodes)
    #[arg(long)]
    pub(super) fold: bool,
    /// Also find flips (period-doublings)
    #[arg(long)]
    pub(super) flip: bool,
    /// Parameter that folds and flips are solved for; if two are given, the first is stepped
    /// through. Default: the first active parameter that is adjusted to graze
    #[arg(long, alias = "in", value_name = "[P,]Q", value_delimiter = ',', requires = "kinds")]
    pub(super) plane: Vec<String>,
    /// First offset of the parameter that is stepped through. Default: the edge of the window
    #[arg(long, value_name = "A", requires = "plane")]
    pub(super) from: Option<Position>,
    /// Last offset of that parameter. Default: the edge of the window
    #[arg(long, value_name = "B", requires = "plane")]
    pub(super) to: Option<Position>,
    /// Number of offsets
    #[arg(
        long,
        value_name = "N",
        default_value_t = 21,
        requires = "plane",
        value_parser = clap::value_parser!(u16).range(2..=10_000)
    )]
    pub(super) points: u16,
}

/// Options of `branch`.
#[derive(Clone, Debug, Args)]
pub(super) struct BranchArguments {
    #[command(flatten)]
    pub(super) scene: SceneOptions,
    /// Active parameter that varies along the branches
    #[arg(long, value_name = "P")]
    pub(super) along: String,
    #[command(flatten)]
    pub(super) stretch: Stretch,
    /// Search all itineraries of up to N returns, and follow period-doubled branches up to N
    /// returns. Default: 4 returns, or 4 passages where a return has several
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u8).range(1..=12))]
    pub(super) period: Option<u8>,
    #[command(flatten)]
    pub(super) which: WhichOrbits,
    /// Offsets of section coordinates (0 if not named) of a further start from which direct
    /// simulation searches for orbits; may be repeated. `basin` can supply such starts
    #[arg(long, value_name = "NAME=OFFSET,...", value_parser = positions)]
    pub(super) start: Vec<Named<Position>>,
    /// Quantities to compute for every orbit; each adds a column and a picture
    #[arg(long, value_name = "NAME,...", value_parser = one_of(OBSERVABLES), value_delimiter = ',')]
    pub(super) observe: Vec<BranchObservable>,
    #[command(flatten)]
    pub(super) sharding: Sharding,
}

/// Interval of one parameter, the others held: options of `branch` and `loci`.
#[derive(Clone, Debug, Args)]
pub(super) struct Stretch {
    /// First offset of the parameter from the graze. Default: the edge of the window
    #[arg(long, value_name = "A")]
    pub(super) from: Option<Position>,
    /// Last offset of the parameter from the graze. Default: the edge of the window
    #[arg(long, value_name = "B")]
    pub(super) to: Option<Position>,
    /// Offsets of further active parameters from the graze (0 if not named)
    #[arg(long, value_name = "NAME=OFFSET,...", value_parser = positions)]
    pub(super) at: Option<Named<Position>>,
    #[command(flatten)]
    pub(super) counting: Counting,
}

impl Stretch {
    /// Offsets of the ends of the interval of a parameter.
    pub(super) fn range(&self, origin: &Origin<'_>, along: &str) -> [Option<f64>; 2] {
        origin.range(along, [self.from, self.to])
    }

    /// Offsets of further parameters.
    pub(super) fn at(&self, origin: &Origin<'_>) -> Named<f64> {
        origin.named(self.at.as_ref())
    }
}

/// Method and itineraries of the orbits: options of `orbits`, `branch` and `loci`.
#[derive(Clone, Debug, Args)]
pub(super) struct WhichOrbits {
    /// Orbits with these contacts only: 1 for contact, 0 for none, passage by passage and return by
    /// return (`100`); may be repeated. Default: all itineraries of short periods
    #[arg(long, value_name = "DIGITS")]
    pub(super) itinerary: Vec<String>,
    /// Method that computes the orbits
    #[arg(long, alias = "using", default_value = "map", value_parser = one_of(ORBITS_OF))]
    pub(super) method: OrbitsOf,
}

/// Quantities observed on the orbits of a branch.
const OBSERVABLES: Words<BranchObservable> = &[
    ("h", BranchObservable::Gap, "The event function at the first section point"),
    ("impact_speed", BranchObservable::ImpactSpeed, "The largest impact speed"),
    ("contact_time", BranchObservable::ContactTime, "Time in contact per period of the orbit"),
    (
        "amplitude",
        BranchObservable::Amplitude,
        "Half of the range of the event function along the orbit",
    ),
];

/// Methods that compute periodic orbits.
const ORBITS_OF: Words<OrbitsOf> =
    &[("map", OrbitsOf::Map, "The local map"), ("direct", OrbitsOf::Direct, "Direct simulation")];

/// Options of `loci`.
#[derive(Clone, Debug, Args)]
pub(super) struct LociArguments {
    #[command(flatten)]
    pub(super) scene: SceneOptions,
    /// The two active parameters of the plane
    #[arg(long, alias = "in", value_name = "P,Q", value_delimiter = ',', required = true)]
    pub(super) plane: Vec<String>,
    #[command(flatten)]
    pub(super) stretch: Stretch,
    /// Kinds of loci to follow. Default: all but crises
    #[arg(long, value_name = "KIND,...", value_parser = one_of(LOCI), value_delimiter = ',')]
    pub(super) kind: Vec<LocusKind>,
    #[command(flatten)]
    pub(super) which: WhichOrbits,
}

/// Kinds of loci.
const LOCI: Words<LocusKind> = &[
    ("GR|graze", LocusKind::Graze, "The orbit grazes"),
    ("SN|fold", LocusKind::Fold, "Saddle-nodes (folds)"),
    ("PD|flip", LocusKind::Flip, "Period-doublings (flips)"),
    ("NS|torus", LocusKind::Torus, "Neimark-Sacker points (tori)"),
    ("crisis", LocusKind::Crisis, "An attractor touches the stable manifold of a saddle"),
];

/// Options of `trajectory`.
#[derive(Clone, Debug, Args)]
pub(super) struct TrajectoryArguments {
    #[command(flatten)]
    pub(super) scene: SceneOptions,
    /// Offsets of active parameters from the graze (0 if not named)
    #[arg(long, value_name = "NAME=OFFSET,...", value_parser = positions)]
    pub(super) at: Option<Named<Position>>,
    #[command(flatten)]
    pub(super) counting: Counting,
    /// Start at these offsets of section coordinates (0 if not named). Default: on the grazing
    /// orbit
    #[arg(long, value_name = "NAME=OFFSET,...", value_parser = positions)]
    pub(super) start: Option<Named<Position>>,
    /// Start on the periodic orbit with this itinerary: 1 for contact, 0 for none, passage by
    /// passage and return by return
    #[arg(long, value_name = "DIGITS", conflicts_with = "start")]
    pub(super) itinerary: Option<String>,
    /// Returns to the section that are simulated first and not written, so that the orbit settles
    #[arg(
        long,
        value_name = "K",
        default_value_t = 0,
        value_parser = clap::value_parser!(u32).range(0..=10_000_000)
    )]
    pub(super) settle: u32,
    /// Number of periods of the orbit to simulate, or of returns to the section if the start is not
    /// a periodic orbit
    #[arg(
        long,
        value_name = "K",
        default_value_t = 1,
        value_parser = clap::value_parser!(u32).range(1..=10_000_000)
    )]
    pub(super) periods: u32,
    /// Write the derivatives of the state at the end, by the state at the start and the active
    /// parameters, to this order (1 to 8) in the place of rows
    #[arg(
        long,
        value_name = "N",
        conflicts_with = "settle",
        value_parser = clap::value_parser!(u32).range(1..=8)
    )]
    pub(super) derivatives: Option<u32>,
    /// Number of rows per return to the section, evenly spaced in time; events add rows
    #[arg(
        long,
        value_name = "N",
        default_value_t = TrajectoryKeys::SAMPLES,
        value_parser = clap::value_parser!(u32).range(1..=1_000_000)
    )]
    pub(super) samples: u32,
}

/// Options of `basin`.
#[derive(Clone, Debug, Args)]
pub(super) struct BasinArguments {
    #[command(flatten)]
    pub(super) scene: SceneOptions,
    /// Offsets of active parameters from the graze (0 if not named)
    #[arg(long, value_name = "NAME=OFFSET,...", value_parser = positions)]
    pub(super) at: Option<Named<Position>>,
    #[command(flatten)]
    pub(super) counting: Counting,
    /// Section coordinates that span the plane, the horizontal one first. Default: the first two
    #[arg(long, alias = "axes", value_name = "A,B", value_delimiter = ',')]
    pub(super) plane: Vec<String>,
    /// First and last offset along an axis. Default: the window of the map
    #[arg(long, value_name = "NAME=FROM:TO,...", value_parser = Ranges::parse)]
    pub(super) range: Option<Ranges>,
    /// Number of cells along both axes, or along each. Default: 400
    #[arg(
        long,
        value_name = "N[,M]",
        value_delimiter = ',',
        value_parser = clap::value_parser!(u32).range(1..=10_000)
    )]
    pub(super) points: Vec<u32>,
    /// Cells that are computed: `all`, or `borders` (those along borders and probes of the blocks
    /// between; the others are filled). Default: borders
    #[arg(long, value_parser = ["all", "borders"])]
    pub(super) cells: Option<String>,
    /// Offsets of the other section coordinates (0 if not named)
    #[arg(long, value_name = "NAME=OFFSET,...", value_parser = positions)]
    pub(super) start: Option<Named<Position>>,
    /// Method that iterates the states. Default: guarded
    #[arg(long, alias = "with", value_parser = one_of(METHODS))]
    pub(super) method: Option<Method>,
    /// Also compute stable and unstable manifolds of saddles of up to N returns, as curves; needs a
    /// section of two coordinates
    #[arg(
        long,
        value_name = "N",
        num_args = 0..=1,
        default_missing_value = "2",
        value_parser = clap::value_parser!(u8).range(1..=12)
    )]
    pub(super) manifolds: Option<u8>,
    #[command(flatten)]
    pub(super) sharding: Sharding,
}

impl BasinArguments {
    /// Whether the options ask for a basin of their own, in the place of the scene's.
    pub(super) fn names_any(&self) -> bool {
        let named = self.at.is_some() || self.range.is_some() || self.start.is_some();
        let listed = !self.plane.is_empty() || !self.points.is_empty();
        let chosen = self.cells.is_some() || self.method.is_some();
        named || listed || chosen || self.manifolds.is_some()
    }
}

/// Options of `atlas`.
#[derive(Clone, Debug, Args)]
pub(super) struct AtlasArguments {
    #[command(flatten)]
    pub(super) scene: SceneOptions,
    /// First and last offset of states, and of parameters that become coordinates, from the
    /// grazing orbit at the phase, or with `@` their values. Default: states within a twentieth of
    /// their extent along the orbit
    #[arg(
        long,
        value_name = "NAME=FROM:TO,...",
        value_parser = Ranges::parse,
        conflicts_with = "load"
    )]
    pub(super) range: Option<Ranges>,
    /// Offsets of parameters that are fixed (0 if not named)
    #[arg(
        long,
        value_name = "NAME=OFFSET,...",
        value_parser = positions,
        conflicts_with = "load"
    )]
    pub(super) at: Option<Named<Position>>,
    #[command(flatten)]
    pub(super) counting: Counting,
    /// Phase of the section. Default: the scene's, or the phase farthest from all stops
    #[arg(long, value_name = "PHASE", conflicts_with = "load")]
    pub(super) phase: Option<Finite>,
    /// Largest error, in widths of the region. Default: 1e-6
    #[arg(long, value_name = "E", conflicts_with = "load")]
    pub(super) tolerance: Option<Finite>,
    /// Order of the polynomials, from 3 to 20. Default: 6
    #[arg(
        long,
        value_name = "N",
        conflicts_with = "load",
        value_parser = clap::value_parser!(u32).range(3..=20)
    )]
    pub(super) order: Option<u32>,
    /// Most halvings of a box; smaller boxes are simulated. Default: 20
    #[arg(
        long,
        value_name = "N",
        conflicts_with = "load",
        value_parser = clap::value_parser!(u32).range(0..=60)
    )]
    pub(super) depth: Option<u32>,
    /// Most boxes that are expanded, from here on; points of other boxes are simulated
    #[arg(
        long,
        value_name = "N",
        default_value_t = AtlasKeys::BOXES,
        value_parser = clap::value_parser!(u32).range(0..=100_000_000)
    )]
    pub(super) boxes: u32,
    /// Number of points at which the atlas is made and compared with direct simulation
    #[arg(
        long,
        value_name = "N",
        default_value_t = AtlasKeys::POINTS,
        value_parser = clap::value_parser!(u32).range(1..=10_000_000)
    )]
    pub(super) points: u32,
    /// Write the atlas to a file, from which --load goes on; it may be the file of --load
    #[arg(long, value_name = "FILE")]
    pub(super) save: Option<PathBuf>,
    /// Go on with the atlas in a file that --save wrote for this scene, in its region and with its
    /// settings
    #[arg(long, value_name = "FILE")]
    pub(super) load: Option<PathBuf>,
}

/// Options of `noise`.
#[derive(Clone, Debug, Args)]
pub(super) struct NoiseArguments {
    #[command(flatten)]
    pub(super) scene: SceneOptions,
    /// Standard deviations of active parameters
    #[arg(long, value_name = "P=SIZE,...", value_parser = sizes)]
    pub(super) deviation: Named<f64>,
    /// Means of active parameters, as offsets from the graze (0 if not named)
    #[arg(long, value_name = "P=OFFSET,...", value_parser = positions)]
    pub(super) at: Option<Named<Position>>,
    #[command(flatten)]
    pub(super) counting: Counting,
    /// Distribution of the parameters
    #[arg(long, default_value = "normal", value_parser = one_of(LAWS))]
    pub(super) law: NoiseLaw,
    /// Offsets of section coordinates at which the orbits start (0 if not named)
    #[arg(long, value_name = "NAME=OFFSET,...", value_parser = positions)]
    pub(super) start: Option<Named<Position>>,
    /// Number of orbits
    #[arg(long, value_name = "N", default_value_t = 1000)]
    pub(super) orbits: u32,
    /// Number of returns before counting begins
    #[arg(long, value_name = "N", default_value_t = 100)]
    pub(super) transient: u32,
    /// Number of returns counted
    #[arg(long, value_name = "N", default_value_t = 1000)]
    pub(super) keep: u32,
    /// First and last offset of a coordinate. Default: the window's
    #[arg(long, value_name = "NAME=FROM:TO,...", value_parser = Ranges::parse)]
    pub(super) range: Option<Ranges>,
    /// Number of cells along every coordinate
    #[arg(
        long,
        value_name = "N",
        default_value_t = 100,
        value_parser = clap::value_parser!(u32).range(1..=1_000_000)
    )]
    pub(super) cells: u32,
    /// Seed of the random numbers; equal seeds give equal results
    #[arg(long, value_name = "N", default_value_t = 0)]
    pub(super) seed: u64,
    /// Method that computes returns
    #[arg(long, default_value = "guarded", value_parser = one_of(METHODS))]
    pub(super) method: Method,
}

/// Distributions of parameters under noise.
const LAWS: Words<NoiseLaw> = &[
    ("normal", NoiseLaw::Normal, "Normal distribution"),
    ("uniform", NoiseLaw::Uniform, "Uniform distribution of the same standard deviation"),
];

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
    /// Active parameters to fit
    #[arg(long, value_name = "P,...", value_delimiter = ',', required = true)]
    pub(super) parameters: Vec<String>,
    /// Offsets of active parameters from the graze (0 if not named); the fit starts there
    #[arg(long, value_name = "P=OFFSET,...", value_parser = positions)]
    pub(super) at: Option<Named<Position>>,
    #[command(flatten)]
    pub(super) counting: Counting,
    /// Standard deviation of the measurement of every coordinate. Default: that of the residuals
    #[arg(long, value_name = "NAME=SIZE,...", value_parser = sizes)]
    pub(super) noise: Option<Named<f64>>,
    /// Number of returns in a piece, which has a start of its own; 0: a series is one piece
    #[arg(long, value_name = "N", default_value_t = FitRequest::PIECE as u32)]
    pub(super) piece: u32,
    /// Number of points at the end of every series that are predicted instead of fitted
    #[arg(long, value_name = "N", default_value_t = 0)]
    pub(super) withheld: u32,
    /// Method that computes returns
    #[arg(long, default_value = "guarded", value_parser = one_of(METHODS))]
    pub(super) method: Method,
}

/// Methods that iterate states.
const METHODS: Words<Method> = &[
    ("map", Method::Map, "The local map"),
    ("guarded", Method::Guarded, "The local map inside its window, direct simulation outside"),
    ("direct", Method::Direct, "Direct simulation"),
];

/// Intervals by name.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Ranges(Named<[Position; 2]>);

impl Ranges {
    /// Parses `name=from:to,name=from:to`.
    fn parse(text: &str) -> Result<Self, String> {
        let range = |range: &str| {
            let (name, ends) = range.split_once('=').ok_or("expected NAME=FROM:TO")?;
            let (from, to) = ends.split_once(':').ok_or("expected NAME=FROM:TO")?;
            Ok((name.trim().to_owned(), [from.parse()?, to.parse()?]))
        };
        Ok(Self(Named(text.split(',').map(range).collect::<Result<_, String>>()?)))
    }

    /// Offsets of both ends of each interval.
    pub(super) fn offsets(&self, origin: &Origin<'_>) -> Named<[f64; 2]> {
        let ends = |(name, ends): &(String, [Position; 2])| {
            (name.clone(), ends.map(|end| origin.offset(name, end)))
        };
        Named(self.0.0.iter().map(ends).collect())
    }
}

/// Words of an option, each with its value and its help text. Older spellings follow a word after
/// `|`.
type Words<T> = &'static [(&'static str, T, &'static str)];

/// Parser that accepts these words, in any case, and returns the value of the word given.
fn one_of<T: Copy + Send + Sync>(words: Words<T>) -> impl TypedValueParser<Value = T> {
    let known = words.iter().map(|&(spellings, _, help)| {
        let mut spellings = spellings.split('|');
        let word = spellings.next().unwrap_or_default();
        PossibleValue::new(word).aliases(spellings).help(help)
    });
    PossibleValuesParser::new(known).map(|word| {
        let is_word = |(spellings, ..): &&(&str, T, &str)| {
            spellings.split('|').any(|spelling| spelling.eq_ignore_ascii_case(&word))
        };
        words.iter().find(is_word).expect("the parser takes no other word").1
    })
}

/// Parses numbers by name: `name=number,name=number`.
fn named<T: FromStr<Err = String>>(text: &str) -> Result<Named<T>, String> {
    let pair = |pair: &str| {
        let (name, number) = pair.split_once('=').ok_or("expected NAME=NUMBER")?;
        Ok((name.trim().to_owned(), number.parse()?))
    };
    text.split(',').map(pair).collect::<Result<_, String>>().map(Named)
}

/// Parses positions by name.
fn positions(text: &str) -> Result<Named<Position>, String> {
    named(text)
}

/// Parses shares by name: `name=5%` or `name=0.05`.
fn shares(text: &str) -> Result<Named<f64>, String> {
    let share = |pair: &str| {
        let (name, share) = pair.split_once('=').ok_or("expected NAME=SHARE, as omega=1%")?;
        let Finite(value) = share.trim().trim_end_matches('%').parse()?;
        let value = if share.trim().ends_with('%') { value / 100.0 } else { value };
        Ok((name.trim().to_owned(), value))
    };
    text.split(',').map(share).collect::<Result<_, String>>().map(Named)
}

/// Parses finite values by name.
fn values(text: &str) -> Result<Named<f64>, String> {
    let Named(pairs) = named::<Finite>(text)?;
    Ok(Named(pairs.into_iter().map(|(name, Finite(value))| (name, value)).collect()))
}

/// Parses sizes by name.
fn sizes(text: &str) -> Result<Named<f64>, String> {
    let sizes = values(text)?;
    match sizes.0.iter().find(|(_, size)| *size < 0.0) {
        Some((name, size)) => Err(format!("a size is not negative, found {name} = {size}")),
        None => Ok(sizes),
    }
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
