/* The headline: one stated error of an answer or of a store, the root of the sum of squares of operator, form
 * factors, mesh, sun and rows of sensors, and how it is told. It must not know where its parts come from
 * (answer_error.h). */
#ifndef LAMBERT_CODEC_HEADLINE_H
#define LAMBERT_CODEC_HEADLINE_H

#include "solver/codec/buffer.h"
#include "solver/operator/stated/answer_error.h"

/* Zeroed: nothing is stated, and nothing is to be said of it. */
typedef struct headline {
    bool known;
    stated_parts parts;
    double share;       /* of the square of parts.rest, the operator's own; negative: it is that of walks */
    const char *advice; /* where it is not known: one line what to do; NULL: say nothing */
} headline;

/* The error in one number: not finite where there is nothing that it could be relative to. */
double headline_stated(const headline *h);

/* False where no light reaches what the parts are of: an error is no share of it then. */
bool headline_has_light(const stated_parts *parts);

/* Above a tenth of the light. */
bool headline_is_coarse(const headline *h);

/* The parts by name; *largest is the place of the largest. */
typedef struct headline_part {
    const char *name;   /* "form_factors", a member of JSON */
    const char *words;  /* "form factors" */
    const char *option; /* of precompute, that lowers it, or, of the sun, of solve */
    double error;
} headline_part;
enum { HEADLINE_PARTS = 5 };
size_t headline_parts(const headline *h, headline_part out[HEADLINE_PARTS], size_t *largest);

/* Takes other parts where their sum is larger, as of another vector of a batch. */
void headline_raise(headline *h, const stated_parts *parts);

/* Appends "stated":0.123,"coarse":true,"advice":"...","parts":{"mesh":0.1,...}, or, of an error that is not
 * known, "stated":null,"advice":"...". False when memory is short. */
bool headline_write(buffer *b, const headline *h);

/* For people, of one that is known: "0.012, most of it by the mesh", and where it is coarse ": coarse;
 * precompute with --mesh-error .05". */
enum { HEADLINE_BYTES = 192 };
void headline_text(const headline *h, char text[HEADLINE_BYTES]);

/* Its parts: "operator 0.001, form factors 0.01, mesh 0.1". */
void headline_text_parts(const headline *h, char text[HEADLINE_BYTES]);

#endif
