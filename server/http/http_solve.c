/* Solves: their way through the queue, their deadlines, and what becomes of those that nobody waits for. */
#include "server/http/http_request.h"
#include "server/scene/map_guard.h"
#include "server/scene/verifier.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>

/* The longest time that Retry-After asks for. */
#define RETRY_MOST 600

/* Seconds in which an answer is sent that is made at the deadline, and those that a request may take to
 * arrive, so that one whose time is over before is told so. */
#define REFUSAL_S 1.0
#define ARRIVAL_S .25

bool http_check_health(request *r) {
    lam_error why;
    bool news;
    if (r->call.scene == NULL || !scene_damaged(r->call.scene, &why, &news)) return true;
    if (news) verifier_report_damage(stderr, r->call.scene, &why);
    answer_refuse(&r->answer, PROBLEM_UNAVAILABLE, "%.200s is out of service: %s", r->call.scene->name,
                  scene_message(r->call.scene, why.message));
    return false;
}

void http_drop_body(request *r) {
    request_memory_give_back_body(&r->memory, r->body.length);
    buffer_free(&r->body);
}

/* The request that a job is part of. */
static request *request_of(batch_job *job) {
    return (request *)(void *)((char *)call_of(job) - offsetof(request, call));
}

static void finish_answer(request *r) {
    http_finish_answer(r, false);
    http_drop_body(r);
}

bool http_read_timeout(request *r) {
    const char *text = http_header(r, "Lambert-Timeout");
    char *end;
    if (text == NULL) return true;
    const double seconds = strtod(text, &end);
    if (end == text || *end != '\0' || !(seconds > 0 && seconds <= 1e9)) {
        answer_refuse(&r->answer, PROBLEM_MALFORMED_HEAD,
                      "Lambert-Timeout is %.40s, must be a number of seconds above 0", text);
        return false;
    }
    r->deadline = fmin(r->deadline, r->start + seconds);
    client_end_by(r->service->connections, r->client, fmax(r->deadline, r->start + ARRIVAL_S));
    return true;
}

/* Makes the answer of a solve that is not done. */
static void refuse_solve(request *r) {
    static const char *const reasons[N_REFUSALS] = {
        [REFUSED_FULL] = "too many solves wait or run (--max-inflight); try again",
        [REFUSED_DEADLINE] = "the answer was not ready in time (--request-timeout, Lambert-Timeout)",
        [REFUSED_MEMORY] = "other requests hold the memory that it needs (--max-request-memory); try again",
        [REFUSED_GONE] = "the client ended its sending before the answer was ready",
        [REFUSED_REFINEMENTS] = "too many refinements wait or run (a quarter of --max-inflight); try again",
        [REFUSED_SHARE] = "all places are taken, and this client has most of them; try again",
        [REFUSED_SHUTDOWN] = "shutting down",
    };
    const double delay = fmin(fmax(ceil(batch_delay(r->service->queue)), 1), RETRY_MOST);
    const bool memory = r->refusal == REFUSED_MEMORY;
    answer_refuse(&r->answer, memory ? PROBLEM_NO_MEMORY : PROBLEM_UNAVAILABLE, "%s", reasons[r->refusal]);
    r->answer.retry_after = (unsigned)delay;
    metrics_refuse(r->service->metrics, r->refusal);
    if (memory) request_ledger_count_full(&r->service->memory);
}

static bool is_wanted(request *r) {
    const double now = clock_seconds();
    if (atomic_load(&r->service->state) == SERVICE_ENDING)
        r->refusal = REFUSED_SHUTDOWN;
    else if (now > r->deadline)
        r->refusal = r->waits_for_memory ? REFUSED_MEMORY : REFUSED_DEADLINE;
    else if (client_is_lost(r->client))
        r->refusal = REFUSED_GONE;
    else
        return true;
    return false;
}

static bool is_solve_wanted(batch_job *job) {
    return is_wanted(request_of(job));
}

/* The same for steps that look in the middle of their work. */
static bool is_call_wanted(call *in) {
    return is_wanted(request_of(&in->job));
}

static void leave_refinements(request *r) {
    if (r->call.refines) atomic_fetch_sub(&r->service->n_refining, 1);
    r->call.refines = false;
}

/* A queue that needs the place, or is abandoned, does not ask. */
static metrics_refusal why_dropped(const request *r) {
    if (r->refusal != REFUSED_NOT) return r->refusal;
    return atomic_load(&r->service->state) == SERVICE_ENDING ? REFUSED_SHUTDOWN : REFUSED_SHARE;
}

static void drop_solve(batch_job *job) {
    request *r = request_of(job);
    request_memory_leave(&r->memory);
    r->refusal = why_dropped(r);
    if (r->call.state != NULL) r->match.route->steps->drop(&r->call);
    leave_refinements(r);
    refuse_solve(r);
    finish_answer(r);
}

/* Seconds, roughly: to read a byte of JSON or of NPY, to read a byte of an operator, to write a number. */
#define PER_JSON_BYTE 20e-9
#define PER_NPY_BYTE .5e-9
#define PER_OPERATOR_BYTE .1e-9
#define PER_NUMBER 60e-9
/* A pass of refinement takes many products; its cost is not known before. */
#define REFINEMENT 1.0

/* The cost of begin: of routes without steps it has all of the work. */
static double cost_to_begin(const call *c, const route *to) {
    const double read = (double)c->length * (c->body_type == MEDIA_NPY ? PER_NPY_BYTE : PER_JSON_BYTE);
    if (to->steps != NULL || c->scene == NULL) return read;
    return read + PER_OPERATOR_BYTE * (double)lam_operator_bytes(c->scene->op) +
           PER_NUMBER * (double)(c->scene->n * c->scene->n_channels);
}

/* The cost of a pass, or of the end if that takes longer. */
static double cost_to_solve(const call *c, const route *to) {
    if (c->cost > 0) return c->cost;
    if (to->steps->cost != NULL) return to->steps->cost(c);
    const double n_vectors = (double)c->job.n_vectors, together = fmin(n_vectors, BATCH_PASS);
    if (c->refines) return REFINEMENT;
    const double pass = PER_OPERATOR_BYTE * (double)lam_operator_bytes(c->scene->op) * (1 + together / 8);
    return fmax(pass, c->accept.type == MEDIA_NPY ? 0 : (double)c->n_written * PER_NUMBER);
}

/* Refinements may have a quarter of the places: they take many times as long as other solves. No client has
 * all of these while others come. */
static bool enter_refinements(request *r) {
    service *s = r->service;
    const size_t most = s->config->max_inflight / 4;
    if (!r->call.refines || atomic_fetch_add(&s->n_refining, 1) < (most > 0 ? most : 1) ||
        batch_make_place(s->queue, r->peer.key, r->call.job.key))
        return true;
    r->refusal = REFUSED_REFINEMENTS;
    return false;
}

/* Called with the lock of the ledger. */
static void wake_solve(request_memory *memory) {
    request *r = (request *)(void *)((char *)memory - offsetof(request, memory));
    batch_unblock(r->service->queue, &r->call.job);
}

/* Has begin called again once there is the memory that the request was short of. */
static void wait_for_memory(request *r) {
    r->waits_for_memory = r->call.job.blocked = true;
    request_memory_wait(&r->memory, wake_solve);
}

/* True if the request found no room, which is no answer while it has time: all but its body is given back,
 * and it waits. */
static bool is_short_of_memory(request *r) {
    if (r->memory.wanted == 0 || r->answer.problem != PROBLEM_NO_MEMORY) return false;
    const size_t wanted = r->memory.wanted;
    answer_free(&r->answer);
    r->answer = (answer){.status = 0};
    (void)request_memory_keep(&r->memory, r->body.length);
    r->memory.wanted = wanted;
    return true;
}

/* After a wait: false, with the answer made, if the request was refused to let others go on. */
static bool has_memory(request *r) {
    r->memory.wanted = 0;
    if (!r->waits_for_memory) {
        r->waited = clock_seconds() - r->submitted;
        return true;
    }
    r->waits_for_memory = false;
    if (!r->memory.refused) return true;
    r->refusal = REFUSED_MEMORY;
    refuse_solve(r);
    finish_answer(r);
    return false;
}

/* Reads the request; true if passes are left. */
static bool read_solve(batch_job *job, batch_workspace *workspace) {
    request *r = request_of(job);
    const route *to = r->match.route;
    r->call.workspace = workspace;
    map_guard_allow();
    if (!has_memory(r)) return false;
    if (to->steps == NULL) {
        to->handle(&r->call, &r->answer);
    } else if (to->steps->begin(&r->call, &r->answer)) {
        if (enter_refinements(r)) {
            job->cost = cost_to_solve(&r->call, to);
            http_drop_body(r); /* its vectors were read */
            (void)request_memory_keep(&r->memory, r->memory.held);
            return true;
        }
        drop_solve(job);
        return false;
    }
    if (is_short_of_memory(r)) {
        wait_for_memory(r);
        return false;
    }
    (void)http_check_health(r); /* an answer from lost pages is wrong */
    finish_answer(r);
    return false;
}

static bool begin_solve(batch_job *job, batch_workspace *workspace) {
    request *r = request_of(job);
    const bool waits = read_solve(job, workspace);
    if (waits)
        r->read = clock_seconds();
    else if (!job->blocked)
        metrics_wait(r->service->metrics, r->waited);
    return waits;
}

static void pass_solve(const batch_part *parts, size_t n_parts, batch_workspace *workspace) {
    const double now = clock_seconds();
    for (size_t p = 0; p < n_parts; p++) {
        const request *r = request_of(parts[p].job);
        if (parts[p].first == 0) metrics_wait(r->service->metrics, r->waited + now - r->read);
    }
    map_guard_allow();
    request_of(parts[0].job)->match.route->steps->pass(parts, n_parts, workspace);
}

static void end_solve(batch_job *job, batch_workspace *workspace) {
    request *r = request_of(job);
    r->call.workspace = workspace;
    leave_refinements(r);
    /* A look in the middle of the work may have ended it. */
    if (r->refusal != REFUSED_NOT) {
        drop_solve(job);
        return;
    }
    r->match.route->steps->end(&r->call, &r->answer);
    /* Large numbers come of large emission, or of arrays that rot in memory or on the medium. */
    if (r->answer.problem == PROBLEM_NOT_IN_ENCODING) catalog_doubt(r->service->catalog, r->call.scene);
    (void)http_check_health(r);
    finish_answer(r);
}

/* A pass over this operator takes about a millisecond; reading a body of this length as NPY takes less. */
#define BRIEF_OPERATOR ((size_t)32 << 20)
#define BRIEF_BODY ((size_t)256 << 10)

static bool is_brief(const call *c) {
    return c->body_type == MEDIA_NPY && c->accept.type == MEDIA_NPY && c->length <= BRIEF_BODY &&
           c->scene != NULL && lam_operator_bytes(c->scene->op) <= BRIEF_OPERATOR;
}

static void finish_solve(batch_job *job) {
    request *r = request_of(job);
    r->answered = true;
    if (r->refusal == REFUSED_DEADLINE || r->refusal == REFUSED_MEMORY)
        client_end_by(r->service->connections, r->client, clock_seconds() + REFUSAL_S);
    MHD_resume_connection(r->connection);
}

static void refuse_wait(request *r, metrics_refusal why) {
    r->refusal = why;
    refuse_solve(r);
    http_drop_body(r);
    (void)request_memory_keep(&r->memory, 0);
}

/* The first time it waits, the second time it goes on. */
static bool begin_wait(batch_job *job, batch_workspace *workspace) {
    request *r = request_of(job);
    (void)workspace;
    if (!r->waits_for_memory) {
        wait_for_memory(r);
        return false;
    }
    r->waits_for_memory = false;
    if (r->memory.refused) refuse_wait(r, REFUSED_MEMORY);
    return false;
}

static void drop_wait(batch_job *job) {
    request *r = request_of(job);
    request_memory_leave(&r->memory);
    r->waits_for_memory = false;
    refuse_wait(r, why_dropped(r));
}

/* The I/O thread goes on with the body, or with the answer if it was refused. */
static void finish_wait(batch_job *job) {
    request *r = request_of(job);
    if (r->refusal != REFUSED_NOT) {
        r->answered = true;
        client_end_by(r->service->connections, r->client, clock_seconds() + REFUSAL_S);
    }
    MHD_resume_connection(r->connection);
}

bool http_wait_for_memory(request *r, size_t wanted) {
    service *s = r->service;
    if (!is_short_of_memory(r)) return false;
    const size_t most = request_ledger_most(&s->memory);
    if (wanted > r->memory.wanted) r->memory.wanted = wanted < most ? wanted : most;
    r->call.job = (batch_job){.begin = begin_wait,
                              .finish = finish_wait,
                              .is_wanted = is_solve_wanted,
                              .drop = drop_wait,
                              .client = r->peer.key,
                              .kind = (unsigned)route_label_count()};
    r->paused = true;
    client_enter(s->connections, r->client, STAGE_SOLVE, 0);
    MHD_suspend_connection(r->connection);
    if (batch_submit(s->queue, &r->call.job)) return true;
    refuse_wait(r, atomic_load(&s->state) == SERVICE_ENDING ? REFUSED_SHUTDOWN : REFUSED_FULL);
    r->answered = true;
    MHD_resume_connection(r->connection);
    return true;
}

void http_solve(request *r) {
    const solve_steps *steps = r->match.route->steps;
    service *s = r->service;
    r->submitted = clock_seconds();
    r->call.is_wanted = is_call_wanted;
    r->call.job = (batch_job){.begin = begin_solve,
                              .pass = steps != NULL ? pass_solve : NULL,
                              .end = end_solve,
                              .finish = finish_solve,
                              .is_wanted = is_solve_wanted,
                              .drop = drop_solve,
                              .key = r->call.scene != NULL ? r->call.scene->op : NULL,
                              .client = r->peer.key,
                              .kind = (unsigned)r->match.label,
                              .cost = cost_to_begin(&r->call, r->match.route),
                              .brief = is_brief(&r->call)};
    client_enter(s->connections, r->client, STAGE_SOLVE, 0);
    /* Suspended before batch_submit, as the solve may finish before that returns. */
    MHD_suspend_connection(r->connection);
    if (batch_submit(s->queue, &r->call.job)) return;
    r->refusal = atomic_load(&s->state) == SERVICE_ENDING ? REFUSED_SHUTDOWN : REFUSED_FULL;
    refuse_solve(r);
    r->answered = true;
    MHD_resume_connection(r->connection);
}
