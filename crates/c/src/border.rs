//! The functions of the header, and the only `unsafe` of the package.
//!
//! Every function of this module is called from other languages, so that the compiler knows nothing
//! of its callers. What they promise stands in the header and, once for all functions, here: a
//! handle is null or came from this library and was not freed; a pointer to data is null or is
//! valid for as many items as the length beside it says, one where there is none, for reading or,
//! where it is a result, for writing. Null pointers and wrong lengths are answered by
//! [`GRAZEMAP_WRONG`]. Results are written after all arguments were read, and by raw pointers, so
//! that they may lie where the arguments are.

#![expect(clippy::missing_safety_doc, reason = "said above, once for all")]

use std::ffi::c_char;
use std::{ptr, slice, str};

use crate::failure::{Failure, answer, cover, last};
use crate::values::{Graze, Interruption, Map, Scene, Table};

/// Done.
pub const GRAZEMAP_DONE: i32 = 0;
/// The input was right and the mathematics ended otherwise: no grazing orbit, no map for a
/// tolerance.
pub const GRAZEMAP_ENDED: i32 = 1;
/// Wrong input, or a wrong call.
pub const GRAZEMAP_WRONG: i32 = 2;
/// A fault of the library.
pub const GRAZEMAP_PANIC: i32 = 3;
/// Ended by `grazemap_interruption_request`.
pub const GRAZEMAP_INTERRUPTED: i32 = 4;

/// A scene is read from a file.
pub const GRAZEMAP_PATH: i32 = 0;
/// A scene is a text.
pub const GRAZEMAP_TEXT: i32 = 1;
/// A scene is named as in the catalogue.
pub const GRAZEMAP_CATALOGUE: i32 = 2;

/// Iterates by the map alone.
pub const GRAZEMAP_MAP: i32 = 0;
/// Iterates by the map inside its window, by direct simulation outside.
pub const GRAZEMAP_GUARDED: i32 = 1;
/// Iterates by direct simulation.
pub const GRAZEMAP_DIRECT: i32 = 2;

/// The version of the library, as text.
#[unsafe(no_mangle)] // SAFETY: no other symbol begins with `grazemap_`; so below.
pub extern "C" fn grazemap_version() -> *const c_char {
    concat!(env!("CARGO_PKG_VERSION"), "\0").as_ptr().cast()
}

/// What the last call of this thread that failed has to say. The text is valid until the thread's
/// next call that fails. `line` and `column` are those of the fault in the text of a scene, from 1,
/// and 0 where it has no place; they may be null.
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

/// Makes an interruption, by which another thread or a handler of a signal ends calls.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn grazemap_interruption_make(interruption: *mut *mut Interruption) -> i32 {
    // SAFETY: the caller's promise.
    answer(|| unsafe { give(interruption, || Ok(Interruption::default())) })
}

/// Covers the later calls of this thread: once the end is requested they end soon, with
/// `GRAZEMAP_INTERRUPTED`. Null covers them by none.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn grazemap_interruption_cover(interruption: *const Interruption) {
    // SAFETY: the caller's promise.
    cover(unsafe { interruption.as_ref() });
}

/// Requests the end of all calls that the interruption covers, for good. Null is left alone. A
/// handler of a signal may call it.
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

/// Finds the orbit that just touches the stop.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn grazemap_scene_graze(scene: *const Scene, graze: *mut *mut Graze) -> i32 {
    // SAFETY: the caller's promise.
    answer(|| unsafe { give(graze, || value(scene)?.graze()) })
}

/// Value of a parameter at which the orbit grazes.
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

/// Expands the local map, with the orders that the scene names or needs for its tolerance.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn grazemap_graze_map(graze: *const Graze, map: *mut *mut Map) -> i32 {
    // SAFETY: the caller's promise.
    answer(|| unsafe { give(map, || value(graze)?.map()) })
}

/// Reads a saved `map.json`, with the bits that it had.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn grazemap_map_load(
    path: *const c_char,
    path_length: usize,
    map: *mut *mut Map,
) -> i32 {
    // SAFETY: the caller's promise.
    answer(|| unsafe { give(map, || Map::load(words("path", path, path_length)?)) })
}

/// Numbers of coordinates of a state, of active parameters, and of passages through the stop.
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

/// Images of states under the map: as many numbers as there are in `states`.
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

/// Derivatives of the images: of every state, of every coordinate of its image, by the coordinates
/// and then by the parameters.
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

/// Whether every state lies in the window on which the map's error was measured: 1 or 0.
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

/// Orbits of states by the map (`GRAZEMAP_MAP`), guarded (`GRAZEMAP_GUARDED`) or by direct
/// simulation (`GRAZEMAP_DIRECT`): of every state, iterate by iterate, its coordinates. After an
/// early end they are NaN.
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
        // What is too long for the machine is refused before it is computed.
        same("images", images_length, states_length.checked_mul(iterations))?;
        fill("images", images, images_length, &value(map)?.iterate(method, rows, iterations)?)
    })
}

/// Bifurcation diagrams: those that the tables `[[diagram]]` of a text ask for, or those of the
/// scene where the text is empty.
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

/// Numbers of rows and columns of a table.
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

/// A column of numbers by its name, one for each row, NaN where nothing is known.
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

/// The table as CSV, the bytes that the program writes. The text belongs to the table and does not
/// end with a zero byte.
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

/// Frees an interruption, which still covers the calls that it was told to cover; null is left
/// alone.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn grazemap_interruption_free(interruption: *mut Interruption) {
    // SAFETY: the caller's promise.
    unsafe { free(interruption) }
}

/// Frees a scene; null is left alone.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn grazemap_scene_free(scene: *mut Scene) {
    // SAFETY: the caller's promise.
    unsafe { free(scene) }
}

/// Frees a graze; null is left alone.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn grazemap_graze_free(graze: *mut Graze) {
    // SAFETY: the caller's promise.
    unsafe { free(graze) }
}

/// Frees a map; null is left alone.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn grazemap_map_free(map: *mut Map) {
    // SAFETY: the caller's promise.
    unsafe { free(map) }
}

/// Frees a table with its text; null is left alone.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn grazemap_table_free(table: *mut Table) {
    // SAFETY: the caller's promise.
    unsafe { free(table) }
}

/// The value behind a handle.
unsafe fn value<'a, T>(handle: *const T) -> Result<&'a T, Failure> {
    let missing = || Failure::Call("a null handle: was its making refused?".to_owned());
    // SAFETY: a handle that is not null came from `give` and was not freed.
    unsafe { handle.as_ref() }.ok_or_else(missing)
}

/// Items at a pointer.
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

/// A text at a pointer.
unsafe fn words<'a>(what: &str, at: *const c_char, length: usize) -> Result<&'a str, Failure> {
    // SAFETY: the promise of this function's caller.
    let bytes = unsafe { items(what, at.cast(), length) }?;
    str::from_utf8(bytes).map_err(|_| Failure::Call(format!("`{what}` is no UTF-8 text")))
}

/// States and parameters.
unsafe fn rows<'a>(
    states: (*const f64, usize),
    parameters: (*const f64, usize),
) -> Result<crate::values::Rows<'a>, Failure> {
    // SAFETY: the promise of this function's caller.
    let states = unsafe { items("states", states.0, states.1) }?;
    // SAFETY: the same.
    Ok((states, unsafe { items("parameters", parameters.0, parameters.1) }?))
}

/// Refuses a place for results of another length than theirs.
fn same(what: &str, length: usize, expected: Option<usize>) -> Result<(), Failure> {
    if expected == Some(length) {
        return Ok(());
    }
    let expected = expected.map_or("more than there are".to_owned(), |count| count.to_string());
    Err(Failure::Call(format!("`{what}` has room for {length} numbers, the result has {expected}")))
}

/// Writes a result to its place.
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
    // SAFETY: valid for as many items as the caller says, which are as many as there are; what was
    // made here overlaps nothing of the caller's.
    unsafe { ptr::copy_nonoverlapping(result.as_ptr(), to, length) };
    Ok(())
}

/// Gives a value away as a handle; null where there is none.
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

/// Takes a value back.
unsafe fn free<T>(handle: *mut T) {
    if !handle.is_null() {
        // SAFETY: it came from `give`, and its owner gives it up.
        drop(unsafe { Box::from_raw(handle) });
    }
}
