/* The share of the light of a group that constants on its elements leave, for any light: a law between the
 * lights that a store states it for (error_figures.h). */
#ifndef LAMBERT_OPERATOR_STATED_MESH_LAW_H
#define LAMBERT_OPERATOR_STATED_MESH_LAW_H

#include "solver/operator/stated/error_figures.h"

/* Squares of shares, mean square variation over mean square of B - E. Zeroed: nothing is stated. */
typedef struct mesh_shares {
    size_t n_groups;
    double *of[MESH_FIGURES];              /* [n_groups + 1], the last of all groups that exchange light with
                                              others; NULL: not stated */
    double even_emitters, groups_emitters; /* effective numbers; 0: not stated */
    double even_tiles;                     /* of an even sky */
    double luminaires_number;              /* of all luminaires */
    double common_light, common_sky, common_luminaires; /* q below, of elements, of tiles and of luminaires;
                                                           0: not stated, of an older store */
    /* [n_groups], of groups that are lit alone: m_g^2 and the light l_g of 1 W. One that was not measured has
     * the share of groups and the mean light of the others. NULL: not stated. */
    double *group_share2, *group_light;
    double *area;                          /* [n_groups] */
    double shared_light, shared_variation; /* l and v of mesh_whole_of; 0: not stated */
    bool *lamps; /* [n_groups], true where lamps of the scene are; NULL: not stated, any light is taken for
                    theirs */
} mesh_shares;
void mesh_shares_free(mesh_shares *m);

/* area [n_groups] of groups; even_tiles: the effective number of tiles of an even sky, 0 without one. A group
 * that was not looked at, or that the light did not reach, has the share of the scene, and so have all groups
 * of an older store. Errors: LAM_ERR_MEMORY. */
lam_status mesh_shares_make(const mesh_figures *from, size_t n_groups, const double *area, double even_tiles,
                            mesh_shares *out, lam_error *error);

bool mesh_shares_known(const mesh_shares *m);

/* The variation of the light of whole groups, by what is known of each of them: the share of it that each
 * lights alone, the rest being what they light in common; the factor from the square of the share of groups
 * to that of these; and from that of an even light to that of what they light in common. Zeroed: not known,
 * it goes by the number of emitters. */
typedef struct mesh_whole {
    bool known;
    double alone, scale, common;
} mesh_whole;

/* Of groups [n_whole] that shine evenly by weights [C][n_whole], W/m^2: with P_g the power of a group, l_g
 * and m_g its light and its share alone, p = (sum_g P_g)^2 - sum_g P_g^2, the square of the share that they
 * leave together is m^2 = (sum_g P_g^2 l_g m_g^2 + p v) / (sum_g P_g^2 l_g + p l). The light l that two
 * groups have in common, and its variation v, are those of the light of all elements, l_e and l_e m_e^2,
 * without what groups light alone, a_g being their shares of the area: l = (l_e - sum_g a_g^2 l_g) / (1 -
 * sum_g a_g^2), at least 0; v = (l_e m_e^2 - sum_g a_g^2 l_g m_g^2) / (1 - sum_g a_g^2), which is negative
 * where groups even out the light of each other. Lamps of the scene are left out. Cost: O(C n_whole). */
mesh_whole mesh_whole_of(const mesh_shares *m, size_t n_channels, size_t n_whole, const uint32_t *groups,
                         const double *weights);

/* The light of an answer: the power that elements emit, the parts of it that come from groups with lamps and
 * from other groups that shine evenly as wholes, the effective number of emitters, that of all but such
 * groups, the power that a sky sends on, and the effective number of its tiles, the same of luminaires;
 * bounced: the direct light of these is no part of it. */
typedef struct mesh_light {
    double power, of_lamps, of_whole, emitters, others, sky_power, sky_tiles, luminaire_power, luminaires;
    bool bounced;
    mesh_whole whole;
} mesh_light;

/* Squares of the shares that a group lacks. m^2, what its light varies by inside elements: squares of parts
 * of a light are weighted by their powers. Light from groups with lamps has that of the lamps, and that of
 * other whole groups what they light alone and in common (mesh_whole); of older stores the share of groups,
 * which goes over to that of an even light by log N, the effective number of emitters. N emitters here and
 * there lie between a single one, m_1^2, and an even light of N_e, m_e^2: what they light in common, q of the
 * square of the light of one, varies as the even light, and the rest as the single one, m^2 = (s m_1^2 + (1 -
 * s) q m_e^2) / (s + (1 - s) q),    s = (1/N - 1/N_e) / (1 - 1/N_e). In a maze q is a hundredth, and twenty
 * emitters vary as one does. The same holds of the tiles of a sky, single ones and all, of whose two kinds of
 * skies the larger counts; of their bounced light one tile counts as a group, from where it falls, and all as
 * an even light. Luminaires have the same law of single ones and of all together, and their bounced light
 * too.
 *
 * The mean of a group is off by less: light is sent by elements as if it were even over them. By reciprocity
 * the mean is the product of the light that is sent and of the light of the group where it alone shines, so
 * that it is off by that of both variations inside elements, about
 *     c_g = sqrt(2) m s_g,
 * m being the share of the scene where light is sent from, m_g if that is more, and s_g that of the light of
 * group g. Elements are off by m_g and by c = m s_1 / sqrt(2), s_1 that of single elements; squares add up. 0
 * where nothing is stated; stores without s have m in its place. group n_groups is all of them together. */
typedef struct mesh_lack {
    double elements2, mean2;
    double sent2, one2; /* m^2 of the light where it is sent from, and s_1^2 */
} mesh_lack;
mesh_lack mesh_lack_of(const mesh_shares *m, const mesh_light *light, size_t group);

#endif
