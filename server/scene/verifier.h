/* The thread that compares mapped arrays with their checksums while their scenes are served. */
#ifndef LAMBERT_SERVER_SCENE_VERIFIER_H
#define LAMBERT_SERVER_SCENE_VERIFIER_H

#include "server/scene/scene.h"
#include "store/status.h"

#include <stdio.h>

typedef struct verifier verifier;

/* Verification again of scenes that were sound: `list` adds them by verifier_add_again, on the thread of the
 * verifier, `hours` after it had nothing left to do. */
typedef struct verifier_scrub {
    double hours; /* 0: never */
    void (*list)(void *context, verifier *v);
    void *context;
} verifier_scrub;

/* Writes a line to `out` for each scene that was verified, to `problems` for each that is damaged. */
lam_status verifier_start(FILE *out, FILE *problems, const verifier_scrub *scrub, verifier **made,
                          lam_error *error);

/* Queues a scene, once; does nothing if it needs no comparison. Any thread. */
void verifier_add(verifier *v, scene *s);

/* Queues a scene that was compared before; does nothing if nothing of it is mapped, or it is damaged. */
void verifier_add_again(verifier *v, scene *s);

/* Stops the thread, also in the middle of a comparison. NULL is allowed. */
void verifier_stop(verifier *v);

/* Writes the line for a damaged scene. */
void verifier_report_damage(FILE *problems, const scene *s, const lam_error *why);

#endif
