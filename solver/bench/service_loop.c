/* An optimizer in a loop on one keep-alive connection, and what an answer says of its own times. */
#include "solver/base/clock.h"
#include "solver/bench/bench_service.h"
#include "solver/bench/stats.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

enum { MOST_TIMES = 1 << 16, TURNS = 2 };

/* So many answers of the codec's times are looked at. */
enum { CODEC_ANSWERS = 9, CODEC_TIMES = 3 };

/* What one loop came to, request by request. */
typedef struct loop_result {
    double per_second; /* turns: one of each request */
    double p50[TURNS]; /* s, of each request */
} loop_result;

/* The requests of a loop in turns for so many seconds. */
static lam_status loop(client *c, const bench_run *run, const client_request *const *requests, size_t n,
                       double seconds, loop_result *out, lam_error *error) {
    lam_status status = LAM_OK;
    client_answer answer;
    size_t turns = 0;
    double *times = memory_allocate((size_t)TURNS * MOST_TIMES, sizeof *times, "times", error);
    if (times == NULL) return LAM_ERR_MEMORY;
    for (size_t i = 0; i < n; i++) TRY(client_warm_up(c, run, requests[i], .1, 1, error));
    const double start = clock_seconds();
    while (turns == 0 || clock_seconds() < start + seconds) {
        for (size_t i = 0; i < n; i++) {
            TRY(client_ask(c, run, requests[i], &answer, error));
            if (answer.status != 200)
                FAIL(error, LAM_ERR_IO, "%s answered %u in a loop", requests[i]->path, answer.status);
            times[i * MOST_TIMES + turns % MOST_TIMES] = answer.seconds;
        }
        turns++;
        TRY(bench_check(run, error));
    }
    out->per_second = (double)(n * turns) / (clock_seconds() - start);
    for (size_t i = 0; i < n; i++)
        out->p50[i] = stats_median(times + i * MOST_TIMES, turns < MOST_TIMES ? turns : MOST_TIMES);
done:
    free(times);
    return status;
}

static void add_row(service_bench *b, const service_scene *scene, const char *name, const char *format,
                    double per_second, double first, double second, const char *note) {
    table *t = &b->tables.loop;
    table_number(t, (double)scene->n);
    table_number(t, (double)scene->k);
    table_text(t, name);
    table_text(t, format);
    table_number(t, per_second);
    table_number(t, first * 1e3);
    table_number(t, second * 1e3);
    table_text(t, note);
}

/* Whether a route is there and takes this request; else note says what it answered. Not an error. */
static lam_status try_route(client *c, const bench_run *run, const client_request *request, bool *good,
                            char note[64], lam_error *error) {
    lam_status status = LAM_OK;
    client_answer answer;
    lam_error cause;
    status = client_ask(c, run, request, &answer, &cause);
    *good = status == LAM_OK && answer.status == 200;
    if (status == LAM_OK)
        snprintf(note, 64, "not run: the route answers %u", answer.status);
    else
        snprintf(note, 64, "not run: no answer");
    if (status == LAM_ERR_CANCELLED) return bench_check(run, error);
    return LAM_OK;
}

static lam_status forward(service_bench *b, client *c, const service_scene *scene, lam_error *error) {
    lam_status status = LAM_OK;
    for (service_format f = 0; f < SERVICE_FORMATS; f++) {
        const client_request *const one = &scene->ask[f];
        loop_result r = {.per_second = 0};
        TRY(loop(c, b->run, &one, 1, scene->seconds, &r, error));
        add_row(b, scene, "forward", service_format_names[f], r.per_second, r.p50[0], NAN, "");
    }
done:
    return status;
}

/* Forward and adjoint in turns: the cotangent is what the forward answer is made of in size and format. */
static lam_status with_adjoint(service_bench *b, client *c, const service_scene *scene, service_loops *out,
                               lam_error *error) {
    static const char path[] = "/v1/scenes/bench/adjoint", old[] = "\"emission\"",
                      new[] = "\"gradient\":[\"emission\"],\"cotangent\"",
                      short_body[] = "{\"cotangent\":{\"elements\":[0],\"values\":[1]}}";
    lam_status status = LAM_OK;
    const client_request *json = &scene->ask[SERVICE_JSON];
    char note[64], *body = NULL;
    bool good = false;
    service_format format = SERVICE_NPY;
    client_request adjoint = scene->ask[SERVICE_NPY];
    /* A short request first: a long one to a route that does not read it would be cut off. */
    const client_request probe = {.method = "POST",
                                  .path = path,
                                  .type = json->type,
                                  .body = short_body,
                                  .length = sizeof short_body - 1};
    adjoint.path = path;
    TRY(try_route(c, b->run, &probe, &good, note, error));
    if (!good && (strstr(note, "501") != NULL || strstr(note, "404") != NULL)) {
        add_row(b, scene, "forward, adjoint", "", NAN, NAN, NAN, note);
        return LAM_OK;
    }
    TRY(try_route(c, b->run, &adjoint, &good, note, error));
    if (!good) {
        format = SERVICE_JSON;
        const size_t length = json->length + sizeof new - sizeof old;
        body = memory_allocate(length, 1, "a request", error);
        if (body == NULL) TRY(LAM_ERR_MEMORY);
        /* {"gradient":["emission"],"cotangent": for {"emission": */
        body[0] = '{';
        memcpy(body + 1, new, sizeof new - 1);
        memcpy(body + sizeof new, json->body + sizeof old, json->length - sizeof old);
        adjoint = (client_request){.method = "POST", .path = path, .type = json->type, .body = body};
        adjoint.length = length;
        TRY(try_route(c, b->run, &adjoint, &good, note, error));
    }
    if (good) {
        const client_request *const both[TURNS] = {&scene->ask[format], &adjoint};
        loop_result r = {.per_second = 0};
        TRY(loop(c, b->run, both, TURNS, scene->seconds, &r, error));
        add_row(b, scene, "forward, adjoint", service_format_names[format], r.per_second, r.p50[0], r.p50[1],
                "");
        out->adjoint_of_forward = r.p50[1] / r.p50[0];
    } else {
        add_row(b, scene, "forward, adjoint", "", NAN, NAN, NAN, note);
    }
done:
    free(body);
    return status;
}

static lam_status reduce(service_bench *b, client *c, const service_scene *scene, service_loops *out,
                         lam_error *error) {
    static const char body[] = "{\"emission\":{\"groups\":{\"lamp\":1.5}},"
                               "\"reduce\":{\"groups\":[\"desk\"],\"with\":[\"mean\",\"sum\"]}}";
    lam_status status = LAM_OK;
    char note[64];
    bool good = false;
    const client_request request = {.method = "POST",
                                    .path = scene->ask[SERVICE_JSON].path,
                                    .type = scene->ask[SERVICE_JSON].type,
                                    .body = body,
                                    .length = sizeof body - 1};
    const client_request *const one = &request;
    loop_result r = {.per_second = 0};
    TRY(try_route(c, b->run, &request, &good, note, error));
    if (good) {
        TRY(loop(c, b->run, &one, 1, scene->seconds, &r, error));
        add_row(b, scene, "reduce", "json", r.per_second, r.p50[0], NAN, "");
        out->reduce_per_second = r.per_second;
    } else {
        add_row(b, scene, "reduce", "json", NAN, NAN, NAN, note);
    }
done:
    return status;
}

/* time_ms of a dense JSON answer, which is at its end. */
static lam_status codec(service_bench *b, client *c, const service_scene *scene, service_loops *out,
                        lam_error *error) {
    static const char wanted[] = "\"time_ms\":{\"parse\":%lf,\"solve\":%lf,\"encode\":%lf}";
    enum { TAIL = 160 };
    lam_status status = LAM_OK;
    double times[CODEC_TIMES][CODEC_ANSWERS], sums[CODEC_ANSWERS];
    for (int a = 0; a < CODEC_ANSWERS; a++) {
        client_answer answer;
        double t[CODEC_TIMES];
        TRY(client_ask(c, b->run, &scene->ask[SERVICE_JSON], &answer, error));
        if (answer.status != 200) FAIL(error, LAM_ERR_IO, "lambertd answered %u", answer.status);
        const char *tail = answer.length > TAIL ? answer.body + answer.length - TAIL : answer.body;
        const char *found = strstr(tail, "\"time_ms\"");
        if (found == NULL || sscanf(found, wanted, &t[0], &t[1], &t[2]) != CODEC_TIMES)
            FAIL(error, LAM_ERR_IO, "lambertd's answer has no time_ms at its end");
        for (int i = 0; i < CODEC_TIMES; i++) times[i][a] = t[i];
        sums[a] = t[0] + t[2];
    }
    out->codec_ms = stats_median(sums, CODEC_ANSWERS);
    table *to = &b->tables.codec;
    table_number(to, (double)scene->n);
    table_number(to, (double)scene->k);
    for (int i = 0; i < CODEC_TIMES; i++) table_number(to, stats_median(times[i], CODEC_ANSWERS));
    table_number(to, out->codec_ms);
    table_number(to, sums[0]); /* sorted by now */
done:
    return status;
}

lam_status service_loop(service_bench *b, const service_scene *scene, service_loops *out, lam_error *error) {
    lam_status status = LAM_OK;
    client c = client_to(scene->port);
    *out = (service_loops){NAN, NAN, NAN};
    TRY(forward(b, &c, scene, error));
    TRY(with_adjoint(b, &c, scene, out, error));
    TRY(reduce(b, &c, scene, out, error));
    TRY(codec(b, &c, scene, out, error));
done:
    client_close(&c);
    return status;
}
