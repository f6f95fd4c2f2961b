/* The parts of the suite cities and what they share. */
#ifndef LAMBERT_BENCH_CITIES_H
#define LAMBERT_BENCH_CITIES_H

#include "solver/formfactor/formfactor.h"
#include "solver/method/low_rank/spectrum.h"
#include "solver/method/method.h"
#include "tests/bench/suites/bench.h"
#include "tests/bench/suites/lowrank.h"

enum { CITY_VARIANTS = 3, CITY_SIZES = 3, CITY_TERRAINS = 3, CITY_THRESHOLDS = 3, CITY_SKIES = 3650 };

/* A city of the thesis with its form factors. */
extern const size_t city_sizes[CITY_SIZES];            /* 8897, 35588, 142352 */
extern const char *const city_terrains[CITY_TERRAINS]; /* flat, valley, hill */
extern const double city_thresholds[CITY_THRESHOLDS];  /* 1e-3, 1e-4, 1e-5 */

typedef struct city {
    unsigned variant; /* 1 to 3 */
    size_t size;      /* index of city_sizes */
    const char *terrain;
    mesh m; /* reflectance .7 */
    uint32_t *order;
    form_factors f; /* with a sky of 132 tiles, 12 sectors in 11 bands */
    double seconds; /* of f */
    build_problem problem;
} city;

/* The mesh of a city; freed by mesh_free. */
lam_status city_mesh(const bench_run *run, unsigned variant, size_t size, const char *terrain, mesh *out,
                     lam_error *error);

/* Makes a city and computes its form factors by a recipe. Freed by city_free. */
lam_status city_open(const bench_run *run, unsigned variant, size_t size, const char *terrain,
                     const recipe *how, city *out, lam_error *error);
void city_free(city *c);

/* Share of n^2 that F has. */
double city_density(const city *c);

/* A city under each tile of its sky alone: E = rho first_bounce, and B converged, [m][n]. */
typedef struct city_light {
    size_t m;
    float *E;
    double *B;
} city_light;

lam_status city_light_make(const bench_run *run, const city *c, city_light *d, lam_error *error);
void city_light_free(city_light *d);

/* M~ at a threshold and with a correction ("none", "delta", "discarded"), with the other defaults of
 * precompute. */
lam_status city_sparse(const bench_run *run, const city *c, double threshold, const char *correction,
                       lam_operator **op, build_report *report, lam_error *error);

/* B~ [m][n] of an operator, and |B~ - B| over |B| and |B - E| of each tile, area-weighted. */
lam_status city_light_answer(const city_light *d, const lam_operator *op, float *B, lam_error *error);
lam_status city_light_errors(const city *c, const city_light *d, const lam_operator *op, double *relative,
                             double *indirect, lam_error *error);

/* The scenes of figure 5.1, of which the first MAP_MAIN are those of the thesis, as `lambert generate` makes
 * them. Cities have the reflectance .7 of the thesis, the others their own. */
enum { MAP_SCENES = 10, MAP_MAIN = 4, FALL_SCENES = 6 };
extern const char *const map_scenes[MAP_SCENES];

/* One of them with its form factors: by lowrank_recipe, in a quick run by rays. */
lam_status map_scene_open(const bench_run *run, const char *name, size_t elements, lowrank_scene *out,
                          lam_error *error);

/* The distribution of the singular values of S = A^1/2 F A^-1/2, which are those of F where areas are equal.
 * Freed by spectrum_free. */
lam_status map_spectrum(const bench_run *run, const lowrank_scene *s, spectrum *out, lam_error *error);

/* Tables 4.1 and 4.5: densities of F. */
lam_status cities_density(const bench_run *run, lam_error *error);

/* Table 4.6: densities, times and errors of hemicubes of falling resolution. */
lam_status cities_resolution(const bench_run *run, lam_error *error);

/* A stratified sample of the rows of n elements: one at random out of each of count parts of the mesh, whose
 * elements are ordered by group and by building. */
void cities_spread_rows(size_t n, size_t count, uint64_t seed, uint32_t *rows);

/* Tables 4.1 to 4.4 and 4.7: M~, its time beside Jacobi, its error; and few emitters (section 4.4.3). */
lam_status cities_inverse(const bench_run *run, lam_error *error);

/* Figures 4.1, 4.4 and 5.1 and the table of kinds, of scenes that are opened once for all of them. */
lam_status cities_figures(const bench_run *run, lam_error *error);

/* Figure 4.1: how singular values fall, and how many are above .1. The Cornell box, the three cities, rooms
 * and an anechoic chamber of a size, in this order, and again of other sizes: n_sizes times FALL_SCENES. */
lam_status cities_spectra(const bench_run *run, const lowrank_scene *const *scenes, size_t n_sizes,
                          lam_error *error);

/* Figure 4.4: how the elements of M are distributed in cities 1 and 3. */
lam_status cities_distribution(const bench_run *run, const lowrank_scene *const scenes[2], lam_error *error);

/* Figure 5.1: density against rank of MAP_SCENES scenes, and the kind that suits each. */
lam_status cities_map(const bench_run *run, const lowrank_scene *scenes, lam_error *error);

/* Every kind of operator on MAP_MAIN scenes, and the kind that auto picks. */
lam_status cities_kinds(const bench_run *run, const lowrank_scene *scenes, lam_error *error);

/* Figures 4.5 and 4.10: radiosity with and without its first bounces, error of every tile's light. */
lam_status cities_radiosity(const bench_run *run, lam_error *error);

#endif
