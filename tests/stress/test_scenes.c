/* Scenes that break form factors elsewhere, through every recipe: the invariants hold whatever is modelled.
 */
#include "solver/formfactor/formfactor.h"
#include "solver/formfactor/source.h"
#include "support/box.h"
#include "support/plates.h"
#include "support/suite.h"

static const recipe recipes[] = {
    {.source = &source_rays, .rays = 1024, .seed = 3},
    {.source = &source_hemicube, .resolution = 32},
    {.source = &source_pairs, .rays = 256, .accuracy = 7e-4, .seed = 3},
    {.source = &source_near_pairs, .rays = 1024, .accuracy = 7e-4, .seed = 3},
};
enum { N_RECIPES = sizeof recipes / sizeof *recipes };

/* Where a scene stands and how large it is. */
static const double places[][2] = {{1, 0}, {1e-3, 0}, {1e5, 0}, {1, 1e6}, {1e3, -1e6}};
enum { N_PLACES = sizeof places / sizeof *places };

static form_factors make(const mesh *m, const recipe *r) {
    uint32_t *order = malloc(m->n * sizeof *order);
    form_factors f = {0};
    lam_error error = {0};
    const form_factor_options how = {.recipe = *r};
    ck_assert_ptr_nonnull(order);
    ck_assert_msg(mesh_z_order(m, order, &error) == LAM_OK, "%s", error.message);
    ck_assert_msg(form_factors_make(m, order, &how, &f, &error) == LAM_OK, "%s", error.message);
    free(order);
    return f;
}

/* F_ii = 0, 0 <= F <= 1, reciprocity to 1e-6, rows sum to at most 1. A row of single precision numbers sums
 * to within 6e-8 of itself. */
static void check_invariants(const mesh *m, const form_factors *f) {
    const csr *F = &f->F;
    for (size_t i = 0; i < m->n; i++) {
        double sum = 0;
        for (uint64_t p = F->indptr[i]; p < F->indptr[i + 1]; p++) {
            const double here = (double)F->data[p];
            const size_t j = F->indices[p];
            const double there = m->area[j] * csr_entry(F, j, i) / m->area[i];
            ck_assert_uint_ne(i, j);
            ck_assert(here > 0 && here <= 1);
            ck_assert_double_eq_tol(here, there, 1e-6 * here);
            sum += here;
        }
        ck_assert_double_le(sum, 1 + 1e-6);
        ck_assert_double_eq_tol(sum, f->row_sums[i], 1e-6);
    }
    ck_assert_double_le(f->reciprocity_error, 1e-6);
}

/* In a closed scene what leaves a row is nothing: least is a row that sees anything at all. */
static void check_closed(const mesh *m, const form_factors *f, double tolerance) {
    ck_assert(f->closed);
    for (size_t i = 0; i < m->n; i++)
        if (f->row_sums[i] > 0) ck_assert_double_eq_tol(f->row_sums[i], 1, tolerance);
}

typedef mesh scene(void);

/* Every recipe, every place. */
static void run(scene *of, bool closed) {
    for (size_t p = 0; p < N_PLACES; p++) {
        mesh m = of();
        plates_move(&m, places[p][0], places[p][1]);
        for (size_t r = 0; r < N_RECIPES; r++) {
            form_factors f = make(&m, &recipes[r]);
            check_invariants(&m, &f);
            if (closed) check_closed(&m, &f, 1e-5);
            form_factors_free(&f);
        }
        mesh_free(&m);
    }
}

static void add_box(mesh *m, const double low[3], const double high[3], bool inward) {
    for (int axis = 0; axis < 3; axis++)
        for (int side = 0; side < 2; side++) {
            box_cell cell = {.axis = axis, .level = side == 0 ? low[axis] : high[axis]};
            memcpy(cell.from, low, sizeof cell.from);
            memcpy(cell.to, high, sizeof cell.to);
            cell.from[axis] = cell.to[axis] = cell.level;
            mesh_add_cell(m, &cell, (side == 0) == inward);
        }
}

/* A room whose floor is cut in strips, some 1e5 times as long as wide. */
static mesh slivers(void) {
    static const double cuts[] = {0, 1e-5, 2e-5, .01, .3, .3 + 1e-5, .7, 1};
    mesh m = {0};
    add_box(&m, (double[]){0, 0, 0}, (double[]){1, 1, 1}, true);
    /* Not the floor that is one piece: faces come x0 x1 y0 y1 z0 z1. */
    memmove(m.elements + 4, m.elements + 5, sizeof *m.elements);
    m.n--;
    for (size_t k = 0; k + 1 < sizeof cuts / sizeof *cuts; k++) {
        const box_cell strip = {.axis = 2, .level = 0, .from = {cuts[k], 0, 0}, .to = {cuts[k + 1], 1, 0}};
        mesh_add_cell(&m, &strip, true);
    }
    mesh_finish(&m, .5f);
    return m;
}

START_TEST(slivers_hold) {
    run(slivers,
        false); /* at 1e6 m the thinnest are narrower than single precision: rays meet none of them */
    mesh m = slivers();
    form_factors f = make(&m, &recipes[2]);
    check_closed(&m, &f, 1e-5);
    /* The closed form of the strip and the ceiling. */
    const box_cell ceiling = {.axis = 2, .level = 1, .from = {0, 0, 1}, .to = {1, 1, 1}},
                   strip = {.axis = 2, .level = 0, .from = {.01, 0, 0}, .to = {.3, 1, 0}};
    const double exact = box_exchange(&strip, &ceiling) / .29;
    ck_assert_double_eq_tol(csr_entry(&f.F, 8, 4), exact, 1e-4 * exact);
    form_factors_free(&f);
    mesh_free(&m);
}
END_TEST

/* A room with the same plate twice in one place, and a carpet that lies on its floor. */
static mesh coincident(void) {
    mesh m = {0};
    const box_cell plate = {.axis = 2, .level = .5, .from = {.2, .2, .5}, .to = {.8, .8, .5}},
                   carpet = {.axis = 2, .level = 0, .from = {.1, .1, 0}, .to = {.6, .6, 0}};
    add_box(&m, (double[]){0, 0, 0}, (double[]){1, 1, 1}, true);
    mesh_add_cell(&m, &plate, true);
    mesh_add_cell(&m, &plate, true);
    mesh_add_cell(&m, &plate, false);
    mesh_add_cell(&m, &carpet, true);
    mesh_finish(&m, .5f);
    return m;
}

START_TEST(coincident_faces_hold) {
    run(coincident, false);
}
END_TEST

/* Two boxes that stand in one another, in a room. */
static mesh interpenetrating(void) {
    mesh m = {0};
    add_box(&m, (double[]){0, 0, 0}, (double[]){3, 3, 3}, true);
    add_box(&m, (double[]){.5, .5, 0}, (double[]){1.7, 1.5, 1.5}, false);
    add_box(&m, (double[]){1.2, 1, 0}, (double[]){2.5, 2.2, 1}, false);
    mesh_finish(&m, .5f);
    return m;
}

START_TEST(interpenetrating_boxes_hold) {
    run(interpenetrating, false);
}
END_TEST

/* A room turned inside out, about a plate. */
static mesh inverted(void) {
    mesh m = {0};
    const box_cell plate = {.axis = 2, .level = .5, .from = {.2, .2, .5}, .to = {.8, .8, .5}};
    add_box(&m, (double[]){0, 0, 0}, (double[]){1, 1, 1}, false);
    mesh_add_cell(&m, &plate, true);
    mesh_finish(&m, .5f);
    return m;
}

START_TEST(inverted_normals_are_told) {
    run(inverted, false);
    mesh m = inverted();
    for (size_t r = 0; r < N_RECIPES; r++) {
        form_factors f = make(&m, &recipes[r]);
        for (size_t i = 0; i < m.n; i++) ck_assert_double_eq(f.row_sums[i], 0);
        /* The plate sees backs only, the others nothing. */
        ck_assert_double_eq_tol(f.absorbed[6], 1, 1e-6);
        ck_assert_double_eq_tol(f.leaving[0], 1, 1e-6);
        form_factors_free(&f);
    }
    mesh_free(&m);
}
END_TEST

/* A plate within a box, whose sides are all modelled, within a room. */
static mesh enclosed(void) {
    mesh m = {0};
    const box_cell plate = {.axis = 2, .level = 1.5, .from = {1.2, 1.2, 1.5}, .to = {1.8, 1.8, 1.5}};
    add_box(&m, (double[]){0, 0, 0}, (double[]){3, 3, 3}, true);
    add_box(&m, (double[]){1, 1, 1}, (double[]){2, 2, 2}, false);
    add_box(&m, (double[]){1, 1, 1}, (double[]){2, 2, 2}, true);
    mesh_add_cell(&m, &plate, true);
    mesh_add_cell(&m, &plate, false);
    mesh_finish(&m, .5f);
    return m;
}

START_TEST(enclosed_element_sees_only_its_box) {
    run(enclosed, true);
    mesh m = enclosed();
    for (size_t r = 0; r < N_RECIPES; r++) {
        form_factors f = make(&m, &recipes[r]);
        for (size_t i = 12; i < m.n; i++)
            for (size_t j = 0; j < 12; j++) ck_assert_double_eq(csr_entry(&f.F, i, j), 0);
        form_factors_free(&f);
    }
    mesh_free(&m);
}
END_TEST

/* An occluder is added: before the repair no factor rises; after it by no more than that changed. */
START_TEST(occluder_raises_nothing_beyond_the_repair) {
    mesh without = {0}, with = {0};
    const box_cell plate = {.axis = 2, .level = .5, .from = {.2, .3, .5}, .to = {.7, .9, .5}};
    add_box(&without, (double[]){0, 0, 0}, (double[]){1, 1, 1}, true);
    add_box(&with, (double[]){0, 0, 0}, (double[]){1, 1, 1}, true);
    mesh_add_cell(&with, &plate, true);
    mesh_add_cell(&with, &plate, false);
    mesh_finish(&without, .5f);
    mesh_finish(&with, .5f);
    for (size_t r = 0; r < N_RECIPES; r++) {
        form_factors before = make(&without, &recipes[r]), after = make(&with, &recipes[r]);
        for (size_t i = 0; i < without.n; i++)
            for (size_t j = 0; j < without.n; j++)
                /* A row is scaled by about what its sum was repaired by, at either end. */
                ck_assert_double_le(
                    csr_entry(&after.F, i, j),
                    csr_entry(&before.F, i, j) * (1 + 4 * (after.repair_max + before.repair_max)) + 1e-6);
        form_factors_free(&before);
        form_factors_free(&after);
    }
    mesh_free(&without);
    mesh_free(&with);
}
END_TEST

/* Factors have no unit: a scene of another size or place has the same ones. */
START_TEST(factors_have_no_scale) {
    mesh unit = interpenetrating();
    form_factors same = make(&unit, &recipes[2]);
    for (size_t p = 1; p < N_PLACES; p++) {
        mesh m = interpenetrating();
        plates_move(&m, places[p][0], places[p][1]);
        form_factors f = make(&m, &recipes[2]);
        for (size_t i = 0; i < m.n; i++)
            for (size_t j = 0; j < m.n; j++)
                /* The same segments: but for rounding at edges, within several times the standard error. */
                ck_assert_double_eq_tol(csr_entry(&f.F, i, j), csr_entry(&same.F, i, j),
                                        5 * recipes[2].accuracy * fmax(1, 10 * csr_entry(&same.F, i, j)));
        form_factors_free(&f);
        mesh_free(&m);
    }
    form_factors_free(&same);
    mesh_free(&unit);
}
END_TEST

int main(void) {
    Suite *suite = suite_create("scenes");
    TCase *cases = tcase_create("scenes");
    tcase_set_timeout(cases, 300);
    tcase_add_test(cases, slivers_hold);
    tcase_add_test(cases, coincident_faces_hold);
    tcase_add_test(cases, interpenetrating_boxes_hold);
    tcase_add_test(cases, inverted_normals_are_told);
    tcase_add_test(cases, enclosed_element_sees_only_its_box);
    tcase_add_test(cases, occluder_raises_nothing_beyond_the_repair);
    tcase_add_test(cases, factors_have_no_scale);
    suite_add_tcase(suite, cases);
    return suite_run(suite);
}
