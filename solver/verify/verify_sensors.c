/* The check of a store's sensors: numbers that no list and no rays can give, and rows and the light of
 * luminaires that are found again for some receivers. */
#include "solver/direct/direct_points.h"
#include "solver/formfactor/sky_bounce.h"
#include "solver/luminaire/placed_store.h"
#include "solver/operator/luminaire_light.h"
#include "solver/operator/sensor_light.h"
#include "solver/precompute/precompute.h"
#include "solver/scene/glass.h"
#include "solver/sensor/sensor_luminaires.h"
#include "solver/sensor/sensors_store.h"
#include "solver/verify/verify.h"
#include "store/groups.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

/* The rows of so many receivers, and the light of so many luminaires there, are found again. */
enum { ROWS_AGAIN = 32, LUMINAIRES_AGAIN = 8, MORE_RAYS = 4 };

/* Rays of a row that its store does not state: the fewest, those of --quality draft. */
static const double rays_least = 256;

/* Differences of more standard errors than this are none of chance. */
static const double certain = 5;

/* The rounding of a sum of single weights. Rows are scaled to what their rays and pairs say together, so that
 * no sum is above 1. */
static const double rounding = 1e-4;

/* Exact factors of elements of which nothing is hidden have no noise; of others both halves see the same by
 * chance, which is off by a half of 1/16 of few elements. Direct light at points has their segments alone. */
static const double exact = .01;

/* A row of weights: of elements, in order, with half of the difference of both halves, and of the sky. */
typedef struct weight_row {
    size_t n;
    const uint32_t *element;
    const float *weight, *off;
    double sky, sky_off; /* sums over tiles, over pi */
} weight_row;

/* The arrays of /sensors that are compared. */
typedef struct stored_rows {
    sensor_rows rows;
    float *lit; /* [n_luminaires][n_receivers], NULL without any */
    size_t n_luminaires;
} stored_rows;

static void stored_rows_free(stored_rows *r) {
    sensor_rows_free(&r->rows);
    free(r->lit);
}

static lam_status read_array(store *s, const char *name, store_type type, int rank, size_t *dims, void *out,
                             lam_error *error) {
    char path[64];
    void *data = NULL;
    snprintf(path, sizeof path, STORE_SENSORS "/%s", name);
    const lam_status status = store_read(s, path, type, rank, dims, &data, error);
    if (status == LAM_OK) memcpy(out, &data, sizeof data);
    return status;
}

/* Shapes, ranges and order of these were checked as they were loaded (sensors_load). */
static lam_status read_rows(store *s, size_t n, stored_rows *stored, lam_error *error) {
    lam_status status = LAM_OK;
    sensor_rows *r = &stored->rows;
    double rays = rays_least;
    size_t entries[STORE_MAX_RANK] = {SIZE_MAX}, sky[STORE_MAX_RANK] = {SIZE_MAX, n},
           lit[STORE_MAX_RANK] = {SIZE_MAX, n};
    if (store_has_attribute(s, STORE_SENSORS, "rays"))
        TRY(store_get_number(s, STORE_SENSORS, "rays", &rays, error));
    if (!(rays >= SENSOR_RAYS_LEAST && rays <= SENSOR_RAYS_MOST) || exp2(round(log2(rays))) != rays)
        FAIL(error, LAM_ERR_FORMAT, "%s: " STORE_SENSORS " has %g rays, must be a power of two from %d to %d",
             store_path(s), rays, SENSOR_RAYS_LEAST, SENSOR_RAYS_MOST);
    r->n_receivers = n;
    r->rays = (size_t)rays;
    TRY(read_array(s, "indptr", STORE_U64, 1, (size_t[]){n + 1}, &r->start, error));
    TRY(read_array(s, "indices", STORE_U32, 1, entries, &r->element, error));
    TRY(read_array(s, "weights", STORE_F32, 1, entries, &r->weight, error));
    TRY(read_array(s, "weights_off", STORE_F32, 1, entries, &r->off, error));
    TRY(read_array(s, "backs", STORE_F32, 1, &n, &r->backs, error));
    if (store_has(s, STORE_SENSORS "/sky")) {
        TRY(read_array(s, "sky", STORE_F32, 2, sky, &r->sky, error));
        TRY(read_array(s, "sky_off", STORE_F32, 2, sky, &r->sky_off, error));
        r->n_tiles = sky[0];
    }
    if (store_has(s, STORE_SENSORS "/luminaires")) {
        TRY(read_array(s, "luminaires", STORE_F32, 2, lit, &stored->lit, error));
        stored->n_luminaires = lit[0];
    }
done:
    return status;
}

static weight_row row_of(const sensor_rows *r, size_t i) {
    const size_t first = (size_t)r->start[i];
    weight_row out = {
        (size_t)r->start[i + 1] - first, r->element + first, r->weight + first, r->off + first, 0, 0};
    for (size_t t = 0; r->sky != NULL && t < r->n_tiles; t++) {
        out.sky += (double)r->sky[t * r->n_receivers + i] / M_PI;
        out.sky_off += (double)r->sky_off[t * r->n_receivers + i] / M_PI;
    }
    return out;
}

/* True for a receiver whose weights are shares of its rays. Weights of probes are none, and the rows of all
 * nine harmonics of one are made together. */
static bool has_shares(const lam_sensors *loaded, size_t i) {
    return sensors_shown(loaded, i).kind < SENSOR_HARMONIC;
}

/* Flags, cells of grids, and rows: 0 <= |off| <= weight, and no sum above `most`, which is 1 without panes
 * (mesh_row_most). */
static void check_ranges(const sensor_list *l, const lam_sensors *loaded, const stored_rows *stored,
                         double most, check *c) {
    const sensor_rows *r = &stored->rows;
    for (size_t k = 0; k < l->n_sets; k++) {
        const sensor_set *set = &l->sets[k];
        for (size_t i = set->first; i < set->first + set->count && c->verdict == VERDICT_OK; i++) {
            const bool grid = set->kind == SENSOR_GRIDS;
            if (grid ? l->cell[i] >= set->rows * set->columns ||
                           (i > set->first && l->cell[i] <= l->cell[i - 1])
                     : l->cell[i] != SENSOR_NO_CELL)
                check_say(c, VERDICT_BROKEN, "set %s: receiver %zu is in cell %u, which is none of its own",
                          set->name, i - set->first, (unsigned)l->cell[i]);
        }
    }
    for (size_t i = 0; i < r->n_receivers && c->verdict == VERDICT_OK; i++) {
        const unsigned flags = sensors_shown(loaded, i).flags;
        const bool wall = (double)r->backs[i] > SENSOR_BACKS_MOST;
        const weight_row row = row_of(r, i);
        double sum = row.sky;
        const bool shares = has_shares(loaded, i);
        bool even = true;
        for (size_t k = 0; k < row.n && shares; k++) {
            sum += (double)row.weight[k];
            even = even && fabs((double)row.off[k]) <= (1 + rounding) * (double)row.weight[k];
        }
        if (!(r->backs[i] >= 0 && r->backs[i] <= 1) || ((flags & SENSOR_IN_WALL) != 0) != wall ||
            ((flags & SENSOR_IN_LUMINAIRE) != 0 && stored->n_luminaires == 0))
            check_say(c, VERDICT_BROKEN, "receiver %zu: flags %u beside %.3g of rays that meet backs", i,
                      flags, (double)r->backs[i]);
        else if (!even)
            check_say(c, VERDICT_BROKEN, "receiver %zu: halves of a weight differ by more than it", i);
        else if (shares && !(sum <= most + rounding))
            check_say(c, VERDICT_BROKEN, "receiver %zu: its weights add up to %.6g, must be at most %g", i,
                      sum, most);
    }
}

static bool is_found_again(const lam_sensors *loaded, size_t i) {
    return lam_sensors_has_value(loaded, i) != 0 && has_shares(loaded, i);
}

/* The receivers that are found again, at equal steps of those that have shares and a value. */
static size_t choose(const lam_sensors *loaded, size_t chosen[ROWS_AGAIN]) {
    const size_t n = lam_sensors_count(loaded);
    size_t count = 0, seen = 0, place = 0;
    for (size_t i = 0; i < n; i++) count += is_found_again(loaded, i);
    const size_t wanted = count < ROWS_AGAIN ? count : ROWS_AGAIN;
    for (size_t i = 0; i < n && place < wanted; i++)
        if (is_found_again(loaded, i) && seen++ == place * count / wanted) chosen[place++] = i;
    return place;
}

/* Sums of both rows: by groups, then of all, with the sky; their halves; and of elements with exact factors.
 */
typedef struct row_sums {
    double rays;             /* of a row */
    double most;             /* that a ray counts (mesh_row_most) */
    double *sum[2], *off[2]; /* [n_groups + 1] */
    double exact[2];
} row_sums;

static void add_row(const mesh *m, const weight_row *row, double *sum, double *off) {
    for (size_t g = 0; g <= m->n_groups; g++) sum[g] = off[g] = 0;
    for (size_t k = 0; k < row->n; k++) {
        const size_t g = m->group[row->element[k]];
        sum[g] += (double)row->weight[k];
        off[g] += (double)row->off[k];
    }
    for (size_t g = 0; g < m->n_groups; g++) {
        sum[m->n_groups] += sum[g];
        off[m->n_groups] += off[g];
    }
    sum[m->n_groups] += row->sky;
    off[m->n_groups] += row->sky_off;
}

/* Factors above the share of a ray are exact; nothing of an element is hidden where halves do not differ. The
 * second row has MORE_RAYS times as many rays, so that hardly any of its weights above that share is theirs.
 */
static void add_exact(const weight_row rows[2], double rays, double sum[2]) {
    sum[0] = sum[1] = 0;
    for (size_t a = 0, b = 0; b < rows[1].n; b++) {
        while (a < rows[0].n && rows[0].element[a] < rows[1].element[b]) a++;
        const bool both = a < rows[0].n && rows[0].element[a] == rows[1].element[b];
        if (!both || !(rows[1].weight[b] > (float)(1 / rays))) continue;
        if (rows[0].off[a] != 0 || rows[1].off[b] != 0) continue;
        sum[0] += (double)rows[0].weight[a];
        sum[1] += (double)rows[1].weight[b];
    }
}

/* The standard error of a share p by rays that count 0 to `most` is no more than
 * (p (most - p) / rays)^1/2 (Bhatia, Davis 2000); p is the mean of both. */
static double noise_of(const row_sums *s, size_t g) {
    const double p = fmin(fmax((s->sum[0][g] + s->sum[1][g]) / 2, 0), s->most);
    return fmax(hypot(s->off[0][g], s->off[1][g]), sqrt(2 * p * (s->most - p) / s->rays));
}

static void compare_row(const mesh *m, size_t i, const weight_row rows[2], row_sums *s, check *c) {
    for (int k = 0; k < 2; k++) add_row(m, &rows[k], s->sum[k], s->off[k]);
    add_exact(rows, s->rays, s->exact);
    /* Without a few elements of which all is seen there is nothing to tell by them. */
    if (s->exact[1] > .05 && !(fabs(s->exact[0] / s->exact[1] - 1) <= exact))
        check_say(
            c, VERDICT_BROKEN,
            "receiver %zu: elements that nothing hides have %.4g times the weights that their places give "
            "(within %.2g)",
            i, s->exact[0] / s->exact[1], exact);
    for (size_t g = 0; g <= m->n_groups && c->verdict == VERDICT_OK; g++) {
        const double off = fabs(s->sum[0][g] - s->sum[1][g]), allowed = certain * noise_of(s, g) + rounding;
        if (!(off <= allowed))
            check_say(c, VERDICT_BROKEN,
                      "receiver %zu: %s has a share of %.4g, found again %.4g (within %.2g)", i,
                      g < m->n_groups ? m->group_names[g] : "all", s->sum[0][g], s->sum[1][g], allowed);
    }
}

static lam_status compare_rows(examination *e, const stored_rows *stored, size_t n, const size_t *chosen,
                               const receiver *at, check *c, lam_error *error) {
    lam_status status = LAM_OK;
    const mesh *m = &e->m;
    sensor_rows again = {.n = 0};
    sky_bounce sky = {.n = 0};
    const size_t rays = MORE_RAYS * stored->rows.rays;
    double *sums = memory_allocate(4, (m->n_groups + 1) * sizeof *sums, "rows of sensors", error);
    if (sums == NULL) TRY(LAM_ERR_MEMORY);
    row_sums s = {.rays = stored->rows.rays,
                  .most = mesh_row_most(m),
                  .sum = {sums, sums + m->n_groups + 1},
                  .off = {sums + 2 * (m->n_groups + 1), sums + 3 * (m->n_groups + 1)}};
    if (stored->rows.sky != NULL) TRY(sky_bounce_load(e->s, m->n, &sky, error));
    const sensor_rows_options how = {.rays = rays < SENSOR_RAYS_MOST ? rays : SENSOR_RAYS_MOST,
                                     .seed = precompute_seed(0, SEED_VERIFY_SENSORS),
                                     .sky = stored->rows.sky != NULL ? &sky : NULL,
                                     .progress = e->progress,
                                     .stage = "sensors"};
    TRY(sensor_rows_make(m, n, at, &how, &again, error));
    for (size_t k = 0; k < n && c->verdict == VERDICT_OK; k++)
        compare_row(m, chosen[k], (weight_row[]){row_of(&stored->rows, chosen[k]), row_of(&again, k)}, &s, c);
done:
    free(sums);
    sensor_rows_free(&again);
    sky_bounce_free(&sky);
    return status;
}

/* A luminaire's light at the receivers is a times what its place and table give: a = sum x y / sum y^2, with
 * the standard error that the residuals x - a y tell. */
static void compare_luminaire(const char *name, size_t n, const float *x, const float *y, check *c) {
    double xy = 0, yy = 0, rest = 0;
    for (size_t k = 0; k < n; k++) {
        xy += (double)x[k] * (double)y[k];
        yy += (double)y[k] * (double)y[k];
    }
    if (!(yy > 0)) return;
    const double a = xy / yy;
    for (size_t k = 0; k < n; k++) rest += pow((double)x[k] - a * (double)y[k], 2);
    const double allowed = exact + certain * sqrt(rest / yy / fmax((double)n - 1, 1));
    if (!(fabs(a - 1) <= allowed))
        check_say(c, VERDICT_BROKEN,
                  "luminaire %s gives the receivers %.4g times the light that its place and table do (within "
                  "%.2g)",
                  name, a, allowed);
}

static lam_status compare_luminaires(examination *e, const stored_rows *stored, size_t n,
                                     const size_t *chosen, const receiver *at, check *c, lam_error *error) {
    lam_status status = LAM_OK;
    const mesh *m = &e->m;
    placed_luminaires p = {.n = 0};
    float *lit = NULL, *again = NULL;
    size_t wanted[LUMINAIRES_AGAIN];
    if (stored->lit == NULL) return LAM_OK;
    TRY(placed_load(e->s, m->n_groups, m->group_names, &p, error));
    if (p.n != stored->n_luminaires) {
        check_say(c, VERDICT_BROKEN, "light of %zu luminaires, the store has %zu", stored->n_luminaires, p.n);
        goto done;
    }
    const size_t n_wanted = p.n < LUMINAIRES_AGAIN ? p.n : LUMINAIRES_AGAIN;
    for (size_t k = 0; k < n_wanted; k++) wanted[k] = k * p.n / n_wanted;
    lit = memory_allocate(n, sizeof *lit, "light of luminaires", error);
    again = memory_allocate(n_wanted, n * sizeof *again, "light of luminaires", error);
    if (lit == NULL || again == NULL) TRY(LAM_ERR_MEMORY);
    const direct_options how = {.seed = precompute_seed(0, SEED_VERIFY_SENSORS),
                                .progress = e->progress,
                                .stage = "sensors",
                                .n_wanted = n_wanted,
                                .wanted = wanted};
    TRY(sensor_luminaires_make(m, &p, &how, n, at, again, NULL, error));
    for (size_t k = 0; k < n_wanted && c->verdict == VERDICT_OK; k++) {
        for (size_t i = 0; i < n; i++) lit[i] = stored->lit[wanted[k] * stored->rows.n_receivers + chosen[i]];
        compare_luminaire(p.luminaires[wanted[k]].name, n, lit, again + k * n, c);
    }
done:
    placed_free(&p);
    free(lit);
    free(again);
    return status;
}

lam_status verify_sensors(examination *e, check *c, lam_error *error) {
    lam_status status = LAM_OK;
    sensor_list l = {.n = 0};
    lam_sensors *loaded = NULL;
    stored_rows stored = {.lit = NULL};
    receiver at[ROWS_AGAIN];
    size_t chosen[ROWS_AGAIN];
    if (!e->has_mesh || !store_has(e->s, STORE_SENSORS)) {
        check_say(c, VERDICT_SKIPPED, e->has_mesh ? "there are none" : "no mesh to compare with");
        return LAM_OK;
    }
    TRY(sensors_load(e->s, e->m.n, e->m.n_channels, &loaded, error));
    TRY(sensors_load_list(e->s, &l, error));
    TRY(read_rows(e->s, l.n, &stored, error));
    const size_t n = choose(loaded, chosen);
    for (size_t k = 0; k < n; k++) at[k] = l.receivers[chosen[k]];
    check_say(c, VERDICT_OK, "%zu in %zu set%s, the rows of %zu of them were found again, as stated", l.n,
              l.n_sets, l.n_sets == 1 ? "" : "s", n);
    check_ranges(&l, loaded, &stored, mesh_row_most(&e->m), c);
    if (c->verdict == VERDICT_OK && n > 0) TRY(compare_rows(e, &stored, n, chosen, at, c, error));
    if (c->verdict == VERDICT_OK && n > 0) TRY(compare_luminaires(e, &stored, n, chosen, at, c, error));
done:
    lam_sensors_close(loaded);
    sensors_free(&l);
    stored_rows_free(&stored);
    return check_failed(c, status, error);
}
