/* Lights of a scene file as luminaires: their light into directions of the scene, and lists that have more.
 */
#include "solver/base/photometry.h"
#include "solver/base/vector3.h"
#include "solver/luminaire/luminaire_made.h"
#include "solver/luminaire/placed.h"
#include "support/suite.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#define POINT(name) {name, PUNCTUAL_POINT, 0, {0, 0, 2}, {0, 0, -1}, 1, {1, 1, 1}, 0, M_PI_4}

static const punctual_light lights[] = {
    {"spot", PUNCTUAL_SPOT, 1, {1, 2, 3}, {.6, 0, -.8}, 500, {.5, 1, 0}, .2, .6},
    {"sun", PUNCTUAL_DIRECTIONAL, 0, {0, 0, 0}, {0, 0, -1}, 9e4, {1, 1, 1}, 0, M_PI_4},
    {"bulb", PUNCTUAL_POINT, 0, {4, 5, 6}, {0, 1, 0}, 80, {2, 2, 2}, .2, .6},
    {"spot-2", PUNCTUAL_SPOT, 0, {1, 2, 3}, {1, 0, 0}, 20, {1, 1, 1}, .2, .6},
    {"dark", PUNCTUAL_SPOT, 0, {1, 2, 3}, {0, 0, 1}, 20, {0, 0, 0}, 0, .6},
    {"faint", PUNCTUAL_POINT, 0, {0, 0, 0}, {0, 0, -1}, 1, {0, 0, 1e-320}, 0, M_PI_4},
};
enum { LIGHTS = sizeof lights / sizeof *lights };

/* The intensity of a luminaire into a direction of the scene, of its own frame and file. */
static double candela_along(const placed_luminaires *p, const placed_luminaire *l,
                            const double direction[3]) {
    const double x = dot3(direction, l->x), y = dot3(direction, l->y), z = dot3(direction, l->z);
    return l->scale * luminaire_candela(&p->files[l->file].photometry, atan2(y, x) * (180 / M_PI),
                                        acos(fmax(-1, fmin(1, -z))) * (180 / M_PI));
}

static double luminance(const double c[3]) {
    return luminance_of(c[0], c[1], c[2]);
}

START_TEST(lights_shine_as_in_their_file) {
    lam_error error = {0};
    placed_luminaires p = {.n = 0};
    size_t outside = 7;
    uint32_t state = 53;
    ck_ok(placed_from_lights("a.glb", LIGHTS, lights, &p, &outside, &error));
    ck_assert(outside == 1 && p.n == 5 && p.n_files == 3 && p.files[0].path == NULL);
    ck_assert_str_eq(p.files[0].name, "spot, 11.4592 to 34.3775 degrees");
    ck_assert_str_eq(p.files[1].name, "point");
    for (size_t k = 0; k < p.n; k++) {
        const placed_luminaire *l = &p.luminaires[k];
        const punctual_light *of = &lights[l->entry];
        const double Y = luminance(of->colour), edge = cos(of->inner) - cos(of->outer);
        double y[3];
        ck_assert_str_eq(l->name, of->name);
        ck_assert(l->dim == 1 && l->maintenance == 1 && l->is_point && l->n_ignored == 0);
        ck_assert(memcmp(l->at, of->at, sizeof l->at) == 0 && l->group[0] == '\0');
        ck_assert_double_eq_tol(luminance(l->colour), 1, 1e-14);
        cross3(l->z, l->x, y);
        for (int d = 0; d < 3; d++) {
            ck_assert_double_eq_tol(y[d], l->y[d], 1e-15);
            if (of->kind == PUNCTUAL_SPOT) ck_assert_double_eq_tol(-l->z[d], of->direction[d], 1e-15);
            if (Y > 1e-300) ck_assert_double_eq_tol(Y * l->colour[d], of->colour[d], 1e-14);
        }
        /* 1e-4 of the peak is the interpolation, the rest is rounding. */
        for (int j = 0; j < 100; j++) {
            double w[3];
            for (int d = 0; d < 3; d++) {
                state = state * 1664525 + 1013904223;
                w[d] = (double)state / 2147483648. - 1 + (of->kind == PUNCTUAL_SPOT ? of->direction[d] : 0);
            }
            const double length = sqrt(dot3(w, w));
            for (int d = 0; d < 3; d++) w[d] /= length;
            const double s = fmax(0, fmin(1, (dot3(w, of->direction) - cos(of->outer)) / edge));
            const double law = of->kind == PUNCTUAL_SPOT ? s * s : 1;
            ck_assert_double_eq_tol(candela_along(&p, l, w), of->intensity * Y * law,
                                    (1e-4 * Y + 1e-12) * of->intensity);
        }
        const double flux = of->kind == PUNCTUAL_SPOT ? p.files[l->file].lumens : 4 * M_PI;
        ck_assert_double_eq_tol(placed_lumens(&p, l), of->intensity * Y * flux, 1e-12 * of->intensity);
        ck_assert(l->flux == placed_lumens(&p, l));
    }
    /* Lights of one cone share its table. */
    ck_assert(p.luminaires[0].file == 0 && p.luminaires[2].file == 0 && p.luminaires[3].file == 2);
    ck_assert(p.luminaires[1].file == 1 && p.luminaires[4].file == 1);
    ck_assert(p.luminaires[3].scale == 0 && p.luminaires[3].flux == 0);
    placed_free(&p);
}
END_TEST

static const char list[] =
    "{\"luminaires\": [{\"name\": \"desk\", \"group\": \"row\", \"file\": \"f.ies\", \"at\": [0, 0, 3], "
    "\"ignore\": [\"lid\"]}, {\"name\": \"wall\", \"file\": \"g.ies\", \"at\": [0, 0, 3]}]}";

static placed_luminaires read_list(void) {
    const placed_options options = {.unit = 1};
    lam_error error = {0};
    placed_luminaires p = {.n = 0};
    ck_ok(placed_read_text("l.json", list, sizeof list - 1, &options, &p, &error));
    return p;
}

START_TEST(lists_keep_their_own) {
    placed_luminaires p = read_list();
    lam_error error = {0};
    size_t outside = 0;
    ck_ok(placed_from_lights("a.glb", LIGHTS, lights, &p, &outside, &error));
    ck_ok(placed_from_lights("a.glb", 0, NULL, &p, &outside, &error));
    ck_assert(outside == 0 && p.n == 7 && p.n_files == 5 && p.n_ignored == 1);
    ck_assert_str_eq(p.luminaires[0].name, "desk");
    ck_assert_str_eq(p.luminaires[2].name, "spot");
    ck_assert_str_eq(p.files[1].name, "g.ies");
    ck_assert(p.luminaires[1].file == 1 && p.luminaires[2].file == 2 && p.luminaires[3].file == 3);
    placed_free(&p);
}
END_TEST

/* The list stays as it was. */
static void refused(size_t n, const punctual_light *of, const char *says) {
    placed_luminaires p = read_list();
    const placed_luminaires kept = p;
    lam_error error = {0};
    size_t outside = 7;
    ck_assert_int_eq(placed_from_lights("a.glb", n, of, &p, &outside, &error), LAM_ERR_ARGUMENT);
    ck_assert_str_eq(error.message, says);
    ck_assert(outside == 7 && memcmp(&p, &kept, sizeof p) == 0);
    placed_free(&p);
}

START_TEST(names_stand_once) {
    const punctual_light clash[] = {
        POINT("a"),
        POINT("wall"),
        POINT("row"),
        {"desk", PUNCTUAL_DIRECTIONAL, 0, {0, 0, 0}, {0, 0, -1}, 1, {1, 1, 1}, 0, M_PI_4}};
    refused(2, clash,
            "a.glb: its light wall has the name of a luminaire of the list of luminaires; rename one of "
            "them");
    refused(1, clash + 2,
            "a.glb: its light row has the name of a group of the list of luminaires; rename one of "
            "them");
    placed_luminaires p = read_list();
    lam_error error = {0};
    size_t outside = 0;
    ck_ok(placed_from_lights("a.glb", 1, clash + 3, &p, &outside, &error)); /* it is no luminaire */
    ck_assert(outside == 1 && p.n == 2);
    placed_free(&p);
}
END_TEST

START_TEST(there_is_a_most) {
    punctual_light *many = calloc(PUNCTUAL_MOST, sizeof *many);
    ck_assert_ptr_nonnull(many);
    for (size_t k = 0; k < PUNCTUAL_MOST; k++) {
        many[k] = (punctual_light)POINT("");
        snprintf(many[k].name, sizeof many[k].name, "%zu", k);
    }
    refused(PUNCTUAL_MOST, many,
            "a.glb: with its 65536 lights there are 65538 luminaires, must be at most 65536");
    for (size_t k = 0; k < PLACED_FILES_MOST; k++) {
        many[k].kind = PUNCTUAL_SPOT;
        many[k].outer = .1 + .001 * (double)k;
    }
    refused(
        PLACED_FILES_MOST, many,
        "a.glb: light 998: with its cone there are more than 1000 files of luminaires and cones of lights");
    free(many);
}
END_TEST

int main(void) {
    Suite *suite = suite_create("placed_lights");
    TCase *tests = tcase_create("all");
    tcase_add_test(tests, lights_shine_as_in_their_file);
    tcase_add_test(tests, lists_keep_their_own);
    tcase_add_test(tests, names_stand_once);
    tcase_add_test(tests, there_is_a_most);
    suite_add_tcase(suite, tests);
    return suite_run(suite);
}
