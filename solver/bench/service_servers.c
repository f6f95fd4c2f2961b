/* The servers that are measured: started on free ports of the loopback, stopped whatever happens. */
#include "solver/bench/bench_service.h"

#include <errno.h>
#include <math.h>
#include <netinet/in.h>
#include <string.h>
#include <sys/socket.h>
#include <time.h>
#include <unistd.h>

const char *const service_server_names[SERVICE_SERVERS] = {"lambertd", "ready",   "sleeping",
                                                           "as many",  "abreast", "nginx"};

/* A store of gigabytes from a slow disk. */
static const double patience_s = 300;

static lam_status read_port(child *c, const service_bench *b, unsigned *port, lam_error *error) {
    lam_status status = LAM_OK;
    const char *after;
    TRY(child_await(c, b->run, "listening on http://127.0.0.1:", patience_s, &after, error));
    if (sscanf(after, "%u", port) != 1) FAIL(error, LAM_ERR_IO, "%s does not say its port", c->name);
done:
    return status;
}

/* A program of the same build. */
static bool find_beside(const service_bench *b, const char *name, char path[PATH_MAX]) {
    return snprintf(path, PATH_MAX, "%s/%s", b->beside, name) < PATH_MAX && access(path, X_OK) == 0;
}

lam_status service_start_lambertd(const service_bench *b, service_servers *s, lam_error *error) {
    lam_status status = LAM_OK;
    char path[PATH_MAX], threads[16];
    child *c = &s->processes[SERVICE_LAMBERTD];
    if (!find_beside(b, "lambertd", path))
        FAIL(error, LAM_ERR_IO, "%s/lambertd: cannot be run; it has to stand beside lambert", b->beside);
    snprintf(threads, sizeof threads, "%d", b->threads);
    const char *const arguments[] = {path,    "--listen",       "127.0.0.1:0", "--threads",
                                     threads, "store.h5:bench", NULL};
    TRY(child_start(c, service_server_names[SERVICE_LAMBERTD], b->folder, arguments, error));
    TRY(read_port(c, b, &s->port[SERVICE_LAMBERTD], error));
done:
    return status;
}

lam_status service_start_ready(const service_bench *b, service_servers *s, service_server which, double sleep,
                               int sleepers, lam_error *error) {
    lam_status status = LAM_OK;
    char path[PATH_MAX], microseconds[24], at_once[16];
    child *c = &s->processes[which];
    if (!find_beside(b, "tests/ready_server", path) && !find_beside(b, "ready_server", path)) {
        s->absent[which] = "not run: no tests/ready_server beside lambert";
        return LAM_OK;
    }
    snprintf(microseconds, sizeof microseconds, "%.0f", ceil(sleep * 1e6));
    snprintf(at_once, sizeof at_once, "%d", sleepers);
    const char *const arguments[] = {path, microseconds, at_once, "answers/npy", "answers/json", NULL};
    TRY(child_start(c, service_server_names[which], b->folder, arguments, error));
    TRY(read_port(c, b, &s->port[which], error));
done:
    return status;
}

/* --- nginx ---------------------------------------------------------------------------------------------- */

/* A port that nobody listened on a moment ago: nginx cannot be told to take a free one. */
static lam_status find_port(unsigned *port, lam_error *error) {
    lam_status status = LAM_OK;
    struct sockaddr_in address = {.sin_family = AF_INET, .sin_addr.s_addr = htonl(INADDR_LOOPBACK)};
    socklen_t size = sizeof address;
    const int fd = socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0);
    if (fd < 0 || bind(fd, (struct sockaddr *)&address, size) != 0 ||
        getsockname(fd, (struct sockaddr *)&address, &size) != 0)
        FAIL(error, LAM_ERR_IO, "no free port: %s", strerror(errno));
    *port = ntohs(address.sin_port);
done:
    if (fd >= 0) close(fd);
    return status;
}

/* One process, as the others have one thread that talks; everything it writes is in b->folder. */
static lam_status configure_nginx(const service_bench *b, unsigned port, lam_error *error) {
    lam_status status = LAM_OK;
    char path[PATH_MAX];
    snprintf(path, sizeof path, "%s/nginx.conf", b->folder);
    FILE *file = fopen(path, "we");
    if (file == NULL) FAIL(error, LAM_ERR_IO, "%s: %s", path, strerror(errno));
    fprintf(
        file,
        "daemon off; master_process off; pid nginx.pid; error_log stderr;\n"
        "events { worker_connections 512; }\n"
        "http {\n"
        "  access_log off; keepalive_requests 100000000;\n"
        "  client_body_temp_path nginx-body; proxy_temp_path nginx-proxy; fastcgi_temp_path nginx-fastcgi;\n"
        "  uwsgi_temp_path nginx-uwsgi; scgi_temp_path nginx-scgi;\n"
        "  server { listen 127.0.0.1:%u backlog=512; root answers; }\n"
        "}\n",
        port);
    if (fflush(file) != 0) FAIL(error, LAM_ERR_IO, "%s: %s", path, strerror(errno));
done:
    if (file != NULL) fclose(file);
    return status;
}

/* Whether it has begun to serve. LAM_ERR_CANCELLED; nginx that cannot start is no error here. */
static lam_status answers(const service_bench *b, child *server, unsigned port, bool *good,
                          lam_error *error) {
    static const client_request request = {.method = "GET", .path = "/npy"};
    const struct timespec pause = {.tv_nsec = 20000000};
    lam_status status = LAM_OK;
    lam_error cause;
    client_answer answer;
    client c = client_to(port);
    *good = false;
    for (int i = 0; i < 100 && !*good && child_runs(server); i++) {
        TRY(bench_check(b->run, error));
        *good = client_ask(&c, b->run, &request, &answer, &cause) == LAM_OK && answer.status == 200;
        if (!*good) nanosleep(&pause, NULL);
    }
done:
    client_close(&c);
    return status;
}

static lam_status start_nginx(const service_bench *b, service_servers *s, lam_error *error) {
    lam_status status = LAM_OK;
    child *c = &s->processes[SERVICE_NGINX];
    const char *const arguments[] = {b->nginx, "-p", "./", "-c", "nginx.conf", NULL};
    s->absent[SERVICE_NGINX] = "not run: nginx is not installed";
    if (b->nginx[0] == '\0') return LAM_OK;
    s->absent[SERVICE_NGINX] = "not run: nginx does not start";
    for (int attempt = 0; attempt < 3; attempt++) {
        unsigned port = 0;
        bool good = false;
        TRY(find_port(&port, error));
        TRY(configure_nginx(b, port, error));
        TRY(child_start(c, service_server_names[SERVICE_NGINX], b->folder, arguments, error));
        TRY(answers(b, c, port, &good, error));
        if (good) {
            s->port[SERVICE_NGINX] = port;
            s->absent[SERVICE_NGINX] = NULL;
            return LAM_OK;
        }
        child_stop(c);
    }
done:
    return status;
}

lam_status service_start_others(const service_bench *b, service_servers *s, lam_error *error) {
    lam_status status = LAM_OK;
    TRY(service_start_ready(b, s, SERVICE_READY, 0, 0, error));
    TRY(start_nginx(b, s, error));
done:
    return status;
}

void service_stop(service_servers *s) {
    for (int i = 0; i < SERVICE_SERVERS; i++) {
        child_stop(&s->processes[i]);
        s->port[i] = 0;
    }
}
