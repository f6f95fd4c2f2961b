/* Means of images over polygons, and the textures of meshes that are refined, judged by clipping every pixel.
 */
#include "solver/base/random.h"
#include "solver/scene/import/picture_files.h"
#include "solver/scene/mesh_cells.h"
#include "solver/scene/texture.h"
#include "support/scene.h"
#include "support/suite.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

/* Freed by the caller; a seed gives noise with some black and some white rows. */
static texture_image noise_make(size_t width, size_t height, uint64_t seed) {
    texture_image image = {.width = width, .height = height};
    image.pixels = calloc(width * height, sizeof *image.pixels);
    ck_assert_ptr_nonnull(image.pixels);
    for (size_t k = 0; k < width * height; k++)
        for (int c = 0; c < 3; c++)
            image.pixels[k][c] = (uint8_t)(k / width % 5 == 0   ? 0
                                           : k / width % 5 == 1 ? 255
                                                                : random_next(&seed) >> 56);
    return image;
}

/* IEC 61966-2-1. */
static double decoded(unsigned level) {
    const double x = level / 255.;
    return x <= .04045 ? x / 12.92 : pow((x + .055) / 1.055, 2.4);
}

/* The part of a polygon on one side of a line along an axis. */
static size_t clip(double (*p)[2], size_t n, int axis, double at, double side) {
    double out[12][2];
    size_t m = 0;
    for (size_t i = 0; i < n; i++) {
        const double *a = p[i], *b = p[(i + 1) % n];
        const double da = side * (a[axis] - at), db = side * (b[axis] - at);
        if (da >= 0) memcpy(out[m++], a, sizeof *out);
        if ((da > 0 && db < 0) || (da < 0 && db > 0)) {
            const double t = da / (da - db);
            for (int k = 0; k < 2; k++) out[m][k] = a[k] + t * (b[k] - a[k]);
            out[m++][axis] = at;
        }
    }
    memcpy(p, out, m * sizeof *out);
    return m;
}

static double area_of(const double (*p)[2], size_t n) {
    double doubled = 0;
    for (size_t i = 1; i + 1 < n; i++)
        doubled +=
            (p[i][0] - p[0][0]) * (p[i + 1][1] - p[0][1]) - (p[i][1] - p[0][1]) * (p[i + 1][0] - p[0][0]);
    return fabs(doubled) / 2;
}

/* The index of the pixel at a whole number, one step at a time. */
static size_t pixel_at(long at, long n, texture_wrap wrap) {
    if (wrap == TEXTURE_CLAMP) return (size_t)(at < 0 ? 0 : at >= n ? n - 1 : at);
    const long period = wrap == TEXTURE_MIRROR ? 2 * n : n;
    while (at < 0) at += period;
    while (at >= period) at -= period;
    return (size_t)(at < n ? at : period - 1 - at);
}

/* The mean that all others are judged by: every pixel's square is clipped to the polygon. */
static void mean_by_clipping(const texture_image *image, const texture_wrap wrap[2], size_t n,
                             const double (*uv)[2], double mean[3]) {
    double p[4][2], low[2] = {HUGE_VAL, HUGE_VAL}, high[2] = {-HUGE_VAL, -HUGE_VAL}, whole = 0;
    for (size_t i = 0; i < n; i++)
        for (int k = 0; k < 2; k++) {
            p[i][k] = uv[i][k] * (double)(k == 0 ? image->width : image->height);
            low[k] = fmin(low[k], p[i][k]), high[k] = fmax(high[k], p[i][k]);
        }
    memset(mean, 0, 3 * sizeof *mean);
    for (long y = (long)floor(low[1]); (double)y < high[1]; y++)
        for (long x = (long)floor(low[0]); (double)x < high[0]; x++) {
            double part[12][2];
            memcpy(part, p, n * sizeof *p);
            size_t m = clip(part, n, 0, (double)x, 1);
            m = clip(part, m, 0, (double)x + 1, -1);
            m = clip(part, m, 1, (double)y, 1);
            m = clip(part, m, 1, (double)y + 1, -1);
            const double area = m < 3 ? 0 : area_of((const double(*)[2])part, m);
            const size_t row = pixel_at(y, (long)image->height, wrap[1]);
            const uint8_t *pixel =
                image->pixels[row * image->width + pixel_at(x, (long)image->width, wrap[0])];
            for (int c = 0; c < 3; c++) mean[c] += area * decoded(pixel[c]);
            whole += area;
        }
    for (int c = 0; c < 3; c++) mean[c] /= whole;
}

/* A pixel is kept to 2^-20 of white and better; the rest is rounding of doubles. */
static const double tolerance = 2e-6;

/* Triangles and quads of all sizes from a tenth of a pixel to four periods, in both turns, in all nine pairs
 * of continuations, on images of odd sizes and of one pixel's width. */
START_TEST(means_are_those_of_clipped_pixels) {
    static const size_t sizes[][2] = {{16, 16}, {7, 5}, {1, 9}, {13, 1}, {33, 20}};
    uint64_t seed = 1000 + (uint64_t)_i;
    const texture_wrap wrap[2] = {(texture_wrap)(_i % 3), (texture_wrap)(_i / 3)};
    for (size_t s = 0; s < sizeof sizes / sizeof *sizes; s++) {
        texture_image image = noise_make(sizes[s][0], sizes[s][1], seed);
        texture_table *table = NULL;
        lam_error error = {0};
        ck_assert_int_eq(texture_table_create(&image, &table, &error), LAM_OK);
        for (int k = 0; k < 200; k++) {
            const size_t n = 3 + (size_t)(k % 2);
            const double size = pow(10, random_between(&seed, -2.5, .6));
            const double centre[2] = {random_between(&seed, -3, 3), random_between(&seed, -3, 3)};
            const double turn = random_between(&seed, 0, 6.3), way = k % 4 < 2 ? 1 : -1;
            const double aspect = random_between(&seed, .05, 1);
            double uv[4][2], mean[3], truth[3];
            for (size_t i = 0; i < n; i++) {
                const double a = way * 2 * M_PI * (double)i / (double)n + .3;
                const double x = size * cos(a), y = size * aspect * sin(a);
                uv[i][0] = centre[0] + x * cos(turn) - y * sin(turn);
                uv[i][1] = centre[1] + x * sin(turn) + y * cos(turn);
                if (k % 7 == 0) /* whole pixels */
                    for (int d = 0; d < 2; d++)
                        uv[i][d] = round(uv[i][d] * (double)sizes[s][d]) / (double)sizes[s][d];
            }
            if (area_of((const double(*)[2])uv, n) < 1e-9) continue;
            mean_by_clipping(&image, wrap, n, (const double(*)[2])uv, truth);
            texture_table_mean(table, wrap, n, (const double(*)[2])uv, mean);
            for (int c = 0; c < 3; c++)
                ck_assert_msg(fabs(mean[c] - truth[c]) <= tolerance,
                              "wrap %d %d, image %zu, polygon %d: %g, must be %g", _i % 3, _i / 3, s, k,
                              mean[c], truth[c]);
        }
        texture_table_free(table);
        free(image.pixels);
    }
}
END_TEST

/* An image that lies in a point or on a line; one that is repeated 10,000 times; a decal far outside. */
START_TEST(degenerate_and_huge_maps_have_means) {
    texture_image image = noise_make(16, 16, 7);
    texture_table *table = NULL;
    lam_error error = {0};
    const texture_wrap repeat[2] = {TEXTURE_REPEAT, TEXTURE_REPEAT},
                       clamp[2] = {TEXTURE_CLAMP, TEXTURE_CLAMP};
    const double point[3][2] = {{.5 / 16, 3.5 / 16}, {.5 / 16, 3.5 / 16}, {.5 / 16, 3.5 / 16}};
    const double line[4][2] = {{0, 3.5 / 16}, {1, 3.5 / 16}, {1, 3.5 / 16}, {0, 3.5 / 16}};
    const double whole[4][2] = {{0, 0}, {1, 0}, {1, 1}, {0, 1}};
    const double large[4][2] = {{.3, .2}, {10000, 1}, {9990, 10000.7}, {-20, 9000}};
    const double far[3][2] = {{-1e6, -1e6}, {-1e6, -2e6}, {-3e6, -1e6}};
    double mean[3], all[3];
    ck_assert_int_eq(texture_table_create(&image, &table, &error), LAM_OK);
    texture_table_mean(table, repeat, 3, point, mean);
    for (int c = 0; c < 3; c++) ck_assert_double_eq_tol(mean[c], decoded(image.pixels[3 * 16][c]), tolerance);
    texture_table_mean(table, repeat, 4, line, mean);
    for (int c = 0; c < 3; c++) {
        double sum = 0;
        for (int x = 0; x < 16; x++) sum += decoded(image.pixels[3 * 16 + x][c]) / 16;
        ck_assert_double_eq_tol(mean[c], sum, tolerance);
    }
    mean_by_clipping(&image, repeat, 4, whole, all);
    /* The border's pixels are one in 10,000 of the polygon's; sampled, they count a few times as much. */
    texture_table_mean(table, repeat, 4, large, mean);
    for (int c = 0; c < 3; c++) ck_assert_double_eq_tol(mean[c], all[c], 1e-3);
    texture_table_mean(table, clamp, 3, far, mean);
    for (int c = 0; c < 3; c++) ck_assert_double_eq_tol(mean[c], decoded(image.pixels[0][c]), tolerance);
    texture_table_free(table);
    free(image.pixels);
}
END_TEST

/* A triangle and a rectangle in space, far from the origin, with one image over both and a colour that runs
 * from corner to corner. */
static mesh textured_mesh(void) {
    static const double corners[7][3] = {{0, 0, 0}, {2, 0, 1}, {2, 3, 1}, {0, 3, 0},
                                         {5, 5, 5}, {6, 5, 5}, {5, 7, 6}};
    static const double uv[7][2] = {{0, 0}, {1.5, 0}, {1.5, 1}, {0, 1}, {-.3, .2}, {.6, .1}, {.2, 1.4}};
    static const double colours[7] = {1, .5, .5, 1, .2, .8, .6};
    static const uint32_t elements[2][4] = {{0, 1, 2, 3}, {4, 5, 6, MESH_NO_VERTEX}};
    lam_error error = {0};
    mesh m = {.n = 2, .n_vertices = 7, .n_groups = 1, .n_channels = 3, .unit = 1, .up = 'z'};
    m.vertices = calloc(7, sizeof *m.vertices);
    m.elements = calloc(2, sizeof *m.elements);
    m.group = calloc(2, sizeof *m.group);
    m.reflectance = calloc(6, sizeof *m.reflectance);
    m.emission = calloc(6, sizeof *m.emission);
    m.group_names = calloc(1, sizeof *m.group_names + 1);
    m.textured_face = calloc(2, sizeof *m.textured_face);
    m.group_names[0] = (char *)(m.group_names + 1);
    memcpy(m.vertices, corners, sizeof corners);
    for (int v = 0; v < 7; v++) m.vertices[v][0] += 1e5;
    memcpy(m.elements, elements, sizeof elements);
    mesh_textures *t = calloc(1, sizeof *t);
    t->n_images = t->n_surfaces = 1, t->n_faces = 2, t->largest = .9999;
    t->images = calloc(1, sizeof *t->images);
    t->surfaces = calloc(1, sizeof *t->surfaces);
    t->faces = calloc(2, sizeof *t->faces);
    t->images[0] = noise_make(24, 18, 5);
    for (int q = 0; q < TEXTURE_QUANTITIES; q++)
        for (int c = 0; c < 3; c++) t->surfaces[0].factor[q][c] = q == TEXTURE_REFLECTANCE ? .9 : 40;
    for (uint32_t f = 0; f < 2; f++) {
        const size_t n = 4 - f;
        double p[4][3];
        for (size_t k = 0; k < n; k++) memcpy(p[k], m.vertices[4 * f + k], sizeof p[k]);
        memcpy(t->faces[f].origin, p[0], sizeof p[0]);
        for (int q = 0; q < TEXTURE_QUANTITIES; q++)
            for (int d = 0; d < 2; d++)
                texture_affine(n, (const double(*)[3])p, &uv[4 * f][d], 2, t->faces[f].uv[q][d]);
        for (int c = 0; c < 3; c++)
            texture_affine(n, (const double(*)[3])p, &colours[4 * f], 1, t->faces[f].colour[c]);
        m.textured_face[f] = f;
    }
    ck_assert(texture_is_affine((const double(*)[3])m.vertices, &uv[0][0], 2));
    mesh_textures_hold(&m, t);
    ck_assert_int_eq(mesh_measure(&m, &error), LAM_OK);
    ck_assert_int_eq(mesh_textures_apply(&m, &error), LAM_OK);
    return m;
}

/* The emission of all elements of a face, which has no colour, adds up to the face's; reflectances are the
 * product of both means. Cells, backs and elements that others left behind keep their maps. */
START_TEST(parts_of_faces_add_up) {
    mesh coarse = textured_mesh(), m = textured_mesh(), cells = {0};
    const mesh_refinement how = {.subdivide_levels = 3};
    lam_error error = {0};
    double power[2] = {0, 0};
    static const double square[4][2] = {{0, 0}, {1.5, 0}, {1.5, 1}, {0, 1}};
    double truth[3];
    mean_by_clipping(&coarse.textures->images[0], coarse.textures->surfaces[0].wrap[0], 4, square, truth);
    ck_assert_double_eq_tol(coarse.emission[0] / 40, truth[0], tolerance);
    ck_assert_double_eq_tol(coarse.reflectance[0] / (.9 * .75), truth[0], tolerance);
    ck_assert_int_eq(mesh_refine(&m, &how, &error), LAM_OK);
    ck_assert_uint_eq(m.n, 128);
    for (size_t i = 0; i < m.n; i++) power[i / 64] += m.area[i] * (double)m.emission[i];
    for (size_t f = 0; f < 2; f++)
        ck_assert_double_eq_tol(power[f] / (coarse.area[f] * (double)coarse.emission[f]), 1, 1e-5);
    ck_assert_float_ne(m.emission[0], m.emission[1]);

    bool dropped[256] = {false};
    const float kept = m.emission[77];
    for (size_t i = 0; i < 77; i++) dropped[i] = true;
    ck_assert_int_eq(mesh_drop(&m, dropped, &error), LAM_OK);
    ck_assert_int_eq(mesh_make_two_sided(&m, &error), LAM_OK);
    memset(m.emission, 0, m.n * 3 * sizeof *m.emission);
    ck_assert_int_eq(mesh_textures_apply(&m, &error), LAM_OK);
    ck_assert_float_eq_tol(m.emission[0], kept, 1e-5f);
    ck_assert_float_eq_tol(m.emission[m.n / 2], kept, 1e-5f);

    mesh_cell halves[3] = {mesh_cell_of(&coarse, 0), mesh_cell_of(&coarse, 0), mesh_cell_of(&coarse, 1)};
    const mesh_cell whole = halves[0];
    ck_assert(mesh_cell_halve(&whole, 0, halves));
    ck_assert_int_eq(mesh_of_cells(&coarse, 3, halves, &cells, &error), LAM_OK);
    ck_assert_uint_eq(coarse.textures->holders, 2);
    ck_assert_float_eq_tol(cells.emission[2], coarse.emission[1], 1e-5f);
    ck_assert_float_eq_tol((cells.emission[0] + cells.emission[1]) / 2, coarse.emission[0], 1e-5f);
    mesh_textures_release(&coarse);
    ck_assert_int_eq(mesh_textures_apply(&cells, &error), LAM_OK);
    mesh_free(&cells);
    mesh_free(&coarse);
    mesh_free(&m);
}
END_TEST

/* Saves the mesh under another state of its pictures; the reader must say so, or *loaded is filled. */
static void save_and_load(const mesh *m, const char *path, const char *says, mesh *loaded) {
    lam_error error = {0};
    store *s = NULL;
    ck_assert_int_eq(store_create(path, &s, &error), LAM_OK);
    ck_assert_msg(mesh_save(m, NULL, s, &error) == LAM_OK, "%s", error.message);
    ck_assert_msg(store_seal(s, &error) == LAM_OK, "%s", error.message);
    ck_assert_int_eq(store_open(path, &s, &error), LAM_OK);
    const lam_status status = mesh_load(s, loaded, NULL, &error);
    store_close(s);
    if (says == NULL) {
        ck_assert_msg(status == LAM_OK, "%s", error.message);
        return;
    }
    ck_assert_int_eq(status, LAM_ERR_FORMAT);
    ck_assert_msg(strstr(error.message, says) != NULL, "%s", error.message);
}

START_TEST(stores_keep_pictures) {
    char folder[64], path[256];
    mesh m = textured_mesh(), loaded = {0};
    lam_error error = {0};
    folder_make(folder);
    snprintf(path, sizeof path, "%s/a.h5", folder);
    strcpy(m.source_hash, "0");
    ck_assert_int_eq(mesh_keep_pictures(&m, &error), LAM_OK);
    ck_assert_ptr_null(m.textures);
    scene_pictures *p = m.pictures;
    ck_assert_ptr_nonnull(p);
    ck_assert_uint_eq(p->n_surfaces, 1);
    ck_assert_uint_eq(p->n_files, 1);
    ck_assert_float_eq_tol(p->texcoord[1][2][1], 1.4f, 1e-5f);
    save_and_load(&m, path, NULL, &loaded);
    ck_assert_int_eq(memcmp(loaded.pictures->texcoord, p->texcoord, m.n * sizeof *p->texcoord), 0);
    ck_assert_int_eq(memcmp(loaded.pictures->surfaces, p->surfaces, sizeof *p->surfaces), 0);
    ck_assert_int_eq(memcmp(loaded.pictures->bytes, p->bytes, p->start[1]), 0);
    mesh_free(&loaded);
    const scene_pictures sound = *p;
    const struct picture_surface surface = p->surfaces[0];
    p->surface[1] = 1;
    save_and_load(&m, path, "/mesh/surface[1] = 1, there are 1 surfaces", &loaded);
    p->surface[1] = 0;
    p->texcoord[1][2][0] = INFINITY;
    save_and_load(&m, path, "/mesh/texcoord[1][2][0] = inf, must be finite", &loaded);
    p->texcoord[1][2][0] = 0;
    p->surfaces[0].file = 1;
    save_and_load(&m, path, "/mesh/surface_image[0] = 1, 0, 0, there are 1 images", &loaded);
    p->surfaces[0] = surface;
    p->surfaces[0].wrap[1] = 3;
    save_and_load(&m, path, "/mesh/surface_image[0] = 0, 0, 3, ", &loaded);
    p->surfaces[0] = surface;
    p->surfaces[0].factor[2] = NAN;
    save_and_load(&m, path, "/mesh/surface_factor[0][2] = ", &loaded);
    p->surfaces[0] = surface;
    p->start[0] = 1;
    save_and_load(&m, path, "/mesh/image_start[0] = 1, must ascend from 0", &loaded);
    p->start[0] = 0;
    p->n_files = 0;
    save_and_load(&m, path, "/mesh/image_start must end with", &loaded);
    *p = sound;
    save_and_load(&m, path, NULL, &loaded);
    mesh_free(&loaded);
    mesh_free(&m);
    folder_remove(folder);
}
END_TEST

START_TEST(quads_that_are_not_affine_are_known) {
    static const double p[4][3] = {{0, 0, 0}, {2, 0, 0}, {2, 1, 0}, {0, 1, 0}};
    const double straight[4] = {0, 1, 1, 0}, bent[4] = {0, 1, .9, 0}, constant[4] = {3, 3, 3, 3};
    ck_assert(texture_is_affine(p, straight, 1));
    ck_assert(!texture_is_affine(p, bent, 1));
    ck_assert(texture_is_affine(p, constant, 1));
}
END_TEST

int main(void) {
    Suite *suite = suite_create("texture");
    TCase *tests = tcase_create("texture");
    tcase_add_loop_test(tests, means_are_those_of_clipped_pixels, 0, 9);
    tcase_add_test(tests, degenerate_and_huge_maps_have_means);
    tcase_add_test(tests, parts_of_faces_add_up);
    tcase_add_test(tests, stores_keep_pictures);
    tcase_add_test(tests, quads_that_are_not_affine_are_known);
    suite_add_tcase(suite, tests);
    return suite_run(suite);
}
