/* Files that another file names, such as the images of a scene: they are read from the folder of that file,
 * from folders in it, and from --assets. */
#ifndef LAMBERT_BASE_ASSET_FILES_H
#define LAMBERT_BASE_ASSET_FILES_H

/* Where a file that another one names lies. */
typedef enum asset_place { ASSET_MISSING, ASSET_FOUND, ASSET_OUTSIDE, ASSET_SEVERAL } asset_place;
enum { ASSET_PATH = 4096 };

/* Looks for file, which the file scene names: beside the scene, then in assets, unless that is NULL. A file
 * of another system is found by another spelling where none has its own: backslashes are slashes, a path on a
 * drive (C:\) is its last name, and letters A to Z are a to z where one file alone matches. out: its path.
 * ASSET_OUTSIDE: it exists, but lies neither below the scene's folder nor below assets, links resolved.
 * ASSET_SEVERAL: files differ from it by capitals alone; out has two of their names, "a, b". Cost: where no
 * file has the name, all names of the folders. */
asset_place asset_find(const char *scene, const char *assets, const char *file, char out[ASSET_PATH]);

#endif
