/* The part of POST .../radiosity that is asked for a tolerance. */
#ifndef LAMBERT_SERVER_ROUTE_REFINED_ANSWER_H
#define LAMBERT_SERVER_ROUTE_REFINED_ANSWER_H

#include "server/route/call.h"
#include "solver/codec/answer.h"
#include "solver/codec/request.h"

/* One such request, from begin to end. */
typedef struct refined_solve refined_solve;

/* Begins the answer; the certificates in notes are freed by refined_free. Errors: 503. */
bool refined_begin(call *in, const radiosity_request *request, answer_notes *notes, refined_solve **out,
                   problem *why);

/* Refines vectors first ... first + count, at most BATCH_PASS, and writes them to b, one pass after the other
 * in their order. Once this was false the others are not tried. Errors: 422 where the store keeps no form
 * factors, the tolerance is more than can be certified or the store's emitters cannot give the emission; 503
 * when memory is short or the store's file has changed; 500 when it is damaged. */
bool refined_pass(call *in, const radiosity_request *request, size_t first, size_t count, refined_solve *r,
                  answer_notes *notes, buffer *b, problem *why);

/* The rest of the answer. */
bool refined_end(const call *in, const radiosity_request *request, const refined_solve *r,
                 const answer_notes *notes, buffer *b, problem *why);

/* Either may be empty. */
void refined_free(refined_solve *r, answer_notes *notes);

/* What goes beside the body: the largest of certificates and iterations. */
void refined_answer_tell(const answer_notes *notes, size_t n_rhs, answer *out);

#endif
