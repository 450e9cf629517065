//! What can be typed after `grazemap`.

use std::mem;
use std::path::{Path, PathBuf};
use std::sync::{Arc, Mutex, PoisonError};

use clap::builder::{PossibleValue, PossibleValuesParser, TypedValueParser};
use clap::{ArgGroup, Args, Parser, Subcommand};

use super::output::{CliError, Outlets};
use super::pieces;
use grazemap::Map;
use grazemap::analysis::branches::BranchObservable;
use grazemap::analysis::loci::LocusKind;
use grazemap::analysis::{Pieces, Precision, Share, Using};
use grazemap::emission::Target;
use grazemap::model::Method;
use grazemap::pipeline::{Device, OrbitsOf, TrajectoryKeys};
use grazemap::report::Named;

/// Fast, measured local maps of oscillators that graze a stop.
///
/// Without a command, runs the built-in scene `cantilever_3_5_soft` start to finish into ./out.
#[derive(Debug, Parser)]
#[command(name = "grazemap", version, args_conflicts_with_subcommands = true, max_term_width = 100)]
pub(super) struct Arguments {
    #[command(subcommand)]
    pub(super) command: Option<Command>,
    #[command(flatten)]
    pub(super) common: Common,
}

/// The commands: one file of `commands`, or one of few of a kind, carries each out.
#[derive(Debug, Subcommand)]
pub(super) enum Command {
    /// Everything the scene asks for, with a report page, into ./out
    Run(SceneOptions),
    /// The same, and the page opened in a browser
    View(SceneOptions),
    /// A scene from the catalogue to start from
    New(NewOptions),
    /// Parse and check a scene, no computing
    Check(SceneOptions),
    /// The grazing orbit
    Locate(LocateArguments),
    /// The grazing curve in two parameters, with its codimension-two points
    Curve(CurveArguments),
    /// Coefficients of P_smooth, D and their composition
    Expand(SceneOptions),
    /// The map as code: a crate of Rust, a C header or CUDA kernels
    Emit(EmitArguments),
    /// Images of section points
    Image(ImageOptions),
    /// Truncation orders against direct simulation; speed against accuracy
    Converge(ConvergeOptions),
    /// Bifurcation diagrams
    Diagram(SweepArguments),
    /// Two-parameter charts
    Chart(ChartArguments),
    /// Periodic orbits by itinerary, their stability, folds and flips
    Orbits(OrbitsArguments),
    /// Branches of periodic orbits in one parameter, through folds, flips and grazes
    Branch(BranchArguments),
    /// Saddle-nodes, flips, Neimark-Sacker points and grazes in two parameters
    Loci(LociArguments),
    /// Time series and phase portrait of the grazing orbit, of a periodic orbit, of any start
    Trajectory(TrajectoryArguments),
    /// Basins of attraction in a plane of the section
    Basin(BasinArguments),
    /// Published figures and tables, computed again and compared
    Gallery(GalleryOptions),
    /// The results of a command from the pieces of all its shards
    Merge(MergeArguments),
    /// Completions for a shell, on standard output
    Completions(CompletionsOptions),
    /// The manual's pages, written into a folder
    Man(ManOptions),
}

impl Arguments {
    /// Name of the command, the scene that it reads, its common options, and whether it has a
    /// table; `None` for commands without common options.
    fn outputs(&self) -> Option<(&'static str, Option<&Path>, &Common, bool)> {
        let (name, options, has_table) = match self.command.as_ref() {
            None => return Some(("run", None, &self.common, false)),
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
            Some(Command::Run(options)) => ("run", options, false),
            Some(Command::View(options)) => ("view", options, false),
            Some(Command::Check(options)) => ("check", options, false),
            Some(Command::Locate(options)) => ("locate", &options.scene, false),
            Some(Command::Curve(options)) => ("curve", &options.scene, true),
            Some(Command::Expand(options)) => ("expand", options, true),
            Some(Command::Image(options)) => ("image", &options.scene, true),
            Some(Command::Converge(options)) => ("converge", &options.scene, true),
            Some(Command::Diagram(options)) => ("diagram", &options.scene, true),
            Some(Command::Chart(options)) => ("chart", &options.sweep.scene, true),
            Some(Command::Orbits(options)) => ("orbits", &options.scene, true),
            Some(Command::Branch(options)) => ("branch", &options.scene, true),
            Some(Command::Loci(options)) => ("loci", &options.scene, true),
            Some(Command::Trajectory(options)) => ("trajectory", &options.scene, true),
            Some(Command::Basin(options)) => ("basin", &options.scene, true),
        };
        Some((name, Some(&options.scene), &options.common, has_table))
    }

    /// Makes the arguments of a shard those of the run that joins all; whether they are of one.
    pub(super) fn join(&mut self, options: &MergeArguments, joined: Arc<Joined>) -> bool {
        let (scene, sharding) = match &mut self.command {
            Some(Command::Diagram(sweep)) => (&mut sweep.scene, &mut sweep.sharding),
            Some(Command::Chart(ChartArguments { sweep, device })) => {
                // Little is left to compute, on any machine.
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
        // The map holds what was set.
        scene.common = Common { set: Vec::new(), outlets, threads, joined: Some(joined) };
        sharding.share.take().is_some()
    }

    /// Refuses, before anything is computed, a table that a command does not have, and what
    /// [`Outlets::check`] refuses.
    pub(super) fn refuse_lost_output(&self) -> Result<(), CliError> {
        let Some((command, scene, common, has_table)) = self.outputs() else {
            return Ok(());
        };
        if common.outlets.csv.is_some() && !has_table {
            return Err(CliError::NoTable { command });
        }
        let states = match &self.command {
            Some(Command::Image(options)) => Some(options.states.as_path()),
            // Nothing is written into the folder.
            Some(Command::Emit(options)) if options.check => return Ok(()),
            _ => None,
        };
        common.outlets.check(scene.into_iter().chain(states))
    }
}

/// Options every command understands.
#[derive(Clone, Debug, Default, Args)]
pub(super) struct Common {
    /// Override a parameter (`omega=1.9`) or a key (`expansion.smooth_order=7`); may be repeated
    #[arg(long = "set", value_name = "NAME=VALUE", value_parser = assignment)]
    pub(super) set: Vec<(String, String)>,
    #[command(flatten)]
    pub(super) outlets: Outlets,
    /// Threads to compute with, at most as many as there are cores; default: all cores
    #[arg(
        long,
        value_name = "N",
        allow_negative_numbers = true,
        value_parser = clap::value_parser!(u16).range(1..=1024)
    )]
    pub(super) threads: Option<u16>,
    /// What shards found, where the command joins them.
    #[arg(skip)]
    pub(super) joined: Option<Arc<Joined>>,
}

impl Common {
    /// The pieces that shards found; each is given once.
    pub(super) fn pieces(&self) -> Pieces {
        self.joined.as_deref().map(Joined::take).unwrap_or_default()
    }
}

/// What shards found, and the map that they found it for.
#[derive(Debug)]
pub(super) struct Joined {
    pub(super) map: Option<Map>,
    pub(super) pieces: Mutex<Pieces>,
}

impl Joined {
    /// The pieces; each is given once.
    pub(super) fn take(&self) -> Pieces {
        mem::take(&mut self.pieces.lock().unwrap_or_else(PoisonError::into_inner))
    }
}

/// Which part of a command is computed.
#[derive(Clone, Debug, Default, Args)]
pub(super) struct Sharding {
    /// Compute shard I of N alone, and write its pieces into -o DIR (default: here) for
    /// `grazemap merge`; without I/N, the shard of this task of a Slurm job array
    #[arg(
        long = "shard",
        value_name = "I/N",
        num_args = 0..=1,
        default_missing_value = pieces::ARRAY,
        value_parser = pieces::share
    )]
    pub(super) share: Option<Share>,
}

/// Options of `diagram` and `chart`.
#[derive(Clone, Debug, Args)]
pub(super) struct SweepArguments {
    #[command(flatten)]
    pub(super) scene: SceneOptions,
    #[command(flatten)]
    pub(super) sharding: Sharding,
}

/// Options of `chart`.
#[derive(Clone, Debug, Args)]
pub(super) struct ChartArguments {
    #[command(flatten)]
    pub(super) sweep: SweepArguments,
    /// What makes the orbits of the map: `cuda` is a graphics processor of NVIDIA's, whose charts
    /// have the very bytes of this processor's
    #[arg(long, default_value = "cpu", value_parser = Device::NAMES)]
    pub(super) device: String,
}

/// Options of `merge`.
#[derive(Clone, Debug, Args)]
pub(super) struct MergeArguments {
    /// The files that the shards wrote, all of them
    #[arg(value_name = "PIECES", required = true)]
    pub(super) pieces: Vec<PathBuf>,
    #[command(flatten)]
    pub(super) outlets: Outlets,
    /// Threads to compute with what the shards left
    #[arg(
        long,
        value_name = "N",
        allow_negative_numbers = true,
        value_parser = clap::value_parser!(u16).range(1..=1024)
    )]
    pub(super) threads: Option<u16>,
}

/// A scene and the common options.
#[derive(Clone, Debug, Args)]
pub(super) struct SceneOptions {
    /// A scene file, the name of a scene of the catalogue, a saved orbit.json or map.json, or `-`
    /// for a scene on standard input
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
    /// Measure beside the theory what guarded iteration settles on at a tenth and a hundredth of
    /// the window to both sides of the graze; takes the map
    #[arg(long)]
    pub(super) measure: bool,
}

/// Options of `converge`.
#[derive(Clone, Debug, Args)]
pub(super) struct ConvergeOptions {
    #[command(flatten)]
    pub(super) scene: SceneOptions,
    /// Fresh points at which the chosen map is compared with direct simulation
    #[arg(
        long,
        value_name = "N",
        allow_negative_numbers = true,
        default_value_t = 1000,
        value_parser = clap::value_parser!(u32).range(1..=1_000_000)
    )]
    pub(super) fresh: u32,
}

/// Options of `curve`.
#[derive(Clone, Debug, Args)]
pub(super) struct CurveArguments {
    #[command(flatten)]
    pub(super) scene: SceneOptions,
    /// The second parameter
    #[arg(long, value_name = "PARAMETER", required_unless_present = "nearest")]
    pub(super) with: Option<String>,
    /// Its first value
    #[arg(long, value_name = "A", allow_hyphen_values = true, required_unless_present = "nearest")]
    pub(super) from: Option<f64>,
    /// Its last value
    #[arg(long, value_name = "B", allow_hyphen_values = true, required_unless_present = "nearest")]
    pub(super) to: Option<f64>,
    /// The smallest change of one or two parameters from the scene's values at which the orbit
    /// grazes, in the place of a curve
    #[arg(
        long,
        value_name = "P[,Q]",
        value_delimiter = ',',
        conflicts_with_all = ["with", "from", "to", "xi"]
    )]
    pub(super) nearest: Vec<String>,
    /// What a change of a parameter is counted in. Default: its value, 1 where that is 0
    #[arg(
        long,
        value_name = "P=SIZE,...",
        value_parser = offsets,
        requires = "nearest"
    )]
    pub(super) scale: Option<Named<f64>>,
    /// Follow xi_1 to xi_N
    #[arg(
        long,
        value_name = "N",
        allow_negative_numbers = true,
        default_value_t = 1,
        value_parser = clap::value_parser!(u16).range(1..=64)
    )]
    pub(super) xi: u16,
}

/// Options of `emit`.
#[derive(Clone, Debug, Args)]
pub(super) struct EmitArguments {
    /// A scene file, the name of a scene of the catalogue, a saved orbit.json or map.json, or `-`
    /// for a scene on standard input
    #[arg(value_name = "SCENE", required_unless_present = "catalogue")]
    pub(super) scene: Option<PathBuf>,
    /// Emit the catalogue's crate of maps instead
    #[arg(long, conflicts_with = "scene")]
    pub(super) catalogue: bool,
    /// The language of the map
    #[arg(
        long,
        default_value = "rust",
        value_parser = one_of(TARGETS),
        conflicts_with = "catalogue"
    )]
    pub(super) target: Target,
    /// Compare with what is in the folder, write nothing
    #[arg(long)]
    pub(super) check: bool,
    /// Leave out the error on the window against direct simulation, which is measured otherwise
    #[arg(long)]
    pub(super) no_measure: bool,
    /// Measure that error: the default
    #[arg(long, hide = true, conflicts_with = "no_measure")]
    pub(super) measure: bool,
    #[command(flatten)]
    pub(super) common: Common,
}

/// Language of an emitted map.
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
    /// Starting points: a CSV file, or `-` for standard input, whose header names coordinates and
    /// active parameters; offsets
    #[arg(long, value_name = "CSV")]
    pub(super) states: PathBuf,
    /// What computes the images
    #[arg(long, default_value = "map", value_parser = one_of(USING))]
    pub(super) using: Using,
    /// Images per row
    #[arg(
        long,
        value_name = "K",
        allow_negative_numbers = true,
        default_value_t = 1,
        value_parser = clap::value_parser!(u32).range(1..=10_000_000)
    )]
    pub(super) iterations: u32,
    /// The numbers to compute with
    #[arg(long, default_value = "f64", value_parser = one_of(PRECISIONS))]
    pub(super) precision: Precision,
}

/// What computes an image.
const USING: Words<Using> = &[
    ("map", Using::Map, "The local map"),
    ("guarded", Using::Guarded, "The local map inside its window, direct simulation outside"),
    ("direct", Using::Direct, "Direct simulation"),
    ("smooth", Using::Smooth, "P_smooth alone"),
    ("discontinuity", Using::Discontinuity, "D alone"),
];

/// The numbers an image is computed in.
const PRECISIONS: Words<Precision> = &[
    ("f32", Precision::F32, "Single precision, of the map or its parts"),
    ("f64", Precision::F64, "Double precision"),
    ("dd", Precision::Dd, "Double-double, about 32 digits"),
];

/// Options of `new`.
#[derive(Clone, Debug, Args)]
pub(super) struct NewOptions {
    /// Name of the scene in the catalogue
    #[arg(value_name = "NAME", required_unless_present = "list")]
    pub(super) name: Option<String>,
    /// List the catalogue
    #[arg(long)]
    pub(super) list: bool,
    /// The file to write; default: NAME.toml
    #[arg(short = 'o', long = "output", value_name = "FILE", conflicts_with = "list")]
    pub(super) output: Option<PathBuf>,
    /// Say nothing but errors
    #[arg(short = 'q', long = "quiet")]
    pub(super) quiet: bool,
}

/// Options of `gallery`.
#[derive(Clone, Debug, Args)]
pub(super) struct GalleryOptions {
    /// Entries, or papers with all of their entries; default: all
    #[arg(value_name = "NAME", conflicts_with = "list")]
    pub(super) names: Vec<String>,
    /// List the entries
    #[arg(long)]
    pub(super) list: bool,
    /// Compute fewer points: seconds in place of minutes
    #[arg(long)]
    pub(super) small: bool,
    /// The folder for the page and all results; default: out/gallery
    #[arg(short = 'o', long = "output", value_name = "DIR")]
    pub(super) output: Option<PathBuf>,
    /// Say nothing but errors
    #[arg(short = 'q', long = "quiet")]
    pub(super) quiet: bool,
    #[command(flatten)]
    pub(super) sharding: Sharding,
    /// What shards made, where the command joins them.
    #[arg(skip)]
    pub(super) joined: Option<Arc<Joined>>,
}

/// Options of `completions`.
#[derive(Clone, Debug, Args)]
pub(super) struct CompletionsOptions {
    /// The shell
    #[arg(value_enum, value_name = "SHELL")]
    pub(super) shell: clap_complete::Shell,
}

/// Options of `man`.
#[derive(Clone, Debug, Args)]
pub(super) struct ManOptions {
    /// The folder for the pages, such as ~/.local/share/man/man1
    #[arg(short = 'o', long = "output", value_name = "DIR")]
    pub(super) output: PathBuf,
}

/// Options of `orbits`.
#[derive(Clone, Debug, Args)]
#[command(group = ArgGroup::new("kinds").args(["fold", "flip"]).multiple(true))]
pub(super) struct OrbitsArguments {
    #[command(flatten)]
    pub(super) scene: SceneOptions,
    /// Offsets of active parameters from the graze, others 0; may be repeated. Default: a tenth of
    /// the window on both sides of the graze
    #[arg(long, value_name = "NAME=OFFSET,...", value_parser = offsets)]
    pub(super) at: Vec<Named<f64>>,
    /// Look for all itineraries of periods up to N returns. Default: 4, with several passages 4
    /// passages
    #[arg(
        long,
        value_name = "N",
        allow_negative_numbers = true,
        conflicts_with = "itinerary",
        value_parser = clap::value_parser!(u8).range(1..=12)
    )]
    pub(super) period: Option<u8>,
    #[command(flatten)]
    pub(super) which: WhichOrbits,
    /// Look for folds (saddle-nodes) too
    #[arg(long)]
    pub(super) fold: bool,
    /// Look for flips (period-doublings) too
    #[arg(long)]
    pub(super) flip: bool,
    /// The parameter that folds and flips are solved for; of two the first is stepped through.
    /// Default: the first active one
    #[arg(long = "in", value_name = "[P,]Q", value_delimiter = ',', requires = "kinds")]
    pub(super) plane: Vec<String>,
    /// First offset of the parameter stepped through. Default: the window's
    #[arg(long, value_name = "A", allow_hyphen_values = true, requires = "plane")]
    pub(super) from: Option<f64>,
    /// Its last offset
    #[arg(long, value_name = "B", allow_hyphen_values = true, requires = "plane")]
    pub(super) to: Option<f64>,
    /// How many offsets
    #[arg(
        long,
        value_name = "N",
        allow_negative_numbers = true,
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
    /// The active parameter that varies
    #[arg(long, value_name = "P")]
    pub(super) along: String,
    #[command(flatten)]
    pub(super) stretch: Stretch,
    /// Look for all itineraries of periods up to N returns, and follow branches that double up to
    /// N. Default: 4, with several passages 4 passages
    #[arg(
        long,
        value_name = "N",
        allow_negative_numbers = true,
        value_parser = clap::value_parser!(u8).range(1..=12)
    )]
    pub(super) period: Option<u8>,
    #[command(flatten)]
    pub(super) which: WhichOrbits,
    /// Offsets of the section's coordinates, others 0, from which direct simulation looks for
    /// orbits beside those it finds by itself; may be repeated. `basin` finds some
    #[arg(long, value_name = "NAME=OFFSET,...", value_parser = offsets)]
    pub(super) start: Vec<Named<f64>>,
    /// Numbers of every orbit beside its section points, each a column and a picture
    #[arg(long, value_name = "NAME,...", value_parser = one_of(OBSERVABLES), value_delimiter = ',')]
    pub(super) observe: Vec<BranchObservable>,
    #[command(flatten)]
    pub(super) sharding: Sharding,
}

/// Part of a parameter, the others held: options of `branch` and `loci`.
#[derive(Clone, Debug, Args)]
pub(super) struct Stretch {
    /// First offset of the parameter from the graze. Default: the window's
    #[arg(long, value_name = "A", allow_hyphen_values = true)]
    pub(super) from: Option<f64>,
    /// Its last offset
    #[arg(long, value_name = "B", allow_hyphen_values = true)]
    pub(super) to: Option<f64>,
    /// Offsets of further active parameters from the graze, others 0
    #[arg(long, value_name = "NAME=OFFSET,...", value_parser = offsets)]
    pub(super) at: Option<Named<f64>>,
}

/// Whose orbits, and of which contacts: options of `orbits`, `branch` and `loci`.
#[derive(Clone, Debug, Args)]
pub(super) struct WhichOrbits {
    /// The orbits with these contacts: 1 for contact, 0 for none, passage by passage and return by
    /// return (`100`); may be repeated. Default: all of short periods
    #[arg(long, value_name = "DIGITS")]
    pub(super) itinerary: Vec<String>,
    /// Whose orbits: the map's, or those of direct simulation
    #[arg(long, default_value = "map", value_parser = one_of(ORBITS_OF))]
    pub(super) using: OrbitsOf,
}

/// What is observed of the orbits of a branch.
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

/// Whose orbits.
const ORBITS_OF: Words<OrbitsOf> =
    &[("map", OrbitsOf::Map, "The local map"), ("direct", OrbitsOf::Direct, "Direct simulation")];

/// Options of `loci`.
#[derive(Clone, Debug, Args)]
pub(super) struct LociArguments {
    #[command(flatten)]
    pub(super) scene: SceneOptions,
    /// The two active parameters
    #[arg(long = "in", value_name = "P,Q", value_delimiter = ',', required = true)]
    pub(super) plane: Vec<String>,
    #[command(flatten)]
    pub(super) stretch: Stretch,
    /// Which loci. Default: all but crises
    #[arg(long, value_name = "KIND,...", value_parser = one_of(LOCI), value_delimiter = ',')]
    pub(super) kind: Vec<LocusKind>,
    #[command(flatten)]
    pub(super) which: WhichOrbits,
}

/// What happens along a locus.
const LOCI: Words<LocusKind> = &[
    ("graze", LocusKind::Graze, "The orbit grazes"),
    ("fold", LocusKind::Fold, "Saddle-nodes"),
    ("flip", LocusKind::Flip, "Period-doublings"),
    ("torus", LocusKind::Torus, "Neimark-Sacker points"),
    ("crisis", LocusKind::Crisis, "An attractor touches the stable manifold of a saddle"),
];

/// Options of `trajectory`.
#[derive(Clone, Debug, Args)]
pub(super) struct TrajectoryArguments {
    #[command(flatten)]
    pub(super) scene: SceneOptions,
    /// Offsets of active parameters from the graze, others 0
    #[arg(long, value_name = "NAME=OFFSET,...", value_parser = offsets)]
    pub(super) at: Option<Named<f64>>,
    /// Start at these offsets of the section's coordinates, others 0. Default: on the grazing orbit
    #[arg(long, value_name = "NAME=OFFSET,...", value_parser = offsets)]
    pub(super) start: Option<Named<f64>>,
    /// Start on the periodic orbit of this itinerary: 1 for contact, 0 for none, passage by passage
    /// and return by return
    #[arg(long, value_name = "DIGITS", conflicts_with = "start")]
    pub(super) itinerary: Option<String>,
    /// Returns to the section that are simulated first and not written: the orbit settles
    #[arg(
        long,
        value_name = "K",
        allow_negative_numbers = true,
        default_value_t = 0,
        value_parser = clap::value_parser!(u32).range(0..=10_000_000)
    )]
    pub(super) settle: u32,
    /// Periods of the orbit that are simulated; without one, returns to the section
    #[arg(
        long,
        value_name = "K",
        allow_negative_numbers = true,
        default_value_t = 1,
        value_parser = clap::value_parser!(u32).range(1..=10_000_000)
    )]
    pub(super) periods: u32,
    /// Rows per return to the section, evenly spaced in time, beside those of events
    #[arg(
        long,
        value_name = "N",
        allow_negative_numbers = true,
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
    /// Offsets of active parameters from the graze, others 0
    #[arg(long, value_name = "NAME=OFFSET,...", value_parser = offsets)]
    pub(super) at: Option<Named<f64>>,
    /// The coordinates of the section that span the plane, the horizontal one first. Default: the
    /// first two
    #[arg(long, value_name = "A,B", value_delimiter = ',')]
    pub(super) axes: Vec<String>,
    /// First and last offset along an axis. Default: the window of the map
    #[arg(long, value_name = "NAME=FROM:TO,...", value_parser = Ranges::parse)]
    pub(super) range: Option<Ranges>,
    /// Cells along both axes, or along each. Default: 400
    #[arg(
        long,
        value_name = "N[,M]",
        value_delimiter = ',',
        allow_negative_numbers = true,
        value_parser = clap::value_parser!(u32).range(1..=10_000)
    )]
    pub(super) points: Vec<u32>,
    /// Offsets of the section's other coordinates, those not named 0
    #[arg(long, value_name = "NAME=OFFSET,...", value_parser = offsets)]
    pub(super) start: Option<Named<f64>>,
    /// What follows the states. Default: guarded
    #[arg(long, value_parser = one_of(METHODS))]
    pub(super) with: Option<Method>,
    /// Stable and unstable manifolds of the saddles of periods up to N returns, as curves; the
    /// section has two coordinates then
    #[arg(
        long,
        value_name = "N",
        num_args = 0..=1,
        allow_negative_numbers = true,
        default_missing_value = "2",
        value_parser = clap::value_parser!(u8).range(1..=12)
    )]
    pub(super) manifolds: Option<u8>,
    #[command(flatten)]
    pub(super) sharding: Sharding,
}

/// What iterates states.
const METHODS: Words<Method> = &[
    ("map", Method::Map, "The local map"),
    ("guarded", Method::Guarded, "The local map inside its window, direct simulation outside"),
    ("direct", Method::Direct, "Direct simulation"),
];

/// Ranges by name.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Ranges(pub(super) Named<[f64; 2]>);

impl Ranges {
    /// `name=from:to,name=from:to`.
    fn parse(text: &str) -> Result<Self, String> {
        let range = |range: &str| {
            let (name, ends) = range.split_once('=').ok_or("expected NAME=FROM:TO")?;
            let (from, to) = ends.split_once(':').ok_or("expected NAME=FROM:TO")?;
            let range = [finite(from)?, finite(to)?];
            match range[0] < range[1] {
                true => Ok((name.trim().to_owned(), range)),
                false => Err(format!("`{ends}` does not increase")),
            }
        };
        Ok(Self(Named(text.split(',').map(range).collect::<Result<_, String>>()?)))
    }
}

/// Words, what each stands for, and what is said of it.
type Words<T> = &'static [(&'static str, T, &'static str)];

/// Takes one of these words for what it stands for.
fn one_of<T: Copy + Send + Sync>(words: Words<T>) -> impl TypedValueParser<Value = T> {
    let known = words.iter().map(|&(word, _, help)| PossibleValue::new(word).help(help));
    PossibleValuesParser::new(known).map(|word| {
        let named = words.iter().find(|(known, ..)| *known == word);
        named.expect("the parser takes no other word").1
    })
}

/// A finite number.
fn finite(text: &str) -> Result<f64, String> {
    let value = text.trim();
    let number = value.parse().ok().filter(|number: &f64| number.is_finite());
    number.ok_or(format!("`{value}` is no finite number"))
}

/// Offsets by name: `name=offset,name=offset`.
fn offsets(text: &str) -> Result<Named<f64>, String> {
    let pair = |pair: &str| {
        let (name, value) = pair.split_once('=').ok_or("expected NAME=OFFSET")?;
        Ok((name.trim().to_owned(), finite(value)?))
    };
    text.split(',').map(pair).collect::<Result<_, String>>().map(Named)
}

/// `name=value`, split at the first `=`.
fn assignment(text: &str) -> Result<(String, String), String> {
    match text.split_once('=') {
        Some((name, value)) if !name.trim().is_empty() => {
            Ok((name.trim().to_owned(), value.trim().to_owned()))
        }
        _ => Err("expected NAME=VALUE".to_owned()),
    }
}
