#include "solver/method/hierarchical/hierarchical_forecast.h"

#include <math.h>

/* Of rows the threshold falls with the elements per plane below so many, to a third at most. Wavelets find
 * smooth light in planes alone: where planes have one or two elements, coefficients are the factors of pairs,
 * which are less noise than those of smooth light, and the numbers left out are most of the error. With this
 * share single elements of delft-block (1.4 elements in a plane) err by .069 for .093, of cities (5) by half.
 */
static const double elements_of_plane = 12, planes_least = 1. / 3;
double hierarchical_share_of_planes(double n, double planes) {
    return fmin(fmax(n / (elements_of_plane * planes), planes_least), 1);
}

/* Stored coefficients per element at epsilon .05 and with the threshold of large planes: measured 26 to 66
 * where F is known well (a Cornell box of 10,249 elements), 69 to 101 of cities of 8,000, 87 of a canopy of
 * 8,000, fewer of larger scenes, and 114 at .003 in that box. Where the noise of rays bounds them, as an
 * epsilon of nearly three times that or less (noise_of_rows), 40 of a city by 1,024 rays, 44 of a hotel room,
 * 36 of Delft. Memory is forecast for the most of them, time for usual ones. With a third of the threshold,
 * where planes are small (hierarchical_share_of_planes), a canopy has 2.1 times as many, delft-block 1.6, and
 * an inverse takes twice as long. */
static const double noise_share = 1.6, numbers_most = 100, numbers_usual = 66, planes_power = -.7,
                    planes_time_power = -.35;

/* Bytes of a coefficient in memory: both triangles in tiles of 12 bytes; in a store; and while it is built
 * from rows, beside two kilobytes per element for the tree (measured: 5.7 kB per element at 27 coefficients,
 * 16 kB at 114). */
static const double loaded_bytes = 10, stored_bytes = 2.5, building_bytes = 130, element_bytes = 2000;

/* Coefficients for a block of form factors, at most: measured 2.0 to 2.4 (Cornell boxes of 163,687 and
 * 2,620,549 elements); bytes of one while it is built from blocks: measured 16 to 34 of as many. */
static const double coefficients_of_block = 3, building_bytes_of_blocks = 60;

/* Processor seconds of the expansion of S per block, per entry of rows and per element, and of the inverse of
 * a channel per element, per coefficient of S and per pair of coefficients of a row, which its products
 * multiply: by fits to two Cornell boxes, rooms, a maze, a patio and an atrium at three epsilons, and to five
 * scenes by rays. Rows are weighed by other methods first. */
static const double expand_block_seconds = 9e-8, expand_entry_seconds = 6e-8, expand_element_seconds = 4e-6,
                    invert_element_seconds = 1e-6, invert_seconds = 3e-7, multiply_seconds = 1e-9,
                    multiply_rows_seconds = 7e-9;
/* Coefficients of S per element, from b blocks per element as a sample has them: 1.8 b^.77, within a third of
 * those scenes (16 to 741 blocks, 17 to 388 coefficients). A sample counts up to 2.3 times the blocks that
 * are kept where most are pairs of elements, as many of these turn out hidden; pairs have more coefficients.
 */
static const double kept_of_blocks = 1.8, power_of_blocks = .77;

/* Light between small planes that stays in the scene makes products of more terms: times 1 + 2.4 (hits - .4)
 * (1 / hierarchical_share_of_planes - 1). Of a hotel room, which 7 % of the rays leave, this is 3.5 times the
 * work that towns take, which 60 % leave. */
static const double hits_of_towns = .4, products_of_hits = 2.4;
/* Processor seconds of an answer, among many, per stored coefficient: the judge of a hotel room takes .62 s
 * for a probe of three channels, of which products with F are .25 s and eight answers the rest. */
static const double answer_number_seconds = 1.3e-9;

static double products_between_planes(const method_scale *scale, double planes) {
    return 1 + products_of_hits * fmax(scale->hits - hits_of_towns, 0) * (1 / planes - 1);
}

/* Channels that are alike share an operator. */
static double channels_of(const method_scale *scale) {
    return scale->n_own_channels > 0 ? scale->n_own_channels : scale->n_channels;
}

static double seconds_of(const method_scale *scale, double numbers_of_rows, double planes) {
    const double n = scale->n, blocks = scale->n_blocks;
    const double of_blocks = kept_of_blocks * pow(blocks / n, power_of_blocks);
    const double numbers = blocks > 0 ? of_blocks : numbers_of_rows;
    const double expand = blocks > 0 ? blocks * expand_block_seconds : scale->entries * expand_entry_seconds;
    const double multiply =
        blocks > 0 ? multiply_seconds : multiply_rows_seconds * products_between_planes(scale, planes);
    return expand + n * expand_element_seconds +
           channels_of(scale) * n *
               (invert_element_seconds + numbers * (invert_seconds + numbers * multiply));
}

void hierarchical_forecast(const method_scale *scale, double epsilon, method_forecast *out) {
    const double blocks = scale->n_blocks;
    const double planes = scale->n_planes > 0 ? hierarchical_share_of_planes(scale->n, scale->n_planes) : 1;
    const double finer = scale->n * sqrt(.05 / fmax(epsilon, noise_share * scale->noise));
    const double of_rows = numbers_most * finer * pow(planes, planes_power);
    const double usual = numbers_usual * finer * pow(planes, planes_time_power);
    const double count = blocks > 0 ? coefficients_of_block * blocks : of_rows;
    *out = (method_forecast){
        .building = blocks > 0 ? building_bytes_of_blocks * count * channels_of(scale)
                               : element_bytes * scale->n + building_bytes * count,
        .loaded = loaded_bytes * count * channels_of(scale),
        .stored = stored_bytes * count * channels_of(scale),
        .seconds = seconds_of(scale, usual / scale->n, planes),
        .answer = blocks > 0 ? 0 : answer_number_seconds * numbers_usual * finer * pow(planes, planes_power)};
}
