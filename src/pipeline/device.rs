//! Device that iterates maps for charts: the CPU or a GPU.

#[cfg(feature = "cuda")]
use std::sync::Arc;

use super::{Error, Map};
#[cfg(feature = "cuda")]
use crate::emission::{EmitOptions, Target, emitted_module};
#[cfg(feature = "cuda")]
use crate::iteration::{DeviceMap, KernelPiece, KernelPoints, PointKernel};

/// Pieces per launch, so that copies overlap with kernels, and fewest points of a piece.
#[cfg(feature = "cuda")]
const PIECES: usize = 4;
#[cfg(feature = "cuda")]
const FEWEST: usize = 256;

/// Device that iterates maps for charts.
#[derive(Clone, Debug, Default)]
pub enum Device {
    /// CPU of this machine.
    #[default]
    Processor,
    /// GPU, helped by the CPU.
    #[cfg(feature = "cuda")]
    Cuda(grazemap_cuda::Device),
}

impl Device {
    /// Names of the devices.
    pub const NAMES: [&str; 2] = ["cpu", "cuda"];

    /// Device by name: `cpu`, or `cuda` for the first GPU that the driver lists.
    ///
    /// # Errors
    ///
    /// [`Error::NoDevice`] for another name, and if there is no GPU, no driver or no NVRTC
    /// compiler.
    ///
    /// ```
    /// use grazemap::pipeline::Device;
    ///
    /// assert!(Device::open("cpu").is_ok());
    /// assert!(Device::open("abacus").is_err());
    /// ```
    pub fn open(name: &str) -> Result<Self, Error> {
        match name {
            "cpu" => Ok(Self::Processor),
            "cuda" => cuda(),
            _ => Err(no_device(format!("`{name}` is none; expected {}", Self::NAMES.join(" or ")))),
        }
    }
}

fn no_device(reason: String) -> Error {
    Error::NoDevice { reason }
}

#[cfg(feature = "cuda")]
fn cuda() -> Result<Device, Error> {
    let device = grazemap_cuda::Device::open().map_err(|error| no_device(error.to_string()))?;
    Ok(Device::Cuda(device))
}

#[cfg(not(feature = "cuda"))]
fn cuda() -> Result<Device, Error> {
    Err(no_device("this program was built without the feature `cuda`".to_owned()))
}

impl Map {
    /// Copy of the map whose charts are iterated on a device.
    ///
    /// Results have the same bits as those of the CPU: the emitted code is factored, in double
    /// precision, keeps every monomial and rounds products and sums separately. Orbits that leave
    /// the window are handed back to guarded iteration on the CPU.
    ///
    /// # Errors
    ///
    /// [`Error::Emission`] for a map that cannot be emitted; [`Error::NoDevice`] if the device
    /// refuses the code.
    pub fn on(&self, device: &Device) -> Result<Self, Error> {
        let device = match device {
            Device::Processor => None,
            #[cfg(feature = "cuda")]
            Device::Cuda(device) => Some(Arc::new(on_cuda(self, device)?)),
        };
        Ok(self.with_device(device))
    }
}

#[cfg(feature = "cuda")]
fn on_cuda(map: &Map, device: &grazemap_cuda::Device) -> Result<DeviceMap, Error> {
    let options =
        EmitOptions { target: Target::Cuda, derivatives: false, ..EmitOptions::default() };
    let module = emitted_module(map.local(), None, &options)?;
    let name = format!("{}_orbits", module.identifier);
    let kernel = device.kernel(&module.text(), &name);
    let kernel = kernel.map_err(|error| no_device(error.to_string()))?;
    let local = map.local();
    let processor = Box::new(CudaKernel { device: device.name().to_owned(), kernel });
    Ok(DeviceMap::new(processor, local.dimension(), local.passages()))
}

/// Kernel on a GPU.
#[cfg(feature = "cuda")]
#[derive(Debug)]
struct CudaKernel {
    device: String,
    kernel: grazemap_cuda::Kernel<f64>,
}

#[cfg(feature = "cuda")]
impl PointKernel for CudaKernel {
    fn name(&self) -> &str {
        &self.device
    }

    fn run(
        &self,
        points: &KernelPoints<'_>,
        take: &mut dyn FnMut(KernelPiece<'_>),
    ) -> Result<(), String> {
        let points = grazemap_cuda::Points {
            count: points.count,
            piece: points.count.div_ceil(PIECES).max(FEWEST),
            settings: points.settings,
            inputs: points.inputs,
            constants: points.constants,
            numbers: points.numbers,
            words: KernelPiece::WORDS,
        };
        let mut take = |piece: grazemap_cuda::Piece<'_, f64>| {
            let grazemap_cuda::Piece { count, numbers, words, .. } = piece;
            take(KernelPiece { count, numbers, words });
        };
        self.kernel.run(&points, &mut take).map_err(|error| error.to_string())
    }
}
