#include "support/box.h"

box_cell box_cell_of(const double size[3], unsigned divisions, size_t i) {
    const size_t per_face = (size_t)divisions * divisions, face = i / per_face, within = i % per_face;
    box_cell cell = {.axis = (int)(face / 2)};
    cell.level = face % 2 == 0 ? 0 : size[cell.axis];
    const int u = (cell.axis + 1) % 3, v = (cell.axis + 2) % 3;
    const double a = (double)(within % divisions), b = (double)(within / divisions);
    cell.from[cell.axis] = cell.to[cell.axis] = cell.level;
    cell.from[u] = size[u] * a / divisions;
    cell.to[u] = size[u] * (a + 1) / divisions;
    cell.from[v] = size[v] * b / divisions;
    cell.to[v] = size[v] * (b + 1) / divisions;
    return cell;
}

/* Room for `added` more rows behind `count`, which doubles until a mesh is finished: a sanitizer copies an
 * array whenever it grows. */
static void *grow(const mesh *m, void *array, size_t count, size_t added, size_t row_bytes) {
    size_t room = 1;
    while (room < count) room *= 2;
    const bool finished = m->reflectance != NULL;
    if (!finished && array != NULL && count + added <= room) return array;
    while (room < count + added) room *= 2;
    array = realloc(array, (finished ? count + added : room) * row_bytes);
    ck_assert_ptr_nonnull(array);
    return array;
}

void mesh_add_quad(mesh *m, const double corners[4][3]) {
    const size_t v = m->n_vertices;
    m->vertices = grow(m, m->vertices, v, 4, sizeof *m->vertices);
    m->elements = grow(m, m->elements, m->n, 1, sizeof *m->elements);
    memcpy(m->vertices[v], corners, 4 * sizeof *m->vertices);
    for (uint32_t c = 0; c < 4; c++) m->elements[m->n][c] = (uint32_t)v + c;
    m->n_vertices += 4;
    m->n++;
}

void mesh_add_cell(mesh *m, const box_cell *cell, bool positive) {
    const int u = (cell->axis + 1) % 3, v = (cell->axis + 2) % 3;
    double corner[4][3];
    for (int c = 0; c < 4; c++) {
        const int k = positive ? c : 3 - c;
        memcpy(corner[c], cell->from, sizeof corner[c]);
        corner[c][u] = k == 1 || k == 2 ? cell->to[u] : cell->from[u];
        corner[c][v] = k >= 2 ? cell->to[v] : cell->from[v];
    }
    mesh_add_quad(m, (const double(*)[3])corner);
}

void mesh_finish(mesh *m, float reflectance) {
    lam_error error = {0};
    m->vertices = realloc(m->vertices, m->n_vertices * sizeof *m->vertices);
    m->elements = realloc(m->elements, m->n * sizeof *m->elements);
    ck_assert(m->vertices != NULL && m->elements != NULL);
    ck_assert_msg(mesh_measure(m, &error) == LAM_OK, "%s", error.message);
    m->n_channels = 1;
    m->reflectance = malloc(m->n * sizeof(float));
    m->emission = calloc(m->n, sizeof(float));
    m->group = calloc(m->n, sizeof(uint32_t));
    ck_assert(m->reflectance != NULL && m->emission != NULL && m->group != NULL);
    for (size_t i = 0; i < m->n; i++) m->reflectance[i] = reflectance;
    m->unit = 1;
    m->up = 'z';
}

void mesh_name_room(mesh *m) {
    m->up = 'z';
    m->n_groups = 1;
    m->group_names = calloc(1, sizeof *m->group_names + 8);
    ck_assert_ptr_nonnull(m->group_names);
    m->group_names[0] = strcpy((char *)(m->group_names + 1), "room");
}

mesh box_mesh(const double size[3], unsigned divisions, float reflectance) {
    mesh m = {0};
    for (size_t i = 0; i < 6 * (size_t)divisions * divisions; i++) {
        const box_cell cell = box_cell_of(size, divisions, i);
        mesh_add_cell(&m, &cell, cell.level == 0);
    }
    mesh_finish(&m, reflectance);
    return m;
}

/* A1 F12 of parallel rectangles at distance z (truths: formulas, first). */
static double parallel_term(double a, double b, double z) {
    const double u = sqrt(a * a + z * z), v = sqrt(b * b + z * z);
    return (b * u * atan(b / u) + a * v * atan(a / v) - .5 * z * z * log(a * a + b * b + z * z)) / (2 * M_PI);
}

/* A1 F12 of perpendicular ones (second formula), 0 ln 0 = 0. */
static double perpendicular_term(double x, double xi, double d) {
    const double c2 = x * x + xi * xi, c = sqrt(c2), s = c2 + d * d;
    const double arc = c > 0 ? d * c * atan(d / c) : 0, logarithm = s > 0 ? .25 * (c2 - d * d) * log(s) : 0;
    return (arc - logarithm) / (2 * M_PI);
}

double box_exchange(const box_cell *one, const box_cell *two) {
    double sum = 0;
    if (one->axis == two->axis) {
        if (one->level == two->level) return 0;
        const int u = (one->axis + 1) % 3, v = (one->axis + 2) % 3;
        const double x[2] = {one->from[u], one->to[u]}, y[2] = {one->from[v], one->to[v]};
        const double p[2] = {two->from[u], two->to[u]}, q[2] = {two->from[v], two->to[v]};
        for (int i = 0; i < 2; i++)
            for (int j = 0; j < 2; j++)
                for (int k = 0; k < 2; k++)
                    for (int l = 0; l < 2; l++)
                        sum += ((i + j + k + l) % 2 ? -1 : 1) *
                               parallel_term(x[i] - p[k], y[j] - q[l], fabs(one->level - two->level));
        return sum;
    }
    /* x: distance of one from two's plane; xi: of two from one's plane; d along the common line. */
    const int along = 3 - one->axis - two->axis;
    const double x[2] = {fabs(one->from[two->axis] - two->level), fabs(one->to[two->axis] - two->level)};
    const double h[2] = {fabs(two->from[one->axis] - one->level), fabs(two->to[one->axis] - one->level)};
    const double y[2] = {one->from[along], one->to[along]}, q[2] = {two->from[along], two->to[along]};
    for (int i = 0; i < 2; i++)
        for (int j = 0; j < 2; j++)
            for (int k = 0; k < 2; k++)
                for (int l = 0; l < 2; l++)
                    sum += ((i + j + k + l) % 2 ? -1 : 1) * perpendicular_term(x[i], h[k], y[j] - q[l]);
    return fabs(sum);
}

csr box_form_factors(const double size[3], unsigned divisions, const double *area) {
    const size_t n = 6 * (size_t)divisions * divisions;
    csr F = {.n = n,
             .indptr = calloc(n + 1, sizeof(uint64_t)),
             .indices = malloc(n * n * sizeof(uint32_t)),
             .data = malloc(n * n * sizeof(float))};
    ck_assert(F.indptr != NULL && F.indices != NULL && F.data != NULL);
    uint64_t used = 0;
    for (size_t i = 0; i < n; i++) {
        const box_cell one = box_cell_of(size, divisions, i);
        for (size_t j = 0; j < n; j++) {
            const box_cell two = box_cell_of(size, divisions, j);
            const double exchange = i < j ? box_exchange(&one, &two) : box_exchange(&two, &one);
            if (!(exchange > 0)) continue;
            F.indices[used] = (uint32_t)j;
            F.data[used++] = (float)(exchange / area[i]);
        }
        F.indptr[i + 1] = used;
    }
    return F;
}

double csr_entry(const csr *F, size_t i, size_t j) {
    for (uint64_t p = F->indptr[i]; p < F->indptr[i + 1]; p++)
        if (F->indices[p] == j) return (double)F->data[p];
    return 0;
}
