/* Adjoint rows: the mean of a quantity over a group is linear in the emission, mean = w^T E. One row
 *     w = (dq/dE)^T (A 1_group / sum A)
 * answers every emission by a scalar product, and its sums over the groups of the scene every emission by
 * groups. The value of one element has such a row, too. */
#ifndef LAMBERT_OPERATOR_GROUPS_ADJOINT_ROW_H
#define LAMBERT_OPERATOR_GROUPS_ADJOINT_ROW_H

#include "solver/operator/groups/groups.h"

/* The parts of an open store that its light depends on; views. */
typedef struct linear_scene {
    size_t n, n_channels;
    const lam_operator *op;
    size_t n_emitters; /* 0: the store answers any emission */
    const group_index *groups;
    const double *area;       /* [n] */
    const float *reflectance; /* [C][n] */
    const lam_sky *sky;       /* NULL: none */
    const lam_luminaires *luminaires;
} linear_scene;

/* Tiles of the sky, and luminaires; 0: there are none. */
size_t linear_scene_tiles(const linear_scene *s);
size_t linear_scene_luminaires(const linear_scene *s);

/* w = (dq/dE)^T (A 1_group / sum A) of C channels: the mean of quantity q over a group is w^T E. Buried
 * elements are in neither. */
typedef struct adjoint_row {
    const uint32_t *groups; /* of the mean, as group_index_find gives them; NULL: the value of one element */
    size_t n_groups;
    lam_quantity quantity;
    double area;       /* sum A; 0: the row is 0, and the mean has no value */
    double buried;     /* share of the area of the groups that buried elements have */
    float *w;          /* [C][n]; NULL where the store answers for its own emitters only */
    float *emitters;   /* [C][s], by emitter, in place of w */
    double *of_group;  /* [C][groups of the scene], sum of w over each; NaN: not determined by the emitters */
    float *tiles;      /* [C][m], by radiance of a sky's tile; NaN likewise */
    float *luminaires; /* [C][k], by their dimmers */
    size_t bytes;      /* of all this */
    /* Of a cache that keeps it, which alone uses these. */
    size_t references;
    uint64_t used; /* number of its last use */
    struct adjoint_row *next;
} adjoint_row;

size_t adjoint_row_bytes(const linear_scene *s);

/* Bytes of the cotangents and of the results of a pass for `count` rows. */
size_t adjoint_pass_bytes(const linear_scene *s, size_t count);

/* A row of the mean of these groups, or with NULL of the value of an element, which is filled by
 * adjoint_rows_fill. NULL when memory is short. */
adjoint_row *adjoint_row_create(const linear_scene *s, const uint32_t *groups, size_t n_groups,
                                lam_quantity quantity);
void adjoint_row_free(adjoint_row *row);

/* Writes the cotangent g [C][n] of the row's mean, and sets area and buried. */
void adjoint_row_cotangent(const linear_scene *s, adjoint_row *row, float *g);

/* For a store of few emitters: the weights of emitters whose sum is one group of the scene alone, or one tile
 * of its sky. Any emission by groups and tiles is then known by its weights, without a vector. Immutable once
 * made; where no weights give a group or tile in a channel, the first weight is NaN. */
typedef struct emitter_weights {
    float *of_group; /* [groups][C][s] */
    float *of_tile;  /* [m][C][s] */
    size_t bytes;    /* of both */
} emitter_weights;

/* The bytes of these weights; 0 where they are not worth their time or memory, and of other stores. */
size_t emitter_weights_bytes(const linear_scene *s);

/* NULL when memory is short. O(n C) for each group and tile. */
emitter_weights *emitter_weights_create(const linear_scene *s);
void emitter_weights_free(emitter_weights *weights);

/* Fills rows of `count` cotangents g [count][C][n], behind which is as much room for results
 * (adjoint_pass_bytes), by one pass over the operator. weights may be NULL. work holds
 * lam_operator_work_bytes of `count` vectors. Errors: as lam_operator_apply_adjoint. */
lam_status adjoint_rows_fill(const linear_scene *s, const emitter_weights *weights, lam_quantity quantity,
                             size_t count, float *g, void *work, size_t work_bytes, adjoint_row *const *rows,
                             lam_error *error);

/* An entry of a sparse vector: an element, or every element of a group. */
typedef struct emission_spot {
    uint32_t vector;
    uint32_t where; /* an element, or a group of the scene */
    bool whole_group;
    double shared; /* above 0: each element of the group that figures take in has the value times its area
                      over this one, and the others 0; no row knows such a spot */
} emission_spot;

/* The light of one vector; views. The parts add up. */
typedef struct source_light {
    const float *E;             /* [C][n]; NULL: none */
    const emission_spot *spots; /* [n_spots] */
    const float *colours;       /* [n_spots][C], of spots */
    size_t n_spots;
    const float *L; /* [C][m], radiances of tiles; NULL: none */
    const float *D; /* [C][k], dimmers; NULL: none */
    const float *W; /* [C][s], weights of emitters; NULL: none */
} source_light;

/* True if a row answers this light without weights for all of it, false if a store of few emitters needs
 * these. The same for every row of a scene. */
bool adjoint_row_suffices(const linear_scene *s, const adjoint_row *row, const source_light *light);

/* means [C], in double. Cost: that of the spots, tiles, dimmers and weights, and nC of E. */
void adjoint_row_evaluate(const linear_scene *s, const adjoint_row *row, const source_light *light,
                          double *means);

/* The derivatives of channel c by all sources of a kind, [adjoint_row_width]; NaN without an area. */
size_t adjoint_row_width(const linear_scene *s, lam_by kind);
void adjoint_row_derivatives(const linear_scene *s, const adjoint_row *row, lam_by kind, size_t c,
                             float *out);

#endif
