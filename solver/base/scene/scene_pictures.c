#include "solver/base/scene/scene_pictures.h"

#include "store/groups.h"
#include "store/status.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

void scene_pictures_free(scene_pictures *p) {
    free(p->surface);
    free(p->texcoord);
    free(p->surfaces);
    free(p->start);
    free(p->bytes);
    *p = (scene_pictures){0};
}

lam_status scene_pictures_save(const scene_pictures *p, size_t n, store *s, lam_error *error) {
    lam_status status = LAM_OK;
    uint32_t(*place)[3] = NULL;
    float(*factor)[3] = NULL;
    if (p == NULL) return LAM_OK;
    const size_t of_coordinates[3] = {n, 4, 2}, of_surfaces[2] = {p->n_surfaces, 3},
                 n_starts = p->n_files + 1, n_bytes = p->start[p->n_files];
    place = memory_allocate(p->n_surfaces, sizeof *place, "textures", error);
    factor = memory_allocate(p->n_surfaces, sizeof *factor, "textures", error);
    if (place == NULL || factor == NULL) TRY(LAM_ERR_MEMORY);
    for (size_t k = 0; k < p->n_surfaces; k++) {
        place[k][0] = p->surfaces[k].file;
        memcpy(&place[k][1], p->surfaces[k].wrap, sizeof p->surfaces[k].wrap);
        memcpy(factor[k], p->surfaces[k].factor, sizeof factor[k]);
    }
    TRY(store_write(s, STORE_MESH "/surface", STORE_U32, 1, &n, p->surface, error));
    TRY(store_write(s, STORE_MESH "/texcoord", STORE_F32, 3, of_coordinates, p->texcoord, error));
    TRY(store_write(s, STORE_MESH "/surface_image", STORE_U32, 2, of_surfaces, place, error));
    TRY(store_write(s, STORE_MESH "/surface_factor", STORE_F32, 2, of_surfaces, factor, error));
    TRY(store_write(s, STORE_MESH "/image_start", STORE_U64, 1, &n_starts, p->start, error));
    TRY(store_write(s, STORE_MESH "/images", STORE_I8, 1, &n_bytes, p->bytes, error));
done:
    free(place);
    free(factor);
    return status;
}

/* The files of images, whose starts must ascend from 0 to their bytes. */
static lam_status load_files(store *s, scene_pictures *p, lam_error *error) {
    lam_status status = LAM_OK;
    void *data = NULL;
    size_t n_starts = SIZE_MAX, n_bytes = SIZE_MAX;
    TRY(store_read(s, STORE_MESH "/image_start", STORE_U64, 1, &n_starts, &data, error));
    p->start = data;
    TRY(store_read(s, STORE_MESH "/images", STORE_I8, 1, &n_bytes, &data, error));
    p->bytes = data;
    for (size_t k = 0; k < n_starts; k++)
        if (k == 0 ? p->start[k] != 0 : p->start[k] < p->start[k - 1])
            FAIL(error, LAM_ERR_FORMAT, "%s: /mesh/image_start[%zu] = %llu, must ascend from 0",
                 store_path(s), k, (unsigned long long)p->start[k]);
    if (n_starts < 2 || p->start[n_starts - 1] != n_bytes)
        FAIL(error, LAM_ERR_FORMAT, "%s: /mesh/image_start must end with the %zu bytes of /mesh/images",
             store_path(s), n_bytes);
    p->n_files = n_starts - 1;
done:
    return status;
}

static lam_status load_surfaces(store *s, scene_pictures *p, lam_error *error) {
    lam_status status = LAM_OK;
    void *places = NULL, *factors = NULL;
    size_t dims[2] = {SIZE_MAX, 3};
    TRY(store_read(s, STORE_MESH "/surface_image", STORE_U32, 2, dims, &places, error));
    TRY(store_read(s, STORE_MESH "/surface_factor", STORE_F32, 2, dims, &factors, error));
    p->surfaces = memory_allocate(dims[0], sizeof *p->surfaces, "textures", error);
    if (p->surfaces == NULL) TRY(LAM_ERR_MEMORY);
    p->n_surfaces = dims[0];
    const uint32_t(*place)[3] = places;
    const float(*factor)[3] = factors;
    for (size_t k = 0; k < dims[0]; k++) {
        if (place[k][0] >= p->n_files || place[k][1] > PICTURE_WRAP_MOST || place[k][2] > PICTURE_WRAP_MOST)
            FAIL(error, LAM_ERR_FORMAT, "%s: /mesh/surface_image[%zu] = %u, %u, %u, there are %zu images",
                 store_path(s), k, place[k][0], place[k][1], place[k][2], p->n_files);
        for (int c = 0; c < 3; c++)
            if (!(factor[k][c] >= 0) || !(factor[k][c] <= 1))
                FAIL(error, LAM_ERR_FORMAT, "%s: /mesh/surface_factor[%zu][%d] = %g, must be 0 to 1",
                     store_path(s), k, c, (double)factor[k][c]);
        p->surfaces[k] = (struct picture_surface){.file = place[k][0], .wrap = {place[k][1], place[k][2]}};
        memcpy(p->surfaces[k].factor, factor[k], sizeof factor[k]);
    }
done:
    free(places);
    free(factors);
    return status;
}

lam_status scene_pictures_load(store *s, size_t n, scene_pictures **out, lam_error *error) {
    lam_status status = LAM_OK;
    scene_pictures p = {0};
    void *data = NULL;
    size_t of_coordinates[3] = {n, 4, 2};
    *out = NULL;
    if (!store_has(s, STORE_MESH "/surface")) return LAM_OK;
    TRY(store_read(s, STORE_MESH "/surface", STORE_U32, 1, &n, &data, error));
    p.surface = data;
    TRY(store_read(s, STORE_MESH "/texcoord", STORE_F32, 3, of_coordinates, &data, error));
    p.texcoord = data;
    TRY(load_files(s, &p, error));
    TRY(load_surfaces(s, &p, error));
    for (size_t i = 0; i < n; i++) {
        if (p.surface[i] >= p.n_surfaces && p.surface[i] != PICTURE_NONE)
            FAIL(error, LAM_ERR_FORMAT, "%s: /mesh/surface[%zu] = %u, there are %zu surfaces", store_path(s),
                 i, p.surface[i], p.n_surfaces);
        for (int k = 0; k < 8; k++)
            if (!isfinite(p.texcoord[i][k / 2][k % 2]))
                FAIL(error, LAM_ERR_FORMAT, "%s: /mesh/texcoord[%zu][%d][%d] = %g, must be finite",
                     store_path(s), i, k / 2, k % 2, (double)p.texcoord[i][k / 2][k % 2]);
    }
    *out = memory_allocate(1, sizeof **out, "textures", error);
    if (*out == NULL) TRY(LAM_ERR_MEMORY);
    **out = p;
    p = (scene_pictures){0};
done:
    scene_pictures_free(&p);
    return status;
}
