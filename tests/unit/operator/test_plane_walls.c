/* Planes of the tree of clusters are parted where walls stand on them, and only there. */
#include "solver/operator/blocks/plane_walls.h"
#include "support/dense.h"
#include "support/failing_memory.h"
#include "support/suite.h"

#include <math.h>
#include <string.h>

static lam_error error;

enum { ELEMENTS_MOST = 1024 };

/* A floor of 16 x 8 squares of a metre, elements 0 to 127, and what stands on it. */
enum { ALONG = 16, ACROSS = 8, FLOOR = ALONG * ACROSS };

typedef struct yard {
    size_t n;
    double vertices[4 * ELEMENTS_MOST][3];
    uint32_t elements[ELEMENTS_MOST][4];
    double centre[ELEMENTS_MOST][3];
    float normal[ELEMENTS_MOST][3];
    double turn; /* of the walls, about the middle of the floor */
} yard;

/* A parallelogram at a corner, with the normal u x v. */
static void add(yard *y, const double corner[3], const double u[3], const double v[3]) {
    const size_t i = y->n++;
    double normal[3];
    ck_assert_uint_lt(i, ELEMENTS_MOST);
    for (size_t k = 0; k < 4; k++) {
        y->elements[i][k] = (uint32_t)(4 * i + k);
        for (int d = 0; d < 3; d++)
            y->vertices[4 * i + k][d] = corner[d] + (k == 1 || k == 2 ? u[d] : 0) + (k >= 2 ? v[d] : 0);
    }
    for (int d = 0; d < 3; d++) {
        y->centre[i][d] = corner[d] + (u[d] + v[d]) / 2;
        normal[d] = u[(d + 1) % 3] * v[(d + 2) % 3] - u[(d + 2) % 3] * v[(d + 1) % 3];
    }
    const double length = sqrt(normal[0] * normal[0] + normal[1] * normal[1] + normal[2] * normal[2]);
    for (int d = 0; d < 3; d++) y->normal[i][d] = (float)(normal[d] / length);
}

static yard *yard_make(void) {
    yard *y = test_allocate(1, sizeof *y);
    for (int j = 0; j < ACROSS; j++)
        for (int i = 0; i < ALONG; i++)
            add(y, (double[3]){i, j, 0}, (double[3]){1, 0, 0}, (double[3]){0, 1, 0});
    return y;
}

/* A wall from one point of the floor to another, of `pieces` quadrilaterals, from a height to another. */
static void add_wall(yard *y, const double from[2], const double to[2], int pieces, double low, double high) {
    const double c = cos(y->turn), s = sin(y->turn), middle[2] = {ALONG / 2., ACROSS / 2.};
    double at[2][2];
    for (int k = 0; k < 2; k++) {
        const double *p = k == 0 ? from : to;
        at[k][0] = middle[0] + c * (p[0] - middle[0]) - s * (p[1] - middle[1]);
        at[k][1] = middle[1] + s * (p[0] - middle[0]) + c * (p[1] - middle[1]);
    }
    const double u[3] = {(at[1][0] - at[0][0]) / pieces, (at[1][1] - at[0][1]) / pieces, 0};
    for (int k = 0; k < pieces; k++)
        add(y, (double[3]){at[0][0] + k * u[0], at[0][1] + k * u[1], low}, u, (double[3]){0, 0, high - low});
}

static plane_tree tree_of(const yard *y, bool with_walls) {
    const element_corners corners = {y->vertices, y->elements};
    plane_tree tree;
    ck_ok(plane_tree_make(y->n, y->centre, y->normal, with_walls ? &corners : NULL, NULL, PLANE_LEAF, &tree,
                          &error));
    return tree;
}

/* Parts of the floor, each below a frame of its own; part [FLOOR] gets the frame of each element. */
static size_t parts_of(const plane_tree *tree, uint32_t part[FLOOR]) {
    bool seen[ELEMENTS_MOST] = {false};
    size_t count = 0;
    for (size_t t = 0; t < tree->n_clusters; t++) {
        const plane_cluster *c = &tree->clusters[t];
        if (!c->leaf) continue;
        for (uint32_t p = c->begin; p < c->end; p++) {
            if (tree->order[p] >= FLOOR) continue;
            part[tree->order[p]] = c->frame;
            count += !seen[c->frame];
            seen[c->frame] = true;
        }
    }
    return count;
}

/* Checks that elements of the floor are in one part exactly where they are on the same side of a line. */
static void check_sides(const yard *y, double across_x, double across_y, double offset) {
    uint32_t part[FLOOR];
    plane_tree tree = tree_of(y, true);
    ck_assert_uint_eq(parts_of(&tree, part), 2);
    uint32_t one = UINT32_MAX, other = UINT32_MAX;
    for (size_t i = 0; i < FLOOR; i++) {
        const bool beyond = across_x * y->centre[i][0] + across_y * y->centre[i][1] > offset;
        uint32_t *side = beyond ? &one : &other;
        if (*side == UINT32_MAX) *side = part[i];
        ck_assert_uint_eq(part[i], *side);
    }
    ck_assert(one != other && one != UINT32_MAX && other != UINT32_MAX);
    plane_tree_free(&tree);
}

static size_t count_parts(const yard *y) {
    uint32_t part[FLOOR];
    plane_tree tree = tree_of(y, true);
    const size_t count = parts_of(&tree, part);
    plane_tree_free(&tree);
    return count;
}

/* Far from the middle, where halves would have been cut. */
START_TEST(a_wall_parts_the_floor) {
    yard *y = yard_make();
    ck_assert_uint_eq(count_parts(y), 1);
    add_wall(y, (double[2]){3, 0}, (double[2]){3, 8}, 1, 0, 2);
    check_sides(y, 1, 0, 3);
    plane_tree tree = tree_of(y, false);
    uint32_t part[FLOOR];
    ck_assert_uint_eq(parts_of(&tree, part), 1);
    plane_tree_free(&tree);
    free(y);
}
END_TEST

/* Seven pieces, and the two sheets of a wall, 5 cm apart, between which no element lies. */
START_TEST(a_wall_of_pieces_and_sheets_is_one) {
    yard *y = yard_make();
    add_wall(y, (double[2]){3, 8}, (double[2]){3, 0}, 7, 0, 2);
    add_wall(y, (double[2]){3.05, 0}, (double[2]){3.05, 8}, 5, 0, 2);
    check_sides(y, 1, 0, 3);
    free(y);
}
END_TEST

/* Most elements lie at one end, so that their mean centre does too. */
START_TEST(a_wall_far_from_most_elements_parts_the_floor) {
    enum { FINE = 16 };
    yard *y = yard_make();
    const double side = 1. / FINE;
    for (int k = 0; k < FINE * FINE; k++)
        add(y, (double[3]){ALONG + k % FINE * side, k / FINE * side, 0}, (double[3]){side, 0, 0},
            (double[3]){0, side, 0});
    ck_assert_uint_eq(count_parts(y), 1);
    add_wall(y, (double[2]){3, 0}, (double[2]){3, 8}, 1, 0, 2);
    check_sides(y, 1, 0, 3);
    free(y);
}
END_TEST

/* No vertex lies on the floor; a triangle counts as a quadrilateral does. */
START_TEST(a_wall_through_the_floor_parts_it) {
    yard *y = yard_make();
    add_wall(y, (double[2]){5, 0}, (double[2]){5, 8}, 1, -1, 2);
    check_sides(y, 1, 0, 5);
    y->elements[FLOOR][3] = UINT32_MAX;
    check_sides(y, 1, 0, 5);
    free(y);
}
END_TEST

/* With a door three metres wide it is still a wall; three tenths of it, and then a tenth, are left. */
START_TEST(a_door_parts_as_long_as_a_quarter_is_wall) {
    yard *y = yard_make();
    add_wall(y, (double[2]){11, 0}, (double[2]){11, 2}, 2, 0, 2);
    add_wall(y, (double[2]){11, 5}, (double[2]){11, 8}, 3, 0, 2);
    check_sides(y, 1, 0, 11);
    y->n = FLOOR;
    add_wall(y, (double[2]){11, 3}, (double[2]){11, 5.4}, 3, 0, 2);
    check_sides(y, 1, 0, 11);
    y->n = FLOOR;
    add_wall(y, (double[2]){11, 3}, (double[2]){11, 3.8}, 1, 0, 2);
    ck_assert_uint_eq(count_parts(y), 1);
    free(y);
}
END_TEST

/* The mesh of the floor does not know of it. */
START_TEST(an_oblique_wall_parts_the_floor) {
    for (int k = -4; k <= 4; k++) {
        yard *y = yard_make();
        y->turn = .3 * k + .01;
        add_wall(y, (double[2]){8, -9}, (double[2]){8, 17}, 5, 0, 2);
        const double c = cos(y->turn), s = sin(y->turn);
        check_sides(y, c, s, 8 * c + 4 * s);
        free(y);
    }
}
END_TEST

START_TEST(what_does_not_stand_on_the_floor_parts_nothing) {
    static const double heights[3][2] = {{-2, 0}, {.1, 2}, {-3, -1}};
    for (size_t k = 0; k < 3; k++) {
        yard *y = yard_make();
        add_wall(y, (double[2]){3, 0}, (double[2]){3, 8}, 1, heights[k][0], heights[k][1]);
        ck_assert_uint_eq(count_parts(y), 1);
        free(y);
    }
    yard *y = yard_make();
    /* The walls have one plane, and lie behind the floor here and in front of it elsewhere. */
    add_wall(y, (double[2]){3, 0}, (double[2]){3, 8}, 1, -2, 0);
    add_wall(y, (double[2]){3, 20}, (double[2]){3, 22}, 1, 0, 2);
    ck_assert_uint_eq(count_parts(y), 1);
    y->n = FLOOR;
    add_wall(y, (double[2]){0, 0}, (double[2]){0, 8}, 1, 0, 2);
    add_wall(y, (double[2]){16, 8}, (double[2]){16, 0}, 1, 0, 2);
    add_wall(y, (double[2]){20, 8}, (double[2]){20, 0}, 1, 0, 2);
    ck_assert_uint_eq(count_parts(y), 1);
    /* A small plate, of which one corner alone touches the floor. */
    add(y, (double[3]){8, 4, 0}, (double[3]){1, 1, 1}, (double[3]){-1, -1, 1});
    ck_assert_uint_eq(count_parts(y), 1);
    free(y);
}
END_TEST

/* Four rooms of a cross of walls, the second wall in two parts of one line each. */
START_TEST(walls_part_what_other_walls_left) {
    yard *y = yard_make();
    uint32_t part[FLOOR];
    add_wall(y, (double[2]){6, 0}, (double[2]){6, 8}, 3, 0, 2);
    add_wall(y, (double[2]){0, 3}, (double[2]){6, 3}, 2, 0, 2);
    add_wall(y, (double[2]){6, 5}, (double[2]){16, 5}, 4, 0, 2);
    plane_tree tree = tree_of(y, true);
    ck_assert_uint_eq(parts_of(&tree, part), 4);
    for (size_t i = 0; i < FLOOR; i++)
        for (size_t j = 0; j < i; j++) {
            const double *a = y->centre[i], *b = y->centre[j];
            const bool left = a[0] < 6,
                       same = left == (b[0] < 6) && (a[1] < (left ? 3 : 5)) == (b[1] < (left ? 3 : 5));
            ck_assert(same == (part[i] == part[j]));
        }
    plane_tree_free(&tree);
    free(y);
}
END_TEST

START_TEST(memory_that_runs_out_leaves_nothing) {
    yard *y = yard_make();
    add_wall(y, (double[2]){3, 0}, (double[2]){3, 8}, 7, 0, 2);
    const element_corners corners = {y->vertices, y->elements};
    bool made = false;
    for (long k = 0; !made; k++) {
        plane_tree tree = {.n = 0};
        ck_assert_int_lt(k, 64);
        allocations_left = k;
        const lam_status status =
            plane_tree_make(y->n, y->centre, y->normal, &corners, NULL, PLANE_LEAF, &tree, &error);
        allocations_left = -1;
        made = status == LAM_OK;
        ck_assert(made || (status == LAM_ERR_MEMORY && tree.order == NULL));
        plane_tree_free(&tree);
    }
    free(y);
}
END_TEST

int main(void) {
    Suite *suite = suite_create("plane walls");
    TCase *walls = tcase_create("walls");
    tcase_add_test(walls, a_wall_parts_the_floor);
    tcase_add_test(walls, a_wall_far_from_most_elements_parts_the_floor);
    tcase_add_test(walls, a_wall_of_pieces_and_sheets_is_one);
    tcase_add_test(walls, a_wall_through_the_floor_parts_it);
    tcase_add_test(walls, a_door_parts_as_long_as_a_quarter_is_wall);
    tcase_add_test(walls, an_oblique_wall_parts_the_floor);
    tcase_add_test(walls, what_does_not_stand_on_the_floor_parts_nothing);
    tcase_add_test(walls, walls_part_what_other_walls_left);
    tcase_add_test(walls, memory_that_runs_out_leaves_nothing);
    suite_add_tcase(suite, walls);
    return suite_run(suite);
}
