/* Elements know the face of the scene file that they are parts of, whatever is done to the mesh. */
#include "solver/scene/facet/wall_cuts.h"
#include "store/groups.h"
#include "support/scene.h"
#include "support/suite.h"

static lam_error error;
static char folder[64], path[256];

static void setup(void) {
    folder_make(folder);
}

static void teardown(void) {
    folder_remove(folder);
}

/* Faces 0, 1 and 6 are of the floor, 3 a hexagon of another object; 2 repeats 0, 4 and 5 have no area. */
#define PIECES                                                                                               \
    "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nv 2 0 0\nv 2 1 0\n"                                                 \
    "v 0 2 0\nv 1 2 0\nv 2 2 1\nv 2 3 1\nv 1 4 1\nv 0 3 1\nv 0 2 1\nv 1 1.5 1\n"                             \
    "o floor\nf 1 2 3 4\nf 2 5 6 3\nf 2 3 4 1\n"                                                             \
    "o six\nf 9 10 11 12 13 14\n"                                                                            \
    "o none\nf 1 2\nf 1 2 1\n"                                                                               \
    "o floor\nf 4 3 8 7\n"

/* The number of elements of each face, and their area. */
static void count_faces(const mesh *m, size_t n_faces, size_t *numbers, double *areas) {
    ck_assert_uint_eq(m->faces.n_faces, n_faces);
    for (size_t f = 0; f < n_faces; f++) numbers[f] = 0, areas[f] = 0;
    for (size_t i = 0; i < m->n; i++) {
        ck_assert_uint_lt(m->faces.of[i], n_faces);
        numbers[m->faces.of[i]]++;
        areas[m->faces.of[i]] += m->area[i];
    }
}

START_TEST(faces_have_the_numbers_of_their_lines) {
    enum { N = 7 };
    static const double expected[N] = {1, 1, 0, 3.5, 0, 0, 1};
    size_t numbers[N];
    double areas[N], sums[N];
    mesh m = obj_good(folder, PIECES, NULL);
    for (int step = 0; step < 3; step++) {
        if (step == 1) ck_ok(mesh_refine(&m, &(mesh_refinement){.max_edge = .3}, &error));
        if (step == 2) ck_ok(mesh_make_two_sided(&m, &error));
        const size_t n_fronts = m.n - m.n_backs;
        count_faces(&m, N, numbers, areas);
        for (size_t f = 0; f < N; f++) {
            ck_assert_double_eq_tol(areas[f], (step == 2 ? 2 : 1) * expected[f], 1e-12);
            ck_assert_uint_eq(numbers[f] > 0, expected[f] > 0);
        }
        ck_assert_uint_ge(numbers[3], 2); /* a hexagon is several elements of one face */
        for (size_t i = n_fronts; i < m.n; i++) ck_assert_uint_eq(m.faces.of[i], m.faces.of[i - n_fronts]);
        scene_faces_sum(&m.faces, n_fronts, m.area, sums);
        for (size_t f = 0; f < N; f++) ck_assert_double_eq_tol(sums[f], expected[f], 1e-12);
    }
    mesh_free(&m);
}
END_TEST

START_TEST(dropped_elements_leave_the_numbers_of_others) {
    mesh m = obj_good(folder, PIECES, NULL);
    const size_t n = m.n;
    bool *dropped = calloc(n, sizeof *dropped);
    for (size_t i = 0; i < n; i++) dropped[i] = m.faces.of[i] < 3;
    ck_ok(mesh_drop(&m, dropped, &error));
    ck_assert_uint_eq(m.n, n - 2);
    ck_assert_uint_eq(m.faces.n_faces, 7);
    for (size_t i = 0; i < m.n; i++) ck_assert_uint_eq(m.faces.of[i], i + 1 < m.n ? 3 : 6);
    free(dropped);
    mesh_free(&m);
}
END_TEST

/* A wall on a floor of one face cuts it into parts of that face. */
START_TEST(parts_at_walls_are_of_their_face) {
    mesh m = obj_good(folder,
                      "v 0 0 0\nv 4 0 0\nv 4 4 0\nv 0 4 0\nv 1 1 0\nv 1 3 0\nv 1 3 2\nv 1 1 2\n"
                      "f 5 6 7 8\nf 1 2 3 4\n",
                      NULL);
    wall_cuts_report made;
    ck_ok(faces_cut_at_walls(&m, .1, 100, &made, &error));
    ck_assert_uint_gt(made.parts, 1);
    size_t numbers[2];
    double areas[2];
    count_faces(&m, 2, numbers, areas);
    ck_assert_uint_eq(numbers[0], 1);
    ck_assert_uint_eq(numbers[1], made.parts);
    ck_assert_double_eq_tol(areas[1], 16, 1e-12);
    mesh_free(&m);
}
END_TEST

/* Each place of a mesh that two nodes have, in the order of these; the second is twice as long. */
START_TEST(instances_have_faces_of_their_own) {
    file_write(folder, "two.gltf",
               "{\"asset\":{\"version\":\"2.0\"},\"scene\":0,\"scenes\":[{\"nodes\":[1,0]}],"
               "\"nodes\":[{\"name\":\"last\",\"mesh\":0},"
               "{\"name\":\"first\",\"mesh\":0,\"scale\":[2,1,1],\"translation\":[0,0,3],\"children\":[2]},"
               "{\"name\":\"child\",\"mesh\":0,\"scale\":[2,1,1],\"translation\":[0,0,3]}],"
               "\"meshes\":[{\"primitives\":[{\"attributes\":{\"POSITION\":0}}]}],"
               "\"accessors\":[{\"bufferView\":0,\"componentType\":5126,\"count\":3,\"type\":\"VEC3\","
               "\"min\":[0,0,0],\"max\":[1,1,0]}],"
               "\"bufferViews\":[{\"buffer\":0,\"byteLength\":36}],"
               "\"buffers\":[{\"byteLength\":36,\"uri\":\"data:application/"
               "octet-stream;base64,AAAAAAAAAAAAAAAAAACAPwAAAAAAAAAAAAAAAAAAgD8AAAAA\"}]}",
               path);
    static const double expected[3] = {1, 2, .5};
    size_t numbers[3];
    double areas[3];
    mesh m = import_good(path, NULL);
    count_faces(&m, 3, numbers, areas);
    for (size_t f = 0; f < 3; f++) ck_assert_double_eq(areas[f], expected[f]);
    ck_assert_double_eq(group_area(&m, "last", NULL), .5);
    mesh_free(&m);
}
END_TEST

/* Formats of single faces: those of a PLY, less its line, and the triangles of two solids in an STL. */
START_TEST(other_formats_keep_their_order) {
    static const double of_ply[3] = {1, 2, 3}, of_stl[3] = {.5, 1, 1.5};
    size_t numbers[3];
    double areas[3];
    char text[2048];
    size_t at = (size_t)snprintf(text, sizeof text,
                                 "ply\nformat ascii 1.0\nelement vertex 12\nproperty float x\nproperty float "
                                 "y\nproperty float z\nelement face 4\nproperty list uchar int "
                                 "vertex_indices\nend_header\n");
    for (int k = 0; k < 3; k++)
        at += (size_t)snprintf(text + at, sizeof text - at, "0 0 %d\n%d 0 %d\n%d 1 %d\n0 1 %d\n", k, k + 1, k,
                               k + 1, k, k);
    snprintf(text + at, sizeof text - at, "4 0 1 2 3\n2 0 1\n4 4 5 6 7\n4 8 9 10 11\n");
    file_write(folder, "three.ply", text, path);
    mesh m = import_good(path, NULL);
    count_faces(&m, 3, numbers, areas);
    for (size_t f = 0; f < 3; f++) ck_assert_double_eq(areas[f], of_ply[f]);
    mesh_free(&m);
    at = 0;
    for (int k = 0; k < 3; k++) {
        if (k < 2) at += (size_t)snprintf(text + at, sizeof text - at, "solid s%d\n", k);
        at += (size_t)snprintf(text + at, sizeof text - at,
                               "facet normal 0 0 1\nouter loop\nvertex 0 0 %d\nvertex %d 0 %d\nvertex 0 1 "
                               "%d\nendloop\nendfacet\n",
                               k, k + 1, k, k);
        if (k != 1) at += (size_t)snprintf(text + at, sizeof text - at, "endsolid\n");
    }
    file_write(folder, "three.stl", text, path);
    m = import_good(path, NULL);
    count_faces(&m, 3, numbers, areas);
    for (size_t f = 0; f < 3; f++) ck_assert_double_eq(areas[f], of_stl[f]);
    mesh_free(&m);
}
END_TEST

/* Elements 0 to 3, of which the last is a back; the second is a part of two faces. */
static scene_faces faces_made(uint32_t of[4], scene_face_part parts[2]) {
    memcpy(of, (uint32_t[4]){2, SCENE_FACE_NONE, 0, 2}, 4 * sizeof *of);
    parts[0] = (scene_face_part){1, 0, .25};
    parts[1] = (scene_face_part){1, 3, .5};
    return (scene_faces){.n_faces = 5, .of = of, .n_parts = 2, .parts = parts};
}

/* Writes the faces of four elements and reads them again, less some of the arrays. */
static lam_status faces_reload(const scene_faces *f, scene_faces *out) {
    static const double area[4] = {1, .75, .5, 1};
    store *s = NULL;
    snprintf(path, sizeof path, "%s/faces.h5", folder);
    ck_ok(store_create(path, &s, &error));
    ck_ok(store_set_text(s, STORE_MESH, "name", "faces", &error));
    ck_ok(scene_faces_save(f, 4, 3, area, s, &error));
    ck_ok(store_seal(s, &error));
    ck_ok(store_open(path, &s, &error));
    const lam_status status = scene_faces_load(s, 4, 3, out, &error);
    store_close(s);
    return status;
}

START_TEST(stores_keep_faces) {
    uint32_t of[4];
    scene_face_part parts[2];
    scene_faces f = faces_made(of, parts), back;
    ck_ok(faces_reload(&f, &back));
    ck_assert_uint_eq(back.n_faces, 5);
    ck_assert_mem_eq(back.of, of, sizeof of);
    ck_assert_uint_eq(back.n_parts, 2);
    for (size_t p = 0; p < 2; p++) {
        ck_assert_uint_eq(back.parts[p].element, parts[p].element);
        ck_assert_uint_eq(back.parts[p].face, parts[p].face);
        ck_assert_double_eq(back.parts[p].area, parts[p].area);
    }
    scene_faces_free(&back);
    f = (scene_faces){.n_faces = 0}; /* as a store of earlier versions */
    ck_ok(faces_reload(&f, &back));
    ck_assert_ptr_null(back.of);
    ck_assert_uint_eq(back.n_faces, 0);
}
END_TEST

START_TEST(stores_with_wrong_faces_are_refused) {
    enum { CASES = 6 };
    static const char *const says[CASES] = {"face_part[0][0] = 2",   "face_part[0][0] = 3",
                                            "face_part[1] = 1, 0",   "face_part[1] = 1, 3",
                                            "face_part_area[1] = 0", "face_part_area[1] = inf"};
    for (int k = 0; k < CASES; k++) {
        uint32_t of[4];
        scene_face_part parts[2];
        scene_faces f = faces_made(of, parts), back;
        if (k == 0) parts[0].element = 2;
        if (k == 1) parts[0].element = 3;
        if (k == 2) parts[1].face = 0;
        if (k == 3) parts[0].face = 4;
        if (k == 4) parts[1].area = 0;
        if (k == 5) parts[1].area = INFINITY;
        ck_assert_int_eq(faces_reload(&f, &back), LAM_ERR_FORMAT);
        ck_assert_msg(strstr(error.message, says[k]) != NULL, "%s", error.message);
        ck_assert_ptr_null(back.of);
    }
}
END_TEST

int main(void) {
    Suite *suite = suite_create("face numbers");
    TCase *tests = tcase_create("face numbers");
    tcase_add_checked_fixture(tests, setup, teardown);
    tcase_add_test(tests, faces_have_the_numbers_of_their_lines);
    tcase_add_test(tests, dropped_elements_leave_the_numbers_of_others);
    tcase_add_test(tests, parts_at_walls_are_of_their_face);
    tcase_add_test(tests, instances_have_faces_of_their_own);
    tcase_add_test(tests, other_formats_keep_their_order);
    tcase_add_test(tests, stores_keep_faces);
    tcase_add_test(tests, stores_with_wrong_faces_are_refused);
    suite_add_tcase(suite, tests);
    return suite_run(suite);
}
