/* Load by wrk, which reports through the script that it is given. */
#include "solver/bench/bench_service.h"

#include <errno.h>
#include <string.h>

/* Of the warm-up, which one connection does. */
static const double warm_s = .2;

/* Longer than any answer takes; wrk's own default would count slow answers as lost. */
#define TIMEOUT_S "60"

/* Arguments: method, or method, body's file and its type. Times are in microseconds. */
static const char script[] =
    "function init(args)\n"
    "  wrk.method = args[1]\n"
    "  if args[2] then\n"
    "    local file = assert(io.open(args[2], 'rb'))\n"
    "    wrk.body = file:read('*a')\n"
    "    file:close()\n"
    "    wrk.headers['Content-Type'] = args[3]\n"
    "    wrk.headers['Accept'] = args[3]\n"
    "  end\n"
    "end\n"
    "function done(summary, latency, requests)\n"
    "  local e = summary.errors\n"
    "  io.write(string.format('\\nmeasured %.0f %.0f %.0f %.0f %.0f\\n', latency:percentile(50),\n"
    "    latency:percentile(99), summary.requests, summary.duration,\n"
    "    e.connect + e.read + e.write + e.timeout + e.status))\n"
    "end\n";

static lam_status write_script(const service_bench *b, lam_error *error) {
    lam_status status = LAM_OK;
    char path[PATH_MAX];
    snprintf(path, sizeof path, "%s/load.lua", b->folder);
    FILE *file = fopen(path, "we");
    if (file == NULL || fputs(script, file) < 0 || fflush(file) != 0)
        FAIL(error, LAM_ERR_IO, "%s: %s", path, strerror(errno));
done:
    if (file != NULL) fclose(file);
    return status;
}

/* One client asks for so long, at least once. */
static lam_status ask_alone(const service_bench *b, unsigned port, const client_request *request,
                            double seconds, lam_error *error) {
    client c = client_to(port);
    const lam_status status = client_warm_up(&c, b->run, request, seconds, 1, error);
    client_close(&c);
    return status;
}

lam_status service_wrk(const service_bench *b, unsigned port, const client_request *request,
                       const char *body_file, unsigned clients, unsigned seconds, service_load *out,
                       lam_error *error) {
    lam_status status = LAM_OK;
    child wrk = {.pid = 0};
    char connections[16], duration[16], url[128];
    const bool post = request->type != NULL;
    const char *found;
    double failed;
    snprintf(connections, sizeof connections, "%u", clients);
    snprintf(duration, sizeof duration, "%us", seconds);
    snprintf(url, sizeof url, "http://127.0.0.1:%u%s", port, request->path);
    /* One thread: it shares the cores with the server. */
    const char *const arguments[] = {b->wrk,
                                     "-t",
                                     "1",
                                     "-c",
                                     connections,
                                     "-d",
                                     duration,
                                     "--timeout",
                                     TIMEOUT_S "s",
                                     "-s",
                                     "load.lua",
                                     url,
                                     request->method,
                                     post ? body_file : NULL,
                                     request->type,
                                     NULL};
    TRY(write_script(b, error));
    TRY(ask_alone(b, port, request, warm_s, error));
    TRY(child_start(&wrk, "wrk", b->folder, arguments, error));
    TRY(child_finish(&wrk, b->run, seconds + 120, error));
    /* What wrk asked for last and did not wait for is solved all the same; it must not disturb what comes
     * next. */
    TRY(ask_alone(b, port, request, 0, error));
    found = strstr(wrk.said, "\nmeasured ");
    *out = (service_load){0};
    double microseconds;
    if (found == NULL || sscanf(found, " measured %lf %lf %lf %lf %lf", &out->p50, &out->p99, &out->requests,
                                &microseconds, &failed) != 5)
        FAIL(error, LAM_ERR_IO, "wrk does not say what it measured; is it wrk 4?");
    out->p50 *= 1e-6;
    out->p99 *= 1e-6;
    out->failed = failed;
    out->per_second = (out->requests - failed) / (microseconds * 1e-6);
done:
    child_stop(&wrk);
    return status;
}
