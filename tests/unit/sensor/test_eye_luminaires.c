/* Luminaires as eyes see them: a panel of one radiance by hand, partly hidden, hidden, and without an
 * opening. */
#include "solver/base/vector3.h"
#include "solver/sensor/eye_luminaires.h"
#include "support/box.h"
#include "support/suite.h"

#include <unistd.h>

enum { EYES = 3, LUMINAIRES = 2 };

/* A panel of 1 x 1 m and 1,000 cos gamma cd at 3 m, and the same as a point. */
static void read_luminaires(placed_luminaires *p) {
    static const char text[] = "{\"files\":{\"p\":\"lambertian-1000cd-1x1m.ies\"},\"luminaires\":[{\"name\":"
                               "\"a\",\"file\":\"p\",\"at\":[0,4,3]},{\"name\":\"b\",\"file\":\"p\",\"at\":"
                               "[0,4,3],\"opening\":\"point\"}]}";
    lam_error error = {0};
    char path[256];
    snprintf(path, sizeof path, "/tmp/lambert-eye-luminaires-%d.json", (int)getpid());
    FILE *file = fopen(path, "w");
    ck_assert_ptr_nonnull(file);
    fputs(text, file);
    fclose(file);
    ck_ok(placed_read(path, &(placed_options){.assets = FIXTURES "/luminaires/made", .up = 'z'}, p, &error));
    unlink(path);
}

static void see(const mesh *m, glare_source seen[LUMINAIRES][EYES]) {
    lam_error error = {0};
    placed_luminaires p;
    uint32_t *eyes;
    size_t n_eyes;
    read_luminaires(&p);
    receiver receivers[EYES + 1] = {{.kind = RECEIVER_PLANE, .at = {9, 9, 9}, .axis = {0, 0, 1}}};
    sensor_set sets[] = {{.name = "desk", .kind = SENSOR_POINTS, .count = 1},
                         {.name = "seats", .kind = SENSOR_EYES, .first = 1, .count = EYES}};
    static const double at[EYES][3] = {{0, 0, 0}, {0, 0, 0}, {0, 3.8, 0}},
                        view[EYES][3] = {{0, 1, 0}, {0, -1, 0}, {0, 1, 0}};
    for (int k = 0; k < EYES; k++) {
        receivers[k + 1].kind = RECEIVER_PLANE;
        memcpy(receivers[k + 1].at, at[k], sizeof at[k]);
        memcpy(receivers[k + 1].axis, view[k], sizeof view[k]);
    }
    const sensor_list list = {.n_sets = 2, .n = EYES + 1, .sets = sets, .receivers = receivers};
    ck_ok(eyes_find(&list, &n_eyes, &eyes, &error));
    ck_assert_uint_eq(n_eyes, EYES);
    ck_assert_uint_eq(eyes[0], 1);
    ck_ok(eye_luminaires_make(m, &p, &(direct_options){.seed = 1}, receivers, n_eyes, eyes, seen[0], &error));
    free(eyes);
    placed_free(&p);
}

/* A plate 1.5 m high; with it what lies behind y is hidden. */
static mesh plate_upto(double y) {
    mesh m = {0};
    mesh_add_cell(&m, &(box_cell){.axis = 2, .level = 1.5, .from = {-3, -3, 1.5}, .to = {3, y, 1.5}}, true);
    mesh_finish(&m, .5f);
    mesh_name_room(&m);
    return m;
}

/* The eye at the origin sees the panel under cos gamma = 3/5 from 5 m: I = 600 cd, A = .6 m2, R = .75 above
 * the line of sight; chords of a table of 1 degree are off by (pi / 180)^2 / 8 = 4e-5. The panel ends at y
 * = 3.5 and 4.5, and is seen through the plane of the plate from 1.75 to 2.25. */
START_TEST(panel_by_hand) {
    glare_source seen[LUMINAIRES][EYES];
    mesh open = plate_upto(-2.9), half = plate_upto(2), closed = plate_upto(3);
    see(&open, seen);
    const glare_source *a = &seen[0][0];
    ck_assert_double_eq_tol(a->intensity, 600, 4e-5 * 600);
    ck_assert_double_eq_tol(a->area, .6, 1e-9);
    ck_assert_double_eq_tol(a->distance, 5, 1e-9);
    ck_assert_double_eq_tol(
        a->position, glare_position((double[3]){0, 1, 0}, (double[3]){0, 0, 1}, (double[3]){0, .8, .6}),
        1e-9);
    ck_assert_double_eq(a->seen, 1);
    ck_assert_double_eq(seen[0][1].position, 0); /* it looks away */
    ck_assert_double_eq(seen[1][0].area, 0);     /* a point */
    ck_assert_double_eq(seen[1][0].seen, 1);
    ck_assert_int_eq(glare_judge(&seen[1][0]), GLARE_NO_OPENING);
    ck_assert_int_eq(glare_judge(&seen[0][2]), GLARE_OUTSIDE); /* nearly overhead */
    /* The nearer half is hidden. Light across the way goes with I / d^2 = 3 / d^3 * 1,000, and the middles of
     * both halves are 4.80 and 5.20 m away: the farther one gives .440 of it. A row of 16 cells may be on
     * either side, .0625 of half of it. */
    see(&half, seen);
    printf("half a panel: %.4f\n", seen[0][0].seen);
    ck_assert_double_eq_tol(seen[0][0].seen, .44, .04);
    ck_assert_double_eq_tol(seen[0][0].intensity, 600, 4e-5 * 600);
    see(&closed, seen);
    ck_assert_double_eq(seen[0][0].seen, 0);
    ck_assert_double_eq(seen[1][0].seen, 0);
    ck_assert_int_eq(glare_judge(&seen[1][0]), GLARE_HIDDEN);
    mesh_free(&open);
    mesh_free(&half);
    mesh_free(&closed);
}
END_TEST

int main(void) {
    Suite *s = suite_create("luminaires that eyes see");
    TCase *c = tcase_create("all");
    tcase_add_test(c, panel_by_hand);
    suite_add_tcase(s, c);
    return suite_run(s);
}
