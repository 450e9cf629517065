//! Arrays of points: images, derivatives and orbits; and the layout of images for `image`.
//!
//! States are rows of section coordinates, one after another. Parameters are one row for all
//! states, or one row for each. Both are offsets from the grazing orbit.

use std::io::Write;

use super::{Ended, Error, Extent, Map, Results, refuse_memory};
use crate::analysis::{
    DirectEnd, ImageRecord, ImageRequest, ImageRow, Precision, Progress, Using, batch_bytes,
    orbit_bytes,
};
use crate::interruption::{check, check_at};
use crate::iteration::{Batch, DiscreteMap, parallel};
use crate::numeric::Dd;
use crate::report::{
    Figure, ImageListing, OutputFolder, ReportError, Rows, image_outside_words, image_rows,
    write_json,
};

/// Images that are computed together, some milliseconds of work.
const BLOCK: usize = 1 << 13;
/// Number of points below which lanes are not filled.
const FEW: usize = 8;

/// Rows of states and parameters.
#[derive(Clone, Debug, PartialEq)]
pub struct Points {
    /// Coordinates, state by state.
    pub states: Vec<f64>,
    /// One row of parameters, or one row for each state.
    pub parameters: Vec<f64>,
}

impl Map {
    /// Computes images, depths and, if asked for, derivatives of many points.
    ///
    /// # Errors
    ///
    /// [`Error::Rows`] if states or parameters are not a whole number of rows; [`Error::Memory`] if
    /// the results exceed the machine's memory.
    pub fn batch(
        &self,
        states: &[f64],
        parameters: &[f64],
        derivatives: bool,
    ) -> Result<Batch, Error> {
        self.count(states, parameters)?;
        let points = states.len() / self.local().dimension();
        refuse_memory(batch_bytes(self.local(), points, derivatives))?;
        Ok(self.discrete().batch(states, parameters, derivatives))
    }

    /// Whether each point lies in the window on which the map's error was measured.
    ///
    /// # Errors
    ///
    /// As [`batch`](Self::batch).
    pub fn inside(&self, states: &[f64], parameters: &[f64]) -> Result<Vec<bool>, Error> {
        let Batch { rows, width } = self.batch(states, parameters, false)?;
        let (local, dimension) = (self.local(), self.local().dimension());
        let points = rows.chunks_exact(width).zip(states.chunks_exact(dimension)).enumerate();
        let held = |(point, (row, state)): (usize, (&[f64], &[f64]))| {
            let depths = &row[dimension..][..local.passages()];
            local.window.holds(state, self.own(parameters, point), depths)
        };
        Ok(points.map(held).collect())
    }

    /// Computes orbits of many points by a method of `image`. The result holds, point by point and
    /// iterate by iterate, the coordinates of the images; they are NaN after an orbit has ended
    /// early.
    ///
    /// ```
    /// use grazemap::analysis::{NoProgress, Precision, Using};
    /// use grazemap::pipeline::Points;
    /// use grazemap::prelude::*;
    ///
    /// let map = Scene::of_catalogue("linear")?.graze()?.map()?;
    /// let points = Points { states: vec![1e-6, 0.0, 2e-6, 0.0], parameters: vec![1e-7, 0.0] };
    /// let method = (Using::Map, Precision::F64);
    /// let orbits = map.point_orbits(points, 3, method, &NoProgress)?;
    /// let single = map.iterate(&[2e-6, 0.0], &[1e-7, 0.0], 3)?;
    /// assert_eq!(orbits[10..], single[2].offsets);
    /// # Ok::<(), grazemap::Error>(())
    /// ```
    ///
    /// # Errors
    ///
    /// [`Error::Rows`] as [`batch`](Self::batch); [`Error::Analysis`] if the simulator refuses the
    /// offsets, and for unavailable precisions; [`Error::Memory`] if the numbers exceed the
    /// machine's memory.
    pub fn point_orbits(
        &self,
        points: Points,
        iterations: usize,
        (using, precision): (Using, Precision),
        progress: &dyn Progress,
    ) -> Result<Vec<f64>, Error> {
        let Points { states, parameters } = points;
        self.count(&states, &parameters)?;
        let dimension = self.local().dimension();
        let count = states.len() / dimension;
        refuse_memory(orbit_bytes(self.scene(), count, iterations))?;
        progress.expect((count as u64).saturating_mul(iterations as u64));
        let mut images = vec![f64::NAN; states.len() * iterations];
        if images.is_empty() {
            return Ok(images);
        }
        let blocks = images.chunks_mut(BLOCK * iterations * dimension);
        let blocks = blocks.zip(states.chunks(BLOCK * dimension)).enumerate();
        let own = |block: usize| match parameters.len() == self.local().parameters.len() {
            true => &parameters[..],
            false => {
                let width = BLOCK * self.local().parameters.len();
                &parameters[block * width..parameters.len().min((block + 1) * width)]
            }
        };
        if (using, precision) == (Using::Map, Precision::F64) {
            parallel::map(blocks, |(block, (images, states))| {
                self.map_orbits((states, own(block)), images, progress);
            });
        } else {
            for (block, (images, states)) in blocks {
                let request = self.image_request((states, own(block)), 1, (using, precision))?;
                self.image_orbits(request, images, progress)?;
            }
        }
        Ok(images)
    }

    /// Writes orbits of some points by the map.
    fn map_orbits(
        &self,
        (states, parameters): (&[f64], &[f64]),
        images: &mut [f64],
        progress: &dyn Progress,
    ) {
        let dimension = self.local().dimension();
        let points = states.len() / dimension;
        let iterations = images.len() / states.len();
        if points < FEW {
            for (point, images) in images.chunks_exact_mut(iterations * dimension).enumerate() {
                let frozen = self.discrete().freeze(self.own(parameters, point));
                let mut state = states[point * dimension..][..dimension].to_vec();
                for (round, images) in images.chunks_mut(BLOCK * dimension).enumerate() {
                    for (iterate, image) in images.chunks_exact_mut(dimension).enumerate() {
                        check_at(round * BLOCK + iterate);
                        frozen.step(&state, &[], image);
                        state.copy_from_slice(image);
                    }
                    progress.advance((images.len() / dimension) as u64);
                }
            }
            return;
        }
        let mut states = states.to_vec();
        for iterate in 0..iterations {
            check();
            let Batch { rows, width } = self.discrete().batch(&states, parameters, false);
            for (point, row) in rows.chunks_exact(width).enumerate() {
                let image = &row[..dimension];
                states[point * dimension..][..dimension].copy_from_slice(image);
                let place = (point * iterations + iterate) * dimension;
                images[place..][..dimension].copy_from_slice(image);
            }
            progress.advance(points as u64);
        }
    }

    /// Writes orbits of some points by any method, in rounds: the records of one round are in
    /// memory.
    fn image_orbits(
        &self,
        mut request: ImageRequest,
        images: &mut [f64],
        progress: &dyn Progress,
    ) -> Result<(), Error> {
        let (dimension, points) = (self.local().dimension(), request.rows.len());
        let iterations = images.len() / dimension / points;
        // Numbers of the points whose orbits go on.
        let mut going: Vec<usize> = (0..points).collect();
        let mut done = 0;
        while done < iterations {
            request.iterations = (BLOCK / going.len().max(1)).clamp(1, iterations - done);
            let mut ends = vec![None; going.len()];
            let records = match going.is_empty() {
                true => Vec::new(),
                false => self.images(&request)?,
            };
            for record in records {
                let place = going[record.row] * iterations + done + record.iteration - 1;
                let image = &mut images[place * dimension..][..dimension];
                image.iter_mut().zip(&record.offsets).for_each(|(to, from)| *to = from.to_f64());
                let goes_on = record.iteration == request.iterations
                    && record.offsets.iter().all(|value| value.is_finite());
                ends[record.row] = goes_on.then_some(record.offsets);
            }
            done += request.iterations;
            progress.advance((points * request.iterations) as u64);
            let rows = std::mem::take(&mut request.rows).into_iter();
            let rows = rows
                .zip(going)
                .zip(ends)
                .filter_map(|((row, point), end)| Some((ImageRow { state: end?, ..row }, point)));
            (request.rows, going) = rows.unzip();
        }
        Ok(())
    }

    /// Computes images of many points, to be laid out.
    ///
    /// # Errors
    ///
    /// As [`images`](Self::images).
    pub fn image_answer(&self, request: ImageRequest) -> Result<Images, Error> {
        let records = self.images(&request)?;
        Ok(Images { map: self.clone(), request, records })
    }

    /// Request to [`images`](Self::images) for these points.
    ///
    /// # Errors
    ///
    /// As [`batch`](Self::batch).
    pub fn image_request(
        &self,
        (states, parameters): (&[f64], &[f64]),
        iterations: usize,
        (using, precision): (Using, Precision),
    ) -> Result<ImageRequest, Error> {
        self.count(states, parameters)?;
        let exact = |values: &[f64]| values.iter().map(|&value| Dd::from(value)).collect();
        let row = |(point, state)| ImageRow {
            state: exact(state),
            parameters: exact(self.own(parameters, point)),
        };
        let rows = states.chunks_exact(self.local().dimension()).enumerate();
        Ok(ImageRequest { rows: rows.map(row).collect(), iterations, using, precision })
    }

    /// Parameters of a point.
    fn own<'a>(&self, parameters: &'a [f64], point: usize) -> &'a [f64] {
        let count = self.local().parameters.len();
        match parameters.len() == count {
            true => parameters,
            false => &parameters[point * count..][..count],
        }
    }

    /// Refuses arrays that are not a whole number of rows.
    fn count(&self, states: &[f64], parameters: &[f64]) -> Result<(), Error> {
        let (dimension, count) = (self.local().dimension(), self.local().parameters.len());
        let points = states.len() / dimension;
        if states.len() != points * dimension {
            let expected = format!("rows of {dimension} coordinates");
            return Err(Error::Rows { expected, found: states.len() });
        }
        if ![count, points * count].contains(&parameters.len()) {
            let expected =
                format!("one row of {count} parameters or a row for each of {points} states");
            return Err(Error::Rows { expected, found: parameters.len() });
        }
        Ok(())
    }
}

/// Images of many points, with the request.
#[derive(Clone, Debug)]
pub struct Images {
    map: Map,
    request: ImageRequest,
    records: Vec<ImageRecord>,
}

impl Images {
    /// Images.
    pub fn records(&self) -> &[ImageRecord] {
        &self.records
    }
}

impl Results for Images {
    /// Rows as CSV.
    fn text(&self) -> Result<String, Error> {
        let mut bytes = Vec::new();
        self.rows().write_csv(&mut bytes)?;
        Ok(String::from_utf8_lossy(&bytes).into_owned())
    }

    fn write_document(&mut self, _: Extent, out: &mut dyn Write) -> Result<(), ReportError> {
        let map = (self.map.local(), self.map.window());
        let (section, edge) = (self.map.section(), self.map.worst_edge());
        write_json(out, &ImageListing::list(map, &section, &self.request, &self.records, edge))
    }

    /// Table with one row for each starting point and iteration.
    fn rows(&self) -> Rows<'_> {
        image_rows(self.map.local(), &self.request, &self.records)
    }

    fn figures(&self) -> Vec<(String, Figure)> {
        Vec::new()
    }

    fn write_files(&mut self, folder: &OutputFolder) -> Result<Vec<String>, Error> {
        folder.write_streamed("images.json", |out| self.write_document(Extent::Whole, out))?;
        folder.write_streamed("images.csv", |out| self.rows().write_csv(out))?;
        Ok(Vec::new())
    }

    /// Warnings of the map, and one about points that cannot be trusted; the latter not if some
    /// points have no image.
    fn remarks(&self) -> Vec<String> {
        let words = image_outside_words(self.map.local(), &self.request, &self.records);
        let words = words.filter(|_| self.ended().is_none());
        self.map.remarks().chain(words.map(|words| format!("warning: {words}"))).collect()
    }

    /// First point without an image, if there is one.
    fn ended(&self) -> Option<Ended> {
        let lost = |record: &&ImageRecord| record.offsets.iter().any(|value| !value.is_finite());
        let missing = self.records.iter().find(lost);
        missing.map(|&ImageRecord { row, iteration, end, .. }| {
            let end = end.unwrap_or(DirectEnd::Returned);
            Ended::NoImage { row, iteration, reason: end.reason(self.map.scene()) }
        })
    }
}
