/* Rows of sensors: the weights with which radiosities, and radiances of the sky, come to receivers,
 *     value_s = sum_j weight_sj B_j + sum_t sky_ts L_t,
 * in lx, or in W/m^2 as B has it. An element whose unoccluded factor exceeds the share of one ray, and each
 * element of groups that give light, up to 256 of these and the larger factors of more, has its exact factor
 * times the share of it that nothing hides, by segments; all others are found by rays. Rays for the sky are
 * aimed at openings too, and in each direction those of the way that has more of them count (the maximum
 * heuristic: Veach and Guibas 1995): the sky through an opening is then seen by rays that all go there, whose
 * number is no matter of chance. The nine rows of a probe have one set of pairs and rays, and weights of
 * either sign. Knows neither names nor stores. */
#ifndef LAMBERT_SENSOR_SENSOR_ROWS_H
#define LAMBERT_SENSOR_SENSOR_ROWS_H

#include "solver/base/progress.h"
#include "solver/formfactor/sky_bounce.h"
#include "solver/scene/facet/face_openings.h"
#include "solver/sensor/receiver.h"

/* Rays of a receiver: a power of two. */
enum { SENSOR_RAYS_LEAST = 64, SENSOR_RAYS = 1024, SENSOR_RAYS_MOST = 65536 };

typedef struct sensor_rows_options {
    size_t rays;        /* 0: SENSOR_RAYS */
    double pair_factor; /* an element of a larger one is a pair; 0: the share of a ray */
    uint64_t seed;
    const bool *sources;           /* [n_groups], those that give light beside groups that emit; NULL: none */
    const sky_bounce *sky;         /* its tiling and the albedo of its ground; NULL: no sky */
    const face_openings *openings; /* rays are aimed at these; NULL: at those of the mesh */
    const progress *progress;      /* may be NULL */
    const char *stage;
} sensor_rows_options;

/* A weight is the mean of two independent halves of the samples, and off is half of their difference. So of
 * any light the square of sum_j off_sj B_j + sum_t sky_off_ts L_t is an estimate, without bias and of one
 * degree of freedom, of the variance of a value by sampling: mean squares over receivers of one set are
 * sound. A variance for each row and group would need to know how uneven the light of a group is. */
typedef struct sensor_rows {
    size_t n, n_receivers, n_tiles; /* n: elements */
    size_t rays;                    /* of a receiver */
    uint64_t *start;                /* [n_receivers + 1] */
    uint32_t *element;              /* [start[n_receivers]], ascending in a row */
    float *weight, *off;            /* likewise */
    float *sky, *sky_off;           /* [n_tiles][n_receivers], sr: with the light that the ground reflects */
    float *backs; /* [n_receivers], the share of rays that meet backs of faces; of a probe, of the rays that
                     meet faces */
} sensor_rows;

/* A receiver of whose rays more than this share meet backs lies in a wall, or outside of the scene. */
#define SENSOR_BACKS_MOST .5

/* Finds the rows. A receiver on the front of an element, or behind it by no more than a millimetre or a
 * ten-thousandth of the scene, lies on it; a plane in that of an element into whose front it looks lies
 * behind it. In a closed scene without panes a row's sum is 1; those of a probe 2 / sqrt(pi)
 * and eight times nearly 0. The nine harmonics of a probe follow each other. The bits depend on seed and
 * place in the list, not on threads. Freed by sensor_rows_free. Errors: LAM_ERR_MEMORY, LAM_ERR_CANCELLED,
 * LAM_ERR_INTERNAL. Cost: for a receiver the rays, four times as many towards openings, 32 segments for each
 * pair and 256 where it is partly hidden, and .01 us for each element. */
lam_status sensor_rows_make(const mesh *m, size_t n, const receiver *receivers,
                            const sensor_rows_options *options, sensor_rows *out, lam_error *error);
void sensor_rows_free(sensor_rows *r);

#endif
