#include "solver/codec/face_means.h"

#include "solver/base/array_grow.h"
#include "store/status.h"

#include <math.h>
#include <stdlib.h>

void face_index_free(face_index *f) {
    free(f->start);
    free(f->element);
    free(f->area);
    scene_faces_free(&f->of);
    *f = (face_index){.n_faces = 0};
}

uint64_t face_index_bytes(uint64_t n, uint64_t n_faces, uint64_t n_parts) {
    return n * sizeof(uint32_t) + n_parts * sizeof(scene_face_part) + (n_faces + 1) * sizeof(uint32_t) +
           (n + n_parts) * (sizeof(uint32_t) + sizeof(double));
}

static void count_entries(const face_index *f, uint32_t *counts) {
    for (size_t i = 0; i < f->n_fronts; i++)
        if (f->of.of[i] != SCENE_FACE_NONE) counts[f->of.of[i]]++;
    for (size_t p = 0; p < f->of.n_parts; p++) counts[f->of.parts[p].face]++;
}

/* Fills the entries from the last element on, so that those of a face ascend; start holds the ends of faces,
 * which become the beginnings. */
static void fill_entries(face_index *f) {
    size_t p = f->of.n_parts;
    for (size_t i = f->n_fronts; i-- > 0;) {
        const uint32_t face = f->of.of[i];
        for (; p > 0 && f->of.parts[p - 1].element == i; p--) {
            const scene_face_part *part = &f->of.parts[p - 1];
            const uint32_t at = --f->start[part->face];
            f->element[at] = (uint32_t)i;
            f->area[at] = part->area;
        }
        if (face == SCENE_FACE_NONE) continue;
        const uint32_t at = --f->start[face];
        f->element[at] = (uint32_t)i;
        if (f->area != NULL) f->area[at] = f->own[i];
    }
}

lam_status face_index_make(size_t n, size_t n_fronts, const double *area, scene_faces *faces, face_index *out,
                           lam_error *error) {
    lam_status status = LAM_OK;
    face_index made = {
        .n_faces = faces->of != NULL ? faces->n_faces : 0, .n = n, .n_fronts = n_fronts, .own = area};
    made.of = *faces;
    *faces = (scene_faces){.n_faces = 0};
    *out = (face_index){.n_faces = 0};
    if (made.n_faces == 0) goto done;
    if (made.of.n_parts > UINT32_MAX - n) /* of a store, in which each has 16 bytes */
        FAIL(error, LAM_ERR_FORMAT, "%zu parts of faces are too many", made.of.n_parts);
    made.start = memory_allocate(made.n_faces + 1, sizeof *made.start, "faces", error);
    if (made.start == NULL) TRY(LAM_ERR_MEMORY);
    count_entries(&made, made.start);
    for (size_t f = 0; f < made.n_faces; f++) made.start[f + 1] += made.start[f];
    made.n_entries = made.start[made.n_faces];
    made.element = memory_allocate(made.n_entries, sizeof *made.element, "faces", error);
    if (made.element == NULL) TRY(LAM_ERR_MEMORY);
    if (made.of.n_parts > 0) {
        made.area = memory_allocate(made.n_entries, sizeof *made.area, "faces", error);
        if (made.area == NULL) TRY(LAM_ERR_MEMORY);
    }
    fill_entries(&made);
    *out = made;
    made = (face_index){.n_faces = 0};
done:
    face_index_free(&made);
    return status;
}

/* The first part of an element or of one behind it. */
static size_t find_part(const scene_faces *of, uint32_t element) {
    size_t low = 0, high = of->n_parts;
    while (low < high) {
        const size_t middle = low + (high - low) / 2;
        if (of->parts[middle].element < element)
            low = middle + 1;
        else
            high = middle;
    }
    return low;
}

static int ascending(const void *a, const void *b) {
    const uint32_t p = *(const uint32_t *)a, q = *(const uint32_t *)b;
    return (p > q) - (p < q);
}

static bool append(uint32_t **list, size_t *count, size_t *room, uint32_t face) {
    if (*count > 0 && (*list)[*count - 1] == face) return true; /* neighbours are often of one face */
    if (array_grow(list, room, *count + 1, sizeof **list, "faces", NULL) != LAM_OK) return false;
    (*list)[(*count)++] = face;
    return true;
}

bool face_index_of(const face_index *f, size_t count, const uint32_t *elements, uint32_t **faces,
                   size_t *n_faces) {
    uint32_t *list = NULL;
    size_t n = 0, room = 0, kept = 0;
    bool good = array_grow(&list, &room, 1, sizeof *list, "faces", NULL) == LAM_OK;
    for (size_t k = 0; good && k < count; k++) {
        const uint32_t i = elements[k];
        if (i >= f->n_fronts) continue;
        if (f->of.of[i] != SCENE_FACE_NONE) {
            good = append(&list, &n, &room, f->of.of[i]);
            continue;
        }
        for (size_t p = find_part(&f->of, i); good && p < f->of.n_parts && f->of.parts[p].element == i; p++)
            good = append(&list, &n, &room, f->of.parts[p].face);
    }
    if (!good) {
        free(list);
        return false;
    }
    qsort(list, n, sizeof *list, ascending);
    for (size_t k = 0; k < n; k++)
        if (k == 0 || list[k] != list[kept - 1]) list[kept++] = list[k];
    *faces = list;
    *n_faces = kept;
    return true;
}

static size_t face_of(const face_choice *c, size_t k) {
    return c->faces != NULL ? c->faces[k] : k;
}

static size_t count_of(const face_index *f, const face_choice *c) {
    size_t count = 0;
    for (size_t k = 0; k < c->n; k++) count += f->start[face_of(c, k) + 1] - f->start[face_of(c, k)];
    return count;
}

bool face_choice_elements(const face_index *f, const face_choice *c, uint32_t **elements, size_t *count) {
    size_t at = 0;
    uint32_t *list = memory_allocate(count_of(f, c), sizeof *list, "faces", NULL);
    if (list == NULL) return false;
    for (size_t k = 0; k < c->n; k++)
        for (uint32_t e = f->start[face_of(c, k)]; e < f->start[face_of(c, k) + 1]; e++)
            list[at++] = f->element[e];
    *elements = list;
    *count = at;
    return true;
}

/* A row of values, in single or in double precision. */
typedef struct row {
    const float *floats;
    const double *doubles;
} row;

static double value_at(const row *x, size_t k) {
    return x->floats != NULL ? (double)x->floats[k] : x->doubles[k];
}

/* The mean of a face, whose values are those of its elements or, at SIZE_MAX behind it, `at` on; the bound of
 * its rounding error: count products and sums of these and of areas, and a quotient. */
static double mean_of(const face_index *f, size_t face, const row *x, size_t at, double *rounding) {
    const uint32_t first = f->start[face], end = f->start[face + 1];
    double sum = 0, size = 0, area = 0;
    if (first == end) return NAN;
    for (uint32_t e = first; e < end; e++) {
        const double value = value_at(x, at == SIZE_MAX ? f->element[e] : at + (e - first));
        if (end - first == 1) return isnan(value) ? (double)INFINITY : value;
        const double part = face_index_area(f, e);
        sum += part * value;
        size += part * fabs(value);
        area += part;
    }
    *rounding = fmax(*rounding, (2. * (end - first) + 2) * 0x1p-53 * (size / area));
    return isnan(sum) ? (double)INFINITY : sum / area;
}

void face_means_floats(const face_index *f, const face_choice *c, size_t rows, const float *x, float *out) {
    const size_t width = c->faces == NULL ? f->n : count_of(f, c);
    double unused = 0;
    for (size_t r = 0; r < rows; r++) {
        const row values = {.floats = x + r * width};
        for (size_t k = 0, at = 0; k < c->n; k++) {
            const size_t face = face_of(c, k);
            out[r * c->n + k] = (float)mean_of(f, face, &values, c->faces == NULL ? SIZE_MAX : at, &unused);
            at += f->start[face + 1] - f->start[face];
        }
    }
}

void face_means_doubles(const face_index *f, const face_choice *c, size_t rows, const double *x, double *out,
                        double *rounding) {
    const size_t width = c->faces == NULL ? f->n : count_of(f, c);
    for (size_t r = 0; r < rows; r++) {
        const row values = {.doubles = x + r * width};
        for (size_t k = 0, at = 0; k < c->n; k++) {
            const size_t face = face_of(c, k);
            out[r * c->n + k] = mean_of(f, face, &values, c->faces == NULL ? SIZE_MAX : at, rounding);
            at += f->start[face + 1] - f->start[face];
        }
    }
}
