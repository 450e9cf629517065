//! The map as code: in the shape, the numbers and with the monomials that it was chosen with.

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

/// What is asked of an emission.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct EmitRequest {
    /// Language of the code.
    pub target: Target,
    /// Whether the error on the window is measured and stated.
    pub measure: bool,
    /// Whether there is a step with derivatives by the parameters too.
    pub derivatives: bool,
    /// The command that emits the same again, run in the folder of the module's file: for its
    /// header.
    pub command: Option<String>,
}

impl Default for EmitRequest {
    /// Rust, measured, with all derivatives, without a command in its header.
    fn default() -> Self {
        Self { target: Target::Rust, measure: true, derivatives: true, command: None }
    }
}

impl Map {
    /// Writes the map as a crate of Rust without dependencies into a folder.
    ///
    /// # Errors
    ///
    /// As [`module`](Self::module) and [`write_emitted`].
    pub fn emit(&self, folder: impl AsRef<Path>) -> Result<(), Error> {
        let module = self.module(EmitRequest::default())?;
        write_emitted(&EmittedCrate::standalone(&module)?, folder.as_ref())
    }

    /// The emitted module of the map.
    ///
    /// The error of what is emitted is measured against direct simulation at the points of the
    /// window that the map was measured at, and stated in the header, unless that is not asked for.
    ///
    /// # Errors
    ///
    /// [`Error::Emission`] for a map that cannot be emitted, [`Error::Convergence`] if direct
    /// simulation fails.
    pub fn module(&self, request: EmitRequest) -> Result<EmittedModule, Error> {
        Ok(self.emitted(request)?.0)
    }

    /// The emitted module of the map, and the window with the errors of what is emitted: the map's
    /// own where that was not measured.
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
            // The map itself was measured in its own numbers.
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

    /// The map as a module of WebAssembly that computes what [`discrete`](Self::discrete) does, to
    /// the last bit: factored, in double precision, with every monomial.
    ///
    /// # Errors
    ///
    /// [`Error::Emission`] for a map that cannot be emitted.
    pub fn web_module(&self) -> Result<Vec<u8>, Error> {
        web_module(self.local())
    }

    /// Modules of the same map to lower orders, both lowered together, from the next lower ones on;
    /// none of a map that is no Taylor series.
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

    /// The shape chosen with the orders, the one a scene names, or the one with fewer operations.
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

    /// The map that the emitted code computes, interpreted.
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

/// A map as a module of WebAssembly, factored, with every monomial.
fn web_module(map: &LocalMap) -> Result<Vec<u8>, Error> {
    let options =
        EmitOptions { target: Target::Wasm, derivatives: false, ..EmitOptions::default() };
    Ok(emitted_module(map, None, &options)?.content)
}

/// Writes the files of an emission into a folder; older emissions are replaced.
///
/// # Errors
///
/// Before anything is written, [`Error::Emission`] if a file that is no emission has the name of
/// one; [`Error::Report`] if a file cannot be written.
pub fn write_emitted(emitted: &EmittedCrate, folder: &Path) -> Result<(), Error> {
    EmittedCrate::refuse_foreign(folder, emitted.files.keys())?;
    Ok(OutputFolder::create(folder)?.write_all(&emitted.files)?)
}
