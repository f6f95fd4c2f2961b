#include "solver/codec/sensor_error.h"

#include "solver/operator/sensor_light.h"
#include "solver/operator/stated/whole_law.h"

#include <math.h>
#include <stdlib.h>

/* The errors of a bin: of its mean, and by the mesh m, s_1 and c as shares of what it reflects to a point. */
typedef struct bin_off {
    double mean, light, single, mesh_mean;
} bin_off;

/* The sums of one receiver over a bin, in a channel. */
typedef struct bin_sum {
    double weight, reflected, varies; /* w, R and v R */
} bin_sum;

/* Sums of the weights of a receiver by bin, of weights times B - E, and of these times the variation of the
 * weight inside an element; sums [n_bins] is zeroed first. */
static void sum_row(const error_by_group *e, const sensor_answer *a, size_t n, size_t c, size_t receiver,
                    bin_sum *sums) {
    const sensor_weights rows = sensors_weights(a->sensors);
    const float *B = a->of->values + c * n, *E = a->of->E != NULL ? a->of->E + c * n : NULL;
    for (size_t b = 0; b < e->n_bins; b++) sums[b] = (bin_sum){0, 0, 0};
    for (uint64_t k = rows.start[receiver]; k < rows.start[receiver + 1]; k++) {
        const size_t j = rows.element[k];
        const double w = (double)rows.weight[k], R = w * ((double)B[j] - (E != NULL ? (double)E[j] : 0));
        bin_sum *const to = &sums[e->bin[j]];
        to->weight += w;
        to->reflected += R;
        to->varies += sqrt(2 * M_PI / 3 * fabs(w)) * R;
    }
}

/* sum_b W_b e_b of a receiver, of one sign at worst. e_b are of all channels together. */
static double off_of(const error_by_group *e, const bin_off *off, const bin_sum *sums) {
    double sum = 0;
    for (size_t b = 0; b < e->n_bins; b++) sum += fabs(sums[b].weight) * off[b].mean;
    return sum;
}

/* (sum_b (m_b sum v R)^2 + (c_b sum R)^2)^1/2 of a receiver and channel. */
static double mesh_of(const error_by_group *e, const bin_off *off, const bin_sum *sums) {
    double sum = 0;
    for (size_t b = 0; b < e->n_bins; b++) {
        const double R = fabs(sums[b].reflected), varies = fmin(fabs(sums[b].varies), off[b].single * R),
                     at_point = off[b].light * varies, of_mean = off[b].mesh_mean * R;
        sum += at_point * at_point + of_mean * of_mean;
    }
    return sqrt(sum);
}

/* Adds a receiver in all channels. */
static void add_receiver(const error_by_group *e, const error_scene *scene, const sensor_answer *a,
                         const bin_off *off, const float *variance, size_t s, bin_sum *sums,
                         sensor_squares *to) {
    const size_t all = lam_sensors_count(a->sensors);
    for (size_t c = 0; c < scene->n_channels; c++) {
        const double value = (double)a->values[c * all + s];
        sum_row(e, a, scene->n, c, s, sums);
        const double mesh = mesh_of(e, off, sums), rest = c == 0 ? off_of(e, off, sums) : 0;
        to->light2 += value * value;
        to->rows2 += (double)variance[c * all + s];
        to->off2 += rest * rest;
        to->mesh2 += mesh * mesh;
    }
}

/* Errors of every bin, [n_bins]; freed with free(). */
static bin_off *errors_of_bins(const error_by_group *e, const error_scene *scene, const error_answer *of) {
    light_sizes sizes;
    bin_off *off = memory_allocate(e->n_bins, sizeof *off, "errors of sensors", NULL);
    if (off == NULL || !answer_sizes_of(e, scene, of, &sizes)) {
        free(off);
        return NULL;
    }
    for (size_t b = 0; b < e->n_bins; b++) {
        const mesh_lack mesh = mesh_lack_of_bin(e, &sizes, b);
        off[b] = (bin_off){sqrt(error_law(e, &sizes, b).mean2), sqrt(mesh.sent2), sqrt(mesh.one2),
                           sqrt(mesh.mean2)};
    }
    whole_light_free(&sizes.whole);
    return off;
}

bool sensor_squares_of(const error_by_group *e, const error_scene *scene, const sensor_answer *a,
                       size_t n_sets, const uint32_t *sets, sensor_squares *squares) {
    const size_t C = scene->n_channels, all = lam_sensors_count(a->sensors);
    bin_off *off = errors_of_bins(e, scene, a->of);
    bin_sum *sums = memory_allocate(e->n_bins, sizeof *sums, "errors of sensors", NULL);
    float *variance = memory_allocate(C, all * sizeof *variance, "errors of sensors", NULL);
    const bool good = off != NULL && sums != NULL && variance != NULL;
    if (good) lam_sensors_variance(a->sensors, 1, a->of->values, a->L, variance);
    for (size_t k = 0; good && k < n_sets; k++) {
        size_t first, count;
        lam_sensors_set(a->sensors, sets[k], &first, &count);
        sensor_squares *const to = &squares[sets[k]];
        *to = (sensor_squares){.light2 = 0};
        for (size_t s = first; s < first + count; s++)
            if (lam_sensors_has_value(a->sensors, s)) add_receiver(e, scene, a, off, variance, s, sums, to);
        if (!mesh_is_stated(e)) to->mesh2 = -1;
    }
    free(off);
    free(sums);
    free(variance);
    return good;
}

void sensor_squares_add(sensor_squares *a, const sensor_squares *b) {
    a->light2 += b->light2;
    a->rows2 += b->rows2;
    a->off2 += b->off2;
    a->mesh2 = a->mesh2 < 0 || b->mesh2 < 0 ? -1 : a->mesh2 + b->mesh2;
}

stated_parts sensor_parts(const sensor_squares *s) {
    return (stated_parts){.rest = error_ratio(s->off2, s->light2),
                          .mesh = s->mesh2 < 0 ? -1 : error_ratio(s->mesh2, s->light2),
                          .rows = error_ratio(s->rows2, s->light2)};
}
