/* The threads of OpenMP wait for each other asleep. By default they spin, for milliseconds at the end of
 * each loop, and beside other busy programs take the processors from the threads that they wait for. */
#ifndef LAMBERT_SOLVER_WAITS_H
#define LAMBERT_SOLVER_WAITS_H

/* Sees to it that OMP_WAIT_POLICY is passive in this program, and in those that it starts, unless the
 * environment has that, GOMP_SPINCOUNT or KMP_BLOCKTIME. First in main. It may start the program once more,
 * with these arguments. */
void waits_sleep(char **arguments);

#endif
