/* The parts of the suite service and what they share. Other programs are its subjects: lambertd and, beside
 * the build, ready_server; wrk and nginx where they are installed. */
#ifndef LAMBERT_BENCH_BENCH_SERVICE_H
#define LAMBERT_BENCH_BENCH_SERVICE_H

#include "solver/bench/child.h"
#include "solver/bench/client.h"

/* What is sent and what comes back. */
typedef enum service_format { SERVICE_NPY, SERVICE_JSON, SERVICE_FORMATS } service_format;

/* Who answers. */
typedef enum service_server {
    SERVICE_LAMBERTD,
    SERVICE_READY,    /* the same bytes at once */
    SERVICE_SLEEPING, /* the same bytes after a sleep as long as a solve */
    SERVICE_AS_MANY,  /* likewise, with as many asleep at once as give as many answers as lambertd */
    SERVICE_ABREAST,  /* likewise, with everybody asleep at once */
    SERVICE_NGINX,    /* the same bytes as a file */
    SERVICE_SERVERS
} service_server;

enum { SERVICE_CLIENTS = 3, SERVICE_ROUNDS = 5 };
extern const unsigned service_clients[SERVICE_CLIENTS];
extern const char *const service_format_names[SERVICE_FORMATS];
extern const char *const service_server_names[SERVICE_SERVERS];

/* One size of operator, and for how long each thing is measured. */
typedef struct service_size {
    size_t n, k;
    unsigned seconds; /* whole ones: wrk knows no others */
} service_size;

/* Tables, one row after the other, over all sizes. */
typedef struct service_tables {
    table load, solve, loop, codec, ratios;
} service_tables;

typedef struct service_bench {
    const bench_run *run;
    int threads;                /* of the cores that solve */
    char folder[PATH_MAX - 64]; /* temporary: stores, bodies, answers */
    char beside[PATH_MAX - 64]; /* where this program is: others of its build are there */
    char wrk[PATH_MAX];         /* "": not found */
    char nginx[PATH_MAX];       /* "": not found */
    service_tables tables;
} service_bench;

/* --- operators (service_store.c) ------------------------------------------------------------------------ */

/* The largest k up to the wanted one for which memory (run->memory) and disk are enough. */
size_t service_store_fits(const service_bench *b, size_t n, size_t k);

/* Writes b->folder/store.h5, a grey low-rank operator of n x k made up of random numbers, and keeps it; the
 * caller closes it. Its elements are squares in groups of which "lamp" and "desk" are two. */
lam_status service_store_make(const service_bench *b, size_t n, size_t k, lam_operator **op,
                              lam_error *error);

/* The emission that is asked for, [n] in [0, 1), freed by the caller; and as a body, in a file of this name
 * in b->folder. */
lam_status service_emission(const service_bench *b, size_t n, float **E, lam_error *error);
lam_status service_body(const service_bench *b, service_format format, size_t n, const float *E, char **body,
                        size_t *length, lam_error *error);

/* --- solves in process (service_solve.c) ---------------------------------------------------------------- */

typedef struct service_solve {
    double p50, p99; /* s; NaN where several ran at once */
    double per_second;
    size_t count;
} service_solve;

/* For so many seconds: one solve after the other on so many threads; the last answer is in B [n]. */
lam_status service_solve_alone(const service_bench *b, lam_operator *op, int threads, const float *E,
                               float *B, double seconds, service_solve *out, lam_error *error);

/* As many threads at once as there are cores, each solving one vector after the other. */
lam_status service_solve_beside(const service_bench *b, lam_operator *op, const float *E, double seconds,
                                service_solve *out, lam_error *error);

/* --- servers (service_servers.c) ------------------------------------------------------------------------ */

typedef struct service_servers {
    child processes[SERVICE_SERVERS];
    unsigned port[SERVICE_SERVERS];      /* 0: it does not run */
    const char *absent[SERVICE_SERVERS]; /* why it does not; static */
} service_servers;

/* lambertd with b->folder/store.h5 as scene "bench". */
lam_status service_start_lambertd(const service_bench *b, service_servers *s, lam_error *error);

/* A ready server, which serves b->folder/answers/NPY and JSON: at once, or after so many seconds of sleep, in
 * which so many requests are at once; the others wait. Where it is not there that is no error. */
lam_status service_start_ready(const service_bench *b, service_servers *s, service_server which, double sleep,
                               int sleepers, lam_error *error);

/* The one that never sleeps, and nginx. */
lam_status service_start_others(const service_bench *b, service_servers *s, lam_error *error);
void service_stop(service_servers *s);

/* --- load (service_load.c) ------------------------------------------------------------------------------ */

typedef struct service_load {
    double p50, p99;   /* s */
    double per_second; /* answers */
    double requests;   /* answered */
    double failed;     /* refused or broken off */
} service_load;

/* wrk with so many connections for so many seconds, after a short warm-up of one. path and body are those of
 * the server; body_file is its name in b->folder. */
lam_status service_wrk(const service_bench *b, unsigned port, const client_request *request,
                       const char *body_file, unsigned clients, unsigned seconds, service_load *out,
                       lam_error *error);

/* --- one size (service_size.c) -------------------------------------------------------------------------- */

/* Everything of one size into the tables; curves gets the answers a second of NPY by clients, of lambertd and
 * of the sleeping server, NaN where they were not measured. */
typedef struct service_curves {
    double per_second[2][SERVICE_CLIENTS];
} service_curves;

lam_status service_measure(service_bench *b, const service_size *size, service_curves *curves,
                           lam_error *error);

/* --- an optimizer's loop and the codec (service_loop.c) ------------------------------------------------- */

typedef struct service_scene {
    size_t n, k;
    unsigned port;  /* of lambertd */
    double seconds; /* for each loop */
    client_request ask[SERVICE_FORMATS];
} service_scene;

/* What loops come to; NaN where a route does not answer. */
typedef struct service_loops {
    double reduce_per_second;
    double adjoint_of_forward; /* times, in the same format */
    double codec_ms;           /* parse + encode, median, JSON */
} service_loops;

lam_status service_loop(service_bench *b, const service_scene *scene, service_loops *out, lam_error *error);

#endif
