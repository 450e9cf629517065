//! Arrays of points: images, derivatives and orbits; and the layout of images for `image`.
//!
//! States are rows of section coordinates, one after another. Parameters are one row for all
//! states, or one row for each. Both are offsets from the grazing orbit.

use super::{Ended, Error, Map, refuse_memory};
use crate::analysis::{
    DirectEnd, ImageRecord, ImageRequest, ImageRow, Precision, Progress, Using, batch_bytes,
    orbit_bytes,
};
use crate::iteration::Batch;
use crate::numeric::Dd;
use crate::report::{ImageListing, Rows, image_outside_words, image_rows, to_json};

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
    /// let map = Scene::load("scenes/linear.toml")?.graze()?.map()?;
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
        let count = states.len() / self.local().dimension();
        refuse_memory(orbit_bytes(self.scene(), count, iterations))?;
        if (using, precision) == (Using::Map, Precision::F64) {
            return self.map_orbits(states, &parameters, iterations, progress);
        }
        let request = self.image_request((&states, &parameters), iterations, (using, precision))?;
        let dimension = self.local().dimension();
        let mut images = vec![f64::NAN; states.len() * iterations];
        for record in self.images(&request)? {
            let place = (record.row * iterations + record.iteration - 1) * dimension;
            let image = &mut images[place..][..dimension];
            image.iter_mut().zip(&record.offsets).for_each(|(to, from)| *to = from.to_f64());
        }
        Ok(images)
    }

    /// Computes orbits by the map, all points together for each iterate.
    fn map_orbits(
        &self,
        mut states: Vec<f64>,
        parameters: &[f64],
        iterations: usize,
        progress: &dyn Progress,
    ) -> Result<Vec<f64>, Error> {
        let dimension = self.local().dimension();
        progress.expect(iterations as u64);
        let mut images = vec![0.0; states.len() * iterations];
        for iterate in 0..iterations {
            let Batch { rows, width } = self.batch(&states, parameters, false)?;
            for (point, row) in rows.chunks_exact(width).enumerate() {
                let image = &row[..dimension];
                states[point * dimension..][..dimension].copy_from_slice(image);
                let place = (point * iterations + iterate) * dimension;
                images[place..][..dimension].copy_from_slice(image);
            }
            progress.advance(1);
        }
        Ok(images)
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
    /// Table with one row for each starting point and iteration.
    pub fn rows(&self) -> Rows<'_> {
        image_rows(self.map.local(), &self.request, &self.records)
    }

    /// Images.
    pub fn records(&self) -> &[ImageRecord] {
        &self.records
    }

    /// JSON document.
    ///
    /// # Errors
    ///
    /// [`Error::Report`] if the document cannot be serialised.
    pub fn document(&self) -> Result<String, Error> {
        let map = (self.map.local(), self.map.window());
        let (section, edge) = (self.map.section(), self.map.worst_edge());
        let list = ImageListing::list(map, &section, &self.request, &self.records, edge);
        Ok(to_json(&list)?)
    }

    /// Warning about points that cannot be trusted; none if some points have no image.
    pub fn remarks(&self) -> impl Iterator<Item = String> + use<> {
        let words = image_outside_words(self.map.local(), &self.request, &self.records);
        let words = words.filter(|_| self.ended().is_none());
        words.map(|words| format!("warning: {words}")).into_iter()
    }

    /// First point without an image, if there is one.
    pub fn ended(&self) -> Option<Ended> {
        let lost = |record: &&ImageRecord| record.offsets.iter().any(|value| !value.is_finite());
        let missing = self.records.iter().find(lost);
        missing.map(|&ImageRecord { row, iteration, end, .. }| {
            let end = end.unwrap_or(DirectEnd::Returned);
            Ended::NoImage { row, iteration, reason: end.reason(self.map.scene()) }
        })
    }
}
