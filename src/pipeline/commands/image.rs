//! `image`: images of section points, by the map, its parts or direct simulation.

use crate::analysis::{ImageRecord, ImageRequest};
use crate::pipeline::{Ended, Error, Map};
use crate::report::{ImageListing, Rows, image_outside_words, image_rows, to_json};

/// Images of many points, with what was asked for.
#[derive(Clone, Debug)]
pub struct Images {
    map: Map,
    request: ImageRequest,
    records: Vec<ImageRecord>,
}

impl Map {
    /// Images of many points, to be laid out.
    ///
    /// # Errors
    ///
    /// As [`images`](Self::images).
    pub fn image_answer(&self, request: ImageRequest) -> Result<Images, Error> {
        let records = self.images(&request)?;
        Ok(Images { map: self.clone(), request, records })
    }
}

impl Images {
    /// The table: a row for every starting point and iteration.
    pub fn rows(&self) -> Rows<'_> {
        image_rows(self.map.local(), &self.request, &self.records)
    }

    /// The images themselves.
    pub fn records(&self) -> &[ImageRecord] {
        &self.records
    }

    /// The document: JSON.
    ///
    /// # Errors
    ///
    /// [`Error::Report`] if the writer refuses.
    pub fn document(&self) -> Result<String, Error> {
        let map = (self.map.local(), self.map.window());
        let (section, edge) = (self.map.section(), self.map.worst_edge());
        let list = ImageListing::list(map, &section, &self.request, &self.records, edge);
        Ok(to_json(&list)?)
    }

    /// Which points may not be trusted; nothing where some have no image.
    pub fn remarks(&self) -> impl Iterator<Item = String> + use<> {
        let words = image_outside_words(self.map.local(), &self.request, &self.records);
        let words = words.filter(|_| self.ended().is_none());
        words.map(|words| format!("warning: {words}")).into_iter()
    }

    /// The first point without an image, if there is one.
    pub fn ended(&self) -> Option<Ended> {
        let lost = |record: &&ImageRecord| record.offsets.iter().any(|value| !value.is_finite());
        let missing = self.records.iter().find(lost);
        missing.map(|&ImageRecord { row, iteration, end, .. }| Ended::NoImage {
            row,
            iteration,
            end,
        })
    }
}
