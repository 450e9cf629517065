//! From the options of `grazemap orbits` to itineraries and offsets of parameters.

use super::error::CliError;
use super::orbits_arguments::{OrbitsArguments, OrbitsUsing, ParameterOffsets};
use grazemap::analysis::orbits::{LociRequest, OrbitsRequest, SteppedParameter};
use grazemap::analysis::periodic::{BifurcationKind, ContactItinerary, ItineraryError};
use grazemap::expansion::LocalMap;
use grazemap::model::{Scene, nearest};

/// Share of the window's half-width at which orbits are looked for where no parameters are named.
const DEFAULT_SHARE: f64 = 0.1;
/// Passages of the longest period that is looked for where none is named.
const DEFAULT_PASSAGES: usize = 4;

/// What the options ask for, in numbers.
pub(super) fn request(
    options: &OrbitsArguments,
    scene: &Scene,
    map: &LocalMap,
) -> Result<OrbitsRequest, CliError> {
    let parameters = Parameters { scene, map };
    Ok(OrbitsRequest {
        itineraries: itineraries(options, map.passages())?,
        at: parameters.at(options)?,
        direct: options.using == OrbitsUsing::Direct,
        loci: parameters.loci(options)?,
    })
}

/// The itineraries named, or all of short periods.
fn itineraries(
    options: &OrbitsArguments,
    passages: usize,
) -> Result<Vec<ContactItinerary>, ItineraryError> {
    if options.itinerary.is_empty() {
        let longest = (DEFAULT_PASSAGES / passages.max(1)).max(1);
        return ContactItinerary::all(passages, options.period.map_or(longest, usize::from));
    }
    let named = options.itinerary.iter();
    let parse = |digits: &String| ContactItinerary::parse(digits, passages);
    named.map(parse).collect()
}

/// The active parameters of a map.
struct Parameters<'a> {
    scene: &'a Scene,
    map: &'a LocalMap,
}

impl Parameters<'_> {
    fn names(&self) -> impl Iterator<Item = &str> {
        self.map
            .parameters
            .iter()
            .map(|parameter| parameter.name.as_str())
    }

    /// The number of a parameter.
    fn place(&self, flag: &'static str, name: &str) -> Result<usize, CliError> {
        self.names()
            .position(|known| known == name)
            .ok_or_else(|| CliError::NotActive {
                flag,
                name: name.to_owned(),
                nearest: nearest(name, self.names()),
                known: self.names().collect::<Vec<_>>().join(", "),
            })
    }

    /// The first that is adjusted so that the orbit grazes; where the map has none of those, its
    /// first.
    fn first(&self) -> Result<usize, CliError> {
        let adjusted = self.scene.grazing.solve_for.iter();
        let mut adjusted = adjusted.map(|&parameter| &self.scene.model.parameters[parameter].name);
        let place = adjusted.find_map(|name| self.names().position(|known| known == name));
        let any = (!self.map.parameters.is_empty()).then_some(0);
        place.or(any).ok_or(CliError::NoParameter)
    }

    /// Its half-width in the window.
    fn width(&self, place: usize, flag: &'static str) -> Result<f64, CliError> {
        let width = self.map.window.parameter[place];
        let name = || self.map.parameters[place].name.clone();
        Some(width)
            .filter(|width| width.is_finite())
            .ok_or_else(|| CliError::NoWidth { flag, name: name() })
    }

    /// Offsets, all 0 but one.
    fn one(&self, place: usize, offset: f64) -> Vec<f64> {
        let mut offsets = vec![0.0; self.map.parameters.len()];
        offsets[place] = offset;
        offsets
    }

    /// Offsets by name; those not named are 0.
    fn offsets(&self, named: &ParameterOffsets) -> Result<Vec<f64>, CliError> {
        let mut offsets = vec![None; self.map.parameters.len()];
        for (name, offset) in &named.0 {
            let place = self.place("--at", name)?;
            if offsets[place].replace(*offset).is_some() {
                return Err(CliError::NamedTwice {
                    flag: "--at",
                    name: name.clone(),
                });
            }
        }
        Ok(offsets.into_iter().map(Option::unwrap_or_default).collect())
    }

    /// Where orbits are looked for.
    fn at(&self, options: &OrbitsArguments) -> Result<Vec<Vec<f64>>, CliError> {
        if options.at.is_empty() {
            let first = self.first()?;
            let offset = DEFAULT_SHARE * self.width(first, "--at")?;
            return Ok([offset, -offset]
                .map(|offset| self.one(first, offset))
                .into());
        }
        let named = options.at.iter();
        named.map(|offsets| self.offsets(offsets)).collect()
    }

    /// Folds and flips in one parameter, or in two; beside them the offsets named first hold.
    fn loci(&self, options: &OrbitsArguments) -> Result<Option<LociRequest>, CliError> {
        let kinds = [
            (options.fold, BifurcationKind::Fold),
            (options.flip, BifurcationKind::Flip),
        ];
        let kinds = kinds.into_iter().filter(|(asked, _)| *asked);
        let kinds: Vec<_> = kinds.map(|(_, kind)| kind).collect();
        if kinds.is_empty() {
            return Ok(None);
        }
        let (stepped, free) = self.plane(options)?;
        let named = options.at.first().map(|offsets| self.offsets(offsets));
        let named = named.transpose()?;
        let mut at = named.unwrap_or_else(|| vec![0.0; self.map.parameters.len()]);
        at[free] = 0.0;
        let stepped = stepped.map(|place| self.steps(options, place));
        Ok(Some(LociRequest {
            kinds,
            free,
            stepped: stepped.transpose()?,
            at,
        }))
    }

    /// The parameter that is stepped through, where there is one, and the one that is solved for.
    fn plane(&self, options: &OrbitsArguments) -> Result<(Option<usize>, usize), CliError> {
        let plane = options.plane.iter();
        let plane = plane.map(|name| self.place("--in", name.trim()));
        match plane.collect::<Result<Vec<_>, _>>()?[..] {
            [] => Ok((None, self.first()?)),
            [free] => Ok((None, free)),
            [stepped, free] if stepped == free => Err(CliError::NamedTwice {
                flag: "--in",
                name: options.plane[0].clone(),
            }),
            [stepped, free] => Ok((Some(stepped), free)),
            _ => Err(CliError::NotAPlane {
                found: options.plane.len(),
            }),
        }
    }

    /// The values of the parameter that is stepped through.
    fn steps(&self, options: &OrbitsArguments, place: usize) -> Result<SteppedParameter, CliError> {
        let end = |flag, given: Option<f64>, sign: f64| match given {
            Some(value) if value.is_finite() => Ok(value),
            Some(value) => Err(CliError::NotFinite { flag, value }),
            None => Ok(sign * self.width(place, flag)?),
        };
        let (from, to) = (
            end("--from", options.from, -1.0)?,
            end("--to", options.to, 1.0)?,
        );
        let last = f64::from(options.points - 1);
        let value = |number: u16| from + (to - from) * f64::from(number) / last;
        Ok(SteppedParameter {
            parameter: place,
            values: (0..options.points).map(value).collect(),
        })
    }
}
