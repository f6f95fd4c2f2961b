/* The other programs of Lambert, which stand beside this one or in PATH. */
#ifndef LAMBERT_VERBS_SIBLING_H
#define LAMBERT_VERBS_SIBLING_H

/* Becomes the program argv[0], a name of at most 63 letters: that beside this program, else that of PATH.
 * Returns only where neither can be run, with errno. */
void sibling_execute(char **argv);

#endif
