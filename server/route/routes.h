/* The one table of routes, and what a handler sees of a request and gives back. Knows no HTTP library. */
#ifndef LAMBERT_SERVER_ROUTE_ROUTES_H
#define LAMBERT_SERVER_ROUTE_ROUTES_H

#include "server/route/service.h"
#include "solver/codec/answer.h"
#include "solver/codec/media.h"
#include "solver/codec/problem.h"
#include "solver/codec/request.h"

/* A request that has passed its checks and whose body is there. */
typedef struct call {
    batch_job job; /* of a solving route */
    const service *service;
    const catalog_snapshot *snapshot;
    const scene *scene;         /* of a route with {name}; NULL where a variant is not served yet */
    const char *name;           /* the same, as asked for */
    variant_state variant;      /* when the request came, */
    const problem *variant_why; /* and why it failed */
    media_type body_type;
    media_accept accept;
    const char *body; /* body[length] is NUL */
    size_t length;
    batch_workspace *workspace; /* of a solving route */
    void *state;                /* of a route that solves in steps: its own, from begin to end */
    size_t n_rhs;               /* set by the handler, for the log */
} call;

/* Starts zeroed. body is taken over by whoever sends it. */
typedef struct answer {
    unsigned status;
    const char *type; /* static */
    buffer body;
    char allow[32];       /* of a 405 */
    unsigned retry_after; /* of a 503: seconds; 0: not said */
    bool refined;         /* then, of its vectors, the largest: */
    double certificate;
    size_t iterations;
    char *location; /* of a 202, owned; or NULL */
    bool cacheable; /* the same until something changes: gets an ETag */
} answer;

typedef void route_handler(call *in, answer *out);

/* Answers on the thread of all input and output what takes well below a millisecond and waits for nobody, or
 * returns false with nothing done: the handler's turn then. */
typedef bool route_shortcut(call *in, answer *out);

/* A solve that shares passes over an operator with those of other clients (server/queue/batch.h). begin sets
 * the job's key and n_vectors, or makes the answer, a problem as a rule, and returns false. */
typedef struct solve_steps {
    bool (*begin)(call *in, answer *out);
    void (*pass)(const batch_part *parts, size_t n_parts, batch_workspace *workspace);
    void (*end)(call *in, answer *out);
} solve_steps;

/* Whose job it is. */
static inline call *call_of(batch_job *job) {
    return (call *)(void *)job;
}

typedef struct route {
    const char *method;
    const char *pattern;
    route_handler *handle;    /* NULL: */
    const solve_steps *steps; /* of a solve only */
    enum {
        BODY_NONE,
        BODY_OF_SOLVE
    } body; /* a solve is up to --max-body long and runs on a thread of its own */
    enum { OPEN, WITH_TOKEN } access;
    enum { SERVED, SERVED_OR_BUILT } subject; /* {name} may also be a variant that is not served yet */
    route_shortcut *shortcut;                 /* of a solving route; NULL: none */
} route;

#define ROUTE_NAME_MAX 256

/* Labels for metrics: the patterns, and at last "other". */
size_t route_label_count(void);
const char *route_label(size_t label);

/* What a method and a raw path (escapes not resolved) lead to. */
typedef struct route_match {
    const route *route; /* NULL: the answer is made */
    size_t label;
    bool with_token; /* the path asks for it, whatever the method */
    bool has_name;
    char name[ROUTE_NAME_MAX]; /* of {name}, escapes resolved; "" when it cannot be one */
} route_match;

/* Fills *match, and *out with a 404 or 405 when there is no route. */
void route_find(const char *method, const char *path, route_match *match, answer *out);

/* Fills an answer with a problem. */
void answer_problem(answer *out, const problem *what);
void answer_refuse(answer *out, unsigned status, const char *format, ...)
    __attribute__((format(printf, 3, 4)));

/* Gives JSON back that is in b (taken over), or 503 when it could not be written. */
void answer_json(answer *out, buffer *b, bool written);

/* What a body is read against, and what an answer says beside its numbers: of a route with {name}. */
codec_scene call_codec_scene(const call *in);
answer_notes call_notes(const call *in);

/* Milliseconds on a clock that only goes forward. */
double call_now_ms(void);

route_handler get_healthz, get_readyz, get_metrics, get_scenes, get_scene, post_adjoint, put_reflectance,
    delete_reflectance, delete_scene, get_openapi, not_yet;
route_shortcut quick_radiosity;
extern const solve_steps post_radiosity;

#endif
