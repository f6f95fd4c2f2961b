/* lambert bench service: lambertd beside servers that compute nothing and beside solves without a server. */
#include "solver/bench/bench_service.h"

#include <errno.h>
#include <ftw.h>
#include <math.h>
#include <omp.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

enum { SIZES_MOST = 3 };

static const table_column load_columns[] = {
    {"n", "", "elements"},
    {"k", "", "columns of the operator"},
    {"format", NULL, "of request and answer, all of n values"},
    {"clients", "", "connections of wrk, each with one request at a time"},
    {"server", NULL,
     "lambertd; ready: the same bytes at once; sleeping: after a solve's time; as many: with "
     "enough asleep at once for lambertd's pace; abreast: with all; nginx: as a file"},
    {"p50_ms", "ms", "half of the answers came within"},
    {"p99_ms", "ms", "99 of 100 came within"},
    {"per_second", "1/s", "answers"},
    {"bytes_sent", "B", "of a request's body"},
    {"bytes_got", "B", "of an answer's body"},
    {"mb_per_second", "MB/s", "both bodies"},
    {"requests", "", "answered in a run"},
    {"runs", "", "of which these are medians"},
    {"note", NULL,
     "why it was not run, how many failed, or that wrk stopped before there were three for each client"},
};

static const table_column solve_columns[] = {
    {"n", "", "elements"},
    {"k", "", "columns of the operator"},
    {"gb", "GB", "that a solve reads"},
    {"solves", NULL, "one after the other, or one vector on each core at once"},
    {"threads", "", "in all"},
    {"p50_ms", "ms", "median of a solve"},
    {"p99_ms", "ms", "99 of 100 took less"},
    {"per_second", "1/s", "solves"},
    {"count", "", "measured"},
};

static const table_column loop_columns[] = {
    {"n", "", "elements"},
    {"k", "", "columns of the operator"},
    {"loop", NULL, "requests in turns on one connection"},
    {"format", NULL, "of request and answer"},
    {"per_second", "1/s", "evaluations: answers"},
    {"p50_ms", "ms", "of the first request"},
    {"p50_second_ms", "ms", "of the second"},
    {"note", NULL, "why it was not run"},
};

static const table_column codec_columns[] = {
    {"n", "", "elements"},
    {"k", "", "columns of the operator"},
    {"parse_ms", "ms", "median of 9 dense JSON answers, as they say themselves"},
    {"solve_ms", "ms", "likewise"},
    {"encode_ms", "ms", "likewise"},
    {"codec_ms", "ms", "parse + encode, median"},
    {"codec_best_ms", "ms", "parse + encode, least"},
};

static const table_column ratio_columns[] = {
    {"n", "", "elements"},
    {"k", "", "columns of the operator"},
    {"what", NULL, "medians of rounds in which both sides had their turn"},
    {"measured", "", ""},
    {"wanted", NULL, "empty: nothing at this size"},
    {"outcome", NULL, "met, missed, not run, too few answers"},
};

#define COLUMNS(of) .columns = of, .n_columns = sizeof of / sizeof *of, .printed = true

static const service_tables empty_tables = {
    .load = {.name = "load", .title = "Servers under load", COLUMNS(load_columns)},
    .solve = {.name = "solve", .title = "Solves in process", COLUMNS(solve_columns)},
    .loop = {.name = "loop",
             .title = "An optimizer's loop on one keep-alive connection",
             COLUMNS(loop_columns)},
    .codec = {.name = "codec", .title = "What dense JSON answers say of their time", COLUMNS(codec_columns)},
    .ratios = {.name = "ratios", .title = "What the service costs beside its solves", COLUMNS(ratio_columns)},
};

/* --- beginning and end ---------------------------------------------------------------------------------- */

static int remove_one(const char *path, const struct stat *about, int type, struct FTW *where) {
    (void)about;
    (void)type;
    (void)where;
    remove(path); /* what cannot be removed stays */
    return 0;
}

static void bench_close(service_bench *b) {
    if (b->folder[0] != '\0') nftw(b->folder, remove_one, 16, FTW_DEPTH | FTW_PHYS);
    table_free(&b->tables.load);
    table_free(&b->tables.solve);
    table_free(&b->tables.loop);
    table_free(&b->tables.codec);
    table_free(&b->tables.ratios);
}

static lam_status make_folder(service_bench *b, lam_error *error) {
    lam_status status = LAM_OK;
    const char *where = getenv("TMPDIR");
    char path[sizeof b->folder], answers[PATH_MAX];
    if (where == NULL || where[0] == '\0') where = "/tmp";
    if (snprintf(path, sizeof path, "%s/lambert-bench-XXXXXX", where) >= (int)sizeof path)
        FAIL(error, LAM_ERR_IO, "%s: the name is too long", where);
    if (mkdtemp(path) == NULL)
        FAIL(error, LAM_ERR_IO, "%s: no folder can be made there: %s; name another in TMPDIR", where,
             strerror(errno));
    /* Others work in it, so that its name must not depend on where we are. */
    char *whole = realpath(path, NULL);
    if (whole == NULL || strlen(whole) >= sizeof b->folder) {
        free(whole);
        rmdir(path);
        FAIL(error, LAM_ERR_IO, "%s: the name is too long", where);
    }
    strcpy(b->folder, whole);
    free(whole);
    snprintf(answers, sizeof answers, "%s/answers", b->folder);
    if (mkdir(answers, 0700) != 0) FAIL(error, LAM_ERR_IO, "%s: %s", answers, strerror(errno));
done:
    return status;
}

static lam_status bench_begin(const bench_run *run, service_bench *b, lam_error *error) {
    lam_status status = LAM_OK;
    *b = (service_bench){.run = run, .threads = omp_get_max_threads(), .tables = empty_tables};
    const ssize_t length = readlink("/proc/self/exe", b->beside, sizeof b->beside - 1);
    if (length <= 0) FAIL(error, LAM_ERR_IO, "/proc/self/exe: %s", strerror(errno));
    b->beside[length] = '\0';
    char *slash = strrchr(b->beside, '/');
    if (slash != NULL) *slash = '\0';
    if (!child_find("wrk", b->wrk)) {
        b->wrk[0] = '\0';
        bench_say(run, "wrk is not installed: no load, only loops of one client");
    }
    if (!child_find("nginx", b->nginx)) b->nginx[0] = '\0';
    TRY(make_folder(b, error));
done:
    return status;
}

static lam_status hand_on(const service_bench *b, lam_error *error) {
    lam_status status = LAM_OK;
    TRY(bench_table(b->run, &b->tables.solve, error));
    TRY(bench_table(b->run, &b->tables.load, error));
    TRY(bench_table(b->run, &b->tables.loop, error));
    TRY(bench_table(b->run, &b->tables.codec, error));
    TRY(bench_table(b->run, &b->tables.ratios, error));
done:
    return status;
}

/* Answers a second by clients, of every size. */
static lam_status draw(const bench_run *run, const service_size *sizes, const service_curves *curves,
                       size_t n, lam_error *error) {
    static const char *const who[2] = {"lambertd", "sleeping"};
    plot_series series[2 * SIZES_MOST];
    char labels[2 * SIZES_MOST][48];
    double x[SERVICE_CLIENTS];
    bool any = false;
    for (int c = 0; c < SERVICE_CLIENTS; c++) x[c] = service_clients[c];
    for (size_t i = 0; i < 2 * n; i++) {
        const double *y = curves[i / 2].per_second[i % 2];
        snprintf(labels[i], sizeof labels[i], "%s, %zu elements", who[i % 2], sizes[i / 2].n);
        series[i] = (plot_series){.label = labels[i], .n = SERVICE_CLIENTS, .x = x, .y = y, .joined = true};
        for (int c = 0; c < SERVICE_CLIENTS; c++) any = any || (isfinite(y[c]) && y[c] > 0);
    }
    if (!any) return LAM_OK;
    const plot p = {.name = "throughput",
                    .title = "Answers a second in NPY, beside a server that sleeps instead of solving",
                    .x_label = "clients",
                    .y_label = "answers (1/s)",
                    .x_log = true,
                    .y_log = true,
                    .series = series,
                    .n_series = 2 * n};
    return run->sink->plot(run->sink->context, &p, error);
}

lam_status bench_service(const bench_run *run, lam_error *error) {
    /* A Cornell box at .1, the City of table 4.6, and a Cornell box at the largest size of the thesis. */
    static const service_size all_sizes[3][SIZES_MOST] = {
        {{200, 32, 1}},
        {{2560, 416, 1}, {24128, 1364, 1}, {163840, 4000, 3}},
        {{2560, 416, 5}, {24128, 1364, 5}, {163840, 4000, 10}},
    };
    const service_size *sizes = all_sizes[run->scale];
    lam_status status = LAM_OK;
    service_bench b = {.run = NULL};
    service_curves curves[SIZES_MOST];
    size_t n = 0;
    for (size_t i = 0; i < SIZES_MOST; i++)
        for (int c = 0; c < 2 * SERVICE_CLIENTS; c++)
            curves[i].per_second[c / SERVICE_CLIENTS][c % SERVICE_CLIENTS] = NAN;
    TRY(bench_begin(run, &b, error));
    for (; n < SIZES_MOST && sizes[n].n > 0; n++) TRY(service_measure(&b, &sizes[n], &curves[n], error));
    TRY(hand_on(&b, error));
    TRY(draw(run, sizes, curves, n, error));
done:
    bench_close(&b);
    return status;
}
