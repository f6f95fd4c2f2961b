/* Emissions by which an operator is judged, some at a time, and its answers to them. Private to judge.c. */
#ifndef LAMBERT_METHOD_JUDGE_PROBES_H
#define LAMBERT_METHOD_JUDGE_PROBES_H

#include "solver/method/method.h"

/* A round has this order. */
enum { JUDGE_RANDOM, JUDGE_WHOLE, JUDGE_LIGHTS, JUDGE_SINGLE, JUDGE_GROUPS };

/* A source of emissions: single elements (or emitters), drawn without repetition, the scene's own light,
 * random light of all elements (emitters), and whole groups of the scene, each of which emits evenly; with
 * sources, of these elements alone. */
typedef struct probe_source {
    const build_problem *problem;
    const lam_operator *op;
    const float *emission; /* [C][n], the scene's own */
    const float *emits;    /* [n], above 0 of elements that emit; NULL: all */
    const bool *black;     /* [n], true where B of probes is the irradiance; NULL: nowhere. Set by the user */
    const uint32_t *group; /* [n], of each element; NULL: no whole groups are drawn */
    size_t n_singles;      /* in the deck */
    size_t n_whole;        /* groups of which some element may emit */
    uint32_t *whole;       /* [n_whole], in the order in which they are taken */
    size_t most[JUDGE_GROUPS], made[JUDGE_GROUPS];
    uint32_t *deck;        /* [n or emitters, or those that emit] drawn so far, then the others */
    uint64_t draw, random; /* states */
} probe_source;

/* singles: at most; emits may be NULL, as it is of an operator of emitters. Errors: LAM_ERR_MEMORY. */
lam_status probe_source_make(const build_problem *problem, const lam_operator *op, const float *emission,
                             const float *emits, size_t singles, size_t randoms, uint64_t seed,
                             probe_source *out, lam_error *error);

/* Adds groups 0 ... n_groups - 1, group [n] being those of the elements: those that people light, which are
 * groups with emission of the scene, by their power, those that `people` [n_groups] marks (NULL: none), and
 * with `emits` all of which some element emits, and so many others, `large`, by their area; at most `most`.
 * An operator of emitters cannot answer them, and gets none. Errors: LAM_ERR_MEMORY. */
lam_status probe_source_add_groups(probe_source *s, const uint32_t *group, size_t n_groups,
                                   const bool *people, size_t large, size_t most, lam_error *error);
void probe_source_free(probe_source *s);

/* The number of emissions of a group, JUDGE_..., 0 where they are endless. */
size_t probe_source_all(const probe_source *s, int group);

/* Emissions E and the operator's radiosity B (its irradiance where the source is black) and irradiance H,
 * [m][C][n]; those of group g are begin[g] ...
 * begin[g + 1] - 1. Of an operator of emitters W are their weights, [m][C][s], and H0 is the light of the
 * sky, which E contains as rho H0; else both are NULL. */
typedef struct probes {
    size_t m, begin[JUDGE_GROUPS + 1];
    float *E, *B, *H, *W, *H0;
} probes;

/* The next `counts` emissions and the answers to them; H is NULL unless irradiance is asked for. Errors:
 * LAM_ERR_MEMORY, those of the operator. */
lam_status probes_next(probe_source *s, const size_t counts[JUDGE_GROUPS], bool irradiance, probes *out,
                       lam_error *error);
void probes_free(probes *p);

#endif
