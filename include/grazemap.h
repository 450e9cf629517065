/* Grazemap as a library for C, and for all languages that call C. Made by cbindgen: do not edit.
 *
 * Functions of type int32_t return a code, GRAZEMAP_DONE on success. After any other code
 * grazemap_last_error() on the same thread gives the message; results are unchanged, and new
 * handles are null.
 *
 * Every pointer to data is followed by its length in items: bytes of UTF-8 text without a final
 * zero, or numbers of an array. Pointers to single results must not be null. Arrays hold rows: a
 * state is a row of coordinates; parameters are one row for all states, or one row for each. States
 * and parameters are offsets from the grazing orbit.
 *
 * One function makes a handle and another frees it, in any order: a map does not need its scene any
 * more. Handles never change, so that several threads may use one. Computations use all cores, or
 * RAYON_NUM_THREADS of them if that is fewer.
 *
 * Results and arguments may overlap: results are written after all arguments were read, and only by
 * a call that returns GRAZEMAP_DONE, so that there are no partial results. A process made by fork
 * may use the handles of its parent and gets threads of its own. Fork while no other thread is in a
 * call. */

#ifndef GRAZEMAP_H
#define GRAZEMAP_H

#include <stddef.h>
#include <stdint.h>

/*
 Success.
 */
#define GRAZEMAP_DONE 0

/*
 Correct input without a result: no grazing orbit, or no map within a tolerance, for example.
 */
#define GRAZEMAP_ENDED 1

/*
 Wrong input or a wrong call.
 */
#define GRAZEMAP_WRONG 2

/*
 An internal error of the library.
 */
#define GRAZEMAP_PANIC 3

/*
 The call was ended by `grazemap_interruption_request`.
 */
#define GRAZEMAP_INTERRUPTED 4

/*
 The scene is the path of a file.
 */
#define GRAZEMAP_PATH 0

/*
 The scene is TOML text.
 */
#define GRAZEMAP_TEXT 1

/*
 The scene is the name of a scene of the catalogue.
 */
#define GRAZEMAP_CATALOGUE 2

/*
 Iterates with the map alone.
 */
#define GRAZEMAP_MAP 0

/*
 Iterates with the map inside its window and with direct simulation outside.
 */
#define GRAZEMAP_GUARDED 1

/*
 Iterates with direct simulation.
 */
#define GRAZEMAP_DIRECT 2

/*
 A scene with its grazing orbit.
 */
typedef struct grazemap_graze grazemap_graze;

/*
 A request to end calls, from any thread.
 */
typedef struct grazemap_interruption grazemap_interruption;

/*
 The local map near a grazing orbit.
 */
typedef struct grazemap_map grazemap_map;

/*
 A scene: an oscillator, its stops, and the requested results.
 */
typedef struct grazemap_scene grazemap_scene;

/*
 A table: columns of numbers or words.
 */
typedef struct grazemap_table grazemap_table;

#ifdef __cplusplus
extern "C" {
#endif // __cplusplus

/*
 Version of the library, as zero-terminated text.
 */
const char *grazemap_version(void);

/*
 Message of this thread's last failed call, as zero-terminated text, valid until the thread's
 next failed call. `line` and `column` are the place of the fault in the text of a scene, from 1,
 or 0 if there is no place; the pointers may be null.
 */
const char *grazemap_last_error(size_t *line, size_t *column);

/*
 Makes an interruption, with which another thread or a signal handler can end calls.
 */
int32_t grazemap_interruption_make(grazemap_interruption **interruption);

/*
 Covers the later calls of this thread: after a request to end they return soon, with
 `GRAZEMAP_INTERRUPTED`. Null removes the cover.
 */
void grazemap_interruption_cover(const grazemap_interruption *interruption);

/*
 Requests the end of all calls that the interruption covers. The request is permanent. Null is
 ignored. A signal handler may call this function.
 */
void grazemap_interruption_request(const grazemap_interruption *interruption);

/*
 Reads a scene from a file (`GRAZEMAP_PATH`), a text (`GRAZEMAP_TEXT`) or the catalogue
 (`GRAZEMAP_CATALOGUE`).
 */
int32_t grazemap_scene_load(int32_t source,
                            const char *text,
                            size_t text_length,
                            grazemap_scene **scene);

/*
 Finds the grazing orbit: the periodic orbit that just touches the stop.
 */
int32_t grazemap_scene_graze(const grazemap_scene *scene, grazemap_graze **graze);

/*
 Writes the value of a parameter at which the orbit grazes.
 */
int32_t grazemap_graze_parameter(const grazemap_graze *graze,
                                 const char *name,
                                 size_t name_length,
                                 double *parameter);

/*
 Expands the local map, to the orders that the scene names or needs for its tolerance.
 */
int32_t grazemap_graze_map(const grazemap_graze *graze, grazemap_map **map);

/*
 Reads a saved `map.json`. The map is identical to the saved one, bit by bit.
 */
int32_t grazemap_map_load(const char *path, size_t path_length, grazemap_map **map);

/*
 Writes the numbers of coordinates of a state, of active parameters, and of passages at the stop.
 */
int32_t grazemap_map_sizes(const grazemap_map *map,
                           size_t *coordinates,
                           size_t *parameters,
                           size_t *passages);

/*
 Writes the images of states under the map: as many numbers as there are in `states`.
 */
int32_t grazemap_map_step(const grazemap_map *map,
                          const double *states,
                          size_t states_length,
                          const double *parameters,
                          size_t parameters_length,
                          double *images,
                          size_t images_length);

/*
 Writes the derivatives of the images, state by state: for each coordinate of the image its
 derivatives with respect to the coordinates, then to the parameters.
 */
int32_t grazemap_map_jacobian(const grazemap_map *map,
                              const double *states,
                              size_t states_length,
                              const double *parameters,
                              size_t parameters_length,
                              double *derivatives,
                              size_t derivatives_length);

/*
 Writes for each state whether it lies in the window on which the map's error was measured: 1 or
 0.
 */
int32_t grazemap_map_inside(const grazemap_map *map,
                            const double *states,
                            size_t states_length,
                            const double *parameters,
                            size_t parameters_length,
                            uint8_t *inside,
                            size_t inside_length);

/*
 Writes the orbits of states under the map (`GRAZEMAP_MAP`), guarded iteration
 (`GRAZEMAP_GUARDED`) or direct simulation (`GRAZEMAP_DIRECT`): state by state, iterate by
 iterate, the coordinates. After an early end they are NaN.
 */
int32_t grazemap_map_iterate(const grazemap_map *map,
                             int32_t method,
                             const double *states,
                             size_t states_length,
                             const double *parameters,
                             size_t parameters_length,
                             size_t iterations,
                             double *images,
                             size_t images_length);

/*
 Computes bifurcation diagrams: those of the tables `[[diagram]]` in the text, or those of the
 scene if the text is empty.
 */
int32_t grazemap_map_diagram(const grazemap_map *map,
                             const char *tables,
                             size_t tables_length,
                             grazemap_table **diagram);

/*
 Writes the numbers of rows and columns of a table.
 */
int32_t grazemap_table_size(const grazemap_table *table, size_t *rows, size_t *columns);

/*
 Writes a column of numbers, found by its name: one for each row, NaN if the value is unknown.
 */
int32_t grazemap_table_column(const grazemap_table *table,
                              const char *name,
                              size_t name_length,
                              double *values,
                              size_t values_length);

/*
 Gives the table as CSV, with the bytes that the program writes. The text belongs to the table
 and is not zero-terminated.
 */
int32_t grazemap_table_csv(const grazemap_table *table, const char **text, size_t *text_length);

/*
 Frees an interruption. Calls that it covers stay covered. Null is ignored.
 */
void grazemap_interruption_free(grazemap_interruption *interruption);

/*
 Frees a scene. Null is ignored.
 */
void grazemap_scene_free(grazemap_scene *scene);

/*
 Frees a graze. Null is ignored.
 */
void grazemap_graze_free(grazemap_graze *graze);

/*
 Frees a map. Null is ignored.
 */
void grazemap_map_free(grazemap_map *map);

/*
 Frees a table and its CSV text. Null is ignored.
 */
void grazemap_table_free(grazemap_table *table);

#ifdef __cplusplus
}  // extern "C"
#endif  // __cplusplus

#endif  /* GRAZEMAP_H */
