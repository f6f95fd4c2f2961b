#include "solver/operator/stated/whole_law.h"

#include <math.h>
#include <stdlib.h>

/* The least share of the errors of groups alone that may be left where they shine together. */
static const double together_least = .25;

uint32_t whole_place(const error_by_group *e, size_t group) {
    return e->whole_of != NULL ? e->whole_of[group] : WHOLE_NONE;
}

void whole_light_free(whole_light *w) {
    free(w->weights);
    *w = (whole_light){.weights = NULL};
}

/* The value of all elements of a group that may emit; 0 where they differ. */
static double even_value(const error_scene *scene, size_t group, const float *E) {
    double value = 0;
    bool first = true;
    for (uint32_t k = scene->start[group]; k < scene->start[group + 1]; k++) {
        const size_t i = scene->members[k];
        if (scene->emits != NULL && !scene->emits[i]) continue;
        if (!first && (double)E[i] != value) return 0;
        value = (double)E[i];
        first = false;
    }
    return value;
}

/* Adds the size of a channel but for what is counted as of whole groups, by their weights. */
static void add_rest(const error_by_group *e, const error_scene *scene, const double *weights, const float *E,
                     emission_size *rest) {
    double power = 0, squares = 0;
    for (size_t i = 0; i < scene->n; i++) {
        const uint32_t place = e->whole_of[e->bin[i] % e->figures.n_groups];
        if (E[i] == 0 || (place != WHOLE_NONE && weights[place] > 0)) continue;
        const double flux = fabs(scene->area[i] * (double)E[i]);
        power += flux;
        squares += flux * flux;
    }
    rest->power2 += power * power;
    rest->squares += squares;
}

void whole_light_set_mesh(const error_by_group *e, whole_light *w) {
    const group_errors *f = &e->figures;
    w->mesh = mesh_whole_of(&e->mesh, f->n_channels, f->n_whole, f->whole_groups, w->weights);
}

bool whole_light_find(const error_by_group *e, const error_scene *scene, const float *E, whole_light *out) {
    const size_t w = e->figures.n_whole;
    *out = (whole_light){.weights = NULL};
    if (e->whole_of == NULL || E == NULL) return true;
    out->weights = memory_allocate(w, scene->n_channels * sizeof *out->weights, "errors", NULL);
    if (out->weights == NULL) return false;
    for (size_t c = 0; c < scene->n_channels; c++) {
        const float *of_channel = E + c * scene->n;
        for (size_t k = 0; k < w; k++)
            out->weights[c * w + k] = fabs(even_value(scene, e->figures.whole_groups[k], of_channel));
        add_rest(e, scene, out->weights + c * w, of_channel, &out->rest);
    }
    whole_light_set_mesh(e, out);
    return true;
}

/* Adds w' K w, no less than a share of its diagonal. */
static double square(size_t n, const double *K, const double *w) {
    double sum = 0, alone = 0;
    for (size_t j = 0; j < n; j++) {
        double row = 0;
        if (!(w[j] > 0)) continue;
        for (size_t l = 0; l < j; l++) row += (K[j * n + l] + K[l * n + j]) * w[l];
        alone += w[j] * w[j] * K[j * n + j];
        sum += w[j] * row;
    }
    return fmax(alone + sum, together_least * alone);
}

bin_error whole_law(const error_by_group *e, const double *weights, size_t bin) {
    const group_errors *f = &e->figures;
    const size_t w = f->n_whole, C = f->n_channels;
    bin_error sum = {0, 0};
    for (size_t c = 0; c < C; c++) {
        sum.elements2 += square(w, f->whole_rms + bin * w * w, weights + c * w) / (double)C;
        sum.mean2 += square(w, f->whole_mean + bin * w * w, weights + c * w) / (double)C;
    }
    if (e->area[bin] > 0)
        sum.mean2 =
            fmax(sum.mean2, sum.elements2 * e->squares[bin % f->n_groups] / (e->area[bin] * e->area[bin]));
    return sum;
}
