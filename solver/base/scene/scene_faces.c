#include "solver/base/scene/scene_faces.h"

#include "store/groups.h"
#include "store/status.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

void scene_faces_free(scene_faces *f) {
    free(f->of);
    free(f->parts);
    *f = (scene_faces){.n_faces = 0};
}

void scene_faces_sum(const scene_faces *f, size_t n_fronts, const double *area, double *areas) {
    memset(areas, 0, f->n_faces * sizeof *areas);
    for (size_t i = 0; i < n_fronts; i++)
        if (f->of[i] != SCENE_FACE_NONE) areas[f->of[i]] += area[i];
    for (size_t p = 0; p < f->n_parts; p++) areas[f->parts[p].face] += f->parts[p].area;
}

static lam_status save_parts(const scene_faces *f, store *s, lam_error *error) {
    lam_status status = LAM_OK;
    const size_t of_pairs[2] = {f->n_parts, 2};
    uint32_t(*pair)[2] = memory_allocate(f->n_parts, sizeof *pair, "parts of faces", error);
    double *area = memory_allocate(f->n_parts, sizeof *area, "parts of faces", error);
    if (pair == NULL || area == NULL) TRY(LAM_ERR_MEMORY);
    for (size_t p = 0; p < f->n_parts; p++) {
        pair[p][0] = f->parts[p].element;
        pair[p][1] = f->parts[p].face;
        area[p] = f->parts[p].area;
    }
    TRY(store_write(s, STORE_MESH "/face_part", STORE_U32, 2, of_pairs, pair, error));
    TRY(store_write(s, STORE_MESH "/face_part_area", STORE_F64, 1, &f->n_parts, area, error));
done:
    free(pair);
    free(area);
    return status;
}

lam_status scene_faces_save(const scene_faces *f, size_t n, size_t n_fronts, const double *area, store *s,
                            lam_error *error) {
    lam_status status = LAM_OK;
    double *areas = NULL;
    if (f->of == NULL) return LAM_OK;
    areas = memory_allocate(f->n_faces, sizeof *areas, "areas of faces", error);
    if (areas == NULL) TRY(LAM_ERR_MEMORY);
    scene_faces_sum(f, n_fronts, area, areas);
    TRY(store_write(s, STORE_MESH "/face", STORE_U32, 1, &n, f->of, error));
    TRY(store_write(s, STORE_MESH "/face_area", STORE_F64, 1, &f->n_faces, areas, error));
    if (f->n_parts > 0) TRY(save_parts(f, s, error));
done:
    free(areas);
    return status;
}

/* Checks a part and that it stands behind the one before. */
static lam_status check_part(store *s, const scene_faces *f, size_t n_fronts, size_t p, lam_error *error) {
    lam_status status = LAM_OK;
    const scene_face_part *part = &f->parts[p], *before = part - (p > 0);
    if (part->element >= n_fronts || f->of[part->element] != SCENE_FACE_NONE)
        FAIL(error, LAM_ERR_FORMAT,
             "%s: /mesh/face_part[%zu][0] = %u, must be a front whose /mesh/face is 0xFFFFFFFF",
             store_path(s), p, part->element);
    if (part->face >= f->n_faces)
        FAIL(error, LAM_ERR_FORMAT, "%s: /mesh/face_part[%zu][1] = %u, there are %zu faces", store_path(s), p,
             part->face, f->n_faces);
    if (p > 0 &&
        (part->element < before->element || (part->element == before->element && part->face <= before->face)))
        FAIL(error, LAM_ERR_FORMAT, "%s: /mesh/face_part[%zu] = %u, %u, must ascend", store_path(s), p,
             part->element, part->face);
    if (!(part->area > 0) || !isfinite(part->area))
        FAIL(error, LAM_ERR_FORMAT, "%s: /mesh/face_part_area[%zu] = %g, must be above 0 and finite",
             store_path(s), p, part->area);
done:
    return status;
}

static lam_status load_parts(store *s, size_t n_fronts, scene_faces *f, lam_error *error) {
    lam_status status = LAM_OK;
    void *pairs = NULL, *areas = NULL;
    size_t dims[2] = {SIZE_MAX, 2};
    if (!store_has(s, STORE_MESH "/face_part")) return LAM_OK;
    TRY(store_read(s, STORE_MESH "/face_part", STORE_U32, 2, dims, &pairs, error));
    TRY(store_read(s, STORE_MESH "/face_part_area", STORE_F64, 1, dims, &areas, error));
    f->parts = memory_allocate(dims[0], sizeof *f->parts, "parts of faces", error);
    if (f->parts == NULL) TRY(LAM_ERR_MEMORY);
    const uint32_t(*pair)[2] = pairs;
    const double *area = areas;
    for (size_t p = 0; p < dims[0]; p++) {
        f->parts[p] = (scene_face_part){pair[p][0], pair[p][1], area[p]};
        TRY(check_part(s, f, n_fronts, p, error));
    }
    f->n_parts = dims[0];
done:
    free(pairs);
    free(areas);
    return status;
}

lam_status scene_faces_count(store *s, size_t *n_faces, lam_error *error) {
    lam_status status = LAM_OK;
    size_t dims[STORE_MAX_RANK];
    store_type type;
    int rank;
    *n_faces = 0;
    if (!store_has(s, STORE_MESH "/face")) return LAM_OK;
    TRY(store_array_info(s, STORE_MESH "/face_area", &type, &rank, dims, error));
    if (rank != 1 || type != STORE_F64 || dims[0] == 0 || dims[0] >= SCENE_FACE_NONE)
        FAIL(error, LAM_ERR_FORMAT, "%s: /mesh/face_area must be [faces] of f64, 1 to 2^32 - 2 faces",
             store_path(s));
    *n_faces = dims[0];
done:
    return status;
}

lam_status scene_faces_load(store *s, size_t n, size_t n_fronts, scene_faces *out, lam_error *error) {
    lam_status status = LAM_OK;
    scene_faces f = {.n_faces = 0};
    void *data = NULL;
    *out = f;
    TRY(scene_faces_count(s, &f.n_faces, error));
    if (f.n_faces == 0) goto done;
    TRY(store_read(s, STORE_MESH "/face", STORE_U32, 1, &n, &data, error));
    f.of = data;
    for (size_t i = 0; i < n; i++)
        if (f.of[i] >= f.n_faces && f.of[i] != SCENE_FACE_NONE)
            FAIL(error, LAM_ERR_FORMAT, "%s: /mesh/face[%zu] = %u, there are %zu faces", store_path(s), i,
                 f.of[i], f.n_faces);
    TRY(load_parts(s, n_fronts, &f, error));
    *out = f;
    f = (scene_faces){.n_faces = 0};
done:
    scene_faces_free(&f);
    return status;
}
