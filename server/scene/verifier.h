/* The thread that compares with their checksums what scenes have mapped, while they are served already. */
#ifndef LAMBERT_SERVER_SCENE_VERIFIER_H
#define LAMBERT_SERVER_SCENE_VERIFIER_H

#include "server/scene/scene.h"
#include "store/status.h"

#include <stdio.h>

typedef struct verifier verifier;

/* Says a line on `out` for each scene that is as it was written, on `problems` for each that is not. */
lam_status verifier_start(FILE *out, FILE *problems, verifier **made, lam_error *error);

/* Another scene to compare, after those that wait; nothing where there is nothing to. Once for a scene. Any
 * thread. */
void verifier_add(verifier *v, scene *s);

/* Leaves what is not compared yet; NULL is allowed. */
void verifier_stop(verifier *v);

/* The line for a scene that was found to be damaged. */
void verifier_tell(FILE *problems, const scene *s, const lam_error *why);

#endif
