/* The name of a file without its folder and its extension: a scene is called as its store's file is. */
#ifndef LAMBERT_BASE_FILE_STEM_H
#define LAMBERT_BASE_FILE_STEM_H

/* Behind the last '/', up to the last '.' that is not its first letter: "box" of "a.b/box.h5". The caller
 * frees; NULL if memory is short. */
char *file_stem(const char *path);

#endif
