/* Figures of a year against the plainest way to find them: every vector solved by itself, every hour counted.
 */
#include "solver/base/random.h"
#include "solver/light/annual.h"
#include "solver/operator/operator.h"
#include "solver/operator/sky_light.h"
#include "support/failing_memory.h"
#include "support/suite.h"
#include "support/transport.h"

#include <math.h>
#include <string.h>

enum { N = 23, C = 2, TILES = 5, HOURS = 24 * 10 };

typedef struct place {
    lam_operator *op;
    lam_sky *sky;
    emission light;
} place;

/* Light of nights and days: every third lit hour has a lamp of its own unless steady, nights are dark. */
static place make_place(bool steady, bool lamp) {
    place p = {.light = {.n_vectors = HOURS, .batch = true, .steady = steady}};
    lam_error error = {0};
    uint64_t seed = 7;
    float *P = malloc(sizeof(float) * C * N * N), first_bounce[TILES * N], reflectance[C * N];
    for (size_t i = 0; i < C * N; i++)
        reflectance[i] = i == 4 ? 0 : (float)(.1 + .8 * random_lcg_unit(&seed));
    for (size_t i = 0; i < (size_t)C * N * N; i++) P[i] = (float)(.05 * random_lcg_unit(&seed));
    for (size_t i = 0; i < TILES * N; i++) first_bounce[i] = (float)random_lcg_unit(&seed);
    ck_assert_int_eq(operator_exact_create(N, C, reflectance, P, &p.op, &error), LAM_OK);
    ck_assert_int_eq(sky_create(TILES, N, first_bounce, &p.sky, &error), LAM_OK);
    const size_t n_E = steady ? 1 : HOURS;
    p.light.E = test_allocate(n_E * C * N, sizeof(float));
    p.light.L = test_allocate((size_t)HOURS * C * TILES, sizeof(float));
    for (size_t h = 0; h < HOURS; h++) {
        const bool day = h % 24 >= 6 && h % 24 < 19;
        for (size_t t = 0; t < C * TILES; t++)
            p.light.L[h * C * TILES + t] = day ? (float)(100 * random_lcg_unit(&seed)) : 0;
        for (size_t i = 0; i < C * N; i++)
            if (h < n_E) p.light.E[h * C * N + i] = lamp && h % 3 == 0 ? (float)random_lcg_unit(&seed) : 0;
    }
    return p;
}

static void free_place(place *p) {
    lam_operator_close(p->op);
    lam_sky_close(p->sky);
    emission_free(&p->light);
}

/* A figure of element row i (of C N), by the definition. */
static double figure_of(const place *p, lam_quantity quantity, const annual_figure *f, double hours,
                        double from, double to, size_t i) {
    lam_error error = {0};
    const size_t bytes = lam_operator_work_bytes(p->op, 1);
    void *work = malloc(bytes);
    double sum = 0, hit = 0, counted = 0;
    for (size_t h = 0; h < HOURS; h++) {
        float H0[C * N], x[C * N];
        lam_sky_irradiance(p->sky, C, p->light.L + h * C * TILES, H0);
        ck_assert_int_eq(lam_operator_apply_lit(p->op, 1, quantity,
                                                p->light.E + (p->light.steady ? 0 : h * C * N), H0, x, work,
                                                bytes, &error),
                         LAM_OK);
        const double of_day = fmod((double)h * hours, 24), value = (double)x[i];
        sum += value * hours / 1000;
        if (of_day < from - 1e-9 || of_day + hours > to + 1e-9) continue;
        counted++;
        hit += value >= f->low && value <= f->high;
    }
    free(work);
    return f->is_sum ? sum : hit / counted;
}

typedef struct wanted {
    bool steady, lamp;
    lam_quantity quantity;
    const char *items[3], *occupied;
    double hours;
    bool some;
} wanted;

static void check(const wanted *w) {
    static const uint32_t chosen[] = {3, 4, 17};
    place p = make_place(w->steady, w->lamp);
    lam_error error = {0};
    annual_options wish = {.hours = w->hours, .from = 0, .to = 24};
    annual_summary sum = {0};
    float *values = NULL;
    size_t between = 0;
    for (size_t k = 0; k < 3 && w->items[k] != NULL; k++)
        ck_assert_msg(annual_add(&wish, w->items[k], &error) == LAM_OK, "%s", error.message);
    if (w->occupied != NULL) ck_assert_int_eq(annual_parse_occupied(w->occupied, &wish, &error), LAM_OK);
    ck_assert_msg(annual_apply(&wish, &p.light, p.op, p.sky, w->quantity, w->some ? 3 : 0,
                               w->some ? chosen : NULL, NULL, &values, &sum, &error) == LAM_OK,
                  "%s", error.message);
    ck_assert_uint_eq(sum.n, HOURS);
    ck_assert_uint_eq(sum.counted, (size_t)lround((wish.to - wish.from) / 24 * HOURS));
    for (size_t k = 0; k < wish.n_figures; k++)
        for (size_t i = 0; i < C * N; i++) {
            const bool asked = !w->some || i % N == 3 || i % N == 4 || i % N == 17;
            const double got = (double)values[k * C * N + i];
            const double right =
                asked ? figure_of(&p, w->quantity, &wish.figures[k], wish.hours, wish.from, wish.to, i) : 0;
            /* Sums of single precision both; shares are whole hours over whole hours, rounded once. */
            const double tolerance = wish.figures[k].is_sum ? 1e-5 * fabs(right) : 6e-8 * right;
            ck_assert_msg(fabs(got - right) <= tolerance, "%s[%zu] = %.9g, is %.9g", wish.figures[k].name, i,
                          got, right);
            between += right > 0 && right < 1;
        }
    ck_assert_uint_gt(between, 0);
    free(values);
    free_place(&p);
}

START_TEST(figures) {
    static const wanted all[] = {
        {.steady = true, .quantity = LAM_IRRADIANCE, .items = {"sum", "autonomy=130", "useful=60,160"}},
        {.steady = true, .lamp = true, .quantity = LAM_RADIOSITY, .items = {"useful=20,60", "sum"}},
        {.lamp = true, .quantity = LAM_IRRADIANCE, .items = {"autonomy=.4", "autonomy=130", "sum"}},
        {.lamp = true, .quantity = LAM_INDIRECT, .items = {"sum", "autonomy=5"}, .some = true},
        {.quantity = LAM_IRRADIANCE, .items = {"useful=0,130", "useful=1,130"}, .occupied = "4-22"},
        {.quantity = LAM_IRRADIANCE, .items = {"autonomy=130", "sum"}, .occupied = "8-18", .some = true},
        {.quantity = LAM_IRRADIANCE, .items = {"autonomy=130", "sum"}, .occupied = "0-9", .hours = .5},
        {.quantity = LAM_IRRADIANCE, .items = {"autonomy=130", "sum"}, .occupied = "12-24", .hours = 3},
    };
    wanted w = all[_i];
    if (w.hours == 0) w.hours = 1;
    check(&w);
}
END_TEST

/* Both bounds are within, and dark hours are useful from 0 on. */
START_TEST(bounds) {
    lam_error error = {0};
    lam_operator *op = NULL;
    annual_options wish = {.hours = 1, .from = 0, .to = 24};
    annual_summary sum = {0};
    const float reflectance[1] = {.5f};
    /* .1 and .3 lie between floats; the float next to .1 is above it, and so is that of .3. */
    float light[] = {0, 100, 2000, 2001, 99, 300, .1f, nextafterf(.1f, 0), .3f, nextafterf(.3f, 0)},
          *values = NULL;
    const emission e = {.n_vectors = 10, .batch = true, .E = light};
    float *P = calloc(1, sizeof *P);
    ck_assert_int_eq(operator_exact_create(1, 1, reflectance, P, &op, &error), LAM_OK);
    static const char *const items[] = {"useful=100,2000", "autonomy=300", "useful=0,99", "sum",
                                        "useful=.1,.3"};
    for (size_t k = 0; k < 5; k++) ck_assert_int_eq(annual_add(&wish, items[k], &error), LAM_OK);
    ck_assert_int_eq(annual_apply(&wish, &e, op, NULL, LAM_RADIOSITY, 0, NULL, NULL, &values, &sum, &error),
                     LAM_OK);
    ck_assert_float_eq(values[0], 3.f / 10);
    ck_assert_float_eq(values[1], 3.f / 10);
    ck_assert_float_eq(values[2], 6.f / 10);
    ck_assert_float_eq_tol(values[3], 4.5008f, 1e-6f);
    ck_assert_float_eq(values[4], 2.f / 10);
    ck_assert(sum.n == 10 && sum.lit == 9 && sum.counted == 10);
    ck_assert_str_eq(wish.figures[0].name, "useful_100_2000");
    free(values);
    lam_operator_close(op);
}
END_TEST

/* Half of the hours of a year are those of daylight: 3 of 6 months here, of which a place has 2 and 6 with so
 * much; 6 of 3 are all. */
START_TEST(hours_of_daylight) {
    annual_options wish = {.hours = 1460, .from = 0, .to = 24};
    lam_error error = {0};
    lam_operator *op = NULL;
    annual_summary sum = {0};
    const float reflectance[1] = {.5f};
    float light[] = {0, 100, 2000, 2001, 99, 1}, *values = NULL;
    const emission e = {.n_vectors = 6, .batch = true, .E = light};
    float *P = calloc(1, sizeof *P);
    ck_assert_int_eq(operator_exact_create(1, 1, reflectance, P, &op, &error), LAM_OK);
    static const char *const items[] = {"daylit=300", "daylit=1"};
    for (size_t k = 0; k < 2; k++) ck_assert_int_eq(annual_add(&wish, items[k], &error), LAM_OK);
    ck_assert_int_eq(annual_apply(&wish, &e, op, NULL, LAM_RADIOSITY, 0, NULL, NULL, &values, &sum, &error),
                     LAM_OK);
    ck_assert_float_eq(values[0], 2.f / 3);
    ck_assert_float_eq(values[1], 1);
    free(values);
    wish.hours = 1;
    ck_assert_int_eq(annual_apply(&wish, &e, op, NULL, LAM_RADIOSITY, 0, NULL, NULL, &values, &sum, &error),
                     LAM_ERR_ARGUMENT);
    ck_assert_ptr_nonnull(strstr(error.message, "6 vectors of 1 h, 0.25 days"));
    wish.hours = 1460, wish.from = 8;
    ck_assert_int_eq(annual_apply(&wish, &e, op, NULL, LAM_RADIOSITY, 0, NULL, NULL, &values, &sum, &error),
                     LAM_ERR_ARGUMENT);
    lam_operator_close(op);
}
END_TEST

static bool stopped(void *context) {
    size_t *asked = context;
    return (*asked)++ == 1;
}

START_TEST(ctrl_c) {
    place p = make_place(true, true);
    size_t asked = 0;
    const progress steps = {.cancelled = stopped, .context = &asked};
    lam_error error = {0};
    annual_options wish = {.hours = 1, .from = 0, .to = 24};
    annual_summary sum;
    float *values = NULL;
    ck_assert_int_eq(annual_add(&wish, "autonomy=1", &error), LAM_OK);
    ck_assert_int_eq(
        annual_apply(&wish, &p.light, p.op, p.sky, LAM_IRRADIANCE, 0, NULL, &steps, &values, &sum, &error),
        LAM_ERR_CANCELLED);
    ck_assert_uint_eq(asked, 2); /* between the first pass and the second */
    ck_assert_ptr_null(values);
    free_place(&p);
}
END_TEST

START_TEST(no_memory) {
    static const uint32_t chosen[] = {3};
    place p = make_place(false, true);
    lam_error error = {0};
    annual_options wish = {.hours = 1, .from = 0, .to = 24};
    annual_summary sum;
    float *values = NULL;
    ck_assert_int_eq(annual_add(&wish, "sum", &error), LAM_OK);
    ck_assert_int_eq(annual_add(&wish, "autonomy=1", &error), LAM_OK);
    long failed = 0;
    for (lam_status status = LAM_ERR_MEMORY; status != LAM_OK; failed++) {
        allocations_left = failed;
        status = annual_apply(&wish, &p.light, p.op, p.sky, LAM_IRRADIANCE, 1, chosen, NULL, &values, &sum,
                              &error);
        allocations_left = -1;
        if (status != LAM_OK) {
            ck_assert_int_eq(status, LAM_ERR_MEMORY);
            ck_assert_ptr_null(values);
        }
    }
    ck_assert_int_gt(failed, 10);
    free(values);
    free_place(&p);
}
END_TEST

START_TEST(wrong) {
    lam_error error = {0};
    annual_options wish = {.hours = 1, .from = 0, .to = 24};
    annual_summary sum;
    float *values = NULL;
    static const char *const items[] = {
        "daylit",     "daylit=0",     "daylit=x",     "",           "sums",
        "sum=1",      "autonomy",     "autonomy=",    "autonomy=0", "autonomy=-1",
        "autonomy=x", "autonomy=1,2", "autonomy=nan", "useful=100", "useful=1,2,3",
        "useful=2,1", "useful=2,2",   "useful=-1,2",  "useful=1;2"};
    static const char *const hours[] = {"",     "8",     "8-",    "-8",    "8-8",   "18-8", "0-25",
                                        "8:18", "8-18x", "8.5-9", " 8-18", "8--18", "8-180"};
    for (size_t k = 0; k < sizeof items / sizeof items[0]; k++)
        ck_assert_msg(annual_add(&wish, items[k], &error) == LAM_ERR_ARGUMENT, "'%s' was read", items[k]);
    for (size_t k = 0; k < sizeof hours / sizeof hours[0]; k++)
        ck_assert_msg(annual_parse_occupied(hours[k], &wish, &error) == LAM_ERR_ARGUMENT, "'%s' was read",
                      hours[k]);
    ck_assert(wish.n_figures == 0 && wish.from == 0 && wish.to == 24);
    ck_assert_int_eq(annual_add(&wish, "autonomy=300", &error), LAM_OK);
    ck_assert_int_eq(annual_add(&wish, "autonomy=3e2", &error), LAM_ERR_ARGUMENT);
    ck_assert_ptr_nonnull(strstr(error.message, "asked for twice"));
    for (int k = 1; k < ANNUAL_MOST; k++) {
        char item[32];
        snprintf(item, sizeof item, "autonomy=%d", k);
        ck_assert_int_eq(annual_add(&wish, item, &error), LAM_OK);
    }
    ck_assert_int_eq(annual_add(&wish, "sum", &error), LAM_ERR_ARGUMENT);
    place p = make_place(true, false);
    static const struct {
        size_t n;
        double hours;
        const char *says;
    } days[] = {{HOURS - 1, 1, "239 vectors of 1 hours are not whole days; it takes 24 a day"},
                {HOURS, .7, "vectors of 0.7 hours do not make days of 24"},
                {HOURS, 48, "vectors of 48 hours do not make days"},
                {HOURS, 12, "no vector of 12 hours has its middle"}};
    ck_assert_int_eq(annual_parse_occupied("8-11", &wish, &error), LAM_OK);
    for (size_t k = 0; k < sizeof days / sizeof days[0]; k++) {
        p.light.n_vectors = days[k].n;
        wish.hours = days[k].hours;
        ck_assert_int_eq(
            annual_apply(&wish, &p.light, p.op, p.sky, LAM_IRRADIANCE, 0, NULL, NULL, &values, &sum, &error),
            LAM_ERR_ARGUMENT);
        ck_assert_msg(strstr(error.message, days[k].says) != NULL, "%s", error.message);
    }
    free_place(&p);
}
END_TEST

int main(void) {
    Suite *s = suite_create("annual");
    TCase *c = tcase_create("all");
    tcase_set_timeout(c, 120);
    tcase_add_loop_test(c, figures, 0, 8);
    tcase_add_test(c, bounds);
    tcase_add_test(c, hours_of_daylight);
    tcase_add_test(c, ctrl_c);
    tcase_add_test(c, no_memory);
    tcase_add_test(c, wrong);
    suite_add_tcase(s, c);
    return suite_run(s);
}
