/* The input and output of a handler: the call and the answer. Knows no HTTP library and no route. */
#ifndef LAMBERT_SERVER_ROUTE_CALL_H
#define LAMBERT_SERVER_ROUTE_CALL_H

#include "server/route/content_coding.h"
#include "server/route/request_memory.h"
#include "server/route/service.h"
#include "solver/base/clock.h"
#include "solver/codec/answer_stream.h"
#include "solver/codec/media.h"
#include "solver/codec/problem.h"
#include "solver/codec/request.h"

#include <stddef.h>

typedef struct call call;
typedef struct answer answer;
typedef struct kept_source kept_source;

/* Sets *from to the bytes of an answer that is kept (kept_answer.h); or makes another answer, usually a
 * problem, and returns false. On any thread, at once. */
typedef bool route_keeps(const call *in, kept_source *from, answer *out);

/* A member ?name=value of the target of a request, escapes resolved, as far as they are some. */
typedef struct query_member {
    const char *name, *value;
} query_member;

/* A request that has passed its checks, with its whole body. */
struct call {
    batch_job job; /* of a route with a body */
    const service *service;
    const catalog_snapshot *snapshot;
    const scene *scene;         /* of a route with {name}; NULL for a variant that is not served yet */
    const char *name;           /* its name in the request */
    variant_state variant;      /* when the request came */
    const problem *variant_why; /* of a variant that failed */
    media_type body_type;
    media_accept accept;
    coding_choice accepted;    /* of the answer */
    const query_member *query; /* [n_query], of a route with a query */
    size_t n_query;
    const char *body; /* body[length] is NUL */
    size_t length;
    request_memory *memory;     /* of this request; all that it still holds is given back after its answer */
    batch_workspace *workspace; /* of a route with a body */
    void *state;                /* of a route with solve_steps: its own, from begin to end */
    bool refines;               /* set by begin: to a tolerance */
    double cost;                /* set by begin: seconds of a pass where they are known, else 0 */
    bool (*is_wanted)(struct call *in); /* of a route with a body, from the thread that serves it: false when
                                         * nobody needs the answer any more; what is done may then be left */
    size_t n_rhs;                       /* set by the handler, for the log */
    size_t n_written;                   /* set by begin: numbers of the answer, 0 where they are few */
    char *changed;      /* the variant that the handler made or removed, owned, for the log; or NULL */
    route_keeps *keeps; /* of a route whose answer is kept */
};

/* Bytes that the program holds as long as it runs. */
typedef struct fixed_bytes {
    const unsigned char *plain;
    size_t length;
    const unsigned char *gzip; /* the same, compressed */
    size_t gzip_length;
    uint64_t tag; /* a hash of plain */
} fixed_bytes;

/* Zero at the start. The sender takes the body over. */
struct answer {
    unsigned status;
    problem_kind problem; /* PROBLEM_NONE: it is none */
    const char *type;     /* static */
    buffer body;
    answer_stream *stream; /* in place of body: of an answer of many numbers; or NULL */
    kept_bytes *kept; /* in place of body: a reference to bytes in kept_coding, the coding accepted, whose
                         memory is counted by themselves; or NULL */
    content_coding kept_coding;
    uint64_t tag;             /* of kept, where it is cacheable: what its ETag is made of */
    const fixed_bytes *fixed; /* in place of body; or NULL */
    const char *policy;       /* Content-Security-Policy, static; or NULL */
    char allow[48];           /* of a 405, and of OPTIONS */
    unsigned retry_after;     /* of a 503: seconds; 0: no header */
    bool refined;             /* certificate and iterations are set: the largest of its vectors */
    double certificate;
    size_t iterations;
    bool counts_limited; /* `limited` is set: elements that were limited, of all its vectors */
    size_t limited;
    const char *unit;                      /* of an answer in NPY, static; or NULL */
    char converted[LIGHT_CONVERSION_TEXT]; /* the conversion of its numbers; "": none */
    bool timed;                            /* the times below are set, in ms */
    double parse_ms, solve_ms, encode_ms;
    char *location; /* of a 202, owned; or NULL */
    bool cacheable; /* gets an ETag */
    bool by_type;   /* another Accept has another answer */
};

/* The call that a job is part of. */
static inline call *call_of(batch_job *job) {
    return (call *)(void *)((char *)job - offsetof(call, job));
}

/* Frees what the answer owns. */
void answer_free(answer *out);

/* Makes the answer a problem document. */
void answer_problem(answer *out, const problem *what);
void answer_refuse(answer *out, problem_kind kind, const char *format, ...)
    __attribute__((format(printf, 3, 4)));

/* Makes the answer the JSON in b (taken over), or 503 if it could not be written. */
void answer_json(answer *out, buffer *b, bool written);

/* States the times of the notes with the answer, whatever its type. */
void answer_set_times(answer *out, const answer_notes *notes);

/* States the unit of the notes with an answer in NPY, which has no place for it. */
void answer_set_unit(answer *out, const answer_notes *notes);

/* The scene as a body is read against, and the notes of an answer beside its numbers and its
 * error (scene_note_error), for a route with {name}. */
codec_scene call_codec_scene(const call *in);

/* Bytes that reading the body takes while it is read, beside emission vectors. */
size_t call_parse_bytes(const call *in);

/* malloc of bytes taken of the memory of the request; NULL with *why if there is no room (422, 503) or no
 * memory (503, `what` names it). */
void *call_allocate(const call *in, size_t bytes, const char *what, problem *why);
/* Refuses what needs the store again, which could not be read or has no room: false with *why. A store that
 * cannot be read any more is no fault of the daemon's, and its next version may be right. */
bool call_refuse_store(const scene *s, lam_status status, const lam_error *error, problem *why);

answer_notes call_notes(const call *in);

#endif
