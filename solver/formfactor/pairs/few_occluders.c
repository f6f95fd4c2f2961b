#include "solver/formfactor/pairs/few_occluders.h"

#include "solver/formfactor/sight/windows.h"

#include <math.h>

lam_status few_occluders_make(const mesh *m, const visibility *v, const polygon *polygons,
                              const pair_factor_rules *rules, uint64_t seed, int most, few_occluders *out,
                              lam_error *error) {
    few_occluders f = {.m = m,
                       .v = v,
                       .polygons = polygons,
                       .rules = rules,
                       .seed = seed,
                       .most = most < UNCUT_OCCLUDERS_MOST ? most : UNCUT_OCCLUDERS_MOST};
    const lam_status status =
        occluders_make(m, visibility_facets(v), visibility_rounding(v), &f.occluders, error);
    if (status == LAM_OK) *out = f;
    return status;
}

void few_occluders_free(few_occluders *f) {
    occluders_free(&f->occluders);
}

bool few_occluders_apply(const few_occluders *f) {
    return f->most > 0 && f->occluders.n > 0 && f->occluders.n <= FEW_OCCLUDERS;
}

/* True where most links of a sample have up to `most` occluders. */
static bool are_mostly_few(const few_occluders *f, const cluster_tree *t, const cluster_links *links,
                           int most) {
    enum { SAMPLE = 2000 };
    const size_t step = links->n / SAMPLE + 1;
    size_t counted = 0, uncounted = 0;
    for (size_t k = 0; k < links->n; k += step) {
        const cluster_link *link = &links->links[k];
        const cluster *a = &t->clusters[link->a], *b = &t->clusters[link->b];
        link_occluders among;
        shaft s;
        if (link->open || link->a == link->b) continue;
        cluster_shaft_init(&s, a, b, f->occluders.slack);
        link_occluders_find(&f->occluders, &s, a, b, most, &among);
        counted += among.count >= 0;
        uncounted += among.count < 0;
    }
    return counted > uncounted;
}

bool few_occluders_pay(const few_occluders *f, const cluster_tree *t, const cluster_links *links) {
    if (f->most == 0 || f->occluders.n <= FEW_OCCLUDERS) return few_occluders_apply(f);
    return are_mostly_few(f, t, links, link_occluders_projected(&f->occluders));
}

bool few_occluders_are_listed(const few_occluders *f, const cluster_tree *t, const cluster_links *links) {
    return f->most > 0 && f->occluders.n > 0 && are_mostly_few(f, t, links, TESTED_OCCLUDERS_MOST);
}

double few_occluders_tolerance(const few_occluders *f, uint32_t i, uint32_t j, double g, double accuracy) {
    return accuracy / 3 * fmin(f->m->area[i], f->m->area[j]) / g;
}

/* Both sides of a two-sided element lie in one facet. */
static uint32_t facet_of(const few_occluders *f, uint32_t element) {
    const size_t n_fronts = f->m->two_sided ? f->m->n / 2 : f->m->n;
    return visibility_facets(f->v)->of_element[element < n_fronts ? element : element - n_fronts];
}

few_verdict few_occluders_share(const few_occluders *f, const link_occluders *among, uint32_t i, uint32_t j,
                                double g, double tolerance, double *share, double *work) {
    polygon a, b;
    pair_occluders between;
    if (among->count == OCCLUDERS_UNCOUNTED) return FEW_UNDECIDED;
    polygon_in_front(&f->polygons[i], &f->polygons[j], &a);
    polygon_in_front(&f->polygons[j], &f->polygons[i], &b);
    if (a.n == 0 || b.n == 0) return FEW_UNDECIDED;
    const uint32_t own[2] = {facet_of(f, i), facet_of(f, j)};
    const double rise[2] = {visibility_rise(f->v, i), visibility_rise(f->v, j)};
    pair_occluders_find(&f->occluders, among, &a, &b, own, rise, &between);
    if (between.hidden) {
        *share = 0;
        return FEW_HIDDEN;
    }
    double full = 0; /* g where windows cut the pair */
    if (between.count != 0 && between.count != 1) {
        const windows_found found = windows_cut(&f->occluders, among, own, rise, &a, &b);
        if (found == WINDOWS_CUT) {
            pair_occluders_find(&f->occluders, among, &a, &b, own, rise, &between);
            full = g;
        }
        if (found == WINDOWS_CLOSED || between.hidden) {
            *share = 0;
            return FEW_HIDDEN;
        }
    }
    if (between.count == OCCLUDERS_UNCOUNTED || between.count > (full > 0 ? PAIR_OCCLUDERS_MOST : f->most))
        return FEW_UNDECIDED;
    if (between.count == 0 && full <= 0) {
        *share = 1;
        return FEW_OPEN;
    }
    const projection p = {f->rules, &f->occluders, f->seed};
    const projected_pair pair = {i, j, &a, &b, &between, full};
    const double found = projection_share(&p, &pair, tolerance, work);
    if (found < 0) return FEW_UNDECIDED;
    *share = found;
    return found <= 0 ? FEW_HIDDEN : FEW_PARTIAL;
}

few_verdict few_occluders_between(const few_occluders *f, const link_occluders *among, uint32_t i, uint32_t j,
                                  pair_occluders *between) {
    polygon a, b;
    *between = (pair_occluders){.count = OCCLUDERS_UNCOUNTED};
    polygon_in_front(&f->polygons[i], &f->polygons[j], &a);
    polygon_in_front(&f->polygons[j], &f->polygons[i], &b);
    if (a.n == 0 || b.n == 0) return FEW_UNDECIDED;
    const uint32_t own[2] = {facet_of(f, i), facet_of(f, j)};
    const double rise[2] = {visibility_rise(f->v, i), visibility_rise(f->v, j)};
    pair_occluders_find(&f->occluders, among, &a, &b, own, rise, between);
    if (between->hidden) return FEW_HIDDEN;
    return between->count == 0 ? FEW_OPEN : FEW_UNDECIDED;
}
