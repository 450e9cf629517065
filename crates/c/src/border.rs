//! The functions of the header, and the only `unsafe` of the package.
//!
//! Other languages call the functions of this module, so that the compiler cannot check the
//! callers. Callers promise what the header states and, for all functions, the following: a handle
//! is null or came from this library and was not freed; a pointer to data is null or is valid for
//! as many items as the length beside it says (one if there is no length), for reading or, for a
//! result, for writing. Null pointers and wrong lengths give [`GRAZEMAP_WRONG`]. Results are
//! written after all arguments were read, and by raw pointers, so that results and arguments may
//! overlap.

#![expect(clippy::missing_safety_doc, reason = "said above, once for all")]

use std::ffi::c_char;
use std::{ptr, slice, str};

use crate::failure::{Failure, answer, cover, last};
use crate::values::{Graze, Interruption, Map, Scene, Table};

/// Success.
pub const GRAZEMAP_DONE: i32 = 0;
/// Correct input without a result: no grazing orbit, or no map within a tolerance, for example.
pub const GRAZEMAP_ENDED: i32 = 1;
/// Wrong input or a wrong call.
pub const GRAZEMAP_WRONG: i32 = 2;
/// An internal error of the library.
pub const GRAZEMAP_PANIC: i32 = 3;
/// The call was ended by `grazemap_interruption_request`.
pub const GRAZEMAP_INTERRUPTED: i32 = 4;

/// The scene is the path of a file.
pub const GRAZEMAP_PATH: i32 = 0;
/// The scene is TOML text.
pub const GRAZEMAP_TEXT: i32 = 1;
/// The scene is the name of a scene of the catalogue.
pub const GRAZEMAP_CATALOGUE: i32 = 2;

/// Iterates with the map alone.
pub const GRAZEMAP_MAP: i32 = 0;
/// Iterates with the map inside its window and with direct simulation outside.
pub const GRAZEMAP_GUARDED: i32 = 1;
/// Iterates with direct simulation.
pub const GRAZEMAP_DIRECT: i32 = 2;

/// Version of the library, as zero-terminated text.
#[unsafe(no_mangle)] // SAFETY: no other symbol begins with `grazemap_`; so below.
pub extern "C" fn grazemap_version() -> *const c_char {
    concat!(env!("CARGO_PKG_VERSION"), "\0").as_ptr().cast()
}

/// Message of this thread's last failed call, as zero-terminated text, valid until the thread's
/// next failed call. `line` and `column` are the place of the fault in the text of a scene, from 1,
/// or 0 if there is no place; the pointers may be null.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn grazemap_last_error(
    line: *mut usize,
    column: *mut usize,
) -> *const c_char {
    let (words, at_line, at_column) = last();
    for (to, value) in [(line, at_line), (column, at_column)] {
        if !to.is_null() {
            // SAFETY: not null, and so valid for one number.
            unsafe { to.write(value) };
        }
    }
    words
}

/// Makes an interruption, with which another thread or a signal handler can end calls.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn grazemap_interruption_make(interruption: *mut *mut Interruption) -> i32 {
    // SAFETY: the caller's promise.
    answer(|| unsafe { give(interruption, || Ok(Interruption::default())) })
}

/// Covers the later calls of this thread: after a request to end they return soon, with
/// `GRAZEMAP_INTERRUPTED`. Null removes the cover.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn grazemap_interruption_cover(interruption: *const Interruption) {
    // SAFETY: the caller's promise.
    cover(unsafe { interruption.as_ref() });
}

/// Requests the end of all calls that the interruption covers. The request is permanent. Null is
/// ignored. A signal handler may call this function.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn grazemap_interruption_request(interruption: *const Interruption) {
    // SAFETY: the caller's promise.
    if let Some(interruption) = unsafe { interruption.as_ref() } {
        interruption.0.request();
    }
}

/// Reads a scene from a file (`GRAZEMAP_PATH`), a text (`GRAZEMAP_TEXT`) or the catalogue
/// (`GRAZEMAP_CATALOGUE`).
#[unsafe(no_mangle)]
pub unsafe extern "C" fn grazemap_scene_load(
    source: i32,
    text: *const c_char,
    text_length: usize,
    scene: *mut *mut Scene,
) -> i32 {
    // SAFETY: the caller's promise.
    answer(|| unsafe { give(scene, || Scene::load(source, words("text", text, text_length)?)) })
}

/// Finds the grazing orbit: the periodic orbit that just touches the stop.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn grazemap_scene_graze(scene: *const Scene, graze: *mut *mut Graze) -> i32 {
    // SAFETY: the caller's promise.
    answer(|| unsafe { give(graze, || value(scene)?.graze()) })
}

/// Writes the value of a parameter at which the orbit grazes.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn grazemap_graze_parameter(
    graze: *const Graze,
    name: *const c_char,
    name_length: usize,
    parameter: *mut f64,
) -> i32 {
    // SAFETY: the caller's promise.
    answer(|| unsafe {
        let found = value(graze)?.parameter(words("name", name, name_length)?)?;
        fill("parameter", parameter, 1, &[found])
    })
}

/// Expands the local map, to the orders that the scene names or needs for its tolerance.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn grazemap_graze_map(graze: *const Graze, map: *mut *mut Map) -> i32 {
    // SAFETY: the caller's promise.
    answer(|| unsafe { give(map, || value(graze)?.map()) })
}

/// Reads a saved `map.json`. The map is identical to the saved one, bit by bit.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn grazemap_map_load(
    path: *const c_char,
    path_length: usize,
    map: *mut *mut Map,
) -> i32 {
    // SAFETY: the caller's promise.
    answer(|| unsafe { give(map, || Map::load(words("path", path, path_length)?)) })
}

/// Writes the numbers of coordinates of a state, of active parameters, and of passages at the stop.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn grazemap_map_sizes(
    map: *const Map,
    coordinates: *mut usize,
    parameters: *mut usize,
    passages: *mut usize,
) -> i32 {
    // SAFETY: the caller's promise.
    answer(|| unsafe {
        let sizes = value(map)?.sizes();
        fill("coordinates", coordinates, 1, &sizes[..1])?;
        fill("parameters", parameters, 1, &sizes[1..2])?;
        fill("passages", passages, 1, &sizes[2..])
    })
}

/// Writes the images of states under the map: as many numbers as there are in `states`.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn grazemap_map_step(
    map: *const Map,
    states: *const f64,
    states_length: usize,
    parameters: *const f64,
    parameters_length: usize,
    images: *mut f64,
    images_length: usize,
) -> i32 {
    // SAFETY: the caller's promise.
    answer(|| unsafe {
        let rows = rows((states, states_length), (parameters, parameters_length))?;
        fill("images", images, images_length, &value(map)?.step(rows)?)
    })
}

/// Writes the derivatives of the images, state by state: for each coordinate of the image its
/// derivatives with respect to the coordinates, then to the parameters.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn grazemap_map_jacobian(
    map: *const Map,
    states: *const f64,
    states_length: usize,
    parameters: *const f64,
    parameters_length: usize,
    derivatives: *mut f64,
    derivatives_length: usize,
) -> i32 {
    // SAFETY: the caller's promise.
    answer(|| unsafe {
        let rows = rows((states, states_length), (parameters, parameters_length))?;
        fill("derivatives", derivatives, derivatives_length, &value(map)?.jacobian(rows)?)
    })
}

/// Writes for each state whether it lies in the window on which the map's error was measured: 1 or
/// 0.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn grazemap_map_inside(
    map: *const Map,
    states: *const f64,
    states_length: usize,
    parameters: *const f64,
    parameters_length: usize,
    inside: *mut u8,
    inside_length: usize,
) -> i32 {
    // SAFETY: the caller's promise.
    answer(|| unsafe {
        let rows = rows((states, states_length), (parameters, parameters_length))?;
        fill("inside", inside, inside_length, &value(map)?.inside(rows)?)
    })
}

/// Writes the orbits of states under the map (`GRAZEMAP_MAP`), guarded iteration
/// (`GRAZEMAP_GUARDED`) or direct simulation (`GRAZEMAP_DIRECT`): state by state, iterate by
/// iterate, the coordinates. After an early end they are NaN.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn grazemap_map_iterate(
    map: *const Map,
    method: i32,
    states: *const f64,
    states_length: usize,
    parameters: *const f64,
    parameters_length: usize,
    iterations: usize,
    images: *mut f64,
    images_length: usize,
) -> i32 {
    // SAFETY: the caller's promise.
    answer(|| unsafe {
        let rows = rows((states, states_length), (parameters, parameters_length))?;
        // A result too long for the machine is refused before it is computed.
        same("images", images_length, states_length.checked_mul(iterations))?;
        fill("images", images, images_length, &value(map)?.iterate(method, rows, iterations)?)
    })
}

/// Computes bifurcation diagrams: those of the tables `[[diagram]]` in the text, or those of the
/// scene if the text is empty.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn grazemap_map_diagram(
    map: *const Map,
    tables: *const c_char,
    tables_length: usize,
    diagram: *mut *mut Table,
) -> i32 {
    // SAFETY: the caller's promise.
    answer(|| unsafe {
        give(diagram, || value(map)?.diagram(words("tables", tables, tables_length)?))
    })
}

/// Writes the numbers of rows and columns of a table.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn grazemap_table_size(
    table: *const Table,
    rows: *mut usize,
    columns: *mut usize,
) -> i32 {
    // SAFETY: the caller's promise.
    answer(|| unsafe {
        let size = value(table)?.size();
        fill("rows", rows, 1, &[size.0])?;
        fill("columns", columns, 1, &[size.1])
    })
}

/// Writes a column of numbers, found by its name: one for each row, NaN if the value is unknown.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn grazemap_table_column(
    table: *const Table,
    name: *const c_char,
    name_length: usize,
    values: *mut f64,
    values_length: usize,
) -> i32 {
    // SAFETY: the caller's promise.
    answer(|| unsafe {
        let column = value(table)?.column(words("name", name, name_length)?)?;
        fill("values", values, values_length, &column)
    })
}

/// Gives the table as CSV, with the bytes that the program writes. The text belongs to the table
/// and is not zero-terminated.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn grazemap_table_csv(
    table: *const Table,
    text: *mut *const c_char,
    text_length: *mut usize,
) -> i32 {
    // SAFETY: the caller's promise.
    answer(|| unsafe {
        let csv = value(table)?.csv()?;
        fill("text", text, 1, &[csv.as_ptr().cast()])?;
        fill("text_length", text_length, 1, &[csv.len()])
    })
}

/// Frees an interruption. Calls that it covers stay covered. Null is ignored.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn grazemap_interruption_free(interruption: *mut Interruption) {
    // SAFETY: the caller's promise.
    unsafe { free(interruption) }
}

/// Frees a scene. Null is ignored.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn grazemap_scene_free(scene: *mut Scene) {
    // SAFETY: the caller's promise.
    unsafe { free(scene) }
}

/// Frees a graze. Null is ignored.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn grazemap_graze_free(graze: *mut Graze) {
    // SAFETY: the caller's promise.
    unsafe { free(graze) }
}

/// Frees a map. Null is ignored.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn grazemap_map_free(map: *mut Map) {
    // SAFETY: the caller's promise.
    unsafe { free(map) }
}

/// Frees a table and its CSV text. Null is ignored.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn grazemap_table_free(table: *mut Table) {
    // SAFETY: the caller's promise.
    unsafe { free(table) }
}

/// Reference to the value behind a handle.
unsafe fn value<'a, T>(handle: *const T) -> Result<&'a T, Failure> {
    let missing = || Failure::Call("a null handle: was its making refused?".to_owned());
    // SAFETY: a handle that is not null came from `give` and was not freed.
    unsafe { handle.as_ref() }.ok_or_else(missing)
}

/// Slice of items at a pointer.
unsafe fn items<'a, T>(what: &str, at: *const T, length: usize) -> Result<&'a [T], Failure> {
    if length == 0 {
        return Ok(&[]);
    }
    if at.is_null() || !at.is_aligned() || length > isize::MAX as usize / size_of::<T>() {
        let words = format!("`{what}` points to no {length} numbers or letters");
        return Err(Failure::Call(words));
    }
    // SAFETY: not null, aligned, no longer than memory, and as long as the caller says.
    Ok(unsafe { slice::from_raw_parts(at, length) })
}

/// Text at a pointer.
unsafe fn words<'a>(what: &str, at: *const c_char, length: usize) -> Result<&'a str, Failure> {
    // SAFETY: the promise of this function's caller.
    let bytes = unsafe { items(what, at.cast(), length) }?;
    str::from_utf8(bytes).map_err(|_| Failure::Call(format!("`{what}` is no UTF-8 text")))
}

/// Slices of states and parameters.
unsafe fn rows<'a>(
    states: (*const f64, usize),
    parameters: (*const f64, usize),
) -> Result<crate::values::Rows<'a>, Failure> {
    // SAFETY: the promise of this function's caller.
    let states = unsafe { items("states", states.0, states.1) }?;
    // SAFETY: the same.
    Ok((states, unsafe { items("parameters", parameters.0, parameters.1) }?))
}

/// Refuses a result buffer whose length is not the length of the result.
fn same(what: &str, length: usize, expected: Option<usize>) -> Result<(), Failure> {
    if expected == Some(length) {
        return Ok(());
    }
    let expected = expected.map_or("more than there are".to_owned(), |count| count.to_string());
    Err(Failure::Call(format!("`{what}` has room for {length} numbers, the result has {expected}")))
}

/// Writes a result to its buffer.
unsafe fn fill<T: Copy>(
    what: &str,
    to: *mut T,
    length: usize,
    result: &[T],
) -> Result<(), Failure> {
    same(what, length, Some(result.len()))?;
    if length > 0 && (to.is_null() || !to.is_aligned()) {
        return Err(Failure::Call(format!("`{what}` is null or not aligned")));
    }
    // SAFETY: valid for as many items as the caller says, which is the length of the result; the
    // result was allocated here and overlaps no memory of the caller.
    unsafe { ptr::copy_nonoverlapping(result.as_ptr(), to, length) };
    Ok(())
}

/// Moves a value into a new handle; writes null if the value could not be made.
unsafe fn give<T>(
    to: *mut *mut T,
    make: impl FnOnce() -> Result<T, Failure>,
) -> Result<(), Failure> {
    if to.is_null() {
        return Err(Failure::Call("the place for the new handle is null".to_owned()));
    }
    // SAFETY: not null, and so valid for one handle.
    unsafe { to.write(ptr::null_mut()) };
    let handle = Box::into_raw(Box::new(make()?));
    // SAFETY: the same.
    unsafe { to.write(handle) };
    Ok(())
}

/// Frees the value behind a handle.
unsafe fn free<T>(handle: *mut T) {
    if !handle.is_null() {
        // SAFETY: it came from `give`, and its owner gives it up.
        drop(unsafe { Box::from_raw(handle) });
    }
}
