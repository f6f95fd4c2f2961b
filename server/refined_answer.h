/* The part of POST .../radiosity that is asked for a tolerance. */
#ifndef LAMBERT_SERVER_REFINED_ANSWER_H
#define LAMBERT_SERVER_REFINED_ANSWER_H

#include "server/codec_answer.h"
#include "server/codec_request.h"
#include "server/routes.h"

/* Refines all that a request asks for and writes it to b; the certificates in notes are freed by
 * refined_answer_free, whatever the outcome. False with *why: 422 where the store keeps no form factors, the
 * tolerance is more than can be certified or the store's emitters cannot give the emission; 503 when memory
 * is short or the store's file has changed; 500 when it is damaged. */
bool refined_answer(call *in, const radiosity_request *request, answer_notes *notes, buffer *b, problem *why);
void refined_answer_free(answer_notes *notes);

/* What goes beside the body: the largest of certificates and iterations. */
void refined_answer_tell(const answer_notes *notes, size_t n_rhs, answer *out);

#endif
