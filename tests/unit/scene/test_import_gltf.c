/* A glTF in its own way: luminance in place of exitance, integers in place of floats, extensions. */
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

/* Writes a glTF of two triangles that make a square of 2 m in the plane y = 3, facing up, whose corners are
 * integers of a type, from 0 to top, in rows of `stride` bytes. */
static void write_square(const char *type, size_t size, double top, size_t stride, const char *more,
                         char path[256]) {
    static const int corners[4][3] = {{0, 0, 0}, {0, 0, 1}, {1, 0, 1}, {1, 0, 0}};
    static const unsigned char order[6] = {0, 1, 2, 0, 2, 3};
    unsigned char bytes[4 * 16 + 6] = {0};
    char text[2048];
    for (size_t v = 0; v < 4; v++)
        for (size_t k = 0; k < 3; k++) {
            const uint16_t value = (uint16_t)(corners[v][k] * (int)top);
            bytes[v * stride + k * size] = (unsigned char)value;
            if (size == 2) bytes[v * stride + k * size + 1] = (unsigned char)(value >> 8);
        }
    memcpy(bytes + 4 * stride, order, sizeof order);
    snprintf(path, 256, "%s/square.bin", folder);
    FILE *f = fopen(path, "wb");
    ck_assert_ptr_nonnull(f);
    ck_assert_uint_eq(fwrite(bytes, 4 * stride + sizeof order, 1, f), 1);
    ck_assert_int_eq(fclose(f), 0);
    snprintf(
        text, sizeof text,
        "{\"asset\":{\"version\":\"2.0\"},\"scene\":0,\"scenes\":[{\"nodes\":[0]}],\"extensionsUsed\":["
        "\"KHR_mesh_quantization\"],\"extensionsRequired\":[\"KHR_mesh_quantization\"],"
        "\"nodes\":[{\"mesh\":0,\"scale\":[%.17g,1,%.17g],\"translation\":[0,3,0]}],"
        "\"meshes\":[{\"primitives\":[{\"attributes\":{\"POSITION\":0,\"NORMAL\":0},\"indices\":1}]}],"
        "\"accessors\":[{\"bufferView\":0,\"componentType\":%s,\"count\":4,\"type\":\"VEC3\"%s},"
        "{\"bufferView\":1,\"componentType\":5121,\"count\":6,\"type\":\"SCALAR\"}],"
        "\"bufferViews\":[{\"buffer\":0,\"byteLength\":%zu,\"byteStride\":%zu},{\"buffer\":0,"
        "\"byteOffset\":%zu,\"byteLength\":6}],\"buffers\":[{\"byteLength\":%zu,\"uri\":\"square.bin\"}]}",
        strstr(more, "true") != NULL ? 2. : 2 / top, strstr(more, "true") != NULL ? 2. : 2 / top, type, more,
        4 * stride, stride, 4 * stride, 4 * stride + sizeof order);
    file_write(folder, "square.gltf", text, path);
}

/* KHR_mesh_quantization: numbers times the scale of the node; normalized ones end at 1. */
START_TEST(positions_may_be_integers) {
    static const struct {
        const char *type;
        size_t size;
        double top;
    } types[] = {
        {"5120", 1, 127}, {"5121", 1, 255}, {"5122", 2, 32767}, {"5123", 2, 65535}, {"5123", 2, 16383}};
    char path[256];
    for (size_t k = 0; k < sizeof types / sizeof *types; k++)
        for (size_t stride = 3 * types[k].size; stride <= 16; stride += 16 - 3 * types[k].size)
            for (int normalized = 0; normalized < (k == 4 ? 1 : 2); normalized++) {
                import_report report;
                write_square(types[k].type, types[k].size, types[k].top, stride,
                             normalized == 1 ? ",\"normalized\":true" : "", path);
                mesh m = import_good(path, &report);
                ck_assert_uint_eq(m.n, 2);
                ck_assert_double_eq_tol(total_area(&m), 4, 1e-5);
                for (size_t v = 0; v < m.n_vertices; v++) ck_assert_double_eq_tol(m.vertices[v][1], 3, 1e-6);
                for (size_t i = 0; i < m.n; i++) ck_assert_float_eq_tol(m.normal[i][1], 1, 1e-6f);
                ck_assert_ptr_null(strstr(report.warnings, "quantization"));
                mesh_free(&m);
            }
    const import_options options = import_plain();
    mesh m = {0};
    lam_error error = {0};
    write_square("5121", 1, 255, 4, ",\"byteOffset\":4", path); /* beyond its bytes */
    ck_assert_int_eq(scene_import(path, &options, &m, NULL, &error), LAM_ERR_FORMAT);
    ck_assert_msg(strstr(error.message, "its POSITION are integers that cannot be read") != NULL, "%s",
                  error.message);
}
END_TEST

START_TEST(extensions_that_are_not_read_are_named_with_their_faces) {
    static const char gltf[] =
        "{\"asset\":{\"version\":\"2.0\"},\"scene\":0,\"scenes\":[{\"nodes\":[0,1,2,3]}],"
        "\"extensionsUsed\":[\"KHR_materials_clearcoat\",\"EXT_of_nodes\",\"EXT_of_nothing\",\"KHR_xmp\","
        "\"KHR_lights_punctual\"],\"extensions\":{\"KHR_lights_punctual\":{\"lights\":[{\"type\":\"point\"}]}"
        "},"
        "\"nodes\":[{\"mesh\":0},{\"mesh\":1,\"translation\":[0,0,3],\"extensions\":{\"EXT_of_nodes\":{}}},"
        "{\"translation\":[0,0,6],\"mesh\":1},{\"extensions\":{\"KHR_lights_punctual\":{\"light\":0}}}],"
        "\"meshes\":[{\"primitives\":[{\"attributes\":{\"POSITION\":0}}]},"
        "{\"primitives\":[{\"attributes\":{\"POSITION\":0},\"material\":0}]}],"
        "\"materials\":[{\"extensions\":{\"KHR_materials_clearcoat\":{}}}]," TRIANGLE "}";
    char path[256];
    import_report report;
    file_write(folder, "more.gltf", gltf, path);
    mesh m = import_good(path, &report);
    ck_assert_uint_eq(m.n, 3);
    ck_assert_msg(strstr(report.warnings,
                         "extensions are left out: KHR_materials_clearcoat (of 2 of 3 faces, 1 of 1.5 m2), "
                         "EXT_of_nodes (of 1 of 3 faces, 0.5 of 1.5 m2), EXT_of_nothing") != NULL,
                  "%s", report.warnings);
    ck_assert_ptr_nonnull(strstr(report.warnings, "its 1 light (KHR_lights_punctual) is read: 1 point"));
    mesh_free(&m);
}
END_TEST

static void import_told(const char *gltf, double unit, bool guess, size_t n, const char *told) {
    import_options options = import_plain();
    char path[256];
    import_report report;
    lam_error error = {0};
    mesh m = {0};
    options.unit = unit;
    options.guess_unit = guess;
    file_write(folder, "told.gltf", gltf, path);
    ck_assert_msg(scene_import(path, &options, &m, &report, &error) == LAM_OK, "%s", error.message);
    ck_assert_uint_eq(m.n, n);
    ck_assert_msg(strstr(report.warnings, told) != NULL, "%s", report.warnings);
    mesh_free(&m);
}

/* Nodes of another scene, or of none, are not read: the larger one has four times the area of a triangle. */
START_TEST(faces_that_are_not_read_are_told_with_their_area) {
#define HEAD "{\"asset\":{\"version\":\"2.0\"},\"scene\":0,"
#define MESHES "\"meshes\":[{\"primitives\":[{\"attributes\":{\"POSITION\":0}}]}]," TRIANGLE "}"
    static const char of_another[] =
        HEAD "\"scenes\":[{\"nodes\":[0]},{\"nodes\":[1]}],\"nodes\":[{\"mesh\":0},"
             "{\"mesh\":0,\"scale\":[2,2,2]}]," MESHES;
    static const char of_none[] = HEAD
        "\"scenes\":[{\"nodes\":[0]}],\"nodes\":[{\"mesh\":0},{\"matrix\":[2,0,0,0,0,2,0,0,0,0,2,0,5,5,5,1],"
        "\"children\":[2]},{\"mesh\":0},{\"mesh\":0,\"children\":[4]},{\"children\":[3]}]," MESHES;
    /* Three instances, each with the extension of their node. */
    static const char of_instances[] =
        HEAD "\"extensionsUsed\":[\"EXT_x\"],\"scenes\":[{\"nodes\":[0,1]}],\"nodes\":[{\"mesh\":0,"
             "\"translation\":[0,"
             "0,3]},{\"mesh\":0,\"scale\":[2,2,2],\"extensions\":{\"EXT_x\":{},\"EXT_mesh_gpu_instancing\":{"
             "\"attributes\":{\"TRANSLATION\":0}}}}]," MESHES;
    import_told(of_another, 1, false, 1,
                ": of its 2 scenes only scenes[0] is read; faces are missing: 1 of 2 faces, 2 of 2.5 m2");
    import_told(of_another, .1, false, 1, "faces are missing: 1 of 2 faces, 0.02 of 0.025 m2");
    import_told(of_another, 1, true, 1, "faces are missing: 1 of 2 faces, 80 % of the area");
    import_told(of_none, 1, false, 1,
                ": faces are missing, as their nodes are in no scene: 2 of 3 faces, 2.5 of 3 m2");
    import_told(of_instances, 1, false, 4, "EXT_x (of 3 of 4 faces, 6 of 6.5 m2)");
    /* Vertices that are sparse are the library's to read: they have no area that could be told. */
    static const char unknown[] = HEAD
        "\"scenes\":[{\"nodes\":[0]},{\"nodes\":[1]}],\"nodes\":[{\"mesh\":0},{\"mesh\":1}],\"meshes\":[{"
        "\"primitives\":[{\"attributes\":{\"POSITION\":0}}]},{\"primitives\":[{\"attributes\":{\"POSITION\":"
        "1}}]"
        "}],\"accessors\":[{\"bufferView\":0,\"componentType\":5126,\"count\":3,\"type\":\"VEC3\"},"
        "{\"bufferView\":0,\"componentType\":5126,\"count\":3,\"type\":\"VEC3\",\"sparse\":{\"count\":1,"
        "\"indices\":{\"bufferView\":0,\"componentType\":5121},\"values\":{\"bufferView\":0}}}],"
        "\"bufferViews\":[{\"buffer\":0,\"byteLength\":36}],\"buffers\":[{\"byteLength\":36,\"uri\":\"data:"
        "application/octet-stream;base64,AAAAAAAAAAAAAAAAAACAPwAAAAAAAAAAAAAAAAAAgD8AAAAA\"}]}";
    import_told(
        unknown, 1, false, 1,
        "1 of 2 faces, of an area that is not known: their vertices are compressed, sparse or missing");
#undef HEAD
#undef MESHES
}
END_TEST

/* The library reads on behind the bytes of a view. */
START_TEST(vertices_beyond_their_bytes_are_refused) {
    static const char head[] =
        "{\"asset\":{\"version\":\"2.0\"},\"scene\":0,\"scenes\":[{\"nodes\":[0]}],\"nodes\":[{\"mesh\":0}],"
        "\"meshes\":[{\"primitives\":[{\"attributes\":{\"POSITION\":0},\"indices\":1}]}],"
        "\"bufferViews\":[{\"buffer\":0,\"byteLength\":36},{\"buffer\":0,\"byteLength\":12,\"byteOffset\":24}"
        "],"
        "\"buffers\":[{\"byteLength\":36,\"uri\":\"data:application/octet-stream;base64,"
        "AAAAAAAAAAAAAAAAAACAPwAAAAAAAAAAAAAAAAAAgD8AAAAA\"}],\"accessors\":[";
    static const struct {
        const char *accessors, *says;
    } cases[] = {{"{\"bufferView\":0,\"componentType\":5126,\"count\":3,\"type\":\"VEC3\",\"byteOffset\":24},"
                  "{\"bufferView\":0,\"componentType\":5121,\"count\":3,\"type\":\"SCALAR\"}",
                  "accessors[0], POSITION of a mesh, reaches beyond"},
                 {"{\"bufferView\":0,\"componentType\":5126,\"count\":4,\"type\":\"VEC3\"},"
                  "{\"bufferView\":0,\"componentType\":5121,\"count\":3,\"type\":\"SCALAR\"}",
                  "accessors[0], POSITION of a mesh, reaches beyond"},
                 {"{\"bufferView\":0,\"componentType\":5126,\"count\":3,\"type\":\"VEC3\"},"
                  "{\"bufferView\":1,\"componentType\":5125,\"count\":6,\"type\":\"SCALAR\"}",
                  "accessors[1], indices of a mesh, reaches beyond"}};
    for (size_t k = 0; k < sizeof cases / sizeof *cases; k++) {
        const import_options options = import_plain();
        char path[256], text[2048];
        lam_error error = {0};
        mesh m = {0};
        snprintf(text, sizeof text, "%s%s]}", head, cases[k].accessors);
        file_write(folder, "beyond.gltf", text, path);
        ck_assert_int_eq(scene_import(path, &options, &m, NULL, &error), LAM_ERR_FORMAT);
        ck_assert_msg(strstr(error.message, cases[k].says) != NULL, "%s", error.message);
    }
}
END_TEST

/* Bones whose matrices are left out, which is allowed, made the library crash; shape keys count by their
 * weights. */
START_TEST(bones_shapes_and_lines_are_told) {
    static const char gltf[] =
        "{\"asset\":{\"version\":\"2.0\"},\"scene\":1,\"scenes\":[{\"nodes\":[0]},{\"nodes\":[0,1,2]}],"
        "\"skins\":[{"
        "\"joints\":[0]}],"
        "\"nodes\":[{\"mesh\":0,\"skin\":0},{\"mesh\":1,\"translation\":[0,0,3],\"weights\":[0,0.5]},"
        "{\"mesh\":1,\"translation\":[0,0,6]}],"
        "\"meshes\":[{\"primitives\":[{\"attributes\":{\"POSITION\":0}},{\"attributes\":{\"POSITION\":0},"
        "\"mode\":2}]},"
        "{\"weights\":[0,0],\"primitives\":[{\"attributes\":{\"POSITION\":0},\"targets\":[{\"POSITION\":0},{"
        "\"POSITION\":0}]}]}]," TRIANGLE "}";
    static const char *const told[] = {
        ": of its 2 scenes only scenes[1] is read, which has all faces",
        ": the bones of 1 mesh (skins) are left out: each stands as it was modelled",
        ": the shape keys of 1 mesh (targets) are left out: each has its basic shape",
        ": 1 primitive of lines or points is left out: no faces"};
    char path[256];
    import_report report;
    file_write(folder, "moved.gltf", gltf, path);
    mesh m = import_good(path, &report);
    ck_assert_uint_eq(m.n, 3);
    ck_assert_double_eq_tol(total_area(&m), 1.5, 1e-6);
    for (size_t k = 0; k < sizeof told / sizeof *told; k++)
        ck_assert_msg(strstr(report.warnings, told[k]) != NULL, "%s", report.warnings);
    mesh_free(&m);
}
END_TEST

int main(void) {
    Suite *suite = suite_create("import_gltf");
    TCase *tests = tcase_create("import_gltf");
    tcase_add_checked_fixture(tests, setup, teardown);
    tcase_add_test(tests, emission_is_luminance);
    tcase_add_test(tests, positions_may_be_integers);
    tcase_add_test(tests, extensions_that_are_not_read_are_named_with_their_faces);
    tcase_add_test(tests, faces_that_are_not_read_are_told_with_their_area);
    tcase_add_test(tests, vertices_beyond_their_bytes_are_refused);
    tcase_add_test(tests, bones_shapes_and_lines_are_told);
    suite_add_tcase(suite, tests);
    return suite_run(suite);
}
