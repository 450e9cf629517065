//! A graphics processor, a kernel compiled for it, and points that it runs on.

use std::env::consts::{DLL_PREFIX, DLL_SUFFIX};
use std::marker::PhantomData;
use std::sync::{Arc, Mutex, PoisonError};

use cudarc::driver::{CudaContext, CudaFunction, CudaStream, DriverError};
use cudarc::nvrtc::{CompileError, CompileOptions, Ptx, compile_ptx_with_opts};

use crate::border::{self, Arguments, Buffer, Real};

/// What keeps a graphics processor from being used.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum CudaError {
    /// No driver.
    #[error(
        "no driver of an NVIDIA graphics processor: looked for the library {looked_for} in the \
         folders of the system and of {path}"
    )]
    NoDriver {
        /// The names of the library.
        looked_for: String,
        /// The variable that names further folders.
        path: &'static str,
    },
    /// No compiler.
    #[error(
        "no compiler NVRTC, a part of the CUDA toolkit: looked for the library {looked_for} in the \
         folders of the system and of {path}"
    )]
    NoCompiler {
        /// The names of the library.
        looked_for: String,
        /// The variable that names further folders.
        path: &'static str,
    },
    /// The driver refuses.
    #[error("the driver of the graphics processor, {doing}: {answer}")]
    Driver {
        /// What was asked of it.
        doing: &'static str,
        /// What it said.
        answer: String,
    },
    /// The compiler refuses.
    #[error("NVRTC does not compile the kernel: {answer}")]
    Compiler {
        /// What it said.
        answer: String,
    },
}

/// The variable that names folders of libraries beside those of the system.
const LIBRARY_PATH: &str = if cfg!(windows) { "PATH" } else { "LD_LIBRARY_PATH" };

/// The first names that a library is looked for by.
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

/// A graphics processor.
#[derive(Clone, Debug)]
pub struct Device {
    context: Arc<CudaContext>,
    name: String,
    /// As the compiler calls it.
    architecture: String,
}

impl Device {
    /// The first graphics processor of the machine; `CUDA_VISIBLE_DEVICES` says which that is.
    ///
    /// # Errors
    ///
    /// [`CudaError::NoDriver`], [`CudaError::NoCompiler`] where a library is not found;
    /// [`CudaError::Driver`] where there is no graphics processor, or it cannot be used.
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

    /// What the driver calls it.
    pub fn name(&self) -> &str {
        &self.name
    }

    /// The kernel of this name in a text of CUDA, which takes the points' count, the settings, and
    /// the inputs, constants, numbers and words of [`Points`].
    ///
    /// Products and sums are rounded apart, so that numbers have the bits of a processor that does
    /// so.
    ///
    /// # Errors
    ///
    /// [`CudaError::Compiler`] for a text that is not compiled; [`CudaError::Driver`] for one that
    /// cannot be loaded.
    pub fn kernel<T: Real>(&self, text: &str, name: &str) -> Result<Kernel<T>, CudaError> {
        let load = driver("loading the kernel");
        let module = self.context.load_module(compiled(text, &self.architecture)?);
        let function = module.and_then(|module| module.load_function(name)).map_err(load)?;
        let context = self.context.clone();
        Ok(Kernel { context, function, idle: Mutex::default(), number: PhantomData })
    }
}

/// A text compiled for an architecture; for the compiler's own choice where it does not know it,
/// which the driver takes as well.
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

/// Points that a kernel runs on. In its memory everything lies one number after another, of all
/// points of a piece each.
#[derive(Clone, Copy, Debug)]
pub struct Points<'a, T> {
    /// Number of points.
    pub count: usize,
    /// Most points of a piece.
    pub piece: usize,
    /// What all points have in common.
    pub settings: [i64; 3],
    /// The numbers of every point, point after point.
    pub inputs: &'a [T],
    /// Numbers that all points have in common.
    pub constants: &'a [T],
    /// Numbers that the kernel writes for each point.
    pub numbers: usize,
    /// Words that the kernel writes for each point.
    pub words: usize,
}

/// What a kernel wrote for some points, one number after another, of all points of the piece each.
#[derive(Clone, Copy, Debug)]
pub struct Piece<'a, T> {
    /// The first of its points.
    pub first: usize,
    /// Number of its points.
    pub count: usize,
    /// Numbers.
    pub numbers: &'a [T],
    /// Words.
    pub words: &'a [i64],
}

/// A kernel for points, compiled and loaded. It may be run from several threads at once.
#[derive(Debug)]
pub struct Kernel<T> {
    context: Arc<CudaContext>,
    function: CudaFunction,
    /// Streams and memory of runs that have ended.
    idle: Mutex<Vec<[Track<T>; 2]>>,
    number: PhantomData<T>,
}

impl<T: Real> Kernel<T> {
    /// Runs the kernel on points; `take` is given every piece in turn, while later ones are
    /// computed.
    ///
    /// # Errors
    ///
    /// [`CudaError::Driver`] where the device has not memory enough, or fails.
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

/// A stream with the memory of a piece.
#[derive(Debug)]
struct Track<T> {
    stream: Arc<CudaStream>,
    inputs: Buffer<T>,
    constants: Buffer<T>,
    numbers: Buffer<T>,
    words: Buffer<i64>,
    /// The points that were begun.
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

    /// Room for a piece, and what all its points have in common.
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

    /// Puts a piece into the stream: copies in, the kernel, copies out.
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

    /// Waits for the piece that was begun and hands it on.
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

/// Memory for so many numbers, anew where there is less.
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
