/* Lights of one element and of one group by which the error of the mesh is stated for other emissions than
 * the scene's own, and the steps that all such lights share. */
#ifndef LAMBERT_PRECOMPUTE_MESH_ERROR_LIGHTS_H
#define LAMBERT_PRECOMPUTE_MESH_ERROR_LIGHTS_H

#include "solver/adapt/mesh_error.h"
#include "solver/precompute/parts.h"

/* The effective number of emitters of an emission E [C][n]. */
double mesh_error_emitters(const mesh *m, const float *E);

/* Sum A (B - E)^2 of an answer B [C][n] over the square of the power of E, 1/m^2; where E is the first bounce
 * of a sky, sum A B^2. 0 of no light. */
double mesh_error_light(const mesh *m, const float *E, const float *B, bool first_bounce);

/* The radiosity B [n_lights][C][n] of emissions E; of a lightened scene (black_scene.h) by the irradiance, as
 * the operator is of one that reflects nothing: B = E + rho H. An operator that knows few emitters alone is
 * asked by their weights W [n_lights][C][s], of which elements emit E (NULL: nothing); else W is NULL. work
 * is for lam_operator_apply. */
lam_status mesh_error_answers(const precompute_scene *scene, const made_operator *made, size_t n_lights,
                              const float *W, const float *E, float *B, void *work, size_t bytes,
                              lam_error *error);

/* Room for figures by group of n_lights lights; out->fewer stays. Freed by mesh_error_groups_free, also after
 * LAM_ERR_MEMORY. */
lam_status mesh_error_groups_begin(const mesh *m, size_t n_lights, mesh_error_groups *out, lam_error *error);
void mesh_error_groups_free(mesh_error_groups *g);

/* Puts the figures of a light into those that the store states for the light `which` (MESH_OF_...). A
 * variance below its standard error is stated as that. Errors: LAM_ERR_MEMORY. */
lam_status mesh_error_take(const mesh_error_groups *from, size_t light, int which, size_t n_groups,
                           mesh_figures *to, lam_error *error);

/* Sums over lights that are stated together, each scaled to sum A (B - E)^2 = 1, by group. Zeroed: freed. */
typedef struct mesh_light_sums {
    double *area;                       /* [n_groups] */
    double *variance, *noise2, *light2; /* [n_groups] */
    double light;                       /* sum of mesh_error_light */
    size_t n;                           /* lights */
} mesh_light_sums;
lam_status mesh_light_sums_begin(const mesh *m, mesh_light_sums *s, lam_error *error);
void mesh_light_sums_free(mesh_light_sums *s);

/* Adds light number k of those whose figures are given, and its mesh_error_light; nothing where no group has
 * any. */
void mesh_light_sums_add(const mesh_error_groups *of, size_t k, const mesh *m, double light,
                         mesh_light_sums *to);

/* States them as the light `which` (MESH_OF_...), and *whole, the share of all groups together; leaves *has
 * where no light was added. Errors: LAM_ERR_MEMORY. */
lam_status mesh_light_sums_state(const mesh_light_sums *s, const mesh *m, int which, double *whole, bool *has,
                                 mesh_figures *to, lam_error *error);

/* States the error for light of single elements, of all of them, and of some single groups, where the
 * operator takes any emission. Cost: about that of mesh_error twice more. Errors: those of mesh_error. */
lam_status mesh_error_add_others(const precompute_job *job, const precompute_scene *scene,
                                 made_operator *made, lam_error *error);

#endif
