/* Computes by the library what the test computes by the program, and prints it with all digits. */
#include "grazemap.h"
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

static void expect(int32_t code, const char *what) {
  if (code != GRAZEMAP_DONE) {
    fprintf(stderr, "%s: code %d: %s\n", what, (int)code, grazemap_last_error(NULL, NULL));
    exit(1);
  }
}

static void print(const char *what, const double *values, size_t count) {
  printf("%s", what);
  for (size_t n = 0; n < count; ++n)
    printf(" %.17g", values[n]);
  printf("\n");
}

/* Refused calls: code, line, column, message. */
static void refused(int32_t code) {
  size_t line, column;
  const char *words = grazemap_last_error(&line, &column);
  printf("refused %d %zu %zu %s\n", (int)code, line, column, words);
}

int main(int argc, char **argv) {
  if (argc != 3)
    return 2;
  printf("version %s\n", grazemap_version());

  grazemap_scene *scene = NULL;
  grazemap_graze *graze = NULL;
  grazemap_map *map = NULL;
  expect(grazemap_scene_load(GRAZEMAP_CATALOGUE, "linear", 6, &scene), "scene");
  expect(grazemap_scene_graze(scene, &graze), "graze");
  double alpha;
  expect(grazemap_graze_parameter(graze, "alpha", 5, &alpha), "parameter");
  print("alpha", &alpha, 1);
  expect(grazemap_graze_map(graze, &map), "map");
  grazemap_scene_free(scene);
  grazemap_graze_free(graze);

  size_t coordinates, parameters, passages;
  expect(grazemap_map_sizes(map, &coordinates, &parameters, &passages), "sizes");
  printf("sizes %zu %zu %zu\n", coordinates, parameters, passages);

  /* The second state is outside of the window. */
  const double states[] = {1e-5, 2e-5, 0.4, 0.3, -3e-6, 1e-6}, offsets[] = {1e-6, 0};
  double images[6], derivatives[3 * 2 * 4], orbits[3 * 4 * 2];
  uint8_t inside[3];
  expect(grazemap_map_step(map, states, 6, offsets, 2, images, 6), "step");
  print("step", images, 6);
  expect(grazemap_map_jacobian(map, states, 6, offsets, 2, derivatives, 24), "jacobian");
  print("jacobian", derivatives, 24);
  expect(grazemap_map_inside(map, states, 6, offsets, 2, inside, 3), "inside");
  printf("inside %d %d %d\n", inside[0], inside[1], inside[2]);
  const char *names[] = {"map", "guarded", "direct"};
  for (int32_t method = GRAZEMAP_MAP; method <= GRAZEMAP_DIRECT; ++method) {
    expect(grazemap_map_iterate(map, method, states, 6, offsets, 2, 4, orbits, 24), names[method]);
    print(names[method], orbits, 24);
  }

  grazemap_table *diagram = NULL;
  const char *tables = argv[1], *csv;
  size_t rows, columns, length;
  expect(grazemap_map_diagram(map, tables, strlen(tables), &diagram), "diagram");
  expect(grazemap_table_size(diagram, &rows, &columns), "size");
  double *offset = calloc(rows, sizeof *offset);
  expect(grazemap_table_column(diagram, "offset", 6, offset, rows), "column");
  print("offset", offset, rows);
  expect(grazemap_table_csv(diagram, &csv, &length), "csv");
  FILE *file = fopen(argv[2], "wb");
  if (file == NULL || fwrite(csv, 1, length, file) != length || fclose(file) != 0)
    return 3;
  refused(grazemap_table_column(diagram, "offset", 6, offset, rows + 1));
  refused(grazemap_table_column(diagram, "method", 6, offset, rows));
  grazemap_table_free(diagram);
  free(offset);

  const char *text = "[model]\nstates = 7\n";
  refused(grazemap_scene_load(GRAZEMAP_TEXT, text, strlen(text), &scene));
  refused(scene == NULL ? GRAZEMAP_WRONG : GRAZEMAP_DONE);
  refused(grazemap_scene_load(GRAZEMAP_CATALOGUE, "linaer", 6, &scene));
  refused(grazemap_scene_load(9, "linear", 6, &scene));
  refused(grazemap_scene_load(GRAZEMAP_PATH, "\xff", 1, &scene));
  refused(grazemap_scene_graze(NULL, &graze));
  refused(grazemap_map_step(map, states, 5, offsets, 2, images, 5));
  refused(grazemap_map_step(map, states, 6, offsets, 1, images, 6));
  refused(grazemap_map_step(map, NULL, 6, offsets, 2, images, 6));
  refused(grazemap_map_step(map, states, 6, offsets, 2, NULL, 6));
  refused(grazemap_map_step(map, states, 6, offsets, 2, images, 4));
  refused(grazemap_map_iterate(map, 7, states, 6, offsets, 2, 1, orbits, 6));
  refused(grazemap_map_iterate(map, 0, states, 6, offsets, 2, SIZE_MAX, orbits, 6));
  grazemap_map_free(map);
  grazemap_map_free(NULL);
  return 0;
}
