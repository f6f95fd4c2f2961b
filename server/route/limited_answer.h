/* Answers without light below zero (operator/limiter.h): the limiter works on whole groups, so that an answer
 * for selected elements is computed for all elements of their groups, of which the selected ones are taken.
 * Hence an element has the same bits in the whole answer and in a selected one. */
#ifndef LAMBERT_SERVER_ROUTE_LIMITED_ANSWER_H
#define LAMBERT_SERVER_ROUTE_LIMITED_ANSWER_H

#include "server/route/call.h"

/* Zero at the start, and of an answer that is not limited. */
typedef struct limited_solve {
    size_t *limited; /* [n_rhs]: elements that were below zero, of all that were computed */
    uint32_t
        *whole; /* the elements of all groups of the selected ones; NULL: what is asked for is computed */
    size_t n_whole;
    float *room; /* [BATCH_PASS][C][n_whole], of a pass; or NULL */
} limited_solve;

/* Takes memory and sets notes->limited, unless the request asks for the linear map. False with *why. */
bool limited_begin(const call *in, const radiosity_request *request, limited_solve *out, answer_notes *notes,
                   problem *why);
void limited_free(limited_solve *l);

/* Where a pass computes to, and for which elements (NULL: all): out and those of the request, or room. */
float *limited_place(const limited_solve *l, const radiosity_request *request, float *out, size_t *n_selected,
                     const uint32_t **selected);

/* Limits vectors first ... first + count of the answer, which the pass has put where limited_place said, and
 * takes the selected elements into out. E, H0 and W are of the whole request; NULL: none. */
void limited_finish(const scene *s, const limited_solve *l, const radiosity_request *request, size_t first,
                    size_t count, const float *H0, const float *W, float *out, void *work);

/* States the elements that were limited, of all vectors, with the answer, whatever its type. */
void limited_set_header(const limited_solve *l, size_t n_rhs, answer *out);

#endif
