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

/* Values that are looked at together, and lanes of their least and largest. */
enum { AT_ONCE = 256, LANES = 8 };

/* Values of a group that its figures take in, and their areas. */
typedef struct portion {
    size_t count;
    double value[AT_ONCE], area[AT_ONCE];
} portion;

/* Takes those of elements first ... last - 1 of a group, at most AT_ONCE; areas only where it weighs them. */
static void take_portion(const group_index *groups, const value_row *row, uint32_t g, size_t first,
                         size_t last, const double *area, bool weighs, portion *p) {
    const uint32_t *elements = groups->elements + groups->start[g];
    const float *side_by_side = row->begin != NULL && row->x.doubles == NULL && groups->buried == NULL
                                    ? row->x.floats + row->first + row->begin[g]
                                    : NULL;
    p->count = 0;
    if (side_by_side != NULL) {
        for (size_t e = first; e < last; e++) p->value[e - first] = (double)side_by_side[e];
        p->count = last - first;
    } else {
        for (size_t e = first; e < last; e++)
            if (group_index_counts(groups, elements[e])) p->value[p->count++] = value_of(row, g, e, elements);
    }
    size_t count = 0;
    for (size_t e = first; weighs && e < last; e++)
        if (group_index_counts(groups, elements[e])) p->area[count++] = area_of(area, elements[e]);
}

typedef void portion_look(void *context, const portion *p);

/* Calls look with all values of some groups, in their order. */
static void look_at_groups(size_t n_named, const uint32_t *named, const group_index *groups,
                           const double *area, bool weighs, const value_row *row, portion_look *look,
                           void *context) {
    portion p;
    for (size_t m = 0; m < n_named; m++) {
        const uint32_t g = named[m];
        const size_t size = groups->start[g + 1] - groups->start[g];
        for (size_t first = 0; first < size; first += AT_ONCE) {
            take_portion(groups, row, g, first, size - first < AT_ONCE ? size : first + AT_ONCE, area, weighs,
                         &p);
            look(context, &p);
        }
    }
}

typedef struct bounds {
    double low, high;
} bounds;

/* A value that is NaN is passed over. */
static void widen(void *context, const portion *p) {
    bounds *b = context;
    double low[LANES], high[LANES];
    size_t k = 0;
    for (size_t l = 0; l < LANES; l++) {
        low[l] = b->low;
        high[l] = b->high;
    }
    for (; k + LANES <= p->count; k += LANES)
        for (size_t l = 0; l < LANES; l++) {
            const double x = p->value[k + l];
            low[l] = x < low[l] ? x : low[l];
            high[l] = x > high[l] ? x : high[l];
        }
    for (size_t l = 0; k < p->count; k++, l++) {
        low[l] = p->value[k] < low[l] ? p->value[k] : low[l];
        high[l] = p->value[k] > high[l] ? p->value[k] : high[l];
    }
    for (size_t l = 0; l < LANES; l++) {
        b->low = low[l] < b->low ? low[l] : b->low;
        b->high = high[l] > b->high ? high[l] : b->high;
    }
}

typedef struct sums {
    double total, sum, squares, mean;
} sums;

static void add_up(void *context, const portion *p) {
    sums *s = context;
    for (size_t k = 0; k < p->count; k++) {
        s->total += p->area[k];
        s->sum += p->area[k] * p->value[k];
    }
}

static void add_squares(void *context, const portion *p) {
    sums *s = context;
    for (size_t k = 0; k < p->count; k++) {
        const double off = p->value[k] - s->mean;
        s->squares += p->area[k] * off * off;
    }
}

/* True where an element that counts has an area. */
static bool have_area(size_t n_named, const uint32_t *named, const group_index *groups, const double *area) {
    for (size_t m = 0; m < n_named; m++)
        for (uint32_t k = groups->start[named[m]]; k < groups->start[named[m] + 1]; k++) {
            const uint32_t i = groups->elements[k];
            if (group_index_counts(groups, i) && area_of(area, i) > 0) return true;
        }
    return false;
}

void group_statistics(size_t n_named, const uint32_t *named, const group_index *groups, const double *area,
                      const value_row *row, unsigned asked, double out[REDUCE_COUNT]) {
    const unsigned extremes = REDUCE_BIT(MIN) | REDUCE_BIT(MAX) | REDUCE_BIT(UNIFORMITY),
                   means = REDUCE_BIT(MEAN) | REDUCE_BIT(SUM) | REDUCE_BIT(UNIFORMITY) | REDUCE_BIT(VARIANCE);
    bounds b = {.low = INFINITY, .high = -INFINITY};
    sums s = {.total = 0};
    for (size_t k = 0; k < REDUCE_COUNT; k++) out[k] = NAN;
    if (!have_area(n_named, named, groups, area)) return;
    if (asked & extremes) look_at_groups(n_named, named, groups, area, false, row, widen, &b);
    if (asked & means) look_at_groups(n_named, named, groups, area, true, row, add_up, &s);
    s.mean = s.sum / s.total;
    if (asked & REDUCE_BIT(VARIANCE))
        look_at_groups(n_named, named, groups, area, true, row, add_squares, &s);
    if (asked & REDUCE_BIT(MEAN)) out[REDUCE_MEAN] = s.mean;
    if (asked & REDUCE_BIT(SUM)) out[REDUCE_SUM] = s.sum;
    if (asked & REDUCE_BIT(MIN)) out[REDUCE_MIN] = b.low;
    if (asked & REDUCE_BIT(MAX)) out[REDUCE_MAX] = b.high;
    if (asked & REDUCE_BIT(UNIFORMITY) && s.mean != 0) out[REDUCE_UNIFORMITY] = b.low / s.mean;
    if (asked & REDUCE_BIT(VARIANCE)) out[REDUCE_VARIANCE] = s.squares / s.total;
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
    group_statistics(n_named, named, groups, area, &(value_row){.x = x}, ~0u, out);
}
