/* Table skies of the suite mesh: the error that constants on elements leave of the light of skies. */
#ifndef LAMBERT_BENCH_MESH_SKIES_H
#define LAMBERT_BENCH_MESH_SKIES_H

#include "tests/bench/suites/bench.h"

/* Hands on the table: for a Cornell box, a room with a window, a courtyard and a city the error that a store
 * states of an even sky and of a cloudy one, and the true one against a mesh 16 times finer, both solved in
 * double. Cost: that of form factors and rays of the finer meshes, up to 16 times 1,013 elements. Errors:
 * those of form factors and solutions. */
lam_status mesh_skies(const bench_run *run, lam_error *error);

#endif
