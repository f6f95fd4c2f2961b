/* The errors of answers at sensors, by what a store states of its elements. Value s is
 *     v_s = sum_j w_sj B_j + direct light,
 * so that it is off by three things. The rows w are sampled: their variance is known of each answer. The
 * elements are off by operator and form factors: a sensor gathers means over groups, W_sg the sum of w over
 * group g, and is off by sum_g W_sg e_g, e_g the error of the mean of g, of one sign at worst. And light is
 * constant on elements, and so are the weights of a point: by reciprocity it is off by the product of both
 * variations inside elements. The weight of an element of edge h at a distance d is w = cos cos' h^2 / (pi
 * d^2); over it 1 / d^2 varies by 2 h / d / sqrt(12), which with cos cos' = 1/2 is
 *     v_sj = (2 pi w_sj / 3)^1/2,
 * and over a group no more than that of single elements, s_1. With m_g the variation of the light that group
 * g reflects and R_sj = w_sj (B_j - E_j) a point is off by
 *     (sum_g (m_g sum_j v_sj R_sj)^2 + (c_g sum_j R_sj)^2)^1/2,
 * c_g being what the mean of g is off by (mesh_lack, operator/stated/mesh_law.h): what light and weights have
 * inside elements of one group says nothing of the sign in another.
 * Direct light comes to the point itself, and is free of these. No I/O. */
#ifndef LAMBERT_CODEC_SENSOR_ERROR_H
#define LAMBERT_CODEC_SENSOR_ERROR_H

#include "solver/operator/stated/answer_error.h"

/* Squares of a set, sums over its receivers that have a value, and over channels. */
typedef struct sensor_squares {
    double light2;      /* of values */
    double rows2, off2; /* of errors by rows, and by operator and form factors */
    double mesh2;       /* negative: not stated */
} sensor_squares;

/* One vector at the sensors of its store: `of` has its light and the radiosities of all elements, L [C][m]
 * its sky or NULL, values [C][s]. */
typedef struct sensor_answer {
    const lam_sensors *sensors;
    const error_answer *of;
    const float *L, *values;
} sensor_answer;

/* Fills squares [sets of the store] at the numbers of the sets named, each of which stands once. Cost: the
 * stored weights, and n_bins for each receiver. False when memory is short. */
bool sensor_squares_of(const error_by_group *e, const error_scene *scene, const sensor_answer *answer,
                       size_t n_sets, const uint32_t *sets, sensor_squares *squares);

/* Adds b to a: of several sets together. */
void sensor_squares_add(sensor_squares *a, const sensor_squares *b);

/* The parts of the headline of a set, over the root mean square of its values. */
stated_parts sensor_parts(const sensor_squares *squares);

#endif
