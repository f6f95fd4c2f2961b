/* The verbs of `lambert`: each gets its own command line (argv[0] is the verb) and returns the exit status: 0
 * success, 1 failure, 2 wrong usage. */
#ifndef LAMBERT_VERBS_VERBS_H
#define LAMBERT_VERBS_VERBS_H

int cmd_generate(int argc, char **argv);
int cmd_precompute(int argc, char **argv);
int cmd_classify(int argc, char **argv);
int cmd_info(int argc, char **argv);
int cmd_sky(int argc, char **argv);
int cmd_luminaire(int argc, char **argv);
int cmd_solve(int argc, char **argv);
int cmd_verify(int argc, char **argv);
int cmd_render(int argc, char **argv);
int cmd_view(int argc, char **argv);
int cmd_bench(int argc, char **argv);

#endif
