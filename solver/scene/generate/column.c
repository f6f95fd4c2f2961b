#include "solver/scene/generate/column.h"

#include <assert.h>
#include <math.h>
#include <string.h>

/* The corners of the column at a height; the last repeats the first. */
static void ring(const column *c, double z, double radius, double out[COLUMN_SIDES_MOST + 1][3]) {
    assert(c->sides > 0 && c->sides % 8 == 0 && c->sides <= COLUMN_SIDES_MOST);
    for (size_t k = 0; k < c->sides; k++) {
        const double angle = 2 * M_PI * (double)k / (double)c->sides;
        out[k][0] = c->middle[0] + radius * cos(angle);
        out[k][1] = c->middle[1] + radius * sin(angle);
        out[k][2] = z;
    }
    memcpy(out[c->sides], out[0], sizeof *out);
}

/* Points of the square's border in the same directions; those on a side have its coordinate to the bit. */
static void border(const column *c, const double low[2], const double high[2], double z,
                   double out[COLUMN_SIDES_MOST + 1][3]) {
    const size_t eighth = c->sides / 8;
    assert(c->sides > 0 && c->sides <= COLUMN_SIDES_MOST);
    for (size_t k = 0; k < c->sides; k++) {
        const double angle = 2 * M_PI * (double)k / (double)c->sides;
        const double direction[2] = {cos(angle), sin(angle)};
        const size_t octant = k / eighth;
        for (int axis = 0; axis < 2; axis++) {
            const double to = direction[axis] > 0 ? high[axis] : low[axis];
            const bool corner = k % eighth == 0 && octant % 2 == 1;
            const bool side = fabs(direction[axis]) > fabs(direction[1 - axis]);
            const double share = fabs(direction[axis]) / fabs(direction[1 - axis]);
            out[k][axis] = corner || side ? to : c->middle[axis] + (to - c->middle[axis]) * share;
        }
        out[k][2] = z;
    }
    memcpy(out[c->sides], out[0], sizeof *out);
}

/* Four points around, either way. */
static lam_status add_quad(const column *c, const double *corners[4], bool turned, patch_list *out,
                           lam_error *error) {
    double quad[4][3];
    for (int k = 0; k < 4; k++) memcpy(quad[k], corners[turned ? 3 - k : k], sizeof *quad);
    return patch_add(out, (const double(*)[3])quad, 4, c->group, error);
}

lam_status column_square(const column *c, const double low[2], const double high[2], double z, double radius,
                         bool down, patch_list *out, lam_error *error) {
    lam_status status = LAM_OK;
    double outer[COLUMN_SIDES_MOST + 1][3], inner[COLUMN_SIDES_MOST + 1][3];
    border(c, low, high, z, outer);
    ring(c, z, radius, inner);
    for (size_t k = 0; k < c->sides; k++) {
        const double *corners[4] = {outer[k], outer[k + 1], inner[k + 1], inner[k]};
        TRY(add_quad(c, corners, down, out, error));
    }
done:
    return status;
}

lam_status column_band(const column *c, double z0, double radius0, double z1, double radius1, patch_list *out,
                       lam_error *error) {
    lam_status status = LAM_OK;
    double lower[COLUMN_SIDES_MOST + 1][3], upper[COLUMN_SIDES_MOST + 1][3];
    ring(c, z0, radius0, lower);
    ring(c, z1, radius1, upper);
    for (size_t k = 0; k < c->sides; k++) {
        const double *corners[4] = {lower[k], lower[k + 1], upper[k + 1], upper[k]};
        double tip[3][3];
        if (radius1 > 0) {
            TRY(add_quad(c, corners, false, out, error));
            continue;
        }
        for (int i = 0; i < 3; i++) memcpy(tip[i], corners[i], sizeof *tip);
        TRY(patch_add(out, (const double(*)[3])tip, 3, c->group, error));
    }
done:
    return status;
}
