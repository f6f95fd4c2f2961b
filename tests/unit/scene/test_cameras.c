/* Cameras of a glTF: from the file into a mesh, through refinement and a store. */
#include "support/suite.h"

#include "support/scene.h"

static char folder[64];

static void setup(void) {
    folder_make(folder);
}

static void teardown(void) {
    folder_remove(folder);
}

/* A triangle, and cameras: two nodes of one name, of which the second is a child of a node that turns it by
 * 90 degrees about y, scales it by 2 and moves it; one without a name; one that is orthographic; one turned
 * upside down about z. Vertical angles of 40 and 60 degrees. */
static const char gltf[] =
    "{\"asset\":{\"version\":\"2.0\"},\"scene\":0,\"scenes\":[{\"nodes\":[0,1,2,4,5,6]}],"
    "\"nodes\":[{\"name\":\"floor\",\"mesh\":0},"
    "{\"name\":\"eye\",\"camera\":0,\"translation\":[1,2,3]},"
    "{\"name\":\"arm\",\"children\":[3],\"rotation\":[0,0.70710678,0,0.70710678],\"scale\":[2,2,2],"
    "\"translation\":[10,0,0]},"
    "{\"name\":\"eye\",\"camera\":1,\"translation\":[0,0,1]},"
    "{\"camera\":2},{\"name\":\"plan\",\"camera\":3},"
    "{\"name\":\"over, \\u00fcber\",\"camera\":4,\"rotation\":[0,0,1,0]}],"
    "\"cameras\":[{\"type\":\"perspective\",\"perspective\":{\"aspectRatio\":1.5,\"yfov\":0.6981317,"
    "\"znear\":0.1}},"
    "{\"type\":\"perspective\",\"perspective\":{\"yfov\":1.0471976,\"znear\":0.1}},"
    "{\"type\":\"perspective\",\"perspective\":{\"aspectRatio\":0.5,\"yfov\":1.0471976,\"znear\":0.1}},"
    "{\"type\":\"orthographic\",\"orthographic\":{\"xmag\":1,\"ymag\":1,\"zfar\":9,\"znear\":0.1}},"
    "{\"type\":\"perspective\",\"perspective\":{\"yfov\":1.0471976,\"znear\":0.1}}],"
    "\"meshes\":[{\"primitives\":[{\"attributes\":{\"POSITION\":0}}]}],"
    "\"accessors\":[{\"bufferView\":0,\"componentType\":5126,\"count\":3,\"type\":\"VEC3\","
    "\"min\":[0,0,0],\"max\":[1,1,0]}],"
    "\"bufferViews\":[{\"buffer\":0,\"byteLength\":36}],"
    "\"buffers\":[{\"byteLength\":36,\"uri\":\"data:application/"
    "octet-stream;base64,AAAAAAAAAAAAAAAAAACAPwAAAAAAAAAAAAAAAAAAgD8AAAAA\"}]}";

static const scene_camera expected[] = {
    {"eye", {1, 2, 3}, {0, 0, -1}, {0, 1, 0}, 40},
    {"eye-2", {12, 0, 0}, {-1, 0, 0}, {0, 1, 0}, 60},
    {"camera-2", {0, 0, 0}, {0, 0, -1}, {0, 1, 0}, 60},
    {"over, \xc3\xbc"
     "ber",
     {0, 0, 0},
     {0, 0, -1},
     {0, -1, 0},
     60},
};
enum { CAMERAS = sizeof expected / sizeof *expected };

/* The numbers of the file are in single precision. */
static void check(const mesh *m, double unit) {
    ck_assert_uint_eq(m->n_cameras, CAMERAS);
    for (size_t k = 0; k < CAMERAS; k++) {
        const scene_camera *c = scene_camera_find(m->n_cameras, m->cameras, expected[k].name);
        ck_assert_msg(c != NULL, "no camera %s", expected[k].name);
        ck_assert_double_eq_tol(c->fov, expected[k].fov, 1e-4);
        for (int d = 0; d < 3; d++) {
            ck_assert_double_eq_tol(c->eye[d], unit * expected[k].eye[d], 1e-5 * unit);
            ck_assert_double_eq_tol(c->direction[d], expected[k].direction[d], 1e-6);
            ck_assert_double_eq_tol(c->up[d], expected[k].up[d], 1e-6);
        }
    }
}

START_TEST(cameras_come_with_the_scene) {
    char path[256], name[96];
    import_report report;
    lam_error error = {0};
    import_options options = import_plain();
    const mesh_refinement how = {.subdivide_levels = 2};
    mesh m = {0}, back = {0};
    store *s = NULL;
    options.unit = .01;
    file_write(folder, "scene.gltf", gltf, path);
    ck_assert_msg(scene_import(path, &options, &m, &report, &error) == LAM_OK, "%s", error.message);
    check(&m, .01);
    ck_assert_ptr_nonnull(strstr(report.warnings, "the camera 'plan' is left out: it is orthographic"));
    ck_assert_ptr_null(strstr(report.warnings, "eye"));
    ck_assert_int_eq(mesh_refine(&m, &how, &error), LAM_OK);
    check(&m, .01);
    ck_assert_int_eq(mesh_make_two_sided(&m, &error), LAM_OK);
    check(&m, .01);
    snprintf(name, sizeof name, "%s/a.h5", folder);
    ck_assert_msg(store_create(name, &s, &error) == LAM_OK, "%s", error.message);
    ck_assert_msg(mesh_save(&m, NULL, s, &error) == LAM_OK, "%s", error.message);
    ck_assert_msg(store_seal(s, &error) == LAM_OK, "%s", error.message);
    ck_assert_msg(store_open(name, &s, &error) == LAM_OK, "%s", error.message);
    ck_assert_msg(mesh_load(s, &back, NULL, &error) == LAM_OK, "%s", error.message);
    check(&back, .01);
    store_close(s);
    mesh_free(&m);
    mesh_free(&back);
}
END_TEST

START_TEST(cameras_are_settled) {
    /* An up that leans is made upright; what has no direction, no up of its own or no angle is refused. */
    scene_camera c = {"a", {1, 2, 3}, {0, 0, -5}, {0, 3, 4}, 40};
    ck_assert(scene_camera_settle(&c));
    ck_assert_double_eq(c.direction[2], -1);
    ck_assert_double_eq_tol(c.up[1], 1, 1e-15);
    ck_assert_double_eq_tol(c.up[2], 0, 1e-15);
    const scene_camera bad[] = {
        {"a", {0, 0, 0}, {0, 0, 0}, {0, 1, 0}, 40},   {"a", {0, 0, 0}, {0, 0, 1}, {0, 0, -1}, 40},
        {"a", {0, 0, 0}, {0, 0, 1}, {0, 1, 0}, 0},    {"a", {0, 0, 0}, {0, 0, 1}, {0, 1, 0}, 180},
        {"a", {0, 0, 0}, {0, 0, 1}, {0, 1, 0}, NAN},  {"a", {NAN, 0, 0}, {0, 0, 1}, {0, 1, 0}, 40},
        {"a", {0, 0, 0}, {0, NAN, 1}, {0, 1, 0}, 40}, {"a", {0, 0, INFINITY}, {0, 0, 1}, {0, 1, 0}, 40},
    };
    for (size_t k = 0; k < sizeof bad / sizeof *bad; k++) {
        scene_camera kept = bad[k];
        ck_assert_msg(!scene_camera_settle(&kept), "camera %zu", k);
        ck_assert_mem_eq(&kept, &bad[k], sizeof kept);
    }
}
END_TEST

START_TEST(damaged_cameras_are_named) {
    char name[96];
    lam_error error = {0};
    store *s = NULL;
    scene_camera *found = NULL;
    size_t n = 7;
    const scene_camera bad[] = {{"ok", {0, 0, 0}, {0, 0, 1}, {0, 1, 0}, 40},
                                {"a", {0, 0, 0}, {0, 0, 1}, {0, 1, 0}, 200}};
    snprintf(name, sizeof name, "%s/b.h5", folder);
    for (size_t count = 0; count <= 2; count += 2) {
        ck_assert_int_eq(store_create(name, &s, &error), LAM_OK);
        ck_assert_int_eq(store_set_text(s, "/", "name", "eyes", &error), LAM_OK);
        ck_assert_int_eq(scene_cameras_save(count, bad, s, &error), LAM_OK);
        ck_assert_msg(store_seal(s, &error) == LAM_OK, "%s", error.message);
        ck_assert_msg(store_open(name, &s, &error) == LAM_OK, "%s", error.message);
        ck_assert_int_eq(scene_cameras_load(s, &n, &found, &error), count == 0 ? LAM_OK : LAM_ERR_FORMAT);
        ck_assert_uint_eq(n, 0);
        ck_assert_ptr_null(found);
        store_close(s);
    }
    ck_assert_ptr_nonnull(
        strstr(error.message, "/cameras: camera 1 has no direction, no up, or a field of view of 200"));
}
END_TEST

int main(void) {
    Suite *suite = suite_create("cameras");
    TCase *tests = tcase_create("cameras");
    tcase_set_timeout(tests, 60);
    tcase_add_checked_fixture(tests, setup, teardown);
    tcase_add_test(tests, cameras_come_with_the_scene);
    tcase_add_test(tests, cameras_are_settled);
    tcase_add_test(tests, damaged_cameras_are_named);
    suite_add_tcase(suite, tests);
    return suite_run(suite);
}
