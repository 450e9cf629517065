//! What can be typed after `grazemap orbits`.

use clap::{ArgGroup, Args, ValueEnum};

use super::arguments::SceneOptions;

/// Options of `orbits`.
#[derive(Clone, Debug, Args)]
#[command(group = ArgGroup::new("kinds").args(["fold", "flip"]).multiple(true))]
pub(super) struct OrbitsArguments {
    #[command(flatten)]
    pub(super) scene: SceneOptions,
    /// Offsets of active parameters from the graze, others 0; may be repeated. Default: a tenth of
    /// the window on both sides of the graze
    #[arg(long, value_name = "NAME=OFFSET,...", value_parser = ParameterOffsets::parse)]
    pub(super) at: Vec<ParameterOffsets>,
    /// Look for all itineraries of periods up to N returns. Default: 4, with several passages 4
    /// passages
    #[arg(long, value_name = "N", allow_negative_numbers = true, value_parser = clap::value_parser!(u8).range(1..=12))]
    pub(super) period: Option<u8>,
    /// Look for this itinerary: 1 for contact, 0 for none, passage by passage and return by return
    /// (`100`); may be repeated
    #[arg(long, value_name = "DIGITS", conflicts_with = "period")]
    pub(super) itinerary: Vec<String>,
    /// Whose orbits: the map's, or those of direct simulation next to them
    #[arg(long, value_enum, default_value_t = OrbitsUsing::Map)]
    pub(super) using: OrbitsUsing,
    /// Look for folds (saddle-nodes) too
    #[arg(long)]
    pub(super) fold: bool,
    /// Look for flips (period-doublings) too
    #[arg(long)]
    pub(super) flip: bool,
    /// The parameter that folds and flips are solved for; of two the first is stepped through.
    /// Default: the first active one
    #[arg(
        long = "in",
        value_name = "[P,]Q",
        value_delimiter = ',',
        requires = "kinds"
    )]
    pub(super) plane: Vec<String>,
    /// First offset of the parameter stepped through. Default: the window's
    #[arg(
        long,
        value_name = "A",
        allow_negative_numbers = true,
        requires = "plane"
    )]
    pub(super) from: Option<f64>,
    /// Its last offset
    #[arg(
        long,
        value_name = "B",
        allow_negative_numbers = true,
        requires = "plane"
    )]
    pub(super) to: Option<f64>,
    /// How many offsets
    #[arg(long, value_name = "N", allow_negative_numbers = true, default_value_t = 21, requires = "plane", value_parser = clap::value_parser!(u16).range(2..=10_000))]
    pub(super) points: u16,
}

/// Whose orbits.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub(super) enum OrbitsUsing {
    /// The local map
    Map,
    /// Direct simulation
    Direct,
}

/// Offsets of parameters by name.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct ParameterOffsets(pub(super) Vec<(String, f64)>);

impl ParameterOffsets {
    /// `name=offset,name=offset`.
    fn parse(text: &str) -> Result<Self, String> {
        let pair = |pair: &str| {
            let (name, value) = pair.split_once('=').ok_or("expected NAME=OFFSET")?;
            let value = value.trim();
            let offset = value.parse().ok().filter(|offset: &f64| offset.is_finite());
            let offset = offset.ok_or(format!("`{value}` is no finite number"))?;
            Ok((name.trim().to_owned(), offset))
        };
        let pairs = text.split(',').map(pair).collect::<Result<_, String>>();
        Ok(Self(pairs?))
    }
}
