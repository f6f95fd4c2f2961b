/* Elements that emit, in groups of neighbours, and how many of the samples of lamps each group is worth at
 * some points: of twenty lamps one or two light a cell, and samples on the others say nothing. The shares are
 * a density of samples: they change the noise of an estimate that is weighed by it, never its mean. */
#ifndef LAMBERT_ADAPT_LAMP_GROUPS_H
#define LAMBERT_ADAPT_LAMP_GROUPS_H

#include "solver/formfactor/visibility/visibility.h"
#include "solver/scene/mesh.h"

enum { LAMP_GROUPS_MOST = 256 };

typedef struct lamp_group {
    double centre[3], radius; /* of a ball that holds it */
    double normal[3];
    bool flat; /* all of it faces along the normal */
    double power;
} lamp_group;

typedef struct lamp_groups {
    const mesh *m;
    const visibility *v;
    const float *E; /* [C][n] */
    size_t n, n_groups;
    uint32_t *element; /* [n], those that emit, in their order */
    double *before;    /* [n + 1]: power of those before, all channels */
    size_t *first;     /* [n_groups + 1], of the lamps of each group */
    uint32_t *group;   /* [elements of m], where an element emits */
    lamp_group *of;    /* [n_groups] */
} lamp_groups;

/* The shares of groups before each; their sum is 1. */
typedef struct lamp_shares {
    double before[LAMP_GROUPS_MOST + 1];
} lamp_shares;

/* E [C][n], or NULL: nothing emits. The arguments must outlive out. Freed by lamp_groups_free, also after an
 * error. Errors: LAM_ERR_MEMORY. */
lam_status lamp_groups_make(const mesh *m, const visibility *v, const float *E, lamp_groups *out,
                            lam_error *error);
void lamp_groups_free(lamp_groups *l);

/* Emission of all channels. */
double lamp_groups_brightness(const lamp_groups *l, size_t element);

/* Shares for points of the plane of an element, where anything emits: by power, distance and cosines, and by
 * a few segments. key: chooses these. Cost: O(n_groups), and a packet of segments for each of 32 groups at
 * most. */
void lamp_groups_share(const lamp_groups *l, uint32_t element, uint64_t key, size_t n_points,
                       const double (*points)[3], lamp_shares *out);

/* The lamp at a place of [0, 1) among all: a group has its share, and a lamp of it that of its power. */
uint32_t lamp_groups_at(const lamp_groups *l, const lamp_shares *shares, double place);

/* The density of a sample per area, at an element that emits. */
double lamp_groups_density(const lamp_groups *l, const lamp_shares *shares, uint32_t element);

#endif
