//! A GPU, a kernel compiled for it, and the points on which the kernel runs.

use std::env::consts::{DLL_PREFIX, DLL_SUFFIX};
use std::marker::PhantomData;
use std::sync::{Arc, Mutex, PoisonError};

use cudarc::driver::{CudaContext, CudaFunction, CudaStream, DriverError};
use cudarc::nvrtc::{CompileError, CompileOptions, Ptx, compile_ptx_with_opts};

use crate::border::{self, Arguments, Buffer, Real};

/// Reason why a GPU cannot be used.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum CudaError {
    /// The driver's library was not found.
    #[error(
        "no driver of an NVIDIA graphics processor: looked for the library {looked_for} in the \
         folders of the system and of {path}"
    )]
    NoDriver {
        /// File names of the library.
        looked_for: String,
        /// Environment variable that names further folders.
        path: &'static str,
    },
    /// The compiler's library, NVRTC, was not found.
    #[error(
        "no compiler NVRTC, a part of the CUDA toolkit: looked for the library {looked_for} in the \
         folders of the system and of {path}"
    )]
    NoCompiler {
        /// File names of the library.
        looked_for: String,
        /// Environment variable that names further folders.
        path: &'static str,
    },
    /// A call of the driver failed.
    #[error("the driver of the graphics processor, {doing}: {answer}")]
    Driver {
        /// Call that failed, in words.
        doing: &'static str,
        /// Answer of the driver.
        answer: String,
    },
    /// The kernel was not compiled.
    #[error("NVRTC does not compile the kernel: {answer}")]
    Compiler {
        /// Message of the compiler.
        answer: String,
    },
}

/// Environment variable that names library folders beside those of the system.
const LIBRARY_PATH: &str = if cfg!(windows) { "PATH" } else { "LD_LIBRARY_PATH" };

/// File names tried for a library: the first few.
fn names(stem: &str) -> String {
    let plain = format!("{DLL_PREFIX}{stem}{DLL_SUFFIX}");
    let candidates = cudarc::get_lib_name_candidates(stem);
    let numbered = candidates.iter().filter(|name| **name != plain && name.starts_with(&plain));
    let mut numbered: Vec<_> = numbered.map(String::as_str).collect();
    numbered.dedup();
    [&[&*plain], &numbered[..]].concat().join(", ")
}

fn driver(doing: &'static str) -> impl Fn(DriverError) -> CudaError {
    move |error| {
        let words = error.error_string().map(|words| words.to_string_lossy().into_owned());
        let name = error.error_name().map(|name| name.to_string_lossy().into_owned());
        let answer = match (words, name) {
            (Ok(words), Ok(name)) => format!("{words} ({name})"),
            _ => format!("{:?}", error.0),
        };
        CudaError::Driver { doing, answer }
    }
}

/// A GPU.
#[derive(Clone, Debug)]
pub struct Device {
    context: Arc<CudaContext>,
    name: String,
    /// Name of the architecture, as the compiler spells it.
    architecture: String,
}

impl Device {
    /// Opens the first GPU of the machine, which `CUDA_VISIBLE_DEVICES` selects.
    ///
    /// # Errors
    ///
    /// [`CudaError::NoDriver`] or [`CudaError::NoCompiler`] if a library is not found;
    /// [`CudaError::Driver`] if there is no GPU, or if it cannot be used.
    pub fn open() -> Result<Self, CudaError> {
        let path = LIBRARY_PATH;
        if !border::has_driver() {
            let looked_for = names(if cfg!(windows) { "nvcuda" } else { "cuda" });
            return Err(CudaError::NoDriver { looked_for, path });
        }
        if !border::has_compiler() {
            return Err(CudaError::NoCompiler { looked_for: names("nvrtc"), path });
        }
        let open = driver("opening the first device");
        let context = border::first_device().map_err(&open)?;
        let (major, minor) = context.compute_capability().map_err(&open)?;
        let name = context.name().map_err(&open)?;
        Ok(Self { context, name, architecture: format!("compute_{major}{minor}") })
    }

    /// Name of the GPU given by the driver.
    pub fn name(&self) -> &str {
        &self.name
    }

    /// Compiles the kernel `name` of a CUDA source text. Its parameters are the number of points,
    /// the settings, and the inputs, constants, numbers and words of [`Points`].
    ///
    /// Products and sums are rounded separately (no fused multiply-add), so that results have the
    /// bits of a CPU that does the same.
    ///
    /// # Errors
    ///
    /// [`CudaError::Compiler`] if the text does not compile; [`CudaError::Driver`] if the kernel
    /// cannot be loaded.
    pub fn kernel<T: Real>(&self, text: &str, name: &str) -> Result<Kernel<T>, CudaError> {
        let load = driver("loading the kernel");
        let module = self.context.load_module(compiled(text, &self.architecture)?);
        let function = module.and_then(|module| module.load_function(name)).map_err(load)?;
        let context = self.context.clone();
        Ok(Kernel { context, function, idle: Mutex::default(), number: PhantomData })
    }
}

/// A text compiled for an architecture, or, if the compiler does not know it, for the compiler's
/// default, which the driver accepts as well.
fn compiled(text: &str, architecture: &str) -> Result<Ptx, CudaError> {
    if text.contains('\0') {
        return Err(CudaError::Compiler { answer: "the text holds a null character".to_owned() });
    }
    let compile = |more: &[String]| {
        let apart = ["--define-macro=GRAZEMAP_SEPARATE".to_owned()];
        let options = CompileOptions {
            ftz: Some(false),
            prec_sqrt: Some(true),
            prec_div: Some(true),
            fmad: Some(false),
            options: [&apart, more].concat(),
            ..CompileOptions::default()
        };
        compile_ptx_with_opts(text, options)
    };
    let found = match compile(&[format!("--gpu-architecture={architecture}")]) {
        Err(CompileError::CompileError { nvrtc, .. })
            if format!("{:?}", nvrtc.0) == "NVRTC_ERROR_INVALID_OPTION" =>
        {
            compile(&[])
        }
        found => found,
    };
    found.map_err(|error| CudaError::Compiler {
        answer: match error {
            CompileError::CompileError { log, .. } => log.to_string_lossy().trim().to_owned(),
            other => other.to_string(),
        },
    })
}

/// Points on which a kernel runs. In device memory each quantity is stored component by component:
/// the first number of all points of a piece, then the second, and so on.
#[derive(Clone, Copy, Debug)]
pub struct Points<'a, T> {
    /// Number of points.
    pub count: usize,
    /// Largest number of points in a piece.
    pub piece: usize,
    /// Settings common to all points.
    pub settings: [i64; 3],
    /// Input numbers of every point, point after point.
    pub inputs: &'a [T],
    /// Numbers common to all points.
    pub constants: &'a [T],
    /// Count of numbers that the kernel writes for each point.
    pub numbers: usize,
    /// Count of words that the kernel writes for each point.
    pub words: usize,
}

/// Results of a kernel for one piece, component by component: the first number of all points, and
/// so on.
#[derive(Clone, Copy, Debug)]
pub struct Piece<'a, T> {
    /// Index of the first point.
    pub first: usize,
    /// Number of points.
    pub count: usize,
    /// Numbers that the kernel wrote.
    pub numbers: &'a [T],
    /// Words that the kernel wrote.
    pub words: &'a [i64],
}

/// A kernel for points, compiled and loaded. Several threads may run the kernel at once.
#[derive(Debug)]
pub struct Kernel<T> {
    context: Arc<CudaContext>,
    function: CudaFunction,
    /// Streams and memory of finished runs, to be used again.
    idle: Mutex<Vec<[Track<T>; 2]>>,
    number: PhantomData<T>,
}

impl<T: Real> Kernel<T> {
    /// Runs the kernel on points. `take` is called with every piece in turn, while later pieces are
    /// computed.
    ///
    /// # Errors
    ///
    /// [`CudaError::Driver`] if the device has too little memory, or fails.
    pub fn run(
        &self,
        points: &Points<'_, T>,
        take: &mut dyn FnMut(Piece<'_, T>),
    ) -> Result<(), CudaError> {
        let answer = driver("running the kernel");
        self.pieces(points, take).map_err(answer)
    }

    fn pieces(
        &self,
        points: &Points<'_, T>,
        take: &mut dyn FnMut(Piece<'_, T>),
    ) -> Result<(), DriverError> {
        let idle = || self.idle.lock().unwrap_or_else(PoisonError::into_inner);
        let waiting = idle().pop();
        let mut tracks = match waiting {
            Some(tracks) => tracks,
            None => [Track::new(&self.context)?, Track::new(&self.context)?],
        };
        let piece = points.piece.clamp(1, points.count.max(1));
        tracks.iter_mut().try_for_each(|track| track.reserve(points, piece))?;
        let firsts: Vec<usize> = (0..points.count).step_by(piece).collect();
        for (number, &first) in firsts.iter().enumerate() {
            let track = &mut tracks[number % 2];
            if number >= 2 {
                track.give(points, take)?;
            }
            track.begin(&self.function, points, first..points.count.min(first + piece))?;
        }
        for number in firsts.len().saturating_sub(2)..firsts.len() {
            tracks[number % 2].give(points, take)?;
        }
        idle().push(tracks);
        Ok(())
    }
}

/// A stream with memory for a piece.
#[derive(Debug)]
struct Track<T> {
    stream: Arc<CudaStream>,
    inputs: Buffer<T>,
    constants: Buffer<T>,
    numbers: Buffer<T>,
    words: Buffer<i64>,
    /// Range of the points that were started.
    begun: std::ops::Range<usize>,
}

impl<T: Real> Track<T> {
    fn new(context: &Arc<CudaContext>) -> Result<Self, DriverError> {
        let stream = context.new_stream()?;
        Ok(Self {
            inputs: Buffer::new(&stream, 0)?,
            constants: Buffer::new(&stream, 0)?,
            numbers: Buffer::new(&stream, 0)?,
            words: Buffer::new(&stream, 0)?,
            begun: 0..0,
            stream,
        })
    }

    /// Allocates memory for a piece, and copies the data common to all points.
    fn reserve(&mut self, points: &Points<'_, T>, piece: usize) -> Result<(), DriverError> {
        let stream = &self.stream;
        let inputs = points.inputs.len() / points.count.max(1);
        enlarge(&mut self.inputs, stream, inputs * piece)?;
        enlarge(&mut self.constants, stream, points.constants.len())?;
        enlarge(&mut self.numbers, stream, points.numbers * piece)?;
        enlarge(&mut self.words, stream, points.words * piece)?;
        let constants = self.constants.host.as_mut_slice()?;
        constants[..points.constants.len()].copy_from_slice(points.constants);
        stream.memcpy_htod(&self.constants.host, &mut self.constants.device)
    }

    /// Queues a piece in the stream: copies in, the kernel, copies out.
    fn begin(
        &mut self,
        kernel: &CudaFunction,
        points: &Points<'_, T>,
        begun: std::ops::Range<usize>,
    ) -> Result<(), DriverError> {
        let count = begun.len();
        let width = points.inputs.len() / points.count;
        let rows = points.inputs[begun.start * width..begun.end * width].chunks_exact(width);
        let inputs = self.inputs.host.as_mut_slice()?;
        for (point, row) in rows.enumerate() {
            for (number, &value) in row.iter().enumerate() {
                inputs[number * count + point] = value;
            }
        }
        self.begun = begun;
        let stream = &self.stream;
        stream.memcpy_htod(&self.inputs.host, &mut self.inputs.device)?;
        let arguments = Arguments {
            count,
            settings: points.settings,
            inputs: &self.inputs.device,
            constants: &self.constants.device,
            numbers: &mut self.numbers.device,
            words: &mut self.words.device,
        };
        border::launch(stream, kernel, arguments)?;
        let numbers = self.numbers.device.slice(..points.numbers * count);
        stream.memcpy_dtoh(&numbers, &mut self.numbers.host)?;
        let words = self.words.device.slice(..points.words * count);
        stream.memcpy_dtoh(&words, &mut self.words.host)
    }

    /// Waits for the piece that was started and passes it on.
    fn give(
        &mut self,
        points: &Points<'_, T>,
        take: &mut dyn FnMut(Piece<'_, T>),
    ) -> Result<(), DriverError> {
        let (first, count) = (self.begun.start, self.begun.len());
        let numbers = &self.numbers.host.as_slice()?[..points.numbers * count];
        let words = &self.words.host.as_slice()?[..points.words * count];
        take(Piece { first, count, numbers, words });
        Ok(())
    }
}

/// Enlarges a buffer to `count` numbers if it is smaller.
fn enlarge<T: cudarc::driver::DeviceRepr + cudarc::driver::ValidAsZeroBits>(
    buffer: &mut Buffer<T>,
    stream: &Arc<CudaStream>,
    count: usize,
) -> Result<(), DriverError> {
    if buffer.device.len() < count {
        *buffer = Buffer::new(stream, count)?;
    }
    Ok(())
}
