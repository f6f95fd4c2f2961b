/* What a glTF says in its own way: luminance in place of exitance. */
#include "support/suite.h"

#include "support/scene.h"

/* A folder that each test has to itself. */
static char folder[64];

static void setup(void) {
    folder_make(folder);
}

static void teardown(void) {
    folder_remove(folder);
}

/* A triangle of .5 m2 in each of its nodes. */
#define TRIANGLE                                                                                             \
    "\"accessors\":[{\"bufferView\":0,\"componentType\":5126,\"count\":3,\"type\":\"VEC3\","                 \
    "\"min\":[0,0,0],\"max\":[1,1,0]}],\"bufferViews\":[{\"buffer\":0,\"byteLength\":36}],"                  \
    "\"buffers\":[{\"byteLength\":36,\"uri\":\"data:application/"                                            \
    "octet-stream;base64,AAAAAAAAAAAAAAAAAACAPwAAAAAAAAAAAAAAAAAAgD8AAAAA\"}]"

/* Of a luminance L a diffuse surface sends out pi L. */
START_TEST(emission_is_luminance) {
    static const char gltf[] =
        "{\"asset\":{\"version\":\"2.0\"},\"scene\":0,\"scenes\":[{\"nodes\":[0,1,2]}],"
        "\"nodes\":[{\"name\":\"dark\",\"mesh\":0},{\"name\":\"dim\",\"mesh\":1,\"translation\":[0,0,3]},{"
        "\"name\":\"bright\","
        "\"translation\":[0,0,6],\"mesh\":2}],"
        "\"meshes\":[{\"primitives\":[{\"attributes\":{\"POSITION\":0},\"material\":0}]},"
        "{\"primitives\":[{\"attributes\":{\"POSITION\":0},\"material\":1}]},"
        "{\"primitives\":[{\"attributes\":{\"POSITION\":0},\"material\":2}]}],"
        "\"extensionsUsed\":[\"KHR_materials_emissive_strength\"],"
        "\"materials\":[{\"emissiveFactor\":[0,0,0]},{\"emissiveFactor\":[0.5,0.5,0.5]},"
        "{\"emissiveFactor\":[1,1,1],\"extensions\":{\"KHR_materials_emissive_strength\":{"
        "\"emissiveStrength\":1000}}}]," TRIANGLE "}";
    static const double luminance[] = {0, .5, 1000};
    char path[256];
    import_report report;
    file_write(folder, "lamps.gltf", gltf, path);
    mesh m = import_good(path, &report);
    ck_assert_uint_eq(m.n, 3);
    ck_assert_uint_eq(report.luminous, 2);
    for (size_t i = 0; i < 3; i++)
        ck_assert_double_eq_tol((double)m.emission[i], M_PI * luminance[i], 1e-6 * 1000 * M_PI);
    mesh_free(&m);
    mtl_write(folder, "newmtl lamp\nKd 0 0 0\nKe 1 1 1\n");
    m = obj_good(folder, "mtllib scene.mtl\nv 0 0 0\nv 1 0 0\nv 0 1 0\nusemtl lamp\nf 1 2 3\n", &report);
    ck_assert_float_eq(m.emission[0], 1); /* it has no unit */
    ck_assert_uint_eq(report.luminous, 0);
    mesh_free(&m);
}
END_TEST

int main(void) {
    Suite *suite = suite_create("import_gltf");
    TCase *tests = tcase_create("import_gltf");
    tcase_add_checked_fixture(tests, setup, teardown);
    tcase_add_test(tests, emission_is_luminance);
    suite_add_tcase(suite, tests);
    return suite_run(suite);
}
