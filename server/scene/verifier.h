/* The thread that compares mapped arrays with their checksums while their scenes are served. */
#ifndef LAMBERT_SERVER_SCENE_VERIFIER_H
#define LAMBERT_SERVER_SCENE_VERIFIER_H

#include "server/scene/scene.h"
#include "store/status.h"

#include <stdio.h>

typedef struct verifier verifier;

/* Writes a line to `out` for each scene that was verified, to `problems` for each that is damaged. */
lam_status verifier_start(FILE *out, FILE *problems, verifier **made, lam_error *error);

/* Queues a scene, once; does nothing if it needs no comparison. Any thread. */
void verifier_add(verifier *v, scene *s);

/* Stops the thread, also in the middle of a comparison. NULL is allowed. */
void verifier_stop(verifier *v);

/* Writes the line for a damaged scene. */
void verifier_report_damage(FILE *problems, const scene *s, const lam_error *why);

#endif
