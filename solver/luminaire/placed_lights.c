/* Appends the point and spot lights of a scene file to a list of luminaires. Lights whose tables are the same
 * but for a factor share one, of 1 cd. */
#include "solver/luminaire/luminaire_made.h"
#include "solver/luminaire/placed_parts.h"

#include "solver/base/array_grow.h"
#include "solver/base/photometry.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

_Static_assert((int)PUNCTUAL_NAME == (int)PLACED_NAME, "a light's name is that of a luminaire");

/* A name or a group of the list. */
typedef struct taken_name {
    const char *text;
    bool is_group;
} taken_name;

/* The lights, and the list that they make. */
typedef struct light_list {
    const char *name; /* of the scene file, with which messages begin */
    size_t n;
    const punctual_light *lights;
    placed_luminaires made;
    size_t first_file;                     /* of those that are made here */
    double (*cones)[2];                    /* [of such a file]: inner and outer; outer 0: a point */
    size_t cones_capacity, files_capacity; /* of cones; of made.files */
} light_list;

static int by_text(const void *a, const void *b) {
    const taken_name *first = a, *second = b;
    return strcmp(first->text, second->text);
}

/* A name stands for one luminaire, or for the luminaires of a group. Cost: O((n + list) log list). */
static lam_status check_names(const light_list *w, const placed_luminaires *p, lam_error *error) {
    lam_status status = LAM_OK;
    size_t n = 0;
    taken_name *taken = memory_allocate(p->n, 2 * sizeof *taken, w->name, error);
    if (taken == NULL) return LAM_ERR_MEMORY;
    for (size_t k = 0; k < p->n; k++) {
        taken[n++] = (taken_name){p->luminaires[k].name, false};
        if (p->luminaires[k].group[0] != '\0') taken[n++] = (taken_name){p->luminaires[k].group, true};
    }
    qsort(taken, n, sizeof *taken, by_text);
    for (size_t k = 0; k < w->n; k++) {
        const taken_name own = {w->lights[k].name, false};
        const taken_name *same = bsearch(&own, taken, n, sizeof *taken, by_text);
        if (same == NULL || w->lights[k].kind == PUNCTUAL_DIRECTIONAL) continue;
        FAIL(error, LAM_ERR_ARGUMENT,
             "%.200s: its light %s has the name of a %s of the list of luminaires; rename one of them",
             w->name, own.text, same->is_group ? "group" : "luminaire");
    }
done:
    free(taken);
    return status;
}

/* Finds the table of a light, or makes it. */
static lam_status find_file(light_list *w, const punctual_light *light, size_t k, size_t *file,
                            lam_error *error) {
    lam_status status = LAM_OK;
    placed_luminaires *p = &w->made;
    const bool is_spot = light->kind == PUNCTUAL_SPOT;
    const double inner = is_spot ? light->inner : 0, outer = is_spot ? light->outer : 0;
    placed_file f = {.path = NULL, .entry = k};
    char name[64];
    for (*file = w->first_file; *file < p->n_files; ++*file) {
        const double *cone = w->cones[*file - w->first_file];
        if (cone[0] == inner && cone[1] == outer) return LAM_OK;
    }
    if (p->n_files == PLACED_FILES_MOST)
        FAIL(error, LAM_ERR_ARGUMENT,
             "%.200s: light %s: with its cone there are more than %d files of luminaires and cones of lights",
             w->name, light->name, PLACED_FILES_MOST);
    snprintf(name, sizeof name, is_spot ? "spot, %.6g to %.6g degrees" : "point", inner * (180 / M_PI),
             outer * (180 / M_PI));
    TRY(array_grow(&p->files, &w->files_capacity, p->n_files + 1, sizeof *p->files, w->name, error));
    TRY(array_grow(&w->cones, &w->cones_capacity, p->n_files + 1 - w->first_file, sizeof *w->cones, w->name,
                   error));
    TRY(is_spot ? luminaire_of_spot(1, inner, outer, &f.photometry, error)
                : luminaire_of_point(1, &f.photometry, error));
    f.name = memory_allocate(strlen(name) + 1, 1, w->name, error);
    if (f.name == NULL) TRY(LAM_ERR_MEMORY);
    memcpy(f.name, name, strlen(name) + 1);
    f.lumens = fmax(0, luminaire_lumens(&f.photometry));
    memcpy(w->cones[p->n_files - w->first_file], (const double[2]){inner, outer}, sizeof *w->cones);
    p->files[p->n_files++] = f;
    f = (placed_file){.path = NULL};
done:
    luminaire_free(&f.photometry);
    return status;
}

/* Candela are weighed by the eye: the luminance Y of a light's colour is a factor of its intensity, and the
 * rest, colour / Y, has the luminance 1. The largest component is divided out first, so that no quotient
 * loses its digits. A black light stays in the list, without light. */
static void settle_colour(const punctual_light *light, placed_luminaire *l) {
    const double *c = light->colour, most = fmax(fmax(c[0], c[1]), c[2]);
    for (int d = 0; d < 3; d++) l->colour[d] = most > 0 ? c[d] / most : 1;
    const double Y = luminance_of(l->colour[0], l->colour[1], l->colour[2]);
    for (int d = 0; d < 3; d++) l->colour[d] /= Y;
    l->scale = light->intensity * most * Y;
}

static lam_status add_light(light_list *w, size_t k, lam_error *error) {
    lam_status status = LAM_OK;
    const punctual_light *light = &w->lights[k];
    placed_luminaire l = {.dim = 1, .maintenance = 1, .is_point = true, .entry = k};
    TRY(find_file(w, light, k, &l.file, error));
    memcpy(l.name, light->name, sizeof l.name);
    memcpy(l.at, light->at, sizeof l.at);
    (void)placed_aim(light->direction, NULL, 0, 'z', &l); /* a unit vector has a frame */
    settle_colour(light, &l);
    l.flux = l.scale * w->made.files[l.file].lumens;
    w->made.luminaires[w->made.n++] = l;
done:
    return status;
}

lam_status placed_from_lights(const char *name, size_t n, const punctual_light *lights, placed_luminaires *p,
                              size_t *n_directional, lam_error *error) {
    lam_status status = LAM_OK;
    light_list w = {.name = name, .n = n, .lights = lights, .first_file = p->n_files};
    size_t outside = 0;
    w.made.n = p->n;
    w.made.n_files = p->n_files;
    for (size_t k = 0; k < n; k++) outside += lights[k].kind == PUNCTUAL_DIRECTIONAL;
    if (n - outside > PLACED_MOST - p->n)
        FAIL(error, LAM_ERR_ARGUMENT,
             "%.200s: with its %zu lights there are %zu luminaires, must be at most %d", name, n - outside,
             p->n + n - outside, PLACED_MOST);
    TRY(check_names(&w, p, error));
    w.made.luminaires = memory_allocate(p->n + n - outside, sizeof *w.made.luminaires, name, error);
    if (w.made.luminaires == NULL) TRY(LAM_ERR_MEMORY);
    TRY(array_grow(&w.made.files, &w.files_capacity, p->n_files + 1, sizeof *w.made.files, name, error));
    if (p->n > 0) memcpy(w.made.luminaires, p->luminaires, p->n * sizeof *p->luminaires);
    if (p->n_files > 0) memcpy(w.made.files, p->files, p->n_files * sizeof *p->files);
    for (size_t k = 0; k < n; k++)
        if (lights[k].kind != PUNCTUAL_DIRECTIONAL) TRY(add_light(&w, k, error));
    free(p->luminaires);
    free(p->files);
    p->luminaires = w.made.luminaires;
    p->files = w.made.files;
    p->n = w.made.n;
    p->n_files = w.made.n_files;
    *n_directional = outside;
    w.made.luminaires = NULL;
    w.made.files = NULL;
done:
    for (size_t k = w.first_file; w.made.files != NULL && k < w.made.n_files; k++) {
        free(w.made.files[k].name);
        luminaire_free(&w.made.files[k].photometry);
    }
    free(w.made.files);
    free(w.made.luminaires);
    free(w.cones);
    return status;
}
