/* Grazemap for programs in C, and for all that calls C. Made by cbindgen: do not change.
 *
 * Every function but those that free gives a code: GRAZEMAP_DONE; else the message is
 * grazemap_last_error() of the same thread, and results are left as they were, new handles null.
 *
 * Every pointer to data stands before its length in items: letters of UTF-8 text without an end,
 * numbers of an array. Pointers to single results must not be null. Arrays hold rows: a state is a
 * row of coordinates; parameters are one row for all states or a row for each. States and
 * parameters are offsets from the grazing orbit.
 *
 * A handle is made by one function and freed by another, in any order: a map needs its scene no
 * longer. Handles are never changed, so that several threads may use one; computations use all
 * cores, or as many as RAYON_NUM_THREADS says where these are fewer.
 *
 * Results may lie where the arguments are: they are written after all arguments were read, and only
 * by a call that gives GRAZEMAP_DONE, so that there are no partial results. A process made by fork
 * may go on with the handles of its parent: it gets threads of its own. Fork while no other thread
 * is in a call. */

#ifndef GRAZEMAP_H
#define GRAZEMAP_H

#include <stddef.h>
#include <stdint.h>

/*
 Done.
 */
#define GRAZEMAP_DONE 0

/*
 The input was right and the mathematics ended otherwise: no grazing orbit, no map for a
 tolerance.
 */
#define GRAZEMAP_ENDED 1

/*
 Wrong input, or a wrong call.
 */
#define GRAZEMAP_WRONG 2

/*
 A fault of the library.
 */
#define GRAZEMAP_PANIC 3

/*
 Ended by `grazemap_interruption_request`.
 */
#define GRAZEMAP_INTERRUPTED 4

/*
 A scene is read from a file.
 */
#define GRAZEMAP_PATH 0

/*
 A scene is a text.
 */
#define GRAZEMAP_TEXT 1

/*
 A scene is named as in the catalogue.
 */
#define GRAZEMAP_CATALOGUE 2

/*
 Iterates by the map alone.
 */
#define GRAZEMAP_MAP 0

/*
 Iterates by the map inside its window, by direct simulation outside.
 */
#define GRAZEMAP_GUARDED 1

/*
 Iterates by direct simulation.
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
 A scene: an oscillator, its stops, and what is asked of it.
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
 The version of the library, as text.
 */
const char *grazemap_version(void);

/*
 What the last call of this thread that failed has to say. The text is valid until the thread's
 next call that fails. `line` and `column` are those of the fault in the text of a scene, from 1,
 and 0 where it has no place; they may be null.
 */
const char *grazemap_last_error(size_t *line, size_t *column);

/*
 Makes an interruption, by which another thread or a handler of a signal ends calls.
 */
int32_t grazemap_interruption_make(grazemap_interruption **interruption);

/*
 Covers the later calls of this thread: once the end is requested they end soon, with
 `GRAZEMAP_INTERRUPTED`. Null covers them by none.
 */
void grazemap_interruption_cover(const grazemap_interruption *interruption);

/*
 Requests the end of all calls that the interruption covers, for good. Null is left alone. A
 handler of a signal may call it.
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
 Finds the orbit that just touches the stop.
 */
int32_t grazemap_scene_graze(const grazemap_scene *scene, grazemap_graze **graze);

/*
 Value of a parameter at which the orbit grazes.
 */
int32_t grazemap_graze_parameter(const grazemap_graze *graze,
                                 const char *name,
                                 size_t name_length,
                                 double *parameter);

/*
 Expands the local map, with the orders that the scene names or needs for its tolerance.
 */
int32_t grazemap_graze_map(const grazemap_graze *graze, grazemap_map **map);

/*
 Reads a saved `map.json`, with the bits that it had.
 */
int32_t grazemap_map_load(const char *path, size_t path_length, grazemap_map **map);

/*
 Numbers of coordinates of a state, of active parameters, and of passages through the stop.
 */
int32_t grazemap_map_sizes(const grazemap_map *map,
                           size_t *coordinates,
                           size_t *parameters,
                           size_t *passages);

/*
 Images of states under the map: as many numbers as there are in `states`.
 */
int32_t grazemap_map_step(const grazemap_map *map,
                          const double *states,
                          size_t states_length,
                          const double *parameters,
                          size_t parameters_length,
                          double *images,
                          size_t images_length);

/*
 Derivatives of the images: of every state, of every coordinate of its image, by the coordinates
 and then by the parameters.
 */
int32_t grazemap_map_jacobian(const grazemap_map *map,
                              const double *states,
                              size_t states_length,
                              const double *parameters,
                              size_t parameters_length,
                              double *derivatives,
                              size_t derivatives_length);

/*
 Whether every state lies in the window on which the map's error was measured: 1 or 0.
 */
int32_t grazemap_map_inside(const grazemap_map *map,
                            const double *states,
                            size_t states_length,
                            const double *parameters,
                            size_t parameters_length,
                            uint8_t *inside,
                            size_t inside_length);

/*
 Orbits of states by the map (`GRAZEMAP_MAP`), guarded (`GRAZEMAP_GUARDED`) or by direct
 simulation (`GRAZEMAP_DIRECT`): of every state, iterate by iterate, its coordinates. After an
 early end they are NaN.
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
 Bifurcation diagrams: those that the tables `[[diagram]]` of a text ask for, or those of the
 scene where the text is empty.
 */
int32_t grazemap_map_diagram(const grazemap_map *map,
                             const char *tables,
                             size_t tables_length,
                             grazemap_table **diagram);

/*
 Numbers of rows and columns of a table.
 */
int32_t grazemap_table_size(const grazemap_table *table, size_t *rows, size_t *columns);

/*
 A column of numbers by its name, one for each row, NaN where nothing is known.
 */
int32_t grazemap_table_column(const grazemap_table *table,
                              const char *name,
                              size_t name_length,
                              double *values,
                              size_t values_length);

/*
 The table as CSV, the bytes that the program writes. The text belongs to the table and does not
 end with a zero byte.
 */
int32_t grazemap_table_csv(const grazemap_table *table, const char **text, size_t *text_length);

/*
 Frees an interruption, which still covers the calls that it was told to cover; null is left
 alone.
 */
void grazemap_interruption_free(grazemap_interruption *interruption);

/*
 Frees a scene; null is left alone.
 */
void grazemap_scene_free(grazemap_scene *scene);

/*
 Frees a graze; null is left alone.
 */
void grazemap_graze_free(grazemap_graze *graze);

/*
 Frees a map; null is left alone.
 */
void grazemap_map_free(grazemap_map *map);

/*
 Frees a table with its text; null is left alone.
 */
void grazemap_table_free(grazemap_table *table);

#ifdef __cplusplus
}  // extern "C"
#endif  // __cplusplus

#endif  /* GRAZEMAP_H */
