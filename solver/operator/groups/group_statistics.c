#include "solver/operator/groups/group_statistics.h"

#include <math.h>

static double value_at(reduce_values x, size_t i) {
    return x.doubles != NULL ? x.doubles[i] : (double)x.floats[i];
}

static double value_of(const value_row *row, uint32_t g, size_t e, const uint32_t *elements) {
    return value_at(row->x, row->first + (row->begin != NULL ? row->begin[g] + e : elements[e]));
}

/* area NULL: all are 1. */
static double area_of(const double *area, uint32_t element) {
    return area != NULL ? area[element] : 1;
}

void group_statistics(size_t n_named, const uint32_t *named, const group_index *groups, const double *area,
                      const value_row *row, double out[REDUCE_COUNT]) {
    double total = 0, sum = 0, squares = 0, low = INFINITY, high = -INFINITY;
    for (size_t m = 0; m < n_named; m++) {
        const uint32_t g = named[m], *elements = groups->elements + groups->start[g];
        for (size_t e = 0; e < groups->start[g + 1] - groups->start[g]; e++) {
            const double value = value_of(row, g, e, elements), A = area_of(area, elements[e]);
            if (!group_index_counts(groups, elements[e])) continue;
            total += A;
            sum += A * value;
            low = fmin(low, value);
            high = fmax(high, value);
        }
    }
    const double mean = sum / total;
    for (size_t m = 0; m < n_named; m++) {
        const uint32_t g = named[m], *elements = groups->elements + groups->start[g];
        for (size_t e = 0; e < groups->start[g + 1] - groups->start[g]; e++) {
            const double off = value_of(row, g, e, elements) - mean;
            if (!group_index_counts(groups, elements[e])) continue;
            squares += area_of(area, elements[e]) * off * off;
        }
    }
    const bool any = total > 0;
    out[REDUCE_MEAN] = any ? mean : NAN;
    out[REDUCE_SUM] = any ? sum : NAN;
    out[REDUCE_MIN] = any ? low : NAN;
    out[REDUCE_MAX] = any ? high : NAN;
    out[REDUCE_UNIFORMITY] = any && mean != 0 ? low / mean : NAN;
    out[REDUCE_VARIANCE] = any ? squares / total : NAN;
}

double group_share(size_t n_named, const uint32_t *named, const group_index *groups, const double *area,
                   const value_row *row, double limit) {
    double total = 0, reached = 0;
    for (size_t m = 0; m < n_named; m++) {
        const uint32_t g = named[m], *elements = groups->elements + groups->start[g];
        for (size_t e = 0; e < groups->start[g + 1] - groups->start[g]; e++) {
            if (!group_index_counts(groups, elements[e])) continue;
            total += area_of(area, elements[e]);
            if (value_of(row, g, e, elements) >= limit) reached += area_of(area, elements[e]);
        }
    }
    return total > 0 ? reached / total : NAN;
}

void reduce_groups(size_t n_named, const uint32_t *named, const group_index *groups, const double *area,
                   reduce_values x, double out[REDUCE_COUNT]) {
    group_statistics(n_named, named, groups, area, &(value_row){.x = x}, out);
}
