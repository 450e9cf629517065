//! What is not safe code: asking for libraries, memory that is unset, launching a kernel.

use std::sync::Arc;

use cudarc::driver::{
    CudaContext, CudaFunction, CudaSlice, CudaStream, DeviceRepr, DriverError, LaunchConfig,
    PinnedHostSlice, PushKernelArg, ValidAsZeroBits,
};

/// Threads of a block.
const THREADS: u32 = 128;

/// A number of a kernel: `f64` or `f32`.
pub trait Real: DeviceRepr + ValidAsZeroBits + Copy + Default + Send + Sync + 'static {}

impl Real for f64 {}
impl Real for f32 {}

/// Whether the library of the driver is found.
pub(super) fn has_driver() -> bool {
    // SAFETY: loading a library runs what it does at its start; it is the driver that the user
    // installed or put on the loader's path.
    unsafe { cudarc::driver::sys::is_culib_present() }
}

/// Whether the library of the compiler is found.
pub(super) fn has_compiler() -> bool {
    // SAFETY: as of the driver.
    unsafe { cudarc::nvrtc::sys::is_culib_present() }
}

/// Memory of a device beside memory of this machine that it copies to and from.
#[derive(Debug)]
pub(super) struct Buffer<T> {
    pub(super) device: CudaSlice<T>,
    pub(super) host: PinnedHostSlice<T>,
}

impl<T: DeviceRepr + ValidAsZeroBits> Buffer<T> {
    /// So many numbers, all 0.
    pub(super) fn new(stream: &Arc<CudaStream>, count: usize) -> Result<Self, DriverError> {
        let count = count.max(1);
        // SAFETY: the memory is unset, and set below before anything reads it.
        let mut host = unsafe { stream.context().alloc_pinned_with_flags(count, 0)? };
        let device = stream.alloc_zeros(count)?;
        stream.memcpy_dtoh(&device, &mut host)?;
        Ok(Self { device, host })
    }
}

/// What a kernel is launched with, all on one device.
pub(super) struct Arguments<'a, T> {
    pub(super) count: usize,
    pub(super) settings: [i64; 3],
    pub(super) inputs: &'a CudaSlice<T>,
    pub(super) constants: &'a CudaSlice<T>,
    pub(super) numbers: &'a mut CudaSlice<T>,
    pub(super) words: &'a mut CudaSlice<i64>,
}

/// Puts a launch into a stream: a thread for each point.
///
/// The kernel is one of a text of this house: it takes a count, three settings, and four arrays, of
/// which it reads the first two and writes the last two, no further than `count` times as many
/// numbers as [`Points`](super::Points) says.
pub(super) fn launch<T: Real>(
    stream: &CudaStream,
    kernel: &CudaFunction,
    arguments: Arguments<'_, T>,
) -> Result<(), DriverError> {
    let count = arguments.count as i64;
    let blocks = u32::try_from(arguments.count.div_ceil(THREADS as usize)).unwrap_or(u32::MAX);
    let mut launch = stream.launch_builder(kernel);
    launch.arg(&count);
    arguments.settings.iter().for_each(|setting| {
        launch.arg(setting);
    });
    launch.arg(arguments.inputs).arg(arguments.constants);
    launch.arg(arguments.numbers).arg(arguments.words);
    let shape =
        LaunchConfig { grid_dim: (blocks, 1, 1), block_dim: (THREADS, 1, 1), shared_mem_bytes: 0 };
    // SAFETY: the arguments are those of the kernel, in its order and of its types, as said above.
    // The buffers hold as many numbers as the kernel reads and writes: `Track::reserve` makes them.
    unsafe { launch.launch(shape)? };
    Ok(())
}

/// The first graphics processor.
pub(super) fn first_device() -> Result<Arc<CudaContext>, DriverError> {
    CudaContext::new(0)
}
