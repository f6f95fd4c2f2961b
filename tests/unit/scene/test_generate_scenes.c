/* Properties that all generated scenes of many surfaces have. */
#include "support/suite.h"

#include "solver/base/union_find.h"
#include "solver/formfactor/visibility/sample.h"
#include "solver/formfactor/visibility/visibility.h"
#include "support/scene.h"

typedef struct scene_kind {
    const char *name;
    size_t small, large; /* --elements */
    size_t usual;        /* without */
    bool closed, lamps;
    const char *sheets; /* the group whose faces lie back to back, or NULL */
} scene_kind;

static const scene_kind kinds[] = {
    {.name = "rooms", .small = 700, .large = 3000, .usual = 6000, .closed = true, .lamps = true},
    {.name = "anechoic", .small = 1000, .large = 3000, .usual = 6000, .closed = true, .lamps = true},
    {.name = "patio", .small = 3000, .large = 5000, .usual = 21888, .lamps = true},
    {.name = "atrium", .small = 4000, .large = 6000, .usual = 79232, .lamps = true},
    {.name = "maze", .small = 800, .large = 3000, .usual = 6000},
    {.name = "canopy", .small = 500, .large = 4000, .usual = 12000, .sheets = "leaf"},
};
enum { KINDS = sizeof kinds / sizeof *kinds };

static lam_error error;

static mesh scene(const char *kind, size_t elements, uint64_t seed) {
    const generate_options options = {.kind = kind, .elements = elements, .reflectance = -1, .seed = seed};
    char folder[64], path[256];
    import_report report;
    size_t faces = 0;
    folder_make(folder);
    snprintf(path, sizeof path, "%s/scene.obj", folder);
    const lam_status status = scene_generate(&options, path, &faces, &error);
    ck_assert_msg(status == LAM_OK, "%s", error.message);
    mesh m = import_good(path, &report);
    ck_assert_uint_eq(m.n, faces);
    ck_assert_uint_eq(report.dropped_faces, 0);
    ck_assert_str_eq(report.warnings, "");
    folder_remove(folder);
    return m;
}

START_TEST(it_has_the_elements_asked_for) {
    const scene_kind *kind = &kinds[_i];
    const size_t asked[] = {kind->small, kind->large, 0};
    for (int a = 0; a < 3; a++) {
        mesh m = scene(kind->name, asked[a], 1);
        const double wanted = (double)(asked[a] > 0 ? asked[a] : kind->usual);
        bool lamps = false;
        ck_assert_msg(fabs((double)m.n - wanted) <= .01 * wanted, "%s: %zu elements instead of %g",
                      kind->name, m.n, wanted);
        for (size_t i = 0; i < m.n; i++) {
            ck_assert(m.area[i] > 1e-7);
            for (size_t c = 0; c < m.n_channels; c++) {
                ck_assert(m.reflectance[c * m.n + i] > .05f && m.reflectance[c * m.n + i] < .9f);
                lamps = lamps || m.emission[c * m.n + i] > 0;
            }
        }
        ck_assert_int_eq(lamps, kind->lamps);
        mesh_free(&m);
    }
}
END_TEST

/* The text of a generated scene; the caller frees. */
static char *scene_text(const char *kind, uint64_t seed, size_t *bytes) {
    const generate_options options = {.kind = kind, .elements = 1000, .reflectance = -1, .seed = seed};
    char folder[64], path[256], *text = NULL;
    folder_make(folder);
    snprintf(path, sizeof path, "%s/scene.obj", folder);
    ck_assert_int_eq(scene_generate(&options, path, NULL, &error), LAM_OK);
    FILE *file = fopen(path, "r"), *copy = open_memstream(&text, bytes);
    ck_assert(file != NULL && copy != NULL);
    for (int c = fgetc(file); c != EOF; c = fgetc(file)) fputc(c, copy);
    fclose(file);
    fclose(copy);
    folder_remove(folder);
    return text;
}

START_TEST(it_is_its_seed_s) {
    size_t a_bytes, same_bytes, other_bytes;
    const char *name = kinds[_i].name;
    char *a = scene_text(name, 7, &a_bytes), *same = scene_text(name, 7, &same_bytes),
         *other = scene_text(name, 8, &other_bytes);
    ck_assert_uint_eq(a_bytes, same_bytes);
    ck_assert_mem_eq(a, same, a_bytes);
    const bool seeded =
        strcmp(name, "rooms") == 0 || strcmp(name, "maze") == 0 || strcmp(name, "canopy") == 0;
    ck_assert_int_eq(a_bytes != other_bytes || memcmp(a, other, a_bytes) != 0, seeded);
    free(a);
    free(same);
    free(other);
}
END_TEST

START_TEST(it_takes_a_reflectance) {
    const generate_options options = {
        .kind = kinds[_i].name, .elements = 1000, .reflectance = .25, .seed = 1};
    char folder[64], path[256];
    import_report report;
    folder_make(folder);
    snprintf(path, sizeof path, "%s/scene.obj", folder);
    ck_assert_int_eq(scene_generate(&options, path, NULL, &error), LAM_OK);
    mesh m = import_good(path, &report);
    ck_assert_uint_eq(m.n_channels, 1);
    for (size_t i = 0; i < m.n; i++) ck_assert(m.reflectance[i] == .25f);
    folder_remove(folder);
    mesh_free(&m);
}
END_TEST

/* Twice the area of the triangle abp times the cosine of its normal to n. */
static double turn(const double *a, const double *b, const double *p, const float *n) {
    double sum = 0;
    for (int d = 0; d < 3; d++) {
        const int e = (d + 1) % 3, f = (d + 2) % 3;
        sum += (double)n[d] * ((b[e] - a[e]) * (p[f] - a[f]) - (b[f] - a[f]) * (p[e] - a[e]));
    }
    return sum;
}

/* True where a point lies in an element, to within a hundredth of a millimetre off its plane and not on its
 * border. */
static bool is_in(const mesh *m, size_t i, const double p[3]) {
    const double *first = m->vertices[m->elements[i][0]];
    double off = 0;
    for (int d = 0; d < 3; d++) off += (double)m->normal[i][d] * (p[d] - first[d]);
    if (fabs(off) > 1e-5) return false;
    for (size_t k = 0, n = mesh_corners(m, i); k < n; k++)
        if (turn(m->vertices[m->elements[i][k]], m->vertices[m->elements[i][(k + 1) % n]], p, m->normal[i]) <
            1e-9)
            return false;
    return true;
}

/* Elements of one plane: neither facing the same way nor, but for sheets, back to back. */
START_TEST(no_two_faces_lie_on_one_another) {
    mesh m = scene(kinds[_i].name, kinds[_i].large, 3);
    const size_t sheets = kinds[_i].sheets == NULL ? m.n_groups : group_find(&m, kinds[_i].sheets);
    size_t backs = 0;
    for (size_t i = 0; i < m.n; i++) {
        double p[3];
        mesh_centroid(&m, i, p);
        ck_assert(is_in(&m, i, p));
        for (size_t j = 0; j < m.n; j++) {
            float cosine = 0;
            for (int d = 0; d < 3; d++) cosine += m.normal[i][d] * m.normal[j][d];
            if (j == i || fabsf(cosine) < 1 - 1e-6f || !is_in(&m, j, p)) continue;
            ck_assert_msg(cosine < 0 && m.group[i] == sheets && m.group[j] == sheets,
                          "%s: elements %zu and %zu overlap at %g,%g,%g", kinds[_i].name, i, j, p[0], p[1],
                          p[2]);
            backs++;
        }
    }
    if (kinds[_i].sheets != NULL) ck_assert_uint_gt(backs, m.n / 2);
    mesh_free(&m);
}
END_TEST

/* The surface has no gaps but those below and around an open scene, whose sides are alike: the integral of
 * the front's normal over it is 0, or the area that is open below. A face too many or missing would change
 * it. */
START_TEST(the_surface_has_no_gaps) {
    mesh m = scene(kinds[_i].name, kinds[_i].large, 4);
    const size_t sheets = kinds[_i].sheets == NULL ? m.n_groups : group_find(&m, kinds[_i].sheets);
    double sum[3] = {0}, low[2] = {HUGE_VAL, HUGE_VAL}, high[2] = {-HUGE_VAL, -HUGE_VAL};
    for (size_t i = 0; i < m.n; i++) {
        for (int d = 0; d < 3; d++) sum[d] += m.area[i] * (double)m.normal[i][d];
        for (size_t k = 0; k < mesh_corners(&m, i) && m.group[i] != sheets; k++)
            for (int d = 0; d < 2; d++) {
                low[d] = fmin(low[d], m.vertices[m.elements[i][k]][d]);
                high[d] = fmax(high[d], m.vertices[m.elements[i][k]][d]);
            }
    }
    const double site = (high[0] - low[0]) * (high[1] - low[1]);
    const double tolerance = 1e-7 * total_area(&m); /* a normal is a float */
    for (int d = 0; d < 3; d++)
        ck_assert_double_eq_tol(sum[d], d == 2 && !kinds[_i].closed ? site : 0, tolerance);
    mesh_free(&m);
}
END_TEST

/* The fate of rays from every element. */
typedef struct tally {
    size_t all, gone, backs;
    size_t far;   /* share of rays that meet something 8 m away or more, from above */
    size_t parts; /* parts between which no light goes, over any number of bounces; elements that see only the
                     sky do not count */
} tally;

static tally cast_from_all(const mesh *m, size_t rays, uint64_t seed) {
    tally t = {0};
    visibility *v;
    uint32_t *joined = malloc(m->n * sizeof *joined);
    bool *sees = calloc(m->n, sizeof *sees);
    ck_assert(joined != NULL && sees != NULL);
    for (uint32_t i = 0; i < m->n; i++) joined[i] = i;
    ck_assert_msg(visibility_create(m, &v, &error) == LAM_OK, "%s", error.message);
    for (uint32_t i = 0; i < m->n; i++) {
        element_sampler sampler;
        uint32_t self[VISIBILITY_PACKET];
        double from[3], to[3];
        for (int k = 0; k < VISIBILITY_PACKET; k++) self[k] = i;
        mesh_centroid(m, i, from);
        element_sampler_init(&sampler, m, v, i, seed);
        for (size_t ray = 0; ray < rays; ray += VISIBILITY_PACKET) {
            ray_packet packet;
            hit_packet hits;
            element_sampler_packet(&sampler, (uint32_t)ray, &packet);
            visibility_cast(v, &packet, VISIBILITY_PACKET, self, 0, &hits);
            for (int k = 0; k < VISIBILITY_PACKET; k++) {
                const bool gone = hits.element[k] == VISIBILITY_NOTHING;
                t.all++;
                t.gone += gone;
                t.backs += hits.back[k];
                if (gone || hits.back[k]) continue;
                sees[i] = sees[hits.element[k]] = true;
                union_find_join(joined, i, hits.element[k]);
                mesh_centroid(m, hits.element[k], to);
                t.far += hypot(from[0] - to[0], from[1] - to[1]) > 8;
            }
        }
    }
    for (size_t i = 0; i < m->n; i++) t.parts += sees[i] && joined[i] == i;
    free(joined);
    free(sees);
    visibility_destroy(v);
    return t;
}

/* No ray meets a back face; in a closed scene none leaves, from an open one some do. */
START_TEST(rays_stay_on_the_lit_side) {
    mesh m = scene(kinds[_i].name, kinds[_i].large, 5);
    const tally t = cast_from_all(&m, 64, 3);
    ck_assert_uint_eq(t.backs, 0);
    if (kinds[_i].closed)
        ck_assert_uint_eq(t.gone, 0);
    else
        ck_assert_uint_gt(t.gone, m.n);
    ck_assert_uint_eq(t.parts, 1);
    mesh_free(&m);
}
END_TEST

/* Every room is connected to every other, but sees only itself; rooms come with the elements they need. */
START_TEST(rooms_are_joined_by_bent_corridors) {
    static const struct {
        size_t elements, fewest, most;
    } sizes[] = {{1500, 2, 2}, {6000, 4, 6}, {12000, 9, 12}};
    double all = 0, backs = 0;
    for (size_t k = 0; k < sizeof sizes / sizeof *sizes; k++) {
        size_t smallest = 12, largest = 0;
        for (uint64_t seed = 1; seed <= 8; seed++) {
            mesh m = scene("rooms", sizes[k].elements, seed);
            const tally t = cast_from_all(&m, 32, seed);
            size_t rooms = 0;
            for (size_t g = 0; g < m.n_groups; g++) rooms += strncmp(m.group_names[g], "lamp-", 5) == 0;
            smallest = rooms < smallest ? rooms : smallest;
            largest = rooms > largest ? rooms : largest;
            ck_assert_uint_eq(t.gone, 0);
            all += (double)t.all;
            backs += (double)t.backs;
            ck_assert_uint_eq(t.parts, 1);
            ck_assert_double_lt((double)t.far, .0024 * (double)t.all); /* straight ones: .0030 to .0045 */
            mesh_free(&m);
        }
        ck_assert_uint_eq(smallest, sizes[k].fewest);
        ck_assert_uint_eq(largest, sizes[k].most);
    }
    /* A ray that begins within a rounding, 1e-6 m at some ten metres, of the seam of two walls may be behind
     * one of them; there are about two metres of seams to a square metre. Three deviations more. */
    ck_assert_double_le(backs, 2e-6 * all + 3 * sqrt(2e-6 * all));
}
END_TEST

/* The openings make a tree of the cells, and two lead outside: with fewer some cells could not be reached
 * (rays show it), with more there would be a cycle. */
START_TEST(maze_is_a_tree) {
    const size_t sizes[] = {0, 300, 2000, 20000};
    for (size_t s = 0; s < sizeof sizes / sizeof *sizes; s++) {
        mesh m = scene("maze", sizes[s], s);
        double side = 0;
        for (size_t v = 0; v < m.n_vertices; v++) side = fmax(side, m.vertices[v][0]);
        const double cells = round((side - .3) / 2.1), n = cells * cells;
        ck_assert_double_eq_tol(side, 2.1 * cells + .3, 1e-9);
        ck_assert_double_ge(cells, 3);
        ck_assert_double_eq_tol(group_area(&m, "floor", NULL), 1.8 * 1.8 * n + 1.8 * .3 * (n - 1 + 2),
                                1e-6 * n);
        ck_assert_double_eq_tol(group_area(&m, "floor", NULL) + group_area(&m, "wall-top", NULL), side * side,
                                1e-6 * n);
        ck_assert_uint_eq(cast_from_all(&m, 16, 1).parts, 1);
        mesh_free(&m);
    }
}
END_TEST

/* Four times as many elements are pyramids of half the width, each of sixteen as before. They fill the 6 m
 * between the tips at both ends, and are as high as wide, or the width that follows from their area would
 * differ. */
START_TEST(pyramids_grow_in_number) {
    double foot = 0;
    for (size_t elements = 1000; elements <= 16000; elements *= 4) {
        mesh m = scene("anechoic", elements, 1);
        size_t n;
        const double area = group_area(&m, "floor", &n); /* of a pyramid: 4 pitch^2 sqrt(5) / 4 */
        const double pitch = sqrt(area / sqrt(5) / ((double)n / 16));
        ck_assert_uint_eq(n % 16, 0);
        ck_assert_double_eq_tol(6 / pitch, round(6 / pitch), 1e-6);
        if (foot > 0) ck_assert_double_eq_tol(pitch, foot / 2, .25 * foot);
        foot = pitch;
        mesh_free(&m);
    }
}
END_TEST

int main(void) {
    Suite *suite = suite_create("generate_scenes");
    TCase *tests = tcase_create("generate_scenes");
    tcase_set_timeout(tests, 300);
    tcase_add_loop_test(tests, it_has_the_elements_asked_for, 0, KINDS);
    tcase_add_loop_test(tests, it_is_its_seed_s, 0, KINDS);
    tcase_add_loop_test(tests, it_takes_a_reflectance, 0, KINDS);
    tcase_add_loop_test(tests, no_two_faces_lie_on_one_another, 0, KINDS);
    tcase_add_loop_test(tests, the_surface_has_no_gaps, 0, KINDS);
    tcase_add_loop_test(tests, rays_stay_on_the_lit_side, 0, KINDS);
    tcase_add_test(tests, rooms_are_joined_by_bent_corridors);
    tcase_add_test(tests, maze_is_a_tree);
    tcase_add_test(tests, pyramids_grow_in_number);
    suite_add_tcase(suite, tests);
    return suite_run(suite);
}
