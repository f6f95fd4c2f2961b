/* The parts of the suite hierarchical. */
#ifndef LAMBERT_BENCH_BENCH_HIERARCHICAL_H
#define LAMBERT_BENCH_BENCH_HIERARCHICAL_H

#include "solver/bench/lowrank.h"

/* Kinds of operator, the first of them hierarchical, and settings of each, from rough to fine. */
enum { KINDS = 6, SETTINGS_MOST = 5 };
/* What errors are of: one bright element, the scene's lights, light all over. */
enum { LIGHT_SINGLE, LIGHT_LAMPS, LIGHT_ALL_OVER, LIGHTS };

extern const char *const hierarchical_kinds[KINDS];
extern const char *const hierarchical_lights[LIGHTS];

/* An operator, measured. */
typedef struct kind_point {
    double setting, build_s, query_ms, mb, stored_mb;
    double error[LIGHTS]; /* total indirect, mean; NaN: not measured */
} kind_point;
typedef struct kind_curve {
    size_t n;
    kind_point at[SETTINGS_MOST];
} kind_curve;

/* Every kind at its settings on one scene, judged by form factors of another seed; rows of a table, and
 * plots. */
extern const table_column hierarchical_points_columns[];
extern const size_t hierarchical_points_width;
lam_status hierarchical_of_scene(const bench_run *run, const lowrank_scene *s, kind_curve curves[KINDS],
                                 table *out, lam_error *error);

/* Beside each hierarchical operator what other kinds take for as small an error, between two of their
 * settings by powers. */
extern const table_column hierarchical_equal_columns[];
extern const size_t hierarchical_equal_width;
void hierarchical_at_equal_error(const lowrank_scene *s, const kind_curve curves[KINDS], table *out);

/* Closed Cornell boxes of growing size: time, memory and numbers an element, beside an operator of low rank.
 */
lam_status hierarchical_growth(const bench_run *run, lam_error *error);

#endif
