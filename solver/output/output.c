#include "solver/output/output.h"

#include "solver/base/atomic_file.h"
#include "solver/codec/answer.h"
#include "solver/codec/npy.h"
#include "solver/codec/request.h"

#include <stdlib.h>
#include <string.h>

void reductions_free(reduction *reductions, size_t n) {
    for (size_t r = 0; r < n; r++) {
        free(reductions[r].group);
        free(reductions[r].figures);
        reduce_request_free(&reductions[r].request);
    }
}

/* The reduction of a group, a new one where there is none. */
static reduction *find_reduction(reduction *reductions, size_t *n, const char *group, size_t length) {
    for (size_t r = 0; r < *n; r++)
        if (strlen(reductions[r].group) == length && memcmp(reductions[r].group, group, length) == 0)
            return &reductions[r];
    reductions[*n] = (reduction){.group = strndup(group, length)};
    return reductions[*n].group != NULL ? &reductions[(*n)++] : NULL;
}

lam_status reductions_add(reduction *reductions, size_t *n, const char *item, lam_error *error) {
    lam_status status = LAM_OK;
    problem why;
    const char *equals = strrchr(item, '=');
    if (equals == NULL || equals == item)
        FAIL(error, LAM_ERR_ARGUMENT,
             "--reduce %s: must be GROUP=mean, sum, min, max, uniformity or variance", item);
    reduction *r = find_reduction(reductions, n, item, (size_t)(equals - item));
    if (r == NULL) FAIL(error, LAM_ERR_MEMORY, "--reduce %s: not enough memory", item);
    for (const char *rest = equals + 1;; rest++) {
        const size_t length = strcspn(rest, ",");
        if (!reduce_request_with(&r->request, rest, length, &why))
            FAIL(error, LAM_ERR_ARGUMENT, "--reduce %.200s: %s", item, why.detail);
        rest += length;
        if (*rest == '\0') break;
    }
done:
    return status;
}

lam_status reductions_bind(reduction *reductions, size_t n, const group_index *groups, lam_error *error) {
    lam_status status = LAM_OK;
    problem why;
    for (size_t r = 0; r < n; r++) {
        const char *group = reductions[r].group;
        const uint32_t *found = NULL;
        const size_t length = strlen(group), n_found = group_index_find(groups, group, length, &found);
        char miss[GROUP_MISS];
        if (n_found == 0) {
            group_index_miss(groups, group, length, miss);
            FAIL(error, LAM_ERR_ARGUMENT, "--reduce %.200s: the scene has %s", group, miss);
        }
        if (!reduce_request_add(&reductions[r].request, group, length, found, n_found, &why))
            FAIL(error, LAM_ERR_MEMORY, "--reduce %.200s: %s", group, why.detail);
    }
done:
    return status;
}

lam_status reductions_elements(const mesh *m, const reduction *reductions, size_t n_reductions,
                               size_t *n_selected, uint32_t **selected, lam_error *error) {
    lam_status status = LAM_OK;
    bool *inside = NULL;
    uint32_t *made = NULL;
    *selected = NULL;
    *n_selected = 0;
    if (n_reductions == 0) return LAM_OK;
    inside = memory_allocate(m->n_groups, sizeof *inside, "the elements wanted", error);
    made = memory_allocate(m->n, sizeof *made, "the elements wanted", error);
    if (inside == NULL || made == NULL) TRY(LAM_ERR_MEMORY);
    for (size_t r = 0; r < n_reductions; r++) {
        const reduce_name *name = &reductions[r].request.names[0];
        for (size_t g = 0; g < name->n_groups; g++) inside[name->groups[g]] = true;
    }
    for (size_t i = 0; i < m->n; i++)
        if (inside[m->group[i]]) made[(*n_selected)++] = (uint32_t)i;
    *selected = made;
    made = NULL;
done:
    free(inside);
    free(made);
    return status;
}

lam_status reductions_fill(solution *s, lam_error *error) {
    lam_status status = LAM_OK;
    const size_t C = s->m->n_channels;
    const reduce_values x = {.floats = s->values, .doubles = s->refined, .whole = true};
    for (size_t r = 0; r < s->n_reductions; r++) {
        reduction *to = &s->reductions[r];
        to->figures = reduce_figures(&to->request, s->n_vectors, C);
        if (to->figures == NULL || !reduce_vectors(&to->request, s->groups, s->m->area, C, s->n_vectors, 0,
                                                   s->n_vectors, x, to->figures))
            FAIL(error, LAM_ERR_MEMORY, "--reduce %.200s: not enough memory", to->group);
    }
done:
    return status;
}

void output_column(const solution *s, size_t vector, size_t channel, char name[OUTPUT_COLUMN]) {
    static const char letters[] = "rgb";
    int length = snprintf(name, OUTPUT_COLUMN, "%s", codec_quantity_name(s->quantity));
    if (s->names != NULL)
        length += snprintf(name + length, OUTPUT_COLUMN - (size_t)length, "_%s", s->names[vector]);
    else if (s->batch)
        length += snprintf(name + length, OUTPUT_COLUMN - (size_t)length, "_%zu", vector);
    if (s->m->n_channels == 3)
        snprintf(name + length, OUTPUT_COLUMN - (size_t)length, "_%c", letters[channel]);
    else if (s->m->n_channels > 1)
        snprintf(name + length, OUTPUT_COLUMN - (size_t)length, "_c%zu", channel);
}

const char *output_face_group(const solution *s, size_t face, double *area) {
    const face_index *f = s->faces;
    *area = 0;
    for (uint32_t e = f->start[face]; e < f->start[face + 1]; e++) *area += face_index_area(f, e);
    if (f->start[face] == f->start[face + 1]) return NULL;
    return s->m->group_names[s->m->group[f->element[f->start[face]]]];
}

lam_status output_array(FILE *stream, size_t rank, const size_t *shape, const float *floats,
                        const double *doubles, lam_error *error) {
    enum { BLOCK = 1 << 16 };
    size_t count = 1;
    double rounding = 0;
    buffer b = {0};
    bool good = npy_write_header(&b, floats != NULL ? NPY_F4 : NPY_F8, rank, shape);
    for (size_t k = 0; k < rank; k++) count *= shape[k];
    for (size_t first = 0; good && (first < count || first == 0); first += BLOCK) {
        const size_t some = count - first < BLOCK ? count - first : BLOCK;
        good = floats != NULL ? npy_write_values(&b, NPY_F4, floats + first, some)
                              : npy_write_doubles(&b, NPY_F8, doubles + first, some, &rounding);
        if (good) fwrite(b.bytes, 1, b.length, stream);
        b.length = 0;
    }
    buffer_free(&b);
    return good ? LAM_OK : status_fail(error, LAM_ERR_MEMORY, "not enough memory to write an array");
}

static lam_status output_npy(const solution *s, FILE *stream, lam_error *error) {
    size_t shape[4], rank = 0;
    if (s->batch) shape[rank++] = s->n_vectors;
    if (s->m->n_channels > 1) shape[rank++] = s->m->n_channels;
    shape[rank++] = output_width(s);
    if (s->corners != NULL) shape[rank++] = 4;
    return output_array(stream, rank, shape, s->corners != NULL ? s->corners : s->values, s->refined, error);
}

/* A format of files: the writer of an extension. */
static const struct {
    const char *extension;
    lam_status (*write)(const solution *s, FILE *stream, lam_error *error);
    bool takes[OUTPUT_CONTENTS]; /* elements, groups, corners, faces */
} formats[] = {
    {"npy", output_npy, {true, false, true, true}},  {"json", output_json, {true, true, false, true}},
    {"csv", output_csv, {true, true, false, true}},  {"ply", output_ply, {true, false, true, false}},
    {"vtu", output_vtu, {true, false, true, false}}, {"glb", output_glb, {true, false, true, false}},
};
#define N_FORMATS (sizeof formats / sizeof *formats)

void output_formats(output_content content, char text[OUTPUT_FORMATS]) {
    size_t length = 0, left = 0;
    for (size_t k = 0; k < N_FORMATS; k++) left += formats[k].takes[content];
    for (size_t k = 0; k < N_FORMATS && length < OUTPUT_FORMATS; k++) {
        if (!formats[k].takes[content]) continue;
        left--;
        length += (size_t)snprintf(text + length, OUTPUT_FORMATS - length, ".%s%s", formats[k].extension,
                                   left > 1    ? ", "
                                   : left == 1 ? " or "
                                               : "");
    }
}

/* The format of a path; N_FORMATS: none. */
static size_t find_format(const char *path) {
    size_t k = 0;
    char extension[16];
    atomic_file_extension(path, extension);
    while (k < N_FORMATS && strcmp(formats[k].extension, extension) != 0) k++;
    return k;
}

lam_status output_check(const char *path, output_content content, lam_error *error) {
    static const char *const options[OUTPUT_CONTENTS] = {"values of elements", "--reduce", "--smooth",
                                                         "--at faces"};
    lam_status status = LAM_OK;
    const size_t format = find_format(path);
    char text[OUTPUT_FORMATS];
    output_formats(format < N_FORMATS ? content : OUTPUT_ELEMENTS, text);
    if (format == N_FORMATS) FAIL(error, LAM_ERR_ARGUMENT, "-o %s: must end in %s", path, text);
    if (!formats[format].takes[content])
        FAIL(error, LAM_ERR_ARGUMENT, "-o %s: %s goes into %s only", path, options[content], text);
done:
    return status;
}

lam_status output_write(const solution *s, const char *path, lam_error *error) {
    lam_status status = LAM_OK;
    atomic_file file = {0};
    problem why;
    const media_accept as = {.type = MEDIA_JSON};
    const size_t count = s->n_vectors * s->m->n_channels * output_width(s);
    if (s->values != NULL && !answer_check_as(s->values, count, s->faces != NULL, &as, &why))
        FAIL(error, LAM_ERR_ARGUMENT, "%.200s: %s", path, why.detail);
    TRY(atomic_file_open(path, &file, error));
    TRY(formats[find_format(path)].write(s, file.stream, error));
    TRY(atomic_file_commit(&file, error));
done:
    atomic_file_abort(&file);
    return status;
}
