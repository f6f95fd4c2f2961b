/* Whether jansson was refused memory: its parser then says that the text is wrong, or leaves out a byte of
 * it. */
#ifndef LAMBERT_CODEC_JSON_MEMORY_H
#define LAMBERT_CODEC_JSON_MEMORY_H

#include <stdbool.h>

/* Once, before any thread uses jansson. */
void json_memory_install(void);

/* From now on, in this thread. */
void json_memory_watch(void);

/* Whether an allocation of jansson's has failed in this thread since json_memory_watch. */
bool json_memory_failed(void);

#endif
