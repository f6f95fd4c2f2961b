/* The share of the light of a group that constants on its elements leave, for any light: a law between the
 * lights that a store states it for (error_figures.h). */
#ifndef LAMBERT_OPERATOR_STATED_MESH_LAW_H
#define LAMBERT_OPERATOR_STATED_MESH_LAW_H

#include "solver/operator/stated/error_figures.h"

/* Squares of shares, mean square variation over mean square of B - E. Zeroed: nothing is stated. */
typedef struct mesh_shares {
    size_t n_groups;
    double *of[MESH_FIGURES];              /* [n_groups + 1], the last of the scene; NULL: not stated */
    double even_emitters, groups_emitters; /* effective numbers; 0: not stated */
    bool *lamps; /* [n_groups], true where lamps of the scene are; NULL: not stated, any light is taken for
                    theirs */
} mesh_shares;
void mesh_shares_free(mesh_shares *m);

/* A group that was not looked at, or that the light did not reach, has the share of the scene, and so have
 * all groups of an older store. Errors: LAM_ERR_MEMORY. */
lam_status mesh_shares_make(const mesh_figures *from, size_t n_groups, mesh_shares *out, lam_error *error);

bool mesh_shares_known(const mesh_shares *m);

/* The light of an answer: the power that elements emit, the part of it that comes from groups with lamps, the
 * effective number of emitters, and the power that a sky sends on; bounced: the direct light of the sky is no
 * part of it. */
typedef struct mesh_light {
    double power, of_lamps, emitters, sky_power;
    bool bounced;
} mesh_light;

/* Squares of the shares that a group lacks. m^2, what its light varies by inside elements: squares of parts
 * of a light are weighted by their powers. Light from groups with lamps has that of the lamps; of other
 * emissions the squares follow log N, the effective number of emitters, from single elements through groups
 * to an even light. Of two skies the larger counts, and of their bounced light, which comes from everywhere,
 * that of an even light.
 *
 * The mean of a group is off by less: light is sent by elements as if it were even over them, and where it is
 * not, the part of it that arrives varies with it, so that the error is of second order, about
 *     c = (m_g^2 + m^2) / 2,
 * m being the share of the scene. Elements have m_g^2 + c^2. 0 where nothing is stated. */
typedef struct mesh_lack {
    double elements2, mean2;
} mesh_lack;
mesh_lack mesh_lack_of(const mesh_shares *m, const mesh_light *light, size_t group);

#endif
