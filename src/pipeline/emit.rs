//! Emission of a map as source code, in its chosen shape, precision and monomials.

use std::path::Path;

use super::map::refuse_depth_variables;
use super::{Error, Map};
use crate::convergence::{Choice, MapFamily, MeasuredWindow};
use crate::emission::{
    EmitOptions, EmittedCrate, EmittedModule, EmittedShape, Target, emitted_module,
};
use crate::expansion::{Expander, LocalMap, MapOrders, prune, prune_composed};
use crate::iteration::HornerMap;
use crate::model::Shape;
use crate::report::OutputFolder;

/// Options of an emission.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct EmitRequest {
    /// Language of the code.
    pub target: Target,
    /// Whether the error on the window is measured and stated in the header.
    pub measure: bool,
    /// Whether the code also computes derivatives by the parameters.
    pub derivatives: bool,
    /// Command that reproduces the emission, run in the folder of the module's file; it is stated
    /// in the header.
    pub command: Option<String>,
}

impl Default for EmitRequest {
    /// Rust, with measured error and all derivatives, without a command in the header.
    fn default() -> Self {
        Self { target: Target::Rust, measure: true, derivatives: true, command: None }
    }
}

impl Map {
    /// Writes the map as a Rust crate without dependencies into a folder.
    ///
    /// # Errors
    ///
    /// As [`module`](Self::module) and [`write_emitted`].
    pub fn emit(&self, folder: impl AsRef<Path>) -> Result<(), Error> {
        let module = self.module(EmitRequest::default())?;
        write_emitted(&EmittedCrate::standalone(&module)?, folder.as_ref())
    }

    /// Emits the map as a module.
    ///
    /// Unless the request disables it, the error of the emitted form against direct simulation is
    /// measured at the window's sample points and stated in the header.
    ///
    /// # Errors
    ///
    /// [`Error::Emission`] for a map that cannot be emitted, [`Error::Convergence`] if direct
    /// simulation fails.
    pub fn module(&self, request: EmitRequest) -> Result<EmittedModule, Error> {
        Ok(self.emitted(request)?.0)
    }

    /// Emits the map as a module, and returns the window with the errors of the emitted form (the
    /// map's own errors if the emitted form was not measured).
    ///
    /// # Errors
    ///
    /// As [`module`](Self::module).
    pub fn emitted(&self, request: EmitRequest) -> Result<(EmittedModule, MeasuredWindow), Error> {
        refuse_depth_variables(&Expander::new(self.scene(), self.orbit())?)?;
        let (choice, precision) = (self.choice(), self.precision());
        let mut options = EmitOptions {
            target: request.target,
            shape: EmittedShape::Factored,
            precision,
            lanes: self.scene().emit.lanes(precision),
            tolerance: choice.map(|choice| choice.tolerance).or(self.scene().emit.tolerance),
            drop_within: choice.and_then(Choice::drop_after),
            measured_error: None,
            derivatives: request.derivatives,
            command: request.command,
        };
        options.shape = self.emitted_shape(&options)?;
        let mut window = self.window().clone();
        if request.measure {
            // NOTE: this form is the map itself, whose errors are known.
            let is_itself =
                options.shape == EmittedShape::Factored && options.drop_within.is_none();
            if let Some(images) = self.exact_images()?.filter(|_| !is_itself) {
                let form = self.as_emitted(&options)?.in_format(precision);
                let of = (self.scene(), self.orbit());
                window = window.of_form(of, self.local(), &*form, images)?;
            }
            options.measured_error = window.largest_error();
        }
        Ok((self.in_shape(&options)?, window))
    }

    /// WebAssembly module that computes the same bits as [`discrete`](Self::discrete): factored, in
    /// double precision, with every monomial.
    ///
    /// # Errors
    ///
    /// [`Error::Emission`] for a map that cannot be emitted.
    pub fn web_module(&self) -> Result<Vec<u8>, Error> {
        web_module(self.local())
    }

    /// WebAssembly modules of lower orders, both orders lowered together, starting with the next
    /// lower pair; empty for a map that is not a Taylor series.
    ///
    /// # Errors
    ///
    /// [`Error::Expansion`] if the scene cannot be expanded, [`Error::Emission`] for a map that
    /// cannot be emitted.
    pub fn lower_web_modules(&self) -> Result<Vec<(MapOrders, Vec<u8>)>, Error> {
        let (highest, local) = (self.orders(), self.local());
        if local.is_flown() || local.fitted_to.is_some() {
            return Ok(Vec::new());
        }
        let family = MapFamily::new(self.scene(), self.orbit(), highest)?;
        let fewer = highest.smooth_order.min(highest.contact_weight);
        let lower = (1..fewer).map(|less| MapOrders {
            smooth_order: highest.smooth_order - less,
            contact_weight: highest.contact_weight - less,
        });
        lower.map(|orders| Ok((orders, web_module(&family.map(orders)?)?))).collect()
    }

    /// Emitted shape: the scene's (which includes the one chosen with the orders), else the one
    /// with fewer operations.
    fn emitted_shape(&self, options: &EmitOptions) -> Result<EmittedShape, Error> {
        match self.scene().emit.shape {
            Shape::Factored | Shape::Flown => return Ok(EmittedShape::Factored),
            Shape::Composed => return Ok(EmittedShape::Composed),
            Shape::Auto => {}
        }
        let operations = |shape| {
            let options = EmitOptions { shape, ..options.clone() };
            Ok::<_, Error>(self.in_shape(&options)?.frozen_operations.total())
        };
        let composed = operations(EmittedShape::Composed)?;
        Ok(match composed < operations(EmittedShape::Factored)? {
            true => EmittedShape::Composed,
            false => EmittedShape::Factored,
        })
    }

    fn in_shape(&self, options: &EmitOptions) -> Result<EmittedModule, Error> {
        let composed = match options.shape {
            EmittedShape::Composed => Some(self.composed()?),
            EmittedShape::Factored => None,
        };
        Ok(emitted_module(self.local(), composed, options)?)
    }

    /// Interpreted map with the arithmetic of the emitted code.
    fn as_emitted(&self, options: &EmitOptions) -> Result<HornerMap, Error> {
        let map = self.local();
        Ok(match (options.shape, options.drop_within) {
            (EmittedShape::Factored, None) => self.discrete().clone(),
            (EmittedShape::Factored, Some(tolerance)) => HornerMap::new(&prune(map, tolerance).0),
            (EmittedShape::Composed, None) => HornerMap::composed(map, self.composed()?),
            (EmittedShape::Composed, Some(tolerance)) => {
                let composed = prune_composed(map, self.composed()?, tolerance).0;
                HornerMap::composed(map, &composed)
            }
        })
    }
}

/// WebAssembly module of a map, factored, with every monomial.
fn web_module(map: &LocalMap) -> Result<Vec<u8>, Error> {
    let options =
        EmitOptions { target: Target::Wasm, derivatives: false, ..EmitOptions::default() };
    Ok(emitted_module(map, None, &options)?.content)
}

/// Writes the files of an emission into a folder. Older emissions are replaced.
///
/// # Errors
///
/// [`Error::Emission`], before anything is written, if a file with one of the names is not an
/// emission; [`Error::Report`] if a file cannot be written.
pub fn write_emitted(emitted: &EmittedCrate, folder: &Path) -> Result<(), Error> {
    EmittedCrate::refuse_foreign(folder, emitted.files.keys())?;
    Ok(OutputFolder::create(folder)?.write_all(&emitted.files)?)
}
