/* Imports files of other programs, whole, broken and damaged. */
#include "support/suite.h"

#include "solver/scene/import/gltf_file.h"
#include "support/scene.h"

#include <dirent.h>
#include <sys/stat.h>

/* A folder that each test has to itself. */
static char folder[64];

static void setup(void) {
    folder_make(folder);
}

static void teardown(void) {
    folder_remove(folder);
}

/* An imported mesh is sound; a refusal is one line that names the file. */
static void assert_loads_or_refuses(const char *path) {
    const import_options options = import_plain();
    mesh m = {0};
    lam_error error = {0};
    const lam_status status = scene_import(path, &options, &m, NULL, &error);
    if (status != LAM_OK) {
        ck_assert_msg(status == LAM_ERR_FORMAT, "%s: status %d", error.message, (int)status);
        ck_assert_msg(strstr(error.message, path) != NULL && strchr(error.message, '\n') == NULL, "%s",
                      error.message);
        ck_assert_msg(strstr(error.message, "crashed") == NULL && strstr(error.message, "answer") == NULL,
                      "%s", error.message);
        return;
    }
    ck_assert_uint_gt(m.n, 0);
    for (size_t i = 0; i < m.n; i++) {
        ck_assert(m.area[i] > 0 && isfinite(m.area[i]));
        ck_assert_uint_lt(m.group[i], m.n_groups);
        for (size_t k = 0; k < 4; k++)
            ck_assert(m.elements[i][k] < m.n_vertices || (k == 3 && m.elements[i][k] == MESH_NO_VERTEX));
    }
    for (size_t i = 0; i < m.n * m.n_channels; i++) {
        ck_assert(m.reflectance[i] >= 0 && m.reflectance[i] < 1);
        ck_assert(m.emission[i] >= 0 && isfinite(m.emission[i]));
    }
    mesh_free(&m);
}

static size_t visit_files(const char *path) {
    size_t n = 0;
    DIR *entries = opendir(path);
    ck_assert_ptr_nonnull(entries);
    for (struct dirent *entry; (entry = readdir(entries)) != NULL;) {
        char full[1024];
        struct stat about;
        if (entry->d_name[0] == '.') continue;
        snprintf(full, sizeof full, "%s/%s", path, entry->d_name);
        ck_assert_int_eq(stat(full, &about), 0);
        if (S_ISDIR(about.st_mode))
            n += visit_files(full);
        else
            assert_loads_or_refuses(full), n++;
    }
    closedir(entries);
    return n;
}

START_TEST(every_odd_file_loads_or_is_refused) {
    const char *const folders[] = {FIXTURES "/obj-odd", FIXTURES "/gltf-odd", FIXTURES "/meshes"};
    const size_t at_least[] = {70, 20, 12};
    ck_assert_uint_ge(visit_files(folders[_i]), at_least[_i]);
}
END_TEST

START_TEST(known_fixtures_have_their_sizes) {
    const struct {
        const char *name;
        size_t n;
        double area, tolerance;
        char up;
    } expected[] = {
        {"meshes/unit_cube.STL", 12, 6, 1e-6, 'z'},
        /* a sphere of 1,280 triangles: .5 % below 4 pi */
        {"meshes/unit_sphere.STL", 1280, 4 * M_PI, .08, 'z'},
        {"meshes/cube_blender_uv.ply", 6, 6, 1e-6, 'z'},
        /* a regular tetrahedron would differ; this one has 4 faces of area sqrt(5) */
        {"meshes/tet.ply", 4, 4 * sqrt(5), 1e-6, 'z'},
        {"meshes/BoxInterleaved.glb", 12, 6, 1e-6, 'y'},
        {"meshes/cube.glb", 12, 24, 1e-4, 'y'},       /* whose chunks lack their padding */
        {"meshes/cube-draco.glb", 12, 24, 1e-3, 'y'}, /* the same by draco_transcoder: 11 bits a coordinate */
        {"meshes/cube-quantized.glb", 12, 24, 1e-3, 'y'}, /* and by gltfpack: 14 bits */
        {"meshes/no_indices_3storybuilding.glb", 72, 12527.6824, .01, 'y'},
        {"gltf-odd/box01.glb", 12, 6, 1e-6, 'y'},
        {"gltf-odd/Cube/Cube.gltf", 12, 24, 1e-4, 'y'},
        {"obj-odd/cube.obj", 6, 24, 1e-12, 'z'},
        {"obj-odd/issue-295-trianguation-failure.obj", 14, 14, 1e-9, 'z'},
    };
    for (size_t i = 0; i < sizeof expected / sizeof *expected; i++) {
        mesh m = {0};
        import_report report;
        lam_error error = {0};
        ck_assert_msg(import_fixture(expected[i].name, &m, &report, &error) == LAM_OK, "%s", error.message);
        ck_assert_uint_eq(m.n, expected[i].n);
        ck_assert_double_eq_tol(total_area(&m), expected[i].area, expected[i].tolerance);
        ck_assert_int_eq(m.up, expected[i].up);
        mesh_free(&m);
    }
}
END_TEST

START_TEST(broken_fixtures_are_refused) {
    const struct {
        const char *name, *says;
    } expected[] = {
        {"obj-odd/test-nan.obj", "test-nan.obj:12: vertex coordinate nan"},
        {"obj-odd/issue-140-zero-face-idx.obj", "obj:16: vertex index 0"},
        {"obj-odd/invalid-relative-vertex-index.obj", "obj:1: vertex index -4"},
        {"obj-odd/invalid-relative-texture-index.obj", "refers to vertex 1, there are 0"},
        {"obj-odd/invalid-face-definition.obj", "scene is empty"},
        {"obj-odd/issue-244-mtl-searchpaths.obj", "obj:2: the material file 'issue-244.mtl' is missing"},
        {"obj-odd/points-prim.obj", "no faces"},
        {"obj-odd/line-prim.obj", "no faces"},
        {"gltf-odd/BoundsChecking/integer-out-of-bounds.gltf", "out of range"},
        {"gltf-odd/BoundsChecking/invalid-buffer-index.gltf", "not a scene that can be read"},
        {"gltf-odd/issue-416.gltf", "not a scene that can be read"},
        {"gltf-odd/issue-492.glb", "no faces"},
        {"gltf-odd/ORIGIN.md", "not a scene that can be read"},
    };
    for (size_t i = 0; i < sizeof expected / sizeof *expected; i++) {
        mesh m = {0};
        lam_error error = {0};
        ck_assert_int_eq(import_fixture(expected[i].name, &m, NULL, &error), LAM_ERR_FORMAT);
        ck_assert_msg(strstr(error.message, expected[i].says) != NULL, "%s", error.message);
    }
}
END_TEST

/* The cube by `gltfpack -c -kn`, with one text or byte of the file replaced by another of its length. */
static lam_status import_packed(size_t at, const char *text, const char *by, mesh *m, lam_error *error) {
    char bytes[4096], path[256];
    const import_options options = import_plain();
    FILE *file = fopen(FIXTURES "/meshes/cube-meshopt.glb", "rb");
    ck_assert_ptr_nonnull(file);
    const size_t length = fread(bytes, 1, sizeof bytes, file);
    fclose(file);
    char *place = text != NULL ? memmem(bytes, length, text, strlen(text)) : bytes + (length - at);
    ck_assert_ptr_nonnull(place);
    if (text != NULL)
        memcpy(place, by, strlen(by));
    else if (at > 0)
        *place ^= 0x55;
    snprintf(path, sizeof path, "%s/packed.glb", folder);
    file = fopen(path, "wb");
    ck_assert_uint_eq(fwrite(bytes, 1, length, file), length);
    fclose(file);
    return scene_import(path, &options, m, NULL, error);
}

/* Compressed views are read where the library is there, and else refused by name; views that the format does
 * not have, or whose bytes are damaged, are refused with their number. */
START_TEST(compressed_views_are_read_or_refused) {
    static const char *const wrong[][3] = {
        {"\"byteLength\":75,", "\"byteLength\":99,", "bufferViews[0] is compressed"},
        {"\"byteLength\":75,", "\"byteLength\":5 ,", "bufferViews[0] is compressed"},
        {"\"byteStride\":8,\"mode", "\"byteStride\":6,\"mode", "way that the format does not have"},
        {"\"ATTRIBUTES\"", "\"ATTRIBUTED\"", "way that the format does not have"},
        {"\"count\":8}", "\"count\":-}", "packed.glb"},
        {"\"count\":36}", "\"count\":35}", "bufferViews[1] is compressed"},
        {"\"count\":36}", "\"count\":3e}", "packed.glb"},
        {"\"extensionsRequired\"", "\"extensionsInquired\"", NULL},
    };
    mesh m = {0};
    lam_error error = {0};
    if (!gltf_reads_meshopt()) {
        ck_assert_int_eq(import_packed(0, NULL, NULL, &m, &error), LAM_ERR_FORMAT);
        ck_assert_ptr_nonnull(strstr(error.message, "by a build without libmeshoptimizer"));
        return;
    }
    ck_assert_msg(import_packed(0, NULL, NULL, &m, &error) == LAM_OK, "%s", error.message);
    ck_assert_uint_eq(m.n, 12);
    ck_assert_double_eq_tol(total_area(&m), 24, 1e-3);
    mesh_free(&m);
    for (size_t k = 0; k < sizeof wrong / sizeof *wrong; k++) {
        const lam_status status = import_packed(0, wrong[k][0], wrong[k][1], &m, &error);
        ck_assert_msg(status == (wrong[k][2] != NULL ? LAM_ERR_FORMAT : LAM_OK), "%s", error.message);
        if (wrong[k][2] != NULL)
            ck_assert_msg(strstr(error.message, wrong[k][2]) != NULL, "%s", error.message);
        mesh_free(&m);
    }
    /* Each byte of the chunk by itself: it is refused, or makes some mesh. */
    for (size_t at = 1; at <= 108; at += 3) {
        if (import_packed(at, NULL, NULL, &m, &error) != LAM_OK)
            ck_assert_ptr_nonnull(strstr(error.message, "packed.glb"));
        mesh_free(&m);
    }
}
END_TEST

START_TEST(damaged_files_never_hurt) {
    const char *const names[] = {"meshes/BoxInterleaved.glb", "meshes/cube.glb",  "meshes/tet.ply",
                                 "meshes/unit_cube.STL",      "obj-odd/cube.obj", "gltf-odd/Cube/Cube.gltf"};
    const char *name = names[_i];
    static char bytes[8192], path[256];
    char source[512];
    unsigned state = 12345 + (unsigned)_i;
    snprintf(source, sizeof source, FIXTURES "/%s", name);
    FILE *file = fopen(source, "rb");
    ck_assert_ptr_nonnull(file);
    const size_t length = fread(bytes, 1, sizeof bytes, file);
    fclose(file);
    ck_assert_uint_gt(length, 100);
    for (int round = 0; round < 40; round++) {
        static char damaged[8192];
        memcpy(damaged, bytes, length);
        size_t kept = length;
        for (int k = 0; k < 1 + round % 4; k++) {
            state = state * 1664525u + 1013904223u;
            damaged[(state >> 8) % length] ^= (char)(1 << (state & 7));
        }
        if (round % 5 == 4) kept = (state >> 8) % length;
        snprintf(path, sizeof path, "%s/damaged%s", folder, strrchr(name, '.'));
        file = fopen(path, "wb");
        ck_assert_uint_eq(fwrite(damaged, 1, kept, file), kept);
        fclose(file);
        const import_options options = {.unit = 1, .reflectance = -1, .cpu_seconds = 5};
        mesh m = {0};
        lam_error error = {0};
        /* the library may crash on damaged input; the answer is one line all the same */
        if (scene_import(path, &options, &m, NULL, &error) != LAM_OK)
            ck_assert_msg(strstr(error.message, folder) != NULL, "%s", error.message);
        mesh_free(&m);
    }
}
END_TEST

int main(void) {
    Suite *suite = suite_create("import_files");
    TCase *tests = tcase_create("import_files");
    tcase_set_timeout(tests, 300);
    tcase_add_checked_fixture(tests, setup, teardown);
    tcase_add_loop_test(tests, every_odd_file_loads_or_is_refused, 0, 3);
    tcase_add_test(tests, known_fixtures_have_their_sizes);
    tcase_add_test(tests, broken_fixtures_are_refused);
    tcase_add_test(tests, compressed_views_are_read_or_refused);
    tcase_add_loop_test(tests, damaged_files_never_hurt, 0, 6);
    suite_add_tcase(suite, tests);
    return suite_run(suite);
}
