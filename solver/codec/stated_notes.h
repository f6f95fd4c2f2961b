/* The error that a store states as answers and reports have it: notes of an answer, and the headline. */
#ifndef LAMBERT_CODEC_STATED_NOTES_H
#define LAMBERT_CODEC_STATED_NOTES_H

#include "solver/codec/answer.h"
#include "solver/codec/headline.h"
#include "solver/operator/stated/stated_errors.h"

/* The elements of an answer, beside those that a store was built for. */
typedef struct answer_scope {
    bool receivers_only; /* nothing but the light of receivers is in the answer */
    bool strange;        /* an element emits that is no source, or a sky, or luminaires where they are none */
    bool sky;            /* a sky alone shines */
} answer_scope;

/* Puts the error of an answer, the elements that it is of, and those that emit, into notes. The error of
 * receivers stands in no other answer, and no error in a strange one. */
void stated_errors_note(const stated_errors *e, answer_scope scope, answer_notes *notes);

/* The headline of a store, of the scene's own lights and luminaires, else of a sky, else of one group that is
 * lit alone, else, of a scene of one group, of light that all elements emit: *light is "lights", "sky",
 * "groups" or "random". Not known where nothing was measured. */
headline stated_headline(const error_report *report, const mesh_figures *mesh, const own_figures *own,
                         const char **light);

#endif
