/* Subdivision: every face into a grid of cells, or m^2 triangles, with vertices shared across faces. */
#include "solver/scene/face_grid.h"
#include "solver/scene/glass.h"
#include "solver/scene/mesh_cells.h"
#include "solver/scene/mesh_refined.h"
#include "solver/scene/texture.h"

#include <assert.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

/* The division of one face: a quad into a x b cells (a along its first edge), a triangle into a^2. */
typedef struct face_cut {
    uint32_t a, b;
} face_cut;

typedef struct face {
    size_t n; /* corners: 3 or 4 */
    double p[4][3];
} face;

static face face_of(const mesh *m, size_t i) {
    face f = {.n = mesh_corners(m, i)};
    for (size_t k = 0; k < f.n; k++) memcpy(f.p[k], m->vertices[m->elements[i][k]], sizeof f.p[k]);
    return f;
}

static size_t cut_pieces(const mesh *m, size_t i, face_cut cut) {
    return mesh_corners(m, i) == 3 ? (size_t)cut.a * cut.a : (size_t)cut.a * cut.b;
}

/* More steps than this along an edge are taken for a wrong unit. */
static const double most_steps = 32768;

static lam_status cuts_by_edge(const mesh *m, double max_edge, face_cut *cuts, lam_error *error) {
    lam_status status = LAM_OK;
    if (!(max_edge > 0) || !isfinite(max_edge))
        FAIL(error, LAM_ERR_ARGUMENT, "max edge = %g m, must be positive", max_edge);
    for (size_t i = 0; i < m->n; i++) {
        const face f = face_of(m, i);
        double along = 0,
               across = 0; /* the longer one of each pair of opposite edges; both: all three edges */
        for (size_t k = 0; k < f.n; k++) {
            const double length = point_distance(f.p[k], f.p[(k + 1) % f.n]);
            if (f.n == 3 || k % 2 == 0) along = fmax(along, length);
            if (f.n == 3 || k % 2 == 1) across = fmax(across, length);
        }
        /* with a tolerance for rounding: 3 m by .1 m is 30 steps, not 31 */
        const double a = fmax(ceil(along / max_edge - 1e-9), 1), b = fmax(ceil(across / max_edge - 1e-9), 1);
        if (a > most_steps || b > most_steps)
            FAIL(error, LAM_ERR_ARGUMENT,
                 "max edge = %g m would cut element %zu into %.0f x %.0f; at most %.0f", max_edge, i, a, b,
                 most_steps);
        cuts[i] = (face_cut){(uint32_t)a, (uint32_t)b};
    }
done:
    return status;
}

/* Near-square cells of about target m^2: of the two integers around the ideal number in each direction, those
 * whose cell area is nearest; the number of a triangle's cells is a square. */
static face_cut cut_by_area(const mesh *m, size_t i, double target) {
    const face f = face_of(m, i);
    const double pieces = fmin(fmax(m->area[i] / target, 1), most_steps * most_steps);
    if (f.n == 3) {
        double a = floor(sqrt(pieces));
        /* by ratios: half as large is as far off as twice as large */
        if (pieces / (a * a) > (a + 1) * (a + 1) / pieces) a++;
        return (face_cut){(uint32_t)a, 1};
    }
    const double along = point_distance(f.p[0], f.p[1]) + point_distance(f.p[3], f.p[2]);
    const double across = point_distance(f.p[0], f.p[3]) + point_distance(f.p[1], f.p[2]);
    const double ideal = sqrt(pieces * along / fmax(across, 1e-300));
    face_cut best = {1, 1};
    double best_cost = HUGE_VAL;
    for (int up = 0; up < 2; up++) {
        const double a = fmin(fmax(floor(ideal) + up, 1), fmin(most_steps, ceil(pieces)));
        const double b = fmin(fmax(round(pieces / a), 1), most_steps);
        /* both are logarithms of ratios: of the cells' area to the target, and of their sides */
        const double cost = 2 * fabs(log(a * b / pieces)) + .5 * fabs(log(a * across / (b * along)));
        if (cost < best_cost) best_cost = cost, best = (face_cut){(uint32_t)a, (uint32_t)b};
    }
    return best;
}

static double count_by_area(const mesh *m, double target) {
    double total = 0;
    for (size_t i = 0; i < m->n; i++) total += (double)cut_pieces(m, i, cut_by_area(m, i, target));
    return total;
}

/* The target area whose cuts give the number nearest to wanted. */
static lam_status cuts_by_count(const mesh *m, size_t wanted, face_cut *cuts, lam_error *error) {
    lam_status status = LAM_OK;
    double area = 0;
    if (wanted >= MESH_NO_VERTEX)
        FAIL(error, LAM_ERR_ARGUMENT, "elements = %zu, must be below 2^32 - 1", wanted);
    for (size_t i = 0; i < m->n; i++) area += m->area[i];
    /* The count falls, but for rounding, as the target grows: bisection, then the neighbourhood. */
    double low = area / (double)wanted / 64, high = area / (double)wanted * 64, best = high, off = HUGE_VAL;
    for (int step = 0; step < 60 && off > 0; step++) {
        const double middle = sqrt(low * high), count = count_by_area(m, middle);
        const double distance = fabs(count - (double)wanted);
        if (distance < off) off = distance, best = middle;
        if (count > (double)wanted)
            low = middle;
        else
            high = middle;
    }
    const double around = best;
    for (int step = -40; step <= 40 && off > 0 && m->n < 100000; step++) {
        const double target = around * (1 + .002 * step);
        const double distance = fabs(count_by_area(m, target) - (double)wanted);
        if (distance < off) off = distance, best = target;
    }
    for (size_t i = 0; i < m->n; i++) cuts[i] = wanted <= m->n ? (face_cut){1, 1} : cut_by_area(m, i, best);
done:
    return status;
}

static lam_status plan_cuts(const mesh *m, const mesh_refinement *how, face_cut *cuts, lam_error *error) {
    lam_status status = LAM_OK;
    if ((how->subdivide_levels > 0) + (how->max_edge != 0) + (how->elements > 0) > 1)
        FAIL(error, LAM_ERR_ARGUMENT, "give one of subdivide, max edge and elements");
    if (how->subdivide_levels > 15)
        FAIL(error, LAM_ERR_ARGUMENT, "subdivide = %u levels, at most 15", how->subdivide_levels);
    const uint32_t steps =
        1u << how->subdivide_levels; /* halving that often is cutting into 2^levels steps */
    for (size_t i = 0; i < m->n; i++) cuts[i] = (face_cut){steps, steps};
    if (how->max_edge != 0) TRY(cuts_by_edge(m, how->max_edge, cuts, error));
    if (how->elements > 0) TRY(cuts_by_count(m, how->elements, cuts, error));
done:
    return status;
}

lam_status refined_mesh_begin(const mesh *m, size_t n, refined_mesh *out, lam_error *error) {
    lam_status status = LAM_OK;
    refined_mesh r = {.n = n};
    if (m->n_backs > 0) FAIL(error, LAM_ERR_ARGUMENT, "mesh: refine before making it two-sided");
    if (n >= MESH_NO_VERTEX)
        FAIL(error, LAM_ERR_ARGUMENT, "mesh: this would make more than %u elements", MESH_NO_VERTEX - 1);
    r.elements = memory_allocate(n, sizeof *r.elements, "refined mesh", error);
    r.face = memory_allocate(n, sizeof *r.face, "refined mesh", error);
    if (r.elements == NULL || r.face == NULL) TRY(LAM_ERR_MEMORY);
    *out = r;
    r = (refined_mesh){.n = 0};
done:
    refined_mesh_free(&r);
    return status;
}

void refined_mesh_free(refined_mesh *r) {
    free(r->elements);
    free(r->face);
    point_table_free(&r->points);
    *r = (refined_mesh){.n = 0};
}

lam_status refined_mesh_add(refined_mesh *r, size_t i, size_t corners, const double (*p)[3],
                            lam_error *error) {
    lam_status status = LAM_OK;
    r->elements[i][3] = MESH_NO_VERTEX;
    for (size_t k = 0; k < corners; k++) TRY(point_table_add(&r->points, p[k], &r->elements[i][k], error));
done:
    return status;
}

lam_status refined_mesh_end(refined_mesh *r, const mesh *m, mesh *out, lam_error *error) {
    lam_status status = LAM_OK;
    const size_t n = r->n, channels = m->n_channels;
    mesh fine = {.n = n, .n_channels = channels, .unit = m->unit, .rounding = m->rounding, .up = m->up};
    fine.group = memory_allocate(n, sizeof *fine.group, "refined mesh", error);
    fine.reflectance = memory_allocate(n * channels, sizeof *fine.reflectance, "refined mesh", error);
    fine.emission = memory_allocate(n * channels, sizeof *fine.emission, "refined mesh", error);
    if (fine.group == NULL || fine.reflectance == NULL || fine.emission == NULL) TRY(LAM_ERR_MEMORY);
    for (size_t i = 0; i < n; i++) {
        fine.group[i] = m->group[r->face[i]];
        for (size_t c = 0; c < channels; c++) {
            fine.reflectance[c * n + i] = m->reflectance[c * m->n + r->face[i]];
            fine.emission[c * n + i] = m->emission[c * m->n + r->face[i]];
        }
    }
    if (m->textures != NULL) {
        fine.textured_face = memory_allocate(n, sizeof *fine.textured_face, "refined mesh", error);
        if (fine.textured_face == NULL) TRY(LAM_ERR_MEMORY);
        for (size_t i = 0; i < n; i++) fine.textured_face[i] = m->textured_face[r->face[i]];
        mesh_textures_hold(&fine, m->textures);
    }
    if (m->faces.of != NULL) {
        assert(m->faces.n_parts == 0);
        fine.faces = (scene_faces){.n_faces = m->faces.n_faces};
        fine.faces.of = memory_allocate(n, sizeof *fine.faces.of, "refined mesh", error);
        if (fine.faces.of == NULL) TRY(LAM_ERR_MEMORY);
        for (size_t i = 0; i < n; i++) fine.faces.of[i] = m->faces.of[r->face[i]];
    }
    if (m->has_back != NULL) {
        fine.has_back = memory_allocate(n, sizeof *fine.has_back, "refined mesh", error);
        if (fine.has_back == NULL) TRY(LAM_ERR_MEMORY);
        for (size_t i = 0; i < n; i++) fine.has_back[i] = m->has_back[r->face[i]];
    }
    TRY(mesh_copy_glass(m, &fine, error));
    fine.elements = r->elements;
    fine.vertices = r->points.points;
    fine.n_vertices = r->points.n;
    r->elements = NULL;
    r->points.points = NULL;
    TRY(mesh_measure(&fine, error));
    TRY(mesh_textures_apply(&fine, error));
    memcpy(fine.name, m->name, sizeof fine.name);
    memcpy(fine.source_hash, m->source_hash, sizeof fine.source_hash);
    *out = fine;
    fine = (mesh){0};
done:
    mesh_free(&fine);
    return status;
}

void mesh_replace(mesh *m, mesh *by) {
    by->n_groups = m->n_groups;
    by->group_names = m->group_names;
    m->group_names = NULL;
    by->overlap = m->overlap;
    m->overlap = NULL;
    free(by->glass);
    by->n_glass = m->n_glass;
    by->glass = m->glass;
    by->glass_by_angle = m->glass_by_angle;
    by->glass_given = m->glass_given;
    m->glass = NULL;
    by->lights = m->lights;
    by->n_cameras = m->n_cameras;
    by->cameras = m->cameras;
    m->cameras = NULL;
    by->n_punctual = m->n_punctual;
    by->punctual = m->punctual;
    m->punctual = NULL;
    mesh_free(m);
    *m = *by;
    *by = (mesh){0};
}

static lam_status cut_quad(const face *f, face_cut cut, refined_mesh *fine, size_t at, lam_error *error) {
    lam_status status = LAM_OK;
    for (uint32_t j = 0; j < cut.b; j++)
        for (uint32_t i = 0; i < cut.a; i++) {
            double p[4][3];
            for (int k = 0; k < 4; k++)
                grid_point(f->p, i + (k == 1 || k == 2), cut.a, j + (k >= 2), cut.b, p[k]);
            TRY(refined_mesh_add(fine, at++, 4, (const double(*)[3])p, error));
        }
done:
    return status;
}

static lam_status cut_triangle(const face *f, uint32_t m, refined_mesh *fine, size_t at, lam_error *error) {
    lam_status status = LAM_OK;
    for (uint32_t j = 0; j < m; j++)
        for (uint32_t i = 0; i + j < m; i++) {
            /* the triangle that stands as its parent does, then the one turned over to its right */
            const uint32_t steps[2][3][2] = {{{i, j}, {i + 1, j}, {i, j + 1}},
                                             {{i + 1, j}, {i + 1, j + 1}, {i, j + 1}}};
            for (int t = 0; t < (i + j + 1 < m ? 2 : 1); t++) {
                double p[3][3];
                for (int k = 0; k < 3; k++) triangle_point(f->p, steps[t][k][0], steps[t][k][1], m, p[k]);
                TRY(refined_mesh_add(fine, at++, 3, (const double(*)[3])p, error));
            }
        }
done:
    return status;
}

static lam_status cut_faces(const mesh *m, const face_cut *cuts, refined_mesh *fine, lam_error *error) {
    lam_status status = LAM_OK;
    size_t at = 0;
    for (size_t i = 0; i < m->n; i++) {
        const face f = face_of(m, i);
        const size_t pieces = cut_pieces(m, i, cuts[i]);
        TRY(f.n == 4 ? cut_quad(&f, cuts[i], fine, at, error) : cut_triangle(&f, cuts[i].a, fine, at, error));
        for (size_t p = 0; p < pieces; p++) fine->face[at++] = (uint32_t)i;
    }
done:
    return status;
}

static lam_status plan_division(const mesh *m, const mesh_refinement *how, face_cut **cuts, size_t *n,
                                lam_error *error) {
    lam_status status = LAM_OK;
    *n = 0;
    *cuts = memory_allocate(m->n, sizeof **cuts, "refined mesh", error);
    if (*cuts == NULL) return LAM_ERR_MEMORY;
    TRY(plan_cuts(m, how, *cuts, error));
    for (size_t i = 0; i < m->n && *n < MESH_NO_VERTEX; i++) *n += cut_pieces(m, i, (*cuts)[i]);
done:
    return status;
}

static lam_status divide(const mesh *m, const face_cut *cuts, size_t n, mesh *out, uint32_t **parent,
                         lam_error *error) {
    lam_status status = LAM_OK;
    refined_mesh fine = {.n = 0};
    uint32_t *of = NULL;
    TRY(refined_mesh_begin(m, n, &fine, error));
    if (parent != NULL) {
        of = memory_allocate(n, sizeof *of, "refined mesh", error);
        if (of == NULL) TRY(LAM_ERR_MEMORY);
    }
    TRY(cut_faces(m, cuts, &fine, error));
    if (parent != NULL) memcpy(of, fine.face, n * sizeof *of);
    TRY(refined_mesh_end(&fine, m, out, error));
    if (parent != NULL) *parent = of;
    of = NULL;
done:
    free(of);
    refined_mesh_free(&fine);
    return status;
}

lam_status mesh_refine_into(const mesh *m, const mesh_refinement *how, mesh *out, uint32_t **parent,
                            lam_error *error) {
    lam_status status = LAM_OK;
    face_cut *cuts = NULL;
    size_t n;
    TRY(plan_division(m, how, &cuts, &n, error));
    TRY(divide(m, cuts, n, out, parent, error));
done:
    free(cuts);
    return status;
}

lam_status mesh_refine(mesh *m, const mesh_refinement *how, lam_error *error) {
    lam_status status = LAM_OK;
    mesh made = {0};
    face_cut *cuts = NULL;
    size_t n;
    if (m->n_backs > 0) FAIL(error, LAM_ERR_ARGUMENT, "mesh: refine before making it two-sided");
    TRY(plan_division(m, how, &cuts, &n, error));
    if (n == m->n) goto done; /* nothing to cut */
    TRY(divide(m, cuts, n, &made, NULL, error));
    mesh_replace(m, &made);
done:
    free(cuts);
    mesh_free(&made);
    return status;
}
