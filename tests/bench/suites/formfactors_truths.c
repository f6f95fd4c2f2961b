#include "tests/bench/suites/formfactors_truths.h"

#define COUNT(array) (sizeof(array) / sizeof *(array))

static const scene_piece opposed_squares_side_gap_1[] = {{{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, false},
                                                         {{0, 0, 1}, {0, 1, 0}, {1, 0, 0}, false}};

static const scene_piece opposed_squares_side_gap_2[] = {{{0, 0, 0}, {2, 0, 0}, {0, 2, 0}, false},
                                                         {{0, 0, 1}, {0, 2, 0}, {2, 0, 0}, false}};

static const scene_piece opposed_squares_side_gap_0_1[] = {{{0, 0, 0}, {.1, 0, 0}, {0, .1, 0}, false},
                                                           {{0, 0, 1}, {0, .1, 0}, {.1, 0, 0}, false}};

static const scene_piece opposed_squares_side_gap_0_4[] = {{{0, 0, 0}, {.4, 0, 0}, {0, .4, 0}, false},
                                                           {{0, 0, 1}, {0, .4, 0}, {.4, 0, 0}, false}};

static const scene_piece opposed_squares_side_gap_10[] = {{{0, 0, 0}, {10, 0, 0}, {0, 10, 0}, false},
                                                          {{0, 0, 1}, {0, 10, 0}, {10, 0, 0}, false}};

static const scene_piece perpendicular_common_edge_h_1_w_1[] = {{{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, false},
                                                                {{0, 0, 0}, {0, 0, 1}, {1, 0, 0}, false}};

static const scene_piece perpendicular_common_edge_h_2_w_1[] = {{{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, false},
                                                                {{0, 0, 0}, {0, 0, 2}, {1, 0, 0}, false}};

static const scene_piece perpendicular_common_edge_h_1_w_0_1[] = {{{0, 0, 0}, {1, 0, 0}, {0, .1, 0}, false},
                                                                  {{0, 0, 0}, {0, 0, 1}, {1, 0, 0}, false}};

static const scene_piece perpendicular_common_edge_h_0_5_w_0_5[] = {
    {{0, 0, 0}, {1, 0, 0}, {0, .5, 0}, false}, {{0, 0, 0}, {0, 0, .5}, {1, 0, 0}, false}};

static const scene_piece perpendicular_common_edge_h_0_2_w_0_2[] = {
    {{0, 0, 0}, {1, 0, 0}, {0, .2, 0}, false}, {{0, 0, 0}, {0, 0, .2}, {1, 0, 0}, false}};

static const scene_piece perpendicular_common_edge_h_2_w_2[] = {{{0, 0, 0}, {1, 0, 0}, {0, 2, 0}, false},
                                                                {{0, 0, 0}, {0, 0, 2}, {1, 0, 0}, false}};

static const scene_piece parallel_shifted_by_one_side[] = {{{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, false},
                                                           {{1, 0, 1}, {0, 1, 0}, {1, 0, 0}, false}};

static const scene_piece parallel_to_a_square_twice_as_wide[] = {
    {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, false}, {{-.5, -.5, 1}, {0, 2, 0}, {2, 0, 0}, false}};

static const scene_piece perpendicular_touching_in_a_point[] = {{{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, false},
                                                                {{1, 0, 0}, {0, 0, 1}, {1, 0, 0}, false}};

static const scene_piece perpendicular_gap_1[] = {{{1, 0, 0}, {1, 0, 0}, {0, 1, 0}, false},
                                                  {{0, 0, 0}, {0, 1, 0}, {0, 0, 1}, false}};

static const scene_piece squares_hinged_at_30_degrees[] = {
    {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, false}, {{0, 0, 0}, {0, .8660254037844386, .5}, {1, 0, 0}, false}};

static const scene_piece squares_hinged_at_60_degrees[] = {
    {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, false}, {{0, 0, 0}, {0, .5, .8660254037844386}, {1, 0, 0}, false}};

static const scene_piece squares_hinged_at_120_degrees[] = {
    {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, false}, {{0, 0, 0}, {0, -.5, .8660254037844386}, {1, 0, 0}, false}};

static const scene_piece triangle_to_the_same_above[] = {{{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, true},
                                                         {{0, 0, 1}, {0, 1, 0}, {1, 0, 0}, true}};

static const scene_piece triangle_to_its_complement_above[] = {{{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, true},
                                                               {{1, 1, 1}, {0, -1, 0}, {-1, 0, 0}, true}};

static const scene_piece parallel_right_triangles[] = {{{1, 1, 0}, {-1, 0, 0}, {-1, -1, 0}, true},
                                                       {{0, 1, 1}, {1, 0, 0}, {1, -1, 0}, true}};

static const scene_piece regular_tetrahedron[] = {{{1, -1, -1}, {-2, 2, 0}, {-2, 0, 2}, true},
                                                  {{1, 1, 1}, {-2, -2, 0}, {-2, 0, -2}, true},
                                                  {{1, 1, 1}, {0, -2, -2}, {-2, -2, 0}, true},
                                                  {{1, 1, 1}, {-2, 0, -2}, {0, -2, -2}, true}};

static const scene_piece room[] = {
    {{0, 0, 0}, {10, 0, 0}, {0, 6, 0}, false}, {{0, 0, 3}, {0, 6, 0}, {10, 0, 0}, false},
    {{0, 0, 0}, {0, 0, 3}, {10, 0, 0}, false}, {{0, 6, 0}, {10, 0, 0}, {0, 0, 3}, false},
    {{0, 0, 0}, {0, 6, 0}, {0, 0, 3}, false},  {{10, 0, 0}, {0, 0, 3}, {0, 6, 0}, false}};

static const scene_piece tiny_1_mm_square_under_a_corner[] = {
    {{-.0005, -.0005, 0}, {.001, 0, 0}, {0, .001, 0}, false}, {{0, 0, 1}, {0, 1, 0}, {1, 0, 0}, false}};

static const scene_piece tiny_1_mm_square_under_the_centre[] = {
    {{.4995, .4995, 0}, {.001, 0, 0}, {0, .001, 0}, false}, {{0, 0, 1}, {0, 1, 0}, {1, 0, 0}, false}};

static const scene_piece tiny_1_mm_square_perpendicular[] = {
    {{-.0005, -.0005, 0}, {.001, 0, 0}, {0, .001, 0}, false}, {{1, 0, 0}, {0, 0, 1}, {0, 1, 0}, false}};

static const scene_piece plates_a_quarter_between[] = {{{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, false},
                                                       {{0, 0, 1}, {0, 1, 0}, {1, 0, 0}, false},
                                                       {{0, 0, .5}, {.5, 0, 0}, {0, .5, 0}, false},
                                                       {{0, 0, .5}, {0, .5, 0}, {.5, 0, 0}, false}};

static const scene_piece plates_a_half_between[] = {{{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, false},
                                                    {{0, 0, 1}, {0, 1, 0}, {1, 0, 0}, false},
                                                    {{0, 0, .5}, {.5, 0, 0}, {0, 1, 0}, false},
                                                    {{0, 0, .5}, {0, 1, 0}, {.5, 0, 0}, false}};

static const scene_piece plates_the_middle_between[] = {{{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, false},
                                                        {{0, 0, 1}, {0, 1, 0}, {1, 0, 0}, false},
                                                        {{.25, .25, .5}, {.5, 0, 0}, {0, .5, 0}, false},
                                                        {{.25, .25, .5}, {0, .5, 0}, {.5, 0, 0}, false}};

static const scene_piece plates_all_between[] = {{{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, false},
                                                 {{0, 0, 1}, {0, 1, 0}, {1, 0, 0}, false},
                                                 {{0, 0, .5}, {1, 0, 0}, {0, 1, 0}, false},
                                                 {{0, 0, .5}, {0, 1, 0}, {1, 0, 0}, false}};

static const scene_piece plates_more_than_all_between[] = {{{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, false},
                                                           {{0, 0, 1}, {0, 1, 0}, {1, 0, 0}, false},
                                                           {{-1, -1, .5}, {3, 0, 0}, {0, 3, 0}, false},
                                                           {{-1, -1, .5}, {0, 3, 0}, {3, 0, 0}, false}};

static const scene_piece l_room[] = {
    {{0, 0, 3}, {3, 0, 0}, {0, 0, -3}, false}, {{3, 0, 0}, {0, 0, 3}, {0, 1, 0}, false},
    {{1, 1, 0}, {2, 0, 0}, {0, 0, 3}, false},  {{1, 3, 0}, {0, -2, 0}, {0, 0, 3}, false},
    {{0, 3, 0}, {1, 0, 0}, {0, 0, 3}, false},  {{0, 0, 0}, {0, 3, 0}, {0, 0, 3}, false},
    {{0, 0, 3}, {0, 1, 0}, {1, 0, 0}, false},  {{0, 3, 3}, {1, 0, 0}, {0, -2, 0}, false},
    {{1, 1, 3}, {2, 0, 0}, {0, -1, 0}, false}, {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, false},
    {{0, 1, 0}, {1, 0, 0}, {0, 2, 0}, false},  {{1, 0, 0}, {2, 0, 0}, {0, 1, 0}, false}};

/* Exact values, computed with 25 digits from the closed forms named and checked against each other. */
const formfactors_truth formfactors_truths[] = {
    {"opposed squares, side/gap 1", "Howell C-11", .199824895698, opposed_squares_side_gap_1,
     COUNT(opposed_squares_side_gap_1), 0, 1, false},
    {"opposed squares, side/gap 2", "Howell C-11", .415253283577, opposed_squares_side_gap_2,
     COUNT(opposed_squares_side_gap_2), 0, 1, false},
    {"opposed squares, side/gap 0.1", "Howell C-11", .003162056839, opposed_squares_side_gap_0_1,
     COUNT(opposed_squares_side_gap_0_1), 0, 1, false},
    {"opposed squares, side/gap 0.4", "Howell C-11, OpenViewFactor", .046137416744875,
     opposed_squares_side_gap_0_4, COUNT(opposed_squares_side_gap_0_4), 0, 1, false},
    {"opposed squares, side/gap 10", "Howell C-11", .826994522397, opposed_squares_side_gap_10,
     COUNT(opposed_squares_side_gap_10), 0, 1, false},
    {"perpendicular, common edge, H=1 W=1", "Howell C-14", .200043776075, perpendicular_common_edge_h_1_w_1,
     COUNT(perpendicular_common_edge_h_1_w_1), 0, 1, false},
    {"perpendicular, common edge, H=2 W=1", "Howell C-14", .232852602795, perpendicular_common_edge_h_2_w_1,
     COUNT(perpendicular_common_edge_h_2_w_1), 0, 1, false},
    {"perpendicular, common edge, H=1 W=0.1", "Howell C-14", .432513694007,
     perpendicular_common_edge_h_1_w_0_1, COUNT(perpendicular_common_edge_h_1_w_0_1), 0, 1, false},
    {"perpendicular, common edge, H=0.5 W=0.5", "Howell C-14", .240636006177,
     perpendicular_common_edge_h_0_5_w_0_5, COUNT(perpendicular_common_edge_h_0_5_w_0_5), 0, 1, false},
    {"perpendicular, common edge, H=0.2 W=0.2", "Howell C-14, OpenViewFactor", .271036935697358,
     perpendicular_common_edge_h_0_2_w_0_2, COUNT(perpendicular_common_edge_h_0_2_w_0_2), 0, 1, false},
    {"perpendicular, common edge, H=2 W=2", "Howell C-14, OpenViewFactor", .149299795886762,
     perpendicular_common_edge_h_2_w_2, COUNT(perpendicular_common_edge_h_2_w_2), 0, 1, false},
    {"parallel, shifted by one side", "closed form of parallel rectangles", .086050489152,
     parallel_shifted_by_one_side, COUNT(parallel_shifted_by_one_side), 0, 1, false},
    {"parallel, to a square twice as wide", "closed form of parallel rectangles", .517653079516,
     parallel_to_a_square_twice_as_wide, COUNT(parallel_to_a_square_twice_as_wide), 0, 1, false},
    {"perpendicular, touching in a point", "closed form of perpendicular rectangles", .040592230102,
     perpendicular_touching_in_a_point, COUNT(perpendicular_touching_in_a_point), 0, 1, false},
    {"perpendicular, gap 1", "closed form of perpendicular rectangles", .032808826720, perpendicular_gap_1,
     COUNT(perpendicular_gap_1), 0, 1, false},
    {"squares hinged at 30 degrees", "contour integral", .619028323, squares_hinged_at_30_degrees,
     COUNT(squares_hinged_at_30_degrees), 0, 1, false},
    {"squares hinged at 60 degrees", "contour integral", .370905321150, squares_hinged_at_60_degrees,
     COUNT(squares_hinged_at_60_degrees), 0, 1, false},
    {"squares hinged at 120 degrees", "contour integral", .086615001118, squares_hinged_at_120_degrees,
     COUNT(squares_hinged_at_120_degrees), 0, 1, false},
    {"triangle to the same above", "contour integral", .115049228150, triangle_to_the_same_above,
     COUNT(triangle_to_the_same_above), 0, 1, false},
    {"triangle to its complement above", "contour integral", .084775667549, triangle_to_its_complement_above,
     COUNT(triangle_to_its_complement_above), 0, 1, false},
    {"parallel right triangles", "half of C-11, Narayanaswamy 2015", .099912447849, parallel_right_triangles,
     COUNT(parallel_right_triangles), 0, 1, false},
    {"regular tetrahedron", "symmetry", 1. / 3, regular_tetrahedron, COUNT(regular_tetrahedron), 0, 1, false},
    {"room 10x6x3, floor to ceiling", "closed form of parallel rectangles", .488700936440, room, COUNT(room),
     0, 1, false},
    {"room 10x6x3, floor to 10x3 wall", "closed form of perpendicular rectangles", .162387354927, room,
     COUNT(room), 0, 2, false},
    {"room 10x6x3, floor to 6x3 wall", "closed form of perpendicular rectangles", .093262176853, room,
     COUNT(room), 0, 4, false},
    {"1 mm square under a corner", "closed form of a point and a polygon", .138531605995,
     tiny_1_mm_square_under_a_corner, COUNT(tiny_1_mm_square_under_a_corner), 0, 1, false},
    {"1 mm square under the centre", "closed form of a point and a polygon", .239456470461,
     tiny_1_mm_square_under_the_centre, COUNT(tiny_1_mm_square_under_the_centre), 0, 1, false},
    {"1 mm square, perpendicular", "closed form of a point and a polygon", .055734197003,
     tiny_1_mm_square_perpendicular, COUNT(tiny_1_mm_square_perpendicular), 0, 1, false},
    {"plates, a quarter between", "3/4 of C-11", .149868671774, plates_a_quarter_between,
     COUNT(plates_a_quarter_between), 0, 1, true},
    {"plates, a half between", "1/2 of C-11", .099912447849, plates_a_half_between,
     COUNT(plates_a_half_between), 0, 1, true},
    {"plates, the middle between", "Gauss quadrature", .099506294599, plates_the_middle_between,
     COUNT(plates_the_middle_between), 0, 1, true},
    {"plates, all between", "nothing passes", 0, plates_all_between, COUNT(plates_all_between), 0, 1, true},
    {"plates, more than all between", "nothing passes", 0, plates_more_than_all_between,
     COUNT(plates_more_than_all_between), 0, 1, true},
    {"L-room, end wall to end wall", "behind the corner", 0, l_room, COUNT(l_room), 1, 4, true},
    {NULL, NULL, 0, NULL, 0, 0, 0, false},
};

static const int l_room_surface[] = {0, 1, 2, 3, 4, 5, 6, 6, 6, 7, 7, 7};
/* Exact: walls in full view of each other by the closed forms C-11 and C-14; of walls partly behind the
 * corner the exchange of two vertical lines of height h at distance d,
 *     g = cos d . cos' d / pi * [h^2 / (d^2 (d^2 + h^2)) + h atan(h / d) / d^3 - 1 / d^2 + 1 / (d^2 + h^2)],
 * by Gauss quadrature over the lines that see each other; floor and ceiling, both alike, close the rows. */
static const double l_room_F[] = {
    0,           .113154414,  .378092898,  .0274734057, .0328902476, .182355904,  .133016565,  .133016565,
    .339463243,  0,           .318996701,  0,           0,           .0986707427, .121434656,  .121434656,
    .567139347,  .159498351,  0,           0,           0,           .0412101086, .116076097,  .116076097,
    .0412101086, 0,           0,           0,           .159498351,  .567139347,  .116076097,  .116076097,
    .0986707427, 0,           0,           .318996701,  0,           .339463243,  .121434656,  .121434656,
    .182355904,  .0328902476, .0274734057, .378092898,  .113154414,  0,           .133016565,  .133016565,
    .239429818,  .0728607939, .139291316,  .139291316,  .0728607939, .239429818,  0,           .0968361437,
    .239429818,  .0728607939, .139291316,  .139291316,  .0728607939, .239429818,  .0968361437, 0};
static const double l_room_emission[] = {376.8893, 376.8893, 328.0352, 376.8893,
                                         376.8893, 376.8893, 376.8893, 376.8893};
static const double l_room_radiosity[] = {416.8706, 417.118,  369.7598, 418.7288,
                                          418.7211, 418.5694, 418.013,  418.013};

static const scene_piece square_2d[] = {
    {{0, 1, -.5}, {0, 0, 1}, {0, -1, 0}, false},     {{0, 1, -100}, {0, 0, 99.5}, {0, -1, 0}, false},
    {{0, 1, .5}, {0, 0, 99.5}, {0, -1, 0}, false},   {{1, 1, -.5}, {0, 0, 1}, {-1, 0, 0}, false},
    {{1, 1, -100}, {0, 0, 99.5}, {-1, 0, 0}, false}, {{1, 1, .5}, {0, 0, 99.5}, {-1, 0, 0}, false},
    {{1, 0, -.5}, {0, 0, 1}, {0, 1, 0}, false},      {{1, 0, -100}, {0, 0, 99.5}, {0, 1, 0}, false},
    {{1, 0, .5}, {0, 0, 99.5}, {0, 1, 0}, false},    {{0, 0, -.5}, {0, 0, 1}, {1, 0, 0}, false},
    {{0, 0, -100}, {0, 0, 99.5}, {1, 0, 0}, false},  {{0, 0, .5}, {0, 0, 99.5}, {1, 0, 0}, false}};
static const int square_2d_surface[] = {0, 0, 0, 1, 1, 1, 2, 2, 2, 3, 3, 3};
static const double square_2d_F[] = {0,          .292893219, .414213562, .292893219, .292893219, 0,
                                     .292893219, .414213562, .414213562, .292893219, 0,          .292893219,
                                     .292893219, .414213562, .292893219, 0};

static const scene_piece blocked_2d_half[] = {
    {{0, 0, -5}, {0, 0, 10}, {10, 0, 0}, false},       {{0, 0, -1000}, {0, 0, 995}, {10, 0, 0}, false},
    {{0, 0, 5}, {0, 0, 995}, {10, 0, 0}, false},       {{10, 5, -5}, {0, 0, 10}, {-10, 0, 0}, false},
    {{10, 5, -1000}, {0, 0, 995}, {-10, 0, 0}, false}, {{10, 5, 5}, {0, 0, 995}, {-10, 0, 0}, false},
    {{0, 2, -5}, {0, 0, 10}, {5, 0, 0}, false},        {{0, 2, -1000}, {0, 0, 995}, {5, 0, 0}, false},
    {{0, 2, 5}, {0, 0, 995}, {5, 0, 0}, false}};
static const int blocked_2d_half_surface[] = {0, 0, 0, 1, 1, 1, 2, 2, 2};
static const double blocked_2d_half_F[] = {0, .309016994, 0, .309016994, 0, .372015325, 0, .744030651, 0};

/* The form factors that were published for the L-room, recovered from rows that had been scaled to close, are
 * off by up to 2.33e-5 (surface 2 to floor and ceiling; F_23, C-14(H=2/3, W=1/3), by 2.1e-5). Its radiosity,
 * as published, may then be off by rho * 8 * 2.33e-5 * 418 / (1 - rho). Strips of a length of 2 Z stand for
 * endless ones to (size/Z)^2/2. */
const formfactors_enclosure formfactors_enclosures[] = {
    {"L-room", "Pinney and Bean test 4, View3D", l_room, COUNT(l_room), 8, l_room_surface, false, l_room_F,
     2.33e-5, l_room_emission, l_room_radiosity, 8.7e-3},
    {"square duct", "LBNL Windows-CalcEngine", square_2d, COUNT(square_2d), 4, square_2d_surface, true,
     square_2d_F, 5e-5, NULL, NULL, 0},
    {"plates, a long strip between", "LBNL Windows-CalcEngine", blocked_2d_half, COUNT(blocked_2d_half), 3,
     blocked_2d_half_surface, true, blocked_2d_half_F, 5e-5, NULL, NULL, 0},
    {NULL, NULL, NULL, 0, 0, NULL, false, NULL, 0, NULL, NULL, 0},
};
