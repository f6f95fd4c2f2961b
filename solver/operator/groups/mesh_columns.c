#include "solver/operator/groups/mesh_columns.h"

#include "solver/base/vector3.h"
#include "store/groups.h"

#include <math.h>
#include <stdlib.h>

#define NO_VERTEX UINT32_MAX

lam_status areas_view(store *s, size_t n, store_view *out, lam_error *error) {
    lam_status status = LAM_OK;
    store_view read = {.data = NULL};
    TRY(store_read_view(s, STORE_MESH "/area", STORE_F64, 1, (size_t[]){n}, &read, error));
    const double *area = read.data;
    for (size_t i = 0; i < n; i++)
        if (!(area[i] >= 0 && isfinite(area[i]))) {
            /* A block that is not as it was written is the cause, where there is one. */
            TRY(store_verify_group(s, STORE_MESH, error));
            FAIL(error, LAM_ERR_FORMAT, "%s: /mesh/area[%zu] = %g, must be at least 0", store_path(s), i,
                 area[i]);
        }
    *out = read;
    read = (store_view){.data = NULL};
done:
    store_view_free(&read);
    return status;
}

static double triangle_area(const double *a, const double *b, const double *c) {
    double ab[3], ac[3], normal[3];
    subtract3(b, a, ab);
    subtract3(c, a, ac);
    cross3(ab, ac, normal);
    return sqrt(dot3(normal, normal)) / 2;
}

/* The centroid a + (b - a + c - a) / 3 of a triangle, or that of two of these by their areas: the one that
 * `lambert` computes with (solver/scene/mesh.c). */
static void find_centre(const double (*vertices)[3], const uint32_t corners[4], float centre[3]) {
    const double *a = vertices[corners[0]], *b = vertices[corners[1]], *c = vertices[corners[2]];
    const double *d = corners[3] != NO_VERTEX ? vertices[corners[3]] : c;
    const double area_abc = triangle_area(a, b, c), area_acd = triangle_area(a, c, d);
    const double share = area_abc + area_acd > 0 ? area_acd / (area_abc + area_acd) : 0;
    for (int k = 0; k < 3; k++)
        centre[k] = (float)(a[k] + ((c[k] - a[k]) + (1 - share) * (b[k] - a[k]) + share * (d[k] - a[k])) / 3);
}

lam_status centres_load(store *s, size_t n, float **out, lam_error *error) {
    lam_status status = LAM_OK;
    void *vertices = NULL, *elements = NULL;
    float *made = NULL;
    size_t v[2] = {SIZE_MAX, 3};
    TRY(store_read(s, STORE_MESH "/vertices", STORE_F64, 2, v, &vertices, error));
    TRY(store_read(s, STORE_MESH "/elements", STORE_U32, 2, (size_t[]){n, 4}, &elements, error));
    const uint32_t(*corners)[4] = elements;
    for (size_t i = 0; i < n; i++)
        for (int k = 0; k < 4; k++)
            if (corners[i][k] >= v[0] && !(k == 3 && corners[i][k] == NO_VERTEX))
                FAIL(error, LAM_ERR_FORMAT, "%s: /mesh/elements[%zu][%d] = %u, there are %zu vertices",
                     store_path(s), i, k, corners[i][k], v[0]);
    made = memory_allocate(n, 3 * sizeof *made, "centres of elements", error);
    if (made == NULL) TRY(LAM_ERR_MEMORY);
    for (size_t i = 0; i < n; i++) find_centre(vertices, corners[i], made + 3 * i);
    *out = made;
done:
    free(vertices);
    free(elements);
    return status;
}
