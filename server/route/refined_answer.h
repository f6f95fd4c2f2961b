/* Radiosity requests with a tolerance: refined in double until the error is certified. */
#ifndef LAMBERT_SERVER_ROUTE_REFINED_ANSWER_H
#define LAMBERT_SERVER_ROUTE_REFINED_ANSWER_H

#include "server/route/radiosity_figures.h"
#include "solver/codec/answer.h"
#include "solver/codec/request.h"

/* The state of one request from begin to end. */
typedef struct refined_solve refined_solve;

/* Begins the answer; the certificates in notes are freed by refined_free. Errors: 503. */
bool refined_begin(call *in, const radiosity_request *request, answer_notes *notes, refined_solve **out,
                   problem *why);

/* Refines vectors first ... first + count, at most BATCH_PASS, and appends them to b; passes come in order,
 * and none after one that failed. Errors: 422 if the store keeps no form factors, the tolerance cannot be
 * certified or the store's emitters cannot give the emission; 503 if memory is short or the store's file has
 * changed; 500 if it is damaged; any, once nobody needs the answer (call.is_wanted). */
bool refined_pass(call *in, const radiosity_request *request, size_t first, size_t count, refined_solve *r,
                  answer_notes *notes, buffer *b, problem *why);

/* Writes the end of an answer that has the vectors themselves. */
bool refined_end(const refined_solve *r, const answer_notes *notes, buffer *b, problem *why);

/* The figures of the vectors that were refined, in place of these. */
kept_figures *refined_figures(refined_solve *r);

/* r may be NULL. */
void refined_free(refined_solve *r, answer_notes *notes);

/* Sets the header figures of the answer: the largest certificate and number of iterations. */
void refined_set_headers(const answer_notes *notes, size_t n_rhs, answer *out);

#endif
