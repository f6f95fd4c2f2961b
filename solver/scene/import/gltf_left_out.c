/* Parts of a glTF that are not read, for people: lights, maps, extensions with the faces that they are about.
 * Runs in the child. */
#include "solver/scene/import/gltf_file.h"

#include <stdio.h>
#include <string.h>

/* Extensions that are read, or have a line of their own where they matter. */
static bool is_read(const char *extension) {
    static const char *const names[] = {"KHR_texture_transform",
                                        "KHR_materials_emissive_strength",
                                        "KHR_materials_transmission",
                                        "KHR_materials_pbrSpecularGlossiness",
                                        "KHR_draco_mesh_compression",
                                        "KHR_mesh_quantization",
                                        "KHR_lights_punctual",
                                        "KHR_texture_basisu",
                                        "EXT_texture_webp",
                                        GLTF_INSTANCES,
                                        GLTF_MESHOPT};
    for (size_t i = 0; i < sizeof names / sizeof *names; i++)
        if (strcmp(extension, names[i]) == 0) return true;
    return strncmp(extension, "KHR_xmp", 7) == 0;
}

/* Triangles of a primitive. */
static size_t faces_of(const gltf_file *g, const json_t *primitive) {
    const double mode = gltf_number(json_object_get(primitive, "mode"), 4);
    const json_t *index = json_object_get(primitive, "indices");
    if (index == NULL) index = json_object_get(json_object_get(primitive, "attributes"), "POSITION");
    const double n = gltf_number(json_object_get(gltf_entry(g, "accessors", index), "count"), 0);
    const double faces = mode == 4 ? n / 3 : mode > 4 ? n - 2 : 0;
    return faces > 0 && faces < 1e15 ? (size_t)faces : 0;
}

/* Faces of all nodes, and in *with those that an extension is about: by their node, mesh or material. */
static size_t count_faces(const gltf_file *g, const char *extension, size_t *with) {
    size_t i, k, all = 0;
    json_t *node, *primitive;
    *with = 0;
    json_array_foreach(json_object_get(g->root, "nodes"), i, node) {
        const json_t *of = gltf_entry(g, "meshes", json_object_get(node, "mesh"));
        const bool whole = gltf_extension(node, extension) != NULL || gltf_extension(of, extension) != NULL;
        json_array_foreach(json_object_get(of, "primitives"), k, primitive) {
            const json_t *material = gltf_entry(g, "materials", json_object_get(primitive, "material"));
            const size_t faces = faces_of(g, primitive);
            all += faces;
            if (whole || gltf_extension(primitive, extension) != NULL ||
                gltf_extension(material, extension) != NULL)
                *with += faces;
        }
    }
    return all;
}

static void tell_extensions(const gltf_file *g) {
    size_t i, written = 0;
    json_t *name;
    char list[1024] = "";
    json_array_foreach(json_object_get(g->root, "extensionsUsed"), i, name) {
        const char *extension = json_string_value(name);
        size_t with;
        if (extension == NULL || is_read(extension) || written + 128 > sizeof list) continue;
        const size_t all = count_faces(g, extension, &with);
        written += (size_t)snprintf(list + written, sizeof list - written, "%s%.60s", written > 0 ? ", " : "",
                                    extension);
        if (with > 0)
            written +=
                (size_t)snprintf(list + written, sizeof list - written, " (of %zu of %zu faces)", with, all);
    }
    if (written > 0) import_warn(&g->s->warnings, "%s: these extensions are left out: %s", g->path, list);
}

static bool any_weight(const json_t *owner) {
    size_t k;
    json_t *weight;
    bool any = false;
    json_array_foreach(json_object_get(owner, "weights"), k, weight) any = any || gltf_number(weight, 0) != 0;
    return any;
}

/* Tells of meshes that bones or shape keys would move. */
static void tell_moved(const gltf_file *g) {
    size_t i, skins = 0, shapes = 0;
    json_t *node;
    json_array_foreach(json_object_get(g->root, "nodes"), i, node) {
        const json_t *of = gltf_entry(g, "meshes", json_object_get(node, "mesh"));
        const bool keyed =
            json_object_get(json_array_get(json_object_get(of, "primitives"), 0), "targets") != NULL;
        skins += of != NULL && json_object_get(node, "skin") != NULL;
        shapes += keyed && any_weight(json_object_get(node, "weights") != NULL ? node : of);
    }
    if (skins > 0)
        import_warn(
            &g->s->warnings,
            "%s: the bones of %zu mesh%s (skins) are left out: each stands as it was modelled; apply the "
            "armature before the export",
            g->path, skins, skins == 1 ? "" : "es");
    if (shapes > 0)
        import_warn(
            &g->s->warnings,
            "%s: the shape keys of %zu mesh%s (targets) are left out: each has its basic shape; apply them "
            "before the export",
            g->path, shapes, shapes == 1 ? "" : "es");
}

/* Tells of primitives that are no faces. */
static void tell_lines(const gltf_file *g) {
    size_t i, k, n = 0;
    json_t *of, *primitive;
    json_array_foreach(json_object_get(g->root, "meshes"), i, of)
        json_array_foreach(json_object_get(of, "primitives"), k, primitive) n +=
        gltf_number(json_object_get(primitive, "mode"), 4) < 4;
    if (n > 0)
        import_warn(&g->s->warnings, "%s: %zu primitive%s of lines or points %s left out: no faces", g->path,
                    n, n == 1 ? "" : "s", n == 1 ? "is" : "are");
}

/* Tells of scenes beside the one that the file names, or its first. */
static void tell_scenes(const gltf_file *g) {
    const json_t *given = json_object_get(g->root, "scene");
    const size_t n = json_array_size(json_object_get(g->root, "scenes"));
    const long long one = json_is_integer(given) ? (long long)json_integer_value(given) : 0;
    if (n > 1)
        import_warn(&g->s->warnings,
                    "%s: of its %zu scenes only scenes[%lld] is read; faces of others may be missing",
                    g->path, n, one);
}

void gltf_tell_left_out(const gltf_file *g) {
    import_warnings *w = &g->s->warnings;
    static const char punctual[] = "KHR_lights_punctual";
    size_t i, lights = 0, bumps = 0, alphas = 0, metals = 0;
    json_t *m;
    json_array_foreach(json_object_get(g->root, "materials"), i, m) {
        const json_t *pbr = json_object_get(m, "pbrMetallicRoughness");
        const char *mode = json_string_value(json_object_get(m, "alphaMode"));
        bumps +=
            json_object_get(m, "normalTexture") != NULL || json_object_get(m, "occlusionTexture") != NULL;
        const double alpha = gltf_number(json_array_get(json_object_get(pbr, "baseColorFactor"), 3), 1);
        const bool blended = mode != NULL && strcmp(mode, "BLEND") == 0;
        alphas += mode != NULL && strcmp(mode, "OPAQUE") != 0 && !(blended && alpha < 1);
        metals += gltf_number(json_object_get(pbr, "metallicFactor"), 0) > 0 ||
                  json_object_get(pbr, "metallicRoughnessTexture") != NULL;
    }
    json_array_foreach(json_object_get(g->root, "nodes"), i, m) lights += gltf_extension(m, punctual) != NULL;
    g->s->punctual = lights;
    if (lights > 0)
        import_warn(w, "%s: its %zu light%s (%s) %s left out; only faces emit", g->path, lights,
                    lights == 1 ? "" : "s", punctual, lights == 1 ? "is" : "are");
    if (alphas > 0)
        import_warn(w, "%s: the alpha of %zu materials (MASK, or in an image) is left out; they are opaque",
                    g->path, alphas);
    if (bumps > 0)
        import_warn(w, "%s: normal and occlusion maps of %zu materials are left out", g->path, bumps);
    if (metals > 0)
        import_warn(w,
                    "%s: %zu materials are metallic or may be; they are diffuse here, of their base colour",
                    g->path, metals);
    tell_moved(g);
    tell_lines(g);
    tell_scenes(g);
    tell_extensions(g);
}
