/* One size of operator: in process and behind every server, in turns, as the machine's speed drifts. */
#include "solver/base/clock.h"
#include "solver/bench/bench_service.h"
#include "solver/bench/stats.h"

#include <errno.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

const unsigned service_clients[SERVICE_CLIENTS] = {1, 4, 16};
const char *const service_format_names[SERVICE_FORMATS] = {"npy", "json"};

static const char *const types[SERVICE_FORMATS] = {"application/x-npy", "application/json"};
static const char *const ready_paths[SERVICE_FORMATS] = {"/0", "/1"};
static const char *const file_paths[SERVICE_FORMATS] = {"/npy", "/json"};

enum { ONE = 0, MANY = SERVICE_CLIENTS - 1 }; /* of service_clients */

enum { SLEEPING_SERVERS = 3 };
static const service_server sleeping[SLEEPING_SERVERS] = {SERVICE_SLEEPING, SERVICE_AS_MANY, SERVICE_ABREAST};

/* What one server came to under one load, round by round. */
typedef struct cell {
    service_load runs[SERVICE_ROUNDS];
    size_t n;
} cell;

typedef struct subject {
    service_bench *b;
    const service_size *size;
    size_t k; /* which may be less than what was wanted */
    lam_operator *op;
    float *E, *B; /* [n] */
    char *bodies[SERVICE_FORMATS];
    client_request ask[SERVICE_FORMATS];
    size_t answer_bytes[SERVICE_FORMATS];
    service_servers servers;
    cell cells[SERVICE_FORMATS][SERVICE_CLIENTS][SERVICE_SERVERS];
    service_solve solves[SERVICE_ROUNDS], beside[SERVICE_ROUNDS];
    size_t rounds;
    double solve; /* s, of one vector in process: the sleeping server's sleep */
    bool same_bits;
} subject;

/* --- tables --------------------------------------------------------------------------------------------- */

static double median_of(const cell *c, double (*figure)(const service_load *)) {
    double values[SERVICE_ROUNDS];
    for (size_t r = 0; r < c->n; r++) values[r] = figure(&c->runs[r]);
    return stats_median(values, c->n);
}

static double p50_of(const service_load *l) {
    return l->p50;
}
static double p99_of(const service_load *l) {
    return l->p99;
}
static double tail_of(const service_load *l) {
    return l->p99 / l->p50;
}
static double per_second_of(const service_load *l) {
    return l->per_second;
}
static double requests_of(const service_load *l) {
    return l->requests;
}
static double failed_of(const service_load *l) {
    return l->failed;
}

/* Whether so many came that those under way when wrk stops, which it does not count, are few beside them. */
static bool enough(const cell *c, int clients) {
    for (size_t r = 0; r < c->n; r++)
        if (c->runs[r].requests < 3 * service_clients[clients]) return false;
    return true;
}

static const char *why_not(const subject *s, service_server server) {
    if (s->b->wrk[0] == '\0') return "not run: wrk is not installed";
    return s->servers.absent[server];
}

static void add_load(subject *s, service_format f, int clients, service_server server) {
    table *t = &s->b->tables.load;
    const cell *c = &s->cells[f][clients][server];
    const double per_second = median_of(c, per_second_of);
    const size_t sent = server == SERVICE_NGINX ? 0 : s->ask[f].length;
    const char *note = why_not(s, server);
    char failed[64];
    snprintf(failed, sizeof failed, "%.0f of %.0f failed", median_of(c, failed_of),
             median_of(c, requests_of));
    if (note == NULL)
        note = median_of(c, failed_of) > 0 ? failed : enough(c, clients) ? "" : "too few answers";
    table_number(t, (double)s->size->n);
    table_number(t, (double)s->k);
    table_text(t, service_format_names[f]);
    table_number(t, service_clients[clients]);
    table_text(t, service_server_names[server]);
    table_number(t, 1e3 * median_of(c, p50_of));
    table_number(t, 1e3 * median_of(c, p99_of));
    table_number(t, per_second);
    table_number(t, (double)sent);
    table_number(t, (double)s->answer_bytes[f]);
    table_number(t, per_second * (double)(sent + s->answer_bytes[f]) * 1e-6);
    table_number(t, median_of(c, requests_of));
    table_number(t, (double)c->n);
    table_text(t, note);
}

static void add_solve(subject *s, const char *how, int threads, const service_solve *found) {
    table *t = &s->b->tables.solve;
    table_number(t, (double)s->size->n);
    table_number(t, (double)s->k);
    table_number(t, (double)lam_operator_bytes(s->op) * 1e-9);
    table_text(t, how);
    table_number(t, threads);
    table_number(t, 1e3 * found->p50);
    table_number(t, 1e3 * found->p99);
    table_number(t, found->per_second);
    table_number(t, (double)found->count);
}

/* wanted: NULL where nothing is. */
static void add_ratio(subject *s, const char *what, double measured, bool sure, const char *wanted,
                      bool met) {
    table *t = &s->b->tables.ratios;
    table_number(t, (double)s->size->n);
    table_number(t, (double)s->k);
    table_text(t, what);
    table_number(t, measured);
    table_text(t, wanted != NULL ? wanted : "");
    table_text(t, !isfinite(measured) ? "not run"
                  : !sure             ? "too few answers"
                  : wanted == NULL    ? ""
                  : met               ? "met"
                                      : "missed");
}

/* --- making ready --------------------------------------------------------------------------------------- */

static lam_status keep_answer(const subject *s, service_format f, const client_answer *answer,
                              lam_error *error) {
    lam_status status = LAM_OK;
    char path[PATH_MAX];
    snprintf(path, sizeof path, "%s/answers/%s", s->b->folder, service_format_names[f]);
    FILE *file = fopen(path, "wbe");
    if (file == NULL || fwrite(answer->body, 1, answer->length, file) != answer->length || fflush(file) != 0)
        FAIL(error, LAM_ERR_IO, "%s: %s", path, strerror(errno));
done:
    if (file != NULL) fclose(file);
    return status;
}

/* One answer in each format: what the others serve, and what must be bit for bit what was solved here. */
static lam_status ask_once(subject *s, lam_error *error) {
    lam_status status = LAM_OK;
    client c = client_to(s->servers.port[SERVICE_LAMBERTD]);
    const size_t values = s->size->n * sizeof *s->B;
    for (service_format f = 0; f < SERVICE_FORMATS; f++) {
        client_answer answer;
        TRY(client_ask(&c, s->b->run, &s->ask[f], &answer, error));
        if (answer.status != 200)
            FAIL(error, LAM_ERR_IO, "lambertd answered %u: %.200s", answer.status,
                 answer.status != 0 ? answer.body : "it hung up");
        TRY(keep_answer(s, f, &answer, error));
        s->answer_bytes[f] = answer.length;
        if (f == SERVICE_NPY)
            s->same_bits =
                answer.length > values && memcmp(answer.body + answer.length - values, s->B, values) == 0;
    }
done:
    client_close(&c);
    return status;
}

/* One after the other on one thread and on all, in turns; of each the best turn, as what disturbs a machine
 * only ever makes it slower. */
static lam_status solve_in_turns(subject *s, double seconds, service_solve best[2], lam_error *error) {
    enum { TURNS = 3 };
    lam_status status = LAM_OK;
    const int threads[2] = {1, s->b->threads};
    for (int turn = 0; turn < TURNS; turn++)
        for (int i = 0; i < 2; i++) {
            service_solve found;
            TRY(service_solve_alone(s->b, s->op, threads[i], s->E, s->B, seconds / TURNS, &found, error));
            if (turn == 0 || found.p50 < best[i].p50) best[i] = found;
        }
    for (int i = 0; i < 2; i++) add_solve(s, "one after the other", threads[i], &best[i]);
done:
    return status;
}

/* In process: how long a solve takes decides how long the sleeping server sleeps, and how many at once: as
 * many as solve at once on these cores. */
static lam_status solve_first(subject *s, int *sleepers, lam_error *error) {
    lam_status status = LAM_OK;
    service_bench *b = s->b;
    const double seconds = b->run->scale == BENCH_QUICK ? .1 : s->size->seconds;
    service_solve alone[2], beside;
    TRY(solve_in_turns(s, seconds, alone, error));
    TRY(service_solve_beside(b, s->op, s->E, seconds, &beside, error));
    add_solve(s, "one on each core", b->threads, &beside);
    s->solve = alone[1].p50;
    *sleepers = (int)fmax(1, fmin(b->threads, round(b->threads * alone[1].p50 / alone[0].p50)));
    bench_say(b->run, "n = %zu: a solve takes %.3g ms; the sleeping server sleeps so long, %d at once",
              s->size->n, 1e3 * s->solve, *sleepers);
done:
    return status;
}

/* Answers a second at most clients, in a short run. */
static lam_status try_out(subject *s, service_server server, double *per_second, lam_error *error) {
    lam_status status = LAM_OK;
    client_request request = s->ask[SERVICE_NPY];
    service_load found;
    if (server != SERVICE_LAMBERTD) request.path = ready_paths[SERVICE_NPY];
    TRY(service_wrk(s->b, s->servers.port[server], &request, service_format_names[SERVICE_NPY],
                    service_clients[MANY], s->size->seconds, &found, error));
    *per_second = found.per_second;
done:
    return status;
}

/* One sleeping server with as many asleep at once as solves run at once in process; as lambertd shares its
 * passes, and so gives more answers than that, another that gives about as many as it does; and one where
 * nobody waits for others to sleep. How much later than others the slowest answers come depends on the pace:
 * who is slower by half has few to wait for between. */
static lam_status start_sleeping(subject *s, int sleepers, lam_error *error) {
    lam_status status = LAM_OK;
    double lambertd = 1, as_solves = 1;
    TRY(service_start_ready(s->b, &s->servers, SERVICE_SLEEPING, s->solve, sleepers, error));
    if (s->b->wrk[0] != '\0' && s->servers.absent[SERVICE_SLEEPING] == NULL) {
        TRY(try_out(s, SERVICE_LAMBERTD, &lambertd, error));
        TRY(try_out(s, SERVICE_SLEEPING, &as_solves, error));
    }
    const double as_many = as_solves > 0 ? round(sleepers * lambertd / as_solves) : sleepers;
    sleepers = (int)fmax(1, fmin(as_many, service_clients[MANY]));
    bench_say(s->b->run, "n = %zu: with %d asleep at once it gives about as many answers as lambertd",
              s->size->n, sleepers);
    TRY(service_start_ready(s->b, &s->servers, SERVICE_AS_MANY, s->solve, sleepers, error));
    TRY(service_start_ready(s->b, &s->servers, SERVICE_ABREAST, s->solve, (int)service_clients[MANY], error));
done:
    return status;
}

static lam_status make_ready(subject *s, lam_error *error) {
    lam_status status = LAM_OK;
    service_bench *b = s->b;
    const size_t n = s->size->n;
    double start = clock_seconds();
    int sleepers = 1;
    TRY(service_store_make(b, n, s->k, &s->op, error));
    bench_say(b->run, "n = %zu, k = %zu: operator of %.3g GB made and stored in %.1f s", n, s->k,
              (double)lam_operator_bytes(s->op) * 1e-9, clock_seconds() - start);
    TRY(service_emission(b, n, &s->E, error));
    s->B = memory_allocate(n, sizeof *s->B, "radiosity", error);
    if (s->B == NULL) TRY(LAM_ERR_MEMORY);
    for (service_format f = 0; f < SERVICE_FORMATS; f++) {
        size_t length;
        TRY(service_body(b, f, n, s->E, &s->bodies[f], &length, error));
        s->ask[f] = (client_request){.method = "POST",
                                     .path = "/v1/scenes/bench/radiosity",
                                     .type = types[f],
                                     .body = s->bodies[f],
                                     .length = length};
    }
    TRY(solve_first(s, &sleepers, error));
    start = clock_seconds();
    TRY(service_start_lambertd(b, &s->servers, error));
    TRY(ask_once(s, error));
    bench_say(b->run, "n = %zu: lambertd's first answers came %.1f s after its start", n,
              clock_seconds() - start);
    TRY(service_start_others(b, &s->servers, error));
    TRY(start_sleeping(s, sleepers, error));
done:
    return status;
}

static void subject_free(subject *s) {
    char path[PATH_MAX];
    service_stop(&s->servers);
    lam_operator_close(s->op);
    free(s->E);
    free(s->B);
    for (service_format f = 0; f < SERVICE_FORMATS; f++) free(s->bodies[f]);
    /* The next size needs the room. */
    snprintf(path, sizeof path, "%s/store.h5", s->b->folder);
    unlink(path);
}

/* --- measuring ------------------------------------------------------------------------------------------ */

/* So that there are ten answers, and two for every client, where solves have to wait for each other; at most
 * three times as long as the scale says. */
static unsigned seconds_of(const subject *s, int clients, service_server server) {
    const double least = s->size->seconds, wanted = ceil(fmax(10, 2 * service_clients[clients]) * s->solve);
    if (server == SERVICE_READY || server == SERVICE_NGINX) return s->size->seconds;
    return (unsigned)fmax(least, fmin(wanted, 3 * least));
}

/* wrk on one server; nothing where either is missing. */
static lam_status load(subject *s, service_format f, int clients, service_server server, lam_error *error) {
    lam_status status = LAM_OK;
    cell *c = &s->cells[f][clients][server];
    client_request request = s->ask[f];
    if (why_not(s, server) != NULL) return LAM_OK;
    if (server == SERVICE_NGINX)
        request = (client_request){.method = "GET", .path = file_paths[f]};
    else if (server != SERVICE_LAMBERTD)
        request.path = ready_paths[f];
    TRY(service_wrk(s->b, s->servers.port[server], &request, service_format_names[f],
                    service_clients[clients], seconds_of(s, clients, server), &c->runs[c->n], error));
    c->n++;
done:
    return status;
}

/* What the ratios are made of, in turns. */
static lam_status measure_rounds(subject *s, lam_error *error) {
    lam_status status = LAM_OK;
    const bench_run *run = s->b->run;
    const size_t rounds = run->scale == BENCH_QUICK ? 1 : SERVICE_ROUNDS;
    const double seconds = run->scale == BENCH_QUICK ? .1 : .5 * s->size->seconds;
    for (size_t r = 0; r < rounds; r++) {
        progress_report(run->progress, "rounds of HTTP and solves", (double)r / (double)rounds);
        TRY(service_solve_alone(s->b, s->op, s->b->threads, s->E, s->B, seconds, &s->solves[r], error));
        TRY(load(s, SERVICE_NPY, ONE, SERVICE_LAMBERTD, error));
        TRY(service_solve_beside(s->b, s->op, s->E, seconds, &s->beside[r], error));
        TRY(load(s, SERVICE_NPY, MANY, SERVICE_LAMBERTD, error));
        for (int k = 0; k < SLEEPING_SERVERS; k++) TRY(load(s, SERVICE_NPY, MANY, sleeping[k], error));
        s->rounds = r + 1;
    }
    progress_report(run->progress, "rounds of HTTP and solves", 1);
done:
    return status;
}

/* Everything that had no turn yet, once. */
static lam_status measure_rest(subject *s, lam_error *error) {
    lam_status status = LAM_OK;
    const progress *p = s->b->run->progress;
    const int all = SERVICE_FORMATS * SERVICE_CLIENTS * SERVICE_SERVERS;
    for (int i = 0; i < all; i++) {
        const service_format f = i / (SERVICE_CLIENTS * SERVICE_SERVERS);
        const int clients = i / SERVICE_SERVERS % SERVICE_CLIENTS;
        const service_server server = i % SERVICE_SERVERS;
        progress_report(p, "load on every server", (double)i / all);
        if (s->cells[f][clients][server].n == 0) TRY(load(s, f, clients, server, error));
        add_load(s, f, clients, server);
    }
    progress_report(p, "load on every server", 1);
done:
    return status;
}

/* --- ratios --------------------------------------------------------------------------------------------- */

/* The median over rounds of a figure of one cell over that of another thing in the same round. */
static double ratio_of(const subject *s, const cell *above, double (*figure)(const service_load *),
                       const cell *below, const service_solve *solves, bool of_times) {
    double ratios[SERVICE_ROUNDS];
    if (above->n < s->rounds || (below != NULL && below->n < s->rounds)) return NAN;
    for (size_t r = 0; r < s->rounds; r++)
        ratios[r] = figure(&above->runs[r]) / (below != NULL ? figure(&below->runs[r])
                                               : of_times    ? solves[r].p50
                                                             : solves[r].per_second);
    return stats_median(ratios, s->rounds);
}

/* The best of the rounds: what disturbs a machine only ever makes it worse. */
static double best_tail(const cell *c) {
    double best = NAN;
    for (size_t r = 0; r < c->n; r++) best = fmin(best, tail_of(&c->runs[r]));
    return best;
}

static const char *const tails_of_sleeping[SLEEPING_SERVERS] = {
    "likewise of the sleeping server, as many at once as solves are",
    "likewise of the sleeping server, at lambertd's pace",
    "likewise of the sleeping server, all at once",
};

/* What issue 6 is done with. Targets are named at the sizes that they were set for. */
static void add_ratios(subject *s, const service_loops *loops) {
    const cell *one = &s->cells[SERVICE_NPY][ONE][SERVICE_LAMBERTD];
    const cell *many = &s->cells[SERVICE_NPY][MANY][SERVICE_LAMBERTD];
    const bool whole = s->k == s->size->k && s->b->run->scale != BENCH_QUICK;
    const bool small = whole && s->size->n == 2560, large = whole && s->size->n == 163840;
    const double http = ratio_of(s, one, p50_of, NULL, s->solves, true);
    const double rate = ratio_of(s, many, per_second_of, NULL, s->beside, false);
    const double batch = ratio_of(s, many, per_second_of, one, NULL, false);
    const double tail = best_tail(many);
    const bool sure = enough(many, MANY);
    add_ratio(s, "p50 over the solve in process, npy, 1 client", http, enough(one, ONE),
              large ? "<= 1.15" : NULL, http <= 1.15);
    add_ratio(s, "answers a second over unbatched solves, npy, 16 clients", rate, sure,
              small ? ">= 0.85" : NULL, rate >= .85);
    add_ratio(s, "answers a second of 16 clients over 1, npy", batch, sure && enough(one, ONE),
              whole && !small ? ">= 4" : NULL, batch >= 4);
    add_ratio(s, "p99 over p50, npy, 16 clients, best round", tail, sure, NULL, false);
    for (int k = 0; k < SLEEPING_SERVERS; k++) {
        const cell *other = &s->cells[SERVICE_NPY][MANY][sleeping[k]];
        const double theirs = best_tail(other);
        add_ratio(s, tails_of_sleeping[k], theirs, sure && enough(other, MANY),
                  small ? ">= lambertd's" : NULL, tail <= theirs);
    }
    add_ratio(s, "parse and encode of dense JSON, ms", loops->codec_ms, true, large ? "<= 9" : NULL,
              loops->codec_ms <= 9);
    add_ratio(s, "evaluations a second of the reduce loop", loops->reduce_per_second, true,
              whole ? ">= 5000" : NULL, loops->reduce_per_second >= 5000);
    add_ratio(s, "adjoint over forward, p50 in turns", loops->adjoint_of_forward, true,
              whole ? "<= 1.2" : NULL, loops->adjoint_of_forward <= 1.2);
    add_ratio(s, "bits as in process (1: yes)", s->same_bits, true, "= 1", s->same_bits);
}

lam_status service_measure(service_bench *b, const service_size *size, service_curves *curves,
                           lam_error *error) {
    lam_status status = LAM_OK;
    service_loops loops;
    subject *s = memory_allocate(1, sizeof *s, "a subject", error);
    if (s == NULL) return LAM_ERR_MEMORY;
    s->b = b;
    s->size = size;
    for (int i = 0; i < SERVICE_SERVERS; i++) s->servers.absent[i] = NULL;
    s->k = service_store_fits(b, size->n, size->k);
    if (s->k < size->k)
        bench_say(b->run, "n = %zu: memory or disk is enough for k = %zu only, not for %zu", size->n, s->k,
                  size->k);
    if (s->k == 0) goto done;
    TRY(make_ready(s, error));
    TRY(measure_rounds(s, error));
    TRY(measure_rest(s, error));
    const service_scene scene = {.n = size->n,
                                 .k = s->k,
                                 .port = s->servers.port[SERVICE_LAMBERTD],
                                 .seconds = b->run->scale == BENCH_QUICK ? .1 : size->seconds,
                                 .ask = {s->ask[SERVICE_NPY], s->ask[SERVICE_JSON]}};
    TRY(service_loop(b, &scene, &loops, error));
    add_ratios(s, &loops);
    for (int c = 0; c < SERVICE_CLIENTS; c++) {
        curves->per_second[0][c] = median_of(&s->cells[SERVICE_NPY][c][SERVICE_LAMBERTD], per_second_of);
        curves->per_second[1][c] = median_of(&s->cells[SERVICE_NPY][c][SERVICE_SLEEPING], per_second_of);
    }
done:
    subject_free(s);
    free(s);
    return status;
}
