/* Trees on open ground: each a trunk and some hundred leaves. A leaf has no thickness: it is two faces back
 * to back, so that light falls on both. Coordinates have six decimals, as in most files of others, so that
 * the corners of a leaf lie off its plane. */
#include "solver/base/random.h"
#include "solver/scene/generate/column.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

/* Metres. Trees stand so near the middle of their lots that no crown comes to the trunk of another. */
static const double lot = 4, astray = .6, half_foot = .25, trunk_radius[2] = {.09, .16};
static const double crown_middle[2] = {2.6, 3.8}, crown_radius[2] = {1.1, 1.5}, crown_rise[2] = {1, 1.6};
static const double leaf_length[2] = {.2, .36}, leaf_shape = .55; /* width to length */
static const double trunk_end = .3;                               /* of the crown's rise, above its middle */
static const double bare_share = .15;                             /* of all elements: ground and trunks */

enum { CANOPY_ELEMENTS = 12000, PER_TREE = 820, TRUNK_SIDES = 8, DECIMALS = 6, GROUND = 0, TRUNK, GROUPS };

static const scene_draft_material soil = {"soil", {.3, .25, .18}, {0, 0, 0}};
static const scene_draft_material bark = {"bark", {.25, .19, .14}, {0, 0, 0}};
static const scene_draft_material green = {"green", {.14, .34, .08}, {0, 0, 0}};
static const patch_group groups[GROUPS] = {{"ground", &soil}, {"trunk", &bark}};

typedef struct tree {
    double foot[2], trunk, middle, radius,
        rise; /* radius of the trunk; height, radius and rise of the crown */
} tree;

static double micrometres(double x) {
    return round(x * 1e6) / 1e6;
}

static double trunk_top(const tree *t) {
    return t->middle + trunk_end * t->rise;
}

/* A level rectangle, facing up. */
static lam_status add_ground(patch_list *list, double x0, double y0, double x1, double y1, lam_error *error) {
    const double quad[4][3] = {{x0, y0, 0}, {x1, y0, 0}, {x1, y1, 0}, {x0, y1, 0}};
    return x0 < x1 && y0 < y1 ? patch_add(list, quad, 4, GROUND, error) : LAM_OK;
}

/* A lot with a tree: four pieces of ground around a square one that the trunk has a hole in. */
static lam_status add_tree(patch_list *list, const tree *t, double x, double y, lam_error *error) {
    lam_status status = LAM_OK;
    const double low[2] = {t->foot[0] - half_foot, t->foot[1] - half_foot};
    const double high[2] = {t->foot[0] + half_foot, t->foot[1] + half_foot};
    const column foot = {{t->foot[0], t->foot[1]}, TRUNK_SIDES, GROUND};
    const column trunk = {{t->foot[0], t->foot[1]}, TRUNK_SIDES, TRUNK};
    TRY(add_ground(list, x, y, high[0], low[1], error));
    TRY(add_ground(list, high[0], y, x + lot, high[1], error));
    TRY(add_ground(list, low[0], high[1], x + lot, y + lot, error));
    TRY(add_ground(list, x, low[1], low[0], y + lot, error));
    TRY(column_square(&foot, low, high, 0, t->trunk, false, list, error));
    TRY(column_band(&trunk, 0, t->trunk, trunk_top(t) / 2, .7 * t->trunk, list, error));
    TRY(column_band(&trunk, trunk_top(t) / 2, .7 * t->trunk, trunk_top(t), 0, list, error));
done:
    return status;
}

/* Uniform over all directions. */
static void any_direction(uint64_t *r, double out[3]) {
    const double z = random_between(r, -1, 1), angle = random_between(r, 0, 2 * M_PI),
                 across = sqrt(1 - z * z);
    out[0] = across * cos(angle);
    out[1] = across * sin(angle);
    out[2] = z;
}

/* A place in the crown, anew until a leaf of this length there is clear of the trunk. */
static void leaf_place(uint64_t *r, const tree *t, double length, double out[3]) {
    for (;;) {
        const double reach = cbrt(random_unit(r));
        any_direction(r, out);
        for (int d = 0; d < 3; d++) out[d] *= reach * (d < 2 ? t->radius : t->rise);
        const double beside = hypot(out[0], out[1]) - t->trunk;
        out[2] += t->middle;
        if (beside > length / 2 || out[2] - length / 2 > trunk_top(t)) break;
    }
    for (int d = 0; d < 2; d++) out[d] += t->foot[d];
}

/* A rhombus that lies anyhow, and the same from behind. */
static lam_status draw_leaf(scene_draft *d, uint64_t *r, const tree *t, lam_error *error) {
    lam_status status = LAM_OK;
    const double length = random_between(r, leaf_length[0], leaf_length[1]);
    double middle[3], along[3], across[3], corners[4][3], behind[4][3], dot = 0, norm = 0;
    leaf_place(r, t, length, middle);
    any_direction(r, along);
    any_direction(r, across);
    for (int k = 0; k < 3; k++) dot += along[k] * across[k];
    for (int k = 0; k < 3; k++) {
        across[k] -= dot * along[k];
        norm += across[k] * across[k];
    }
    for (int k = 0; k < 3; k++) {
        const double p = middle[k], a = along[k] * length / 2;
        const double b = across[k] / sqrt(norm) * leaf_shape * length / 2;
        corners[0][k] = p + a;
        corners[1][k] = p + b;
        corners[2][k] = p - a;
        corners[3][k] = p - b;
    }
    for (int k = 0; k < 4; k++) memcpy(behind[k], corners[3 - k], sizeof *behind);
    TRY(scene_draft_face(d, (const double(*)[3])corners, 4, error));
    TRY(scene_draft_face(d, (const double(*)[3])behind, 4, error));
done:
    return status;
}

/* Trees in some of the lots of a square: each lot's chance is what makes the number come out. */
static lam_status plant(patch_list *list, tree *trees, size_t n, uint64_t seed, lam_error *error) {
    lam_status status = LAM_OK;
    const size_t columns = (size_t)ceil(sqrt((double)n)), lots = columns * ((n + columns - 1) / columns);
    uint64_t chance = random_stream(seed, 1), shape = random_stream(seed, 2);
    for (size_t i = 0, planted = 0; i < lots; i++) {
        const double x = lot * (double)(i % columns), y = lot * (double)(i / columns);
        if (random_between(&chance, 0, (double)(lots - i)) >= (double)(n - planted)) {
            TRY(add_ground(list, x, y, x + lot, y + lot, error));
            continue;
        }
        tree *t = &trees[planted++];
        t->foot[0] = micrometres(x + lot / 2 + random_between(&shape, -astray, astray));
        t->foot[1] = micrometres(y + lot / 2 + random_between(&shape, -astray, astray));
        t->trunk = random_between(&shape, trunk_radius[0], trunk_radius[1]);
        t->middle = random_between(&shape, crown_middle[0], crown_middle[1]);
        t->radius = random_between(&shape, crown_radius[0], crown_radius[1]);
        t->rise = random_between(&shape, crown_rise[0], crown_rise[1]);
        TRY(add_tree(list, t, x, y, error));
    }
done:
    return status;
}

lam_status generate_canopy(scene_draft *d, const generate_options *options, lam_error *error) {
    lam_status status = LAM_OK;
    patch_list list = {.groups = groups, .n_groups = GROUPS};
    const size_t wanted = options->elements > 0 ? options->elements : CANOPY_ELEMENTS;
    const size_t n = wanted < PER_TREE ? 1 : (wanted + PER_TREE / 2) / PER_TREE;
    tree *trees = memory_allocate(n, sizeof *trees, "trees", error);
    if (trees == NULL) TRY(LAM_ERR_MEMORY);
    d->decimals = DECIMALS;
    TRY(plant(&list, trees, n, options->seed, error));
    TRY(patches_draw(&list, d, options, (size_t)fmax(1, bare_share * (double)wanted), error));
    const size_t leaves = wanted > d->n_faces + 2 * n ? (wanted - d->n_faces) / 2 : n; /* two faces each */
    TRY(scene_draft_group(d, "leaf", &green, error));
    for (size_t i = 0; i < n; i++) {
        uint64_t r = random_stream(options->seed, 3 + i);
        for (size_t k = leaves * i / n; k < leaves * (i + 1) / n; k++)
            TRY(draw_leaf(d, &r, &trees[i], error));
    }
done:
    free(trees);
    patches_free(&list);
    return status;
}
