/* The two ends of the pipe from the process that reads a luminaire's file. Private to solver/luminaire. */
#ifndef LAMBERT_LUMINAIRE_CHILD_H
#define LAMBERT_LUMINAIRE_CHILD_H

#include "solver/luminaire/luminaire.h"
#include "store/confined.h"

/* Sends a luminaire, or an error where result is one; false where the pipe ends. */
bool luminaire_send(int fd, lam_status result, const lam_error *error, const luminaire *l);

/* Runs a child and takes the luminaire that it sends, if it is sound. */
lam_status luminaire_receive(confined_main *run, void *context, const char *path, luminaire *out,
                             lam_error *error);

#endif
